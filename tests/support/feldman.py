"""The revised standard submarine equations once more: scalar, slow and independent of bayesub.

The first half is the set `feldman` typed by hand from its equations (Feldman 1979; Gertler & Hagen 1967 for the
products), with `boat` a vehicle file as it stands in TOML; rigid body and hydrostatics are those of `slow_twin`. The
second half is the boat of Healey & Lienard (1993) with its numbers typed in, as in the MSS toolbox
(CRAFT/AUV/models/npsauv.m of cybergalactic/MSS, commit 736a3d1, lines 104-156 and 186-274).
"""

import math

import numpy as np
from support import slow_twin


def trapezoids(boat, n):
    """n + 1 points along the hull, tail to nose, and the weights of the trapezoidal rule."""
    tail, nose = boat["hull"]["x_m"][0], boat["hull"]["x_m"][-1]
    weights = np.full(n + 1, (nose - tail) / n)
    weights[[0, -1]] /= 2.0
    return np.linspace(tail, nose, n + 1), weights


def gauss_legendre(boat, n):
    """n points along the hull and the weights of the Gauss-Legendre rule."""
    tail, nose = boat["hull"]["x_m"][0], boat["hull"]["x_m"][-1]
    points, weights = np.polynomial.legendre.leggauss(n)
    return (tail + nose) / 2.0 + (nose - tail) / 2.0 * points, (nose - tail) / 2.0 * weights


def crossflow(boat, velocity, points, weights):
    """The integrals of Y, Z, M and N for a drag coefficient of 1, without rho/2: m^4/s^2, m^4/s^2, m^5/s^2, m^5/s^2."""
    _, v, w, _, q, r = velocity
    y = z = m = n = 0.0
    for x, dx in zip(points, weights, strict=True):
        height = np.interp(x, boat["hull"]["x_m"], boat["hull"]["height_m"])
        breadth = np.interp(x, boat["hull"]["x_m"], boat["hull"]["breadth_m"])
        sway, heave = v + x * r, w - x * q
        speed = math.sqrt(heave**2 + sway**2)
        y -= height * sway * speed * dx
        z -= breadth * heave * speed * dx
        m += x * breadth * heave * speed * dx
        n -= x * height * sway * speed * dx
    return y, z, m, n


def hydrodynamics(boat, velocity, acceleration, controls, ordered, points, weights):
    """Forces (N) and moments (N m) of the set; `ordered` is the speed u_c = n/k0."""
    c = boat["coefficients"]
    u, v, w, p, q, r = velocity
    udot, vdot, wdot, pdot, qdot, rdot = acceleration
    dr, db, ds = controls
    nu = math.sqrt(v**2 + w**2)
    load = u * ordered - u**2  # u^2 (eta - 1)
    load_v, load_w = v * ordered - u * v, w * ordered - u * w  # u v (eta - 1), u w (eta - 1)
    load_p, load_q, load_r = p * ordered - u * p, q * ordered - u * q, r * ordered - u * r
    l0, l2, l3, l4, l5 = (
        0.5 * boat["body"]["water_density_kgm3"] * boat["body"]["length_m"] ** k for k in (0, 2, 3, 4, 5)
    )
    cross_y, cross_z, cross_m, cross_n = crossflow(boat, velocity, points, weights)

    x = l4 * (c["Xqq"] * q**2 + c["Xrr"] * r**2 + c["Xrp"] * r * p)
    x += l3 * (c["Xudot"] * udot + c["Xvr"] * v * r + c["Xwq"] * w * q)
    x += l2 * (c["Xuu"] * u**2 + c["Xvv"] * v**2 + c["Xww"] * w**2)
    x += l2 * u**2 * (c["Xuu_drdr"] * dr**2 + c["Xuu_dsds"] * ds**2 + c["Xuu_dbdb"] * db**2)
    x += l2 * load * (c["Xuu_drdr_eta"] * dr**2 + c["Xuu_dsds_eta"] * ds**2)

    y = l4 * (c["Yrdot"] * rdot + c["Ypdot"] * pdot + c["Yp_absp"] * p * abs(p) + c["Ypq"] * p * q + c["Yqr"] * q * r)
    y += l3 * (c["Yvdot"] * vdot + c["Yup"] * u * p + c["Yur"] * u * r + c["Yvq"] * v * q)
    y += l3 * (c["Ywp"] * w * p + c["Ywr"] * w * r)
    y += l2 * (c["Yuu"] * u**2 + c["Yuv"] * u * v + c["Yvw"] * v * w + c["Yv_absnu"] * v * nu)
    y += l2 * c["Yuu_dr"] * u**2 * dr
    y += l2 * (c["Yuu_dr_eta"] * load * dr + c["Yuv_eta"] * load_v) + l3 * c["Yur_eta"] * load_r
    y += l0 * c["Ycrossflow"] * cross_y

    z = l4 * (c["Zqdot"] * qdot + c["Zpp"] * p**2 + c["Zrr"] * r**2 + c["Zrp"] * r * p)
    z += l3 * (c["Zwdot"] * wdot + c["Zuq"] * u * q + c["Zvp"] * v * p + c["Zvr"] * v * r)
    z += l2 * (c["Zuu"] * u**2 + c["Zuw"] * u * w + c["Zvv"] * v**2)
    z += l2 * (c["Zu_absw"] * u * abs(w) + c["Zabsw_nu"] * abs(w) * nu)
    z += l2 * u**2 * (c["Zuu_ds"] * ds + c["Zuu_db"] * db)
    z += l2 * (c["Zuu_ds_eta"] * load * ds + c["Zuw_eta"] * load_w) + l3 * c["Zuq_eta"] * load_q
    z += l0 * c["Zcrossflow"] * cross_z

    k = l5 * (c["Kpdot"] * pdot + c["Krdot"] * rdot + c["Kqr"] * q * r + c["Kpq"] * p * q)
    k += l5 * c["Kp_absp"] * p * abs(p)
    k += l4 * (c["Kvdot"] * vdot + c["Kup"] * u * p + c["Kur"] * u * r + c["Kvq"] * v * q)
    k += l4 * (c["Kwp"] * w * p + c["Kwr"] * w * r)
    k += l3 * (c["Kuu"] * u**2 + c["Kuv"] * u * v + c["Kvw"] * v * w + c["Kuu_dr"] * u**2 * dr)
    k += l3 * c["Kuu_dr_eta"] * load * dr + l4 * c["Kup_eta"] * load_p

    m = l5 * (c["Mqdot"] * qdot + c["Mpp"] * p**2 + c["Mrr"] * r**2 + c["Mrp"] * r * p)
    m += l4 * (c["Mwdot"] * wdot + c["Muq"] * u * q + c["Mvp"] * v * p + c["Mvr"] * v * r)
    m += l3 * (c["Muu"] * u**2 + c["Muw"] * u * w + c["Mvv"] * v**2)
    m += l3 * (c["Mu_absw"] * u * abs(w) + c["Mabsw_nu"] * abs(w) * nu)
    m += l3 * u**2 * (c["Muu_ds"] * ds + c["Muu_db"] * db)
    m += l3 * (c["Muu_ds_eta"] * load * ds + c["Muw_eta"] * load_w) + l4 * c["Muq_eta"] * load_q
    m += l0 * c["Mcrossflow"] * cross_m

    n = l5 * (c["Nrdot"] * rdot + c["Npdot"] * pdot + c["Npq"] * p * q + c["Nqr"] * q * r)
    n += l4 * (c["Nvdot"] * vdot + c["Nup"] * u * p + c["Nur"] * u * r + c["Nvq"] * v * q)
    n += l4 * (c["Nwp"] * w * p + c["Nwr"] * w * r)
    n += l3 * (c["Nuu"] * u**2 + c["Nuv"] * u * v + c["Nvw"] * v * w + c["Nv_absnu"] * v * nu)
    n += l3 * c["Nuu_dr"] * u**2 * dr
    n += l3 * (c["Nuu_dr_eta"] * load * dr + c["Nuv_eta"] * load_v) + l4 * c["Nur_eta"] * load_r
    n += l0 * c["Ncrossflow"] * cross_n
    return np.array([x, y, z, k, m, n])


def accelerations(boat, state, controls, rpm, points, weights):
    """Body accelerations (6,) of one state (12,), with the integrals by these points and weights."""
    _, _, _, phi, theta, _, *velocity = (float(value) for value in state)
    rest = [0.0] * 6
    ordered = rpm / boat["propulsion"]["rpm_per_mps"]
    with_torque = {**boat, "propulsion": {"torque": [0.0, 0.0], **boat["propulsion"]}}

    def unbalanced(acceleration):
        force = hydrodynamics(boat, velocity, acceleration, controls, ordered, points, weights)
        force += np.add(slow_twin.hydrostatics(boat, phi, theta), slow_twin.propulsion(with_torque, velocity[0], rpm))
        return force - slow_twin.rigid_body(boat, velocity, acceleration)

    at_rest = unbalanced(rest)
    columns = [at_rest - unbalanced([float(j == k) for k in range(6)]) for j in range(6)]
    return np.linalg.solve(np.array(columns).T, at_rest)


# --- Healey & Lienard (1993) ---

LENGTH, DENSITY = 5.3, 1025.0

HULL = {
    "X": {"pp": 7.0e-3, "qq": -1.5e-2, "rr": 4.0e-3, "pr": 7.5e-4, "udot": -7.6e-3, "wq": -2.0e-1, "vp": -3.0e-3}
    | {"vr": 2.0e-2, "vv": 5.3e-2, "ww": 1.7e-1},
    "Y": {"pdot": 1.2e-4, "rdot": 1.2e-3, "pq": 4.0e-3, "qr": -6.5e-3, "vdot": -5.5e-2, "up": 3.0e-3, "ur": 3.0e-2}
    | {"vq": 2.4e-2, "wp": 2.3e-1, "wr": -1.9e-2, "uv": -1.0e-1, "vw": 6.8e-2},
    "Z": {"qdot": -6.8e-3, "pp": 1.3e-4, "pr": 6.7e-3, "rr": -7.4e-3, "wdot": -2.4e-1, "uq": -1.4e-1}
    | {"vp": -4.8e-2, "vr": 4.5e-2, "uw": -3.0e-1, "vv": -6.8e-2},
    "K": {"pdot": -1.0e-3, "rdot": -3.4e-5, "pq": -6.9e-5, "qr": 1.7e-2, "vdot": 1.2e-4, "up": -1.1e-2}
    | {"ur": -8.4e-4, "vq": -5.1e-3, "wp": -1.3e-4, "wr": 1.4e-2, "uv": 3.1e-3, "vw": -1.9e-1},
    "M": {"qdot": -1.7e-2, "pp": 5.3e-5, "pr": 5.0e-3, "rr": 2.9e-3, "wdot": -6.8e-3, "uq": -6.8e-2}
    | {"vp": 1.2e-3, "vr": 1.7e-2, "uw": 1.0e-1, "vv": -2.6e-2},
    "N": {"pdot": -3.4e-5, "rdot": -3.4e-3, "pq": -2.1e-2, "qr": 2.7e-3, "vdot": 1.2e-3, "up": -8.4e-4}
    | {"ur": -1.6e-2, "vq": -1.0e-2, "wp": -1.7e-2, "wr": 7.4e-3, "uv": -7.4e-3, "vw": -2.7e-2},
}
DRAG, DRAG_Y, DRAG_Z = 0.00385, 0.5, 0.6
# Planes: u^2 delta of Y, Z, M, N and u^2 delta^2 of X; those of one of the two bow planes.
PLANES = {"Ydr": 2.7e-2, "Ndr": -1.3e-2, "Zds": -7.3e-2, "Mds": -4.1e-2, "Zdb": -1.3e-2, "Mdb": 3.5e-3}
PLANES |= {"Xdsds": -1.0e-2, "Xdrdr": -1.0e-2, "Xdbdb": -4.0e-3}  # the last: the older VESSELS/npsauv.m there
# Of the function of the propeller's load that is zero at self-propulsion.
LOAD = {"Zuq": -2.9e-3, "Zuw": -5.1e-3, "Zds": -1.0e-2, "Kup": -5.7e-4, "Muq": -1.6e-3, "Muw": -2.9e-3, "Mds": -5.2e-3}
LOAD |= {"Xdsds": -1.6e-3}


def load_function(eta):
    """What the propeller adds to planes and hull forces, of eta = u_c/u: minus one at rest, zero at self-propulsion."""
    own, even = 0.008 * LENGTH**2 * abs(eta) * eta / 2.0, 0.008 * LENGTH**2 / 2.0
    return -1.0 + (math.sqrt(own + 1.0) - 1.0) / (math.sqrt(even + 1.0) - 1.0)


def healey_lienard(boat, state, controls, points, weights):
    """Body accelerations at self-propulsion, without the terms of X that the set lacks; `boat` gives the rigid body.

    The cross-flow drag is that of the publication, which mixes height and breadth of the block of 0.53 m. In the
    pitching moment it has the sign of Brutzman (1994), w - x q and +, where the publication has w + x q.
    """
    _, _, _, phi, theta, _, *velocity = (float(value) for value in state)
    u, v, w, p, q, r = velocity
    dr, db, ds = controls
    drag = np.zeros(6)
    for x, dx in zip(points, weights, strict=True):
        sway, heave = v + x * r, w - x * q
        strip = DRAG_Y * 0.53 * sway**2 + DRAG_Z * 0.53 * heave**2
        speed = math.sqrt(sway**2 + heave**2)
        drag -= strip / speed * dx * np.array([0.0, sway, heave, 0.0, -x * heave, x * sway])

    def unbalanced(acceleration):
        udot, vdot, wdot, pdot, qdot, rdot = acceleration
        motion = {"udot": udot, "vdot": vdot, "wdot": wdot, "pdot": pdot, "qdot": qdot, "rdot": rdot}
        motion |= {"pp": p * p, "qq": q * q, "rr": r * r, "pr": p * r, "pq": p * q, "qr": q * r}
        motion |= {"up": u * p, "uq": u * q, "ur": u * r, "vp": v * p, "vq": v * q, "vr": v * r}
        motion |= {
            "wp": w * p,
            "wq": w * q,
            "wr": w * r,
            "uv": u * v,
            "uw": u * w,
            "vw": v * w,
            "vv": v * v,
            "ww": w * w,
        }
        rotational = set("pqr") | {"pdot", "qdot", "rdot"}
        force = DENSITY / 2.0 * drag
        for row, (axis, values) in enumerate(HULL.items()):
            for name, value in values.items():
                if axis == "X" and name in ("pp", "vp"):
                    continue
                letters = [name] if name.endswith("dot") else list(name)
                power = 2 + sum(letter in rotational for letter in letters) + (axis in "KMN")
                power += name.endswith("dot")
                force[row] += DENSITY / 2.0 * LENGTH**power * value * motion[name]
        square, cube = DENSITY / 2.0 * LENGTH**2 * u**2, DENSITY / 2.0 * LENGTH**3 * u**2
        force[0] += square * (PLANES["Xdrdr"] * dr**2 + PLANES["Xdsds"] * ds**2 + 2.0 * PLANES["Xdbdb"] * db**2)
        force[1] += square * PLANES["Ydr"] * dr
        force[2] += square * (PLANES["Zds"] * ds + 2.0 * PLANES["Zdb"] * db)
        force[4] += cube * (PLANES["Mds"] * ds + 2.0 * PLANES["Mdb"] * db)
        force[5] += cube * PLANES["Ndr"] * dr
        force += slow_twin.hydrostatics(boat, phi, theta)
        return force - slow_twin.rigid_body(boat, velocity, acceleration)

    at_rest = unbalanced([0.0] * 6)
    columns = [at_rest - unbalanced([float(j == k) for k in range(6)]) for j in range(6)]
    return np.linalg.solve(np.array(columns).T, at_rest)
