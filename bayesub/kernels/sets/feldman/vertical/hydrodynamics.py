"""Hydrodynamic forces of one lane, by bayesub.model.equations.generate: do not edit.

Equations 'feldman', vertical sub-problem, 34 of 108 terms.
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
ADDED_MASS = ((0, 0, 6), (2, 2, 41), (2, 4, 45), (4, 2, 77), (4, 4, 81))


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
        + work[(COEFFICIENTS + 4) * LANES + i] * (u*u*db*db)  # Xuu_dbdb
        + work[(COEFFICIENTS + 5) * LANES + i] * (u*u*ds*ds)  # Xuu_dsds
        + work[(COEFFICIENTS + 8) * LANES + i] * (w*q)  # Xwq
        + work[(COEFFICIENTS + 9) * LANES + i] * (q*q)  # Xqq
        + work[(COEFFICIENTS + 13) * LANES + i] * (u*duc*ds*ds)  # Xuu_dsds_eta
    )
    Y = 0.0
    Z = (
        work[(COEFFICIENTS + 34) * LANES + i] * (u*u)  # Zuu
        + work[(COEFFICIENTS + 35) * LANES + i] * (u*w)  # Zuw
        + work[(COEFFICIENTS + 37) * LANES + i] * (u*u*db)  # Zuu_db
        + work[(COEFFICIENTS + 38) * LANES + i] * (u*u*ds)  # Zuu_ds
        + work[(COEFFICIENTS + 39) * LANES + i] * (u*abs(w))  # Zu_absw
        + work[(COEFFICIENTS + 40) * LANES + i] * (abs(w)*nu)  # Zabsw_nu
        + work[(COEFFICIENTS + 42) * LANES + i] * (u*q)  # Zuq
        + work[(COEFFICIENTS + 49) * LANES + i] * (crossflow_z)  # Zcrossflow
        + work[(COEFFICIENTS + 50) * LANES + i] * (w*duc)  # Zuw_eta
        + work[(COEFFICIENTS + 51) * LANES + i] * (q*duc)  # Zuq_eta
        + work[(COEFFICIENTS + 52) * LANES + i] * (u*duc*ds)  # Zuu_ds_eta
    )
    K = 0.0
    M = (
        work[(COEFFICIENTS + 70) * LANES + i] * (u*u)  # Muu
        + work[(COEFFICIENTS + 71) * LANES + i] * (u*w)  # Muw
        + work[(COEFFICIENTS + 73) * LANES + i] * (u*u*db)  # Muu_db
        + work[(COEFFICIENTS + 74) * LANES + i] * (u*u*ds)  # Muu_ds
        + work[(COEFFICIENTS + 75) * LANES + i] * (u*abs(w))  # Mu_absw
        + work[(COEFFICIENTS + 76) * LANES + i] * (abs(w)*nu)  # Mabsw_nu
        + work[(COEFFICIENTS + 78) * LANES + i] * (u*q)  # Muq
        + work[(COEFFICIENTS + 85) * LANES + i] * (crossflow_m)  # Mcrossflow
        + work[(COEFFICIENTS + 86) * LANES + i] * (w*duc)  # Muw_eta
        + work[(COEFFICIENTS + 87) * LANES + i] * (q*duc)  # Muq_eta
        + work[(COEFFICIENTS + 88) * LANES + i] * (u*duc*ds)  # Muu_ds_eta
    )
    N = 0.0
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
        + work[(COEFFICIENTS + 13) * LANES + i] * (duc*ds*ds + -1.0*u*ds*ds)  # Xuu_dsds_eta
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
        + work[(COEFFICIENTS + 49) * LANES + i] * (crossflow_z_v)  # Zcrossflow
    )
    Z_w = (
        work[(COEFFICIENTS + 35) * LANES + i] * (u)  # Zuw
        + work[(COEFFICIENTS + 39) * LANES + i] * (sgn(w)*u)  # Zu_absw
        + work[(COEFFICIENTS + 40) * LANES + i] * (sgn(w)*nu + nu_w*abs(w))  # Zabsw_nu
        + work[(COEFFICIENTS + 49) * LANES + i] * (crossflow_z_w)  # Zcrossflow
        + work[(COEFFICIENTS + 50) * LANES + i] * (duc)  # Zuw_eta
    )
    Z_p = 0.0
    Z_q = (
        work[(COEFFICIENTS + 42) * LANES + i] * (u)  # Zuq
        + work[(COEFFICIENTS + 49) * LANES + i] * (crossflow_z_q)  # Zcrossflow
        + work[(COEFFICIENTS + 51) * LANES + i] * (duc)  # Zuq_eta
    )
    Z_r = (
        work[(COEFFICIENTS + 44) * LANES + i] * (v)  # Zvr
        + work[(COEFFICIENTS + 47) * LANES + i] * (r + r)  # Zrr
        + work[(COEFFICIENTS + 49) * LANES + i] * (crossflow_z_r)  # Zcrossflow
    )
    K_u = 0.0
    K_v = 0.0
    K_w = 0.0
    K_p = 0.0
    K_q = 0.0
    K_r = 0.0
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
        + work[(COEFFICIENTS + 85) * LANES + i] * (crossflow_m_v)  # Mcrossflow
    )
    M_w = (
        work[(COEFFICIENTS + 71) * LANES + i] * (u)  # Muw
        + work[(COEFFICIENTS + 75) * LANES + i] * (sgn(w)*u)  # Mu_absw
        + work[(COEFFICIENTS + 76) * LANES + i] * (sgn(w)*nu + nu_w*abs(w))  # Mabsw_nu
        + work[(COEFFICIENTS + 85) * LANES + i] * (crossflow_m_w)  # Mcrossflow
        + work[(COEFFICIENTS + 86) * LANES + i] * (duc)  # Muw_eta
    )
    M_p = 0.0
    M_q = (
        work[(COEFFICIENTS + 78) * LANES + i] * (u)  # Muq
        + work[(COEFFICIENTS + 85) * LANES + i] * (crossflow_m_q)  # Mcrossflow
        + work[(COEFFICIENTS + 87) * LANES + i] * (duc)  # Muq_eta
    )
    M_r = (
        work[(COEFFICIENTS + 80) * LANES + i] * (v)  # Mvr
        + work[(COEFFICIENTS + 83) * LANES + i] * (r + r)  # Mrr
        + work[(COEFFICIENTS + 85) * LANES + i] * (crossflow_m_r)  # Mcrossflow
    )
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
    row[12] = 0.0  # Xuu_drdr_eta
    row[13] = u*duc*ds*ds  # Xuu_dsds_eta
    row[14] = 0.0  # Yuu
    row[15] = 0.0  # Yuv
    row[16] = 0.0  # Yvw
    row[17] = 0.0  # Yv_absnu
    row[18] = 0.0  # Yuu_dr
    row[19] = 0.0  # Yvdot
    row[20] = 0.0  # Yup
    row[21] = 0.0  # Yur
    row[22] = 0.0  # Yvq
    row[23] = 0.0  # Ywp
    row[24] = 0.0  # Ywr
    row[25] = 0.0  # Ypdot
    row[26] = 0.0  # Yrdot
    row[27] = 0.0  # Yp_absp
    row[28] = 0.0  # Ypq
    row[29] = 0.0  # Yqr
    row[30] = 0.0  # Ycrossflow
    row[31] = 0.0  # Yuv_eta
    row[32] = 0.0  # Yur_eta
    row[33] = 0.0  # Yuu_dr_eta
    row[34] = u*u  # Zuu
    row[35] = u*w  # Zuw
    row[36] = 0.0  # Zvv
    row[37] = u*u*db  # Zuu_db
    row[38] = u*u*ds  # Zuu_ds
    row[39] = u*abs(w)  # Zu_absw
    row[40] = abs(w)*nu  # Zabsw_nu
    row[41] = wdot  # Zwdot
    row[42] = u*q  # Zuq
    row[43] = 0.0  # Zvp
    row[44] = 0.0  # Zvr
    row[45] = qdot  # Zqdot
    row[46] = 0.0  # Zpp
    row[47] = 0.0  # Zrr
    row[48] = 0.0  # Zrp
    row[49] = crossflow_z  # Zcrossflow
    row[50] = w*duc  # Zuw_eta
    row[51] = q*duc  # Zuq_eta
    row[52] = u*duc*ds  # Zuu_ds_eta
    row[53] = 0.0  # Kuu
    row[54] = 0.0  # Kuv
    row[55] = 0.0  # Kvw
    row[56] = 0.0  # Kuu_dr
    row[57] = 0.0  # Kvdot
    row[58] = 0.0  # Kup
    row[59] = 0.0  # Kur
    row[60] = 0.0  # Kvq
    row[61] = 0.0  # Kwp
    row[62] = 0.0  # Kwr
    row[63] = 0.0  # Kpdot
    row[64] = 0.0  # Krdot
    row[65] = 0.0  # Kqr
    row[66] = 0.0  # Kpq
    row[67] = 0.0  # Kp_absp
    row[68] = 0.0  # Kup_eta
    row[69] = 0.0  # Kuu_dr_eta
    row[70] = u*u  # Muu
    row[71] = u*w  # Muw
    row[72] = 0.0  # Mvv
    row[73] = u*u*db  # Muu_db
    row[74] = u*u*ds  # Muu_ds
    row[75] = u*abs(w)  # Mu_absw
    row[76] = abs(w)*nu  # Mabsw_nu
    row[77] = wdot  # Mwdot
    row[78] = u*q  # Muq
    row[79] = 0.0  # Mvp
    row[80] = 0.0  # Mvr
    row[81] = qdot  # Mqdot
    row[82] = 0.0  # Mpp
    row[83] = 0.0  # Mrr
    row[84] = 0.0  # Mrp
    row[85] = crossflow_m  # Mcrossflow
    row[86] = w*duc  # Muw_eta
    row[87] = q*duc  # Muq_eta
    row[88] = u*duc*ds  # Muu_ds_eta
    row[89] = 0.0  # Nuu
    row[90] = 0.0  # Nuv
    row[91] = 0.0  # Nvw
    row[92] = 0.0  # Nv_absnu
    row[93] = 0.0  # Nuu_dr
    row[94] = 0.0  # Nvdot
    row[95] = 0.0  # Nup
    row[96] = 0.0  # Nur
    row[97] = 0.0  # Nvq
    row[98] = 0.0  # Nwp
    row[99] = 0.0  # Nwr
    row[100] = 0.0  # Npdot
    row[101] = 0.0  # Nrdot
    row[102] = 0.0  # Npq
    row[103] = 0.0  # Nqr
    row[104] = 0.0  # Ncrossflow
    row[105] = 0.0  # Nuv_eta
    row[106] = 0.0  # Nur_eta
    row[107] = 0.0  # Nuu_dr_eta


@inline
def store_control_slopes(slopes, work, i, control, u, v, w, p, q, r):
    """Add the derivatives of the forces by the controls into `slopes` (6, N_CONTROLS)."""
    dr = control[0] + work[262 * LANES + i]
    db = control[1] + work[263 * LANES + i]
    ds = control[2] + work[264 * LANES + i]
    uc = control[3] + work[265 * LANES + i]
    duc = uc - u
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
    slopes[2, 3] = (
        work[(COEFFICIENTS + 50) * LANES + i] * (w)  # Zuw_eta
        + work[(COEFFICIENTS + 51) * LANES + i] * (q)  # Zuq_eta
        + work[(COEFFICIENTS + 52) * LANES + i] * (u*ds)  # Zuu_ds_eta
    )
    slopes[4, 3] = (
        work[(COEFFICIENTS + 86) * LANES + i] * (w)  # Muw_eta
        + work[(COEFFICIENTS + 87) * LANES + i] * (q)  # Muq_eta
        + work[(COEFFICIENTS + 88) * LANES + i] * (u*ds)  # Muu_ds_eta
    )
