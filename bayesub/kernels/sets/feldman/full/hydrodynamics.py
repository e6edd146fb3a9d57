"""Hydrodynamic forces of one lane, by bayesub.model.equations.generate: do not edit.

Equations 'feldman', all degrees of freedom, 108 terms.
"""

from math import sqrt

from bayesub.kernels.jit import inline
from bayesub.kernels.workspace import COEFFICIENTS, LANES

N_COEFFICIENTS = 108
N_CONTROLS = 4
ORDERED_SPEED = 3  # position of n/k0 among the controls
N_CONSTANTS = 49
RIGID_BODY_TERMS = True  # whether the velocity terms of the rigid body are apart from the coefficients

# (axis, acceleration, coefficient) of the added-mass terms, which stand in the mass matrix.
ADDED_MASS = ((0, 0, 6), (1, 1, 19), (1, 3, 25), (1, 5, 26), (2, 2, 41), (2, 4, 45), (3, 1, 57), (3, 3, 63), (3, 5, 64), (4, 2, 77), (4, 4, 81), (5, 1, 94), (5, 3, 100), (5, 5, 101))


@inline
def sgn(x):
    """Sign of x; zero for zero."""
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@inline
def crossflow(x, height, breadth, v, w, q, r):
    """Side and normal force of the local cross-flow at a station, without density and drag coefficient."""
    v, w = v + x * r, w - x * q
    speed = sqrt(v * v + w * w)
    return -height * v * speed, -breadth * w * speed


@inline
def crossflow_slopes(x, height, breadth, v, w, q, r):
    """Derivatives of :func:`crossflow` by the local velocities across and down: y by v, y by w, z by v, z by w."""
    v, w = v + x * r, w - x * q
    speed = sqrt(v * v + w * w)
    inverse = 1.0 / speed if speed > 0.0 else 0.0
    vw = v * w * inverse
    return -height * (speed + v * v * inverse), -height * vw, -breadth * vw, -breadth * (speed + w * w * inverse)


@inline
def hydrodynamic_forces(work, i, control, u, v, w, p, q, r):
    """X, Y, Z (N) and K, M, N (N m) of lane `i`, terms without accelerations (model manual, section 4)."""
    dr = control[0] + work[262 * LANES + i]
    db = control[1] + work[263 * LANES + i]
    ds = control[2] + work[264 * LANES + i]
    uc = control[3] + work[265 * LANES + i]
    nu = sqrt(v * v + w * w)
    duc = uc - u
    crossflow_y = crossflow_z = crossflow_m = crossflow_n = 0.0
    x, height, breadth = work[267 * LANES + i], work[283 * LANES + i], work[299 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[268 * LANES + i], work[284 * LANES + i], work[300 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[269 * LANES + i], work[285 * LANES + i], work[301 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[270 * LANES + i], work[286 * LANES + i], work[302 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[271 * LANES + i], work[287 * LANES + i], work[303 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[272 * LANES + i], work[288 * LANES + i], work[304 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[273 * LANES + i], work[289 * LANES + i], work[305 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[274 * LANES + i], work[290 * LANES + i], work[306 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[275 * LANES + i], work[291 * LANES + i], work[307 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[276 * LANES + i], work[292 * LANES + i], work[308 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[277 * LANES + i], work[293 * LANES + i], work[309 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[278 * LANES + i], work[294 * LANES + i], work[310 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[279 * LANES + i], work[295 * LANES + i], work[311 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[280 * LANES + i], work[296 * LANES + i], work[312 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[281 * LANES + i], work[297 * LANES + i], work[313 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[282 * LANES + i], work[298 * LANES + i], work[314 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
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
        + work[(COEFFICIENTS + 12) * LANES + i] * (u*duc*dr*dr)  # Xuu_drdr_eta
        + work[(COEFFICIENTS + 13) * LANES + i] * (u*duc*ds*ds)  # Xuu_dsds_eta
    )
    Y = (
        work[(COEFFICIENTS + 14) * LANES + i] * (u*u)  # Yuu
        + work[(COEFFICIENTS + 15) * LANES + i] * (u*v)  # Yuv
        + work[(COEFFICIENTS + 16) * LANES + i] * (v*w)  # Yvw
        + work[(COEFFICIENTS + 17) * LANES + i] * (v*nu)  # Yv_absnu
        + work[(COEFFICIENTS + 18) * LANES + i] * (u*u*dr)  # Yuu_dr
        + work[(COEFFICIENTS + 20) * LANES + i] * (u*p)  # Yup
        + work[(COEFFICIENTS + 21) * LANES + i] * (u*r)  # Yur
        + work[(COEFFICIENTS + 22) * LANES + i] * (v*q)  # Yvq
        + work[(COEFFICIENTS + 23) * LANES + i] * (w*p)  # Ywp
        + work[(COEFFICIENTS + 24) * LANES + i] * (w*r)  # Ywr
        + work[(COEFFICIENTS + 27) * LANES + i] * (p*abs(p))  # Yp_absp
        + work[(COEFFICIENTS + 28) * LANES + i] * (p*q)  # Ypq
        + work[(COEFFICIENTS + 29) * LANES + i] * (q*r)  # Yqr
        + work[(COEFFICIENTS + 30) * LANES + i] * (crossflow_y)  # Ycrossflow
        + work[(COEFFICIENTS + 31) * LANES + i] * (v*duc)  # Yuv_eta
        + work[(COEFFICIENTS + 32) * LANES + i] * (r*duc)  # Yur_eta
        + work[(COEFFICIENTS + 33) * LANES + i] * (u*duc*dr)  # Yuu_dr_eta
    )
    Z = (
        work[(COEFFICIENTS + 34) * LANES + i] * (u*u)  # Zuu
        + work[(COEFFICIENTS + 35) * LANES + i] * (u*w)  # Zuw
        + work[(COEFFICIENTS + 36) * LANES + i] * (v*v)  # Zvv
        + work[(COEFFICIENTS + 37) * LANES + i] * (u*u*db)  # Zuu_db
        + work[(COEFFICIENTS + 38) * LANES + i] * (u*u*ds)  # Zuu_ds
        + work[(COEFFICIENTS + 39) * LANES + i] * (u*abs(w))  # Zu_absw
        + work[(COEFFICIENTS + 40) * LANES + i] * (abs(w)*nu)  # Zabsw_nu
        + work[(COEFFICIENTS + 42) * LANES + i] * (u*q)  # Zuq
        + work[(COEFFICIENTS + 43) * LANES + i] * (v*p)  # Zvp
        + work[(COEFFICIENTS + 44) * LANES + i] * (v*r)  # Zvr
        + work[(COEFFICIENTS + 46) * LANES + i] * (p*p)  # Zpp
        + work[(COEFFICIENTS + 47) * LANES + i] * (r*r)  # Zrr
        + work[(COEFFICIENTS + 48) * LANES + i] * (r*p)  # Zrp
        + work[(COEFFICIENTS + 49) * LANES + i] * (crossflow_z)  # Zcrossflow
        + work[(COEFFICIENTS + 50) * LANES + i] * (w*duc)  # Zuw_eta
        + work[(COEFFICIENTS + 51) * LANES + i] * (q*duc)  # Zuq_eta
        + work[(COEFFICIENTS + 52) * LANES + i] * (u*duc*ds)  # Zuu_ds_eta
    )
    K = (
        work[(COEFFICIENTS + 53) * LANES + i] * (u*u)  # Kuu
        + work[(COEFFICIENTS + 54) * LANES + i] * (u*v)  # Kuv
        + work[(COEFFICIENTS + 55) * LANES + i] * (v*w)  # Kvw
        + work[(COEFFICIENTS + 56) * LANES + i] * (u*u*dr)  # Kuu_dr
        + work[(COEFFICIENTS + 58) * LANES + i] * (u*p)  # Kup
        + work[(COEFFICIENTS + 59) * LANES + i] * (u*r)  # Kur
        + work[(COEFFICIENTS + 60) * LANES + i] * (v*q)  # Kvq
        + work[(COEFFICIENTS + 61) * LANES + i] * (w*p)  # Kwp
        + work[(COEFFICIENTS + 62) * LANES + i] * (w*r)  # Kwr
        + work[(COEFFICIENTS + 65) * LANES + i] * (q*r)  # Kqr
        + work[(COEFFICIENTS + 66) * LANES + i] * (p*q)  # Kpq
        + work[(COEFFICIENTS + 67) * LANES + i] * (p*abs(p))  # Kp_absp
        + work[(COEFFICIENTS + 68) * LANES + i] * (p*duc)  # Kup_eta
        + work[(COEFFICIENTS + 69) * LANES + i] * (u*duc*dr)  # Kuu_dr_eta
    )
    M = (
        work[(COEFFICIENTS + 70) * LANES + i] * (u*u)  # Muu
        + work[(COEFFICIENTS + 71) * LANES + i] * (u*w)  # Muw
        + work[(COEFFICIENTS + 72) * LANES + i] * (v*v)  # Mvv
        + work[(COEFFICIENTS + 73) * LANES + i] * (u*u*db)  # Muu_db
        + work[(COEFFICIENTS + 74) * LANES + i] * (u*u*ds)  # Muu_ds
        + work[(COEFFICIENTS + 75) * LANES + i] * (u*abs(w))  # Mu_absw
        + work[(COEFFICIENTS + 76) * LANES + i] * (abs(w)*nu)  # Mabsw_nu
        + work[(COEFFICIENTS + 78) * LANES + i] * (u*q)  # Muq
        + work[(COEFFICIENTS + 79) * LANES + i] * (v*p)  # Mvp
        + work[(COEFFICIENTS + 80) * LANES + i] * (v*r)  # Mvr
        + work[(COEFFICIENTS + 82) * LANES + i] * (p*p)  # Mpp
        + work[(COEFFICIENTS + 83) * LANES + i] * (r*r)  # Mrr
        + work[(COEFFICIENTS + 84) * LANES + i] * (r*p)  # Mrp
        + work[(COEFFICIENTS + 85) * LANES + i] * (crossflow_m)  # Mcrossflow
        + work[(COEFFICIENTS + 86) * LANES + i] * (w*duc)  # Muw_eta
        + work[(COEFFICIENTS + 87) * LANES + i] * (q*duc)  # Muq_eta
        + work[(COEFFICIENTS + 88) * LANES + i] * (u*duc*ds)  # Muu_ds_eta
    )
    N = (
        work[(COEFFICIENTS + 89) * LANES + i] * (u*u)  # Nuu
        + work[(COEFFICIENTS + 90) * LANES + i] * (u*v)  # Nuv
        + work[(COEFFICIENTS + 91) * LANES + i] * (v*w)  # Nvw
        + work[(COEFFICIENTS + 92) * LANES + i] * (v*nu)  # Nv_absnu
        + work[(COEFFICIENTS + 93) * LANES + i] * (u*u*dr)  # Nuu_dr
        + work[(COEFFICIENTS + 95) * LANES + i] * (u*p)  # Nup
        + work[(COEFFICIENTS + 96) * LANES + i] * (u*r)  # Nur
        + work[(COEFFICIENTS + 97) * LANES + i] * (v*q)  # Nvq
        + work[(COEFFICIENTS + 98) * LANES + i] * (w*p)  # Nwp
        + work[(COEFFICIENTS + 99) * LANES + i] * (w*r)  # Nwr
        + work[(COEFFICIENTS + 102) * LANES + i] * (p*q)  # Npq
        + work[(COEFFICIENTS + 103) * LANES + i] * (q*r)  # Nqr
        + work[(COEFFICIENTS + 104) * LANES + i] * (crossflow_n)  # Ncrossflow
        + work[(COEFFICIENTS + 105) * LANES + i] * (v*duc)  # Nuv_eta
        + work[(COEFFICIENTS + 106) * LANES + i] * (r*duc)  # Nur_eta
        + work[(COEFFICIENTS + 107) * LANES + i] * (u*duc*dr)  # Nuu_dr_eta
    )
    return X, Y, Z, K, M, N


@inline
def hydrodynamic_gradient(work, i, control, u, v, w, p, q, r):
    """Derivatives of :func:`hydrodynamic_forces` by u, v, w, p, q and r, six forces each."""
    dr = control[0] + work[262 * LANES + i]
    db = control[1] + work[263 * LANES + i]
    ds = control[2] + work[264 * LANES + i]
    uc = control[3] + work[265 * LANES + i]
    nu = sqrt(v * v + w * w)
    duc = uc - u
    crossflow_y = crossflow_z = crossflow_m = crossflow_n = 0.0
    x, height, breadth = work[267 * LANES + i], work[283 * LANES + i], work[299 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[268 * LANES + i], work[284 * LANES + i], work[300 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[269 * LANES + i], work[285 * LANES + i], work[301 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[270 * LANES + i], work[286 * LANES + i], work[302 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[271 * LANES + i], work[287 * LANES + i], work[303 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[272 * LANES + i], work[288 * LANES + i], work[304 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[273 * LANES + i], work[289 * LANES + i], work[305 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[274 * LANES + i], work[290 * LANES + i], work[306 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[275 * LANES + i], work[291 * LANES + i], work[307 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[276 * LANES + i], work[292 * LANES + i], work[308 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[277 * LANES + i], work[293 * LANES + i], work[309 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[278 * LANES + i], work[294 * LANES + i], work[310 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[279 * LANES + i], work[295 * LANES + i], work[311 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[280 * LANES + i], work[296 * LANES + i], work[312 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[281 * LANES + i], work[297 * LANES + i], work[313 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[282 * LANES + i], work[298 * LANES + i], work[314 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    inverse = 1.0 / nu if nu > 0.0 else 0.0
    nu_v, nu_w = v * inverse, w * inverse
    crossflow_y_v = crossflow_y_w = crossflow_y_q = crossflow_y_r = crossflow_z_v = crossflow_z_w = crossflow_z_q = crossflow_z_r = crossflow_m_v = crossflow_m_w = crossflow_m_q = crossflow_m_r = crossflow_n_v = crossflow_n_w = crossflow_n_q = crossflow_n_r = 0.0
    x, height, breadth = work[267 * LANES + i], work[283 * LANES + i], work[299 * LANES + i]
    y_v, y_w, z_v, z_w = crossflow_slopes(x, height, breadth, v, w, q, r)
    crossflow_y_v += y_v
    crossflow_n_v += x * (y_v)
    crossflow_y_w += y_w
    crossflow_n_w += x * (y_w)
    crossflow_y_q += -x * y_w
    crossflow_n_q += x * (-x * y_w)
    crossflow_y_r += x * y_v
    crossflow_n_r += x * (x * y_v)
    crossflow_z_v += z_v
    crossflow_m_v += -x * (z_v)
    crossflow_z_w += z_w
    crossflow_m_w += -x * (z_w)
    crossflow_z_q += -x * z_w
    crossflow_m_q += -x * (-x * z_w)
    crossflow_z_r += x * z_v
    crossflow_m_r += -x * (x * z_v)
    x, height, breadth = work[268 * LANES + i], work[284 * LANES + i], work[300 * LANES + i]
    y_v, y_w, z_v, z_w = crossflow_slopes(x, height, breadth, v, w, q, r)
    crossflow_y_v += y_v
    crossflow_n_v += x * (y_v)
    crossflow_y_w += y_w
    crossflow_n_w += x * (y_w)
    crossflow_y_q += -x * y_w
    crossflow_n_q += x * (-x * y_w)
    crossflow_y_r += x * y_v
    crossflow_n_r += x * (x * y_v)
    crossflow_z_v += z_v
    crossflow_m_v += -x * (z_v)
    crossflow_z_w += z_w
    crossflow_m_w += -x * (z_w)
    crossflow_z_q += -x * z_w
    crossflow_m_q += -x * (-x * z_w)
    crossflow_z_r += x * z_v
    crossflow_m_r += -x * (x * z_v)
    x, height, breadth = work[269 * LANES + i], work[285 * LANES + i], work[301 * LANES + i]
    y_v, y_w, z_v, z_w = crossflow_slopes(x, height, breadth, v, w, q, r)
    crossflow_y_v += y_v
    crossflow_n_v += x * (y_v)
    crossflow_y_w += y_w
    crossflow_n_w += x * (y_w)
    crossflow_y_q += -x * y_w
    crossflow_n_q += x * (-x * y_w)
    crossflow_y_r += x * y_v
    crossflow_n_r += x * (x * y_v)
    crossflow_z_v += z_v
    crossflow_m_v += -x * (z_v)
    crossflow_z_w += z_w
    crossflow_m_w += -x * (z_w)
    crossflow_z_q += -x * z_w
    crossflow_m_q += -x * (-x * z_w)
    crossflow_z_r += x * z_v
    crossflow_m_r += -x * (x * z_v)
    x, height, breadth = work[270 * LANES + i], work[286 * LANES + i], work[302 * LANES + i]
    y_v, y_w, z_v, z_w = crossflow_slopes(x, height, breadth, v, w, q, r)
    crossflow_y_v += y_v
    crossflow_n_v += x * (y_v)
    crossflow_y_w += y_w
    crossflow_n_w += x * (y_w)
    crossflow_y_q += -x * y_w
    crossflow_n_q += x * (-x * y_w)
    crossflow_y_r += x * y_v
    crossflow_n_r += x * (x * y_v)
    crossflow_z_v += z_v
    crossflow_m_v += -x * (z_v)
    crossflow_z_w += z_w
    crossflow_m_w += -x * (z_w)
    crossflow_z_q += -x * z_w
    crossflow_m_q += -x * (-x * z_w)
    crossflow_z_r += x * z_v
    crossflow_m_r += -x * (x * z_v)
    x, height, breadth = work[271 * LANES + i], work[287 * LANES + i], work[303 * LANES + i]
    y_v, y_w, z_v, z_w = crossflow_slopes(x, height, breadth, v, w, q, r)
    crossflow_y_v += y_v
    crossflow_n_v += x * (y_v)
    crossflow_y_w += y_w
    crossflow_n_w += x * (y_w)
    crossflow_y_q += -x * y_w
    crossflow_n_q += x * (-x * y_w)
    crossflow_y_r += x * y_v
    crossflow_n_r += x * (x * y_v)
    crossflow_z_v += z_v
    crossflow_m_v += -x * (z_v)
    crossflow_z_w += z_w
    crossflow_m_w += -x * (z_w)
    crossflow_z_q += -x * z_w
    crossflow_m_q += -x * (-x * z_w)
    crossflow_z_r += x * z_v
    crossflow_m_r += -x * (x * z_v)
    x, height, breadth = work[272 * LANES + i], work[288 * LANES + i], work[304 * LANES + i]
    y_v, y_w, z_v, z_w = crossflow_slopes(x, height, breadth, v, w, q, r)
    crossflow_y_v += y_v
    crossflow_n_v += x * (y_v)
    crossflow_y_w += y_w
    crossflow_n_w += x * (y_w)
    crossflow_y_q += -x * y_w
    crossflow_n_q += x * (-x * y_w)
    crossflow_y_r += x * y_v
    crossflow_n_r += x * (x * y_v)
    crossflow_z_v += z_v
    crossflow_m_v += -x * (z_v)
    crossflow_z_w += z_w
    crossflow_m_w += -x * (z_w)
    crossflow_z_q += -x * z_w
    crossflow_m_q += -x * (-x * z_w)
    crossflow_z_r += x * z_v
    crossflow_m_r += -x * (x * z_v)
    x, height, breadth = work[273 * LANES + i], work[289 * LANES + i], work[305 * LANES + i]
    y_v, y_w, z_v, z_w = crossflow_slopes(x, height, breadth, v, w, q, r)
    crossflow_y_v += y_v
    crossflow_n_v += x * (y_v)
    crossflow_y_w += y_w
    crossflow_n_w += x * (y_w)
    crossflow_y_q += -x * y_w
    crossflow_n_q += x * (-x * y_w)
    crossflow_y_r += x * y_v
    crossflow_n_r += x * (x * y_v)
    crossflow_z_v += z_v
    crossflow_m_v += -x * (z_v)
    crossflow_z_w += z_w
    crossflow_m_w += -x * (z_w)
    crossflow_z_q += -x * z_w
    crossflow_m_q += -x * (-x * z_w)
    crossflow_z_r += x * z_v
    crossflow_m_r += -x * (x * z_v)
    x, height, breadth = work[274 * LANES + i], work[290 * LANES + i], work[306 * LANES + i]
    y_v, y_w, z_v, z_w = crossflow_slopes(x, height, breadth, v, w, q, r)
    crossflow_y_v += y_v
    crossflow_n_v += x * (y_v)
    crossflow_y_w += y_w
    crossflow_n_w += x * (y_w)
    crossflow_y_q += -x * y_w
    crossflow_n_q += x * (-x * y_w)
    crossflow_y_r += x * y_v
    crossflow_n_r += x * (x * y_v)
    crossflow_z_v += z_v
    crossflow_m_v += -x * (z_v)
    crossflow_z_w += z_w
    crossflow_m_w += -x * (z_w)
    crossflow_z_q += -x * z_w
    crossflow_m_q += -x * (-x * z_w)
    crossflow_z_r += x * z_v
    crossflow_m_r += -x * (x * z_v)
    x, height, breadth = work[275 * LANES + i], work[291 * LANES + i], work[307 * LANES + i]
    y_v, y_w, z_v, z_w = crossflow_slopes(x, height, breadth, v, w, q, r)
    crossflow_y_v += y_v
    crossflow_n_v += x * (y_v)
    crossflow_y_w += y_w
    crossflow_n_w += x * (y_w)
    crossflow_y_q += -x * y_w
    crossflow_n_q += x * (-x * y_w)
    crossflow_y_r += x * y_v
    crossflow_n_r += x * (x * y_v)
    crossflow_z_v += z_v
    crossflow_m_v += -x * (z_v)
    crossflow_z_w += z_w
    crossflow_m_w += -x * (z_w)
    crossflow_z_q += -x * z_w
    crossflow_m_q += -x * (-x * z_w)
    crossflow_z_r += x * z_v
    crossflow_m_r += -x * (x * z_v)
    x, height, breadth = work[276 * LANES + i], work[292 * LANES + i], work[308 * LANES + i]
    y_v, y_w, z_v, z_w = crossflow_slopes(x, height, breadth, v, w, q, r)
    crossflow_y_v += y_v
    crossflow_n_v += x * (y_v)
    crossflow_y_w += y_w
    crossflow_n_w += x * (y_w)
    crossflow_y_q += -x * y_w
    crossflow_n_q += x * (-x * y_w)
    crossflow_y_r += x * y_v
    crossflow_n_r += x * (x * y_v)
    crossflow_z_v += z_v
    crossflow_m_v += -x * (z_v)
    crossflow_z_w += z_w
    crossflow_m_w += -x * (z_w)
    crossflow_z_q += -x * z_w
    crossflow_m_q += -x * (-x * z_w)
    crossflow_z_r += x * z_v
    crossflow_m_r += -x * (x * z_v)
    x, height, breadth = work[277 * LANES + i], work[293 * LANES + i], work[309 * LANES + i]
    y_v, y_w, z_v, z_w = crossflow_slopes(x, height, breadth, v, w, q, r)
    crossflow_y_v += y_v
    crossflow_n_v += x * (y_v)
    crossflow_y_w += y_w
    crossflow_n_w += x * (y_w)
    crossflow_y_q += -x * y_w
    crossflow_n_q += x * (-x * y_w)
    crossflow_y_r += x * y_v
    crossflow_n_r += x * (x * y_v)
    crossflow_z_v += z_v
    crossflow_m_v += -x * (z_v)
    crossflow_z_w += z_w
    crossflow_m_w += -x * (z_w)
    crossflow_z_q += -x * z_w
    crossflow_m_q += -x * (-x * z_w)
    crossflow_z_r += x * z_v
    crossflow_m_r += -x * (x * z_v)
    x, height, breadth = work[278 * LANES + i], work[294 * LANES + i], work[310 * LANES + i]
    y_v, y_w, z_v, z_w = crossflow_slopes(x, height, breadth, v, w, q, r)
    crossflow_y_v += y_v
    crossflow_n_v += x * (y_v)
    crossflow_y_w += y_w
    crossflow_n_w += x * (y_w)
    crossflow_y_q += -x * y_w
    crossflow_n_q += x * (-x * y_w)
    crossflow_y_r += x * y_v
    crossflow_n_r += x * (x * y_v)
    crossflow_z_v += z_v
    crossflow_m_v += -x * (z_v)
    crossflow_z_w += z_w
    crossflow_m_w += -x * (z_w)
    crossflow_z_q += -x * z_w
    crossflow_m_q += -x * (-x * z_w)
    crossflow_z_r += x * z_v
    crossflow_m_r += -x * (x * z_v)
    x, height, breadth = work[279 * LANES + i], work[295 * LANES + i], work[311 * LANES + i]
    y_v, y_w, z_v, z_w = crossflow_slopes(x, height, breadth, v, w, q, r)
    crossflow_y_v += y_v
    crossflow_n_v += x * (y_v)
    crossflow_y_w += y_w
    crossflow_n_w += x * (y_w)
    crossflow_y_q += -x * y_w
    crossflow_n_q += x * (-x * y_w)
    crossflow_y_r += x * y_v
    crossflow_n_r += x * (x * y_v)
    crossflow_z_v += z_v
    crossflow_m_v += -x * (z_v)
    crossflow_z_w += z_w
    crossflow_m_w += -x * (z_w)
    crossflow_z_q += -x * z_w
    crossflow_m_q += -x * (-x * z_w)
    crossflow_z_r += x * z_v
    crossflow_m_r += -x * (x * z_v)
    x, height, breadth = work[280 * LANES + i], work[296 * LANES + i], work[312 * LANES + i]
    y_v, y_w, z_v, z_w = crossflow_slopes(x, height, breadth, v, w, q, r)
    crossflow_y_v += y_v
    crossflow_n_v += x * (y_v)
    crossflow_y_w += y_w
    crossflow_n_w += x * (y_w)
    crossflow_y_q += -x * y_w
    crossflow_n_q += x * (-x * y_w)
    crossflow_y_r += x * y_v
    crossflow_n_r += x * (x * y_v)
    crossflow_z_v += z_v
    crossflow_m_v += -x * (z_v)
    crossflow_z_w += z_w
    crossflow_m_w += -x * (z_w)
    crossflow_z_q += -x * z_w
    crossflow_m_q += -x * (-x * z_w)
    crossflow_z_r += x * z_v
    crossflow_m_r += -x * (x * z_v)
    x, height, breadth = work[281 * LANES + i], work[297 * LANES + i], work[313 * LANES + i]
    y_v, y_w, z_v, z_w = crossflow_slopes(x, height, breadth, v, w, q, r)
    crossflow_y_v += y_v
    crossflow_n_v += x * (y_v)
    crossflow_y_w += y_w
    crossflow_n_w += x * (y_w)
    crossflow_y_q += -x * y_w
    crossflow_n_q += x * (-x * y_w)
    crossflow_y_r += x * y_v
    crossflow_n_r += x * (x * y_v)
    crossflow_z_v += z_v
    crossflow_m_v += -x * (z_v)
    crossflow_z_w += z_w
    crossflow_m_w += -x * (z_w)
    crossflow_z_q += -x * z_w
    crossflow_m_q += -x * (-x * z_w)
    crossflow_z_r += x * z_v
    crossflow_m_r += -x * (x * z_v)
    x, height, breadth = work[282 * LANES + i], work[298 * LANES + i], work[314 * LANES + i]
    y_v, y_w, z_v, z_w = crossflow_slopes(x, height, breadth, v, w, q, r)
    crossflow_y_v += y_v
    crossflow_n_v += x * (y_v)
    crossflow_y_w += y_w
    crossflow_n_w += x * (y_w)
    crossflow_y_q += -x * y_w
    crossflow_n_q += x * (-x * y_w)
    crossflow_y_r += x * y_v
    crossflow_n_r += x * (x * y_v)
    crossflow_z_v += z_v
    crossflow_m_v += -x * (z_v)
    crossflow_z_w += z_w
    crossflow_m_w += -x * (z_w)
    crossflow_z_q += -x * z_w
    crossflow_m_q += -x * (-x * z_w)
    crossflow_z_r += x * z_v
    crossflow_m_r += -x * (x * z_v)
    X_u = (
        work[(COEFFICIENTS + 0) * LANES + i] * (u + u)  # Xuu
        + work[(COEFFICIENTS + 3) * LANES + i] * (u*dr*dr + u*dr*dr)  # Xuu_drdr
        + work[(COEFFICIENTS + 4) * LANES + i] * (u*db*db + u*db*db)  # Xuu_dbdb
        + work[(COEFFICIENTS + 5) * LANES + i] * (u*ds*ds + u*ds*ds)  # Xuu_dsds
        + work[(COEFFICIENTS + 12) * LANES + i] * (duc*dr*dr + -1.0*u*dr*dr)  # Xuu_drdr_eta
        + work[(COEFFICIENTS + 13) * LANES + i] * (duc*ds*ds + -1.0*u*ds*ds)  # Xuu_dsds_eta
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
        work[(COEFFICIENTS + 14) * LANES + i] * (u + u)  # Yuu
        + work[(COEFFICIENTS + 15) * LANES + i] * (v)  # Yuv
        + work[(COEFFICIENTS + 18) * LANES + i] * (u*dr + u*dr)  # Yuu_dr
        + work[(COEFFICIENTS + 20) * LANES + i] * (p)  # Yup
        + work[(COEFFICIENTS + 21) * LANES + i] * (r)  # Yur
        + work[(COEFFICIENTS + 31) * LANES + i] * (-1.0*v)  # Yuv_eta
        + work[(COEFFICIENTS + 32) * LANES + i] * (-1.0*r)  # Yur_eta
        + work[(COEFFICIENTS + 33) * LANES + i] * (duc*dr + -1.0*u*dr)  # Yuu_dr_eta
    )
    Y_v = (
        work[(COEFFICIENTS + 15) * LANES + i] * (u)  # Yuv
        + work[(COEFFICIENTS + 16) * LANES + i] * (w)  # Yvw
        + work[(COEFFICIENTS + 17) * LANES + i] * (nu + nu_v*v)  # Yv_absnu
        + work[(COEFFICIENTS + 22) * LANES + i] * (q)  # Yvq
        + work[(COEFFICIENTS + 30) * LANES + i] * (crossflow_y_v)  # Ycrossflow
        + work[(COEFFICIENTS + 31) * LANES + i] * (duc)  # Yuv_eta
    )
    Y_w = (
        work[(COEFFICIENTS + 16) * LANES + i] * (v)  # Yvw
        + work[(COEFFICIENTS + 17) * LANES + i] * (nu_w*v)  # Yv_absnu
        + work[(COEFFICIENTS + 23) * LANES + i] * (p)  # Ywp
        + work[(COEFFICIENTS + 24) * LANES + i] * (r)  # Ywr
        + work[(COEFFICIENTS + 30) * LANES + i] * (crossflow_y_w)  # Ycrossflow
    )
    Y_p = (
        work[(COEFFICIENTS + 20) * LANES + i] * (u)  # Yup
        + work[(COEFFICIENTS + 23) * LANES + i] * (w)  # Ywp
        + work[(COEFFICIENTS + 27) * LANES + i] * (abs(p) + sgn(p)*p)  # Yp_absp
        + work[(COEFFICIENTS + 28) * LANES + i] * (q)  # Ypq
    )
    Y_q = (
        work[(COEFFICIENTS + 22) * LANES + i] * (v)  # Yvq
        + work[(COEFFICIENTS + 28) * LANES + i] * (p)  # Ypq
        + work[(COEFFICIENTS + 29) * LANES + i] * (r)  # Yqr
        + work[(COEFFICIENTS + 30) * LANES + i] * (crossflow_y_q)  # Ycrossflow
    )
    Y_r = (
        work[(COEFFICIENTS + 21) * LANES + i] * (u)  # Yur
        + work[(COEFFICIENTS + 24) * LANES + i] * (w)  # Ywr
        + work[(COEFFICIENTS + 29) * LANES + i] * (q)  # Yqr
        + work[(COEFFICIENTS + 30) * LANES + i] * (crossflow_y_r)  # Ycrossflow
        + work[(COEFFICIENTS + 32) * LANES + i] * (duc)  # Yur_eta
    )
    Z_u = (
        work[(COEFFICIENTS + 34) * LANES + i] * (u + u)  # Zuu
        + work[(COEFFICIENTS + 35) * LANES + i] * (w)  # Zuw
        + work[(COEFFICIENTS + 37) * LANES + i] * (u*db + u*db)  # Zuu_db
        + work[(COEFFICIENTS + 38) * LANES + i] * (u*ds + u*ds)  # Zuu_ds
        + work[(COEFFICIENTS + 39) * LANES + i] * (abs(w))  # Zu_absw
        + work[(COEFFICIENTS + 42) * LANES + i] * (q)  # Zuq
        + work[(COEFFICIENTS + 50) * LANES + i] * (-1.0*w)  # Zuw_eta
        + work[(COEFFICIENTS + 51) * LANES + i] * (-1.0*q)  # Zuq_eta
        + work[(COEFFICIENTS + 52) * LANES + i] * (duc*ds + -1.0*u*ds)  # Zuu_ds_eta
    )
    Z_v = (
        work[(COEFFICIENTS + 36) * LANES + i] * (v + v)  # Zvv
        + work[(COEFFICIENTS + 40) * LANES + i] * (nu_v*abs(w))  # Zabsw_nu
        + work[(COEFFICIENTS + 43) * LANES + i] * (p)  # Zvp
        + work[(COEFFICIENTS + 44) * LANES + i] * (r)  # Zvr
        + work[(COEFFICIENTS + 49) * LANES + i] * (crossflow_z_v)  # Zcrossflow
    )
    Z_w = (
        work[(COEFFICIENTS + 35) * LANES + i] * (u)  # Zuw
        + work[(COEFFICIENTS + 39) * LANES + i] * (sgn(w)*u)  # Zu_absw
        + work[(COEFFICIENTS + 40) * LANES + i] * (sgn(w)*nu + nu_w*abs(w))  # Zabsw_nu
        + work[(COEFFICIENTS + 49) * LANES + i] * (crossflow_z_w)  # Zcrossflow
        + work[(COEFFICIENTS + 50) * LANES + i] * (duc)  # Zuw_eta
    )
    Z_p = (
        work[(COEFFICIENTS + 43) * LANES + i] * (v)  # Zvp
        + work[(COEFFICIENTS + 46) * LANES + i] * (p + p)  # Zpp
        + work[(COEFFICIENTS + 48) * LANES + i] * (r)  # Zrp
    )
    Z_q = (
        work[(COEFFICIENTS + 42) * LANES + i] * (u)  # Zuq
        + work[(COEFFICIENTS + 49) * LANES + i] * (crossflow_z_q)  # Zcrossflow
        + work[(COEFFICIENTS + 51) * LANES + i] * (duc)  # Zuq_eta
    )
    Z_r = (
        work[(COEFFICIENTS + 44) * LANES + i] * (v)  # Zvr
        + work[(COEFFICIENTS + 47) * LANES + i] * (r + r)  # Zrr
        + work[(COEFFICIENTS + 48) * LANES + i] * (p)  # Zrp
        + work[(COEFFICIENTS + 49) * LANES + i] * (crossflow_z_r)  # Zcrossflow
    )
    K_u = (
        work[(COEFFICIENTS + 53) * LANES + i] * (u + u)  # Kuu
        + work[(COEFFICIENTS + 54) * LANES + i] * (v)  # Kuv
        + work[(COEFFICIENTS + 56) * LANES + i] * (u*dr + u*dr)  # Kuu_dr
        + work[(COEFFICIENTS + 58) * LANES + i] * (p)  # Kup
        + work[(COEFFICIENTS + 59) * LANES + i] * (r)  # Kur
        + work[(COEFFICIENTS + 68) * LANES + i] * (-1.0*p)  # Kup_eta
        + work[(COEFFICIENTS + 69) * LANES + i] * (duc*dr + -1.0*u*dr)  # Kuu_dr_eta
    )
    K_v = (
        work[(COEFFICIENTS + 54) * LANES + i] * (u)  # Kuv
        + work[(COEFFICIENTS + 55) * LANES + i] * (w)  # Kvw
        + work[(COEFFICIENTS + 60) * LANES + i] * (q)  # Kvq
    )
    K_w = (
        work[(COEFFICIENTS + 55) * LANES + i] * (v)  # Kvw
        + work[(COEFFICIENTS + 61) * LANES + i] * (p)  # Kwp
        + work[(COEFFICIENTS + 62) * LANES + i] * (r)  # Kwr
    )
    K_p = (
        work[(COEFFICIENTS + 58) * LANES + i] * (u)  # Kup
        + work[(COEFFICIENTS + 61) * LANES + i] * (w)  # Kwp
        + work[(COEFFICIENTS + 66) * LANES + i] * (q)  # Kpq
        + work[(COEFFICIENTS + 67) * LANES + i] * (abs(p) + sgn(p)*p)  # Kp_absp
        + work[(COEFFICIENTS + 68) * LANES + i] * (duc)  # Kup_eta
    )
    K_q = (
        work[(COEFFICIENTS + 60) * LANES + i] * (v)  # Kvq
        + work[(COEFFICIENTS + 65) * LANES + i] * (r)  # Kqr
        + work[(COEFFICIENTS + 66) * LANES + i] * (p)  # Kpq
    )
    K_r = (
        work[(COEFFICIENTS + 59) * LANES + i] * (u)  # Kur
        + work[(COEFFICIENTS + 62) * LANES + i] * (w)  # Kwr
        + work[(COEFFICIENTS + 65) * LANES + i] * (q)  # Kqr
    )
    M_u = (
        work[(COEFFICIENTS + 70) * LANES + i] * (u + u)  # Muu
        + work[(COEFFICIENTS + 71) * LANES + i] * (w)  # Muw
        + work[(COEFFICIENTS + 73) * LANES + i] * (u*db + u*db)  # Muu_db
        + work[(COEFFICIENTS + 74) * LANES + i] * (u*ds + u*ds)  # Muu_ds
        + work[(COEFFICIENTS + 75) * LANES + i] * (abs(w))  # Mu_absw
        + work[(COEFFICIENTS + 78) * LANES + i] * (q)  # Muq
        + work[(COEFFICIENTS + 86) * LANES + i] * (-1.0*w)  # Muw_eta
        + work[(COEFFICIENTS + 87) * LANES + i] * (-1.0*q)  # Muq_eta
        + work[(COEFFICIENTS + 88) * LANES + i] * (duc*ds + -1.0*u*ds)  # Muu_ds_eta
    )
    M_v = (
        work[(COEFFICIENTS + 72) * LANES + i] * (v + v)  # Mvv
        + work[(COEFFICIENTS + 76) * LANES + i] * (nu_v*abs(w))  # Mabsw_nu
        + work[(COEFFICIENTS + 79) * LANES + i] * (p)  # Mvp
        + work[(COEFFICIENTS + 80) * LANES + i] * (r)  # Mvr
        + work[(COEFFICIENTS + 85) * LANES + i] * (crossflow_m_v)  # Mcrossflow
    )
    M_w = (
        work[(COEFFICIENTS + 71) * LANES + i] * (u)  # Muw
        + work[(COEFFICIENTS + 75) * LANES + i] * (sgn(w)*u)  # Mu_absw
        + work[(COEFFICIENTS + 76) * LANES + i] * (sgn(w)*nu + nu_w*abs(w))  # Mabsw_nu
        + work[(COEFFICIENTS + 85) * LANES + i] * (crossflow_m_w)  # Mcrossflow
        + work[(COEFFICIENTS + 86) * LANES + i] * (duc)  # Muw_eta
    )
    M_p = (
        work[(COEFFICIENTS + 79) * LANES + i] * (v)  # Mvp
        + work[(COEFFICIENTS + 82) * LANES + i] * (p + p)  # Mpp
        + work[(COEFFICIENTS + 84) * LANES + i] * (r)  # Mrp
    )
    M_q = (
        work[(COEFFICIENTS + 78) * LANES + i] * (u)  # Muq
        + work[(COEFFICIENTS + 85) * LANES + i] * (crossflow_m_q)  # Mcrossflow
        + work[(COEFFICIENTS + 87) * LANES + i] * (duc)  # Muq_eta
    )
    M_r = (
        work[(COEFFICIENTS + 80) * LANES + i] * (v)  # Mvr
        + work[(COEFFICIENTS + 83) * LANES + i] * (r + r)  # Mrr
        + work[(COEFFICIENTS + 84) * LANES + i] * (p)  # Mrp
        + work[(COEFFICIENTS + 85) * LANES + i] * (crossflow_m_r)  # Mcrossflow
    )
    N_u = (
        work[(COEFFICIENTS + 89) * LANES + i] * (u + u)  # Nuu
        + work[(COEFFICIENTS + 90) * LANES + i] * (v)  # Nuv
        + work[(COEFFICIENTS + 93) * LANES + i] * (u*dr + u*dr)  # Nuu_dr
        + work[(COEFFICIENTS + 95) * LANES + i] * (p)  # Nup
        + work[(COEFFICIENTS + 96) * LANES + i] * (r)  # Nur
        + work[(COEFFICIENTS + 105) * LANES + i] * (-1.0*v)  # Nuv_eta
        + work[(COEFFICIENTS + 106) * LANES + i] * (-1.0*r)  # Nur_eta
        + work[(COEFFICIENTS + 107) * LANES + i] * (duc*dr + -1.0*u*dr)  # Nuu_dr_eta
    )
    N_v = (
        work[(COEFFICIENTS + 90) * LANES + i] * (u)  # Nuv
        + work[(COEFFICIENTS + 91) * LANES + i] * (w)  # Nvw
        + work[(COEFFICIENTS + 92) * LANES + i] * (nu + nu_v*v)  # Nv_absnu
        + work[(COEFFICIENTS + 97) * LANES + i] * (q)  # Nvq
        + work[(COEFFICIENTS + 104) * LANES + i] * (crossflow_n_v)  # Ncrossflow
        + work[(COEFFICIENTS + 105) * LANES + i] * (duc)  # Nuv_eta
    )
    N_w = (
        work[(COEFFICIENTS + 91) * LANES + i] * (v)  # Nvw
        + work[(COEFFICIENTS + 92) * LANES + i] * (nu_w*v)  # Nv_absnu
        + work[(COEFFICIENTS + 98) * LANES + i] * (p)  # Nwp
        + work[(COEFFICIENTS + 99) * LANES + i] * (r)  # Nwr
        + work[(COEFFICIENTS + 104) * LANES + i] * (crossflow_n_w)  # Ncrossflow
    )
    N_p = (
        work[(COEFFICIENTS + 95) * LANES + i] * (u)  # Nup
        + work[(COEFFICIENTS + 98) * LANES + i] * (w)  # Nwp
        + work[(COEFFICIENTS + 102) * LANES + i] * (q)  # Npq
    )
    N_q = (
        work[(COEFFICIENTS + 97) * LANES + i] * (v)  # Nvq
        + work[(COEFFICIENTS + 102) * LANES + i] * (p)  # Npq
        + work[(COEFFICIENTS + 103) * LANES + i] * (r)  # Nqr
        + work[(COEFFICIENTS + 104) * LANES + i] * (crossflow_n_q)  # Ncrossflow
    )
    N_r = (
        work[(COEFFICIENTS + 96) * LANES + i] * (u)  # Nur
        + work[(COEFFICIENTS + 99) * LANES + i] * (w)  # Nwr
        + work[(COEFFICIENTS + 103) * LANES + i] * (q)  # Nqr
        + work[(COEFFICIENTS + 104) * LANES + i] * (crossflow_n_r)  # Ncrossflow
        + work[(COEFFICIENTS + 106) * LANES + i] * (duc)  # Nur_eta
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
    dr = control[0] + work[262 * LANES + i]
    db = control[1] + work[263 * LANES + i]
    ds = control[2] + work[264 * LANES + i]
    uc = control[3] + work[265 * LANES + i]
    nu = sqrt(v * v + w * w)
    duc = uc - u
    crossflow_y = crossflow_z = crossflow_m = crossflow_n = 0.0
    x, height, breadth = work[267 * LANES + i], work[283 * LANES + i], work[299 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[268 * LANES + i], work[284 * LANES + i], work[300 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[269 * LANES + i], work[285 * LANES + i], work[301 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[270 * LANES + i], work[286 * LANES + i], work[302 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[271 * LANES + i], work[287 * LANES + i], work[303 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[272 * LANES + i], work[288 * LANES + i], work[304 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[273 * LANES + i], work[289 * LANES + i], work[305 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[274 * LANES + i], work[290 * LANES + i], work[306 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[275 * LANES + i], work[291 * LANES + i], work[307 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[276 * LANES + i], work[292 * LANES + i], work[308 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[277 * LANES + i], work[293 * LANES + i], work[309 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[278 * LANES + i], work[294 * LANES + i], work[310 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[279 * LANES + i], work[295 * LANES + i], work[311 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[280 * LANES + i], work[296 * LANES + i], work[312 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[281 * LANES + i], work[297 * LANES + i], work[313 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
    x, height, breadth = work[282 * LANES + i], work[298 * LANES + i], work[314 * LANES + i]
    y, z = crossflow(x, height, breadth, v, w, q, r)
    crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y
    crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z
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
    row[12] = u*duc*dr*dr  # Xuu_drdr_eta
    row[13] = u*duc*ds*ds  # Xuu_dsds_eta
    row[14] = u*u  # Yuu
    row[15] = u*v  # Yuv
    row[16] = v*w  # Yvw
    row[17] = v*nu  # Yv_absnu
    row[18] = u*u*dr  # Yuu_dr
    row[19] = vdot  # Yvdot
    row[20] = u*p  # Yup
    row[21] = u*r  # Yur
    row[22] = v*q  # Yvq
    row[23] = w*p  # Ywp
    row[24] = w*r  # Ywr
    row[25] = pdot  # Ypdot
    row[26] = rdot  # Yrdot
    row[27] = p*abs(p)  # Yp_absp
    row[28] = p*q  # Ypq
    row[29] = q*r  # Yqr
    row[30] = crossflow_y  # Ycrossflow
    row[31] = v*duc  # Yuv_eta
    row[32] = r*duc  # Yur_eta
    row[33] = u*duc*dr  # Yuu_dr_eta
    row[34] = u*u  # Zuu
    row[35] = u*w  # Zuw
    row[36] = v*v  # Zvv
    row[37] = u*u*db  # Zuu_db
    row[38] = u*u*ds  # Zuu_ds
    row[39] = u*abs(w)  # Zu_absw
    row[40] = abs(w)*nu  # Zabsw_nu
    row[41] = wdot  # Zwdot
    row[42] = u*q  # Zuq
    row[43] = v*p  # Zvp
    row[44] = v*r  # Zvr
    row[45] = qdot  # Zqdot
    row[46] = p*p  # Zpp
    row[47] = r*r  # Zrr
    row[48] = r*p  # Zrp
    row[49] = crossflow_z  # Zcrossflow
    row[50] = w*duc  # Zuw_eta
    row[51] = q*duc  # Zuq_eta
    row[52] = u*duc*ds  # Zuu_ds_eta
    row[53] = u*u  # Kuu
    row[54] = u*v  # Kuv
    row[55] = v*w  # Kvw
    row[56] = u*u*dr  # Kuu_dr
    row[57] = vdot  # Kvdot
    row[58] = u*p  # Kup
    row[59] = u*r  # Kur
    row[60] = v*q  # Kvq
    row[61] = w*p  # Kwp
    row[62] = w*r  # Kwr
    row[63] = pdot  # Kpdot
    row[64] = rdot  # Krdot
    row[65] = q*r  # Kqr
    row[66] = p*q  # Kpq
    row[67] = p*abs(p)  # Kp_absp
    row[68] = p*duc  # Kup_eta
    row[69] = u*duc*dr  # Kuu_dr_eta
    row[70] = u*u  # Muu
    row[71] = u*w  # Muw
    row[72] = v*v  # Mvv
    row[73] = u*u*db  # Muu_db
    row[74] = u*u*ds  # Muu_ds
    row[75] = u*abs(w)  # Mu_absw
    row[76] = abs(w)*nu  # Mabsw_nu
    row[77] = wdot  # Mwdot
    row[78] = u*q  # Muq
    row[79] = v*p  # Mvp
    row[80] = v*r  # Mvr
    row[81] = qdot  # Mqdot
    row[82] = p*p  # Mpp
    row[83] = r*r  # Mrr
    row[84] = r*p  # Mrp
    row[85] = crossflow_m  # Mcrossflow
    row[86] = w*duc  # Muw_eta
    row[87] = q*duc  # Muq_eta
    row[88] = u*duc*ds  # Muu_ds_eta
    row[89] = u*u  # Nuu
    row[90] = u*v  # Nuv
    row[91] = v*w  # Nvw
    row[92] = v*nu  # Nv_absnu
    row[93] = u*u*dr  # Nuu_dr
    row[94] = vdot  # Nvdot
    row[95] = u*p  # Nup
    row[96] = u*r  # Nur
    row[97] = v*q  # Nvq
    row[98] = w*p  # Nwp
    row[99] = w*r  # Nwr
    row[100] = pdot  # Npdot
    row[101] = rdot  # Nrdot
    row[102] = p*q  # Npq
    row[103] = q*r  # Nqr
    row[104] = crossflow_n  # Ncrossflow
    row[105] = v*duc  # Nuv_eta
    row[106] = r*duc  # Nur_eta
    row[107] = u*duc*dr  # Nuu_dr_eta


@inline
def store_control_slopes(slopes, work, i, control, u, v, w, p, q, r):
    """Add the derivatives of the forces by the controls into `slopes` (6, N_CONTROLS)."""
    dr = control[0] + work[262 * LANES + i]
    db = control[1] + work[263 * LANES + i]
    ds = control[2] + work[264 * LANES + i]
    uc = control[3] + work[265 * LANES + i]
    duc = uc - u
    slopes[0, 0] = (
        work[(COEFFICIENTS + 3) * LANES + i] * (u*u*dr + u*u*dr)  # Xuu_drdr
        + work[(COEFFICIENTS + 12) * LANES + i] * (u*duc*dr + u*duc*dr)  # Xuu_drdr_eta
    )
    slopes[1, 0] = (
        work[(COEFFICIENTS + 18) * LANES + i] * (u*u)  # Yuu_dr
        + work[(COEFFICIENTS + 33) * LANES + i] * (u*duc)  # Yuu_dr_eta
    )
    slopes[3, 0] = (
        work[(COEFFICIENTS + 56) * LANES + i] * (u*u)  # Kuu_dr
        + work[(COEFFICIENTS + 69) * LANES + i] * (u*duc)  # Kuu_dr_eta
    )
    slopes[5, 0] = (
        work[(COEFFICIENTS + 93) * LANES + i] * (u*u)  # Nuu_dr
        + work[(COEFFICIENTS + 107) * LANES + i] * (u*duc)  # Nuu_dr_eta
    )
    slopes[0, 1] = (
        work[(COEFFICIENTS + 4) * LANES + i] * (u*u*db + u*u*db)  # Xuu_dbdb
    )
    slopes[2, 1] = (
        work[(COEFFICIENTS + 37) * LANES + i] * (u*u)  # Zuu_db
    )
    slopes[4, 1] = (
        work[(COEFFICIENTS + 73) * LANES + i] * (u*u)  # Muu_db
    )
    slopes[0, 2] = (
        work[(COEFFICIENTS + 5) * LANES + i] * (u*u*ds + u*u*ds)  # Xuu_dsds
        + work[(COEFFICIENTS + 13) * LANES + i] * (u*duc*ds + u*duc*ds)  # Xuu_dsds_eta
    )
    slopes[2, 2] = (
        work[(COEFFICIENTS + 38) * LANES + i] * (u*u)  # Zuu_ds
        + work[(COEFFICIENTS + 52) * LANES + i] * (u*duc)  # Zuu_ds_eta
    )
    slopes[4, 2] = (
        work[(COEFFICIENTS + 74) * LANES + i] * (u*u)  # Muu_ds
        + work[(COEFFICIENTS + 88) * LANES + i] * (u*duc)  # Muu_ds_eta
    )
    slopes[0, 3] = (
        work[(COEFFICIENTS + 12) * LANES + i] * (u*dr*dr)  # Xuu_drdr_eta
        + work[(COEFFICIENTS + 13) * LANES + i] * (u*ds*ds)  # Xuu_dsds_eta
    )
    slopes[1, 3] = (
        work[(COEFFICIENTS + 31) * LANES + i] * (v)  # Yuv_eta
        + work[(COEFFICIENTS + 32) * LANES + i] * (r)  # Yur_eta
        + work[(COEFFICIENTS + 33) * LANES + i] * (u*dr)  # Yuu_dr_eta
    )
    slopes[2, 3] = (
        work[(COEFFICIENTS + 50) * LANES + i] * (w)  # Zuw_eta
        + work[(COEFFICIENTS + 51) * LANES + i] * (q)  # Zuq_eta
        + work[(COEFFICIENTS + 52) * LANES + i] * (u*ds)  # Zuu_ds_eta
    )
    slopes[3, 3] = (
        work[(COEFFICIENTS + 68) * LANES + i] * (p)  # Kup_eta
        + work[(COEFFICIENTS + 69) * LANES + i] * (u*dr)  # Kuu_dr_eta
    )
    slopes[4, 3] = (
        work[(COEFFICIENTS + 86) * LANES + i] * (w)  # Muw_eta
        + work[(COEFFICIENTS + 87) * LANES + i] * (q)  # Muq_eta
        + work[(COEFFICIENTS + 88) * LANES + i] * (u*ds)  # Muu_ds_eta
    )
    slopes[5, 3] = (
        work[(COEFFICIENTS + 105) * LANES + i] * (v)  # Nuv_eta
        + work[(COEFFICIENTS + 106) * LANES + i] * (r)  # Nur_eta
        + work[(COEFFICIENTS + 107) * LANES + i] * (u*dr)  # Nuu_dr_eta
    )
