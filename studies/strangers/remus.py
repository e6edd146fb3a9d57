"""The REMUS 100 of PythonVehicleSimulator, in six degrees of freedom, by Euler's method with a step of 0.02 s.

The equations are those of the vehicle model remus100 (Fossen 2021, Allen et al. 2000): a spheroid with Lamb's added
masses, of whose Coriolis terms those that would destabilise the boat are left out, drag and lift by the angle of attack
(Beard & McLain 2012), cross-flow drag in the horizontal plane only (Hoerner), linear damping, one rudder, stern planes
and a Wageningen propeller by its advance. Conventions of the log: SI units and radians, the rudder
positive to starboard. The boat rolls by a degree under its propeller; the fit is in the horizontal plane.
"""

import math
from pathlib import Path

import numpy as np

from strangers import steps

NAME, TITLE, EQUATIONS = "remus", "PythonVehicleSimulator, REMUS 100", "own terms"
LENGTH, DIAMETER, DENSITY, GRAVITY = 1.6, 0.19, 1026.0, 9.81
A, B = LENGTH / 2, DIAMETER / 2  # semi-axes, m
ZG = 0.02
MASS = 4.0 / 3.0 * math.pi * DENSITY * A * B**2
IXX, IYY = 0.4 * MASS * B**2, 0.2 * MASS * (A**2 + B**2)
PROPELLER, DEDUCTION, ADVANCE = 0.14, 0.1, 0.944  # diameter, m; thrust deduction; one less the wake
KT, KT_MAX, J_MAX, KQ, KQ_MAX = 0.4566, 0.1798, 0.6632, 0.07, 0.0312
FIN_AREA, FIN_X, FIN_LIFT = 2 * 0.00665, -A, 0.5  # of the rudder
STRIPS, HOERNER = 20, 1.1977  # intervals along the hull; drag coefficient of a circle, of Hoerner's curve
LAG, LAG_PROPELLER, LIMIT = 0.1, 1.0, math.radians(15.0)
SPEED, RPM = 2.0, 1300.0  # at the start
STEP_S, ROW_S = 0.02, 0.1
SECONDS = {"fitted": 140.0, "unseen": 100.0}
DEGREES = {  # positive to starboard
    "fitted": ((6.0, 5.0), (25.0, -10.0), (45.0, 15.0), (65.0, -15.0), (85.0, 3.0), (100.0, -6.0), (120.0, 12.0)),
    "unseen": ((5.0, -8.0), (30.0, 13.0), (55.0, -4.0), (75.0, 10.0)),
}
REVOLUTIONS = {
    "fitted": ((0.0, RPM), (50.0, 1000.0), (90.0, 1450.0)),
    "unseen": ((0.0, RPM), (40.0, 1150.0)),
}
START = {"x0_m": 0.0, "y0_m": 0.0, "yaw0_deg": 0.0, "u0_mps": SPEED, "v0_mps": 0.0, "r0_degps": 0.0}
NOISE = {"x": 0.1, "y": 0.1, "psi": math.radians(0.2), "u": 0.005, "v": 0.005, "r": math.radians(0.1)}
SENSORS = {"x_m": 0.1, "y_m": 0.1, "heading_deg": 0.2, "u_mps": 0.005, "v_mps": 0.005, "r_degps": 0.1}


def lamb() -> tuple[float, float, float]:
    """Added masses ahead and across, over the mass, and added inertia over the inertia, of the spheroid."""
    e = math.sqrt(1.0 - (B / A) ** 2)
    rest = 1.0 - e * e
    alpha = 2.0 * rest / e**3 * (0.5 * math.log((1.0 + e) / (1.0 - e)) - e)
    beta = 1.0 / e**2 - rest / (2.0 * e**3) * math.log((1.0 + e) / (1.0 - e))
    turned = e**4 * (beta - alpha) / ((2.0 - e * e) * (2.0 * e * e - (2.0 - e * e) * (beta - alpha)))
    return alpha / (2.0 - alpha), beta / (2.0 - beta), turned


_AHEAD, _ACROSS, _TURNED = lamb()
PARAMETERS = {  # what a boat of the study has of its own
    **{"drag": 0.42, "A11": MASS * _AHEAD, "A22": MASS * _ACROSS, "A66": _TURNED * IYY},
    **{"crossflow_sway": HOERNER, "crossflow_yaw": HOERNER, "KT_0": KT, "KT_slope": (KT_MAX - KT) / J_MAX},
    **{"rudder_sway": FIN_LIFT, "rudder_yaw": FIN_LIFT, "rudder_drag": FIN_LIFT},
    **{"yaw_damping": (1.0 + _TURNED) * IYY / 1.0},  # the time constant in yaw is 1 s
}
# Linear damping in yaw, which `remus` has not.
LACKING: dict[str, float] = {}
ABSENT = ("yaw_damping",)
REMOVED = ("Nr",)


def _cross(vector) -> np.ndarray:
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _coriolis(matrix, velocity):
    """The Coriolis matrix of a mass matrix (6, 6): Kirchhoff's equations."""
    linear, angular = (matrix @ velocity).reshape(2, 3)
    return np.block([[np.zeros((3, 3)), -_cross(linear)], [-_cross(linear), -_cross(angular)]])


class Boat:
    """The boat of some parameters: masses and damping, which do not change."""

    def __init__(self, p: dict[str, float]):
        self.p = p
        lever = _cross([0.0, 0.0, ZG])
        steiner = np.diag([IXX, IYY, IYY]) - MASS * lever @ lever
        self.rigid = np.block([[MASS * np.eye(3), -MASS * lever], [MASS * lever, steiner]])
        nominal = MASS * _ACROSS, 0.3 * IXX, _TURNED * IYY  # in heave, roll and pitch
        self.added = np.diag([p["A11"], p["A22"], nominal[0], nominal[1], nominal[2], p["A66"]])
        total = self.rigid + self.added
        self.inverse = np.linalg.inv(total)
        mass = np.diag(total)
        roll, pitch = (math.sqrt(MASS * GRAVITY * ZG / mass[k]) for k in (3, 4))
        self.damping = np.array([*mass[:3] / 20.0, 0.6 * mass[3] * roll, 1.6 * mass[4] * pitch, p["yaw_damping"]])

    def accelerations(self, velocity: np.ndarray, attitude: np.ndarray, fins: tuple, rpm: float) -> np.ndarray:
        """(6,) of a velocity (6,), the roll and pitch, rudder and stern planes in rad, and revolutions a minute."""
        p, (u, v, w, *_, r) = self.p, velocity.tolist()
        speed = math.sqrt(u * u + v * v + w * w)
        coriolis = _coriolis(self.added, velocity)
        for row, column in ((4, 0), (4, 2), (5, 0), (5, 1)):
            coriolis[row, column] = coriolis[column, row] = 0.0
        damping = self.damping.copy()
        damping[:2] *= math.exp(-3.0 * speed)
        force = -(_coriolis(self.rigid, velocity) + coriolis) @ velocity - damping * velocity
        # Drag and lift of the hull by the angle of attack.
        area, alpha = 0.7 * LENGTH * DIAMETER, math.atan2(w, u)
        ratio = DIAMETER**2 / area
        lift = math.pi * ratio / (1.0 + math.sqrt(1.0 + (ratio / 2.0) ** 2)) * alpha
        resistance = p["drag"] * math.pi * B**2 / area + lift**2 / (math.pi * 0.7 * ratio)
        pressure = 0.5 * DENSITY * speed * speed * area
        force[0] += pressure * (lift * math.sin(alpha) - resistance * math.cos(alpha))
        force[2] -= pressure * (resistance * math.sin(alpha) + lift * math.cos(alpha))
        # Cross-flow along the hull.
        places = LENGTH * (np.arange(STRIPS + 1) / STRIPS - 0.5)
        strips = 0.5 * DENSITY * DIAMETER * LENGTH / STRIPS * np.abs(v + places * r) * (v + places * r)
        force[1] -= p["crossflow_sway"] * strips.sum()
        force[5] -= p["crossflow_yaw"] * (places * strips).sum()
        # Fins.
        rudder, planes = fins
        of_rudder, of_planes = (0.5 * DENSITY * FIN_AREA * (u * u + s * s) for s in (v, w))
        force[0] -= p["rudder_drag"] * of_rudder * rudder**2 + 0.7 * of_planes * planes**2
        force[1] -= p["rudder_sway"] * of_rudder * rudder
        force[5] -= p["rudder_yaw"] * of_rudder * rudder * FIN_X
        force[2] -= 0.7 * of_planes * planes
        force[4] += 0.7 * of_planes * planes * FIN_X
        # Propeller: its torque is a tenth of that of the diagram.
        n, advance = rpm / 60.0, ADVANCE * speed
        thrust = DENSITY * PROPELLER**4 * (p["KT_0"] * n * n + p["KT_slope"] * n * advance / PROPELLER)
        torque = DENSITY * PROPELLER**5 * (KQ * n * n + (KQ_MAX - KQ) / J_MAX * n * advance / PROPELLER)
        force[0] += (1.0 - DEDUCTION) * thrust
        force[3] += torque / 10.0
        # Weight and buoyancy are equal.
        roll, pitch = attitude
        righting = MASS * GRAVITY * ZG
        force[3] -= righting * math.cos(pitch) * math.sin(roll)
        force[4] -= righting * math.sin(pitch)
        return self.inverse @ force


def fly(p: dict[str, float], run: str) -> dict[str, np.ndarray]:
    """Columns of the log of a run, "fitted" or "unseen", without noise: a row every tenth of a second."""
    boat, velocity, rudder, rpm = Boat(p), np.array([SPEED, 0.0, 0.0, 0.0, 0.0, 0.0]), 0.0, RPM
    x, y, z, phi, theta, psi = (0.0,) * 6
    rows, every = [], round(ROW_S / STEP_S)
    for k in range(round(SECONDS[run] / STEP_S) + 1):
        if k % every == 0:
            rows.append((k * STEP_S, x, y, z, phi, theta, psi, *velocity.tolist(), rudder, rpm))
        order, turns = (steps.held(orders[run], k * STEP_S) for orders in (DEGREES, REVOLUTIONS))
        fins = max(-LIMIT, min(LIMIT, rudder)), 0.0
        velocity = velocity + STEP_S * boat.accelerations(velocity, (phi, theta), fins, rpm)
        rudder += STEP_S * (math.radians(order) - rudder) / LAG
        rpm += STEP_S * (turns - rpm) / LAG_PROPELLER
        # The attitude follows the new velocity, as the simulator has it.
        u, v, w, p_rate, q, r = velocity.tolist()
        cf, sf, ct, st, cp, sp = (f(angle) for angle in (phi, theta, psi) for f in (math.cos, math.sin))
        x += STEP_S * (cp * ct * u + (cp * st * sf - sp * cf) * v + (sp * sf + cp * cf * st) * w)
        y += STEP_S * (sp * ct * u + (cp * cf + sf * st * sp) * v + (st * sp * cf - cp * sf) * w)
        z += STEP_S * (-st * u + ct * sf * v + ct * cf * w)
        phi, theta, psi = (
            phi + STEP_S * (p_rate + (sf * q + cf * r) * st / ct),
            theta + STEP_S * (cf * q - sf * r),
            psi + STEP_S * (sf * q + cf * r) / ct,
        )
    return steps.columns("t x y z phi theta psi u v w p q r delta_r n", rows)


def counterparts(p: dict[str, float]) -> dict[str, float]:
    """Coefficient of bayesub -> value: forces of unit regressors, and drag coefficients of the hull.

    The rudder has the other sign, so that the side force of a positive one is positive.
    """
    fin = 0.5 * DENSITY * FIN_AREA
    propeller = (1.0 - DEDUCTION) * DENSITY * PROPELLER**4
    return {
        "XVV": -0.5 * DENSITY * math.pi * B**2 * p["drag"],
        "XVVdd": -fin * p["rudder_drag"],
        "Xnn": propeller * p["KT_0"] / 3600.0,
        "XnV": propeller * p["KT_slope"] * ADVANCE / PROPELLER / 60.0,
        "Xudot": -p["A11"],
        "Yvdot": -p["A22"],
        "Ycrossflow": p["crossflow_sway"],
        "YVVd": fin * p["rudder_sway"],
        "Nrdot": -p["A66"],
        "Ncrossflow": p["crossflow_yaw"],
        "NVVd": fin * p["rudder_yaw"] * FIN_X,
        "Nr": -p["yaw_damping"],
    }


def vehicle(folder: Path, *, lacking: bool):  # noqa: ARG001
    """The guess: the boat of the file beside this one, `lacking` without linear damping in yaw."""
    boat = steps.load(Path(__file__).parent / "remus.toml")
    return steps.without(boat, REMOVED) if lacking else boat
