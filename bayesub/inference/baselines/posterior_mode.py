"""The posterior mode, also where some channels say no more than an interval."""

from dataclasses import replace

import numpy as np

from bayesub.inference.baselines.continuation import continuation, follow_noise
from bayesub.inference.baselines.estimate import Estimate
from bayesub.inference.baselines.gauss_newton import gauss_newton
from bayesub.inference.interface import Sampled
from bayesub.io.errors import InputError

SHARES = (0.1, 0.03, 0.01, 0.003, 0.001)  # sd of what smooths the ends of an interval, over its length
_SEARCHES = 12  # from draws of the prior at most
_SAME = 0.05  # difference of costs for each parameter that is none: posterior draws cost one more for each
_MISFIT = 2.0  # mean square of the residuals, one of a mode that fits, from which a mode is not trusted


def posterior_mode(problem: Sampled, *, rng: np.random.Generator) -> Estimate:
    """The posterior mode by Gauss-Newton searches, with a finite log likelihood.

    A long track has local modes, thousands of standard deviations off. The searches start from the middle of the prior
    and from draws of it until the lowest cost has been reached twice, or nearly: where a force jumps with the sign of a
    velocity a density jumps a little from step to step, and has a mode on each. If the noise has heavy tails, each
    follows the mode from noise as large as the misfit of its start. Where none has, where the best of them fits badly
    or where no simulation completes the record, the mode is follow_noise from large noise
    (:func:`bayesub.inference.baselines.continuation.continuation`), and the better of both is taken.

    Readings that are rounded and have no noise only say in which interval the prediction lies. The search then smooths
    the ends of the intervals, less and less until all predictions are inside.

    Parameters
    ----------
    problem : to be solved
    rng : source of the starts

    Returns
    -------
    Estimate of the last search; its costs are those of all searches.

    Raises
    ------
    InputError : if no mode is found: no simulation completes the record, or no parameters that the prior admits make
        every reading where there is no noise
    """
    mode: Estimate | None = None
    before = (problem.costs.simulations, problem.costs.jacobians)
    for share in SHARES:
        smooth = problem.smoothed(share)
        mode = _lowest(smooth, rng) if mode is None else gauss_newton(smooth, mode.values)
        if np.isfinite(problem.log_likelihood(mode.values)[0]):
            costs = problem.costs
            return replace(mode, evaluations=costs.simulations - before[0], jacobians=costs.jacobians - before[1])
    assert mode is not None
    parts = problem.log_likelihoods(mode.values)
    channels = [name for name, part in parts.items() if not np.isfinite(part[0])]
    raise InputError(
        f"channel '{channels[0]}': no parameters that the prior admits are found with every prediction within the "
        f"rounding of its reading; give the sensor an sd, or widen the prior",
        "data",
        channels[0],
    )


def _lowest(problem, rng) -> Estimate:
    """The best of the searches until two have ended there, or, where that is not to be trusted, of continuation."""
    best, agreed = _best_of_starts(problem, rng)
    if best is not None and agreed and np.mean(problem.misfit(best.values[None])[0] ** 2) < _MISFIT:
        return best
    try:
        other = continuation(problem)
    except ValueError:  # no part of the record is completed
        if best is None:
            raise InputError(
                "no simulation within the prior completes the record, not even the first hundredth of it; look at the "
                "signs of the controls and at the vehicle with bayesub check, or narrow the prior",
                "model",
                "prior",
            ) from None
        return best
    return other if best is None or other.costs[0] < best.costs[0] - _SAME * problem.n_params else best


def _best_of_starts(problem, rng) -> tuple[Estimate | None, bool]:
    """The best of the searches from the prior, None if no simulation completes the record; whether two agree on it."""
    best = _search(problem, None)
    for start in problem.prior.sample(rng, _SEARCHES):
        other = _search(problem, start)
        if best is None or other is None:
            best = best or other
            continue
        if abs(other.costs[0] - best.costs[0]) < _SAME * problem.n_params:
            return best, True
        best = min(best, other, key=lambda estimate: estimate.costs[0])
    return best, False


def _search(problem, start) -> Estimate | None:
    try:
        if not problem.heavy_tailed:
            return gauss_newton(problem, start)
        middle = problem.prior.parameters(np.zeros(problem.n_params))
        return follow_noise(problem, middle if start is None else start)
    except ValueError:  # the simulation fails there
        return None
