"""The three cases of the paper of 2003 (thesis appendix G), drawn at random: starts, and errors of known values."""

import numpy as np

from bayesub.model.coefficients import HORIZONTAL, INDEX, NAMES
from bayesub.model.vehicles import load_vehicle
from stopping_rule.halving_search import Reading, search
from thesis import cases

BOUND, START, WRONG = 0.25, 0.1, 0.01  # of cases 2 and 3; of starts, and bounds of case 1; of known values in case 3
OWN, KNOWN, WRONG_KNOWN = "case1", "case2", "case3"


def one_draw(seed: int, max_iterations: int) -> dict:
    """One search of each case: nothing known; what a towing tank measures held; that held up to 1 % wrong.

    Parameters
    ----------
    seed : int
        Of the draw.
    max_iterations : int
        Of each search.

    Returns
    -------
    dict
        Case -> costs (m^2 + deg^2), position error (m), ratios to the truth at the start and at the end, those of the
        known coefficients, the number at bounds, and errors of position (n_times,) over time.
    """
    boat, rng = load_vehicle("suboff"), np.random.default_rng([cases.SEED, 2003, seed])
    everything = [n for n in HORIZONTAL if boat.xi[INDEX[n]] != 0.0]
    others = [n for n in everything if n not in cases.TOWED and n not in cases.held("horizontal")]
    start = boat.xi * rng.uniform(1.0 - START, 1.0 + START, len(NAMES))
    errors = rng.uniform(1.0 - WRONG, 1.0 + WRONG, len(NAMES))
    wrong = np.where(np.isin(NAMES, cases.TOWED), boat.xi * errors, boat.xi)
    searches = {
        OWN: (everything, start, boat.xi, 0.0, START),
        KNOWN: (others, boat.xi, boat.xi, START, BOUND),
        WRONG_KNOWN: (others, boat.xi, wrong, START, BOUND),
    }
    found = {}
    for case, (free, centre, xi, spread, bounds) in searches.items():
        problem = cases.track_problem(boat, "horizontal", free, centre=centre, xi=xi)
        ratios = rng.uniform(1.0 - spread, 1.0 + spread, (1, problem.n_params))
        found[case] = _search(problem, ratios, Reading(max_iterations=max_iterations), bounds)
    return found


def _search(problem, start, reading, bounds) -> dict:
    """The bounds of case 1 are 10 % about its start, and so differ by coefficient."""
    estimate, boat = search(problem, start, reading, bounds), problem.vehicle
    truth = boat.xi[problem.columns]
    ratios = estimate.values / truth
    true_track = problem.simulator.run(boat.xi)[0][0, :, :3]
    off = np.linalg.norm(problem.trajectory(estimate.values).states[0, :, :3] - true_track, axis=1)
    limits = problem.prior.mean / truth * (1.0 + np.array([[-1.0], [1.0]]) * bounds)
    known = [n for n in HORIZONTAL if boat.xi[INDEX[n]] != 0.0 and n not in problem.names]
    values = problem.coefficient_sets(estimate.values[None])[0] / np.where(boat.xi == 0.0, 1.0, boat.xi)
    return {
        "names": list(problem.names),
        "starting_cost": float(np.sum(problem.residuals(estimate.starts) ** 2)),
        "converged_cost": float(estimate.costs[0]),
        "cost_at_truth": float(np.sum(problem.residuals(truth[None]) ** 2)),
        "position_m": float(off.max()),
        "ratios": ratios.tolist(),
        "starts": (estimate.starts[0] / truth).tolist(),
        "known": {n: float(values[INDEX[n]]) for n in known},
        "at_bounds": int(np.sum(np.min(np.abs(ratios - limits), axis=0) < 1e-6)),
        "errors_m": off.tolist(),
    }
