"""Motion as instruments give it: states and accelerations with noise and finite resolution (thesis section 9.6)."""

from dataclasses import dataclass

import numpy as np

from bayesub.io.errors import InputError
from bayesub.io.log_files import ACCELERATIONS, HEADERS, STATES
from bayesub.model.simulate import Simulator, Trajectory

# What the equations of motion of a sub-problem see of a state; position and heading do not enter them.
_SEEN = {
    "horizontal": ("u", "v", "r"),
    "vertical": ("theta", "u", "w", "q"),
    None: ("phi", "theta", "u", "v", "w", "p", "q", "r"),
}


@dataclass(frozen=True)
class Motion:
    """Measured motion of one vehicle, of which the linear form is taken as of a trajectory.

    Attributes
    ----------
    times : (n_times,) s
    states : (1, n_times, 12) m, rad, m/s, rad/s
    accelerations : (1, n_times, 6) m/s^2, rad/s^2
    controls : (n_times, 3) rad
    simulator, xi : what was simulated and measured
    """

    times: np.ndarray
    states: np.ndarray
    accelerations: np.ndarray
    controls: np.ndarray
    simulator: Simulator
    xi: np.ndarray


def measure(
    trajectory: Trajectory,
    *,
    velocity_sd: float = 0.0,
    acceleration_sd: float = 0.0,
    rng: np.random.Generator | None = None,
    velocity_resolution: float = 0.0,
    acceleration_resolution: float = 0.0,
    member: int = 0,
) -> Motion:
    """Measure u, v, w and their rates: independent normal noise first, then rounding; all else is taken as exact.

    Parameters
    ----------
    velocity_sd, acceleration_sd : noise, m/s and m/s^2, drawn from `rng`
    velocity_resolution, acceleration_resolution : readings are multiples of these, m/s and m/s^2; the thesis has 0.01
        and 0.001; zero for no rounding
    """
    states = trajectory.states[member : member + 1].copy()
    accelerations = trajectory.accelerations[member : member + 1].copy()
    for values, sd, resolution in (
        (states[..., 6:9], velocity_sd, velocity_resolution),
        (accelerations[..., :3], acceleration_sd, acceleration_resolution),
    ):
        if sd:
            values += sd * rng.standard_normal(values.shape)
        if resolution:
            values[...] = resolution * np.round(values / resolution)
    xi = trajectory.xi[member : member + 1]
    return Motion(trajectory.times, states, accelerations, trajectory.controls, trajectory.simulator, xi)


def recorded(record, simulator: Simulator, xi) -> Motion:
    """The motion that a record holds, taken as it was written down; what a sub-problem confines stays as it began.

    Parameters
    ----------
    record : :class:`bayesub.sensors.Record` with readings at the same times of every velocity and
        acceleration of the sub-problem, and of the roll and pitch that it has. Velocities over the ground count as
        those through the water: there must be no current.
    simulator : of the vehicle and manoeuvre
    xi : (101,) coefficients, of which those that are not free count as known

    Raises InputError if a channel is missing, has times of its own, or is measured at a lever arm.
    """
    channels = {channel.state: channel for channel in record.channels}
    seen = _SEEN[simulator.subproblem]
    rates = tuple(f"{name}dot" for name in seen if f"{name}dot" in ACCELERATIONS)
    times = record.channels[0].times
    for name in (*seen, *rates):
        if name not in channels:
            raise InputError(f"record: has no readings of '{HEADERS[name]}', which the equations of motion need")
        if channels[name].displaced:
            raise InputError(
                f"record: '{HEADERS[name]}' is measured at a lever arm; the equations are of the body origin"
            )
        if not np.array_equal(channels[name].times, times):
            raise InputError(f"record: the readings of '{HEADERS[name]}' have times of their own; give one interval")
    states = np.repeat(simulator.manoeuvre.initial_state[None], len(times), axis=0)
    accelerations = np.zeros((len(times), len(ACCELERATIONS)))
    for name in seen:
        states[:, STATES.index(name)] = channels[name].values
    for name in rates:
        accelerations[:, ACCELERATIONS.index(name)] = channels[name].values
    simulator = simulator.at(times)
    controls = simulator.trajectory(xi).controls
    return Motion(times, states[None], accelerations[None], controls, simulator, np.atleast_2d(xi))
