"""Convergence of independent ensembles: autocorrelation times, effective sample sizes and R-hat; and what prevents it.

The walkers of an ensemble are not independent chains. R-hat therefore compares whole ensembles (and their first and
second halves in time), and the autocorrelation time is that of an ensemble, averaged over its walkers.
Functions of a chain take one of (n_ensembles, n_steps, n_walkers, n_params).

The formulas are written out here although ArviZ and emcee have some of them. R-hat is that of ArviZ to round-off (a
test says so), but importing ArviZ takes two seconds, and its R-hat of one parameter after another is a third slower.
emcee's autocorrelation time normalises each walker before it averages, which fails for a walker that stands still.

A log likelihood that jumps from place to place holds walkers. Cross-flow forces with sg(v) and sg(w) jump where a
velocity changes its sign. The integrator sees the sign at the ends and in the middle of its steps only, so that a
change by which a sign comes a step later moves all later readings. The log likelihood jumps in proportion to the step.
"""

import numpy as np
from scipy import fft, special, stats

from bayesub.inference.interface import Emulated

NOTICEABLE_JUMP = 1.0  # jump of a log likelihood by which walkers are held
_JUMP_SEGMENTS, _JUMP_POINTS = 128, 16
_JUMP_SHARE = 1.0 / 8.0  # of the way from one draw to another, on which a log likelihood is a cubic but for jumps


def rank_normalised(chain: np.ndarray) -> np.ndarray:
    """Ranks of all draws of a parameter, turned into normal scores (Vehtari et al. 2021, section 4.1)."""
    flat = chain.reshape(-1, chain.shape[-1])
    ranks = stats.rankdata(flat, axis=0)
    return special.ndtri((ranks - 0.375) / (len(flat) + 0.25)).reshape(chain.shape)


def rank_histograms(chain: np.ndarray, n_bins: int) -> np.ndarray:
    """(n_ensembles, n_bins, n_params) shares of each ensemble's draws in bins of rank among all, 1 where they are even.

    Ensembles that have found the same posterior have even ranks (Vehtari et al. 2021, section 4.2).
    """
    n_ensembles, *_, n_params = chain.shape
    flat = chain.reshape(-1, n_params)
    bins = ((stats.rankdata(flat, axis=0) - 0.5) * (n_bins / len(flat))).astype(int)
    bins = bins.reshape(n_ensembles, -1, n_params)
    return np.stack([(bins == k).mean(axis=1) * n_bins for k in range(n_bins)], axis=1)


def rank_spread(n_effective: float | np.ndarray, n_ensembles: int, n_bins: int) -> np.ndarray:
    """Standard deviation by chance of :func:`rank_histograms`, of ensembles with so many effective draws in all."""
    in_each = np.asarray(n_effective) / n_ensembles
    return np.sqrt((n_bins - 1) / in_each * (1.0 - 1.0 / n_ensembles))


def rhat(chain: np.ndarray, scores: np.ndarray | None = None) -> np.ndarray:
    """(n_params,) rank-normalised split R-hat, the larger of its bulk and folded versions (Vehtari et al. 2021).

    Each ensemble is split into its first and second half in time; all walkers of a half count as one chain. It is
    infinite for a parameter that stands still in all of them. `scores`: the rank-normalised chain, if it is at hand.
    """
    folded = np.abs(chain - np.median(chain, axis=(0, 1, 2)))
    scores = rank_normalised(chain) if scores is None else scores
    return np.maximum(_split_rhat(scores), _split_rhat(rank_normalised(folded)))


def _split_rhat(chain):
    half = chain.shape[1] // 2
    parts = np.concatenate([chain[:, :half], chain[:, -half:]])
    n = half * chain.shape[2]
    within = parts.var(axis=(1, 2), ddof=1).mean(axis=0)
    between = parts.mean(axis=(1, 2)).var(axis=0, ddof=1)
    moving = within > 0.0
    return np.where(moving, np.sqrt((n - 1) / n + between / np.where(moving, within, 1.0)), np.inf)


def autocorrelation_time(chain: np.ndarray) -> np.ndarray:
    """(n_ensembles, n_params) integrated autocorrelation times in steps (Sokal 1997), window of five times tau.

    The autocovariance is averaged over the walkers of an ensemble before it is normalised. An ensemble that stands
    still counts as correlated over all its length.
    """
    centred = chain - chain.mean(axis=(1, 2), keepdims=True)
    n_ensembles, n_steps, _, n_params = chain.shape
    taus = np.empty((n_ensembles, n_params))
    for e in range(n_ensembles):
        spectrum = fft.rfft(centred[e], n=fft.next_fast_len(2 * n_steps), axis=0)
        covariance = fft.irfft(np.mean(np.abs(spectrum) ** 2, axis=1), n=fft.next_fast_len(2 * n_steps), axis=0)
        still = covariance[0] <= 0.0
        running = 2.0 * np.cumsum(covariance[:n_steps] / np.where(still, 1.0, covariance[0]), axis=0) - 1.0
        beyond = np.arange(n_steps)[:, None] >= 5.0 * running
        window = np.where(beyond.any(axis=0), beyond.argmax(axis=0), n_steps - 1)
        taus[e] = np.where(still, n_steps, running[window, np.arange(n_params)])
    return np.maximum(taus, 1.0)


def ess(chain: np.ndarray) -> np.ndarray:
    """(n_params,) effective sample size of all draws: their number over the mean autocorrelation time of ensembles."""
    return np.prod(chain.shape[:3]) / autocorrelation_time(chain).mean(axis=0)


def bulk_ess(chain: np.ndarray, scores: np.ndarray | None = None) -> np.ndarray:
    """(n_params,) effective sample size of the rank-normalised draws, given as `scores` if they are at hand."""
    return ess(rank_normalised(chain) if scores is None else scores)


def tail_ess(chain: np.ndarray) -> np.ndarray:
    """(n_params,) the smaller of the effective sample sizes of the events below the 5 % and 95 % quantiles."""
    low, high = np.quantile(chain, [0.05, 0.95], axis=(0, 1, 2))
    return np.minimum(ess((chain <= low).astype(float)), ess((chain <= high).astype(float)))


def variance_trend(chain: np.ndarray, scores: np.ndarray | None = None) -> np.ndarray:
    """(n_params,) change of the ensemble variance from the first to the second half, in Monte Carlo standard errors.

    The variance is that of the rank-normalised draws, which exists whatever the tails, about the median of all; two
    halves of a stationary chain of many autocorrelation times differ by a standard normal. The standard error is that
    of two mean squares, each with half of their effective sample size (Geweke 1992, for the second moment).
    """
    squares = (rank_normalised(chain) if scores is None else scores) ** 2
    half = chain.shape[1] // 2
    change = squares[:, -half:].mean(axis=(0, 1, 2)) - squares[:, :half].mean(axis=(0, 1, 2))
    errors = np.sqrt(4.0 * squares.var(axis=(0, 1, 2)) / ess(squares))
    return change / np.where(errors > 0.0, errors, 1.0)


def threshold(n: int, false_alarms: float) -> float:
    """The size that any of `n` standard normal numbers reaches with at most this probability (Bonferroni).

    For the trends of a hundred parameters and one false alarm in a hundred looks 3.9; it costs a tenth more steps.
    """
    return float(-special.ndtri(false_alarms / (2.0 * n)))


def largest_jump(problem: Emulated, draws: np.ndarray, rng: np.random.Generator) -> float:
    """The largest difference of log likelihoods at neighbouring parameters that no cubic explains.

    Neighbours lie on short pieces of straight lines from one draw (n, n_params) of the posterior towards another, 2048
    simulations in all. Zero where no piece has finite log likelihoods throughout.
    """
    starts, ends = draws[rng.choice(len(draws), (2, _JUMP_SEGMENTS))]
    shares = np.linspace(0.0, _JUMP_SHARE, _JUMP_POINTS)
    places = starts[:, None] + shares[:, None] * (ends - starts)[:, None]
    values = problem.log_likelihood(places.reshape(-1, draws.shape[1])).reshape(_JUMP_SEGMENTS, _JUMP_POINTS)
    values = values[np.isfinite(values).all(axis=1)].T
    cubics = np.polynomial.polynomial.polyvander(shares / _JUMP_SHARE, 3)
    rest = values - cubics @ np.linalg.lstsq(cubics, values, rcond=None)[0]
    return float(np.abs(np.diff(rest, axis=0)).max(initial=0.0))


def jump_sentence(jump: float, step_s: float) -> str:
    """What a jump means for a run that has not converged, and what to try; empty for one that is not noticeable.

    The step of the integrator is in s, the longest of all trials.
    """
    if jump < NOTICEABLE_JUMP:
        return ""
    # The longest of the steps .. 0.1, 0.2, 0.5, 1 .. with which jumps are not noticed.
    longest = step_s * NOTICEABLE_JUMP / jump
    decade = 10.0 ** np.floor(np.log10(longest))
    step = float(max(m for m in (1.0, 2.0, 5.0) if m * decade <= longest * (1.0 + 1e-9)) * decade)
    return (
        f"The log likelihood jumps by up to {jump:.3g} between neighbouring parameter values, and walkers get stuck. A "
        f"force with the sign of a velocity does this: it switches a time step earlier or later. Try dt_s = {step:g} "
        f"in place of {step_s:g}."
    )
