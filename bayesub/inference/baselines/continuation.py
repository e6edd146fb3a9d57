"""A search for the posterior mode that follows it from the prior: for long records, unstable boats and far starts.

With noise s times as large, and a large s, the posterior has one mode, near the prior; as s falls to one, its mode
moves to that of the posterior, and each search starts where the one before has ended (continuation: Allgower & Georg
1990). If the noise is normal its likelihood is raised to the power 1/s^2 (Friel & Pettitt 2008). To noise with heavy
tails every reading is an outlier from afar, and none has a slope; with a large s all of them have (graduated
non-convexity: Blake & Zisserman 1987). The record is lengthened as well: the first search is with an eighth of it, or
less where the boat does not complete that, and the part doubles.

On an unstable ship and a zig-zag of forty minutes, with guesses 70 % off, Gauss-Newton from the middle of the prior
ends at a deviance of 2507 a reading, and continuation at 1.02, with 73 Jacobians.
"""

from dataclasses import replace

import numpy as np

from bayesub.inference.baselines.estimate import Estimate
from bayesub.inference.baselines.gauss_newton import gauss_newton
from bayesub.inference.interface import Sampled

METHOD = "posterior mode by continuation"
_FALL = 2.0  # of the scale of the noise from one search to the next
_NO_FALL = 1e-3  # of the deviance a row
_NEAR = 0.1  # posterior standard deviations from the mode of a search, where the next begins
_HALVINGS, _MOST_HALVINGS = 3, 7  # of the record before the first search, and where that is not completed
_LAST = 200  # iterations of the last search


def continuation(problem: Sampled, start: np.ndarray | None = None) -> Estimate:
    """The posterior mode, followed from large noise and a short record to those of the problem.

    Parameters
    ----------
    problem : one that is itself within any duration has its whole record in all searches
    start : (n_params,) by default the middle of the prior

    Returns
    -------
    Estimate
        Of the last search; its costs are those of all searches.

    Raises
    ------
    ValueError
        If the simulation fails at the start even on the shortest part of the record.
    """
    before = problem.costs.simulations, problem.costs.jacobians
    values = problem.prior.parameters(np.zeros(problem.n_params)) if start is None else np.asarray(start)
    seconds = 0.0
    for part in _parts(problem, values):
        estimate = follow_noise(part, values, max_iterations=_LAST if part is problem else 60)
        values, seconds = estimate.values, seconds + estimate.seconds
    simulations, jacobians = problem.costs.simulations - before[0], problem.costs.jacobians - before[1]
    return replace(estimate, method=METHOD, evaluations=simulations, jacobians=jacobians, seconds=seconds)


def follow_noise(problem: Sampled, start: np.ndarray, *, max_iterations: int = 60) -> Estimate:
    """The posterior mode, followed from noise with which the start (n_params,) would fit, with the seconds of all.

    The last search, with the noise of the problem, has `max_iterations`. A ValueError says that the simulation fails at
    the start.
    """
    scales, misfit, fall = [1.0], _deviance_a_row(problem, start), np.inf
    while 1.0 < misfit < np.inf and fall > _NO_FALL:  # some noise is as large as the errors are, and falls no more
        scales.insert(0, _FALL * scales[0])
        before, misfit = misfit, _deviance_a_row(problem.widened(scales[0]), start)
        fall = before - misfit
    values, seconds = start, 0.0
    for scale in scales:
        if scale == 1.0:
            estimate = gauss_newton(problem, values, max_iterations=max_iterations)
        else:
            estimate = gauss_newton(problem.widened(scale), values, tolerance=_NEAR)
        values, seconds = estimate.values, seconds + estimate.seconds
    return replace(estimate, seconds=seconds)


def _parts(problem, values):
    """The problem of parts of the record, each twice as long as the one before, from one that is completed."""
    parts = [problem]
    for halvings in range(1, _MOST_HALVINGS + 1):
        if halvings > _HALVINGS and np.isfinite(_deviance_a_row(parts[0], values)):
            break
        part = problem.truncated(problem.duration / 2.0**halvings)
        if part is problem:
            break
        parts.insert(0, part)
    return parts


def _deviance_a_row(problem, values) -> float:
    residuals, (deviance,) = problem.misfit(values[None])
    return deviance / residuals.shape[1]
