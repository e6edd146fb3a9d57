"""A constant current: the equations of motion hold in the water, which carries the boat over the ground."""

import numpy as np

from bayesub.io.log_files import ANGLES, STATES, positions

_TINY = 1e-30  # imaginary step, of which the square vanishes beside one


def over_ground(states: np.ndarray, times: np.ndarray, current_mps: tuple[float, float]) -> np.ndarray:
    """Motion over the ground of motion through the water.

    The position drifts by current times t, and the current adds to the body velocities as seen in body axes. Attitude
    and rates are the same for both.

    Parameters
    ----------
    states : (.., n_times, 12) array
        Through the water, from :func:`bayesub.simulate`.
    times : (n_times,) array
        s.
    current_mps : (2,)
        To the north and to the east, m/s.

    Returns
    -------
    (.., n_times, 12) array
        States of which x, y, u, v, w are over the ground. They are linear in the current.
    """
    states = np.array(states, dtype=float)
    attitude = states[..., positions(*ANGLES)]
    for name in ("x", "y", "u", "v", "w"):
        states[..., STATES.index(name)] += carried(name, np.asarray(times), attitude) @ np.asarray(current_mps)
    return states


def carried(state: str, times: np.ndarray, attitude: np.ndarray) -> np.ndarray:
    """(.., n_times, 2) what a current of 1 m/s to the north, and one to the east, add to x, y, u, v or w.

    Parameters
    ----------
    state : str
        Short name.
    times : (n_times,) array
        s.
    attitude : (.., n_times, 3) array
        phi, theta, psi, rad.
    """
    if state in ("x", "y"):
        parts = np.zeros((*np.shape(attitude)[:-1], 2))
        parts[..., ("x", "y").index(state)] = times
        return parts
    phi, theta, psi = np.moveaxis(attitude, -1, 0)
    # The two currents in axes turned by the yaw, and then their part along the body's z-axis before it rolls.
    ahead, starboard = np.stack([np.cos(psi), np.sin(psi)], -1), np.stack([-np.sin(psi), np.cos(psi)], -1)
    down = np.sin(theta)[..., None] * ahead
    cosine, sine = np.cos(phi)[..., None], np.sin(phi)[..., None]
    if state == "u":
        return np.cos(theta)[..., None] * ahead
    return cosine * starboard + sine * down if state == "v" else cosine * down - sine * starboard


def carried_slopes(state: str, times: np.ndarray, attitude: np.ndarray, current_mps: np.ndarray) -> np.ndarray:
    """(n_times, 3) derivatives of what a current adds to `state` by phi, theta and psi, by imaginary steps."""
    stepped = attitude[None] + 1j * _TINY * np.eye(3)[:, None]
    return (carried(state, times, stepped) @ np.asarray(current_mps)).imag.T / _TINY
