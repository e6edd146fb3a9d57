"""The posterior mode, also where some channels say no more than an interval."""

from dataclasses import replace

import numpy as np

from bayesub.baselines.estimate import Estimate
from bayesub.baselines.gauss_newton import gauss_newton
from bayesub.identifiability.interface import InferenceProblem
from bayesub.io.errors import InputError

SHARES = (0.1, 0.03, 0.01, 0.003, 0.001)  # sd of what smooths the ends of an interval, over its length
_SEARCHES, _SAME = 12, 0.1  # from draws of the prior at most; difference of costs that is none


def posterior_mode(problem: InferenceProblem, *, rng: np.random.Generator) -> Estimate:
    """The posterior mode by Gauss-Newton searches, with a finite log likelihood.

    A long track has local modes, thousands of standard deviations off. The searches start from the middle of the prior
    and from draws of it until the lowest cost has been reached twice.

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
    InputError : if no mode is found: then no parameters that the prior admits make every reading, and there is noise
    """
    mode, before = None, (problem.costs.simulations, problem.costs.jacobians)
    for share in SHARES:
        smooth = problem.smoothed(share)
        mode = _lowest(smooth, rng) if mode is None else gauss_newton(smooth, mode.values)
        if np.isfinite(problem.log_likelihood(mode.values)[0]):
            costs = problem.costs
            return replace(mode, evaluations=costs.simulations - before[0], jacobians=costs.jacobians - before[1])
    parts = problem.log_likelihoods(mode.values)
    channels = [name for name, part in parts.items() if not np.isfinite(part[0])]
    raise InputError(
        f"channel '{channels[0]}': no parameters that the prior admits are found with every prediction within the "
        f"rounding of its reading; give the sensor an sd, or widen the prior"
    )


def _lowest(problem, rng) -> Estimate:
    """The best of the searches until two have ended there; the best of all if no two have."""
    best = gauss_newton(problem)
    for start in problem.prior.sample(rng, _SEARCHES):
        try:
            other = gauss_newton(problem, start)
        except ValueError:  # the simulation fails there
            continue
        if abs(other.costs[0] - best.costs[0]) < _SAME:
            return best
        best = min(best, other, key=lambda estimate: estimate.costs[0])
    return best
