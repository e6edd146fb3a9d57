"""A search for the posterior mode that follows it from the prior: for long records, unstable boats and far starts.

The posterior ``prior * likelihood^(1/s^2)`` is that of noise s times as large. With a large s it has one mode, near the
prior; as s falls to one, its mode moves to that of the posterior, and each search starts where the one before has ended
(continuation: Allgower & Georg 1990; likelihoods with a power: Friel & Pettitt 2008). The record is lengthened as well:
the first search is with an eighth of it, or less where the boat does not complete that, and the part doubles.

On an unstable ship and a record of an hour Gauss-Newton from 13 starts ended at a chi-square of 34 a reading,
continuation with the whole record at two million, and with an eighth first at 1.24, in a fifth of the time.
"""

from dataclasses import replace

import numpy as np

from bayesub.baselines.estimate import Estimate
from bayesub.baselines.gauss_newton import gauss_newton
from bayesub.identifiability.interface import InferenceProblem

METHOD = "posterior mode by continuation"
_FALL = 2.0  # of the scale of the noise from one search to the next
_HALVINGS, _MOST_HALVINGS = 3, 7  # of the record before the first search, and where that is not completed
_LAST = 200  # iterations of the last search


class Tempered:
    """A problem with its log likelihood over the square of `scale`, for searches by Gauss-Newton."""

    def __init__(self, problem: InferenceProblem, scale: float):
        self.problem, self.scale = problem, scale
        self.names, self.n_params, self.prior = problem.names, problem.n_params, problem.prior

    @property
    def costs(self):
        """Those of the problem."""
        return self.problem.costs

    def misfit(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals and deviances of noise that is so many times as large."""
        residuals, deviances = self.problem.misfit(parameters)
        return residuals / self.scale, deviances / self.scale**2

    def jacobian(self, parameters: np.ndarray) -> np.ndarray:
        """Derivatives of these residuals."""
        return self.problem.jacobian(parameters) / self.scale


def continuation(problem: InferenceProblem, start: np.ndarray | None = None) -> Estimate:
    """The posterior mode, followed from large noise and a short record to those of the problem.

    Parameters
    ----------
    problem : InferenceProblem
        One without the method ``within`` (:class:`bayesub.problem.trial_problem.TrialProblem`) has its whole record in
        all searches.
    start : (n_params,) array, optional
        By default the middle of the prior.

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
        for scale in _scales(part, values):
            n = _LAST if part is problem and scale == 1.0 else 60
            estimate = gauss_newton(Tempered(part, scale), values, max_iterations=n)
            values, seconds = estimate.values, seconds + estimate.seconds
    simulations, jacobians = problem.costs.simulations - before[0], problem.costs.jacobians - before[1]
    return replace(estimate, method=METHOD, evaluations=simulations, jacobians=jacobians, seconds=seconds)


def _parts(problem, values):
    """The problem of parts of the record, each twice as long as the one before, from one that is completed."""
    if not hasattr(problem, "within"):
        return [problem]
    parts = [problem]
    for halvings in range(1, _MOST_HALVINGS + 1):
        if halvings > _HALVINGS and np.isfinite(_deviance(parts[0], values)):
            break
        parts.insert(0, problem.within(problem.duration / 2.0**halvings))
    return parts


def _scales(part, values):
    """Falling scales of the noise: from that with which the values would fit, down to one."""
    deviance, n = _deviance(part, values), part.jacobian(values).shape[0]
    largest = max(1.0, np.sqrt(deviance / n)) if np.isfinite(deviance) else 1.0
    n_falls = int(np.ceil(np.log(largest) / np.log(_FALL)))
    return _FALL ** np.arange(n_falls, -1.0, -1.0)


def _deviance(problem, values) -> float:
    return float(problem.misfit(values[None])[1][0])
