"""The state Jacobian of the equations of motion: the tangent-linear equations (model manual, section 6)."""

from bayesub.kernels import workspace as at
from bayesub.kernels.dynamics import Boat, hydrostatics, ordered_speed, propulsion, rigid_body
from bayesub.kernels.trigonometry import sine_cosine

_UNIT = [[1.0 if k == n else 0.0 for k in range(6)] for n in range(6)]


def state_jacobian(boat: Boat) -> list[tuple]:
    """The derivatives of :func:`bayesub.kernels.dynamics.euler_derivative`.

    They are twelve rows with N_COLUMNS columns: nothing depends on the position, so that there is one for each of
    phi theta psi u v w p q r.
    """
    sphi, cphi = sine_cosine(boat.state[3])
    sth, cth = sine_cosine(boat.state[4])
    spsi, cpsi = sine_cosine(boat.state[5])
    u, v, w, _, q, r = velocity = [boat.state[6 + k] for k in range(6)]
    none = (0.0, 0.0, 0.0)

    # Position: the rotation itself, and its derivatives applied to the velocity after roll and after roll and pitch.
    y1, z1 = cphi * v - sphi * w, sphi * v + cphi * w
    x2, z2 = cth * u + sth * z1, cth * z1 - sth * u
    xx, xy, xz = cpsi * cth, cpsi * sth * sphi - spsi * cphi, spsi * sphi + cpsi * cphi * sth
    yx, yy, yz = spsi * cth, cpsi * cphi + sphi * sth * spsi, sth * spsi * cphi - cpsi * sphi
    position = [
        (xz * v - xy * w, cpsi * z2, -spsi * x2 - cpsi * y1, xx, xy, xz, *none),
        (yz * v - yy * w, spsi * z2, cpsi * x2 - spsi * y1, yx, yy, yz, *none),
        (cth * y1, -x2, 0.0, -sth, cth * sphi, cth * cphi, *none),
    ]

    # Euler angles.
    secant = 1.0 / cth
    tangent = sth * secant
    yawing, pitching = (sphi * q + cphi * r) * secant, cphi * q - sphi * r
    attitude = [
        (tangent * pitching, yawing * secant, 0.0, *none, 1.0, tangent * sphi, tangent * cphi),
        (-cth * yawing, 0.0, 0.0, *none, 0.0, cphi, -sphi),
        (secant * pitching, tangent * yawing, 0.0, *none, 0.0, secant * sphi, secant * cphi),
    ]

    # Velocity: the inverse mass matrix times the derivatives of the forces.
    slopes = list(boat.equations.gradient(boat.coefficients, boat.controls, boat.constants, *velocity))
    _, _, thrust_u, torque_u = propulsion(boat.body, u, ordered_speed(boat))
    slopes[0] = _sum(slopes[0], (thrust_u, 0.0, 0.0, torque_u, thrust_u * boat.body[at.ZP], 0.0))
    for n, unit in enumerate(_UNIT):
        slopes[n] = _difference(slopes[n], _sum(rigid_body(boat, velocity, unit), rigid_body(boat, unit, velocity)))
    rolling = hydrostatics(boat, 0.0, cth * cphi, -cth * sphi)
    pitching = hydrostatics(boat, -cth, -sth * sphi, -sth * cphi)
    columns = [boat.inverse_mass @ force for force in (rolling, pitching, *slopes)]
    columns.insert(2, (0.0,) * 6)  # heading
    return [*position, *attitude, *zip(*columns, strict=True)]


def _sum(a, b):
    return tuple(x + y for x, y in zip(a, b, strict=True))


def _difference(a, b):
    return tuple(x - y for x, y in zip(a, b, strict=True))
