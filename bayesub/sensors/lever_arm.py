"""A sensor away from the body origin: what it reads more than the motion of the origin, by the motion of a rigid body.

With l the lever arm in body axes, omega = (p, q, r), and R the rotation from body to inertial axes (model manual,
section 1), the point l of the body has

- position         ``R l`` beyond that of the origin,
- body velocity    ``omega x l`` beyond that of the origin (the terms of xG, yG, zG in the model manual,
  section 2), and
- udot vdot wdot   ``omega_dot x l`` beyond those of the origin, because they are the rates of change of the velocity in
  body axes. The centripetal ``omega x (omega x l)`` of an accelerometer is in its ``omega x v``, with v at the sensor.

Attitude and rates are the same all over the body.
"""

import numpy as np
from numpy.typing import ArrayLike

from bayesub.sensors.current import seen

# State -> what turns the lever arm into it.
TURNING = dict.fromkeys("xyz", ("phi", "theta", "psi")) | dict.fromkeys("uvw", ("p", "q", "r"))
TURNING |= dict.fromkeys(("udot", "vdot", "wdot"), ("pdot", "qdot", "rdot"))
_TINY = 1e-30  # imaginary step, of which the square vanishes beside one


def displaced(state: str, lever_arm_m: ArrayLike, turning: np.ndarray) -> np.ndarray:
    """(..) what a lever arm adds to readings of a state or acceleration, m, m/s or m/s^2.

    Parameters
    ----------
    state : str
        Short name, a key of TURNING.
    lever_arm_m : (3,) or (.., 3)
        Ahead, to starboard and down from the body origin.
    turning : (.., 3) array
        The attitude, rates or angular accelerations that TURNING names, rad, rad/s or rad/s^2.
    """
    if state in "xyz":
        return np.sum(row_of_rotation(state, turning) * np.asarray(lever_arm_m), axis=-1)
    ahead, starboard, down = np.moveaxis(np.asarray(lever_arm_m), -1, 0)
    p, q, r = np.moveaxis(turning, -1, 0)
    cross = {"u": q * down - r * starboard, "v": r * ahead - p * down, "w": p * starboard - q * ahead}
    return cross[state[0]]


def displaced_slopes(state: str, lever_arm_m: ArrayLike, turning: np.ndarray) -> np.ndarray:
    """(n, 3) derivatives of what a lever arm adds by `turning` (n, 3), by imaginary steps."""
    return displaced(state, lever_arm_m, turning[None] + 1j * _TINY * np.eye(3)[:, None]).imag.T / _TINY


def row_of_rotation(state: str, attitude: np.ndarray) -> np.ndarray:
    """(.., 3) the body axes as seen along the inertial axis of x, y or z, at attitudes (.., 3)."""
    if state == "z":
        phi, theta, _ = np.moveaxis(attitude, -1, 0)
        return np.stack([-np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)], axis=-1)
    # A current along an axis adds to each body velocity the cosine between the two.
    return np.stack([seen(axis, attitude)[..., "xy".index(state)] for axis in "uvw"], axis=-1)
