"""The state Jacobian of the equations of motion: the tangent-linear equations of one lane (model manual, section 6)."""

from bayesub.kernels import workspace as at
from bayesub.kernels.jit import inline
from bayesub.kernels.trigonometry import sine_cosine
from bayesub.kernels.workspace import BODY_ROWS, INVERSE_MASS, LANES, N_STATES

from .dynamics import hydrostatics, ordered_speed, propulsion, rigid_body, row_times
from .hydrodynamics import hydrodynamic_gradient

# Nothing depends on the position, so that the Jacobian has a column for each of phi theta psi u v w p q r.
N_COLUMNS = 9
JACOBIAN_ROWS = N_STATES * N_COLUMNS


@inline
def _set(work, i, target, row, phi, theta, psi, u, v, w, p, q, r):
    a = (target + N_COLUMNS * row) * LANES + i
    work[a] = phi
    work[a + LANES] = theta
    work[a + 2 * LANES] = psi
    work[a + 3 * LANES] = u
    work[a + 4 * LANES] = v
    work[a + 5 * LANES] = w
    work[a + 6 * LANES] = p
    work[a + 7 * LANES] = q
    work[a + 8 * LANES] = r


@inline
def _rigid_body_derivative(work, i, u, v, w, p, q, r, du, dv, dw, dp, dq, dr):
    return _sum(
        rigid_body(work, i, u, v, w, p, q, r, du, dv, dw, dp, dq, dr),
        rigid_body(work, i, du, dv, dw, dp, dq, dr, u, v, w, p, q, r),
    )


@inline
def _sum(a, b):
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]


@inline
def _difference(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3], a[4] - b[4], a[5] - b[5]


@inline
def _accelerated(work, a, force):
    """The inverse mass matrix's row at position `a`, times a force and moment."""
    return row_times(work, a, force[0], force[1], force[2], force[3], force[4], force[5])


@inline
def _set_velocity_row(work, i, target, n, rolling, pitching, fu, fv, fw, fp, fq, fr):
    a = (INVERSE_MASS + 6 * n) * LANES + i
    _set(
        work,
        i,
        target,
        6 + n,
        _accelerated(work, a, rolling),
        _accelerated(work, a, pitching),
        0.0,
        _accelerated(work, a, fu),
        _accelerated(work, a, fv),
        _accelerated(work, a, fw),
        _accelerated(work, a, fp),
        _accelerated(work, a, fq),
        _accelerated(work, a, fr),
    )


@inline
def state_jacobian(work, i, state, target, control):
    """Write the (12, 9) derivatives of :func:`.dynamics.euler_derivative` into rows from `target` on."""
    row = state * LANES + i
    sphi, cphi = sine_cosine(work[row + 3 * LANES])
    sth, cth = sine_cosine(work[row + 4 * LANES])
    spsi, cpsi = sine_cosine(work[row + 5 * LANES])
    u, v, w = work[row + 6 * LANES], work[row + 7 * LANES], work[row + 8 * LANES]
    p, q, r = work[row + 9 * LANES], work[row + 10 * LANES], work[row + 11 * LANES]

    # Position: the rotation itself, and its derivatives applied to the velocity after roll and after roll and pitch.
    y1, z1 = cphi * v - sphi * w, sphi * v + cphi * w
    x2, z2 = cth * u + sth * z1, cth * z1 - sth * u
    xx, xy, xz = cpsi * cth, cpsi * sth * sphi - spsi * cphi, spsi * sphi + cpsi * cphi * sth
    yx, yy, yz = spsi * cth, cpsi * cphi + sphi * sth * spsi, sth * spsi * cphi - cpsi * sphi
    _set(work, i, target, 0, xz * v - xy * w, cpsi * z2, -spsi * x2 - cpsi * y1, xx, xy, xz, 0.0, 0.0, 0.0)
    _set(work, i, target, 1, yz * v - yy * w, spsi * z2, cpsi * x2 - spsi * y1, yx, yy, yz, 0.0, 0.0, 0.0)
    _set(work, i, target, 2, cth * y1, -x2, 0.0, -sth, cth * sphi, cth * cphi, 0.0, 0.0, 0.0)

    # Euler angles.
    secant = 1.0 / cth
    tangent = sth * secant
    yawing, pitching = (sphi * q + cphi * r) * secant, cphi * q - sphi * r
    _set(
        work, i, target, 3, tangent * pitching, yawing * secant, 0.0, 0.0, 0.0, 0.0, 1.0, tangent * sphi, tangent * cphi
    )
    _set(work, i, target, 4, -cth * yawing, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, cphi, -sphi)
    _set(work, i, target, 5, secant * pitching, tangent * yawing, 0.0, 0.0, 0.0, 0.0, 0.0, secant * sphi, secant * cphi)

    # Velocity: the inverse mass matrix times the derivatives of the forces.
    fu, fv, fw, fp, fq, fr = hydrodynamic_gradient(work, i, control, u, v, w, p, q, r)
    _, _, thrust_u, torque_u = propulsion(work, i, u, ordered_speed(work, i, control))
    thrusting = (thrust_u, 0.0, 0.0, torque_u, thrust_u * work[(BODY_ROWS + at.ZP) * LANES + i], 0.0)
    fu = _sum(fu, thrusting)
    fu = _difference(fu, _rigid_body_derivative(work, i, u, v, w, p, q, r, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    fv = _difference(fv, _rigid_body_derivative(work, i, u, v, w, p, q, r, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0))
    fw = _difference(fw, _rigid_body_derivative(work, i, u, v, w, p, q, r, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
    fp = _difference(fp, _rigid_body_derivative(work, i, u, v, w, p, q, r, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0))
    fq = _difference(fq, _rigid_body_derivative(work, i, u, v, w, p, q, r, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0))
    fr = _difference(fr, _rigid_body_derivative(work, i, u, v, w, p, q, r, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    rolling = hydrostatics(work, i, control, 0.0, cth * cphi, -cth * sphi)
    pitching = hydrostatics(work, i, control, -cth, -sth * sphi, -sth * cphi)
    _set_velocity_row(work, i, target, 0, rolling, pitching, fu, fv, fw, fp, fq, fr)
    _set_velocity_row(work, i, target, 1, rolling, pitching, fu, fv, fw, fp, fq, fr)
    _set_velocity_row(work, i, target, 2, rolling, pitching, fu, fv, fw, fp, fq, fr)
    _set_velocity_row(work, i, target, 3, rolling, pitching, fu, fv, fw, fp, fq, fr)
    _set_velocity_row(work, i, target, 4, rolling, pitching, fu, fv, fw, fp, fq, fr)
    _set_velocity_row(work, i, target, 5, rolling, pitching, fu, fv, fw, fp, fq, fr)
