"""Hydrodynamic forces of one lane, by bayesub.model.equations.generate: do not edit.

Equations 'remus', horizontal sub-problem, 18 of 44 terms.
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
ADDED_MASS = ((0, 0, 1), (1, 1, 9), (1, 5, 10), (5, 1, 38), (5, 5, 39))


@inline
def sgn(x):
    """Sign of x; zero for zero."""
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@inline
def hydrodynamic_forces(work, i, control, u, v, w, p, q, r):
    """X, Y, Z (N) and K, M, N (N m) of lane `i`, terms without accelerations (model manual, section 4)."""
    dr = control[0] + work[198 * LANES + i]
    X = (
        work[(COEFFICIENTS + 0) * LANES + i] * (u*abs(u))  # Xuu
        + work[(COEFFICIENTS + 2) * LANES + i] * (w*q)  # Xwq
        + work[(COEFFICIENTS + 4) * LANES + i] * (v*r)  # Xvr
        + work[(COEFFICIENTS + 5) * LANES + i] * (r*r)  # Xrr
    )
    Y = (
        work[(COEFFICIENTS + 6) * LANES + i] * (v*abs(v))  # Yvv
        + work[(COEFFICIENTS + 7) * LANES + i] * (r*abs(r))  # Yrr
        + work[(COEFFICIENTS + 8) * LANES + i] * (u*v)  # Yuv
        + work[(COEFFICIENTS + 11) * LANES + i] * (u*r)  # Yur
        + work[(COEFFICIENTS + 14) * LANES + i] * (u*u*dr)  # Yuudr
    )
    Z = 0.0
    K = 0.0
    M = 0.0
    N = (
        work[(COEFFICIENTS + 35) * LANES + i] * (v*abs(v))  # Nvv
        + work[(COEFFICIENTS + 36) * LANES + i] * (r*abs(r))  # Nrr
        + work[(COEFFICIENTS + 37) * LANES + i] * (u*v)  # Nuv
        + work[(COEFFICIENTS + 40) * LANES + i] * (u*r)  # Nur
        + work[(COEFFICIENTS + 43) * LANES + i] * (u*u*dr)  # Nuudr
    )
    return X, Y, Z, K, M, N


@inline
def hydrodynamic_gradient(work, i, control, u, v, w, p, q, r):
    """Derivatives of :func:`hydrodynamic_forces` by u, v, w, p, q and r, six forces each."""
    dr = control[0] + work[198 * LANES + i]
    X_u = (
        work[(COEFFICIENTS + 0) * LANES + i] * (abs(u) + sgn(u)*u)  # Xuu
    )
    X_v = (
        work[(COEFFICIENTS + 4) * LANES + i] * (r)  # Xvr
    )
    X_w = 0.0
    X_p = 0.0
    X_q = 0.0
    X_r = (
        work[(COEFFICIENTS + 4) * LANES + i] * (v)  # Xvr
        + work[(COEFFICIENTS + 5) * LANES + i] * (r + r)  # Xrr
    )
    Y_u = (
        work[(COEFFICIENTS + 8) * LANES + i] * (v)  # Yuv
        + work[(COEFFICIENTS + 11) * LANES + i] * (r)  # Yur
        + work[(COEFFICIENTS + 14) * LANES + i] * (u*dr + u*dr)  # Yuudr
    )
    Y_v = (
        work[(COEFFICIENTS + 6) * LANES + i] * (abs(v) + sgn(v)*v)  # Yvv
        + work[(COEFFICIENTS + 8) * LANES + i] * (u)  # Yuv
    )
    Y_w = 0.0
    Y_p = 0.0
    Y_q = 0.0
    Y_r = (
        work[(COEFFICIENTS + 7) * LANES + i] * (abs(r) + sgn(r)*r)  # Yrr
        + work[(COEFFICIENTS + 11) * LANES + i] * (u)  # Yur
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
        work[(COEFFICIENTS + 37) * LANES + i] * (v)  # Nuv
        + work[(COEFFICIENTS + 40) * LANES + i] * (r)  # Nur
        + work[(COEFFICIENTS + 43) * LANES + i] * (u*dr + u*dr)  # Nuudr
    )
    N_v = (
        work[(COEFFICIENTS + 35) * LANES + i] * (abs(v) + sgn(v)*v)  # Nvv
        + work[(COEFFICIENTS + 37) * LANES + i] * (u)  # Nuv
    )
    N_w = 0.0
    N_p = 0.0
    N_q = 0.0
    N_r = (
        work[(COEFFICIENTS + 36) * LANES + i] * (abs(r) + sgn(r)*r)  # Nrr
        + work[(COEFFICIENTS + 40) * LANES + i] * (u)  # Nur
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
    dr = control[0] + work[198 * LANES + i]
    row[0] = u*abs(u)  # Xuu
    row[1] = udot  # Xudot
    row[2] = 0.0  # Xwq
    row[3] = 0.0  # Xqq
    row[4] = v*r  # Xvr
    row[5] = r*r  # Xrr
    row[6] = v*abs(v)  # Yvv
    row[7] = r*abs(r)  # Yrr
    row[8] = u*v  # Yuv
    row[9] = vdot  # Yvdot
    row[10] = rdot  # Yrdot
    row[11] = u*r  # Yur
    row[12] = 0.0  # Ywp
    row[13] = 0.0  # Ypq
    row[14] = u*u*dr  # Yuudr
    row[15] = 0.0  # Zww
    row[16] = 0.0  # Zqq
    row[17] = 0.0  # Zuw
    row[18] = 0.0  # Zwdot
    row[19] = 0.0  # Zqdot
    row[20] = 0.0  # Zuq
    row[21] = 0.0  # Zvp
    row[22] = 0.0  # Zrp
    row[23] = 0.0  # Zuuds
    row[24] = 0.0  # Kpp
    row[25] = 0.0  # Kpdot
    row[26] = 0.0  # Mww
    row[27] = 0.0  # Mqq
    row[28] = 0.0  # Muw
    row[29] = 0.0  # Mwdot
    row[30] = 0.0  # Mqdot
    row[31] = 0.0  # Muq
    row[32] = 0.0  # Mvp
    row[33] = 0.0  # Mrp
    row[34] = 0.0  # Muuds
    row[35] = v*abs(v)  # Nvv
    row[36] = r*abs(r)  # Nrr
    row[37] = u*v  # Nuv
    row[38] = vdot  # Nvdot
    row[39] = rdot  # Nrdot
    row[40] = u*r  # Nur
    row[41] = 0.0  # Nwp
    row[42] = 0.0  # Npq
    row[43] = u*u*dr  # Nuudr


@inline
def store_control_slopes(slopes, work, i, control, u, v, w, p, q, r):
    """Add the derivatives of the forces by the controls into `slopes` (6, N_CONTROLS)."""
    dr = control[0] + work[198 * LANES + i]
    slopes[1, 0] = (
        work[(COEFFICIENTS + 14) * LANES + i] * (u*u)  # Yuudr
    )
    slopes[5, 0] = (
        work[(COEFFICIENTS + 43) * LANES + i] * (u*u)  # Nuudr
    )
