"""The NPS AUV II as npsauv.m of the MSS toolbox steers it, by Euler's method with a step of 0.05 s, at constant depth.

The equations are those of Healey & Lienard (1993) with the cross-flow drag as the toolbox adds it up, over eleven
strips. They are written out in the horizontal plane; heave, roll and pitch are held at zero, as on a captive model.
Conventions of the log: SI
units and radians, the propeller in revolutions a minute.
"""

import math
from pathlib import Path

import numpy as np

from strangers import steps

NAME, TITLE, EQUATIONS = "npsauv", "MSS, NPS AUV II", "feldman"
LENGTH, DENSITY, WEIGHT, INERTIA = 5.3, 1025.0, 53400.0, 13587.0  # m, kg/m^3, N, kg m^2
STRIPS, SIDE = 10, 0.53  # intervals along the hull, and its height, m
LAG, LIMIT = 0.1, math.radians(20.0)  # of the rudder, s and rad
PITCH = 0.012  # m/rad: speed at which the propeller makes no thrust but that of the drag
SPEED = 1.8
STEP_S, ROW_S = 0.05, 0.1
SECONDS = {"fitted": 200.0, "unseen": 160.0}
DEGREES = {
    "fitted": ((8.0, 10.0), (35.0, -15.0), (70.0, 20.0), (105.0, -20.0), (140.0, 5.0), (165.0, -10.0)),
    "unseen": ((5.0, -12.0), (40.0, 18.0), (75.0, -6.0), (110.0, 15.0)),
}
START = {"x0_m": 0.0, "y0_m": 0.0, "yaw0_deg": 0.0, "u0_mps": SPEED, "v0_mps": 0.0, "r0_degps": 0.0}
NOISE = {"xpos": 0.1, "ypos": 0.1, "psi": math.radians(0.2), "u": 0.005, "v": 0.005, "r": math.radians(0.1)}
SENSORS = {"x_m": 0.1, "y_m": 0.1, "heading_deg": 0.2, "u_mps": 0.005, "v_mps": 0.005, "r_degps": 0.1}
PARAMETERS = {
    **{"Cd0": 3.85e-3, "Xudot": -7.6e-3, "Xvr": 2.0e-2, "Xrr": 4.0e-3, "Xvv": 5.3e-2, "Xdrdr": -1.0e-2},
    **{"Yvdot": -5.5e-2, "Yrdot": 1.2e-3, "Yv": -1.0e-1, "Yr": 3.0e-2, "Ydr": 2.7e-2, "Cdy": 0.5},
    **{"Nvdot": 1.2e-3, "Nrdot": -3.4e-3, "Nv": -7.4e-3, "Nr": -1.6e-2, "Ndr": -1.3e-2, "Cdn": 0.5},
}
# Surge forces of the rudder while drifting and turning, which `feldman` has not.
LACKING = {"Xvdr": 1.7e-3, "Xrdr": -1.0e-3}
ABSENT = REMOVED = tuple(LACKING)
THRUST = 3.85e-3  # of the propeller that balances Cd0; the drag of a boat is drawn, its propeller is known
_OURS = {"Xdrdr": "Xuu_drdr", "Yv": "Yuv", "Yr": "Yur", "Ydr": "Yuu_dr", "Cdy": "Ycrossflow"}
_OURS |= {"Nv": "Nuv", "Nr": "Nur", "Ndr": "Nuu_dr", "Cdn": "Ncrossflow"}


def forces(p: dict[str, float], u: float, v: float, r: float, d: float, revolutions: float) -> np.ndarray:
    """(3,) X, Y and N, N and N m, at velocities in m/s and rad/s, a rudder in rad and a propeller in rpm."""
    r2, r3, r4 = (0.5 * DENSITY * LENGTH**k for k in (2, 3, 4))
    thrust = THRUST * (PITCH * revolutions * math.pi / 30.0) ** 2
    x = r2 * (thrust - p["Cd0"] * u * u + p["Xvv"] * v * v + p["Xdrdr"] * u * u * d * d)
    x += r3 * p["Xvr"] * v * r + r4 * p["Xrr"] * r * r
    x += u * d * (r2 * p.get("Xvdr", 0.0) * v + r3 * p.get("Xrdr", 0.0) * r)
    y = r2 * u * (p["Yv"] * v + p["Ydr"] * u * d) + r3 * p["Yr"] * u * r
    n = r3 * u * (p["Nv"] * v + p["Ndr"] * u * d) + r4 * p["Nr"] * u * r
    side = moment = 0.0
    for k in range(STRIPS + 1):
        place = LENGTH * (k / STRIPS - 0.5)
        drag = (v + place * r) * abs(v + place * r)
        side, moment = side + drag, moment + place * drag
    strip = 0.5 * DENSITY * SIDE * LENGTH / STRIPS
    return np.array([x, y - strip * p["Cdy"] * side, n - strip * p["Cdn"] * moment])


def fly(p: dict[str, float], run: str) -> dict[str, np.ndarray]:
    """Columns of the log of a run, "fitted" or "unseen", without noise: a row every tenth of a second."""
    r3, r4, r5 = (0.5 * DENSITY * LENGTH**k for k in (3, 4, 5))
    mass, revolutions = WEIGHT / 9.81, SPEED / PITCH * 30.0 / math.pi
    matrix = np.array([[mass - r3 * p["Yvdot"], -r4 * p["Yrdot"]], [-r4 * p["Nvdot"], INERTIA - r5 * p["Nrdot"]]])
    (a, b), (c, e) = np.linalg.inv(matrix).tolist()
    surge_mass = mass - r3 * p["Xudot"]
    u, v, r, x, y, psi, d = SPEED, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    rows, every = [], round(ROW_S / STEP_S)
    for k in range(round(SECONDS[run] / STEP_S) + 1):
        if k % every == 0:
            rows.append((k * STEP_S, u, v, r, x, y, psi, d, revolutions))
        order = math.radians(steps.held(DEGREES[run], k * STEP_S))
        along, across, turn = forces(p, u, v, r, max(-LIMIT, min(LIMIT, d)), revolutions).tolist()
        along, across = along + mass * v * r, across - mass * u * r
        cos, sin = math.cos(psi), math.sin(psi)
        x, y, psi = x + STEP_S * (u * cos - v * sin), y + STEP_S * (u * sin + v * cos), psi + STEP_S * r
        d += STEP_S * (order - d) / LAG
        u += STEP_S * along / surge_mass
        v, r = v + STEP_S * (a * across + b * turn), r + STEP_S * (c * across + e * turn)
    return steps.columns("t u v r xpos ypos psi delta_r n_p", rows)


def counterparts(p: dict[str, float]) -> dict[str, float]:
    """Coefficient of bayesub -> value. The scales are the same; the drag has the other sign."""
    ours = {_OURS.get(name, name): value for name, value in p.items() if name != "Cd0"}
    return {"Xuu": -p["Cd0"]} | ours


def vehicle(folder: Path, *, lacking: bool):
    """The guess: `npsauv_crossflow`, whose hull is as long as the strips of the toolbox reach.

    A sum over eleven points with a spacing of 0.53 m is the midpoint rule over 5.83 m.
    """
    half = 0.5 * LENGTH * (1.0 + 1.0 / STRIPS)
    texts = {"x_m = [-2.65, 2.65]": f"x_m = [{-half}, {half}]"}
    if lacking:
        texts['"feldman"'] = f'"{Path(__file__).parent / "npsauv_terms.toml"}"'
    return steps.changed("npsauv_crossflow", folder, texts, dict.fromkeys(LACKING, 0.0) if lacking else {})
