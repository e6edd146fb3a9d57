"""Hydrodynamic forces of one lane, by bayesub.model.equations.generate: do not edit.

Equations 'feldman', horizontal sub-problem, 29 of 108 terms.
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
ADDED_MASS = ((0, 0, 6), (1, 1, 19), (1, 5, 26), (5, 1, 94), (5, 5, 101))


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
        + work[(COEFFICIENTS + 3) * LANES + i] * (u*u*dr*dr)  # Xuu_drdr
        + work[(COEFFICIENTS + 7) * LANES + i] * (v*r)  # Xvr
        + work[(COEFFICIENTS + 10) * LANES + i] * (r*r)  # Xrr
        + work[(COEFFICIENTS + 12) * LANES + i] * (u*duc*dr*dr)  # Xuu_drdr_eta
    )
    Y = (
        work[(COEFFICIENTS + 14) * LANES + i] * (u*u)  # Yuu
        + work[(COEFFICIENTS + 15) * LANES + i] * (u*v)  # Yuv
        + work[(COEFFICIENTS + 17) * LANES + i] * (v*nu)  # Yv_absnu
        + work[(COEFFICIENTS + 18) * LANES + i] * (u*u*dr)  # Yuu_dr
        + work[(COEFFICIENTS + 21) * LANES + i] * (u*r)  # Yur
        + work[(COEFFICIENTS + 30) * LANES + i] * (crossflow_y)  # Ycrossflow
        + work[(COEFFICIENTS + 31) * LANES + i] * (v*duc)  # Yuv_eta
        + work[(COEFFICIENTS + 32) * LANES + i] * (r*duc)  # Yur_eta
        + work[(COEFFICIENTS + 33) * LANES + i] * (u*duc*dr)  # Yuu_dr_eta
    )
    Z = 0.0
    K = 0.0
    M = 0.0
    N = (
        work[(COEFFICIENTS + 89) * LANES + i] * (u*u)  # Nuu
        + work[(COEFFICIENTS + 90) * LANES + i] * (u*v)  # Nuv
        + work[(COEFFICIENTS + 92) * LANES + i] * (v*nu)  # Nv_absnu
        + work[(COEFFICIENTS + 93) * LANES + i] * (u*u*dr)  # Nuu_dr
        + work[(COEFFICIENTS + 96) * LANES + i] * (u*r)  # Nur
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
        + work[(COEFFICIENTS + 12) * LANES + i] * (duc*dr*dr + -1.0*u*dr*dr)  # Xuu_drdr_eta
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
        work[(COEFFICIENTS + 14) * LANES + i] * (u + u)  # Yuu
        + work[(COEFFICIENTS + 15) * LANES + i] * (v)  # Yuv
        + work[(COEFFICIENTS + 18) * LANES + i] * (u*dr + u*dr)  # Yuu_dr
        + work[(COEFFICIENTS + 21) * LANES + i] * (r)  # Yur
        + work[(COEFFICIENTS + 31) * LANES + i] * (-1.0*v)  # Yuv_eta
        + work[(COEFFICIENTS + 32) * LANES + i] * (-1.0*r)  # Yur_eta
        + work[(COEFFICIENTS + 33) * LANES + i] * (duc*dr + -1.0*u*dr)  # Yuu_dr_eta
    )
    Y_v = (
        work[(COEFFICIENTS + 15) * LANES + i] * (u)  # Yuv
        + work[(COEFFICIENTS + 16) * LANES + i] * (w)  # Yvw
        + work[(COEFFICIENTS + 17) * LANES + i] * (nu + nu_v*v)  # Yv_absnu
        + work[(COEFFICIENTS + 30) * LANES + i] * (crossflow_y_v)  # Ycrossflow
        + work[(COEFFICIENTS + 31) * LANES + i] * (duc)  # Yuv_eta
    )
    Y_w = (
        work[(COEFFICIENTS + 16) * LANES + i] * (v)  # Yvw
        + work[(COEFFICIENTS + 17) * LANES + i] * (nu_w*v)  # Yv_absnu
        + work[(COEFFICIENTS + 30) * LANES + i] * (crossflow_y_w)  # Ycrossflow
    )
    Y_p = 0.0
    Y_q = (
        work[(COEFFICIENTS + 22) * LANES + i] * (v)  # Yvq
        + work[(COEFFICIENTS + 28) * LANES + i] * (p)  # Ypq
        + work[(COEFFICIENTS + 30) * LANES + i] * (crossflow_y_q)  # Ycrossflow
    )
    Y_r = (
        work[(COEFFICIENTS + 21) * LANES + i] * (u)  # Yur
        + work[(COEFFICIENTS + 24) * LANES + i] * (w)  # Ywr
        + work[(COEFFICIENTS + 30) * LANES + i] * (crossflow_y_r)  # Ycrossflow
        + work[(COEFFICIENTS + 32) * LANES + i] * (duc)  # Yur_eta
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
        work[(COEFFICIENTS + 89) * LANES + i] * (u + u)  # Nuu
        + work[(COEFFICIENTS + 90) * LANES + i] * (v)  # Nuv
        + work[(COEFFICIENTS + 93) * LANES + i] * (u*dr + u*dr)  # Nuu_dr
        + work[(COEFFICIENTS + 96) * LANES + i] * (r)  # Nur
        + work[(COEFFICIENTS + 105) * LANES + i] * (-1.0*v)  # Nuv_eta
        + work[(COEFFICIENTS + 106) * LANES + i] * (-1.0*r)  # Nur_eta
        + work[(COEFFICIENTS + 107) * LANES + i] * (duc*dr + -1.0*u*dr)  # Nuu_dr_eta
    )
    N_v = (
        work[(COEFFICIENTS + 90) * LANES + i] * (u)  # Nuv
        + work[(COEFFICIENTS + 91) * LANES + i] * (w)  # Nvw
        + work[(COEFFICIENTS + 92) * LANES + i] * (nu + nu_v*v)  # Nv_absnu
        + work[(COEFFICIENTS + 104) * LANES + i] * (crossflow_n_v)  # Ncrossflow
        + work[(COEFFICIENTS + 105) * LANES + i] * (duc)  # Nuv_eta
    )
    N_w = (
        work[(COEFFICIENTS + 91) * LANES + i] * (v)  # Nvw
        + work[(COEFFICIENTS + 92) * LANES + i] * (nu_w*v)  # Nv_absnu
        + work[(COEFFICIENTS + 104) * LANES + i] * (crossflow_n_w)  # Ncrossflow
    )
    N_p = 0.0
    N_q = (
        work[(COEFFICIENTS + 97) * LANES + i] * (v)  # Nvq
        + work[(COEFFICIENTS + 102) * LANES + i] * (p)  # Npq
        + work[(COEFFICIENTS + 104) * LANES + i] * (crossflow_n_q)  # Ncrossflow
    )
    N_r = (
        work[(COEFFICIENTS + 96) * LANES + i] * (u)  # Nur
        + work[(COEFFICIENTS + 99) * LANES + i] * (w)  # Nwr
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
    row[12] = u*duc*dr*dr  # Xuu_drdr_eta
    row[13] = 0.0  # Xuu_dsds_eta
    row[14] = u*u  # Yuu
    row[15] = u*v  # Yuv
    row[16] = 0.0  # Yvw
    row[17] = v*nu  # Yv_absnu
    row[18] = u*u*dr  # Yuu_dr
    row[19] = vdot  # Yvdot
    row[20] = 0.0  # Yup
    row[21] = u*r  # Yur
    row[22] = 0.0  # Yvq
    row[23] = 0.0  # Ywp
    row[24] = 0.0  # Ywr
    row[25] = 0.0  # Ypdot
    row[26] = rdot  # Yrdot
    row[27] = 0.0  # Yp_absp
    row[28] = 0.0  # Ypq
    row[29] = 0.0  # Yqr
    row[30] = crossflow_y  # Ycrossflow
    row[31] = v*duc  # Yuv_eta
    row[32] = r*duc  # Yur_eta
    row[33] = u*duc*dr  # Yuu_dr_eta
    row[34] = 0.0  # Zuu
    row[35] = 0.0  # Zuw
    row[36] = 0.0  # Zvv
    row[37] = 0.0  # Zuu_db
    row[38] = 0.0  # Zuu_ds
    row[39] = 0.0  # Zu_absw
    row[40] = 0.0  # Zabsw_nu
    row[41] = 0.0  # Zwdot
    row[42] = 0.0  # Zuq
    row[43] = 0.0  # Zvp
    row[44] = 0.0  # Zvr
    row[45] = 0.0  # Zqdot
    row[46] = 0.0  # Zpp
    row[47] = 0.0  # Zrr
    row[48] = 0.0  # Zrp
    row[49] = 0.0  # Zcrossflow
    row[50] = 0.0  # Zuw_eta
    row[51] = 0.0  # Zuq_eta
    row[52] = 0.0  # Zuu_ds_eta
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
    row[70] = 0.0  # Muu
    row[71] = 0.0  # Muw
    row[72] = 0.0  # Mvv
    row[73] = 0.0  # Muu_db
    row[74] = 0.0  # Muu_ds
    row[75] = 0.0  # Mu_absw
    row[76] = 0.0  # Mabsw_nu
    row[77] = 0.0  # Mwdot
    row[78] = 0.0  # Muq
    row[79] = 0.0  # Mvp
    row[80] = 0.0  # Mvr
    row[81] = 0.0  # Mqdot
    row[82] = 0.0  # Mpp
    row[83] = 0.0  # Mrr
    row[84] = 0.0  # Mrp
    row[85] = 0.0  # Mcrossflow
    row[86] = 0.0  # Muw_eta
    row[87] = 0.0  # Muq_eta
    row[88] = 0.0  # Muu_ds_eta
    row[89] = u*u  # Nuu
    row[90] = u*v  # Nuv
    row[91] = 0.0  # Nvw
    row[92] = v*nu  # Nv_absnu
    row[93] = u*u*dr  # Nuu_dr
    row[94] = vdot  # Nvdot
    row[95] = 0.0  # Nup
    row[96] = u*r  # Nur
    row[97] = 0.0  # Nvq
    row[98] = 0.0  # Nwp
    row[99] = 0.0  # Nwr
    row[100] = 0.0  # Npdot
    row[101] = rdot  # Nrdot
    row[102] = 0.0  # Npq
    row[103] = 0.0  # Nqr
    row[104] = crossflow_n  # Ncrossflow
    row[105] = v*duc  # Nuv_eta
    row[106] = r*duc  # Nur_eta
    row[107] = u*duc*dr  # Nuu_dr_eta


@inline
def store_control_slopes(slopes, work, i, control, u, v, w, p, q, r):
    """Add the derivatives of the forces by the controls into `slopes` (6, N_CONTROLS)."""
    dr = control[0] + work[262 * LANES + i]
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
    slopes[5, 0] = (
        work[(COEFFICIENTS + 93) * LANES + i] * (u*u)  # Nuu_dr
        + work[(COEFFICIENTS + 107) * LANES + i] * (u*duc)  # Nuu_dr_eta
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
    slopes[5, 3] = (
        work[(COEFFICIENTS + 105) * LANES + i] * (v)  # Nuv_eta
        + work[(COEFFICIENTS + 106) * LANES + i] * (r)  # Nur_eta
        + work[(COEFFICIENTS + 107) * LANES + i] * (u*dr)  # Nuu_dr_eta
    )
