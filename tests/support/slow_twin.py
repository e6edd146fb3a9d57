"""The submarine model once more: scalar, slow and independent of bayesub.

Typed by hand from the equations of motion in the project's model description (sections 1 to 6 there, Gertler & Hagen
1967 and Feldman 1979). `boat` is a vehicle file as it stands in TOML, so that the reading of units is tested too.
Plain floats and dictionaries; the mass matrix is read off the equations by evaluating them at unit accelerations.
"""

import math

import numpy as np

GRAVITY = 9.81
RHO_HALF = 0.5


def _sign(x):
    return float(x > 0) - float(x < 0)


def rigid_body(boat, velocity, acceleration):
    """Left-hand sides of section 2: forces (N) and moments (N m)."""
    u, v, w, p, q, r = velocity
    udot, vdot, wdot, pdot, qdot, rdot = acceleration
    m = boat["body"]["mass_kg"]
    xg, yg, zg = boat["body"]["centre_of_gravity_m"]
    i = boat["body"]["inertia_kgm2"]
    ixx, iyy, izz, ixy, iyz, izx = i["Ixx"], i["Iyy"], i["Izz"], i["Ixy"], i["Iyz"], i["Izx"]
    return [
        m * (udot - v * r + w * q - xg * (q**2 + r**2) + yg * (p * q - rdot) + zg * (p * r + qdot)),
        m * (vdot - w * p + u * r - yg * (r**2 + p**2) + zg * (q * r - pdot) + xg * (p * q + rdot)),
        m * (wdot - u * q + v * p - zg * (p**2 + q**2) + xg * (r * p - qdot) + yg * (r * q + pdot)),
        ixx * pdot
        + (izz - iyy) * q * r
        - (rdot + p * q) * izx
        + (r**2 - q**2) * iyz
        + (p * r - qdot) * ixy
        + m * (yg * (wdot - u * q + v * p) - zg * (vdot - w * p + u * r)),
        iyy * qdot
        + (ixx - izz) * r * p
        - (pdot + q * r) * ixy
        + (p**2 - r**2) * izx
        + (q * p - rdot) * iyz
        + m * (zg * (udot - v * r + w * q) - xg * (wdot - u * q + v * p)),
        izz * rdot
        + (iyy - ixx) * p * q
        - (qdot + r * p) * iyz
        + (q**2 - p**2) * ixy
        + (r * q - pdot) * izx
        + m * (xg * (vdot - w * p + u * r) - yg * (udot - v * r + w * q)),
    ]


def hydrostatics(boat, phi, theta):
    """Section 3."""
    body = boat["body"]
    weight = body["mass_kg"] * GRAVITY
    buoyancy = weight if body["neutrally_buoyant"] else body["buoyancy_n"]
    (xg, yg, zg), (xb, yb, zb) = body["centre_of_gravity_m"], body["centre_of_buoyancy_m"]
    x, y, z = weight * xg - buoyancy * xb, weight * yg - buoyancy * yb, weight * zg - buoyancy * zb
    excess = weight - buoyancy
    return [
        -excess * math.sin(theta),
        excess * math.cos(theta) * math.sin(phi),
        excess * math.cos(theta) * math.cos(phi),
        y * math.cos(theta) * math.cos(phi) - z * math.cos(theta) * math.sin(phi),
        -z * math.sin(theta) - x * math.cos(theta) * math.cos(phi),
        x * math.cos(theta) * math.sin(phi) + y * math.sin(theta),
    ]


def hydrodynamics(boat, velocity, acceleration, controls):
    """The 101 terms of section 4."""
    c = boat["coefficients"]
    u, v, w, p, q, r = velocity
    udot, vdot, wdot, pdot, qdot, rdot = acceleration
    dr, db, ds = controls
    nu = math.sqrt(v**2 + w**2)
    l2, l3, l4, l5 = (
        RHO_HALF * boat["body"]["water_density_kgm3"] * boat["body"]["length_m"] ** k for k in (2, 3, 4, 5)
    )
    x2 = c["Xuu"] * u**2 + c["Xvv"] * v**2 + c["Xww"] * w**2
    x2 += u**2 * (c["Xuu_drdr"] * dr**2 + c["Xuu_dbdb"] * db**2 + c["Xuu_dsds"] * ds**2)
    x3 = c["Xudot"] * udot + c["Xvr"] * v * r + c["Xwq"] * w * q
    x4 = c["Xqq"] * q**2 + c["Xrr"] * r**2 + c["Xrp"] * r * p

    y2 = c["Yuu"] * u**2 + c["Yuv"] * u * v + c["Yvw"] * v * w + c["Yv_absnu"] * v * nu + c["Yuu_dr"] * u**2 * dr
    y3 = c["Yvdot"] * vdot + c["Yup"] * u * p + c["Yur"] * u * r + c["Yvq"] * v * q + c["Ywp"] * w * p
    y3 += c["Ywr"] * w * r + c["Yv_absr"] * _sign(v) * nu * abs(r) + c["Yu_absr_dr"] * u * abs(r) * dr
    y4 = c["Ypdot"] * pdot + c["Yrdot"] * rdot + c["Yp_absp"] * p * abs(p) + c["Ypq"] * p * q + c["Yqr"] * q * r

    z2 = c["Zuu"] * u**2 + c["Zuw"] * u * w + c["Zvv"] * v**2 + c["Zuu_db"] * u**2 * db + c["Zuu_ds"] * u**2 * ds
    z2 += c["Zw_absnu"] * w * nu + c["Zu_absw"] * u * abs(w) + c["Zabsw_nu"] * abs(w) * nu
    z3 = c["Zwdot"] * wdot + c["Zuq"] * u * q + c["Zvp"] * v * p + c["Zvr"] * v * r
    z3 += c["Zu_absq_ds"] * u * abs(q) * ds + c["Zw_absq"] * _sign(w) * nu * abs(q)
    z4 = c["Zqdot"] * qdot + c["Zpp"] * p**2 + c["Zrr"] * r**2 + c["Zrp"] * r * p

    k3 = c["Kuu"] * u**2 + c["Kuv"] * u * v + c["Kvw"] * v * w + c["Kv_absnu"] * v * nu + c["Kuu_dr"] * u**2 * dr
    k4 = c["Kvdot"] * vdot + c["Kup"] * u * p + c["Kur"] * u * r + c["Kvq"] * v * q + c["Kwp"] * w * p
    k4 += c["Kwr"] * w * r
    k5 = c["Kpdot"] * pdot + c["Krdot"] * rdot + c["Kqr"] * q * r + c["Kpq"] * p * q + c["Kp_absp"] * p * abs(p)

    m3 = c["Muu"] * u**2 + c["Muw"] * u * w + c["Mvv"] * v**2 + c["Muu_db"] * u**2 * db + c["Muu_ds"] * u**2 * ds
    m3 += c["Mw_absnu"] * w * nu + c["Mu_absw"] * u * abs(w) + c["Mabsw_nu"] * abs(w) * nu
    m4 = c["Mwdot"] * wdot + c["Muq"] * u * q + c["Mvp"] * v * p + c["Mvr"] * v * r
    m4 += c["Mu_absq_ds"] * u * abs(q) * ds + c["Mabsnu_q"] * nu * q
    m5 = c["Mqdot"] * qdot + c["Mpp"] * p**2 + c["Mrr"] * r**2 + c["Mrp"] * r * p + c["Mq_absq"] * q * abs(q)

    n3 = c["Nuu"] * u**2 + c["Nuv"] * u * v + c["Nvw"] * v * w + c["Nv_absnu"] * v * nu + c["Nuu_dr"] * u**2 * dr
    n4 = c["Nvdot"] * vdot + c["Nup"] * u * p + c["Nur"] * u * r + c["Nvq"] * v * q + c["Nwp"] * w * p
    n4 += c["Nwr"] * w * r + c["Nabsnu_r"] * nu * r + c["Nu_absr_dr"] * u * abs(r) * dr
    n5 = c["Npdot"] * pdot + c["Nrdot"] * rdot + c["Npq"] * p * q + c["Nqr"] * q * r + c["Nr_absr"] * r * abs(r)
    return [
        l2 * x2 + l3 * x3 + l4 * x4,
        l2 * y2 + l3 * y3 + l4 * y4,
        l2 * z2 + l3 * z3 + l4 * z4,
        l3 * k3 + l4 * k4 + l5 * k5,
        l3 * m3 + l4 * m4 + l5 * m5,
        l3 * n3 + l4 * n4 + l5 * n5,
    ]


def propulsion(boat, u, rpm):
    """Section 5; at u = 0, where n' has no value, the branch is that of its limit from ahead."""
    b = (None, *boat["propulsion"]["b"])  # numbered from one
    ordered = rpm / boat["propulsion"]["rpm_per_mps"]
    ratio = ordered / u if u != 0 else math.copysign(math.inf, rpm)
    if ratio > 1:
        i = 1
    elif ratio > 0:
        i = 4
    else:
        i = 7
    thrust = b[i] * u * abs(u) + b[i + 1] * abs(u) * ordered + b[i + 2] * ordered**2
    thrust *= RHO_HALF * boat["body"]["water_density_kgm3"] * boat["body"]["length_m"] ** 2
    kn1, kn2 = boat["propulsion"]["torque"]
    if u < 0:
        kn2 = 0.0
    if rpm < 0:
        kn1 = kn2 = 0.0
    return [thrust, 0.0, 0.0, kn1 * rpm**2 + kn2 * rpm * u, thrust * boat["propulsion"]["thrust_line_z_m"], 0.0]


def mass_matrix(boat):
    """Section 6: column j holds what a unit of acceleration j costs, rigid body less added mass, at rest."""
    rest, columns = [0.0] * 6, []
    for j in range(6):
        unit = [float(j == k) for k in range(6)]
        columns.append(np.subtract(rigid_body(boat, rest, unit), hydrodynamics(boat, rest, unit, [0.0] * 3)))
    return np.array(columns).T


def accelerations(boat, state, controls, rpm):
    """Body accelerations (6,) of one state (12,)."""
    _, _, _, phi, theta, _, *velocity = (float(value) for value in state)
    rest = [0.0] * 6
    force = np.array(hydrodynamics(boat, velocity, rest, controls)) + hydrostatics(boat, phi, theta)
    force += propulsion(boat, velocity[0], rpm)
    force -= rigid_body(boat, velocity, rest)
    return np.linalg.solve(mass_matrix(boat), force)


def kinematics(state):
    """Section 1: rates of position and Euler angles (6,)."""
    _, _, _, phi, theta, psi, u, v, w, p, q, r = (float(value) for value in state)
    sphi, cphi, sth, cth = math.sin(phi), math.cos(phi), math.sin(theta), math.cos(theta)
    spsi, cpsi, tth = math.sin(psi), math.cos(psi), math.tan(theta)
    return np.array(
        [
            cpsi * cth * u + (-spsi * cphi + cpsi * sth * sphi) * v + (spsi * sphi + cpsi * cphi * sth) * w,
            spsi * cth * u + (cpsi * cphi + sphi * sth * spsi) * v + (-cpsi * sphi + sth * spsi * cphi) * w,
            -sth * u + cth * sphi * v + cth * cphi * w,
            p + sphi * tth * q + cphi * tth * r,
            cphi * q - sphi * r,
            (sphi * q + cphi * r) / cth,
        ]
    )


def derivative(boat, state, controls, rpm):
    """Rates of the state (12,)."""
    return np.concatenate([kinematics(state), accelerations(boat, state, controls, rpm)])


def fly(boat, state, history, step, n_steps):
    """Classical fourth-order Runge-Kutta; `history(t)` gives controls (3,) and rpm. States (n_steps + 1, 12)."""
    states = [np.array(state, dtype=float)]
    for n in range(n_steps):
        start, middle, end = (history((n + f) * step) for f in (0.0, 0.5, 1.0))
        s = states[-1]
        k1 = derivative(boat, s, *start)
        k2 = derivative(boat, s + step / 2 * k1, *middle)
        k3 = derivative(boat, s + step / 2 * k2, *middle)
        k4 = derivative(boat, s + step * k3, *end)
        states.append(s + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
    return np.array(states)
