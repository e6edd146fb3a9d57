"""The equations of motion of a boat: rates from state and controls (model manual, sections 1 to 6).

These are lane functions (:mod:`bayesub.kernels.lanes`), for whatever adds and multiplies.
"""

import functools
import operator
from collections.abc import Sequence
from types import ModuleType
from typing import NamedTuple, Protocol

from bayesub.kernels import workspace as at
from bayesub.kernels.lanes import choose, sine_cosine


class Numbers(Protocol):
    """Whatever has numbers, or lanes of them, by position."""

    def __getitem__(self, k: int, /): ...


class Boat(NamedTuple):
    """What the equations of motion ask for, as anything that gives numbers by their position."""

    equations: ModuleType  # of the forces of an equation set (bayesub.model.equations.generate)
    state: Numbers  # 12 or, with a quaternion, 13, in the order of the rows of bayesub.kernels.workspace.STATE
    body: Numbers  # N_BODY
    inverse_mass: "InverseMass"
    coefficients: Numbers  # n_terms, dimensional
    constants: Numbers  # N_CONSTANTS: the trial speed, and stations of the hull if the set integrates along it
    controls: Numbers  # N_CONTROLS: of the set, SI units; n/k0, m/s; and forces from outside, if there are any


class InverseMass:
    """The inverse mass matrix, of its 36 entries row by row."""

    def __init__(self, entries: Numbers):
        self.entries = entries

    def __matmul__(self, forces: Sequence) -> tuple:
        """The six accelerations by forces and moments."""
        return tuple(
            functools.reduce(operator.add, (self.entries[6 * row + axis] * forces[axis] for axis in range(6)))
            for row in range(6)
        )


def propulsion(boat: Boat):
    """Thrust (N) and torque (N m) of the three-branch polynomial (model manual, section 5), and derivatives by u."""
    body, u = boat.body, boat.state[6]
    ordered = boat.controls[boat.equations.ORDERED_SPEED]  # n/k0, the speed that the propeller keeps up (m/s)
    ahead = u >= 0.0
    forward = choose(ahead, ordered > u, ordered < u)  # n' = n / (k0 u) > 1
    astern = choose(ahead, ordered <= 0.0, ordered >= 0.0)  # n' <= 0
    b1, b2, b3 = (choose(forward, body[at.B1 + k], choose(astern, body[at.B7 + k], body[at.B4 + k])) for k in range(3))
    speed = abs(u)
    thrust = b1 * u * speed + b2 * speed * ordered + b3 * ordered * ordered
    thrust_u = 2.0 * b1 * speed + choose(ahead, b2 * ordered, -b2 * ordered)
    advance, advance_u = choose(u > 0.0, u, 0.0), choose(u > 0.0, 1.0, 0.0)
    torque = body[at.KN1] * ordered * ordered + body[at.KN2] * ordered * advance
    turning = choose(ordered > 0.0, 1.0, 0.0)
    return thrust, turning * torque, thrust_u, turning * body[at.KN2] * ordered * advance_u


def rigid_body(boat: Boat, first: Sequence, second: Sequence):
    """The velocity terms of the left-hand sides (model manual, section 2), in N and N m, as a bilinear form.

    With the velocity in both places they are the terms themselves; the form of a velocity and its variation plus that
    of the variation and the velocity is their derivative. A set whose coefficients contain them has none.
    """
    if not boat.equations.RIGID_BODY_TERMS:
        return (0.0,) * 6
    m, ixx, iyy, izz = (boat.body[k] for k in (at.MASS, at.IXX, at.IYY, at.IZZ))
    ixy, iyz, izx = (boat.body[k] for k in (at.IXY, at.IYZ, at.IZX))
    x, y, z = (boat.body[k] for k in (at.XG, at.YG, at.ZG))
    u1, v1, w1, p1, q1, r1 = first
    _, _, _, p2, q2, r2 = second
    surge = w1 * q2 - v1 * r2
    sway = u1 * r2 - w1 * p2
    heave = v1 * p2 - u1 * q2
    pp, qq, rr, pq, qr, rp = p1 * p2, q1 * q2, r1 * r2, p1 * q2, q1 * r2, r1 * p2
    return (
        m * (surge - x * (qq + rr) + y * pq + z * rp),
        m * (sway - y * (rr + pp) + z * qr + x * pq),
        m * (heave - z * (pp + qq) + x * rp + y * qr),
        (izz - iyy) * qr - pq * izx + (rr - qq) * iyz + rp * ixy + m * (y * heave - z * sway),
        (ixx - izz) * rp - qr * ixy + (pp - rr) * izx + pq * iyz + m * (z * surge - x * heave),
        (iyy - ixx) * pq - rp * iyz + (qq - pp) * ixy + qr * izx + m * (x * sway - y * surge),
    )


def hydrostatics(boat: Boat, gx, gy, gz):
    """Weight and buoyancy (model manual, section 3), in N and N m; (gx, gy, gz) points down, in body axes.

    With forces from outside there is a weight from outside too, and its moments about the origin (section 3).
    """
    body, first = boat.body, boat.equations.WEIGHTS
    weight, buoyancy = body[at.WEIGHT], body[at.BUOYANCY]
    net = weight - buoyancy
    x, y, z = (weight * body[at.XG + k] - buoyancy * body[at.XB + k] for k in range(3))
    if first is not None:
        net, x, y, z = (sum_ + boat.controls[first + k] for k, sum_ in enumerate((net, x, y, z)))
    return net * gx, net * gy, net * gz, y * gz - z * gy, z * gx - x * gz, x * gy - y * gx


def weight_slopes(boat: Boat, gx, gy, gz) -> dict:
    """Derivatives of :func:`hydrostatics` that are not zero by a weight from outside and its moments.

    They are those of the force along an axis by a control: (axis, control) -> derivative.
    """
    first = boat.equations.WEIGHTS
    if first is None:
        return {}
    return {
        **{(0, first): gx, (1, first): gy, (2, first): gz},
        **{(4, first + 1): -gz, (5, first + 1): gy},
        **{(3, first + 2): gz, (5, first + 2): -gx},
        **{(3, first + 3): -gy, (4, first + 3): gx},
    }


def mechanical_forces(boat: Boat, gx, gy, gz) -> tuple:
    """The six forces and moments (N, N m) that do not come from coefficients, less the velocity terms."""
    velocity = [boat.state[6 + k] for k in range(6)]
    x1, y1, z1, k1, m1, n1 = hydrostatics(boat, gx, gy, gz)
    x2, y2, z2, k2, m2, n2 = rigid_body(boat, velocity, velocity)
    thrust, torque, _, _ = propulsion(boat)
    return x1 - x2 + thrust, y1 - y2, z1 - z2, k1 - k2 + torque, m1 - m2 + thrust * boat.body[at.ZP], n1 - n2


def accelerations(boat: Boat, gx, gy, gz) -> tuple:
    """udot vdot wdot pdot qdot rdot: M^-1 times all forces without added mass."""
    velocity = [boat.state[6 + k] for k in range(6)]
    x1, y1, z1, k1, m1, n1 = boat.equations.forces(boat.coefficients, boat.controls, boat.constants, *velocity)
    x2, y2, z2, k2, m2, n2 = rigid_body(boat, velocity, velocity)
    x3, y3, z3, k3, m3, n3 = hydrostatics(boat, gx, gy, gz)
    thrust, torque, _, _ = propulsion(boat)
    return boat.inverse_mass @ (
        x1 - x2 + x3 + thrust,
        y1 - y2 + y3,
        z1 - z2 + z3,
        k1 - k2 + k3 + torque,
        m1 - m2 + m3 + thrust * boat.body[at.ZP],
        n1 - n2 + n3,
    )


def down(boat: Boat) -> tuple:
    """The downward direction in body axes, from Euler angles."""
    sphi, cphi = sine_cosine(boat.state[3])
    sth, cth = sine_cosine(boat.state[4])
    return -sth, cth * sphi, cth * cphi


def euler_derivative(boat: Boat) -> tuple:
    """The twelve rates (model manual, section 1) of a state with Euler angles."""
    sphi, cphi = sine_cosine(boat.state[3])
    sth, cth = sine_cosine(boat.state[4])
    spsi, cpsi = sine_cosine(boat.state[5])
    u, v, w, p, q, r = (boat.state[6 + k] for k in range(6))
    accelerated = accelerations(boat, -sth, cth * sphi, cth * cphi)
    yawing = (sphi * q + cphi * r) * (1.0 / cth)
    return (
        cpsi * cth * u + (cpsi * sth * sphi - spsi * cphi) * v + (spsi * sphi + cpsi * cphi * sth) * w,
        spsi * cth * u + (cpsi * cphi + sphi * sth * spsi) * v + (sth * spsi * cphi - cpsi * sphi) * w,
        -sth * u + cth * sphi * v + cth * cphi * w,
        p + sth * yawing,
        cphi * q - sphi * r,
        yawing,
        *accelerated,
    )


def quaternion_derivative(boat: Boat) -> tuple:
    """The thirteen rates of a state with a unit quaternion (thesis appendix B, equations 42 and 43)."""
    q1, q2, q3, u, v, w, p, q, r, q0 = (boat.state[k] for k in range(3, 13))
    gx = 2.0 * (q1 * q3 - q0 * q2)
    gy = 2.0 * (q2 * q3 + q0 * q1)
    gz = q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3
    accelerated = accelerations(boat, gx, gy, gz)
    return (
        (q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3) * u + 2.0 * ((q1 * q2 - q0 * q3) * v + (q1 * q3 + q0 * q2) * w),
        (q0 * q0 - q1 * q1 + q2 * q2 - q3 * q3) * v + 2.0 * ((q1 * q2 + q0 * q3) * u + (q2 * q3 - q0 * q1) * w),
        gx * u + gy * v + gz * w,
        0.5 * (q0 * p - q3 * q + q2 * r),
        0.5 * (q3 * p + q0 * q - q1 * r),
        0.5 * (q1 * q + q0 * r - q2 * p),
        *accelerated,
        -0.5 * (q1 * p + q2 * q + q3 * r),
    )


def state_jacobian(boat: Boat) -> list[tuple]:
    """The derivatives of :func:`euler_derivative`: the tangent-linear equations (model manual, section 6).

    They are twelve rows with N_COLUMNS columns, one for each of phi theta psi u v w p q r: nothing depends on position.
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
    _, _, thrust_u, torque_u = propulsion(boat)
    by_propeller = thrust_u, 0.0, 0.0, torque_u, thrust_u * boat.body[at.ZP], 0.0
    slopes[0] = tuple(map(operator.add, slopes[0], by_propeller))
    for n in range(6):
        unit = [float(k == n) for k in range(6)]
        by_mass = map(operator.add, rigid_body(boat, velocity, unit), rigid_body(boat, unit, velocity))
        slopes[n] = tuple(map(operator.sub, slopes[n], by_mass))
    rolling = hydrostatics(boat, 0.0, cth * cphi, -cth * sphi)
    pitching = hydrostatics(boat, -cth, -sth * sphi, -sth * cphi)
    columns = [boat.inverse_mass @ force for force in (rolling, pitching, *slopes)]
    columns.insert(2, (0.0,) * 6)  # heading
    return [*position, *attitude, *zip(*columns, strict=True)]
