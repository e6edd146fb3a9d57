"""Motion as instruments give it: states and accelerations with noise and finite resolution (thesis section 9.6)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bayesub.io.errors import InputError
from bayesub.logs.log_files import ACCELERATIONS, HEADERS, STATES, positions
from bayesub.sensors.record import Record
from bayesub.sensors.sensor import rounded

if TYPE_CHECKING:  # the simulator needs numba, of which importing takes a second
    from bayesub.model.simulator import Simulator
    from bayesub.model.trajectory import Trajectory

# The states that stand in the equations of motion of a sub-problem; position and heading do not.
_IN_EQUATIONS = {
    "horizontal": ("u", "v", "r"),
    "vertical": ("theta", "u", "w", "q"),
    None: ("phi", "theta", "u", "v", "w", "p", "q", "r"),
}


@dataclass(frozen=True)
class Motion:
    """Measured motion of one vehicle, which has a linear form as a trajectory has.

    Attributes
    ----------
    times : (n_times,) array
        s.
    states : (1, n_times, 12) array
        m, rad, m/s, rad/s.
    accelerations : (1, n_times, 6) array
        m/s^2, rad/s^2.
    controls : (n_times, 3) array
        rad.
    simulator : Simulator
        Of the vehicle and the manoeuvre.
    xi : (1, n_terms) array
        Coefficients, of which those that are not free count as known.
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
    """Measure u, v, w and their rates with independent normal noise, and round them; all else is exact.

    Parameters
    ----------
    trajectory : Trajectory
    velocity_sd : float
        Noise of u, v, w, m/s.
    acceleration_sd : float
        Noise of udot, vdot, wdot, m/s^2.
    rng : Generator, optional
        Source of the noise, if there is any.
    velocity_resolution : float
        Step to which velocities are rounded, m/s, 0 for none; 0.01 in the thesis.
    acceleration_resolution : float
        Step to which accelerations are rounded, m/s^2, 0 for none; 0.001 in the thesis.
    member : int
        Which of the batch.

    Raises
    ------
    InputError
        For noise without `rng`.
    """
    states = trajectory.states[member : member + 1].copy()
    accelerations = trajectory.accelerations[member : member + 1].copy()
    rates = [ACCELERATIONS.index(name) for name in ("udot", "vdot", "wdot")]
    for values, columns, sd, resolution in (
        (states, positions("u", "v", "w"), velocity_sd, velocity_resolution),
        (accelerations, rates, acceleration_sd, acceleration_resolution),
    ):
        readings = values[..., columns]
        if sd:
            if rng is None:
                raise InputError("measured motion: noise needs random numbers; give rng", "missing", "rng")
            readings += sd * rng.standard_normal(readings.shape)
        values[..., columns] = rounded(readings, resolution)
    xi = trajectory.xi[member : member + 1]
    return Motion(trajectory.times, states, accelerations, trajectory.controls, trajectory.simulator, xi)


def recorded(record: Record, simulator: Simulator, xi: np.ndarray) -> Motion:
    """The motion that a record holds, as it was written down; what a sub-problem confines stays as it began.

    Parameters
    ----------
    record : Record
        With readings at the same times of every velocity and acceleration of the sub-problem, and of the roll and pitch
        that it has. Velocities over the ground count as those through the water: there must be no current.
    simulator : Simulator
        Of the vehicle and the manoeuvre.
    xi : (n_terms,) array
        Coefficients, of which those that are not free count as known.

    Raises
    ------
    InputError
        If a channel is missing, has other times, or is measured at a lever arm.
    """
    channels = {channel.state: channel for channel in record.channels}
    names = _IN_EQUATIONS[simulator.subproblem]
    rates = tuple(f"{name}dot" for name in names if f"{name}dot" in ACCELERATIONS)
    times = record.channels[0].times
    for name in (*names, *rates):
        if name not in channels:
            raise InputError(
                f"record: has no readings of '{HEADERS[name]}', which the equations of motion need",
                "missing",
                HEADERS[name],
            )
        if channels[name].displaced:
            raise InputError(
                f"record: '{HEADERS[name]}' is measured at a lever arm; the equations are of the body origin",
                "data",
                HEADERS[name],
            )
        if not np.array_equal(channels[name].times, times):
            raise InputError(
                f"record: the readings of '{HEADERS[name]}' have times of their own; give one interval",
                "data",
                HEADERS[name],
            )
    states = np.repeat(simulator.manoeuvre.initial_state[None], len(times), axis=0)
    accelerations = np.zeros((len(times), len(ACCELERATIONS)))
    for name in names:
        states[:, STATES.index(name)] = channels[name].values
    for name in rates:
        accelerations[:, ACCELERATIONS.index(name)] = channels[name].values
    simulator = simulator.at(times)
    controls = simulator.trajectory(xi).controls
    return Motion(times, states[None], accelerations[None], controls, simulator, np.atleast_2d(xi))
