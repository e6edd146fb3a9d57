"""Coefficient sets that data leave open, and how far off the tracks are that they predict."""

from collections.abc import Iterable

import numpy as np

from bayesub.inference.identifiability import null_space
from bayesub.model.coefficients import NAMES, columns
from bayesub.model.simulator import Simulator
from bayesub.model.vehicles import Vehicle, load_vehicle
from bayesub.problem import priors
from bayesub.problem.joint import JointProblem
from thesis import cases

PRIOR_SD = 0.25
MOST_STEPS, SHORT = 20, 0.02  # posterior standard deviations; jumps of the controls keep some steps longer
NULL_MOVE = 0.5  # of the largest coefficient of a null vector


def open_sets(vehicle: str, n_manoeuvres: int, n_sets: int) -> dict:
    """Sets that the tracks of so many manoeuvres leave open, by randomising and optimising (Bardsley et al. 2014).

    The tracks get noise and the centre of the prior is a draw from it, set by set. Of the residuals of both, the part
    that the Jacobian at the truth spans is made zero by Gauss-Newton steps with this one Jacobian, of all sets at once.

    Returns
    -------
    ``xi`` (n_sets, 101) coefficients, and ``last_steps`` (n_sets,), shares of the distance of a set from the truth
    """
    boat, rng = load_vehicle(vehicle), np.random.default_rng([cases.SEED, n_manoeuvres])
    problem = tracks(boat, cases.unseen(boat, n_manoeuvres))
    prior, truth = problem.prior, np.zeros(problem.n_params)
    jacobian = problem.jacobian(prior.parameters(truth)) @ prior.chain(np.eye(len(truth)), truth)
    _, s, directions = np.linalg.svd(jacobian, full_matrices=False)
    scales = np.sqrt(s**2 + 1.0)  # a step over its posterior standard deviation
    noise = np.array([rng.standard_normal(len(jacobian)) @ jacobian for _ in range(n_sets)])
    centres = rng.standard_normal((n_sets, len(truth)))
    t, last_steps = np.zeros_like(centres), np.full(n_sets, np.inf)
    for _ in range(MOST_STEPS):
        forces = problem.residuals(prior.parameters(t)) @ jacobian - noise + t - centres
        changes = -(forces @ directions.T / scales**2) @ directions
        last_steps = np.linalg.norm(changes @ directions.T * scales, axis=1)
        if last_steps.max() < SHORT:
            break
        t += changes / np.maximum(1.0, np.abs(changes).max(axis=1, keepdims=True))
    shares = last_steps / np.linalg.norm(t @ directions.T * scales, axis=1)
    return {"xi": problem.coefficient_sets(prior.parameters(t)).tolist(), "last_steps": shares.tolist()}


def tracks(boat: Vehicle, simulators: Iterable[Simulator]) -> JointProblem:
    """The joint problem of exact tracks of manoeuvres, with a prior about the truth."""
    given = {"free": NAMES, "prior": priors.relative_normal(PRIOR_SD)}
    flown = [simulator.manoeuvre for simulator in simulators]
    return JointProblem({one.name: cases.posed(boat, one, cases.tracking_range(boat), None, **given) for one in flown})


def null_moves(boat: Vehicle, names) -> np.ndarray:
    """Sets moved along each null vector of the equations until its largest relative change is NULL_MOVE, both ways.

    Parameters
    ----------
    boat : vehicle
    names : coefficients that may change

    Returns
    -------
    (n_sets, 101) non-dimensional coefficients
    """
    problem, sets = cases.track_problem(boat, "coupled", names), []
    for vector in null_space(problem, problem.reference).vectors:
        change = np.zeros(len(NAMES))
        change[columns(vector)] = list(vector.values())
        size = np.max(np.abs(change[boat.xi != 0] / boat.xi[boat.xi != 0]))
        sets += [boat.xi + side * NULL_MOVE / size * change for side in (-1, 1)]
    return np.array(sets)


def random_sets(boat: Vehicle, relative_sds: dict[str, float], n: int) -> dict[str, np.ndarray]:
    """Kind -> sets (n, 101) whose coefficients have independent normal relative errors."""
    rng = np.random.default_rng(cases.SEED)
    return {kind: boat.xi * (1 + sd * rng.standard_normal((n, len(NAMES)))) for kind, sd in relative_sds.items()}


def errors(boat: Vehicle, names, simulators: list[Simulator], n_seen: int, sets: np.ndarray) -> dict:
    """Relative errors of coefficients `names`, and largest position errors in m, set by set.

    Parameters
    ----------
    boat : vehicle
    names : coefficients that are compared
    simulators : of the manoeuvres, the first `n_seen` of which are those that the data come from
    n_seen : number of them
    sets : (n_sets, 101) non-dimensional coefficients
    """
    places = columns(names)
    relative = np.abs(sets[:, places] / boat.xi[places] - 1)
    off = []
    for simulator in simulators:
        states, status = simulator.run(np.vstack([boat.xi, sets]))
        distance = np.linalg.norm(states[1:, :, :3] - states[0, :, :3], axis=2).max(axis=1)
        off.append(np.where(status[1:] == 0, distance, np.inf))
    seen, unseen = np.array(off[:n_seen]), np.array(off[n_seen:])
    return {
        "n_sets": len(sets),
        "coefficient_median": np.median(relative, axis=1).tolist(),
        "coefficient_largest": relative.max(axis=1).tolist(),
        "beyond_ten_per_cent": np.sum(relative > 0.1, axis=1).tolist(),
        "n_coefficients": len(names),
        "seen_m": seen.max(axis=0).tolist(),
        "unseen_m": unseen.max(axis=0).tolist(),
        "unseen_median_m": np.median(unseen, axis=0).tolist(),
        "noise_m": 0.5 * cases.length_scale(boat),
    }
