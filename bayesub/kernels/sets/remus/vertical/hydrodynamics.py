"""Hydrodynamic forces of one lane, by bayesub.model.equations.generate: do not edit.

Equations 'remus', vertical sub-problem, 18 of 44 terms.
"""

from math import sqrt

from bayesub.kernels.jit import inline
from bayesub.kernels.workspace import COEFFICIENTS, LANES

N_COEFFICIENTS = 44
N_CONTROLS = 3
ORDERED_SPEED = 2  # position of n/k0 among the controls
N_CONSTANTS = 1
RIGID_BODY_TERMS = True  # whether the velocity terms of the rigid body are apart from the coefficients

# (axis, acceleration, coefficient) of the added-mass terms, which stand in the mass matrix.
ADDED_MASS = ((0, 0, 1), (2, 2, 18), (2, 4, 19), (4, 2, 29), (4, 4, 30))


@inline
def sgn(x):
    """Sign of x; zero for zero."""
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@inline
def hydrodynamic_forces(work, i, control, u, v, w, p, q, r):
    """X, Y, Z (N) and K, M, N (N m) of lane `i`, terms without accelerations (model manual, section 4)."""
    ds = control[1] + work[199 * LANES + i]
    X = (
        work[(COEFFICIENTS + 0) * LANES + i] * (u*abs(u))  # Xuu
        + work[(COEFFICIENTS + 2) * LANES + i] * (w*q)  # Xwq
        + work[(COEFFICIENTS + 3) * LANES + i] * (q*q)  # Xqq
    )
    Y = 0.0
    Z = (
        work[(COEFFICIENTS + 15) * LANES + i] * (w*abs(w))  # Zww
        + work[(COEFFICIENTS + 16) * LANES + i] * (q*abs(q))  # Zqq
        + work[(COEFFICIENTS + 17) * LANES + i] * (u*w)  # Zuw
        + work[(COEFFICIENTS + 20) * LANES + i] * (u*q)  # Zuq
        + work[(COEFFICIENTS + 23) * LANES + i] * (u*u*ds)  # Zuuds
    )
    K = 0.0
    M = (
        work[(COEFFICIENTS + 26) * LANES + i] * (w*abs(w))  # Mww
        + work[(COEFFICIENTS + 27) * LANES + i] * (q*abs(q))  # Mqq
        + work[(COEFFICIENTS + 28) * LANES + i] * (u*w)  # Muw
        + work[(COEFFICIENTS + 31) * LANES + i] * (u*q)  # Muq
        + work[(COEFFICIENTS + 34) * LANES + i] * (u*u*ds)  # Muuds
    )
    N = 0.0
    return X, Y, Z, K, M, N


@inline
def hydrodynamic_gradient(work, i, control, u, v, w, p, q, r):
    """Derivatives of :func:`hydrodynamic_forces` by u, v, w, p, q and r, six forces each."""
    ds = control[1] + work[199 * LANES + i]
    X_u = (
        work[(COEFFICIENTS + 0) * LANES + i] * (abs(u) + sgn(u)*u)  # Xuu
    )
    X_v = 0.0
    X_w = (
        work[(COEFFICIENTS + 2) * LANES + i] * (q)  # Xwq
    )
    X_p = 0.0
    X_q = (
        work[(COEFFICIENTS + 2) * LANES + i] * (w)  # Xwq
        + work[(COEFFICIENTS + 3) * LANES + i] * (q + q)  # Xqq
    )
    X_r = 0.0
    Y_u = 0.0
    Y_v = 0.0
    Y_w = 0.0
    Y_p = 0.0
    Y_q = 0.0
    Y_r = 0.0
    Z_u = (
        work[(COEFFICIENTS + 17) * LANES + i] * (w)  # Zuw
        + work[(COEFFICIENTS + 20) * LANES + i] * (q)  # Zuq
        + work[(COEFFICIENTS + 23) * LANES + i] * (u*ds + u*ds)  # Zuuds
    )
    Z_v = 0.0
    Z_w = (
        work[(COEFFICIENTS + 15) * LANES + i] * (abs(w) + sgn(w)*w)  # Zww
        + work[(COEFFICIENTS + 17) * LANES + i] * (u)  # Zuw
    )
    Z_p = 0.0
    Z_q = (
        work[(COEFFICIENTS + 16) * LANES + i] * (abs(q) + sgn(q)*q)  # Zqq
        + work[(COEFFICIENTS + 20) * LANES + i] * (u)  # Zuq
    )
    Z_r = 0.0
    K_u = 0.0
    K_v = 0.0
    K_w = 0.0
    K_p = 0.0
    K_q = 0.0
    K_r = 0.0
    M_u = (
        work[(COEFFICIENTS + 28) * LANES + i] * (w)  # Muw
        + work[(COEFFICIENTS + 31) * LANES + i] * (q)  # Muq
        + work[(COEFFICIENTS + 34) * LANES + i] * (u*ds + u*ds)  # Muuds
    )
    M_v = 0.0
    M_w = (
        work[(COEFFICIENTS + 26) * LANES + i] * (abs(w) + sgn(w)*w)  # Mww
        + work[(COEFFICIENTS + 28) * LANES + i] * (u)  # Muw
    )
    M_p = 0.0
    M_q = (
        work[(COEFFICIENTS + 27) * LANES + i] * (abs(q) + sgn(q)*q)  # Mqq
        + work[(COEFFICIENTS + 31) * LANES + i] * (u)  # Muq
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
    ds = control[1] + work[199 * LANES + i]
    row[0] = u*abs(u)  # Xuu
    row[1] = udot  # Xudot
    row[2] = w*q  # Xwq
    row[3] = q*q  # Xqq
    row[4] = 0.0  # Xvr
    row[5] = 0.0  # Xrr
    row[6] = 0.0  # Yvv
    row[7] = 0.0  # Yrr
    row[8] = 0.0  # Yuv
    row[9] = 0.0  # Yvdot
    row[10] = 0.0  # Yrdot
    row[11] = 0.0  # Yur
    row[12] = 0.0  # Ywp
    row[13] = 0.0  # Ypq
    row[14] = 0.0  # Yuudr
    row[15] = w*abs(w)  # Zww
    row[16] = q*abs(q)  # Zqq
    row[17] = u*w  # Zuw
    row[18] = wdot  # Zwdot
    row[19] = qdot  # Zqdot
    row[20] = u*q  # Zuq
    row[21] = 0.0  # Zvp
    row[22] = 0.0  # Zrp
    row[23] = u*u*ds  # Zuuds
    row[24] = 0.0  # Kpp
    row[25] = 0.0  # Kpdot
    row[26] = w*abs(w)  # Mww
    row[27] = q*abs(q)  # Mqq
    row[28] = u*w  # Muw
    row[29] = wdot  # Mwdot
    row[30] = qdot  # Mqdot
    row[31] = u*q  # Muq
    row[32] = 0.0  # Mvp
    row[33] = 0.0  # Mrp
    row[34] = u*u*ds  # Muuds
    row[35] = 0.0  # Nvv
    row[36] = 0.0  # Nrr
    row[37] = 0.0  # Nuv
    row[38] = 0.0  # Nvdot
    row[39] = 0.0  # Nrdot
    row[40] = 0.0  # Nur
    row[41] = 0.0  # Nwp
    row[42] = 0.0  # Npq
    row[43] = 0.0  # Nuudr


@inline
def store_control_slopes(slopes, work, i, control, u, v, w, p, q, r):
    """Add the derivatives of the forces by the controls into `slopes` (6, N_CONTROLS)."""
    ds = control[1] + work[199 * LANES + i]
    slopes[2, 1] = (
        work[(COEFFICIENTS + 23) * LANES + i] * (u*u)  # Zuuds
    )
    slopes[4, 1] = (
        work[(COEFFICIENTS + 34) * LANES + i] * (u*u)  # Muuds
    )
