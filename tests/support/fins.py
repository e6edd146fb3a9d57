"""Boats that are steered by fins, pushed by propellers and thrusters."""

from copy import deepcopy

import numpy as np

FIN = {"kind": "fin", "limit_deg": 25.0, "rate_deg_s": 30.0, "time_constant_s": 0.1}
X_TAIL = (45.0, 135.0, 225.0, 315.0)
PORT = {
    "kind": "propeller",
    "name": "port",
    "position_m": [-40.0, -3.0, 0.5],
    "diameter_m": 4.0,
    "kt0": 0.4,
    "kt1": -0.3,
    "kq0": 0.05,
    "kq1": -0.03,
    "wake_fraction": 0.2,
    "thrust_deduction": 0.1,
    "rpm": 90.0,
}
STARBOARD = PORT | {"name": "starboard", "position_m": [-40.0, 3.0, 0.5], "handedness": "left"}
BOW = {"kind": "thruster", "name": "bow", "column": "bow_thruster_n", "position_m": [35.0, 0.0, 1.0], "limit_n": 1e5}
BOW |= {"direction": [0.0, 2.0, 0.0]}


def fins(*angles, **changes):
    """A fin at each angle, named fin_1 and so on."""
    return [FIN | {"name": f"fin_{k}", "angle_deg": angle, "x_m": -45.0} | changes for k, angle in enumerate(angles, 1)]


def with_actuators(boat, *actuators, **sections):
    """The content of a vehicle file with these actuators instead of its own."""
    return deepcopy(boat) | {"name": "finned", "actuators": list(actuators)} | sections


def weaker(vehicle, xi, control, scales):
    """Coefficient sets (n, n_terms) of boats on which a control of the equations does so many times what it does.

    A term of the first degree in the control goes with the scale, one of the second with its square.
    """
    degrees = np.array([term.regressor.split("*").count(control) for term in vehicle.equations.terms])
    assert degrees.max() == 2
    return xi * np.asarray(scales)[:, None] ** degrees
