"""Hydrodynamic forces of one lane, by bayesub.model.equations.generate: do not edit.

Equations 'glider', horizontal sub-problem, 9 of 19 terms.
"""

from math import sqrt

from bayesub.kernels.jit import inline
from bayesub.kernels.workspace import COEFFICIENTS, LANES

N_COEFFICIENTS = 19
N_CONTROLS = 1
ORDERED_SPEED = 0  # position of n/k0 among the controls
N_CONSTANTS = 1
RIGID_BODY_TERMS = True  # whether the velocity terms of the rigid body are apart from the coefficients

# (axis, acceleration, coefficient) of the added-mass terms, which stand in the mass matrix.
ADDED_MASS = ((0, 0, 3), (1, 1, 7), (5, 5, 18))


@inline
def sgn(x):
    """Sign of x; zero for zero."""
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@inline
def hydrodynamic_forces(work, i, control, u, v, w, p, q, r):
    """X, Y, Z (N) and K, M, N (N m) of lane `i`, terms without accelerations (model manual, section 4)."""
    V = sqrt(u * u + v * v + w * w)
    inverse_V = 1.0 / V if V > 0.0 else 0.0
    X = (
        work[(COEFFICIENTS + 0) * LANES + i] * (u*V)  # Xuu
        + work[(COEFFICIENTS + 1) * LANES + i] * (w*w)  # Xww
        + work[(COEFFICIENTS + 2) * LANES + i] * (v*v)  # Xvv
    )
    Y = (
        work[(COEFFICIENTS + 5) * LANES + i] * (V*v)  # Yv
        + work[(COEFFICIENTS + 6) * LANES + i] * (u*r)  # Yur
    )
    Z = 0.0
    K = 0.0
    M = 0.0
    N = (
        work[(COEFFICIENTS + 16) * LANES + i] * (V*v)  # Nv
        + work[(COEFFICIENTS + 17) * LANES + i] * (u*r)  # Nur
    )
    return X, Y, Z, K, M, N


@inline
def hydrodynamic_gradient(work, i, control, u, v, w, p, q, r):
    """Derivatives of :func:`hydrodynamic_forces` by u, v, w, p, q and r, six forces each."""
    V = sqrt(u * u + v * v + w * w)
    inverse_V = 1.0 / V if V > 0.0 else 0.0
    V_u, V_v, V_w = u * inverse_V, v * inverse_V, w * inverse_V
    X_u = (
        work[(COEFFICIENTS + 0) * LANES + i] * (V + V_u*u)  # Xuu
    )
    X_v = (
        work[(COEFFICIENTS + 0) * LANES + i] * (V_v*u)  # Xuu
        + work[(COEFFICIENTS + 2) * LANES + i] * (v + v)  # Xvv
    )
    X_w = (
        work[(COEFFICIENTS + 0) * LANES + i] * (V_w*u)  # Xuu
        + work[(COEFFICIENTS + 1) * LANES + i] * (w + w)  # Xww
    )
    X_p = 0.0
    X_q = 0.0
    X_r = 0.0
    Y_u = (
        work[(COEFFICIENTS + 5) * LANES + i] * (V_u*v)  # Yv
        + work[(COEFFICIENTS + 6) * LANES + i] * (r)  # Yur
    )
    Y_v = (
        work[(COEFFICIENTS + 5) * LANES + i] * (V_v*v + V)  # Yv
    )
    Y_w = (
        work[(COEFFICIENTS + 5) * LANES + i] * (V_w*v)  # Yv
    )
    Y_p = 0.0
    Y_q = 0.0
    Y_r = (
        work[(COEFFICIENTS + 6) * LANES + i] * (u)  # Yur
    )
    Z_u = 0.0
    Z_v = 0.0
    Z_w = 0.0
    Z_p = 0.0
    Z_q = 0.0
    Z_r = 0.0
    K_u = 0.0
    K_v = 0.0
    K_w = 0.0
    K_p = 0.0
    K_q = 0.0
    K_r = 0.0
    M_u = 0.0
    M_v = 0.0
    M_w = 0.0
    M_p = 0.0
    M_q = 0.0
    M_r = 0.0
    N_u = (
        work[(COEFFICIENTS + 16) * LANES + i] * (V_u*v)  # Nv
        + work[(COEFFICIENTS + 17) * LANES + i] * (r)  # Nur
    )
    N_v = (
        work[(COEFFICIENTS + 16) * LANES + i] * (V_v*v + V)  # Nv
    )
    N_w = (
        work[(COEFFICIENTS + 16) * LANES + i] * (V_w*v)  # Nv
    )
    N_p = 0.0
    N_q = 0.0
    N_r = (
        work[(COEFFICIENTS + 17) * LANES + i] * (u)  # Nur
    )
    return (
        (X_u, Y_u, Z_u, K_u, M_u, N_u),
        (X_v, Y_v, Z_v, K_v, M_v, N_v),
        (X_w, Y_w, Z_w, K_w, M_w, N_w),
        (X_p, Y_p, Z_p, K_p, M_p, N_p),
        (X_q, Y_q, Z_q, K_q, M_q, N_q),
        (X_r, Y_r, Z_r, K_r, M_r, N_r),
    )


@inline
def store_regressors(row, work, i, control, u, v, w, p, q, r, udot, vdot, wdot, pdot, qdot, rdot):
    """Write the regressors of the terms into `row`; zero for those that play no part."""
    V = sqrt(u * u + v * v + w * w)
    inverse_V = 1.0 / V if V > 0.0 else 0.0
    row[0] = u*V  # Xuu
    row[1] = 0.0  # Xww
    row[2] = v*v  # Xvv
    row[3] = udot  # Xudot
    row[4] = 0.0  # Xwq
    row[5] = V*v  # Yv
    row[6] = u*r  # Yur
    row[7] = vdot  # Yvdot
    row[8] = 0.0  # Zuw
    row[9] = 0.0  # Zwww
    row[10] = 0.0  # Zuq
    row[11] = 0.0  # Zwdot
    row[12] = 0.0  # Kup
    row[13] = 0.0  # Muw
    row[14] = 0.0  # Muq
    row[15] = 0.0  # Mqdot
    row[16] = V*v  # Nv
    row[17] = u*r  # Nur
    row[18] = rdot  # Nrdot


@inline
def store_control_slopes(slopes, work, i, control, u, v, w, p, q, r):
    """Add the derivatives of the forces by the controls into `slopes` (6, N_CONTROLS)."""
    pass
