"""The spiral curve: the rudder that holds each rate of turn, and its loop if a straight course is not stable.

It is the result of Bech's reversed spiral, which stands on the unstable branch too; Dieudonne's direct spiral jumps
over that, and its loop lies between the two folds of the curve (IMO circular MSC/Circ.1053, explanatory notes to the
standards for ship manoeuvrability, 2002). The boat turns in the horizontal plane with the propeller speed of straight
flight. Steady turns are solved for, not waited for.
"""

import numpy as np

from bayesub.logs.log_files import VELOCITIES, positions
from bayesub.model.boats import Boats
from bayesub.model.manoeuvre_files import RUDDER

N_RATES = 24  # on each side
_STEP = 1e-6  # of the speed and of 1 rad, for derivatives
_TOLERANCE, _ITERATIONS = 1e-9, 12  # accelerations, on U^2 / l and U^2 / l^2
_BALANCED = [VELOCITIES.index(name) for name in "uvr"]


def spiral(boats: Boats, fastest: float) -> tuple[np.ndarray, np.ndarray]:
    """Rates of turn (2 N_RATES + 1,), rad/s, and the rudder (n, 2 N_RATES + 1) of each boat, rad.

    Not a number where no steady turn is found.

    Parameters
    ----------
    boats : Boats
    fastest : float
        Rate of turn at the ends, rad/s.
    """
    rates = np.linspace(-fastest, fastest, 2 * N_RATES + 1)
    start = boats.vehicle_alone.once(_curve_of_one, fastest)
    return rates, _solved(boats, rates, np.tile(start, (len(boats), 1, 1)))[..., 2]


def _curve_of_one(boat, fastest):
    """(1, n_rates, 3) speeds u and v and the rudder of a boat, from straight flight outwards."""
    rates = np.linspace(-fastest, fastest, 2 * N_RATES + 1)
    curve = np.full((1, len(rates), 3), np.nan)
    for side in (1, -1):
        before = here = np.array([boat.vehicle.speed_mps, 0.0, 0.0])
        for k in range(N_RATES + 1):
            place = N_RATES + side * k
            guess = 2.0 * here - before if k > 1 else here
            found = _solved(boat, rates[place : place + 1], guess[None, None])[0, 0]
            before, here = here, found
            curve[0, place] = found
    return curve


def _solved(boats, rates, guess):
    """(n, n_rates, 3) u, v and rudder without acceleration, by Newton's method from a guess; else not a number."""
    speed, length = boats.vehicle.speed_mps, boats.vehicle.length_m
    steps = _STEP * np.array([speed, speed, 1.0])
    scales = np.array([length / speed**2, length / speed**2, length**2 / speed**2])
    unknown = guess.copy()
    for _ in range(_ITERATIONS):
        probes = np.repeat(unknown[:, :, None], 4, axis=2)  # as it is, and a step of each
        probes[:, :, [1, 2, 3], [0, 1, 2]] += steps
        balance = _accelerations(boats, rates, probes) * scales
        slopes = (balance[:, :, 1:] - balance[:, :, :1]) / steps[:, None]  # by u, v and rudder, of three accelerations
        size = np.abs(balance[:, :, 0]).max(axis=2)
        whole = np.isfinite(slopes).all(axis=(2, 3))
        going = whole & (np.linalg.det(np.where(whole[..., None, None], slopes, 0.0)) != 0.0) & ~(size <= _TOLERANCE)
        if not going.any():
            break
        systems = np.where(going[..., None, None], slopes.swapaxes(2, 3), np.eye(3))
        step = np.linalg.solve(systems, balance[:, :, 0, :, None])[..., 0]
        unknown -= np.where(going[..., None], step, 0.0)
    return np.where((size <= _TOLERANCE)[..., None], unknown, np.nan)


def _accelerations(boats, rates, probes):
    """(n, m, 4, 3) u', v' and r' at probes (n, m, 4, 3) of u, v and rudder."""
    n, m, k, _ = probes.shape
    flat = probes.reshape(n, m * k, 3)
    states = np.tile(boats.straight(1)[0], (n, m * k, 1))
    states[..., positions("u", "v")] = flat[..., :2]
    states[..., positions("r")] = np.repeat(rates, k)[:, None]
    controls = boats.controls("horizontal", {RUDDER: flat[..., 2]}, m * k)
    return boats.accelerations("horizontal", states, controls)[..., _BALANCED].reshape(n, m, k, 3)
