"""Hydrodynamic forces of one lane, by bayesub.model.equations.generate: do not edit.

Equations 'abkowitz', horizontal sub-problem, 45 terms.
"""

from math import sqrt

from bayesub.kernels.jit import inline
from bayesub.kernels.workspace import COEFFICIENTS, LANES

N_COEFFICIENTS = 45
N_CONTROLS = 2
ORDERED_SPEED = 1  # position of n/k0 among the controls
N_CONSTANTS = 1
RIGID_BODY_TERMS = False  # whether the velocity terms of the rigid body are apart from the coefficients

# (axis, acceleration, coefficient) of the added-mass terms, which stand in the mass matrix.
ADDED_MASS = ((0, 0, 10), (1, 1, 26), (1, 5, 27), (5, 1, 43), (5, 5, 44))


@inline
def sgn(x):
    """Sign of x; zero for zero."""
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@inline
def hydrodynamic_forces(work, i, control, u, v, w, p, q, r):
    """X, Y, Z (N) and K, M, N (N m) of lane `i`, terms without accelerations (model manual, section 4)."""
    dr = control[0] + work[199 * LANES + i]
    U = work[201 * LANES + i]
    V = sqrt(u * u + v * v + w * w)
    inverse_V = 1.0 / V if V > 0.0 else 0.0
    du = u - U
    X = (
        work[(COEFFICIENTS + 0) * LANES + i] * (du*V)  # Xu
        + work[(COEFFICIENTS + 1) * LANES + i] * (du*du)  # Xuu
        + work[(COEFFICIENTS + 2) * LANES + i] * (du*du*du*inverse_V)  # Xuuu
        + work[(COEFFICIENTS + 3) * LANES + i] * (v*v)  # Xvv
        + work[(COEFFICIENTS + 4) * LANES + i] * (r*r)  # Xrr
        + work[(COEFFICIENTS + 5) * LANES + i] * (r*v)  # Xrv
        + work[(COEFFICIENTS + 6) * LANES + i] * (dr*dr*V*V)  # Xdd
        + work[(COEFFICIENTS + 7) * LANES + i] * (du*dr*dr*V)  # Xudd
        + work[(COEFFICIENTS + 8) * LANES + i] * (v*dr*V)  # Xvd
        + work[(COEFFICIENTS + 9) * LANES + i] * (du*v*dr)  # Xuvd
    )
    Y = (
        work[(COEFFICIENTS + 11) * LANES + i] * (v*V)  # Yv
        + work[(COEFFICIENTS + 12) * LANES + i] * (r*V)  # Yr
        + work[(COEFFICIENTS + 13) * LANES + i] * (v*v*v*inverse_V)  # Yvvv
        + work[(COEFFICIENTS + 14) * LANES + i] * (v*v*r*inverse_V)  # Yvvr
        + work[(COEFFICIENTS + 15) * LANES + i] * (v*du)  # Yvu
        + work[(COEFFICIENTS + 16) * LANES + i] * (r*du)  # Yru
        + work[(COEFFICIENTS + 17) * LANES + i] * (dr*V*V)  # Yd
        + work[(COEFFICIENTS + 18) * LANES + i] * (dr*dr*dr*V*V)  # Yddd
        + work[(COEFFICIENTS + 19) * LANES + i] * (du*dr*V)  # Yud
        + work[(COEFFICIENTS + 20) * LANES + i] * (du*du*dr)  # Yuud
        + work[(COEFFICIENTS + 21) * LANES + i] * (v*dr*dr*V)  # Yvdd
        + work[(COEFFICIENTS + 22) * LANES + i] * (v*v*dr)  # Yvvd
        + work[(COEFFICIENTS + 23) * LANES + i] * (V*V)  # Y0
        + work[(COEFFICIENTS + 24) * LANES + i] * (du*V)  # Y0u
        + work[(COEFFICIENTS + 25) * LANES + i] * (du*du)  # Y0uu
    )
    Z = 0.0
    K = 0.0
    M = 0.0
    N = (
        work[(COEFFICIENTS + 28) * LANES + i] * (v*V)  # Nv
        + work[(COEFFICIENTS + 29) * LANES + i] * (r*V)  # Nr
        + work[(COEFFICIENTS + 30) * LANES + i] * (v*v*v*inverse_V)  # Nvvv
        + work[(COEFFICIENTS + 31) * LANES + i] * (v*v*r*inverse_V)  # Nvvr
        + work[(COEFFICIENTS + 32) * LANES + i] * (v*du)  # Nvu
        + work[(COEFFICIENTS + 33) * LANES + i] * (r*du)  # Nru
        + work[(COEFFICIENTS + 34) * LANES + i] * (dr*V*V)  # Nd
        + work[(COEFFICIENTS + 35) * LANES + i] * (dr*dr*dr*V*V)  # Nddd
        + work[(COEFFICIENTS + 36) * LANES + i] * (du*dr*V)  # Nud
        + work[(COEFFICIENTS + 37) * LANES + i] * (du*du*dr)  # Nuud
        + work[(COEFFICIENTS + 38) * LANES + i] * (v*dr*dr*V)  # Nvdd
        + work[(COEFFICIENTS + 39) * LANES + i] * (v*v*dr)  # Nvvd
        + work[(COEFFICIENTS + 40) * LANES + i] * (V*V)  # N0
        + work[(COEFFICIENTS + 41) * LANES + i] * (du*V)  # N0u
        + work[(COEFFICIENTS + 42) * LANES + i] * (du*du)  # N0uu
    )
    return X, Y, Z, K, M, N


@inline
def hydrodynamic_gradient(work, i, control, u, v, w, p, q, r):
    """Derivatives of :func:`hydrodynamic_forces` by u, v, w, p, q and r, six forces each."""
    dr = control[0] + work[199 * LANES + i]
    U = work[201 * LANES + i]
    V = sqrt(u * u + v * v + w * w)
    inverse_V = 1.0 / V if V > 0.0 else 0.0
    du = u - U
    V_u, V_v, V_w = u * inverse_V, v * inverse_V, w * inverse_V
    X_u = (
        work[(COEFFICIENTS + 0) * LANES + i] * (V + V_u*du)  # Xu
        + work[(COEFFICIENTS + 1) * LANES + i] * (du + du)  # Xuu
        + work[(COEFFICIENTS + 2) * LANES + i] * (du*du*inverse_V + du*du*inverse_V + du*du*inverse_V + -1.0*inverse_V*inverse_V*V_u*du*du*du)  # Xuuu
        + work[(COEFFICIENTS + 6) * LANES + i] * (V_u*dr*dr*V + V_u*dr*dr*V)  # Xdd
        + work[(COEFFICIENTS + 7) * LANES + i] * (dr*dr*V + V_u*du*dr*dr)  # Xudd
        + work[(COEFFICIENTS + 8) * LANES + i] * (V_u*v*dr)  # Xvd
        + work[(COEFFICIENTS + 9) * LANES + i] * (v*dr)  # Xuvd
    )
    X_v = (
        work[(COEFFICIENTS + 0) * LANES + i] * (V_v*du)  # Xu
        + work[(COEFFICIENTS + 2) * LANES + i] * (-1.0*inverse_V*inverse_V*V_v*du*du*du)  # Xuuu
        + work[(COEFFICIENTS + 3) * LANES + i] * (v + v)  # Xvv
        + work[(COEFFICIENTS + 5) * LANES + i] * (r)  # Xrv
        + work[(COEFFICIENTS + 6) * LANES + i] * (V_v*dr*dr*V + V_v*dr*dr*V)  # Xdd
        + work[(COEFFICIENTS + 7) * LANES + i] * (V_v*du*dr*dr)  # Xudd
        + work[(COEFFICIENTS + 8) * LANES + i] * (dr*V + V_v*v*dr)  # Xvd
        + work[(COEFFICIENTS + 9) * LANES + i] * (du*dr)  # Xuvd
    )
    X_w = (
        work[(COEFFICIENTS + 0) * LANES + i] * (V_w*du)  # Xu
        + work[(COEFFICIENTS + 2) * LANES + i] * (-1.0*inverse_V*inverse_V*V_w*du*du*du)  # Xuuu
        + work[(COEFFICIENTS + 6) * LANES + i] * (V_w*dr*dr*V + V_w*dr*dr*V)  # Xdd
        + work[(COEFFICIENTS + 7) * LANES + i] * (V_w*du*dr*dr)  # Xudd
        + work[(COEFFICIENTS + 8) * LANES + i] * (V_w*v*dr)  # Xvd
    )
    X_p = 0.0
    X_q = 0.0
    X_r = (
        work[(COEFFICIENTS + 4) * LANES + i] * (r + r)  # Xrr
        + work[(COEFFICIENTS + 5) * LANES + i] * (v)  # Xrv
    )
    Y_u = (
        work[(COEFFICIENTS + 11) * LANES + i] * (V_u*v)  # Yv
        + work[(COEFFICIENTS + 12) * LANES + i] * (V_u*r)  # Yr
        + work[(COEFFICIENTS + 13) * LANES + i] * (-1.0*inverse_V*inverse_V*V_u*v*v*v)  # Yvvv
        + work[(COEFFICIENTS + 14) * LANES + i] * (-1.0*inverse_V*inverse_V*V_u*v*v*r)  # Yvvr
        + work[(COEFFICIENTS + 15) * LANES + i] * (v)  # Yvu
        + work[(COEFFICIENTS + 16) * LANES + i] * (r)  # Yru
        + work[(COEFFICIENTS + 17) * LANES + i] * (V_u*dr*V + V_u*dr*V)  # Yd
        + work[(COEFFICIENTS + 18) * LANES + i] * (V_u*dr*dr*dr*V + V_u*dr*dr*dr*V)  # Yddd
        + work[(COEFFICIENTS + 19) * LANES + i] * (dr*V + V_u*du*dr)  # Yud
        + work[(COEFFICIENTS + 20) * LANES + i] * (du*dr + du*dr)  # Yuud
        + work[(COEFFICIENTS + 21) * LANES + i] * (V_u*v*dr*dr)  # Yvdd
        + work[(COEFFICIENTS + 23) * LANES + i] * (V_u*V + V_u*V)  # Y0
        + work[(COEFFICIENTS + 24) * LANES + i] * (V + V_u*du)  # Y0u
        + work[(COEFFICIENTS + 25) * LANES + i] * (du + du)  # Y0uu
    )
    Y_v = (
        work[(COEFFICIENTS + 11) * LANES + i] * (V + V_v*v)  # Yv
        + work[(COEFFICIENTS + 12) * LANES + i] * (V_v*r)  # Yr
        + work[(COEFFICIENTS + 13) * LANES + i] * (v*v*inverse_V + v*v*inverse_V + v*v*inverse_V + -1.0*inverse_V*inverse_V*V_v*v*v*v)  # Yvvv
        + work[(COEFFICIENTS + 14) * LANES + i] * (v*r*inverse_V + v*r*inverse_V + -1.0*inverse_V*inverse_V*V_v*v*v*r)  # Yvvr
        + work[(COEFFICIENTS + 15) * LANES + i] * (du)  # Yvu
        + work[(COEFFICIENTS + 17) * LANES + i] * (V_v*dr*V + V_v*dr*V)  # Yd
        + work[(COEFFICIENTS + 18) * LANES + i] * (V_v*dr*dr*dr*V + V_v*dr*dr*dr*V)  # Yddd
        + work[(COEFFICIENTS + 19) * LANES + i] * (V_v*du*dr)  # Yud
        + work[(COEFFICIENTS + 21) * LANES + i] * (dr*dr*V + V_v*v*dr*dr)  # Yvdd
        + work[(COEFFICIENTS + 22) * LANES + i] * (v*dr + v*dr)  # Yvvd
        + work[(COEFFICIENTS + 23) * LANES + i] * (V_v*V + V_v*V)  # Y0
        + work[(COEFFICIENTS + 24) * LANES + i] * (V_v*du)  # Y0u
    )
    Y_w = (
        work[(COEFFICIENTS + 11) * LANES + i] * (V_w*v)  # Yv
        + work[(COEFFICIENTS + 12) * LANES + i] * (V_w*r)  # Yr
        + work[(COEFFICIENTS + 13) * LANES + i] * (-1.0*inverse_V*inverse_V*V_w*v*v*v)  # Yvvv
        + work[(COEFFICIENTS + 14) * LANES + i] * (-1.0*inverse_V*inverse_V*V_w*v*v*r)  # Yvvr
        + work[(COEFFICIENTS + 17) * LANES + i] * (V_w*dr*V + V_w*dr*V)  # Yd
        + work[(COEFFICIENTS + 18) * LANES + i] * (V_w*dr*dr*dr*V + V_w*dr*dr*dr*V)  # Yddd
        + work[(COEFFICIENTS + 19) * LANES + i] * (V_w*du*dr)  # Yud
        + work[(COEFFICIENTS + 21) * LANES + i] * (V_w*v*dr*dr)  # Yvdd
        + work[(COEFFICIENTS + 23) * LANES + i] * (V_w*V + V_w*V)  # Y0
        + work[(COEFFICIENTS + 24) * LANES + i] * (V_w*du)  # Y0u
    )
    Y_p = 0.0
    Y_q = 0.0
    Y_r = (
        work[(COEFFICIENTS + 12) * LANES + i] * (V)  # Yr
        + work[(COEFFICIENTS + 14) * LANES + i] * (v*v*inverse_V)  # Yvvr
        + work[(COEFFICIENTS + 16) * LANES + i] * (du)  # Yru
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
        work[(COEFFICIENTS + 28) * LANES + i] * (V_u*v)  # Nv
        + work[(COEFFICIENTS + 29) * LANES + i] * (V_u*r)  # Nr
        + work[(COEFFICIENTS + 30) * LANES + i] * (-1.0*inverse_V*inverse_V*V_u*v*v*v)  # Nvvv
        + work[(COEFFICIENTS + 31) * LANES + i] * (-1.0*inverse_V*inverse_V*V_u*v*v*r)  # Nvvr
        + work[(COEFFICIENTS + 32) * LANES + i] * (v)  # Nvu
        + work[(COEFFICIENTS + 33) * LANES + i] * (r)  # Nru
        + work[(COEFFICIENTS + 34) * LANES + i] * (V_u*dr*V + V_u*dr*V)  # Nd
        + work[(COEFFICIENTS + 35) * LANES + i] * (V_u*dr*dr*dr*V + V_u*dr*dr*dr*V)  # Nddd
        + work[(COEFFICIENTS + 36) * LANES + i] * (dr*V + V_u*du*dr)  # Nud
        + work[(COEFFICIENTS + 37) * LANES + i] * (du*dr + du*dr)  # Nuud
        + work[(COEFFICIENTS + 38) * LANES + i] * (V_u*v*dr*dr)  # Nvdd
        + work[(COEFFICIENTS + 40) * LANES + i] * (V_u*V + V_u*V)  # N0
        + work[(COEFFICIENTS + 41) * LANES + i] * (V + V_u*du)  # N0u
        + work[(COEFFICIENTS + 42) * LANES + i] * (du + du)  # N0uu
    )
    N_v = (
        work[(COEFFICIENTS + 28) * LANES + i] * (V + V_v*v)  # Nv
        + work[(COEFFICIENTS + 29) * LANES + i] * (V_v*r)  # Nr
        + work[(COEFFICIENTS + 30) * LANES + i] * (v*v*inverse_V + v*v*inverse_V + v*v*inverse_V + -1.0*inverse_V*inverse_V*V_v*v*v*v)  # Nvvv
        + work[(COEFFICIENTS + 31) * LANES + i] * (v*r*inverse_V + v*r*inverse_V + -1.0*inverse_V*inverse_V*V_v*v*v*r)  # Nvvr
        + work[(COEFFICIENTS + 32) * LANES + i] * (du)  # Nvu
        + work[(COEFFICIENTS + 34) * LANES + i] * (V_v*dr*V + V_v*dr*V)  # Nd
        + work[(COEFFICIENTS + 35) * LANES + i] * (V_v*dr*dr*dr*V + V_v*dr*dr*dr*V)  # Nddd
        + work[(COEFFICIENTS + 36) * LANES + i] * (V_v*du*dr)  # Nud
        + work[(COEFFICIENTS + 38) * LANES + i] * (dr*dr*V + V_v*v*dr*dr)  # Nvdd
        + work[(COEFFICIENTS + 39) * LANES + i] * (v*dr + v*dr)  # Nvvd
        + work[(COEFFICIENTS + 40) * LANES + i] * (V_v*V + V_v*V)  # N0
        + work[(COEFFICIENTS + 41) * LANES + i] * (V_v*du)  # N0u
    )
    N_w = (
        work[(COEFFICIENTS + 28) * LANES + i] * (V_w*v)  # Nv
        + work[(COEFFICIENTS + 29) * LANES + i] * (V_w*r)  # Nr
        + work[(COEFFICIENTS + 30) * LANES + i] * (-1.0*inverse_V*inverse_V*V_w*v*v*v)  # Nvvv
        + work[(COEFFICIENTS + 31) * LANES + i] * (-1.0*inverse_V*inverse_V*V_w*v*v*r)  # Nvvr
        + work[(COEFFICIENTS + 34) * LANES + i] * (V_w*dr*V + V_w*dr*V)  # Nd
        + work[(COEFFICIENTS + 35) * LANES + i] * (V_w*dr*dr*dr*V + V_w*dr*dr*dr*V)  # Nddd
        + work[(COEFFICIENTS + 36) * LANES + i] * (V_w*du*dr)  # Nud
        + work[(COEFFICIENTS + 38) * LANES + i] * (V_w*v*dr*dr)  # Nvdd
        + work[(COEFFICIENTS + 40) * LANES + i] * (V_w*V + V_w*V)  # N0
        + work[(COEFFICIENTS + 41) * LANES + i] * (V_w*du)  # N0u
    )
    N_p = 0.0
    N_q = 0.0
    N_r = (
        work[(COEFFICIENTS + 29) * LANES + i] * (V)  # Nr
        + work[(COEFFICIENTS + 31) * LANES + i] * (v*v*inverse_V)  # Nvvr
        + work[(COEFFICIENTS + 33) * LANES + i] * (du)  # Nru
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
    dr = control[0] + work[199 * LANES + i]
    U = work[201 * LANES + i]
    V = sqrt(u * u + v * v + w * w)
    inverse_V = 1.0 / V if V > 0.0 else 0.0
    du = u - U
    row[0] = du*V  # Xu
    row[1] = du*du  # Xuu
    row[2] = du*du*du*inverse_V  # Xuuu
    row[3] = v*v  # Xvv
    row[4] = r*r  # Xrr
    row[5] = r*v  # Xrv
    row[6] = dr*dr*V*V  # Xdd
    row[7] = du*dr*dr*V  # Xudd
    row[8] = v*dr*V  # Xvd
    row[9] = du*v*dr  # Xuvd
    row[10] = udot  # Xudot
    row[11] = v*V  # Yv
    row[12] = r*V  # Yr
    row[13] = v*v*v*inverse_V  # Yvvv
    row[14] = v*v*r*inverse_V  # Yvvr
    row[15] = v*du  # Yvu
    row[16] = r*du  # Yru
    row[17] = dr*V*V  # Yd
    row[18] = dr*dr*dr*V*V  # Yddd
    row[19] = du*dr*V  # Yud
    row[20] = du*du*dr  # Yuud
    row[21] = v*dr*dr*V  # Yvdd
    row[22] = v*v*dr  # Yvvd
    row[23] = V*V  # Y0
    row[24] = du*V  # Y0u
    row[25] = du*du  # Y0uu
    row[26] = vdot  # Yvdot
    row[27] = rdot  # Yrdot
    row[28] = v*V  # Nv
    row[29] = r*V  # Nr
    row[30] = v*v*v*inverse_V  # Nvvv
    row[31] = v*v*r*inverse_V  # Nvvr
    row[32] = v*du  # Nvu
    row[33] = r*du  # Nru
    row[34] = dr*V*V  # Nd
    row[35] = dr*dr*dr*V*V  # Nddd
    row[36] = du*dr*V  # Nud
    row[37] = du*du*dr  # Nuud
    row[38] = v*dr*dr*V  # Nvdd
    row[39] = v*v*dr  # Nvvd
    row[40] = V*V  # N0
    row[41] = du*V  # N0u
    row[42] = du*du  # N0uu
    row[43] = vdot  # Nvdot
    row[44] = rdot  # Nrdot


@inline
def store_control_slopes(slopes, work, i, control, u, v, w, p, q, r):
    """Add the derivatives of the forces by the controls into `slopes` (6, N_CONTROLS)."""
    dr = control[0] + work[199 * LANES + i]
    U = work[201 * LANES + i]
    V = sqrt(u * u + v * v + w * w)
    inverse_V = 1.0 / V if V > 0.0 else 0.0
    du = u - U
    slopes[0, 0] = (
        work[(COEFFICIENTS + 6) * LANES + i] * (dr*V*V + dr*V*V)  # Xdd
        + work[(COEFFICIENTS + 7) * LANES + i] * (du*dr*V + du*dr*V)  # Xudd
        + work[(COEFFICIENTS + 8) * LANES + i] * (v*V)  # Xvd
        + work[(COEFFICIENTS + 9) * LANES + i] * (du*v)  # Xuvd
    )
    slopes[1, 0] = (
        work[(COEFFICIENTS + 17) * LANES + i] * (V*V)  # Yd
        + work[(COEFFICIENTS + 18) * LANES + i] * (dr*dr*V*V + dr*dr*V*V + dr*dr*V*V)  # Yddd
        + work[(COEFFICIENTS + 19) * LANES + i] * (du*V)  # Yud
        + work[(COEFFICIENTS + 20) * LANES + i] * (du*du)  # Yuud
        + work[(COEFFICIENTS + 21) * LANES + i] * (v*dr*V + v*dr*V)  # Yvdd
        + work[(COEFFICIENTS + 22) * LANES + i] * (v*v)  # Yvvd
    )
    slopes[5, 0] = (
        work[(COEFFICIENTS + 34) * LANES + i] * (V*V)  # Nd
        + work[(COEFFICIENTS + 35) * LANES + i] * (dr*dr*V*V + dr*dr*V*V + dr*dr*V*V)  # Nddd
        + work[(COEFFICIENTS + 36) * LANES + i] * (du*V)  # Nud
        + work[(COEFFICIENTS + 37) * LANES + i] * (du*du)  # Nuud
        + work[(COEFFICIENTS + 38) * LANES + i] * (v*dr*V + v*dr*V)  # Nvdd
        + work[(COEFFICIENTS + 39) * LANES + i] * (v*v)  # Nvvd
    )
