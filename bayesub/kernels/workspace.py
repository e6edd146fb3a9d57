"""Rows of the workspace in which a block of lanes is simulated, and entries of the body vector.

This module imports nothing, so that what only names the parts of a vehicle need not load the compiler.
"""

LANES = 8  # coefficient sets of a block
N_STATES = 12
HATS = 3  # forces of an axis that act between two knots: a piece of a motion ends up to a step late
N_COLUMNS = 9  # of the state Jacobian: phi theta psi u v w p q r

# The body vector: everything of a vehicle that is not a hydrodynamic coefficient. SI units.
BODY = (
    "mass", "Ixx", "Iyy", "Izz", "Ixy", "Iyz", "Izx",
    "xG", "yG", "zG", "weight", "buoyancy", "xB", "yB", "zB",
    "b1", "b2", "b3", "b4", "b5", "b6", "b7", "b8", "b9",  # thrust polynomial times (rho/2) l^2
    "zP", "Kn1", "Kn2",  # thrust line, and propeller torque per (n/k0)^2 and (n/k0) u
)  # fmt: skip
N_BODY = len(BODY)
THRUST = BODY[BODY.index("b1") : BODY.index("b9") + 1]
(
    MASS, IXX, IYY, IZZ, IXY, IYZ, IZX, XG, YG, ZG, WEIGHT, BUOYANCY, XB, YB, ZB,
    B1, B2, B3, B4, B5, B6, B7, B8, B9, ZP, KN1, KN2,
) = range(N_BODY)  # fmt: skip

# First row of each group in the workspace. A state takes thirteen rows: with quaternions its attitude is the vector
# part in the rows of the Euler angles and the scalar part in the last row, which Euler angles leave alone.
STATE_ROWS = N_STATES + 1
STATE = 0  # state at the start of the step
STAGE = STATE + STATE_ROWS  # state at which the next stage is evaluated
SUM = STAGE + STATE_ROWS  # weighted sum of the stage derivatives
SLOPE = SUM + STATE_ROWS  # derivative at the start of the step
PREVIOUS = SLOPE + STATE_ROWS  # state and derivative one step back, for the dense output
PREVIOUS_SLOPE = PREVIOUS + STATE_ROWS
OUTPUT = PREVIOUS_SLOPE + STATE_ROWS  # state interpolated to an output time
BODY_ROWS = OUTPUT + STATE_ROWS
INVERSE_MASS = BODY_ROWS + N_BODY  # 6 x 6, row by row
JACOBIAN = INVERSE_MASS + 36  # of the rates by the state, 12 x 9, row by row
ACCELERATIONS = JACOBIAN + N_STATES * N_COLUMNS
MECHANICAL = ACCELERATIONS + 6  # forces that do not come from coefficients
COEFFICIENTS = MECHANICAL + 6  # dimensional; those after it depend on the equation set

# After the coefficients come the controls that each lane adds to those of all, and the constants of the set.
