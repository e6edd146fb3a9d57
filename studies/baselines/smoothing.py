"""Regression on smoothed motion, as ships are identified, beside the best fit to the same noisy tracks.

An extended Kalman smoother finds the motion with the boat of the guess and unknown forces, and all coefficients follow
by regression on its accelerations (:func:`bayesub.inference.baselines.smoothed_regression`).
"""

import numpy as np
from scipy import stats

from bayesub.inference.baselines import gauss_newton, smoothed_regression
from bayesub.model.disturbance import hull_force_rms
from bayesub.model.equations import AXES
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulate import simulate
from bayesub.model.simulator import Simulator, true_step
from bayesub.model.vehicles import load_vehicle
from bayesub.problem import priors
from bayesub.problem.disturbances import UnknownDisturbance, force_scales
from bayesub.problem.problem import Problem
from bayesub.sensors import Track, observe, unread
from thesis import cases
from thesis.optimisers import LOST

PLANES = {"horizontal": ("X", "Y", "N"), "vertical": ("X", "Z", "M"), "coupled": AXES}
SHARE = 0.003  # of the hull's forces, the noise of the process; with ten times as much more coefficients are lost
GUESS = 0.1  # the guess is as far from the truth as searches begin, at most
NOISE = 1e-2  # m and degrees
INTERVAL = stats.norm.ppf(0.95)


def smoothed(vehicle: str, manoeuvre: str, n_records: int) -> dict:
    """Method -> what it makes of the coefficients of each of some records with noise, as JSON types.

    ``further``: share of the coefficients that end further from the truth than the guess; ``off``: share that is off by
    more than a tenth; ``held``: share of its 90 % intervals that hold the truth.
    """
    boat, flown = load_vehicle(vehicle), load_manoeuvre(manoeuvre, load_vehicle(vehicle))
    free, axes, second = cases.free_coefficients(boat, manoeuvre), PLANES[manoeuvre], cases.time_scale(boat)
    places, truth = boat.equations.columns(free), boat.xi[boat.equations.columns(free)]
    hull = hull_force_rms([Simulator(boat, flown, [flown.duration])])[[AXES.index(axis) for axis in axes]]
    travelled = boat.length_m / boat.speed_mps
    shares = dict(zip(axes, SHARE * hull / force_scales(boat, axes), strict=True))
    forces = UnknownDisturbance(axes, shares, travelled, knot_interval_s=0.5 * travelled)
    track = Track(NOISE, NOISE, second)
    near = Problem(boat, flown, unread(track, flown.duration), free=free, prior=priors.relative_normal(1e-3))
    step = near.simulator.step  # that the track does not notice
    motion = simulate(boat, flown, dt=true_step(step, flown))
    given = {"dt": step, "free": free, "nuisance": {"u0_mps": priors.normal(boat.speed_mps, 0.01 * boat.speed_mps)}}
    found: dict[str, dict[str, list[float]]] = {}
    seed = [cases.SEED, cases.VEHICLES.index(vehicle), cases.MANOEUVRES.index(manoeuvre), 1]
    for rng in map(np.random.default_rng, np.random.SeedSequence(seed).spawn(n_records)):
        record = observe(motion, track, rng)
        guess = boat.xi.copy()
        guess[places] *= rng.uniform(1.0 - GUESS, 1.0 + GUESS, len(places))
        sds = GUESS / np.sqrt(3.0) * np.abs(boat.xi)
        about = {n: priors.normal(guess[k], sds[k]) for n, k in zip(free, places.tolist(), strict=True)}
        given |= {"xi": guess, "prior": priors.Given(priors.relative_normal(GUESS), about)}
        plain = Problem(boat, flown, record, **given)
        pushed = Problem(boat, flown, record, disturbance=forces, **given)
        for method, fit in (("smoothing", smoothed_regression(pushed)), ("best fit", gauss_newton(plain))):
            rows = [fit.names.index(name) for name in free]
            error = np.abs(fit.values[rows] - truth)
            sd = np.full(len(rows), np.nan) if fit.covariance is None else np.sqrt(np.diag(fit.covariance)[rows])
            which_are = {
                "further": error > np.abs(guess[places] - truth),
                "off": error > LOST * np.abs(truth),
                "held": error < INTERVAL * sd,
            }
            for key, which in which_are.items():
                found.setdefault(method, {}).setdefault(key, []).append(float(np.mean(which)))
    return found
