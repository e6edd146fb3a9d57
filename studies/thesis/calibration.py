"""Simulation-based calibration, which asks whether a posterior holds the truth as often as it says.

If the truth is a draw from the prior and the data are simulated from it, then the rank of the truth among independent
draws of its posterior is uniform (Talts et al. 2018), for every parameter and every other quantity, such as the
log likelihood (Modrak et al. 2023).
"""

import numpy as np
from scipy import stats

N_DRAWS = 199  # of the posterior for a rank; with them the central 50, 90 and 95 % are whole numbers of ranks
INTERVALS = (0.5, 0.9, 0.95)
_SIMULATED = 20_000  # sets of uniform ranks that set the band


def independent_draws(posterior, rng: np.random.Generator, n: int = N_DRAWS) -> np.ndarray:
    """(n, n_params) draws, each from another walker and at a random step; there must be `n` walkers in all."""
    n_ensembles, n_steps, n_walkers = posterior.log_prob.shape
    walkers = rng.choice(n_ensembles * n_walkers, n, replace=False)
    return posterior.chain[walkers // n_walkers, rng.integers(n_steps, size=n), walkers % n_walkers]


def prior_trajectory(problem, rng: np.random.Generator):
    """A draw of the prior whose simulation completes, by drawing again where it fails.

    The prior is thereby restricted to such draws, and so is the posterior, as a failed simulation has likelihood zero.

    Returns
    -------
    truth : (n_params,)
    trajectory : its motion at the times of the readings
    n_failed : number of draws before it
    """
    n_failed = 0
    while True:
        (truth,) = problem.prior.sample(rng, 1)
        trajectory = problem.trajectory(truth)
        if trajectory.status[0] == "ok":
            return truth, trajectory, n_failed
        n_failed += 1


def posterior_ranks(problem, posterior, truth, rng: np.random.Generator) -> dict[str, int]:
    """Parameter -> rank of the truth (n_params,) among draws of the posterior, and that of its log likelihood."""
    draws = independent_draws(posterior, rng)
    ranks = dict(zip(problem.names, rank(truth, draws).tolist(), strict=True))
    likelihood = problem.log_likelihood(np.concatenate([truth[None], draws]))
    return ranks | {"log likelihood": int(rank(likelihood[0], likelihood[1:]))}


def rank(truth, draws) -> np.ndarray:
    """Number of draws (n_draws, ...) below the truth (...), 0 to n_draws."""
    return np.count_nonzero(draws < truth, axis=0)


def ecdf(ranks, n_draws: int = N_DRAWS) -> np.ndarray:
    """(n_draws,) fractions of ranks (n_trials,) that are at most 0, 1, .., n_draws - 1."""
    return np.searchsorted(np.sort(ranks), np.arange(n_draws), side="right") / len(ranks)


def band(n_trials: int, false_alarms: float, rng: np.random.Generator, n_draws: int = N_DRAWS) -> tuple:
    """Lower and upper limits (n_draws,) that the whole ECDF of uniform ranks crosses with probability `false_alarms`.

    At each point they are equal quantiles of its binomial law; which ones is simulated (Saeilynoja et al. 2022).
    `false_alarms` must be 1e-4 or more, so that some are seen among 20,000 simulated sets.
    """
    points = np.arange(1, n_draws + 1) / (n_draws + 1)
    ranks = np.sort(rng.integers(n_draws + 1, size=(_SIMULATED, n_trials)), axis=1)
    level = np.full(_SIMULATED, 1.0)
    counts = np.arange(n_trials + 1)
    for k, p in enumerate(points):
        tails = np.minimum(stats.binom.cdf(counts, n_trials, p), stats.binom.sf(counts - 1, n_trials, p))
        level = np.minimum(level, tails[np.count_nonzero(ranks <= k, axis=1)])
    quantile = np.quantile(level, false_alarms, method="lower")
    lower, upper = stats.binom.ppf(quantile, n_trials, points), stats.binom.isf(quantile, n_trials, points)
    return lower / n_trials, upper / n_trials


def coverage(ranks, n_draws: int = N_DRAWS) -> dict[float, float]:
    """Fraction of ranks (n_trials,) within the central 50, 90 and 95 % of those possible."""
    outside = {level: round((n_draws + 1) * (1 - level) / 2) for level in INTERVALS}
    ranks = np.asarray(ranks)
    return {level: float(np.mean((ranks >= cut) & (ranks <= n_draws - cut))) for level, cut in outside.items()}


def uniformity(ranks: dict, false_alarms: float, rng: np.random.Generator, n_draws: int = N_DRAWS) -> dict:
    """Are ranks (n_trials,) of several quantities uniform? As JSON types.

    Parameters
    ----------
    ranks : quantity -> ranks (n_trials,)
    false_alarms : probability that the ECDF of any quantity leaves the band by chance (Bonferroni)

    Returns
    -------
    dict
        ``band`` with ``lower`` and ``upper`` (n_draws,), and ``quantities``: quantity -> whether its ECDF is
        ``inside``, its ``mean_rank`` as a fraction, and the ``coverage`` of its intervals.
    """
    n_trials = len(next(iter(ranks.values())))
    lower, upper = band(n_trials, false_alarms / len(ranks), rng, n_draws)
    quantities = {}
    for name, values in ranks.items():
        fractions = ecdf(values, n_draws)
        quantities[name] = {
            "inside": bool(np.all((fractions >= lower) & (fractions <= upper))),
            "mean_rank": float(np.mean(values)) / n_draws,
            "coverage": {f"{100 * level:g} %": share for level, share in coverage(values, n_draws).items()},
        }
    return {"band": {"lower": lower.tolist(), "upper": upper.tolist()}, "quantities": quantities}
