"""The equations of motion of one lane: state derivative from state and controls (model sections 1 to 6)."""

from bayesub.kernels import layout as at
from bayesub.kernels.hydrodynamics import hydrodynamic_forces
from bayesub.kernels.layout import BODY_ROWS, INVERSE_MASS, LANES, inline
from bayesub.kernels.trigonometry import sine_cosine


@inline
def propulsion(work, i, u, ordered):
    """Thrust (N) and torque (N m) of the three-branch polynomial (section 5).

    `ordered` is n/k0, the speed at which the propeller speed self-propels (m/s).
    """
    forward = ordered > u if u >= 0.0 else ordered < u  # n' = n / (k0 u) > 1
    astern = ordered <= 0.0 if u >= 0.0 else ordered >= 0.0  # n' <= 0
    row = (BODY_ROWS + at.B1) * LANES + i
    b1 = work[row] if forward else (work[row + 6 * LANES] if astern else work[row + 3 * LANES])
    b2 = work[row + LANES] if forward else (work[row + 7 * LANES] if astern else work[row + 4 * LANES])
    b3 = work[row + 2 * LANES] if forward else (work[row + 8 * LANES] if astern else work[row + 5 * LANES])
    speed = abs(u)
    thrust = b1 * u * speed + b2 * speed * ordered + b3 * ordered * ordered
    advance = u if u > 0.0 else 0.0
    kn1, kn2 = work[(BODY_ROWS + at.KN1) * LANES + i], work[(BODY_ROWS + at.KN2) * LANES + i]
    torque = kn1 * ordered * ordered + kn2 * ordered * advance
    return thrust, (torque if ordered > 0.0 else 0.0)


@inline
def rigid_body(work, i, u, v, w, p, q, r):
    """The velocity terms of the left-hand sides (section 2), in N and N m."""
    m = work[(BODY_ROWS + at.MASS) * LANES + i]
    ixx = work[(BODY_ROWS + at.IXX) * LANES + i]
    iyy = work[(BODY_ROWS + at.IYY) * LANES + i]
    izz = work[(BODY_ROWS + at.IZZ) * LANES + i]
    ixy = work[(BODY_ROWS + at.IXY) * LANES + i]
    iyz = work[(BODY_ROWS + at.IYZ) * LANES + i]
    izx = work[(BODY_ROWS + at.IZX) * LANES + i]
    x = work[(BODY_ROWS + at.XG) * LANES + i]
    y = work[(BODY_ROWS + at.YG) * LANES + i]
    z = work[(BODY_ROWS + at.ZG) * LANES + i]
    surge = w * q - v * r
    sway = u * r - w * p
    heave = v * p - u * q
    return (
        m * (surge - x * (q * q + r * r) + y * p * q + z * p * r),
        m * (sway - y * (r * r + p * p) + z * q * r + x * p * q),
        m * (heave - z * (p * p + q * q) + x * r * p + y * r * q),
        (izz - iyy) * q * r - p * q * izx + (r * r - q * q) * iyz + p * r * ixy + m * (y * heave - z * sway),
        (ixx - izz) * r * p - q * r * ixy + (p * p - r * r) * izx + q * p * iyz + m * (z * surge - x * heave),
        (iyy - ixx) * p * q - r * p * iyz + (q * q - p * p) * ixy + r * q * izx + m * (x * sway - y * surge),
    )


@inline
def hydrostatics(work, i, sphi, cphi, sth, cth):
    """Weight and buoyancy (section 3), in N and N m."""
    weight = work[(BODY_ROWS + at.WEIGHT) * LANES + i]
    buoyancy = work[(BODY_ROWS + at.BUOYANCY) * LANES + i]
    net = weight - buoyancy
    x = weight * work[(BODY_ROWS + at.XG) * LANES + i] - buoyancy * work[(BODY_ROWS + at.XB) * LANES + i]
    y = weight * work[(BODY_ROWS + at.YG) * LANES + i] - buoyancy * work[(BODY_ROWS + at.YB) * LANES + i]
    z = weight * work[(BODY_ROWS + at.ZG) * LANES + i] - buoyancy * work[(BODY_ROWS + at.ZB) * LANES + i]
    return (
        -net * sth,
        net * cth * sphi,
        net * cth * cphi,
        y * cth * cphi - z * cth * sphi,
        -z * sth - x * cth * cphi,
        x * cth * sphi + y * sth,
    )


@inline
def kinematics(sphi, cphi, sth, cth, spsi, cpsi, u, v, w, p, q, r):
    """Rates of position and Euler angles (section 1), in m/s and rad/s."""
    secant = 1.0 / cth
    yawing = (sphi * q + cphi * r) * secant
    return (
        cpsi * cth * u + (cpsi * sth * sphi - spsi * cphi) * v + (spsi * sphi + cpsi * cphi * sth) * w,
        spsi * cth * u + (cpsi * cphi + sphi * sth * spsi) * v + (sth * spsi * cphi - cpsi * sphi) * w,
        -sth * u + cth * sphi * v + cth * cphi * w,
        p + sth * yawing,
        cphi * q - sphi * r,
        yawing,
    )


@inline
def state_derivative(work, i, state, dr, db, ds, ordered):
    """The twelve rates of lane `i` whose state begins at row `state`; the added masses enter through the inverse."""
    row = state * LANES + i
    sphi, cphi = sine_cosine(work[row + 3 * LANES])
    sth, cth = sine_cosine(work[row + 4 * LANES])
    spsi, cpsi = sine_cosine(work[row + 5 * LANES])
    u, v, w = work[row + 6 * LANES], work[row + 7 * LANES], work[row + 8 * LANES]
    p, q, r = work[row + 9 * LANES], work[row + 10 * LANES], work[row + 11 * LANES]
    x1, y1, z1, k1, m1, n1 = hydrodynamic_forces(work, i, u, v, w, p, q, r, dr, db, ds)
    x2, y2, z2, k2, m2, n2 = rigid_body(work, i, u, v, w, p, q, r)
    x3, y3, z3, k3, m3, n3 = hydrostatics(work, i, sphi, cphi, sth, cth)
    thrust, torque = propulsion(work, i, u, ordered)
    x = x1 - x2 + x3 + thrust
    y = y1 - y2 + y3
    z = z1 - z2 + z3
    k = k1 - k2 + k3 + torque
    m = m1 - m2 + m3 + thrust * work[(BODY_ROWS + at.ZP) * LANES + i]
    n = n1 - n2 + n3
    a = INVERSE_MASS * LANES + i
    b = a + 6 * LANES
    c = a + 12 * LANES
    d = a + 18 * LANES
    e = a + 24 * LANES
    f = a + 30 * LANES
    xdot, ydot, zdot, phidot, thetadot, psidot = kinematics(sphi, cphi, sth, cth, spsi, cpsi, u, v, w, p, q, r)
    return (
        xdot,
        ydot,
        zdot,
        phidot,
        thetadot,
        psidot,
        _row(work, a, x, y, z, k, m, n),
        _row(work, b, x, y, z, k, m, n),
        _row(work, c, x, y, z, k, m, n),
        _row(work, d, x, y, z, k, m, n),
        _row(work, e, x, y, z, k, m, n),
        _row(work, f, x, y, z, k, m, n),
    )


@inline
def _row(work, a, x, y, z, k, m, n):
    return (
        work[a] * x
        + work[a + LANES] * y
        + work[a + 2 * LANES] * z
        + work[a + 3 * LANES] * k
        + work[a + 4 * LANES] * m
        + work[a + 5 * LANES] * n
    )
