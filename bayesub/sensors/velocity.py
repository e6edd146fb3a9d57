"""Velocity over the ground in inertial axes, its size and its course, and speed through the water.

With v the velocity of the origin in body axes, l the lever arm, omega = (p, q, r), R the rotation from body to inertial
axes (model manual, section 1) and c the current, a sensor reads of its place

- ``north``, ``east``, ``down``: the velocity over the ground ``R (v + omega x l) + c``;
- ``sog``, ``cog``: the size of its horizontal part, and the course, which is the heading plus the angle of that part
  from the heading, so that it is as continuous as the heading;
- ``stw``: through the water, without c: the size of the horizontal part, as of a log that turns into the flow, or the
  component along the `direction` of a log that is fixed to the boat.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from bayesub.sensors.lever_arm import displaced, row_of_rotation

OVER_GROUND = ("north", "east", "down", "sog", "cog")
QUANTITIES = (*OVER_GROUND, "stw")
ATTITUDE, RATES = ("phi", "theta", "psi"), ("p", "q", "r")
CAUSES = (*ATTITUDE, "u", "v", "w", *RATES)
_STEP = 1e-30  # imaginary step, of which the square vanishes beside one
_AT_REST = 1e-12  # m/s, where a course has no derivative


def causes(state: str, displaced: bool) -> tuple[str, ...]:
    """Short names of the states that readings depend on; of any but the velocities of this module the state itself.

    Parameters
    ----------
    state : str
        Short name of what is read.
    displaced : bool
        Whether the sensor has a lever arm.
    """
    if state not in QUANTITIES:
        return (state,)
    return CAUSES if displaced else CAUSES[:6]


def _at_sensor(motion, lever_arm_m):
    """(.., 3) velocity of the sensor through the water, body axes, of states (.., 6 or 9)."""
    velocity = motion[..., 3:6]
    if motion.shape[-1] == len(CAUSES[:6]):
        return velocity
    added = [displaced(name, lever_arm_m, motion[..., 6:]) for name in "uvw"]
    return velocity + np.stack(added, axis=-1)


def _inertial(motion, current, lever_arm_m):
    """(.., 3) velocity to the north, to the east and down, m/s."""
    velocity = _at_sensor(motion, lever_arm_m)
    parts = [np.sum(row_of_rotation(axis, motion[..., :3]) * velocity, axis=-1) for axis in "xyz"]
    return np.stack([parts[0] + current[..., 0], parts[1] + current[..., 1], parts[2]], axis=-1)


def readings(
    quantity: str,
    motion: np.ndarray,
    current: np.ndarray,
    lever_arm_m: ArrayLike,
    direction: Sequence[float] | None = None,
) -> np.ndarray:
    """(..) noise-free readings, m/s or rad.

    Parameters
    ----------
    quantity : str
        Short name, one of QUANTITIES.
    motion : (.., n_causes) array
        The states that :func:`causes` names, through the water.
    current : (.., 2) array
        To the north and to the east, m/s, where and when the reading is taken.
    lever_arm_m : (3,) or (.., 3)
        Ahead, to starboard and down from the body origin; of no account without rates among the motion.
    direction : (3,), optional
        Unit vector in body axes along which a log reads.
    """
    if quantity == "stw":
        if direction is not None:
            return _at_sensor(motion, lever_arm_m) @ np.asarray(direction)
        current = np.zeros(2)
    velocity = _inertial(motion, current, lever_arm_m)
    if quantity in ("north", "east", "down"):
        return velocity[..., ("north", "east", "down").index(quantity)]
    north, east = velocity[..., 0], velocity[..., 1]
    if quantity != "cog":
        return np.hypot(north, east)
    psi = motion[..., 2]
    ahead = north * np.cos(psi) + east * np.sin(psi)
    return psi + np.arctan2(east * np.cos(psi) - north * np.sin(psi), ahead)


def slopes(
    quantity: str,
    motion: np.ndarray,
    current: np.ndarray,
    lever_arm_m: ArrayLike,
    direction: Sequence[float] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives (n, n_causes) of readings by the motion, and (n, 2) by the current, by imaginary steps.

    Parameters
    ----------
    quantity : str
        As of :func:`readings`.
    motion : (n, n_causes) array
        As of :func:`readings`.
    current : (n, 2) array
        As of :func:`readings`.
    lever_arm_m : (3,)
        As of :func:`readings`.
    direction : (3,), optional
        As of :func:`readings`.
    """
    n_causes = motion.shape[1]
    stepped = motion[None] + 1j * _STEP * np.eye(n_causes)[:, None]
    if quantity == "stw" and direction is not None:
        along = _at_sensor(stepped, lever_arm_m) @ np.asarray(direction)
        return along.imag.T / _STEP, np.zeros((len(motion), 2))
    if quantity == "stw":
        current = np.zeros_like(current)
    by_motion = np.moveaxis(_inertial(stepped, current, lever_arm_m).imag / _STEP, 0, 1)  # (n, n_causes, 3)
    by_current = np.broadcast_to(np.eye(2, 3), (len(motion), 2, 3))
    if quantity in ("north", "east", "down"):
        weights = np.eye(3)[("north", "east", "down").index(quantity)]
    else:
        north, east, _ = np.moveaxis(_inertial(motion, current, lever_arm_m), -1, 0)
        speed = np.maximum(np.hypot(north, east), _AT_REST)
        # The size grows along the velocity; the course turns by what is across it.
        parts = (-east / speed**2, north / speed**2) if quantity == "cog" else (north / speed, east / speed)
        weights = np.stack([*parts, np.zeros_like(speed)], axis=-1)[:, None]
    of_current = np.sum(by_current * weights, axis=-1)
    return np.sum(by_motion * weights, axis=-1), np.zeros_like(of_current) if quantity == "stw" else of_current
