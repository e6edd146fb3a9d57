"""A vehicle with a main and a stern thruster under the hydrodynamics of gz-sim, with steps of a millisecond.

The forces are those of its system Hydrodynamics, with the matrices of Fossen (2011): linear and quadratic damping,
Coriolis terms of the diagonal added mass, and the added mass itself by the difference of the last two velocities, one
step late. The physics then moves the body by semi-implicit Euler steps. With the negative added masses that its manual
asks for, the program adds the product of the Coriolis matrix and the velocity where Fossen subtracts it, so that these
terms have the other sign (commit 93bbf3e); here they have the sign of the program.

Numbers are those of gz-sim's example of the LRAUV (auv_controls.sdf); its linear damping is zero, and here assumed.
Conventions of the log: as of ROS, x east and y north, axes forward, to port and up, yaw from east to north, forces of
the thrusters in N, positive forward and to port.
"""

import math
from pathlib import Path

import numpy as np

from strangers import steps

NAME, TITLE, EQUATIONS = "gazebo", "gz-sim, Hydrodynamics", "own terms"
MASS, INERTIA = 147.8671, 41.980233  # kg, kg m^2
STERN_X = -0.8  # of the stern thruster, m
LAG = 0.3  # of the thrusters, s; assumed
SPEED = 0.9
STEP_S, ROW_S = 0.001, 0.1
SECONDS = {"fitted": 240.0, "unseen": 180.0}
MAIN = {"fitted": ((0.0, 7.0), (90.0, 4.0), (160.0, 9.0)), "unseen": ((0.0, 7.0), (80.0, 5.0))}
STERN = {  # positive to port, which turns the bow to starboard
    "fitted": ((8.0, 3.0), (40.0, -8.0), (80.0, 12.0), (120.0, -4.0), (155.0, 8.0), (200.0, -12.0)),
    "unseen": ((5.0, -6.0), (50.0, 10.0), (100.0, -3.0), (140.0, 7.0)),
}
# It starts at east 0, north 0, with its bow to the east.
START = {"x0_m": 0.0, "y0_m": 0.0, "yaw0_deg": 90.0, "u0_mps": SPEED, "v0_mps": 0.0, "r0_degps": 0.0}
_RATE = math.radians(0.1)
NOISE = {"pose_x": 0.1, "pose_y": 0.1, "yaw": math.radians(0.2), "twist_x": 0.005, "twist_y": 0.005, "twist_yaw": _RATE}
SENSORS = {"x_m": 0.1, "y_m": 0.1, "heading_deg": 0.2, "u_mps": 0.005, "v_mps": 0.005, "r_degps": 0.1}
PARAMETERS = {
    **{"xDotU": -4.876161, "yDotV": -126.324739, "nDotR": -33.46},
    **{"xUabsU": -6.2282, "yVabsV": -601.27, "nRabsR": -632.698957},
    **{"xU": -2.0, "yV": -25.0, "nR": -20.0},
}
# Linear damping, which no built-in set has.
LACKING: dict[str, float] = {}
ABSENT = ("xU", "yV", "nR")
REMOVED = ("Xu", "Yv", "Nr")


def water(p: dict[str, float], ahead: float, port: float, turn: float) -> tuple[float, float, float]:
    """Damping and Coriolis forces and moment, N and N m, in axes forward, to port and up, of velocities there."""
    return (
        (p["xU"] + p["xUabsU"] * abs(ahead)) * ahead + p["yDotV"] * port * turn,
        (p["yV"] + p["yVabsV"] * abs(port)) * port - p["xDotU"] * ahead * turn,
        (p["nR"] + p["nRabsR"] * abs(turn)) * turn + (p["xDotU"] - p["yDotV"]) * ahead * port,
    )


def fly(p: dict[str, float], run: str) -> dict[str, np.ndarray]:
    """Columns of the log of a run, "fitted" or "unseen", without noise: a row every tenth of a second."""
    east, north, yaw, ahead, port, turn = 0.0, 0.0, 0.0, SPEED, 0.0, 0.0
    before = ahead, port, turn
    rows, every = [], round(ROW_S / STEP_S)
    main, stern = MAIN[run][0][1], 0.0
    for k in range(round(SECONDS[run] / STEP_S) + 1):
        if k % every == 0:
            rows.append((k * STEP_S, east, north, yaw, ahead, port, turn, main, stern))
            orders = [steps.held(of[run], k * STEP_S + 1e-9) for of in (MAIN, STERN)]
        rates = [(new - old) / STEP_S for new, old in zip((ahead, port, turn), before, strict=True)]
        before = ahead, port, turn
        x, y, n = water(p, ahead, port, turn)
        x += p["xDotU"] * rates[0] + main
        y += p["yDotV"] * rates[1] + stern
        n += p["nDotR"] * rates[2] + STERN_X * stern
        ahead, port, turn = (
            ahead + STEP_S * (x / MASS + turn * port),
            port + STEP_S * (y / MASS - turn * ahead),
            turn + STEP_S * n / INERTIA,
        )
        main, stern = main + STEP_S * (orders[0] - main) / LAG, stern + STEP_S * (orders[1] - stern) / LAG
        cos, sin = math.cos(yaw), math.sin(yaw)
        east += STEP_S * (ahead * cos - port * sin)
        north += STEP_S * (ahead * sin + port * cos)
        yaw += STEP_S * turn
    return steps.columns("stamp pose_x pose_y yaw twist_x twist_y twist_yaw main stern", rows)


def counterparts(p: dict[str, float]) -> dict[str, float]:
    """Coefficient of bayesub -> value. Terms of two velocities to port or in yaw, and of none, keep their sign."""
    return {
        "Xudot": p["xDotU"],
        "Yvdot": p["yDotV"],
        "Nrdot": p["nDotR"],
        "Xu": p["xU"],
        "Xuu": p["xUabsU"],
        "Xvr": p["yDotV"],
        "Yv": p["yV"],
        "Yvv": p["yVabsV"],
        "Yur": -p["xDotU"],
        "Nr": p["nR"],
        "Nrr": p["nRabsR"],
        "Nuv": p["xDotU"] - p["yDotV"],
    }


def vehicle(folder: Path, *, lacking: bool):  # noqa: ARG001
    """The guess: the boat of the file beside this one, `lacking` without linear damping."""
    boat = steps.load(Path(__file__).parent / "gazebo.toml")
    return steps.without(boat, REMOVED) if lacking else boat
