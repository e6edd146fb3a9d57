"""Short flights and linear stability of a vehicle: numbers for whoever asks what kind of boat it is."""

import numpy as np

from bayesub.findings.coefficient_examinations import number_or_none
from bayesub.logs.log_files import VELOCITIES, positions
from bayesub.model.boats import Boats
from bayesub.model.linear_motion import motion_matrix, stability_index
from bayesub.model.manoeuvre_files import straight_and_level
from bayesub.model.manoeuvres import of_inputs
from bayesub.model.simulator import Simulator
from bayesub.model.standard_manoeuvres import at_heading, circle_diameter
from bayesub.model.trajectory import Trajectory
from bayesub.model.vehicles import Vehicle

STEP = 0.02  # integration step in ship lengths travelled; a flight that fails is repeated with a tenth of it
LONGEST_S = 1e9  # for a ship length; beyond it nothing is flown
Y, U, V, R = positions("y", "u", "v", "r")


def fly(vehicle: Vehicle, lengths: float, orders: dict[str, float], subproblem: str | None) -> Trajectory | None:
    """The vehicle from straight flight, planes ordered over at once.

    A flight that fails is repeated with a tenth of the step, since it may be the step that failed.

    `vehicle`: at its trial speed; `lengths`: how far, in ship lengths travelled at that speed; `orders`: column of a
    control -> SI units; `subproblem`: plane to which the motion is confined.

    None if a ship length takes so long or short that times or steps are no numbers.
    """
    scale = np.float64(vehicle.length_m) / vehicle.speed_mps
    rpm = np.float64(vehicle.rpm_per_mps) * vehicle.speed_mps
    if not (1.0 / LONGEST_S < scale < LONGEST_S and np.isfinite(rpm) and rpm > 0.0):
        return None
    times = np.linspace(0.0, lengths, round(lengths / STEP) + 1) * scale
    actuators = vehicle.actuators
    given = {column: (np.zeros(1), np.full(1, angle)) for column, angle in orders.items()}
    inputs = actuators.responses(times, given, "check")
    for i, (_, demand) in actuators.demands(given, "check").items():
        inputs[:, i] = np.where(np.isfinite(inputs[:, i]), inputs[:, i], np.clip(demand, *actuators.members[i].range))
    start, ordered = straight_and_level(vehicle), np.full(len(times), rpm)
    flown = of_inputs("check", times, inputs, ordered, start, vehicle, subproblem=subproblem)
    for step in (STEP * scale, 0.1 * STEP * scale):
        trajectory = Simulator(vehicle, flown, times, dt=step).trajectory(vehicle.xi)
        if trajectory.status[0] == "ok":
            break
    return trajectory


def stability_indices(vehicle: Vehicle) -> dict[str, float | None]:
    """G_h and G_v of :func:`bayesub.model.linear_motion.stability_index`; None where a damping is not negative.

    Equations of three degrees of freedom have no G_v.
    """
    boat, planes = Boats(vehicle, vehicle.xi[None]), {"horizontal_G_h": "horizontal", "vertical_G_v": "vertical"}
    return {
        key: number_or_none(stability_index(boat, plane)[0])
        for key, plane in planes.items()
        if plane == "horizontal" or vehicle.equations.degrees_of_freedom == 6
    }


def growth(vehicle: Vehicle) -> float:
    """Growth of the least stable small motion about straight flight, per ship length travelled; negative is stable.

    The largest real part among the eigenvalues of u v w p q r, roll and pitch, righting moment included; of u v r for
    equations of three degrees of freedom.
    """
    names = ("phi", "theta", *VELOCITIES) if vehicle.equations.degrees_of_freedom == 6 else ("u", "v", "r")
    (matrix,) = motion_matrix(Boats(vehicle, vehicle.xi[None]), None, names)
    if not np.isfinite(matrix).all():
        return np.nan
    try:
        return np.linalg.eigvals(matrix).real.max() * np.float64(vehicle.length_m) / vehicle.speed_mps
    except np.linalg.LinAlgError:
        return np.nan


def turning_circle(vehicle: Vehicle, states: np.ndarray, rudder: float) -> dict:
    """Measures of a turn: steady ones from its end, the tactical diameter at 180 deg of heading.

    `vehicle`: for its length and speed; `states` (n, 12): of the turn; `rudder`: deg.
    """
    end, length = states[-1], vehicle.length_m
    speed, rate = np.linalg.norm(end[[U, V]]), end[R]
    tactical = abs(at_heading(states[None], 180.0)[0, Y]) / length
    steady = abs(rate) * length > 1e-3 * speed
    return {
        "rudder_deg": rudder,
        "diameter_lengths": number_or_none(circle_diameter(end[None])[0] / length) if steady else None,
        "tactical_diameter_lengths": number_or_none(tactical),
        "speed_ratio": number_or_none(speed / vehicle.speed_mps),
        "drift_angle_deg": number_or_none(abs(np.degrees(np.arctan2(-end[V], end[U])))),
        "positive_rudder_turns": ("to starboard" if rate > 0.0 else "to port") if steady else None,
    }
