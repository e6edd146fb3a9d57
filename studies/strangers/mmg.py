"""A tanker model with one propeller and one rudder by the MMG standard method, with Runge-Kutta steps of 0.1 s.

The equations and the numbers of KVLCC2, the model of 7 m, are those of Yasukawa & Yoshimura (2015); a program such as
mmg-1p1r has the same parts: hull, propeller with a wake that changes with drift and turning, rudder in the slipstream
with flow straightening. The rudder moves linearly over a step. Conventions of the log: SI units and radians,
revolutions a second, the rudder positive to starboard, velocities amidships, and the forces on propeller and rudder
that the program computes, as a model with balances on shaft and stock measures them.

bayesub has no flow at the rudder. With the measured forces as inputs every other part is a term: the derivatives of the
hull, added masses, thrust deduction, and the shares of the rudder force that act on the ship. With the rudder angle
alone the equations differ.
"""

import math
from pathlib import Path

import numpy as np

from strangers import steps

NAME, TITLE, EQUATIONS = "mmg", "MMG, tanker KVLCC2", "own terms"
LENGTH, DRAUGHT, DENSITY = 7.0, 0.46, 1000.0  # m, m, kg/m^3
MASS, XG = 3270.0, 0.25  # kg, m
INERTIA = MASS * (0.25 * LENGTH) ** 2  # about the centre of gravity, kg m^2
DIAMETER, DIAGRAM = 0.216, (0.2931, -0.2753, -0.1385)  # of the propeller, and its KT by powers of J
RUDDER_AREA, RUDDER_HEIGHT, GRADIENT = 0.0539, 0.345, 2.747  # m^2, m, slope of the normal force
RUDDER_X = -0.5 * LENGTH
RATE, LIMIT = math.radians(15.8), math.radians(35.0)
SPEED = 1.179
STEP_S, ROW_S = 0.1, 0.1
SECONDS = {"fitted": 320.0, "unseen": 240.0}
DEGREES = {  # positive to starboard
    "fitted": ((10.0, 10.0), (40.0, -20.0), (90.0, 20.0), (140.0, -35.0), (200.0, 35.0), (260.0, -10.0)),
    "unseen": ((8.0, 20.0), (50.0, -15.0), (100.0, 30.0), (150.0, -30.0), (200.0, 5.0)),
}
START = {"x0_m": 0.0, "y0_m": 0.0, "yaw0_deg": 0.0, "u0_mps": SPEED, "v0_mps": 0.0, "r0_degps": 0.0}
_ANGLE, _RATE = math.radians(0.1), math.radians(0.05)
NOISE = {"x_position": 0.02, "y_position": 0.02, "psi": _ANGLE, "u_velo": 0.005, "vm_velo": 0.005, "r_angvelo": _RATE}
SENSORS = {"x_m": 0.02, "y_m": 0.02, "heading_deg": 0.1, "u_mps": 0.005, "v_mps": 0.005, "r_degps": 0.05}
PARAMETERS = {
    **{"R_0": 0.022, "X_vv": -0.040, "X_vr": 0.002, "X_rr": 0.011, "X_vvvv": 0.771},
    **{"Y_v": -0.315, "Y_r": 0.083, "Y_vvv": -1.607, "Y_vvr": 0.379, "Y_vrr": -0.391, "Y_rrr": 0.008},
    **{"N_v": -0.137, "N_r": -0.049, "N_vvv": -0.030, "N_vvr": -0.294, "N_vrr": 0.055, "N_rrr": -0.013},
    **{"m_x": 0.022, "m_y": 0.223, "J_z": 0.011},
    # Shares of thrust and rudder force on the ship: 1 - t_P, 1 - t_R, 1 + a_H and -(x_R + a_H x_H), m
    **{"thrust": 1.0 - 0.220, "drag": 1.0 - 0.387, "side": 1.0 + 0.312, "arm": 3.5 + 0.312 * 0.464 * LENGTH},
}
# Of propeller and rudder, which bayesub does not see: wake, slipstream and flow straightening.
WAKE, WAKE_CHANGE, WAKE_PORT, WAKE_STARBOARD, PROPELLER_X = 0.40, 2.0, 1.6, 1.1, -0.48
EPSILON, KAPPA, STRAIGHTENING, RUDDER_FLOW_X = 1.09, 0.50, (0.395, 0.640), -0.710
# Terms of the turning rate squared and cubed, which `abkowitz` has not.
LACKING: dict[str, float] = {}
ABSENT = ("Y_vrr", "Y_rrr", "N_vrr", "N_rrr")
REMOVED = ("Yvrr", "Yrrr", "Nvrr", "Nrrr")


def propeller(u: float, v: float, r: float, turns: float) -> tuple[float, float, float]:
    """Thrust, N, the speed of the water there, m/s, and what 8 KT / (pi J^2) is, of velocities and turns a second."""
    speed = math.hypot(u, v)
    drift = math.atan2(-v, u) - PROPELLER_X * r * LENGTH / speed
    rise = (WAKE_PORT if drift > 0.0 else WAKE_STARBOARD) - 1.0
    inflow = u * (1.0 - WAKE) * (1.0 + (1.0 - math.exp(-WAKE_CHANGE * abs(drift))) * rise)
    advance = inflow / (turns * DIAMETER)
    kt = DIAGRAM[0] + DIAGRAM[1] * advance + DIAGRAM[2] * advance**2
    return DENSITY * turns**2 * DIAMETER**4 * kt, inflow, 8.0 * kt / (math.pi * advance**2)


def rudder(u: float, v: float, r: float, d: float, inflow: float, load: float) -> float:
    """Normal force, N, positive for a positive angle d in rad, of the flow behind the propeller."""
    speed, eta = math.hypot(u, v), DIAMETER / RUDDER_HEIGHT
    race = 1.0 + KAPPA * (math.sqrt(max(1.0 + load, 0.0)) - 1.0)
    ahead = EPSILON * inflow * math.sqrt(eta * race**2 + 1.0 - eta)
    drift = math.atan2(-v, u) - RUDDER_FLOW_X * r * LENGTH / speed
    across = speed * STRAIGHTENING[drift > 0.0] * drift
    angle = d - math.atan2(across, ahead)
    return 0.5 * DENSITY * RUDDER_AREA * (ahead**2 + across**2) * GRADIENT * math.sin(angle)


def hull(p: dict[str, float], u: float, v: float, r: float) -> tuple[float, float, float]:
    """X, Y, N of the hull, N and N m, at velocities amidships."""
    speed = math.hypot(u, v)
    b, c = v / speed, r * LENGTH / speed
    x = -p["R_0"] + p["X_vv"] * b * b + p["X_vr"] * b * c + p["X_rr"] * c * c + p["X_vvvv"] * b**4
    y, n = (
        p[f"{a}_v"] * b + p[f"{a}_r"] * c + p[f"{a}_vvv"] * b**3 + p[f"{a}_vvr"] * b * b * c
        + p[f"{a}_vrr"] * b * c * c + p[f"{a}_rrr"] * c**3
        for a in "YN"
    )  # fmt: skip
    scale = 0.5 * DENSITY * LENGTH * DRAUGHT * speed**2
    return scale * x, scale * y, scale * LENGTH * n


def turns_of(p: dict[str, float]) -> float:
    """Turns a second with which the propeller drives the ship straight at the trial speed."""
    low, high = 2.0, 40.0
    resistance = -hull(p, SPEED, 0.0, 0.0)[0]
    while high - low > 1e-9:
        middle = 0.5 * (low + high)
        pushed = p["thrust"] * propeller(SPEED, 0.0, 0.0, middle)[0]
        low, high = (middle, high) if pushed < resistance else (low, middle)
    return low


def fly(p: dict[str, float], run: str) -> dict[str, np.ndarray]:
    """Columns of the log of a run, "fitted" or "unseen", without noise: a row every tenth of a second."""
    unit = 0.5 * DENSITY * LENGTH**2 * DRAUGHT
    mx, my, jz = unit * p["m_x"], unit * p["m_y"], unit * LENGTH**2 * p["J_z"]
    matrix = np.array([[MASS + my, XG * MASS], [XG * MASS, INERTIA + XG**2 * MASS + jz]])
    (a, b), (c, e) = np.linalg.inv(matrix).tolist()
    turns = turns_of(PARAMETERS)

    def loads(u, v, r, d):
        thrust, inflow, load = propeller(u, v, r, turns)
        normal = rudder(u, v, r, d, inflow, load)
        return thrust, normal * math.sin(d), normal * math.cos(d)

    def slopes(state, d):
        _, _, psi, u, v, r = state
        thrust, drag, side = loads(u, v, r, d)
        x, y, n = hull(p, u, v, r)
        x += p["thrust"] * thrust - p["drag"] * drag + (MASS + my) * v * r + XG * MASS * r * r
        y += -p["side"] * side - (MASS + mx) * u * r
        n += p["arm"] * side - XG * MASS * u * r
        cos, sin = math.cos(psi), math.sin(psi)
        return u * cos - v * sin, u * sin + v * cos, r, x / (MASS + mx), a * y + b * n, c * y + e * n

    def moved(state, slope, step):
        return tuple(one + step * rate for one, rate in zip(state, slope, strict=True))

    state, d = (0.0, 0.0, 0.0, SPEED, 0.0, 0.0), 0.0
    rows, every = [], round(ROW_S / STEP_S)
    for k in range(round(SECONDS[run] / STEP_S) + 1):
        if k % every == 0:
            x, y, psi, u, v, r = state
            rows.append((k * STEP_S, x, u, y, v, psi, r, turns, d, *loads(u, v, r, d)))
        order = max(-LIMIT, min(LIMIT, math.radians(steps.held(DEGREES[run], k * STEP_S))))
        after = d + max(-RATE * STEP_S, min(RATE * STEP_S, order - d))
        middle = 0.5 * (d + after)
        k1 = slopes(state, d)
        k2 = slopes(moved(state, k1, STEP_S / 2), middle)
        k3 = slopes(moved(state, k2, STEP_S / 2), middle)
        k4 = slopes(moved(state, k3, STEP_S), after)
        mean = tuple((s1 + 2 * s2 + 2 * s3 + s4) / 6 for s1, s2, s3, s4 in zip(k1, k2, k3, k4, strict=True))
        state, d = moved(state, mean, STEP_S), after
    names = "time x_position u_velo y_position vm_velo psi r_angvelo n_prop delta_rudder thrust rudder_drag rudder_side"
    return steps.columns(names, rows)


def counterparts(p: dict[str, float]) -> dict[str, float]:
    """Coefficient of bayesub -> value: L d is L^2 there, and added masses have their Coriolis terms."""
    ratio = DRAUGHT / LENGTH
    hull_terms = {name: ratio * p[f"{name[0]}_{name[1:]}"] for name in ("Xvv", "Xrr", "Xvvvv")}
    hull_terms |= {a + name: ratio * p[f"{a}_{name}"] for a in "YN" for name in ("v", "r", "vvv", "vvr", "vrr", "rrr")}
    return hull_terms | {
        "XVV": -ratio * p["R_0"],
        "Xvr": ratio * (p["X_vr"] + p["m_y"]),
        "Xudot": -ratio * p["m_x"],
        "Yur": -ratio * p["m_x"],
        "Yvdot": -ratio * p["m_y"],
        "Nrdot": -ratio * p["J_z"],
        "XT": p["thrust"],
        "XR": -p["drag"],
        "YR": -p["side"],
        "NR": p["arm"],
    }


def vehicle(folder: Path, *, lacking: bool):  # noqa: ARG001
    """The guess: the boat of the file beside this one, `lacking` without the terms that `abkowitz` has not."""
    boat = steps.load(Path(__file__).parent / "mmg.toml")
    return steps.without(boat, REMOVED) if lacking else boat
