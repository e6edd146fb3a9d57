"""The REMUS 100 of Prestero (2001) once more: scalar, slow and independent of bayesub.

Typed from the thesis: its combined non-linear equations (6.7), its mass matrix (6.8), its kinematics (3.1) to (3.5)
and its Runge-Kutta method (6.16) to (6.18). The origin is the centre of buoyancy (section 3.1, page 20), and the
centre of gravity lies under it (Table A.4), so that only zg of the six offsets is written. A state is in his order,
[u v w p q r x y z phi theta psi]; fin angles are in radians.
"""

import itertools
import math

import numpy as np

GRAVITY = 9.81
WEIGHT = 299.0  # N, Table A.1, page 101
BUOYANCY = 308.0  # N, Table A.1, page 101 (Table 2.3, page 17: 306)
MASS = WEIGHT / GRAVITY
ZG = 0.0196  # m, Table A.4, page 102
IXX, IYY, IZZ = 0.177, 3.45, 3.45  # kg m^2, Table 2.6, page 18

FORCES = {  # Table B.1, page 103
    "Xuu": -1.62,
    "Xudot": -0.93,
    "Xwq": -35.5,
    "Xqq": -1.93,
    "Xvr": 35.5,
    "Xrr": -1.93,
    "Xprop": 3.86,
    "Yvv": -1310.0,
    "Yrr": 0.632,
    "Yuv": -28.6,
    "Yvdot": -35.5,
    "Yrdot": 1.93,
    "Yur": 5.22,
    "Ywp": 35.5,
    "Ypq": 1.93,
    "Yuudr": 9.64,
    "Zww": -131.0,
    "Zqq": -0.632,
    "Zuw": -28.6,
    "Zwdot": -35.5,
    "Zqdot": -1.93,
    "Zuq": -5.22,
    "Zvp": -35.5,
    "Zrp": 1.93,
    "Zuuds": -9.64,
}
MOMENTS = {  # Table B.2, page 104
    "Kpp": -0.13,
    "Kpdot": -0.0704,
    "Kprop": -0.543,
    "Mww": 3.18,
    "Mqq": -188.0,
    "Muw": 24.0,
    "Mwdot": -1.93,
    "Mqdot": -4.88,
    "Muq": -2.0,
    "Mvp": -1.93,
    "Mrp": 4.86,
    "Muuds": -6.15,
    "Nvv": -3.18,
    "Nrr": -94.0,
    "Nuv": -24.0,
    "Nvdot": 1.93,
    "Nrdot": -4.88,
    "Nur": -2.0,
    "Nwp": -1.93,
    "Npq": -4.86,
    "Nuudr": -6.15,
}
COEFFICIENTS = FORCES | MOMENTS


def mass_matrix(c=COEFFICIENTS):
    """Equation 6.8, page 45."""
    m, zg = MASS, ZG
    return np.array(
        [
            [m - c["Xudot"], 0, 0, 0, m * zg, 0],
            [0, m - c["Yvdot"], 0, -m * zg, 0, -c["Yrdot"]],
            [0, 0, m - c["Zwdot"], 0, -c["Zqdot"], 0],
            [0, -m * zg, 0, IXX - c["Kpdot"], 0, 0],
            [m * zg, 0, -c["Mwdot"], 0, IYY - c["Mqdot"], 0],
            [0, -c["Nvdot"], 0, 0, 0, IZZ - c["Nrdot"]],
        ]
    )


def forces(state, rudder, stern_plane, c=COEFFICIENTS, buoyancy=BUOYANCY):
    """Right-hand sides of equation 6.7, page 45: what is left of X to N without accelerations, N and N m."""
    u, v, w, p, q, r = state[:6]
    phi, theta = state[9], state[10]
    m, zg, heavy = MASS, ZG, WEIGHT - buoyancy

    x = -heavy * math.sin(theta) + c["Xuu"] * u * abs(u) + (c["Xwq"] - m) * w * q + c["Xqq"] * q**2
    x += (c["Xvr"] + m) * v * r + c["Xrr"] * r**2 - m * zg * p * r + c["Xprop"]

    y = heavy * math.cos(theta) * math.sin(phi) + c["Yvv"] * v * abs(v) + c["Yrr"] * r * abs(r) + c["Yuv"] * u * v
    y += (c["Ywp"] + m) * w * p + (c["Yur"] - m) * u * r - m * zg * q * r + c["Ypq"] * p * q
    y += c["Yuudr"] * u**2 * rudder

    z = heavy * math.cos(theta) * math.cos(phi) + c["Zww"] * w * abs(w) + c["Zqq"] * q * abs(q) + c["Zuw"] * u * w
    z += (c["Zuq"] + m) * u * q + (c["Zvp"] - m) * v * p + m * zg * p**2 + m * zg * q**2 + c["Zrp"] * r * p
    z += c["Zuuds"] * u**2 * stern_plane

    k = -zg * WEIGHT * math.cos(theta) * math.sin(phi) + c["Kpp"] * p * abs(p) - (IZZ - IYY) * q * r
    k += -m * zg * w * p + m * zg * u * r + c["Kprop"]

    mm = -zg * WEIGHT * math.sin(theta) + c["Mww"] * w * abs(w) + c["Mqq"] * q * abs(q)
    mm += (c["Mrp"] - (IXX - IZZ)) * r * p + m * zg * v * r - m * zg * w * q + c["Muq"] * u * q + c["Muw"] * u * w
    mm += c["Mvp"] * v * p + c["Muuds"] * u**2 * stern_plane

    n = c["Nvv"] * v * abs(v) + c["Nrr"] * r * abs(r) + c["Nuv"] * u * v + (c["Npq"] - (IYY - IXX)) * p * q
    n += c["Nwp"] * w * p + c["Nur"] * u * r + c["Nuudr"] * u**2 * rudder
    return np.array([x, y, z, k, mm, n])


def rates(state):
    """Equations 3.1 to 3.5, page 21: velocity over ground and rates of the Euler angles."""
    u, v, w, p, q, r = state[:6]
    phi, theta, psi = state[9:]
    s1, c1, s2, c2, s3, c3 = (f(a) for a in (phi, theta, psi) for f in (math.sin, math.cos))
    return [
        c3 * c2 * u + (c3 * s2 * s1 - s3 * c1) * v + (s3 * s1 + c3 * c1 * s2) * w,
        s3 * c2 * u + (c1 * c3 + s1 * s2 * s3) * v + (c1 * s2 * s3 - c3 * s1) * w,
        -s2 * u + c2 * s1 * v + c1 * c2 * w,
        p + s1 * s2 / c2 * q + c1 * s2 / c2 * r,
        c1 * q - s1 * r,
        s1 / c2 * q + c1 / c2 * r,
    ]


def derivative(state, rudder, stern_plane, c=COEFFICIENTS, buoyancy=BUOYANCY):
    """Time derivative of a state (equation 6.10, page 46)."""
    acceleration = np.linalg.solve(mass_matrix(c), forces(state, rudder, stern_plane, c, buoyancy))
    return np.array([*acceleration, *rates(state)])


def flight(state, controls, step, c=COEFFICIENTS, buoyancy=BUOYANCY):
    """States (n, 12) at each row of controls (n, 2) of rudder and stern plane, which are interpolated linearly."""

    def f(s, fins):
        return derivative(s, *fins, c, buoyancy)

    states = [np.array(state, float)]
    for fins, after in itertools.pairwise(controls):
        s, middle = states[-1], (fins + after) / 2
        k1 = f(s, fins)
        k2 = f(s + step / 2 * k1, middle)
        k3 = f(s + step / 2 * k2, middle)
        k4 = f(s + step * k3, after)
        states.append(s + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
    return np.array(states)
