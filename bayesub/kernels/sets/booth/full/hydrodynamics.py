"""Hydrodynamic forces of one lane, by bayesub.model.equations.generate: do not edit.

Equations 'booth', all degrees of freedom, 101 terms.
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
ADDED_MASS = ((0, 0, 6), (1, 1, 17), (1, 3, 25), (1, 5, 26), (2, 2, 38), (2, 4, 44), (3, 1, 53), (3, 3, 59), (3, 5, 60), (4, 2, 72), (4, 4, 78), (5, 1, 88), (5, 3, 96), (5, 5, 97))


@inline
def sgn(x):
    """Sign of x; zero for zero."""
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@inline
def hydrodynamic_forces(work, i, control, u, v, w, p, q, r):
    """X, Y, Z (N) and K, M, N (N m) of lane `i`, terms without accelerations (model manual, section 4)."""
    dr = control[0] + work[255 * LANES + i]
    db = control[1] + work[256 * LANES + i]
    ds = control[2] + work[257 * LANES + i]
    nu = sqrt(v * v + w * w)
    X = (
        work[(COEFFICIENTS + 0) * LANES + i] * (u*u)  # Xuu
        + work[(COEFFICIENTS + 1) * LANES + i] * (v*v)  # Xvv
        + work[(COEFFICIENTS + 2) * LANES + i] * (w*w)  # Xww
        + work[(COEFFICIENTS + 3) * LANES + i] * (u*u*dr*dr)  # Xuu_drdr
        + work[(COEFFICIENTS + 4) * LANES + i] * (u*u*db*db)  # Xuu_dbdb
        + work[(COEFFICIENTS + 5) * LANES + i] * (u*u*ds*ds)  # Xuu_dsds
        + work[(COEFFICIENTS + 7) * LANES + i] * (v*r)  # Xvr
        + work[(COEFFICIENTS + 8) * LANES + i] * (w*q)  # Xwq
        + work[(COEFFICIENTS + 9) * LANES + i] * (q*q)  # Xqq
        + work[(COEFFICIENTS + 10) * LANES + i] * (r*r)  # Xrr
        + work[(COEFFICIENTS + 11) * LANES + i] * (r*p)  # Xrp
    )
    Y = (
        work[(COEFFICIENTS + 12) * LANES + i] * (u*u)  # Yuu
        + work[(COEFFICIENTS + 13) * LANES + i] * (u*v)  # Yuv
        + work[(COEFFICIENTS + 14) * LANES + i] * (v*w)  # Yvw
        + work[(COEFFICIENTS + 15) * LANES + i] * (v*nu)  # Yv_absnu
        + work[(COEFFICIENTS + 16) * LANES + i] * (u*u*dr)  # Yuu_dr
        + work[(COEFFICIENTS + 18) * LANES + i] * (u*p)  # Yup
        + work[(COEFFICIENTS + 19) * LANES + i] * (u*r)  # Yur
        + work[(COEFFICIENTS + 20) * LANES + i] * (v*q)  # Yvq
        + work[(COEFFICIENTS + 21) * LANES + i] * (w*p)  # Ywp
        + work[(COEFFICIENTS + 22) * LANES + i] * (w*r)  # Ywr
        + work[(COEFFICIENTS + 23) * LANES + i] * (sgn(v)*nu*abs(r))  # Yv_absr
        + work[(COEFFICIENTS + 24) * LANES + i] * (u*abs(r)*dr)  # Yu_absr_dr
        + work[(COEFFICIENTS + 27) * LANES + i] * (p*abs(p))  # Yp_absp
        + work[(COEFFICIENTS + 28) * LANES + i] * (p*q)  # Ypq
        + work[(COEFFICIENTS + 29) * LANES + i] * (q*r)  # Yqr
    )
    Z = (
        work[(COEFFICIENTS + 30) * LANES + i] * (u*u)  # Zuu
        + work[(COEFFICIENTS + 31) * LANES + i] * (u*w)  # Zuw
        + work[(COEFFICIENTS + 32) * LANES + i] * (v*v)  # Zvv
        + work[(COEFFICIENTS + 33) * LANES + i] * (u*u*db)  # Zuu_db
        + work[(COEFFICIENTS + 34) * LANES + i] * (u*u*ds)  # Zuu_ds
        + work[(COEFFICIENTS + 35) * LANES + i] * (w*nu)  # Zw_absnu
        + work[(COEFFICIENTS + 36) * LANES + i] * (u*abs(w))  # Zu_absw
        + work[(COEFFICIENTS + 37) * LANES + i] * (abs(w)*nu)  # Zabsw_nu
        + work[(COEFFICIENTS + 39) * LANES + i] * (u*q)  # Zuq
        + work[(COEFFICIENTS + 40) * LANES + i] * (v*p)  # Zvp
        + work[(COEFFICIENTS + 41) * LANES + i] * (v*r)  # Zvr
        + work[(COEFFICIENTS + 42) * LANES + i] * (u*abs(q)*ds)  # Zu_absq_ds
        + work[(COEFFICIENTS + 43) * LANES + i] * (sgn(w)*nu*abs(q))  # Zw_absq
        + work[(COEFFICIENTS + 45) * LANES + i] * (p*p)  # Zpp
        + work[(COEFFICIENTS + 46) * LANES + i] * (r*r)  # Zrr
        + work[(COEFFICIENTS + 47) * LANES + i] * (r*p)  # Zrp
    )
    K = (
        work[(COEFFICIENTS + 48) * LANES + i] * (u*u)  # Kuu
        + work[(COEFFICIENTS + 49) * LANES + i] * (u*v)  # Kuv
        + work[(COEFFICIENTS + 50) * LANES + i] * (v*w)  # Kvw
        + work[(COEFFICIENTS + 51) * LANES + i] * (v*nu)  # Kv_absnu
        + work[(COEFFICIENTS + 52) * LANES + i] * (u*u*dr)  # Kuu_dr
        + work[(COEFFICIENTS + 54) * LANES + i] * (u*p)  # Kup
        + work[(COEFFICIENTS + 55) * LANES + i] * (u*r)  # Kur
        + work[(COEFFICIENTS + 56) * LANES + i] * (v*q)  # Kvq
        + work[(COEFFICIENTS + 57) * LANES + i] * (w*p)  # Kwp
        + work[(COEFFICIENTS + 58) * LANES + i] * (w*r)  # Kwr
        + work[(COEFFICIENTS + 61) * LANES + i] * (q*r)  # Kqr
        + work[(COEFFICIENTS + 62) * LANES + i] * (p*q)  # Kpq
        + work[(COEFFICIENTS + 63) * LANES + i] * (p*abs(p))  # Kp_absp
    )
    M = (
        work[(COEFFICIENTS + 64) * LANES + i] * (u*u)  # Muu
        + work[(COEFFICIENTS + 65) * LANES + i] * (u*w)  # Muw
        + work[(COEFFICIENTS + 66) * LANES + i] * (v*v)  # Mvv
        + work[(COEFFICIENTS + 67) * LANES + i] * (u*u*db)  # Muu_db
        + work[(COEFFICIENTS + 68) * LANES + i] * (u*u*ds)  # Muu_ds
        + work[(COEFFICIENTS + 69) * LANES + i] * (w*nu)  # Mw_absnu
        + work[(COEFFICIENTS + 70) * LANES + i] * (u*abs(w))  # Mu_absw
        + work[(COEFFICIENTS + 71) * LANES + i] * (abs(w)*nu)  # Mabsw_nu
        + work[(COEFFICIENTS + 73) * LANES + i] * (u*q)  # Muq
        + work[(COEFFICIENTS + 74) * LANES + i] * (v*p)  # Mvp
        + work[(COEFFICIENTS + 75) * LANES + i] * (v*r)  # Mvr
        + work[(COEFFICIENTS + 76) * LANES + i] * (u*abs(q)*ds)  # Mu_absq_ds
        + work[(COEFFICIENTS + 77) * LANES + i] * (nu*q)  # Mabsnu_q
        + work[(COEFFICIENTS + 79) * LANES + i] * (p*p)  # Mpp
        + work[(COEFFICIENTS + 80) * LANES + i] * (r*r)  # Mrr
        + work[(COEFFICIENTS + 81) * LANES + i] * (r*p)  # Mrp
        + work[(COEFFICIENTS + 82) * LANES + i] * (q*abs(q))  # Mq_absq
    )
    N = (
        work[(COEFFICIENTS + 83) * LANES + i] * (u*u)  # Nuu
        + work[(COEFFICIENTS + 84) * LANES + i] * (u*v)  # Nuv
        + work[(COEFFICIENTS + 85) * LANES + i] * (v*w)  # Nvw
        + work[(COEFFICIENTS + 86) * LANES + i] * (v*nu)  # Nv_absnu
        + work[(COEFFICIENTS + 87) * LANES + i] * (u*u*dr)  # Nuu_dr
        + work[(COEFFICIENTS + 89) * LANES + i] * (u*p)  # Nup
        + work[(COEFFICIENTS + 90) * LANES + i] * (u*r)  # Nur
        + work[(COEFFICIENTS + 91) * LANES + i] * (v*q)  # Nvq
        + work[(COEFFICIENTS + 92) * LANES + i] * (w*p)  # Nwp
        + work[(COEFFICIENTS + 93) * LANES + i] * (w*r)  # Nwr
        + work[(COEFFICIENTS + 94) * LANES + i] * (nu*r)  # Nabsnu_r
        + work[(COEFFICIENTS + 95) * LANES + i] * (u*abs(r)*dr)  # Nu_absr_dr
        + work[(COEFFICIENTS + 98) * LANES + i] * (p*q)  # Npq
        + work[(COEFFICIENTS + 99) * LANES + i] * (q*r)  # Nqr
        + work[(COEFFICIENTS + 100) * LANES + i] * (r*abs(r))  # Nr_absr
    )
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
    X_v = (
        work[(COEFFICIENTS + 1) * LANES + i] * (v + v)  # Xvv
        + work[(COEFFICIENTS + 7) * LANES + i] * (r)  # Xvr
    )
    X_w = (
        work[(COEFFICIENTS + 2) * LANES + i] * (w + w)  # Xww
        + work[(COEFFICIENTS + 8) * LANES + i] * (q)  # Xwq
    )
    X_p = (
        work[(COEFFICIENTS + 11) * LANES + i] * (r)  # Xrp
    )
    X_q = (
        work[(COEFFICIENTS + 8) * LANES + i] * (w)  # Xwq
        + work[(COEFFICIENTS + 9) * LANES + i] * (q + q)  # Xqq
    )
    X_r = (
        work[(COEFFICIENTS + 7) * LANES + i] * (v)  # Xvr
        + work[(COEFFICIENTS + 10) * LANES + i] * (r + r)  # Xrr
        + work[(COEFFICIENTS + 11) * LANES + i] * (p)  # Xrp
    )
    Y_u = (
        work[(COEFFICIENTS + 12) * LANES + i] * (u + u)  # Yuu
        + work[(COEFFICIENTS + 13) * LANES + i] * (v)  # Yuv
        + work[(COEFFICIENTS + 16) * LANES + i] * (u*dr + u*dr)  # Yuu_dr
        + work[(COEFFICIENTS + 18) * LANES + i] * (p)  # Yup
        + work[(COEFFICIENTS + 19) * LANES + i] * (r)  # Yur
        + work[(COEFFICIENTS + 24) * LANES + i] * (abs(r)*dr)  # Yu_absr_dr
    )
    Y_v = (
        work[(COEFFICIENTS + 13) * LANES + i] * (u)  # Yuv
        + work[(COEFFICIENTS + 14) * LANES + i] * (w)  # Yvw
        + work[(COEFFICIENTS + 15) * LANES + i] * (nu + nu_v*v)  # Yv_absnu
        + work[(COEFFICIENTS + 20) * LANES + i] * (q)  # Yvq
        + work[(COEFFICIENTS + 23) * LANES + i] * (nu_v*sgn(v)*abs(r))  # Yv_absr
    )
    Y_w = (
        work[(COEFFICIENTS + 14) * LANES + i] * (v)  # Yvw
        + work[(COEFFICIENTS + 15) * LANES + i] * (nu_w*v)  # Yv_absnu
        + work[(COEFFICIENTS + 21) * LANES + i] * (p)  # Ywp
        + work[(COEFFICIENTS + 22) * LANES + i] * (r)  # Ywr
        + work[(COEFFICIENTS + 23) * LANES + i] * (nu_w*sgn(v)*abs(r))  # Yv_absr
    )
    Y_p = (
        work[(COEFFICIENTS + 18) * LANES + i] * (u)  # Yup
        + work[(COEFFICIENTS + 21) * LANES + i] * (w)  # Ywp
        + work[(COEFFICIENTS + 27) * LANES + i] * (abs(p) + sgn(p)*p)  # Yp_absp
        + work[(COEFFICIENTS + 28) * LANES + i] * (q)  # Ypq
    )
    Y_q = (
        work[(COEFFICIENTS + 20) * LANES + i] * (v)  # Yvq
        + work[(COEFFICIENTS + 28) * LANES + i] * (p)  # Ypq
        + work[(COEFFICIENTS + 29) * LANES + i] * (r)  # Yqr
    )
    Y_r = (
        work[(COEFFICIENTS + 19) * LANES + i] * (u)  # Yur
        + work[(COEFFICIENTS + 22) * LANES + i] * (w)  # Ywr
        + work[(COEFFICIENTS + 23) * LANES + i] * (sgn(r)*sgn(v)*nu)  # Yv_absr
        + work[(COEFFICIENTS + 24) * LANES + i] * (sgn(r)*u*dr)  # Yu_absr_dr
        + work[(COEFFICIENTS + 29) * LANES + i] * (q)  # Yqr
    )
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
        + work[(COEFFICIENTS + 40) * LANES + i] * (p)  # Zvp
        + work[(COEFFICIENTS + 41) * LANES + i] * (r)  # Zvr
        + work[(COEFFICIENTS + 43) * LANES + i] * (nu_v*sgn(w)*abs(q))  # Zw_absq
    )
    Z_w = (
        work[(COEFFICIENTS + 31) * LANES + i] * (u)  # Zuw
        + work[(COEFFICIENTS + 35) * LANES + i] * (nu + nu_w*w)  # Zw_absnu
        + work[(COEFFICIENTS + 36) * LANES + i] * (sgn(w)*u)  # Zu_absw
        + work[(COEFFICIENTS + 37) * LANES + i] * (sgn(w)*nu + nu_w*abs(w))  # Zabsw_nu
        + work[(COEFFICIENTS + 43) * LANES + i] * (nu_w*sgn(w)*abs(q))  # Zw_absq
    )
    Z_p = (
        work[(COEFFICIENTS + 40) * LANES + i] * (v)  # Zvp
        + work[(COEFFICIENTS + 45) * LANES + i] * (p + p)  # Zpp
        + work[(COEFFICIENTS + 47) * LANES + i] * (r)  # Zrp
    )
    Z_q = (
        work[(COEFFICIENTS + 39) * LANES + i] * (u)  # Zuq
        + work[(COEFFICIENTS + 42) * LANES + i] * (sgn(q)*u*ds)  # Zu_absq_ds
        + work[(COEFFICIENTS + 43) * LANES + i] * (sgn(q)*sgn(w)*nu)  # Zw_absq
    )
    Z_r = (
        work[(COEFFICIENTS + 41) * LANES + i] * (v)  # Zvr
        + work[(COEFFICIENTS + 46) * LANES + i] * (r + r)  # Zrr
        + work[(COEFFICIENTS + 47) * LANES + i] * (p)  # Zrp
    )
    K_u = (
        work[(COEFFICIENTS + 48) * LANES + i] * (u + u)  # Kuu
        + work[(COEFFICIENTS + 49) * LANES + i] * (v)  # Kuv
        + work[(COEFFICIENTS + 52) * LANES + i] * (u*dr + u*dr)  # Kuu_dr
        + work[(COEFFICIENTS + 54) * LANES + i] * (p)  # Kup
        + work[(COEFFICIENTS + 55) * LANES + i] * (r)  # Kur
    )
    K_v = (
        work[(COEFFICIENTS + 49) * LANES + i] * (u)  # Kuv
        + work[(COEFFICIENTS + 50) * LANES + i] * (w)  # Kvw
        + work[(COEFFICIENTS + 51) * LANES + i] * (nu + nu_v*v)  # Kv_absnu
        + work[(COEFFICIENTS + 56) * LANES + i] * (q)  # Kvq
    )
    K_w = (
        work[(COEFFICIENTS + 50) * LANES + i] * (v)  # Kvw
        + work[(COEFFICIENTS + 51) * LANES + i] * (nu_w*v)  # Kv_absnu
        + work[(COEFFICIENTS + 57) * LANES + i] * (p)  # Kwp
        + work[(COEFFICIENTS + 58) * LANES + i] * (r)  # Kwr
    )
    K_p = (
        work[(COEFFICIENTS + 54) * LANES + i] * (u)  # Kup
        + work[(COEFFICIENTS + 57) * LANES + i] * (w)  # Kwp
        + work[(COEFFICIENTS + 62) * LANES + i] * (q)  # Kpq
        + work[(COEFFICIENTS + 63) * LANES + i] * (abs(p) + sgn(p)*p)  # Kp_absp
    )
    K_q = (
        work[(COEFFICIENTS + 56) * LANES + i] * (v)  # Kvq
        + work[(COEFFICIENTS + 61) * LANES + i] * (r)  # Kqr
        + work[(COEFFICIENTS + 62) * LANES + i] * (p)  # Kpq
    )
    K_r = (
        work[(COEFFICIENTS + 55) * LANES + i] * (u)  # Kur
        + work[(COEFFICIENTS + 58) * LANES + i] * (w)  # Kwr
        + work[(COEFFICIENTS + 61) * LANES + i] * (q)  # Kqr
    )
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
        + work[(COEFFICIENTS + 74) * LANES + i] * (p)  # Mvp
        + work[(COEFFICIENTS + 75) * LANES + i] * (r)  # Mvr
        + work[(COEFFICIENTS + 77) * LANES + i] * (nu_v*q)  # Mabsnu_q
    )
    M_w = (
        work[(COEFFICIENTS + 65) * LANES + i] * (u)  # Muw
        + work[(COEFFICIENTS + 69) * LANES + i] * (nu + nu_w*w)  # Mw_absnu
        + work[(COEFFICIENTS + 70) * LANES + i] * (sgn(w)*u)  # Mu_absw
        + work[(COEFFICIENTS + 71) * LANES + i] * (sgn(w)*nu + nu_w*abs(w))  # Mabsw_nu
        + work[(COEFFICIENTS + 77) * LANES + i] * (nu_w*q)  # Mabsnu_q
    )
    M_p = (
        work[(COEFFICIENTS + 74) * LANES + i] * (v)  # Mvp
        + work[(COEFFICIENTS + 79) * LANES + i] * (p + p)  # Mpp
        + work[(COEFFICIENTS + 81) * LANES + i] * (r)  # Mrp
    )
    M_q = (
        work[(COEFFICIENTS + 73) * LANES + i] * (u)  # Muq
        + work[(COEFFICIENTS + 76) * LANES + i] * (sgn(q)*u*ds)  # Mu_absq_ds
        + work[(COEFFICIENTS + 77) * LANES + i] * (nu)  # Mabsnu_q
        + work[(COEFFICIENTS + 82) * LANES + i] * (abs(q) + sgn(q)*q)  # Mq_absq
    )
    M_r = (
        work[(COEFFICIENTS + 75) * LANES + i] * (v)  # Mvr
        + work[(COEFFICIENTS + 80) * LANES + i] * (r + r)  # Mrr
        + work[(COEFFICIENTS + 81) * LANES + i] * (p)  # Mrp
    )
    N_u = (
        work[(COEFFICIENTS + 83) * LANES + i] * (u + u)  # Nuu
        + work[(COEFFICIENTS + 84) * LANES + i] * (v)  # Nuv
        + work[(COEFFICIENTS + 87) * LANES + i] * (u*dr + u*dr)  # Nuu_dr
        + work[(COEFFICIENTS + 89) * LANES + i] * (p)  # Nup
        + work[(COEFFICIENTS + 90) * LANES + i] * (r)  # Nur
        + work[(COEFFICIENTS + 95) * LANES + i] * (abs(r)*dr)  # Nu_absr_dr
    )
    N_v = (
        work[(COEFFICIENTS + 84) * LANES + i] * (u)  # Nuv
        + work[(COEFFICIENTS + 85) * LANES + i] * (w)  # Nvw
        + work[(COEFFICIENTS + 86) * LANES + i] * (nu + nu_v*v)  # Nv_absnu
        + work[(COEFFICIENTS + 91) * LANES + i] * (q)  # Nvq
        + work[(COEFFICIENTS + 94) * LANES + i] * (nu_v*r)  # Nabsnu_r
    )
    N_w = (
        work[(COEFFICIENTS + 85) * LANES + i] * (v)  # Nvw
        + work[(COEFFICIENTS + 86) * LANES + i] * (nu_w*v)  # Nv_absnu
        + work[(COEFFICIENTS + 92) * LANES + i] * (p)  # Nwp
        + work[(COEFFICIENTS + 93) * LANES + i] * (r)  # Nwr
        + work[(COEFFICIENTS + 94) * LANES + i] * (nu_w*r)  # Nabsnu_r
    )
    N_p = (
        work[(COEFFICIENTS + 89) * LANES + i] * (u)  # Nup
        + work[(COEFFICIENTS + 92) * LANES + i] * (w)  # Nwp
        + work[(COEFFICIENTS + 98) * LANES + i] * (q)  # Npq
    )
    N_q = (
        work[(COEFFICIENTS + 91) * LANES + i] * (v)  # Nvq
        + work[(COEFFICIENTS + 98) * LANES + i] * (p)  # Npq
        + work[(COEFFICIENTS + 99) * LANES + i] * (r)  # Nqr
    )
    N_r = (
        work[(COEFFICIENTS + 90) * LANES + i] * (u)  # Nur
        + work[(COEFFICIENTS + 93) * LANES + i] * (w)  # Nwr
        + work[(COEFFICIENTS + 94) * LANES + i] * (nu)  # Nabsnu_r
        + work[(COEFFICIENTS + 95) * LANES + i] * (sgn(r)*u*dr)  # Nu_absr_dr
        + work[(COEFFICIENTS + 99) * LANES + i] * (q)  # Nqr
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
    db = control[1] + work[256 * LANES + i]
    ds = control[2] + work[257 * LANES + i]
    nu = sqrt(v * v + w * w)
    row[0] = u*u  # Xuu
    row[1] = v*v  # Xvv
    row[2] = w*w  # Xww
    row[3] = u*u*dr*dr  # Xuu_drdr
    row[4] = u*u*db*db  # Xuu_dbdb
    row[5] = u*u*ds*ds  # Xuu_dsds
    row[6] = udot  # Xudot
    row[7] = v*r  # Xvr
    row[8] = w*q  # Xwq
    row[9] = q*q  # Xqq
    row[10] = r*r  # Xrr
    row[11] = r*p  # Xrp
    row[12] = u*u  # Yuu
    row[13] = u*v  # Yuv
    row[14] = v*w  # Yvw
    row[15] = v*nu  # Yv_absnu
    row[16] = u*u*dr  # Yuu_dr
    row[17] = vdot  # Yvdot
    row[18] = u*p  # Yup
    row[19] = u*r  # Yur
    row[20] = v*q  # Yvq
    row[21] = w*p  # Ywp
    row[22] = w*r  # Ywr
    row[23] = sgn(v)*nu*abs(r)  # Yv_absr
    row[24] = u*abs(r)*dr  # Yu_absr_dr
    row[25] = pdot  # Ypdot
    row[26] = rdot  # Yrdot
    row[27] = p*abs(p)  # Yp_absp
    row[28] = p*q  # Ypq
    row[29] = q*r  # Yqr
    row[30] = u*u  # Zuu
    row[31] = u*w  # Zuw
    row[32] = v*v  # Zvv
    row[33] = u*u*db  # Zuu_db
    row[34] = u*u*ds  # Zuu_ds
    row[35] = w*nu  # Zw_absnu
    row[36] = u*abs(w)  # Zu_absw
    row[37] = abs(w)*nu  # Zabsw_nu
    row[38] = wdot  # Zwdot
    row[39] = u*q  # Zuq
    row[40] = v*p  # Zvp
    row[41] = v*r  # Zvr
    row[42] = u*abs(q)*ds  # Zu_absq_ds
    row[43] = sgn(w)*nu*abs(q)  # Zw_absq
    row[44] = qdot  # Zqdot
    row[45] = p*p  # Zpp
    row[46] = r*r  # Zrr
    row[47] = r*p  # Zrp
    row[48] = u*u  # Kuu
    row[49] = u*v  # Kuv
    row[50] = v*w  # Kvw
    row[51] = v*nu  # Kv_absnu
    row[52] = u*u*dr  # Kuu_dr
    row[53] = vdot  # Kvdot
    row[54] = u*p  # Kup
    row[55] = u*r  # Kur
    row[56] = v*q  # Kvq
    row[57] = w*p  # Kwp
    row[58] = w*r  # Kwr
    row[59] = pdot  # Kpdot
    row[60] = rdot  # Krdot
    row[61] = q*r  # Kqr
    row[62] = p*q  # Kpq
    row[63] = p*abs(p)  # Kp_absp
    row[64] = u*u  # Muu
    row[65] = u*w  # Muw
    row[66] = v*v  # Mvv
    row[67] = u*u*db  # Muu_db
    row[68] = u*u*ds  # Muu_ds
    row[69] = w*nu  # Mw_absnu
    row[70] = u*abs(w)  # Mu_absw
    row[71] = abs(w)*nu  # Mabsw_nu
    row[72] = wdot  # Mwdot
    row[73] = u*q  # Muq
    row[74] = v*p  # Mvp
    row[75] = v*r  # Mvr
    row[76] = u*abs(q)*ds  # Mu_absq_ds
    row[77] = nu*q  # Mabsnu_q
    row[78] = qdot  # Mqdot
    row[79] = p*p  # Mpp
    row[80] = r*r  # Mrr
    row[81] = r*p  # Mrp
    row[82] = q*abs(q)  # Mq_absq
    row[83] = u*u  # Nuu
    row[84] = u*v  # Nuv
    row[85] = v*w  # Nvw
    row[86] = v*nu  # Nv_absnu
    row[87] = u*u*dr  # Nuu_dr
    row[88] = vdot  # Nvdot
    row[89] = u*p  # Nup
    row[90] = u*r  # Nur
    row[91] = v*q  # Nvq
    row[92] = w*p  # Nwp
    row[93] = w*r  # Nwr
    row[94] = nu*r  # Nabsnu_r
    row[95] = u*abs(r)*dr  # Nu_absr_dr
    row[96] = pdot  # Npdot
    row[97] = rdot  # Nrdot
    row[98] = p*q  # Npq
    row[99] = q*r  # Nqr
    row[100] = r*abs(r)  # Nr_absr


@inline
def store_control_slopes(slopes, work, i, control, u, v, w, p, q, r):
    """Add the derivatives of the forces by the controls into `slopes` (6, N_CONTROLS)."""
    dr = control[0] + work[255 * LANES + i]
    db = control[1] + work[256 * LANES + i]
    ds = control[2] + work[257 * LANES + i]
    slopes[0, 0] = (
        work[(COEFFICIENTS + 3) * LANES + i] * (u*u*dr + u*u*dr)  # Xuu_drdr
    )
    slopes[1, 0] = (
        work[(COEFFICIENTS + 16) * LANES + i] * (u*u)  # Yuu_dr
        + work[(COEFFICIENTS + 24) * LANES + i] * (u*abs(r))  # Yu_absr_dr
    )
    slopes[3, 0] = (
        work[(COEFFICIENTS + 52) * LANES + i] * (u*u)  # Kuu_dr
    )
    slopes[5, 0] = (
        work[(COEFFICIENTS + 87) * LANES + i] * (u*u)  # Nuu_dr
        + work[(COEFFICIENTS + 95) * LANES + i] * (u*abs(r))  # Nu_absr_dr
    )
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
