"""Posteriors of trials, and the coefficient sets that SQP identifies seen with their eyes."""

import numpy as np
from scipy import linalg

from bayesub.inference.identifiability import Spectrum, fisher
from bayesub.inference.sampling import Posterior
from bayesub.problem import priors
from bayesub.problem.problem import Problem
from bayesub.report.plots.coefficients import QUANTILES
from thesis import cases

N_DRAWS = 4000  # of the posterior, whose fit is computed
REGION = 0.95
TRADE_OFF = 0.9  # correlation
CORNER = 6  # coefficients at most
MEASURES = ("distance", "chi_square", "density")
GROUPS = ("starts", "exact", "noisy")  # of sets


def searches(problem: Problem, n_sets: int, max_iterations: int) -> dict[str, list]:
    """Starts and ends (n_sets, n_params) of SQP on the exact track, and its ends on the readings of the trial.

    The coefficients that SQP does not identify are at the truth.
    """
    boat, flown = problem.vehicle, problem.manoeuvre
    exact, estimate = cases.identified(boat.name, flown.name, n_sets, max_iterations)
    prior, dt = priors.relative_normal(0.25, boat.xi), problem.simulator.step
    noisy = Problem(boat, flown, problem.record, free=exact.names, prior=prior, dt=dt)
    again = cases.identify(noisy, cases.streams(boat.name, flown.name)[0], n_sets, max_iterations)
    sets = {"starts": estimate.starts, "exact": estimate.solutions, "noisy": again.solutions}
    return {key: exact.coefficient_sets(values)[:, problem.columns].tolist() for key, values in sets.items()}


def compare(problem: Problem, posterior: Posterior, sets: dict[str, list]) -> tuple[dict, dict[str, np.ndarray]]:
    """Numbers of one case, as JSON types, and the arrays that its figures need besides.

    Parameters
    ----------
    problem : the trial
    posterior : of it
    sets : group -> (n_sets, n_params), of :func:`searches`
    """
    sets = {key: np.array(values) for key, values in sets.items()} | {"truth": problem.reference[None]}
    rows = np.random.default_rng(cases.SEED).choice(len(posterior.draws), N_DRAWS)
    draws, directions = posterior.draws[rows], fisher(problem, problem.reference)
    distances = places(problem, draws, sets)
    standard = {key: problem.prior.standard(values) for key, values in (sets | {"posterior": posterior.draws}).items()}
    along = {key: (t @ directions.directions.T).std(axis=0) for key, t in standard.items()}
    chosen, channels = trade_off_group(posterior.correlation), problem.record.channels
    off = problem.prior.standard(problem.reference)
    furthest = int(np.argmax(np.abs(off)))
    pairs = strongest_pairs(posterior.correlation)[:10]
    numbers = {
        "names": list(posterior.names),
        "position_sd_m": float(channels[0].sd),
        "attitude_sd_deg": float(np.degrees(channels[-1].sd)),
        "n_readings": problem.record.n_readings,
        "converged": posterior.converged,
        "shortcomings": list(posterior.shortcomings),
        "rhat": float(posterior.rhat.max()),
        "ess": float(min(posterior.bulk_ess.min(), posterior.tail_ess.min())),
        "evaluations": posterior.evaluations,
        "seconds": posterior.seconds,
        "contraction": posterior.contraction.tolist(),
        "n_null": directions.n_null,
        "n_stiff": directions.n_informed,
        "furthest_from_prior": (posterior.names[furthest], float(off[furthest])),
        "inside": {g: {m: int(np.sum(v <= 1.0)) for m, v in by.items()} for g, by in distances.items()},
        "places": {g: {m: v.tolist() for m, v in by.items()} for g, by in distances.items()},
        "scatter": {group: shares(directions, along[group]) for group in GROUPS},
        "scatter_over_posterior": {group: relative_scatter(sets[group], posterior.sd) for group in ("exact", "noisy")},
        "scatter_sd": {group: float(np.linalg.norm(along[group])) for group in (*GROUPS, "posterior")},
        "trade_offs": [(posterior.names[i], posterior.names[j], float(posterior.correlation[i, j])) for i, j in pairs],
        "n_trade_offs": int(np.sum(np.abs(np.triu(posterior.correlation, 1)) > TRADE_OFF)),
    }
    arrays = {
        "reference": problem.reference,
        "prior_mean": problem.prior.mean,
        "prior_sd": problem.prior.sd,
        "mean": posterior.mean,
        "sd": posterior.sd,
        "quantiles": posterior.quantiles(QUANTILES),
        "exact": sets["exact"],
        "noisy": sets["noisy"],
        "correlation": posterior.correlation.astype(np.float32),
        "chosen": chosen,
        "draws": draws[:, chosen].astype(np.float32),
        "singular_values": directions.singular_values,
    }
    return numbers, arrays | {f"along_{group}": along[group] for group in (*GROUPS, "posterior")}


def places(problem: Problem, draws: np.ndarray, sets: dict) -> dict[str, dict[str, np.ndarray]]:
    """How far out each group of sets (n, n_params) lies, group -> measure -> (n,), over the 95 % limit of the draws."""
    groups = {"draws": draws} | sets
    t = {key: problem.prior.standard(values) for key, values in groups.items()}
    distances = {key: {"distance": mahalanobis(t["draws"], values)} for key, values in t.items()}
    for key, values in groups.items():
        fit = problem.misfit(values)[1]
        distances[key] |= {"chi_square": fit, "density": fit + np.sum(t[key] ** 2, axis=1)}
    for measure in ("chi_square", "density"):
        best = min(values[measure].min() for values in distances.values())
        for values in distances.values():
            values[measure] = values[measure] - best
    limits = {measure: np.quantile(values, REGION) for measure, values in distances.pop("draws").items()}
    return {g: {m: v / limits[m] for m, v in values.items()} for g, values in distances.items()}


def mahalanobis(draws: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(n,) distances of points (n, n_params) from the mean of draws (n_draws, n_params) by their covariance."""
    root = linalg.cholesky(np.cov(draws.T), lower=True)
    return np.linalg.norm(linalg.solve_triangular(root, (points - draws.mean(axis=0)).T, lower=True), axis=0)


def shares(directions: Spectrum, along: np.ndarray) -> dict[str, float]:
    """Shares of the variance of standard deviations along the directions (n_params,) by kind of direction."""
    n_params = len(directions.names)
    n = n_params - directions.n_null
    bounds = {"stiff": (0, directions.n_informed), "sloppy": (directions.n_informed, n), "null": (n, n_params)}
    return {kind: float(np.sum(along[a:b] ** 2) / np.sum(along**2)) for kind, (a, b) in bounds.items()}


def relative_scatter(sets: np.ndarray, sd: np.ndarray) -> list[float]:
    """Scatter of sets over posterior sd of each coefficient that SQP identifies: least, median, largest."""
    ratios = (sets.std(axis=0) / sd)[np.ptp(sets, axis=0) > 0.0]
    return [float(f(ratios)) for f in (np.min, np.median, np.max)]


def strongest_pairs(correlation: np.ndarray) -> np.ndarray:
    """Positions (n_pairs, 2) of the coefficients of each pair, the most correlated first."""
    pairs = np.transpose(np.triu_indices(len(correlation), 1))
    return pairs[np.argsort(-np.abs(correlation[tuple(pairs.T)]))]


def trade_off_group(correlation: np.ndarray) -> np.ndarray:
    """Positions of at most CORNER coefficients: those of the strongest correlations."""
    chosen = {}
    for pair in strongest_pairs(correlation).tolist():
        if len(chosen | dict.fromkeys(pair)) > CORNER:
            break
        chosen |= dict.fromkeys(pair)
    return np.sort(list(chosen))
