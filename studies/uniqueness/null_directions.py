"""Null directions of the equations of motion, and what they do to tracks."""

import numpy as np
from scipy.linalg import subspace_angles

from bayesub.inference import identifiability
from bayesub.model.coefficients import AXES, NAMES, SUBPROBLEMS, columns
from bayesub.model.linear_form import linear_systems, stacked
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulate import simulate
from bayesub.model.trajectory import Trajectory
from bayesub.model.vehicles import Vehicle
from bayesub.problem import priors
from bayesub.problem.problem import Problem
from bayesub.sensors import Track, observe
from uniqueness.structure import structure

LARGEST = 0.5  # relative change of a coefficient along a null vector
SPREAD = 0.1  # of coefficient sets about the vehicle's
PRIOR_SD = 0.25
TYPICAL = dict(zip(AXES, (2e-3, 5e-3, 5e-3, 1e-5, 5e-4, 5e-4), strict=True))  # sizes of coefficients that are zero


def track_change(boat: Vehicle, truth: Trajectory, vector: dict[str, float], rng, n_controls: int = 9) -> dict:
    """Largest change of position along a null vector, and along the same changes with random signs.

    Parameters
    ----------
    boat : vehicle
    truth : its simulated track
    vector : coefficient -> change, scaled so that the largest relative change is 50 %
    rng : source of the signs
    n_controls : number of random signs

    Returns
    -------
    Lengths in m, with the round-off of the track: a machine epsilon of the largest coordinate, a step.
    """
    places, changes = columns(vector), np.array(list(vector.values()))
    present = boat.xi[places] != 0
    changes *= LARGEST / np.abs(changes[present] / boat.xi[places][present]).max()
    signs = rng.choice([-1.0, 1.0], (n_controls, len(places)))
    signs = np.vstack([np.ones(len(places)), signs[np.abs(signs.sum(axis=1)) < len(places)]])
    sets = np.repeat(boat.xi[None], len(signs), axis=0)
    sets[:, places] += signs * changes
    states, status = truth.simulator.run(sets)
    distance = np.linalg.norm(states[:, :, :3] - truth.states[0, :, :3], axis=2).max(axis=1)
    survived = distance[1:][status[1:] == 0]
    n_steps = truth.times[-1] / truth.simulator.step
    return {
        "moved_m": float(distance[0]),
        "round_off_m": float(np.finfo(float).eps * n_steps * np.abs(truth.states[0, :, :3]).max()),
        "random_median_m": float(np.median(survived)),
        "random_min_m": float(survived.min()),
        "random_failed": int(np.count_nonzero(status[1:])),
        "length_m": boat.length_m,
    }


def of_tracks(boat: Vehicle, plane: str, manoeuvres, seed: int) -> dict:
    """Null directions of noise-free tracks about one coefficient set, and those that the linear form predicts.

    Parameters
    ----------
    boat : vehicle
    plane : sub-problem whose coefficients are free
    manoeuvres : names
    seed : of the coefficient set, 10 % about the vehicle's; coefficients that are zero there get a typical size
    """
    rng = np.random.default_rng(seed)
    xi = boat.xi * (1.0 + SPREAD * rng.standard_normal(len(boat.xi)))
    centre = np.where(xi == 0.0, [TYPICAL[name[0]] for name in NAMES], xi)
    jacobians, systems = [], []
    for name in manoeuvres:
        flown = load_manoeuvre(name, boat)
        truth = simulate(boat, flown, xi=xi)
        record = observe(truth, Track(0.5, 0.1, interval_s=flown.duration / 300), rng)
        prior = priors.relative_normal(PRIOR_SD, centre=centre)
        problem = Problem(boat, flown, record, free=SUBPROBLEMS.get(plane, NAMES), prior=prior, xi=xi)
        jacobians.append(problem.jacobian(xi[problem.columns]) * problem.prior.sd)
        systems.append(linear_systems(truth))
    seen = structure(jacobians)
    vectors = [
        vector for axis in identifiability.rank(stacked(systems, NAMES)).values() for vector in axis.null_vectors
    ]
    predicted = np.array([[v.get(name, 0.0) for name in problem.names] for v in vectors]) / problem.prior.sd
    same = len(predicted) == seen.n_structural
    return {
        "vehicle": boat.name,
        "manoeuvres": list(manoeuvres),
        "seed": seed,
        "n_params": problem.n_params,
        "structural": seen.n_structural,
        "practical": seen.n_practical,
        "alone": dict(zip(manoeuvres, seen.alone, strict=True)),
        "predicted": len(predicted),
        "angle_rad": float(subspace_angles(predicted.T, seen.structural.T).max()) if same else None,
        "gap": seen.gap,
        "singular_values": (seen.singular_values / seen.singular_values[0]).tolist(),
        "threshold": seen.threshold / float(seen.singular_values[0]),
    }
