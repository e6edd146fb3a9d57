"""Short flights and linear stability of a vehicle: numbers for whoever asks what kind of boat it is."""

import numpy as np

from bayesub.io.log_files import VELOCITIES, positions
from bayesub.kernels import workspace
from bayesub.model.manoeuvre_files import straight_and_level
from bayesub.model.manoeuvres import of_inputs
from bayesub.model.simulate import accelerations
from bayesub.model.simulator import Simulator
from bayesub.model.trajectory import Trajectory
from bayesub.model.vehicles import Vehicle
from bayesub.report.contributions import slopes

STEP = 0.02  # integration step in ship lengths travelled; a flight that fails is repeated with a tenth of it
LONGEST_S = 1e9  # for a ship length; beyond it nothing is flown
Y, PSI, U, V, R = positions("y", "psi", "u", "v", "r")
NUDGE = 1e-5  # of speed, speed per length and 1 rad, for derivatives


def number_or_none(value) -> float | None:
    """A float, or None for what is not finite."""
    return float(value) if np.isfinite(value) else None


def fly(vehicle: Vehicle, lengths: float, orders: dict[str, float], subproblem: str | None) -> Trajectory | None:
    """The vehicle from straight flight, planes ordered over at once.

    A flight that fails is repeated with a tenth of the step, since it may be the step that failed.

    Parameters
    ----------
    vehicle : Vehicle
        At its trial speed.
    lengths : float
        How far, in ship lengths travelled at that speed.
    orders : dict of str to float
        Column of a control -> SI units.
    subproblem : str or None
        Plane to which the motion is confined.

    Returns
    -------
    Trajectory or None
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
    """G_h and G_v, the margins of straight-line stability in the two planes (Arentzen & Mandel 1960; Feldman 1987).

    ``G_h = 1 - Nv (Yr - m U) / (Yv (Nr - m xG U))``, ``G_v = 1 - Mw (Zq + m U) / (Zw (Mq - m xG U))`` with the slopes
    of the hydrodynamic forces in straight flight, without the terms of the mass where those are in the coefficients;
    above zero is stable, without help from righting moment. None where a damping derivative is not negative. Equations
    of three degrees of freedom have no G_v.
    """
    equations = vehicle.equations
    separate = equations.rigid_body_terms == "separate"
    mass = vehicle.body[workspace.MASS] * vehicle.speed_mps if separate else 0.0
    moment = mass * vehicle.body[workspace.XG]
    drift, turning = (slopes(vehicle, variable).values for variable in "vr")
    indices = {"horizontal_G_h": _index(drift["Y"], turning["Y"] - mass, drift["N"], turning["N"] - moment)}
    if equations.degrees_of_freedom == 6:
        heave, pitching = (slopes(vehicle, variable).values for variable in "wq")
        indices["vertical_G_v"] = _index(heave["Z"], pitching["Z"] + mass, heave["M"], pitching["M"] - moment)
    return indices


def _index(force_drift: float, force_rate: float, moment_drift: float, moment_rate: float) -> float | None:
    """One less the ratio of the lever of the force of turning to that of drifting; the products may overflow."""
    if not (force_drift < 0.0 and moment_rate < 0.0):
        return None
    with np.errstate(all="ignore"):
        return number_or_none(1.0 - np.float64(moment_drift) * force_rate / (np.float64(force_drift) * moment_rate))


def growth(vehicle: Vehicle) -> float:
    """Growth of the least stable small motion about straight flight, per ship length travelled; negative is stable.

    The largest real part among the eigenvalues of u v w p q r, roll and pitch, righting moment included; of u v r for
    equations of three degrees of freedom.
    """
    speed, length = vehicle.speed_mps, np.float64(vehicle.length_m)
    rpm = vehicle.rpm_per_mps * speed
    names = ("phi", "theta", *VELOCITIES) if vehicle.equations.degrees_of_freedom == 6 else ("u", "v", "r")
    scales = {"phi": 1.0, "theta": 1.0} | dict.fromkeys("uvw", speed) | dict.fromkeys("pqr", speed / length)
    steps = NUDGE * np.array([scales[name] for name in names])
    states = np.tile(straight_and_level(vehicle), (2 * len(names), 1))
    for k, (place, step) in enumerate(zip(positions(*names), steps, strict=True)):
        states[2 * k : 2 * k + 2, place] += [step, -step]
    controls = np.zeros((len(states), len(vehicle.equations.controls)))
    rates = accelerations(vehicle.restricted(None), states, controls, rpm)
    rows = dict(zip(VELOCITIES, ((rates[::2] - rates[1::2]) / (2.0 * steps[:, None])).T, strict=True))
    rows |= {angle: np.array(names) == rate for angle, rate in (("phi", "p"), ("theta", "q"))}  # for small angles
    matrix = np.array([rows[name] for name in names], dtype=float)
    if not np.isfinite(matrix).all():
        return np.nan
    try:
        return np.linalg.eigvals(matrix).real.max() * length / speed
    except np.linalg.LinAlgError:
        return np.nan


def turning_circle(vehicle: Vehicle, states: np.ndarray, rudder: float) -> dict:
    """Measures of a turn: steady ones from its end, the tactical diameter at 180 deg of heading.

    Parameters
    ----------
    vehicle : Vehicle
        For its length and speed.
    states : ndarray of shape (n, 12)
        Of the turn.
    rudder : float
        deg.
    """
    end, length = states[-1], vehicle.length_m
    speed, rate = np.linalg.norm(end[[U, V]]), end[R]
    turned = np.abs(states[:, PSI]) >= np.pi
    tactical = np.abs(states[turned.argmax(), Y]) / length if turned.any() else np.nan
    steady = abs(rate) * length > 1e-3 * speed
    return {
        "rudder_deg": rudder,
        "diameter_lengths": number_or_none(2.0 * speed / (abs(rate) * length)) if steady else None,
        "tactical_diameter_lengths": number_or_none(tactical),
        "speed_ratio": number_or_none(speed / vehicle.speed_mps),
        "drift_angle_deg": number_or_none(abs(np.degrees(np.arctan2(-end[V], end[U])))),
        "positive_rudder_turns": ("to starboard" if rate > 0.0 else "to port") if steady else None,
    }
