"""Motion as instruments give it: states and accelerations with noise and finite resolution (thesis section 9.6)."""

from dataclasses import dataclass

import numpy as np

from bayesub.simulate import Simulator, Trajectory


@dataclass(frozen=True)
class Motion:
    """Measured motion of one vehicle, which :func:`bayesub.problem.linear_systems` takes in place of a trajectory.

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
