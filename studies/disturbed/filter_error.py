"""The filter-error method: maximum likelihood of the innovations of an extended Kalman filter, with the prior.

It is what aircraft are identified with in turbulence (Jategaonkar 2015, section 5.5), and takes unmodelled forces for
states of the filter. It linearises about what the readings until then tell of these.
"""

import time
from collections.abc import Iterable, Iterator

import numpy as np

from bayesub.inference.baselines.estimate import Estimate
from bayesub.inference.baselines.gauss_newton import gauss_newton
from bayesub.io.errors import InputError
from disturbed.innovations import Innovations, StateSpaceModel

_DRAWS, _SAME = 12, 0.1  # starts from the prior at most; difference of costs that is none


def filter_error(
    model: StateSpaceModel,
    *,
    rng: np.random.Generator,
    starts: Iterable[np.ndarray] = (),
    agreement: int = 2,
) -> Estimate:
    """Estimate the parameters of a random process by Gauss-Newton searches.

    The searches begin at the given starts, in the middle of the prior and at draws of it, until enough that have
    converged agree on the lowest cost.

    Parameters
    ----------
    model : StateSpaceModel
        Such as :class:`disturbed.state_space.StateSpace`.
    rng : numpy.random.Generator
        Source of the draws.
    starts : iterable of (n_params,) arrays
        Such as the posterior mode without unmodelled forces.
    agreement : int
        Searches that are enough.

    Returns
    -------
    Estimate
        Of all searches, best first. The covariance is the inverse of the information of innovations and prior. Costs
        are minus twice the log posterior but for a constant. The status of the best begins with "converged" if it has,
        and goes on if too few searches agree.

    Raises
    ------
    InputError
        If the simulation fails at all starts.
    """
    began, problem, before = time.perf_counter(), Innovations(model), model.costs.simulations
    estimates, begun = [], []
    for start in _starts(problem.prior, starts, rng):
        try:
            estimates.append(gauss_newton(problem, start))
        except ValueError:  # the simulation fails there
            continue
        begun.append(start)
        costs = np.array([estimate.costs[0] for estimate in estimates])
        converged = np.array([estimate.statuses[0].startswith("converged") for estimate in estimates])
        agreed = np.count_nonzero(converged & (costs < costs.min() + _SAME))
        if agreed >= agreement:
            break
    if not estimates:
        raise InputError(
            "filter error: the simulation fails wherever a search may start; narrow the prior", "model", "prior"
        )
    order = np.argsort(costs, kind="stable")
    statuses = [estimates[k].statuses[0] for k in order]
    if agreed < agreement:
        statuses[0] += f"; {agreed} of {len(estimates)} searches agree on it, start nearer or narrow the prior"
    return Estimate(
        method="filter error",
        names=problem.names,
        solutions=np.array([estimates[k].values for k in order]),
        costs=costs[order],
        statuses=tuple(statuses),
        covariance=estimates[order[0]].covariance,
        evaluations=problem.costs.simulations - before,
        seconds=time.perf_counter() - began,
        starts=np.array([begun[k] for k in order]),
        efforts=np.array([estimates[k].evaluations for k in order]),
    )


def _starts(prior, given, rng) -> Iterator[np.ndarray]:
    """The starts that are given, the middle of the prior, and draws of it."""
    yield from (np.asarray(start, dtype=float) for start in given)
    yield prior.parameters(np.zeros(len(prior.mean)))
    yield from prior.sample(rng, _DRAWS)
