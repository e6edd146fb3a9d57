"""Predictions of unseen manoeuvres by identified, random and posterior coefficient sets (thesis chapter 8)."""

import numpy as np
from scipy import stats

from bayesub.inference.baselines.estimate import Estimate
from bayesub.model.coefficients import INDEX
from bayesub.model.simulator import Simulator
from bayesub.model.vehicles import load_vehicle
from bayesub.problem.problem import Problem
from stopping_rule.halving_search import Reading, search
from thesis import cases
from thesis.cases import WEIGHT, time_scale, unseen

HELD_STEP = 0.1  # s on suboff: the thesis's, with its controls held within a step
LEVELS = np.round(np.linspace(0.1, 0.9, 9), 1)
N_TIMES = 10  # of a manoeuvre at which the posterior predictive is compared with the truth
STATISTICS = {"max": np.nanmax, "mean": np.nanmean, "median": np.nanmedian, "min": np.nanmin}


def searched(vehicle: str, n_starts: int, max_iterations: int) -> tuple[Problem, Estimate]:
    """The coupled case and the sets that the search of the thesis identifies from its exact track, best first.

    The search is that of section 7.2.2 as the study `stopping_rule` reads it, from starts within 10 % of the truth;
    costs are those of a boat as long as suboff, to which its tolerances belong.
    """
    boat, manoeuvre = load_vehicle(vehicle), "coupled"
    free = cases.free_coefficients(boat, manoeuvre)
    problem = cases.track_problem(boat, manoeuvre, free, position_sd=cases.length_scale(boat))
    starts = cases.streams(vehicle, manoeuvre)[0].uniform(0.9, 1.1, (n_starts, problem.n_params))
    return problem, search(problem, starts, Reading(max_iterations=max_iterations))


def fly_all(problem: Problem, estimate: Estimate, draws: np.ndarray, n_manoeuvres: int) -> dict:
    """Fly every set on random manoeuvres; those on which the true boat leaves the envelope are passed over.

    Parameters
    ----------
    problem : from which the sets were identified
    estimate : the identified sets; random sets have errors as large as those that its searches start from, with drag
        at the truth (thesis section 8.5)
    draws : (n_draws, 101) posterior coefficient sets
    n_manoeuvres : number of manoeuvres

    Returns
    -------
    dict of "errors" and "costs" (group -> (n, n_manoeuvres), the largest position error in m and the cost of the model
    manual, section 10; not a number where a simulation fails), "ranks" (n_manoeuvres, N_TIMES, 3) of the truth among
    posterior draws, "ranks_of_draws" (n_manoeuvres, n_draws, N_TIMES, 3) of each of them among all, not a number where
    one fails, "seeds" of the manoeuvres, how "far" each is from that of the problem (:func:`distance`), and the lengths
    "paths_m" of the true paths.
    """
    boat = problem.vehicle
    identified, random = problem.coefficient_sets(estimate.solutions), problem.coefficient_sets(estimate.starts)
    random[:, INDEX["Xuu"]] = boat.xi[INDEX["Xuu"]]
    sets = np.concatenate([boat.xi[None], identified, random, draws])
    ends = np.cumsum([0, 1, len(identified), len(random), len(draws)])
    groups = dict(zip(("truth", "sets", "random", "posterior"), map(slice, ends[:-1], ends[1:]), strict=True))
    errors, costs = ({key: [] for key in (*groups, "simulation")} for _ in range(2))
    ranks, of_draws, seeds, far, paths = [], [], [], [], []
    for simulator in unseen(boat, n_manoeuvres):
        times, manoeuvre = simulator.times, simulator.manoeuvre
        states, status = simulator.run(sets)
        held, _ = Simulator(boat, manoeuvre, times, dt=HELD_STEP * time_scale(boat), controls="hold").run(boat.xi)
        flown = {key: (states[group], status[group]) for key, group in groups.items()}
        for key, (some, codes) in (flown | {"simulation": (held, np.zeros(1, int))}).items():
            off = largest_and_cost(some, states[0])
            errors[key].append(np.where(codes == 0, off[0], np.nan))
            costs[key].append(np.where(codes == 0, off[1], np.nan))
        looks = np.linspace(0, len(times) - 1, N_TIMES + 1).astype(int)[1:]
        some, codes = flown["posterior"]
        places = np.where(codes[:, None, None] == 0, some[:, looks, :3], np.nan)
        good = places[codes == 0]
        ranks.append(np.mean(good < states[0, looks, :3], axis=0))
        of_draws.append((stats.rankdata(places, axis=0, nan_policy="omit") - 0.5) / len(good))
        seeds.append(int(manoeuvre.name.partition(":")[2]))
        far.append(distance(problem.trajectory(boat.xi[problem.columns]).states[0], states[0]))
        paths.append(np.linalg.norm(np.diff(states[0, :, :3], axis=0), axis=1).sum())
    return {
        "errors": {key: np.stack(values, axis=1) for key, values in errors.items()},
        "costs": {key: np.stack(values, axis=1) for key, values in costs.items()},
        "ranks": np.array(ranks),
        "ranks_of_draws": np.array(of_draws),
        "seeds": seeds,
        "far": np.array(far),
        "paths_m": np.array(paths),
    }


def distance(own: np.ndarray, other: np.ndarray) -> float:
    """How far the velocities of one motion (n, 12) are from those of another: rms of the Mahalanobis distance."""
    middle, spread_of = own[:, 6:].mean(axis=0), np.cov(own[:, 6:].T)
    off = other[:, 6:] - middle
    return float(np.sqrt(np.mean(np.einsum("ni,ni->n", off, np.linalg.solve(spread_of, off.T).T))))


def largest_and_cost(states, truth) -> tuple[np.ndarray, np.ndarray]:
    """(n,) largest position errors (m), and costs, of states (n, n_times, 12)."""
    off = states[..., :6] - truth[:, :6]
    off[..., 3:] = np.degrees(off[..., 3:])
    return np.linalg.norm(off[..., :3], axis=2).max(axis=1), WEIGHT * np.sum(off**2, axis=(1, 2))


def summary(problem: Problem, estimate: Estimate, flights: dict) -> dict:
    """The numbers of Tables 29 to 32, and of the posterior predictive."""
    errors, costs = flights["errors"], flights["costs"]
    order = np.argsort(np.nanmean(costs["sets"], axis=1))
    chosen = {"best": order[0], "middle": order[len(order) // 2], "worst": order[-1]}
    kinds = {key: errors["sets"][k] for key, k in chosen.items()}
    n_draws, n_manoeuvres = errors["posterior"].shape
    kinds |= {
        "simulation": errors["simulation"][0],
        "random": np.nanmean(errors["random"], axis=0),
        "posterior": errors["posterior"][np.arange(n_manoeuvres) % n_draws, np.arange(n_manoeuvres)],
    }
    truth = problem.vehicle.xi[problem.columns]
    own = problem.trajectory(np.vstack([truth, estimate.solutions])).states[:, :, :3]
    own_m = float(np.linalg.norm(own[1:] - own[0], axis=2).max(axis=1).mean())
    shares = errors["sets"] / flights["paths_m"]
    return {
        "names": list(problem.names),
        "ratios": {key: (estimate.solutions[k] / truth).tolist() for key, k in chosen.items()},
        "chosen": {key: int(k) for key, k in chosen.items()},
        "all": spread(errors["sets"]),
        "cost": spread(costs["sets"]),
        "kinds": {key: spread(values) for key, values in kinds.items()},
        "kind_errors": {key: values.tolist() for key, values in kinds.items()},
        "own_manoeuvre_mean_m": own_m,
        "times_worse": float(np.nanmean(errors["sets"]) / own_m),
        "share_of_path": {key: float(np.nanmean(shares[k])) for key, k in chosen.items()},
        "largest_share_of_path": float(np.nanmax(shares)),
        "share_simulating": problem.costs.seconds / estimate.seconds,
        "rank_correlations": rank_correlations(
            problem, estimate.solutions / truth - 1.0, errors["sets"], flights["far"]
        ),
        "posterior_spread_m": float(np.nanmedian(errors["posterior"])),
        "variance_by_set": shares_of_variance(errors["sets"]),
        "coverage": {str(level): float(np.mean(np.abs(flights["ranks"] - 0.5) <= level / 2)) for level in LEVELS},
        "coverage_of_draws": {str(level): coverage_of_draws(flights["ranks_of_draws"], level) for level in LEVELS},
        "failed": {key: int(np.isnan(values).sum()) for key, values in errors.items()},
        "n_manoeuvres": len(flights["seeds"]),
        "passed_over": flights["seeds"][-1] + 1 - len(flights["seeds"]),
    }


def rank_correlations(problem: Problem, wrong: np.ndarray, errors: np.ndarray, far: np.ndarray) -> dict[str, float]:
    """Spearman's correlations of the errors of predictions with the errors of coefficients, and with the manoeuvre.

    Parameters
    ----------
    problem : from which the sets were identified
    wrong : (n_sets, n_params) relative errors of the coefficients: all, and along the stiffer and the sloppier half of
        the directions of that problem
    errors : (n_sets, n_manoeuvres) m
    far : (n_manoeuvres,) distances of the manoeuvres from that of the problem
    """
    truth = problem.vehicle.xi[problem.columns]
    directions = np.linalg.svd(problem.jacobian(truth) * truth, full_matrices=False)[2]
    along, half = wrong @ directions.T, len(directions) // 2
    by_set = np.nanmedian(errors, axis=1)
    parts = {"all": along, "stiff": along[:, :half], "sloppy": along[:, half:]}
    found = {key: stats.spearmanr(np.linalg.norm(part, axis=1), by_set).statistic for key, part in parts.items()}
    found["manoeuvre"] = stats.spearmanr(far, np.nanmedian(errors, axis=0)).statistic
    return {key: float(value) for key, value in found.items()}


def coverage_of_draws(ranks, level: float) -> list[float]:
    """5 and 95 % of the share that a band of a level holds if the truth is a draw: ranks are (n, n_draws, ..)."""
    inside = np.where(np.isnan(ranks), np.nan, np.abs(ranks - 0.5) <= level / 2)
    return np.quantile(np.nanmean(inside, axis=(0, 2, 3)), [0.05, 0.95]).tolist()


def spread(values) -> dict[str, float]:
    """Maximum, mean, median and minimum of those that completed."""
    return {key: float(statistic(values)) for key, statistic in STATISTICS.items()}


def shares_of_variance(errors) -> dict[str, float]:
    """Shares of the variance of log errors (n_sets, n_manoeuvres) that set and manoeuvre explain: two-way analysis."""
    logs = np.log(errors)
    total = np.nanvar(logs)
    return {
        "set": float(np.nanvar(np.nanmean(logs, axis=1)) / total),
        "manoeuvre": float(np.nanvar(np.nanmean(logs, axis=0)) / total),
    }
