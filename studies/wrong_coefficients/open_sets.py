"""Coefficient sets that data leave open, and how far off the tracks are that they predict."""

from collections.abc import Iterable
from functools import cache

import numpy as np

from bayesub.inference.baselines import gauss_newton
from bayesub.inference.identifiability import null_space
from bayesub.model.coefficients import NAMES, columns
from bayesub.model.simulator import Simulator
from bayesub.model.vehicles import Vehicle, load_vehicle
from bayesub.problem import priors
from bayesub.problem.joint import JointProblem
from thesis import cases

PRIOR_SD = 0.25
MOST_ITERATIONS = 200
NULL_MOVE = 0.5  # of the largest coefficient of a null vector


def open_set(vehicle: str, n_manoeuvres: int, k: int) -> dict:
    """The k-th set that the tracks of so many manoeuvres leave open, drawn by randomising and optimising.

    The readings get noise, the centre of the prior a draw from it, and the mode is found again (Bardsley et al. 2014),
    from the truth, since the question is what the data leave open around it.
    """
    problem = randomised(seen(vehicle, n_manoeuvres), np.random.default_rng([cases.SEED, n_manoeuvres, k]))
    mode = gauss_newton(problem, problem.vehicle.xi[problem.columns], max_iterations=MOST_ITERATIONS)
    return {
        "xi": problem.coefficient_sets(mode.values)[0].tolist(),
        "cost": mode.costs[0],
        "status": mode.statuses[0],
    }


@cache
def seen(vehicle: str, n_manoeuvres: int) -> JointProblem:
    """:func:`tracks` of the first unseen manoeuvres; each process flies them once for all its sets."""
    boat = load_vehicle(vehicle)
    return tracks(boat, cases.unseen(boat, n_manoeuvres))


def tracks(boat: Vehicle, simulators: Iterable[Simulator]) -> JointProblem:
    """The joint problem of exact tracks of manoeuvres, with a prior about the truth."""
    given = {"free": NAMES, "prior": priors.relative_normal(PRIOR_SD)}
    flown = [simulator.manoeuvre for simulator in simulators]
    return JointProblem({one.name: cases.posed(boat, one, cases.tracking_range(boat), None, **given) for one in flown})


def randomised(problem: JointProblem, rng: np.random.Generator) -> JointProblem:
    """The same with noise on the tracks, and the prior moved, at the same width, to a draw from it."""
    xi, sds = problem.vehicle.xi, PRIOR_SD * np.abs(problem.vehicle.xi)
    centre = xi + sds * rng.standard_normal(len(NAMES))
    moved = {n: priors.normal(c, sd) for n, c, sd in zip(NAMES, centre, sds, strict=True) if sd > 0.0}
    prior = priors.Given(priors.relative_normal(PRIOR_SD), moved)

    def changed(trial):
        return trial.view(spread=prior, readings=trial.readings + trial.sds * rng.standard_normal(trial.sds.size))

    return problem.of_trials(changed)


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
