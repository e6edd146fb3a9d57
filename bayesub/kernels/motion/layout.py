"""Rows of the workspace that depend on the equation set; those of all sets are in :mod:`bayesub.kernels.workspace`."""

from bayesub.kernels.workspace import COEFFICIENTS

from .hydrodynamics import N_COEFFICIENTS, N_CONSTANTS, N_CONTROLS, ORDERED_SPEED

# What each lane adds to the controls of all: those of the set, in SI units; n/k0, m/s; external forces, if any.
CONTROLS = COEFFICIENTS + N_COEFFICIENTS
CONSTANTS = CONTROLS + N_CONTROLS  # the trial speed, and stations of the hull, if the set integrates along it
N_ROWS = CONSTANTS + N_CONSTANTS

# Forces from outside, if there are any, end on a weight (N) and its moments about the origin (N m): its force times x,
# y and z of the point where it acts, as it is with the boat on even keel.
HAS_WEIGHTS = N_CONTROLS > ORDERED_SPEED + 1
WEIGHTS = N_CONTROLS - 4
