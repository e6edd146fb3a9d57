"""Hydrodynamic forces of one lane, by bayesub.model.equations.generate: do not edit.

Equations 'booth', vertical sub-problem, 32 of 101 terms.
"""

from math import sqrt

from bayesub.kernels.jit import inline
from bayesub.kernels.workspace import COEFFICIENTS, LANES

N_COEFFICIENTS = 101
N_CONTROLS = 4
ORDERED_SPEED = 3  # position of n/k0 among the controls
N_CONSTANTS = 1
RIGID_BODY_TERMS = True  # whether the velocity terms of the rigid body are apart from the coefficients

# (axis, acceleration, coefficient) of the added-mass terms, which stand in the mass matrix.
ADDED_MASS = ((0, 0, 6), (2, 2, 38), (2, 4, 44), (4, 2, 72), (4, 4, 78))


@inline
def sgn(x):
    """Sign of x; zero for zero."""
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@inline
def hydrodynamic_forces(work, i, control, u, v, w, p, q, r):
    """X, Y, Z (N) and K, M, N (N m) of lane `i`, terms without accelerations (model manual, section 4)."""
    db = control[1] + work[256 * LANES + i]
    ds = control[2] + work[257 * LANES + i]
    nu = sqrt(v * v + w * w)
    X = (
        work[(COEFFICIENTS + 0) * LANES + i] * (u*u)  # Xuu
        + work[(COEFFICIENTS + 1) * LANES + i] * (v*v)  # Xvv
        + work[(COEFFICIENTS + 2) * LANES + i] * (w*w)  # Xww
        + work[(COEFFICIENTS + 4) * LANES + i] * (u*u*db*db)  # Xuu_dbdb
        + work[(COEFFICIENTS + 5) * LANES + i] * (u*u*ds*ds)  # Xuu_dsds
        + work[(COEFFICIENTS + 8) * LANES + i] * (w*q)  # Xwq
        + work[(COEFFICIENTS + 9) * LANES + i] * (q*q)  # Xqq
    )
    Y = 0.0
    Z = (
        work[(COEFFICIENTS + 30) * LANES + i] * (u*u)  # Zuu
        + work[(COEFFICIENTS + 31) * LANES + i] * (u*w)  # Zuw
        + work[(COEFFICIENTS + 33) * LANES + i] * (u*u*db)  # Zuu_db
        + work[(COEFFICIENTS + 34) * LANES + i] * (u*u*ds)  # Zuu_ds
        + work[(COEFFICIENTS + 35) * LANES + i] * (w*nu)  # Zw_absnu
        + work[(COEFFICIENTS + 36) * LANES + i] * (u*abs(w))  # Zu_absw
        + work[(COEFFICIENTS + 37) * LANES + i] * (abs(w)*nu)  # Zabsw_nu
        + work[(COEFFICIENTS + 39) * LANES + i] * (u*q)  # Zuq
        + work[(COEFFICIENTS + 42) * LANES + i] * (u*abs(q)*ds)  # Zu_absq_ds
        + work[(COEFFICIENTS + 43) * LANES + i] * (sgn(w)*nu*abs(q))  # Zw_absq
    )
    K = 0.0
    M = (
        work[(COEFFICIENTS + 64) * LANES + i] * (u*u)  # Muu
        + work[(COEFFICIENTS + 65) * LANES + i] * (u*w)  # Muw
        + work[(COEFFICIENTS + 67) * LANES + i] * (u*u*db)  # Muu_db
        + work[(COEFFICIENTS + 68) * LANES + i] * (u*u*ds)  # Muu_ds
        + work[(COEFFICIENTS + 69) * LANES + i] * (w*nu)  # Mw_absnu
        + work[(COEFFICIENTS + 70) * LANES + i] * (u*abs(w))  # Mu_absw
        + work[(COEFFICIENTS + 71) * LANES + i] * (abs(w)*nu)  # Mabsw_nu
        + work[(COEFFICIENTS + 73) * LANES + i] * (u*q)  # Muq
        + work[(COEFFICIENTS + 76) * LANES + i] * (u*abs(q)*ds)  # Mu_absq_ds
        + work[(COEFFICIENTS + 77) * LANES + i] * (nu*q)  # Mabsnu_q
        + work[(COEFFICIENTS + 82) * LANES + i] * (q*abs(q))  # Mq_absq
    )
    N = 0.0
    return X, Y, Z, K, M, N


@inline
def hydrodynamic_gradient(work, i, control, u, v, w, p, q, r):
    """Derivatives of :func:`hydrodynamic_forces` by u, v, w, p, q and r, six forces each."""
    dr = control[0] + work[255 * LANES + i]
    db = control[1] + work[256 * LANES + i]
    ds = control[2] + work[257 * LANES + i]
    nu = sqrt(v * v + w * w)
    inverse = 1.0 / nu if nu > 0.0 else 0.0
    nu_v, nu_w = v * inverse, w * inverse
    X_u = (
        work[(COEFFICIENTS + 0) * LANES + i] * (u + u)  # Xuu
        + work[(COEFFICIENTS + 3) * LANES + i] * (u*dr*dr + u*dr*dr)  # Xuu_drdr
        + work[(COEFFICIENTS + 4) * LANES + i] * (u*db*db + u*db*db)  # Xuu_dbdb
        + work[(COEFFICIENTS + 5) * LANES + i] * (u*ds*ds + u*ds*ds)  # Xuu_dsds
    )
    X_v = 0.0
    X_w = (
        work[(COEFFICIENTS + 2) * LANES + i] * (w + w)  # Xww
        + work[(COEFFICIENTS + 8) * LANES + i] * (q)  # Xwq
    )
    X_p = 0.0
    X_q = (
        work[(COEFFICIENTS + 8) * LANES + i] * (w)  # Xwq
        + work[(COEFFICIENTS + 9) * LANES + i] * (q + q)  # Xqq
    )
    X_r = 0.0
    Y_u = 0.0
    Y_v = 0.0
    Y_w = 0.0
    Y_p = 0.0
    Y_q = 0.0
    Y_r = 0.0
    Z_u = (
        work[(COEFFICIENTS + 30) * LANES + i] * (u + u)  # Zuu
        + work[(COEFFICIENTS + 31) * LANES + i] * (w)  # Zuw
        + work[(COEFFICIENTS + 33) * LANES + i] * (u*db + u*db)  # Zuu_db
        + work[(COEFFICIENTS + 34) * LANES + i] * (u*ds + u*ds)  # Zuu_ds
        + work[(COEFFICIENTS + 36) * LANES + i] * (abs(w))  # Zu_absw
        + work[(COEFFICIENTS + 39) * LANES + i] * (q)  # Zuq
        + work[(COEFFICIENTS + 42) * LANES + i] * (abs(q)*ds)  # Zu_absq_ds
    )
    Z_v = (
        work[(COEFFICIENTS + 32) * LANES + i] * (v + v)  # Zvv
        + work[(COEFFICIENTS + 35) * LANES + i] * (nu_v*w)  # Zw_absnu
        + work[(COEFFICIENTS + 37) * LANES + i] * (nu_v*abs(w))  # Zabsw_nu
        + work[(COEFFICIENTS + 43) * LANES + i] * (nu_v*sgn(w)*abs(q))  # Zw_absq
    )
    Z_w = (
        work[(COEFFICIENTS + 31) * LANES + i] * (u)  # Zuw
        + work[(COEFFICIENTS + 35) * LANES + i] * (nu + nu_w*w)  # Zw_absnu
        + work[(COEFFICIENTS + 36) * LANES + i] * (sgn(w)*u)  # Zu_absw
        + work[(COEFFICIENTS + 37) * LANES + i] * (sgn(w)*nu + nu_w*abs(w))  # Zabsw_nu
        + work[(COEFFICIENTS + 43) * LANES + i] * (nu_w*sgn(w)*abs(q))  # Zw_absq
    )
    Z_p = 0.0
    Z_q = (
        work[(COEFFICIENTS + 39) * LANES + i] * (u)  # Zuq
        + work[(COEFFICIENTS + 42) * LANES + i] * (sgn(q)*u*ds)  # Zu_absq_ds
        + work[(COEFFICIENTS + 43) * LANES + i] * (sgn(q)*sgn(w)*nu)  # Zw_absq
    )
    Z_r = 0.0
    K_u = 0.0
    K_v = 0.0
    K_w = 0.0
    K_p = 0.0
    K_q = 0.0
    K_r = 0.0
    M_u = (
        work[(COEFFICIENTS + 64) * LANES + i] * (u + u)  # Muu
        + work[(COEFFICIENTS + 65) * LANES + i] * (w)  # Muw
        + work[(COEFFICIENTS + 67) * LANES + i] * (u*db + u*db)  # Muu_db
        + work[(COEFFICIENTS + 68) * LANES + i] * (u*ds + u*ds)  # Muu_ds
        + work[(COEFFICIENTS + 70) * LANES + i] * (abs(w))  # Mu_absw
        + work[(COEFFICIENTS + 73) * LANES + i] * (q)  # Muq
        + work[(COEFFICIENTS + 76) * LANES + i] * (abs(q)*ds)  # Mu_absq_ds
    )
    M_v = (
        work[(COEFFICIENTS + 66) * LANES + i] * (v + v)  # Mvv
        + work[(COEFFICIENTS + 69) * LANES + i] * (nu_v*w)  # Mw_absnu
        + work[(COEFFICIENTS + 71) * LANES + i] * (nu_v*abs(w))  # Mabsw_nu
        + work[(COEFFICIENTS + 77) * LANES + i] * (nu_v*q)  # Mabsnu_q
    )
    M_w = (
        work[(COEFFICIENTS + 65) * LANES + i] * (u)  # Muw
        + work[(COEFFICIENTS + 69) * LANES + i] * (nu + nu_w*w)  # Mw_absnu
        + work[(COEFFICIENTS + 70) * LANES + i] * (sgn(w)*u)  # Mu_absw
        + work[(COEFFICIENTS + 71) * LANES + i] * (sgn(w)*nu + nu_w*abs(w))  # Mabsw_nu
        + work[(COEFFICIENTS + 77) * LANES + i] * (nu_w*q)  # Mabsnu_q
    )
    M_p = 0.0
    M_q = (
        work[(COEFFICIENTS + 73) * LANES + i] * (u)  # Muq
        + work[(COEFFICIENTS + 76) * LANES + i] * (sgn(q)*u*ds)  # Mu_absq_ds
        + work[(COEFFICIENTS + 77) * LANES + i] * (nu)  # Mabsnu_q
        + work[(COEFFICIENTS + 82) * LANES + i] * (abs(q) + sgn(q)*q)  # Mq_absq
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
    db = control[1] + work[256 * LANES + i]
    ds = control[2] + work[257 * LANES + i]
    nu = sqrt(v * v + w * w)
    row[0] = u*u  # Xuu
    row[1] = 0.0  # Xvv
    row[2] = w*w  # Xww
    row[3] = 0.0  # Xuu_drdr
    row[4] = u*u*db*db  # Xuu_dbdb
    row[5] = u*u*ds*ds  # Xuu_dsds
    row[6] = udot  # Xudot
    row[7] = 0.0  # Xvr
    row[8] = w*q  # Xwq
    row[9] = q*q  # Xqq
    row[10] = 0.0  # Xrr
    row[11] = 0.0  # Xrp
    row[12] = 0.0  # Yuu
    row[13] = 0.0  # Yuv
    row[14] = 0.0  # Yvw
    row[15] = 0.0  # Yv_absnu
    row[16] = 0.0  # Yuu_dr
    row[17] = 0.0  # Yvdot
    row[18] = 0.0  # Yup
    row[19] = 0.0  # Yur
    row[20] = 0.0  # Yvq
    row[21] = 0.0  # Ywp
    row[22] = 0.0  # Ywr
    row[23] = 0.0  # Yv_absr
    row[24] = 0.0  # Yu_absr_dr
    row[25] = 0.0  # Ypdot
    row[26] = 0.0  # Yrdot
    row[27] = 0.0  # Yp_absp
    row[28] = 0.0  # Ypq
    row[29] = 0.0  # Yqr
    row[30] = u*u  # Zuu
    row[31] = u*w  # Zuw
    row[32] = 0.0  # Zvv
    row[33] = u*u*db  # Zuu_db
    row[34] = u*u*ds  # Zuu_ds
    row[35] = w*nu  # Zw_absnu
    row[36] = u*abs(w)  # Zu_absw
    row[37] = abs(w)*nu  # Zabsw_nu
    row[38] = wdot  # Zwdot
    row[39] = u*q  # Zuq
    row[40] = 0.0  # Zvp
    row[41] = 0.0  # Zvr
    row[42] = u*abs(q)*ds  # Zu_absq_ds
    row[43] = sgn(w)*nu*abs(q)  # Zw_absq
    row[44] = qdot  # Zqdot
    row[45] = 0.0  # Zpp
    row[46] = 0.0  # Zrr
    row[47] = 0.0  # Zrp
    row[48] = 0.0  # Kuu
    row[49] = 0.0  # Kuv
    row[50] = 0.0  # Kvw
    row[51] = 0.0  # Kv_absnu
    row[52] = 0.0  # Kuu_dr
    row[53] = 0.0  # Kvdot
    row[54] = 0.0  # Kup
    row[55] = 0.0  # Kur
    row[56] = 0.0  # Kvq
    row[57] = 0.0  # Kwp
    row[58] = 0.0  # Kwr
    row[59] = 0.0  # Kpdot
    row[60] = 0.0  # Krdot
    row[61] = 0.0  # Kqr
    row[62] = 0.0  # Kpq
    row[63] = 0.0  # Kp_absp
    row[64] = u*u  # Muu
    row[65] = u*w  # Muw
    row[66] = 0.0  # Mvv
    row[67] = u*u*db  # Muu_db
    row[68] = u*u*ds  # Muu_ds
    row[69] = w*nu  # Mw_absnu
    row[70] = u*abs(w)  # Mu_absw
    row[71] = abs(w)*nu  # Mabsw_nu
    row[72] = wdot  # Mwdot
    row[73] = u*q  # Muq
    row[74] = 0.0  # Mvp
    row[75] = 0.0  # Mvr
    row[76] = u*abs(q)*ds  # Mu_absq_ds
    row[77] = nu*q  # Mabsnu_q
    row[78] = qdot  # Mqdot
    row[79] = 0.0  # Mpp
    row[80] = 0.0  # Mrr
    row[81] = 0.0  # Mrp
    row[82] = q*abs(q)  # Mq_absq
    row[83] = 0.0  # Nuu
    row[84] = 0.0  # Nuv
    row[85] = 0.0  # Nvw
    row[86] = 0.0  # Nv_absnu
    row[87] = 0.0  # Nuu_dr
    row[88] = 0.0  # Nvdot
    row[89] = 0.0  # Nup
    row[90] = 0.0  # Nur
    row[91] = 0.0  # Nvq
    row[92] = 0.0  # Nwp
    row[93] = 0.0  # Nwr
    row[94] = 0.0  # Nabsnu_r
    row[95] = 0.0  # Nu_absr_dr
    row[96] = 0.0  # Npdot
    row[97] = 0.0  # Nrdot
    row[98] = 0.0  # Npq
    row[99] = 0.0  # Nqr
    row[100] = 0.0  # Nr_absr


@inline
def store_control_slopes(slopes, work, i, control, u, v, w, p, q, r):
    """Add the derivatives of the forces by the controls into `slopes` (6, N_CONTROLS)."""
    db = control[1] + work[256 * LANES + i]
    ds = control[2] + work[257 * LANES + i]
    slopes[0, 1] = (
        work[(COEFFICIENTS + 4) * LANES + i] * (u*u*db + u*u*db)  # Xuu_dbdb
    )
    slopes[2, 1] = (
        work[(COEFFICIENTS + 33) * LANES + i] * (u*u)  # Zuu_db
    )
    slopes[4, 1] = (
        work[(COEFFICIENTS + 67) * LANES + i] * (u*u)  # Muu_db
    )
    slopes[0, 2] = (
        work[(COEFFICIENTS + 5) * LANES + i] * (u*u*ds + u*u*ds)  # Xuu_dsds
    )
    slopes[2, 2] = (
        work[(COEFFICIENTS + 34) * LANES + i] * (u*u)  # Zuu_ds
        + work[(COEFFICIENTS + 42) * LANES + i] * (u*abs(q))  # Zu_absq_ds
    )
    slopes[4, 2] = (
        work[(COEFFICIENTS + 68) * LANES + i] * (u*u)  # Muu_ds
        + work[(COEFFICIENTS + 76) * LANES + i] * (u*abs(q))  # Mu_absq_ds
    )
