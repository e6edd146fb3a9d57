"""A current: the equations of motion hold in the water, which carries the boat over the ground."""

from dataclasses import dataclass

import numpy as np

from bayesub.logs.log_files import ANGLES, STATES, positions
from bayesub.model.disturbance import ForceHistory

_TINY = 1e-30  # imaginary step, of which the square vanishes beside one


@dataclass(frozen=True)
class Water:
    """How the water moves over the ground, at the times of a motion."""

    velocity: np.ndarray  # (.., n_times, 2) to the north and to the east, m/s
    displacement: np.ndarray  # (.., n_times, 2) since the start, m

    @classmethod
    def steady(cls, current_mps: np.ndarray, times: np.ndarray) -> "Water":
        """A constant current (.., 2), m/s, at times (n_times,) or (.., n_times), s."""
        current = np.asarray(current_mps)[..., None, :]
        displacement = current * times[..., None]
        return cls(np.broadcast_to(current, displacement.shape), displacement)

    @classmethod
    def varying(cls, history: ForceHistory, times: np.ndarray) -> "Water":
        """The current of a history at times (n_times,), s."""
        fine = np.union1d(history.times, times)
        fine = np.union1d(fine[fine <= times.max()], 0.0)
        velocity = history.current(fine)
        steps = 0.5 * np.diff(fine)[:, None] * (velocity[1:] + velocity[:-1])
        displacement = np.vstack([np.zeros(2), np.cumsum(steps, axis=0)])
        return cls(history.current(times), displacement[np.searchsorted(fine, times)])

    def __add__(self, other: "Water") -> "Water":
        """Both together."""
        return Water(self.velocity + other.velocity, self.displacement + other.displacement)

    def member(self, k: int) -> "Water":
        """That of one member of a batch."""
        return Water(self.velocity[k], self.displacement[k])

    def behind(self, state: str) -> np.ndarray:
        """(.., n_times, 2) what of it a state feels: the displacement for x and y, the velocity for u, v and w."""
        return self.displacement if state in ("x", "y") else self.velocity


def over_ground(states: np.ndarray, times: np.ndarray, current: "tuple[float, float] | Water") -> np.ndarray:
    """Motion over the ground of motion through the water.

    The position drifts with the water, and the current adds to velocities in body axes; attitude and rates stay.

    `states` (.., n_times, 12), at `times` (n_times,), s, are through the water, from :func:`bayesub.simulate`. The
    `current` is constant, (2,) to the north and to the east, m/s, or says how the water moves at these times. Returned
    are states (.., n_times, 12) of which x, y, u, v, w are over the ground; they are linear in the current.
    """
    states = np.array(states, dtype=float)
    water = current if isinstance(current, Water) else Water.steady(np.asarray(current), np.asarray(times))
    attitude = states[..., positions(*ANGLES)]
    for name in ("x", "y", "u", "v", "w"):
        states[..., STATES.index(name)] += np.sum(seen(name, attitude) * water.behind(name), axis=-1)
    return states


def seen(state: str, attitude: np.ndarray) -> np.ndarray:
    """(.., n_times, 2) what of a displacement to the north and to the east x or y see, or of a velocity u, v or w.

    The attitude (.., n_times, 3) is phi, theta, psi, rad.
    """
    if state in ("x", "y"):
        parts = np.zeros((*np.shape(attitude)[:-1], 2))
        parts[..., ("x", "y").index(state)] = 1.0
        return parts
    phi, theta, psi = np.moveaxis(attitude, -1, 0)
    # The two currents in axes turned by the yaw, and then their part along the body's z-axis before it rolls.
    ahead, starboard = np.stack([np.cos(psi), np.sin(psi)], -1), np.stack([-np.sin(psi), np.cos(psi)], -1)
    down = np.sin(theta)[..., None] * ahead
    cosine, sine = np.cos(phi)[..., None], np.sin(phi)[..., None]
    if state == "u":
        return np.cos(theta)[..., None] * ahead
    return cosine * starboard + sine * down if state == "v" else cosine * down - sine * starboard


def seen_slopes(state: str, attitude: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """(n_times, 3) derivatives of what `state` sees of a velocity (n_times, 2) by phi, theta and psi."""
    stepped = attitude[None] + 1j * _TINY * np.eye(3)[:, None]
    return np.sum(seen(state, stepped) * velocity, axis=-1).imag.T / _TINY
