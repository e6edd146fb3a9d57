"""What every baseline returns."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Estimate:
    """Point estimates from one or more starts.

    Attributes
    ----------
    method : name of the baseline
    names : (n_params,) coefficients
    solutions : (n_starts, n_params) non-dimensional coefficients, best first
    costs : (n_starts,) what the method minimised
    statuses : (n_starts,) in words, with a remedy when the method stopped short
    covariance : (n_params, n_params) of the best solution, or None where the method has none
    evaluations : simulations, and seconds : wall time, both for all starts
    """

    method: str
    names: tuple[str, ...]
    solutions: np.ndarray
    costs: np.ndarray
    statuses: tuple[str, ...]
    covariance: np.ndarray | None
    evaluations: int
    seconds: float

    @property
    def values(self) -> np.ndarray:
        """(n_params,) the best solution."""
        return self.solutions[0]
