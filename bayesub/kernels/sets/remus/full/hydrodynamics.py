"""Hydrodynamic forces of one lane, by bayesub.model.equations.generate: do not edit.

Equations 'remus', all degrees of freedom, 44 terms.
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
ADDED_MASS = ((0, 0, 1), (1, 1, 9), (1, 5, 10), (2, 2, 18), (2, 4, 19), (3, 3, 25), (4, 2, 29), (4, 4, 30), (5, 1, 38), (5, 5, 39))


@inline
def sgn(x):
    """Sign of x; zero for zero."""
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@inline
def hydrodynamic_forces(work, i, control, u, v, w, p, q, r):
    """X, Y, Z (N) and K, M, N (N m) of lane `i`, terms without accelerations (model manual, section 4)."""
    dr = control[0] + work[198 * LANES + i]
    ds = control[1] + work[199 * LANES + i]
    X = (
        work[(COEFFICIENTS + 0) * LANES + i] * (u*abs(u))  # Xuu
        + work[(COEFFICIENTS + 2) * LANES + i] * (w*q)  # Xwq
        + work[(COEFFICIENTS + 3) * LANES + i] * (q*q)  # Xqq
        + work[(COEFFICIENTS + 4) * LANES + i] * (v*r)  # Xvr
        + work[(COEFFICIENTS + 5) * LANES + i] * (r*r)  # Xrr
    )
    Y = (
        work[(COEFFICIENTS + 6) * LANES + i] * (v*abs(v))  # Yvv
        + work[(COEFFICIENTS + 7) * LANES + i] * (r*abs(r))  # Yrr
        + work[(COEFFICIENTS + 8) * LANES + i] * (u*v)  # Yuv
        + work[(COEFFICIENTS + 11) * LANES + i] * (u*r)  # Yur
        + work[(COEFFICIENTS + 12) * LANES + i] * (w*p)  # Ywp
        + work[(COEFFICIENTS + 13) * LANES + i] * (p*q)  # Ypq
        + work[(COEFFICIENTS + 14) * LANES + i] * (u*u*dr)  # Yuudr
    )
    Z = (
        work[(COEFFICIENTS + 15) * LANES + i] * (w*abs(w))  # Zww
        + work[(COEFFICIENTS + 16) * LANES + i] * (q*abs(q))  # Zqq
        + work[(COEFFICIENTS + 17) * LANES + i] * (u*w)  # Zuw
        + work[(COEFFICIENTS + 20) * LANES + i] * (u*q)  # Zuq
        + work[(COEFFICIENTS + 21) * LANES + i] * (v*p)  # Zvp
        + work[(COEFFICIENTS + 22) * LANES + i] * (r*p)  # Zrp
        + work[(COEFFICIENTS + 23) * LANES + i] * (u*u*ds)  # Zuuds
    )
    K = (
        work[(COEFFICIENTS + 24) * LANES + i] * (p*abs(p))  # Kpp
    )
    M = (
        work[(COEFFICIENTS + 26) * LANES + i] * (w*abs(w))  # Mww
        + work[(COEFFICIENTS + 27) * LANES + i] * (q*abs(q))  # Mqq
        + work[(COEFFICIENTS + 28) * LANES + i] * (u*w)  # Muw
        + work[(COEFFICIENTS + 31) * LANES + i] * (u*q)  # Muq
        + work[(COEFFICIENTS + 32) * LANES + i] * (v*p)  # Mvp
        + work[(COEFFICIENTS + 33) * LANES + i] * (r*p)  # Mrp
        + work[(COEFFICIENTS + 34) * LANES + i] * (u*u*ds)  # Muuds
    )
    N = (
        work[(COEFFICIENTS + 35) * LANES + i] * (v*abs(v))  # Nvv
        + work[(COEFFICIENTS + 36) * LANES + i] * (r*abs(r))  # Nrr
        + work[(COEFFICIENTS + 37) * LANES + i] * (u*v)  # Nuv
        + work[(COEFFICIENTS + 40) * LANES + i] * (u*r)  # Nur
        + work[(COEFFICIENTS + 41) * LANES + i] * (w*p)  # Nwp
        + work[(COEFFICIENTS + 42) * LANES + i] * (p*q)  # Npq
        + work[(COEFFICIENTS + 43) * LANES + i] * (u*u*dr)  # Nuudr
    )
    return X, Y, Z, K, M, N


@inline
def hydrodynamic_gradient(work, i, control, u, v, w, p, q, r):
    """Derivatives of :func:`hydrodynamic_forces` by u, v, w, p, q and r, six forces each."""
    dr = control[0] + work[198 * LANES + i]
    ds = control[1] + work[199 * LANES + i]
    X_u = (
        work[(COEFFICIENTS + 0) * LANES + i] * (abs(u) + sgn(u)*u)  # Xuu
    )
    X_v = (
        work[(COEFFICIENTS + 4) * LANES + i] * (r)  # Xvr
    )
    X_w = (
        work[(COEFFICIENTS + 2) * LANES + i] * (q)  # Xwq
    )
    X_p = 0.0
    X_q = (
        work[(COEFFICIENTS + 2) * LANES + i] * (w)  # Xwq
        + work[(COEFFICIENTS + 3) * LANES + i] * (q + q)  # Xqq
    )
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
    Y_w = (
        work[(COEFFICIENTS + 12) * LANES + i] * (p)  # Ywp
    )
    Y_p = (
        work[(COEFFICIENTS + 12) * LANES + i] * (w)  # Ywp
        + work[(COEFFICIENTS + 13) * LANES + i] * (q)  # Ypq
    )
    Y_q = (
        work[(COEFFICIENTS + 13) * LANES + i] * (p)  # Ypq
    )
    Y_r = (
        work[(COEFFICIENTS + 7) * LANES + i] * (abs(r) + sgn(r)*r)  # Yrr
        + work[(COEFFICIENTS + 11) * LANES + i] * (u)  # Yur
    )
    Z_u = (
        work[(COEFFICIENTS + 17) * LANES + i] * (w)  # Zuw
        + work[(COEFFICIENTS + 20) * LANES + i] * (q)  # Zuq
        + work[(COEFFICIENTS + 23) * LANES + i] * (u*ds + u*ds)  # Zuuds
    )
    Z_v = (
        work[(COEFFICIENTS + 21) * LANES + i] * (p)  # Zvp
    )
    Z_w = (
        work[(COEFFICIENTS + 15) * LANES + i] * (abs(w) + sgn(w)*w)  # Zww
        + work[(COEFFICIENTS + 17) * LANES + i] * (u)  # Zuw
    )
    Z_p = (
        work[(COEFFICIENTS + 21) * LANES + i] * (v)  # Zvp
        + work[(COEFFICIENTS + 22) * LANES + i] * (r)  # Zrp
    )
    Z_q = (
        work[(COEFFICIENTS + 16) * LANES + i] * (abs(q) + sgn(q)*q)  # Zqq
        + work[(COEFFICIENTS + 20) * LANES + i] * (u)  # Zuq
    )
    Z_r = (
        work[(COEFFICIENTS + 22) * LANES + i] * (p)  # Zrp
    )
    K_u = 0.0
    K_v = 0.0
    K_w = 0.0
    K_p = (
        work[(COEFFICIENTS + 24) * LANES + i] * (abs(p) + sgn(p)*p)  # Kpp
    )
    K_q = 0.0
    K_r = 0.0
    M_u = (
        work[(COEFFICIENTS + 28) * LANES + i] * (w)  # Muw
        + work[(COEFFICIENTS + 31) * LANES + i] * (q)  # Muq
        + work[(COEFFICIENTS + 34) * LANES + i] * (u*ds + u*ds)  # Muuds
    )
    M_v = (
        work[(COEFFICIENTS + 32) * LANES + i] * (p)  # Mvp
    )
    M_w = (
        work[(COEFFICIENTS + 26) * LANES + i] * (abs(w) + sgn(w)*w)  # Mww
        + work[(COEFFICIENTS + 28) * LANES + i] * (u)  # Muw
    )
    M_p = (
        work[(COEFFICIENTS + 32) * LANES + i] * (v)  # Mvp
        + work[(COEFFICIENTS + 33) * LANES + i] * (r)  # Mrp
    )
    M_q = (
        work[(COEFFICIENTS + 27) * LANES + i] * (abs(q) + sgn(q)*q)  # Mqq
        + work[(COEFFICIENTS + 31) * LANES + i] * (u)  # Muq
    )
    M_r = (
        work[(COEFFICIENTS + 33) * LANES + i] * (p)  # Mrp
    )
    N_u = (
        work[(COEFFICIENTS + 37) * LANES + i] * (v)  # Nuv
        + work[(COEFFICIENTS + 40) * LANES + i] * (r)  # Nur
        + work[(COEFFICIENTS + 43) * LANES + i] * (u*dr + u*dr)  # Nuudr
    )
    N_v = (
        work[(COEFFICIENTS + 35) * LANES + i] * (abs(v) + sgn(v)*v)  # Nvv
        + work[(COEFFICIENTS + 37) * LANES + i] * (u)  # Nuv
    )
    N_w = (
        work[(COEFFICIENTS + 41) * LANES + i] * (p)  # Nwp
    )
    N_p = (
        work[(COEFFICIENTS + 41) * LANES + i] * (w)  # Nwp
        + work[(COEFFICIENTS + 42) * LANES + i] * (q)  # Npq
    )
    N_q = (
        work[(COEFFICIENTS + 42) * LANES + i] * (p)  # Npq
    )
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
    ds = control[1] + work[199 * LANES + i]
    row[0] = u*abs(u)  # Xuu
    row[1] = udot  # Xudot
    row[2] = w*q  # Xwq
    row[3] = q*q  # Xqq
    row[4] = v*r  # Xvr
    row[5] = r*r  # Xrr
    row[6] = v*abs(v)  # Yvv
    row[7] = r*abs(r)  # Yrr
    row[8] = u*v  # Yuv
    row[9] = vdot  # Yvdot
    row[10] = rdot  # Yrdot
    row[11] = u*r  # Yur
    row[12] = w*p  # Ywp
    row[13] = p*q  # Ypq
    row[14] = u*u*dr  # Yuudr
    row[15] = w*abs(w)  # Zww
    row[16] = q*abs(q)  # Zqq
    row[17] = u*w  # Zuw
    row[18] = wdot  # Zwdot
    row[19] = qdot  # Zqdot
    row[20] = u*q  # Zuq
    row[21] = v*p  # Zvp
    row[22] = r*p  # Zrp
    row[23] = u*u*ds  # Zuuds
    row[24] = p*abs(p)  # Kpp
    row[25] = pdot  # Kpdot
    row[26] = w*abs(w)  # Mww
    row[27] = q*abs(q)  # Mqq
    row[28] = u*w  # Muw
    row[29] = wdot  # Mwdot
    row[30] = qdot  # Mqdot
    row[31] = u*q  # Muq
    row[32] = v*p  # Mvp
    row[33] = r*p  # Mrp
    row[34] = u*u*ds  # Muuds
    row[35] = v*abs(v)  # Nvv
    row[36] = r*abs(r)  # Nrr
    row[37] = u*v  # Nuv
    row[38] = vdot  # Nvdot
    row[39] = rdot  # Nrdot
    row[40] = u*r  # Nur
    row[41] = w*p  # Nwp
    row[42] = p*q  # Npq
    row[43] = u*u*dr  # Nuudr


@inline
def store_control_slopes(slopes, work, i, control, u, v, w, p, q, r):
    """Add the derivatives of the forces by the controls into `slopes` (6, N_CONTROLS)."""
    dr = control[0] + work[198 * LANES + i]
    ds = control[1] + work[199 * LANES + i]
    slopes[1, 0] = (
        work[(COEFFICIENTS + 14) * LANES + i] * (u*u)  # Yuudr
    )
    slopes[5, 0] = (
        work[(COEFFICIENTS + 43) * LANES + i] * (u*u)  # Nuudr
    )
    slopes[2, 1] = (
        work[(COEFFICIENTS + 23) * LANES + i] * (u*u)  # Zuuds
    )
    slopes[4, 1] = (
        work[(COEFFICIENTS + 34) * LANES + i] * (u*u)  # Muuds
    )
