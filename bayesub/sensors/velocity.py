"""What a sensor away from the body origin reads: lever arms, velocities in inertial axes, speed through the water.

With l the lever arm in body axes, omega = (p, q, r), and R the rotation from body to inertial axes (model manual,
section 1), the point l of the body has

- position         ``R l`` beyond that of the origin,
- body velocity    ``omega x l`` beyond that of the origin (the terms of xG, yG, zG in the model manual,
  section 2), and
- udot vdot wdot   ``omega_dot x l`` beyond those of the origin, because they are the rates of change of the velocity in
  body axes. The centripetal ``omega x (omega x l)`` of an accelerometer is in its ``omega x v``, with v at the sensor.

Attitude and rates are the same all over the body. With v the velocity of the origin in body axes and c the current,
velocities in inertial axes are, at the place of the sensor,

- ``north``, ``east``, ``down``: the velocity over the ground ``R (v + omega x l) + c``;
- ``sog``, ``cog``: the size of its horizontal part, and the course, which is the heading plus the angle of that part
  from the heading, so that it is as continuous as the heading;
- ``stw``: through the water, without c: the size of the horizontal part, as of a log that turns into the flow, or the
  component along the `direction` of a log that is fixed to the boat.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from bayesub.sensors.current import seen

# State -> what turns the lever arm into it.
TURNING = dict.fromkeys("xyz", ("phi", "theta", "psi")) | dict.fromkeys("uvw", ("p", "q", "r"))
TURNING |= dict.fromkeys(("udot", "vdot", "wdot"), ("pdot", "qdot", "rdot"))
_TINY = 1e-30  # imaginary step, of which the square vanishes beside one


def displaced(state: str, lever_arm_m: ArrayLike, turning: np.ndarray) -> np.ndarray:
    """(..) what a lever arm adds to readings of a state or acceleration, m, m/s or m/s^2.

    `lever_arm_m` (3,) or (.., 3): ahead, to starboard and down from the body origin; `turning` (.., 3): the attitude,
    rates or angular accelerations that TURNING names, rad, rad/s or rad/s^2.
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


OVER_GROUND = ("north", "east", "down", "sog", "cog")
QUANTITIES = (*OVER_GROUND, "stw")
ATTITUDE, RATES = ("phi", "theta", "psi"), ("p", "q", "r")
CAUSES = (*ATTITUDE, "u", "v", "w", *RATES)
_AT_REST = 1e-12  # m/s, where a course has no derivative


def causes(state: str, displaced: bool) -> tuple[str, ...]:
    """Short names of the states that readings depend on; of any but the velocities of this module the state itself.

    The sensor has a lever arm where it is `displaced`.
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
    """(..) noise-free readings of one of QUANTITIES, m/s or rad.

    `motion` (.., n_causes): the states that :func:`causes` names, through the water; `current` (.., 2): to the north
    and to the east, m/s, where and when the reading is taken; `lever_arm_m`: as of :func:`displaced`, of no account
    without rates among the motion; `direction` (3,): unit vector in body axes along which a log reads.
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

    Arguments are those of :func:`readings`, with a motion (n, n_causes), a current (n, 2) and a lever arm (3,).
    """
    n_causes = motion.shape[1]
    stepped = motion[None] + 1j * _TINY * np.eye(n_causes)[:, None]
    if quantity == "stw" and direction is not None:
        along = _at_sensor(stepped, lever_arm_m) @ np.asarray(direction)
        return along.imag.T / _TINY, np.zeros((len(motion), 2))
    if quantity == "stw":
        current = np.zeros_like(current)
    by_motion = np.moveaxis(_inertial(stepped, current, lever_arm_m).imag / _TINY, 0, 1)  # (n, n_causes, 3)
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
