"""A Mariner class cargo ship as mariner.m of the MSS toolbox sails it, by Euler's method with a step of 0.1 s.

The equations are those of Chislett & Strom-Tejsen (1965), made non-dimensional by the speed of the moment; u is the
change of the surge speed from 15 knots. Conventions of the log: SI units and radians, the rudder as the toolbox plots
it, in degrees and positive to starboard.
"""

import math
from pathlib import Path

import numpy as np

from strangers import steps

NAME, TITLE, EQUATIONS = "mariner", "MSS, Mariner class ship", "abkowitz"
LENGTH, SPEED = 160.93, 7.7175  # m, m/s
MASS, INERTIA, XG = 798e-5, 39.2e-5, -0.023
RATE, LIMIT = math.radians(5.0), math.radians(40.0)  # of the rudder; its time constant is 1 s
STEP_S, ROW_S = 0.1, 0.5
SECONDS = {"fitted": 700.0, "unseen": 600.0}
DEGREES = {  # rudder orders, positive to starboard
    "fitted": ((20.0, -10.0), (100.0, 20.0), (200.0, -20.0), (320.0, 35.0), (450.0, -35.0), (600.0, 5.0)),
    "unseen": ((15.0, 15.0), (120.0, -25.0), (250.0, 30.0), (380.0, -5.0), (480.0, 10.0)),
}
START = {"x0_m": 0.0, "y0_m": 0.0, "yaw0_deg": 0.0, "u0_mps": SPEED, "v0_mps": 0.0, "r0_degps": 0.0}
NOISE = {"x": 1.0, "y": 1.0, "psi": math.radians(0.1), "u": 0.02, "v": 0.02, "r": math.radians(0.01)}
SENSORS = {"x_m": 1.0, "y_m": 1.0, "heading_deg": 0.1, "u_mps": 0.02, "v_mps": 0.02, "r_degps": 0.01}

_TABLE = """
    Xudot  -42    Yvdot  -748     Nvdot  4.646
    Xu    -184    Yrdot  -9.354   Nrdot  -43.8
    Xuu   -110    Yv    -1160     Nv      -264
    Xuuu  -215    Yr     -499     Nr      -166
    Xvv   -899    Yvvv  -8078     Nvvv    1636
    Xrr     18    Yvvr  15356     Nvvr   -5483
    Xdd    -95    Yvu   -1160     Nvu     -264
    Xudd  -190    Yru    -499     Nru     -166
    Xrv    798    Yd      278     Nd      -139
    Xvd     93    Yddd    -90     Nddd      45
    Xuvd    93    Yud     556     Nud     -278
                  Yuud    278     Nuud    -139
                  Yvdd     -4     Nvdd      13
                  Yvvd   1190     Nvvd    -489
                  Y0       -4     N0         3
                  Y0u      -8     N0u        6
                  Y0uu     -4     N0uu       3
"""
_CELLS = _TABLE.split()
PARAMETERS = {name: float(f"{value}e-5") for name, value in zip(_CELLS[::2], _CELLS[1::2], strict=True)}
# What `abkowitz` has not: a ship whose side force and yaw moment have the third power of the turning rate. Assumed, of
# the size of a tenth of the moment of the turning hull at 20 degrees of rudder.
LACKING = {"Yrrr": 300e-5, "Nrrr": -150e-5}
ABSENT = REMOVED = tuple(LACKING)


def accelerations(p: dict[str, float], surge: float, sway: float, yaw: float, d: float) -> tuple[float, float, float]:
    """Rates of change of u and v, m/s^2, and r, rad/s^2, at velocities in m/s and rad/s and a rudder angle in rad.

    The angle is that of the tables, positive to port.
    """
    speed = math.hypot(surge, sway)
    u, v, r = (surge - SPEED) / speed, sway / speed, yaw * LENGTH / speed
    along = (p["Xu"] + p["Xuu"] * u + p["Xuuu"] * u * u) * u + p["Xvv"] * v * v + p["Xrr"] * r * r + p["Xrv"] * r * v
    along += ((p["Xdd"] + p["Xudd"] * u) * d + (p["Xvd"] + p["Xuvd"] * u) * v) * d
    across, turn = _lateral(p, "Y", u, v, r, d), _lateral(p, "N", u, v, r, d)
    surge_mass, sway_mass, yaw_mass = MASS - p["Xudot"], MASS - p["Yvdot"], INERTIA - p["Nrdot"]
    a, b = MASS * XG - p["Yrdot"], MASS * XG - p["Nvdot"]
    determinant = sway_mass * yaw_mass - a * b
    scale = speed * speed / LENGTH
    return (
        scale * along / surge_mass,
        scale * (yaw_mass * across - a * turn) / determinant,
        scale / LENGTH * (sway_mass * turn - b * across) / determinant,
    )


def _lateral(p, axis, u, v, r, d):
    def c(name):
        return p[axis + name]

    hull = c("v") * v + c("r") * r + (c("vvv") * v + c("vvr") * r) * v * v + (c("vu") * v + c("ru") * r) * u
    hull += p.get(f"{axis}rrr", 0.0) * r**3
    rudder = (c("d") + c("ddd") * d * d + c("ud") * u + c("uud") * u * u + c("vdd") * v * d + c("vvd") * v * v) * d
    return hull + rudder + c("0") + c("0u") * u + c("0uu") * u * u


def fly(p: dict[str, float], run: str) -> dict[str, np.ndarray]:
    """Columns of the log of a run, "fitted" or "unseen", without noise: a row every half second."""
    surge, sway, yaw, x, y, heading, d = SPEED, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    rows, every = [], round(ROW_S / STEP_S)
    for k in range(round(SECONDS[run] / STEP_S) + 1):
        if k % every == 0:
            rows.append((k * STEP_S, surge - SPEED, sway, yaw, x, y, heading, -math.degrees(d)))
        order = -math.radians(steps.held(DEGREES[run], k * STEP_S))
        udot, vdot, rdot = accelerations(p, surge, sway, yaw, d)
        cos, sin = math.cos(heading), math.sin(heading)
        x, y = x + STEP_S * (surge * cos - sway * sin), y + STEP_S * (surge * sin + sway * cos)
        heading, d = heading + STEP_S * yaw, d + STEP_S * min(RATE, max(-RATE, min(LIMIT, max(-LIMIT, order)) - d))
        surge, sway, yaw = surge + STEP_S * udot, sway + STEP_S * vdot, yaw + STEP_S * rdot
    return steps.columns("t u v r x y psi delta", rows)


def counterparts(p: dict[str, float]) -> dict[str, float]:
    """Coefficient of bayesub -> value; the names and scales are the same."""
    return dict(p)


def vehicle(folder: Path, *, lacking: bool):
    """The guess: the vehicle `mariner`, in the equations `abkowitz` or, `lacking`, in those with the terms at zero."""
    if not lacking:
        return steps.load("mariner")
    terms = Path(__file__).parent / "mariner_terms.toml"
    return steps.changed("mariner", folder, {'"abkowitz"': f'"{terms}"'}, dict.fromkeys(LACKING, 0.0))
