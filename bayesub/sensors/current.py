"""A constant current: the equations of motion hold in the water, which carries the boat over the ground."""

import numpy as np

from bayesub.logs import STATES

X, Y, PHI, THETA, PSI, U, V, W = (STATES.index(name) for name in ("x", "y", "phi", "theta", "psi", "u", "v", "w"))


def over_ground(states, times, current_mps) -> np.ndarray:
    """Motion over the ground of motion through the water.

    The position drifts by current times t, and the current adds to the body velocities as seen in body axes. Attitude
    and rates are the same for both.

    Parameters
    ----------
    states : (.., n_times, 12) through the water, from :func:`bayesub.simulate`; times : (n_times,) s
    current_mps : north and east, m/s

    Returns
    -------
    (.., n_times, 12) states, in which x, y, u, v, w are over the ground. They are linear in the current.
    """
    north, east = current_mps
    states, times = np.array(states, dtype=float), np.asarray(times)
    phi, theta, psi = states[..., PHI], states[..., THETA], states[..., PSI]
    # The current in axes turned by the yaw, and then its part along the body's z-axis before it rolls.
    ahead, starboard = north * np.cos(psi) + east * np.sin(psi), east * np.cos(psi) - north * np.sin(psi)
    down = np.sin(theta) * ahead
    states[..., X] += north * times
    states[..., Y] += east * times
    states[..., U] += np.cos(theta) * ahead
    states[..., V] += np.cos(phi) * starboard + np.sin(phi) * down
    states[..., W] += np.cos(phi) * down - np.sin(phi) * starboard
    return states
