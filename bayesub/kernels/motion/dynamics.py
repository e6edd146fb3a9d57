"""The equations of motion of one lane: state derivative from state and controls (model manual, sections 1 to 6)."""

from bayesub.kernels import workspace as at
from bayesub.kernels.jit import inline
from bayesub.kernels.trigonometry import sine_cosine
from bayesub.kernels.workspace import BODY_ROWS, INVERSE_MASS, LANES

from .hydrodynamics import ORDERED_SPEED, RIGID_BODY_TERMS, hydrodynamic_forces
from .layout import CONTROLS, HAS_WEIGHTS, WEIGHTS


@inline
def ordered_speed(work, i, control):
    """n/k0 of lane `i`, the speed that the propeller keeps up (m/s)."""
    return control[ORDERED_SPEED] + work[(CONTROLS + ORDERED_SPEED) * LANES + i]


@inline
def propulsion(work, i, u, ordered):
    """Thrust (N) and torque (N m) of the three-branch polynomial, and their derivatives with u.

    They are those of the model manual, section 5. `ordered` is n/k0, the speed that the propeller speed keeps up (m/s).
    """
    forward = ordered > u if u >= 0.0 else ordered < u  # n' = n / (k0 u) > 1
    astern = ordered <= 0.0 if u >= 0.0 else ordered >= 0.0  # n' <= 0
    row = (BODY_ROWS + at.B1) * LANES + i
    b1, b2, b3 = work[row], work[row + LANES], work[row + 2 * LANES]
    b4, b5, b6 = work[row + 3 * LANES], work[row + 4 * LANES], work[row + 5 * LANES]
    b7, b8, b9 = work[row + 6 * LANES], work[row + 7 * LANES], work[row + 8 * LANES]
    # Chosen among loaded values: a choice of what to load would become a slow gather.
    b1 = b1 if forward else (b7 if astern else b4)
    b2 = b2 if forward else (b8 if astern else b5)
    b3 = b3 if forward else (b9 if astern else b6)
    speed = abs(u)
    thrust = b1 * u * speed + b2 * speed * ordered + b3 * ordered * ordered
    thrust_u = 2.0 * b1 * speed + (b2 * ordered if u >= 0.0 else -b2 * ordered)
    advance, advance_u = (u, 1.0) if u > 0.0 else (0.0, 0.0)
    kn1, kn2 = work[(BODY_ROWS + at.KN1) * LANES + i], work[(BODY_ROWS + at.KN2) * LANES + i]
    torque = kn1 * ordered * ordered + kn2 * ordered * advance
    turning = 1.0 if ordered > 0.0 else 0.0
    return thrust, turning * torque, thrust_u, turning * kn2 * ordered * advance_u


@inline
def rigid_body(work, i, u1, v1, w1, p1, q1, r1, u2, v2, w2, p2, q2, r2):
    """The velocity terms of the left-hand sides (model manual, section 2), in N and N m, as a bilinear form.

    With the velocity in both places they are the terms themselves; the form of a velocity and its variation plus that
    of the variation and the velocity is their derivative. A set whose coefficients contain them has none.
    """
    if not RIGID_BODY_TERMS:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
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


@inline
def hydrostatics(work, i, control, gx, gy, gz):
    """Weight and buoyancy (model manual, section 3), in N and N m; (gx, gy, gz) points down, in body axes.

    With forces from outside there is a weight from outside too, and its moments about the origin (section 3).
    """
    weight = work[(BODY_ROWS + at.WEIGHT) * LANES + i]
    buoyancy = work[(BODY_ROWS + at.BUOYANCY) * LANES + i]
    net = weight - buoyancy
    x = weight * work[(BODY_ROWS + at.XG) * LANES + i] - buoyancy * work[(BODY_ROWS + at.XB) * LANES + i]
    y = weight * work[(BODY_ROWS + at.YG) * LANES + i] - buoyancy * work[(BODY_ROWS + at.YB) * LANES + i]
    z = weight * work[(BODY_ROWS + at.ZG) * LANES + i] - buoyancy * work[(BODY_ROWS + at.ZB) * LANES + i]
    if HAS_WEIGHTS:
        row = (CONTROLS + WEIGHTS) * LANES + i
        net += control[WEIGHTS] + work[row]
        x += control[WEIGHTS + 1] + work[row + LANES]
        y += control[WEIGHTS + 2] + work[row + 2 * LANES]
        z += control[WEIGHTS + 3] + work[row + 3 * LANES]
    return net * gx, net * gy, net * gz, y * gz - z * gy, z * gx - x * gz, x * gy - y * gx


@inline
def store_weight_slopes(slopes, gx, gy, gz):
    """Write the derivatives of :func:`hydrostatics` by a weight from outside and its moments into `slopes`."""
    if HAS_WEIGHTS:
        slopes[0, WEIGHTS], slopes[1, WEIGHTS], slopes[2, WEIGHTS] = gx, gy, gz
        slopes[4, WEIGHTS + 1], slopes[5, WEIGHTS + 1] = -gz, gy
        slopes[3, WEIGHTS + 2], slopes[5, WEIGHTS + 2] = gz, -gx
        slopes[3, WEIGHTS + 3], slopes[4, WEIGHTS + 3] = -gy, gx


@inline
def accelerations(work, i, row, gx, gy, gz, control):
    """udot vdot wdot pdot qdot rdot of the state at position `row`: M^-1 times all forces without added mass."""
    u, v, w = work[row + 6 * LANES], work[row + 7 * LANES], work[row + 8 * LANES]
    p, q, r = work[row + 9 * LANES], work[row + 10 * LANES], work[row + 11 * LANES]
    x1, y1, z1, k1, m1, n1 = hydrodynamic_forces(work, i, control, u, v, w, p, q, r)
    x2, y2, z2, k2, m2, n2 = rigid_body(work, i, u, v, w, p, q, r, u, v, w, p, q, r)
    x3, y3, z3, k3, m3, n3 = hydrostatics(work, i, control, gx, gy, gz)
    thrust, torque, _, _ = propulsion(work, i, u, ordered_speed(work, i, control))
    x = x1 - x2 + x3 + thrust
    y = y1 - y2 + y3
    z = z1 - z2 + z3
    k = k1 - k2 + k3 + torque
    m = m1 - m2 + m3 + thrust * work[(BODY_ROWS + at.ZP) * LANES + i]
    n = n1 - n2 + n3
    first = INVERSE_MASS * LANES + i
    return (
        row_times(work, first, x, y, z, k, m, n),
        row_times(work, first + 6 * LANES, x, y, z, k, m, n),
        row_times(work, first + 12 * LANES, x, y, z, k, m, n),
        row_times(work, first + 18 * LANES, x, y, z, k, m, n),
        row_times(work, first + 24 * LANES, x, y, z, k, m, n),
        row_times(work, first + 30 * LANES, x, y, z, k, m, n),
    )


@inline
def euler_derivative(work, i, state, control):
    """The twelve rates (model manual, section 1) of lane `i` whose state, with Euler angles, begins at row `state`."""
    row = state * LANES + i
    sphi, cphi = sine_cosine(work[row + 3 * LANES])
    sth, cth = sine_cosine(work[row + 4 * LANES])
    spsi, cpsi = sine_cosine(work[row + 5 * LANES])
    u, v, w = work[row + 6 * LANES], work[row + 7 * LANES], work[row + 8 * LANES]
    p, q, r = work[row + 9 * LANES], work[row + 10 * LANES], work[row + 11 * LANES]
    udot, vdot, wdot, pdot, qdot, rdot = accelerations(work, i, row, -sth, cth * sphi, cth * cphi, control)
    yawing = (sphi * q + cphi * r) * (1.0 / cth)
    return (
        cpsi * cth * u + (cpsi * sth * sphi - spsi * cphi) * v + (spsi * sphi + cpsi * cphi * sth) * w,
        spsi * cth * u + (cpsi * cphi + sphi * sth * spsi) * v + (sth * spsi * cphi - cpsi * sphi) * w,
        -sth * u + cth * sphi * v + cth * cphi * w,
        p + sth * yawing,
        cphi * q - sphi * r,
        yawing,
        udot,
        vdot,
        wdot,
        pdot,
        qdot,
        rdot,
    )


@inline
def quaternion_derivative(work, i, state, control):
    """The thirteen rates of a state with a unit quaternion (thesis appendix B, equations 42 and 43)."""
    row = state * LANES + i
    q0, q1, q2, q3 = work[row + 12 * LANES], work[row + 3 * LANES], work[row + 4 * LANES], work[row + 5 * LANES]
    u, v, w = work[row + 6 * LANES], work[row + 7 * LANES], work[row + 8 * LANES]
    p, q, r = work[row + 9 * LANES], work[row + 10 * LANES], work[row + 11 * LANES]
    gx = 2.0 * (q1 * q3 - q0 * q2)
    gy = 2.0 * (q2 * q3 + q0 * q1)
    gz = q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3
    udot, vdot, wdot, pdot, qdot, rdot = accelerations(work, i, row, gx, gy, gz, control)
    return (
        (q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3) * u + 2.0 * ((q1 * q2 - q0 * q3) * v + (q1 * q3 + q0 * q2) * w),
        (q0 * q0 - q1 * q1 + q2 * q2 - q3 * q3) * v + 2.0 * ((q1 * q2 + q0 * q3) * u + (q2 * q3 - q0 * q1) * w),
        gx * u + gy * v + gz * w,
        0.5 * (q0 * p - q3 * q + q2 * r),
        0.5 * (q3 * p + q0 * q - q1 * r),
        0.5 * (q1 * q + q0 * r - q2 * p),
        udot,
        vdot,
        wdot,
        pdot,
        qdot,
        rdot,
        -0.5 * (q1 * p + q2 * q + q3 * r),
    )


@inline
def row_times(work, a, x, y, z, k, m, n):
    """The row of the inverse mass matrix at position `a` times forces and moments."""
    return (
        work[a] * x
        + work[a + LANES] * y
        + work[a + 2 * LANES] * z
        + work[a + 3 * LANES] * k
        + work[a + 4 * LANES] * m
        + work[a + 5 * LANES] * n
    )
