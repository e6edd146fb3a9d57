"""Hydrodynamic forces of one lane, by bayesub.model.equations.generate: do not edit.

Equations 'glider', vertical sub-problem, 11 of 19 terms.
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
ADDED_MASS = ((0, 0, 3), (2, 2, 11), (4, 4, 15))


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
        + work[(COEFFICIENTS + 4) * LANES + i] * (w*q)  # Xwq
    )
    Y = 0.0
    Z = (
        work[(COEFFICIENTS + 8) * LANES + i] * (V*w)  # Zuw
        + work[(COEFFICIENTS + 9) * LANES + i] * (w*w*w*inverse_V)  # Zwww
        + work[(COEFFICIENTS + 10) * LANES + i] * (u*q)  # Zuq
    )
    K = 0.0
    M = (
        work[(COEFFICIENTS + 13) * LANES + i] * (V*w)  # Muw
        + work[(COEFFICIENTS + 14) * LANES + i] * (u*q)  # Muq
    )
    N = 0.0
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
        + work[(COEFFICIENTS + 4) * LANES + i] * (q)  # Xwq
    )
    X_p = 0.0
    X_q = (
        work[(COEFFICIENTS + 4) * LANES + i] * (w)  # Xwq
    )
    X_r = 0.0
    Y_u = 0.0
    Y_v = 0.0
    Y_w = 0.0
    Y_p = 0.0
    Y_q = 0.0
    Y_r = 0.0
    Z_u = (
        work[(COEFFICIENTS + 8) * LANES + i] * (V_u*w)  # Zuw
        + work[(COEFFICIENTS + 9) * LANES + i] * (-1.0*inverse_V*inverse_V*V_u*w*w*w)  # Zwww
        + work[(COEFFICIENTS + 10) * LANES + i] * (q)  # Zuq
    )
    Z_v = (
        work[(COEFFICIENTS + 8) * LANES + i] * (V_v*w)  # Zuw
        + work[(COEFFICIENTS + 9) * LANES + i] * (-1.0*inverse_V*inverse_V*V_v*w*w*w)  # Zwww
    )
    Z_w = (
        work[(COEFFICIENTS + 8) * LANES + i] * (V_w*w + V)  # Zuw
        + work[(COEFFICIENTS + 9) * LANES + i] * (w*w*inverse_V + w*w*inverse_V + w*w*inverse_V + -1.0*inverse_V*inverse_V*V_w*w*w*w)  # Zwww
    )
    Z_p = 0.0
    Z_q = (
        work[(COEFFICIENTS + 10) * LANES + i] * (u)  # Zuq
    )
    Z_r = 0.0
    K_u = 0.0
    K_v = 0.0
    K_w = 0.0
    K_p = 0.0
    K_q = 0.0
    K_r = 0.0
    M_u = (
        work[(COEFFICIENTS + 13) * LANES + i] * (V_u*w)  # Muw
        + work[(COEFFICIENTS + 14) * LANES + i] * (q)  # Muq
    )
    M_v = (
        work[(COEFFICIENTS + 13) * LANES + i] * (V_v*w)  # Muw
    )
    M_w = (
        work[(COEFFICIENTS + 13) * LANES + i] * (V_w*w + V)  # Muw
    )
    M_p = 0.0
    M_q = (
        work[(COEFFICIENTS + 14) * LANES + i] * (u)  # Muq
    )
    M_r = 0.0
    N_u = 0.0
    N_v = 0.0
    N_w = 0.0
    N_p = 0.0
    N_q = 0.0
    N_r = 0.0
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
    row[1] = w*w  # Xww
    row[2] = 0.0  # Xvv
    row[3] = udot  # Xudot
    row[4] = w*q  # Xwq
    row[5] = 0.0  # Yv
    row[6] = 0.0  # Yur
    row[7] = 0.0  # Yvdot
    row[8] = V*w  # Zuw
    row[9] = w*w*w*inverse_V  # Zwww
    row[10] = u*q  # Zuq
    row[11] = wdot  # Zwdot
    row[12] = 0.0  # Kup
    row[13] = V*w  # Muw
    row[14] = u*q  # Muq
    row[15] = qdot  # Mqdot
    row[16] = 0.0  # Nv
    row[17] = 0.0  # Nur
    row[18] = 0.0  # Nrdot


@inline
def store_control_slopes(slopes, work, i, control, u, v, w, p, q, r):
    """Add the derivatives of the forces by the controls into `slopes` (6, N_CONTROLS)."""
    pass
