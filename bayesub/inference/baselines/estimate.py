"""The result of a baseline."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bayesub.inference.interface import CostCounter
from bayesub.io.notebook import Displayed

_ARRAYS = ("solutions", "costs", "covariance", "starts", "efforts")


def meter(costs: CostCounter) -> Callable[[], dict]:
    """A function that says what has been spent since now, as an :class:`Estimate` has it."""
    began, simulations, jacobians = time.perf_counter(), costs.simulations, costs.jacobians

    def spent():
        counts = {"evaluations": costs.simulations - simulations, "jacobians": costs.jacobians - jacobians}
        return counts | {"seconds": time.perf_counter() - began}

    return spent


@dataclass(frozen=True)
class Estimate(Displayed):
    """Point estimates from one or more starts."""

    method: str  # name of the baseline
    names: tuple[str, ...]  # (n_params,) parameters
    # (n_starts, n_params) values in the units of the parameters, best first; not a number where the method has found
    # none
    solutions: np.ndarray
    costs: np.ndarray  # (n_starts,) what the method minimised, infinite where it has found nothing
    statuses: tuple[str, ...]  # (n_starts,) in words, with a remedy when the method stopped short
    covariance: np.ndarray | None  # (n_params, n_params) of the best solution, or None where the method has none
    evaluations: int  # simulations, of all starts
    seconds: float  # wall time, of all starts
    # (n_starts, n_params) where the search for each solution began, or None where the method does not search
    starts: np.ndarray | None = None
    efforts: np.ndarray | None = None  # (n_starts,) the simulations and Jacobians that each search took, or None
    jacobians: int = 0  # Jacobians, of all starts

    @property
    def values(self) -> np.ndarray:
        """(n_params,) the best solution."""
        return self.solutions[0]

    def completed(self, guess: dict[str, float]) -> "Estimate":
        """The estimate with the coefficients of `guess` that the method did not see, at the guess."""
        missing = [name for name in guess if name not in self.names]
        guesses = np.tile([guess[name] for name in missing], (len(self.solutions), 1))
        return replace(self, names=(*self.names, *missing), solutions=np.hstack([self.solutions, guesses]))

    def to_json(self) -> dict:
        """Everything as JSON types."""
        return {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in vars(self).items()}

    @classmethod
    def from_json(cls, content: dict) -> "Estimate":
        """The inverse of :meth:`to_json`."""
        arrays = {key: np.array(content[key]) for key in _ARRAYS if content.get(key) is not None}
        tuples = {key: tuple(content[key]) for key in ("names", "statuses")}
        return cls(**content | arrays | tuples)
