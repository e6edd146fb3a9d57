"""Hydrodynamic forces of one lane, by bayesub.model.equations.generate: do not edit.

Equations 'booth', horizontal sub-problem, 25 of 101 terms.
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
ADDED_MASS = ((0, 0, 6), (1, 1, 17), (1, 5, 26), (5, 1, 88), (5, 5, 97))


@inline
def sgn(x):
    """Sign of x; zero for zero."""
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@inline
def hydrodynamic_forces(work, i, control, u, v, w, p, q, r):
    """X, Y, Z (N) and K, M, N (N m) of lane `i`, terms without accelerations (model manual, section 4)."""
    dr = control[0] + work[255 * LANES + i]
    nu = sqrt(v * v + w * w)
    X = (
        work[(COEFFICIENTS + 0) * LANES + i] * (u*u)  # Xuu
        + work[(COEFFICIENTS + 1) * LANES + i] * (v*v)  # Xvv
        + work[(COEFFICIENTS + 3) * LANES + i] * (u*u*dr*dr)  # Xuu_drdr
        + work[(COEFFICIENTS + 7) * LANES + i] * (v*r)  # Xvr
        + work[(COEFFICIENTS + 10) * LANES + i] * (r*r)  # Xrr
    )
    Y = (
        work[(COEFFICIENTS + 12) * LANES + i] * (u*u)  # Yuu
        + work[(COEFFICIENTS + 13) * LANES + i] * (u*v)  # Yuv
        + work[(COEFFICIENTS + 15) * LANES + i] * (v*nu)  # Yv_absnu
        + work[(COEFFICIENTS + 16) * LANES + i] * (u*u*dr)  # Yuu_dr
        + work[(COEFFICIENTS + 19) * LANES + i] * (u*r)  # Yur
        + work[(COEFFICIENTS + 23) * LANES + i] * (sgn(v)*nu*abs(r))  # Yv_absr
        + work[(COEFFICIENTS + 24) * LANES + i] * (u*abs(r)*dr)  # Yu_absr_dr
    )
    Z = 0.0
    K = 0.0
    M = 0.0
    N = (
        work[(COEFFICIENTS + 83) * LANES + i] * (u*u)  # Nuu
        + work[(COEFFICIENTS + 84) * LANES + i] * (u*v)  # Nuv
        + work[(COEFFICIENTS + 86) * LANES + i] * (v*nu)  # Nv_absnu
        + work[(COEFFICIENTS + 87) * LANES + i] * (u*u*dr)  # Nuu_dr
        + work[(COEFFICIENTS + 90) * LANES + i] * (u*r)  # Nur
        + work[(COEFFICIENTS + 94) * LANES + i] * (nu*r)  # Nabsnu_r
        + work[(COEFFICIENTS + 95) * LANES + i] * (u*abs(r)*dr)  # Nu_absr_dr
        + work[(COEFFICIENTS + 100) * LANES + i] * (r*abs(r))  # Nr_absr
    )
    return X, Y, Z, K, M, N


@inline
def hydrodynamic_gradient(work, i, control, u, v, w, p, q, r):
    """Derivatives of :func:`hydrodynamic_forces` by u, v, w, p, q and r, six forces each."""
    dr = control[0] + work[255 * LANES + i]
    nu = sqrt(v * v + w * w)
    inverse = 1.0 / nu if nu > 0.0 else 0.0
    nu_v, nu_w = v * inverse, w * inverse
    X_u = (
        work[(COEFFICIENTS + 0) * LANES + i] * (u + u)  # Xuu
        + work[(COEFFICIENTS + 3) * LANES + i] * (u*dr*dr + u*dr*dr)  # Xuu_drdr
    )
    X_v = (
        work[(COEFFICIENTS + 1) * LANES + i] * (v + v)  # Xvv
        + work[(COEFFICIENTS + 7) * LANES + i] * (r)  # Xvr
    )
    X_w = 0.0
    X_p = 0.0
    X_q = 0.0
    X_r = (
        work[(COEFFICIENTS + 7) * LANES + i] * (v)  # Xvr
        + work[(COEFFICIENTS + 10) * LANES + i] * (r + r)  # Xrr
    )
    Y_u = (
        work[(COEFFICIENTS + 12) * LANES + i] * (u + u)  # Yuu
        + work[(COEFFICIENTS + 13) * LANES + i] * (v)  # Yuv
        + work[(COEFFICIENTS + 16) * LANES + i] * (u*dr + u*dr)  # Yuu_dr
        + work[(COEFFICIENTS + 19) * LANES + i] * (r)  # Yur
        + work[(COEFFICIENTS + 24) * LANES + i] * (abs(r)*dr)  # Yu_absr_dr
    )
    Y_v = (
        work[(COEFFICIENTS + 13) * LANES + i] * (u)  # Yuv
        + work[(COEFFICIENTS + 14) * LANES + i] * (w)  # Yvw
        + work[(COEFFICIENTS + 15) * LANES + i] * (nu + nu_v*v)  # Yv_absnu
        + work[(COEFFICIENTS + 23) * LANES + i] * (nu_v*sgn(v)*abs(r))  # Yv_absr
    )
    Y_w = (
        work[(COEFFICIENTS + 14) * LANES + i] * (v)  # Yvw
        + work[(COEFFICIENTS + 15) * LANES + i] * (nu_w*v)  # Yv_absnu
        + work[(COEFFICIENTS + 23) * LANES + i] * (nu_w*sgn(v)*abs(r))  # Yv_absr
    )
    Y_p = 0.0
    Y_q = 0.0
    Y_r = (
        work[(COEFFICIENTS + 19) * LANES + i] * (u)  # Yur
        + work[(COEFFICIENTS + 22) * LANES + i] * (w)  # Ywr
        + work[(COEFFICIENTS + 23) * LANES + i] * (sgn(r)*sgn(v)*nu)  # Yv_absr
        + work[(COEFFICIENTS + 24) * LANES + i] * (sgn(r)*u*dr)  # Yu_absr_dr
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
        work[(COEFFICIENTS + 83) * LANES + i] * (u + u)  # Nuu
        + work[(COEFFICIENTS + 84) * LANES + i] * (v)  # Nuv
        + work[(COEFFICIENTS + 87) * LANES + i] * (u*dr + u*dr)  # Nuu_dr
        + work[(COEFFICIENTS + 90) * LANES + i] * (r)  # Nur
        + work[(COEFFICIENTS + 95) * LANES + i] * (abs(r)*dr)  # Nu_absr_dr
    )
    N_v = (
        work[(COEFFICIENTS + 84) * LANES + i] * (u)  # Nuv
        + work[(COEFFICIENTS + 85) * LANES + i] * (w)  # Nvw
        + work[(COEFFICIENTS + 86) * LANES + i] * (nu + nu_v*v)  # Nv_absnu
        + work[(COEFFICIENTS + 94) * LANES + i] * (nu_v*r)  # Nabsnu_r
    )
    N_w = (
        work[(COEFFICIENTS + 85) * LANES + i] * (v)  # Nvw
        + work[(COEFFICIENTS + 86) * LANES + i] * (nu_w*v)  # Nv_absnu
        + work[(COEFFICIENTS + 94) * LANES + i] * (nu_w*r)  # Nabsnu_r
    )
    N_p = 0.0
    N_q = 0.0
    N_r = (
        work[(COEFFICIENTS + 90) * LANES + i] * (u)  # Nur
        + work[(COEFFICIENTS + 93) * LANES + i] * (w)  # Nwr
        + work[(COEFFICIENTS + 94) * LANES + i] * (nu)  # Nabsnu_r
        + work[(COEFFICIENTS + 95) * LANES + i] * (sgn(r)*u*dr)  # Nu_absr_dr
        + work[(COEFFICIENTS + 100) * LANES + i] * (abs(r) + sgn(r)*r)  # Nr_absr
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
    dr = control[0] + work[255 * LANES + i]
    nu = sqrt(v * v + w * w)
    row[0] = u*u  # Xuu
    row[1] = v*v  # Xvv
    row[2] = 0.0  # Xww
    row[3] = u*u*dr*dr  # Xuu_drdr
    row[4] = 0.0  # Xuu_dbdb
    row[5] = 0.0  # Xuu_dsds
    row[6] = udot  # Xudot
    row[7] = v*r  # Xvr
    row[8] = 0.0  # Xwq
    row[9] = 0.0  # Xqq
    row[10] = r*r  # Xrr
    row[11] = 0.0  # Xrp
    row[12] = u*u  # Yuu
    row[13] = u*v  # Yuv
    row[14] = 0.0  # Yvw
    row[15] = v*nu  # Yv_absnu
    row[16] = u*u*dr  # Yuu_dr
    row[17] = vdot  # Yvdot
    row[18] = 0.0  # Yup
    row[19] = u*r  # Yur
    row[20] = 0.0  # Yvq
    row[21] = 0.0  # Ywp
    row[22] = 0.0  # Ywr
    row[23] = sgn(v)*nu*abs(r)  # Yv_absr
    row[24] = u*abs(r)*dr  # Yu_absr_dr
    row[25] = 0.0  # Ypdot
    row[26] = rdot  # Yrdot
    row[27] = 0.0  # Yp_absp
    row[28] = 0.0  # Ypq
    row[29] = 0.0  # Yqr
    row[30] = 0.0  # Zuu
    row[31] = 0.0  # Zuw
    row[32] = 0.0  # Zvv
    row[33] = 0.0  # Zuu_db
    row[34] = 0.0  # Zuu_ds
    row[35] = 0.0  # Zw_absnu
    row[36] = 0.0  # Zu_absw
    row[37] = 0.0  # Zabsw_nu
    row[38] = 0.0  # Zwdot
    row[39] = 0.0  # Zuq
    row[40] = 0.0  # Zvp
    row[41] = 0.0  # Zvr
    row[42] = 0.0  # Zu_absq_ds
    row[43] = 0.0  # Zw_absq
    row[44] = 0.0  # Zqdot
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
    row[64] = 0.0  # Muu
    row[65] = 0.0  # Muw
    row[66] = 0.0  # Mvv
    row[67] = 0.0  # Muu_db
    row[68] = 0.0  # Muu_ds
    row[69] = 0.0  # Mw_absnu
    row[70] = 0.0  # Mu_absw
    row[71] = 0.0  # Mabsw_nu
    row[72] = 0.0  # Mwdot
    row[73] = 0.0  # Muq
    row[74] = 0.0  # Mvp
    row[75] = 0.0  # Mvr
    row[76] = 0.0  # Mu_absq_ds
    row[77] = 0.0  # Mabsnu_q
    row[78] = 0.0  # Mqdot
    row[79] = 0.0  # Mpp
    row[80] = 0.0  # Mrr
    row[81] = 0.0  # Mrp
    row[82] = 0.0  # Mq_absq
    row[83] = u*u  # Nuu
    row[84] = u*v  # Nuv
    row[85] = 0.0  # Nvw
    row[86] = v*nu  # Nv_absnu
    row[87] = u*u*dr  # Nuu_dr
    row[88] = vdot  # Nvdot
    row[89] = 0.0  # Nup
    row[90] = u*r  # Nur
    row[91] = 0.0  # Nvq
    row[92] = 0.0  # Nwp
    row[93] = 0.0  # Nwr
    row[94] = nu*r  # Nabsnu_r
    row[95] = u*abs(r)*dr  # Nu_absr_dr
    row[96] = 0.0  # Npdot
    row[97] = rdot  # Nrdot
    row[98] = 0.0  # Npq
    row[99] = 0.0  # Nqr
    row[100] = r*abs(r)  # Nr_absr


@inline
def store_control_slopes(slopes, work, i, control, u, v, w, p, q, r):
    """Add the derivatives of the forces by the controls into `slopes` (6, N_CONTROLS)."""
    dr = control[0] + work[255 * LANES + i]
    slopes[0, 0] = (
        work[(COEFFICIENTS + 3) * LANES + i] * (u*u*dr + u*u*dr)  # Xuu_drdr
    )
    slopes[1, 0] = (
        work[(COEFFICIENTS + 16) * LANES + i] * (u*u)  # Yuu_dr
        + work[(COEFFICIENTS + 24) * LANES + i] * (u*abs(r))  # Yu_absr_dr
    )
    slopes[5, 0] = (
        work[(COEFFICIENTS + 87) * LANES + i] * (u*u)  # Nuu_dr
        + work[(COEFFICIENTS + 95) * LANES + i] * (u*abs(r))  # Nu_absr_dr
    )
