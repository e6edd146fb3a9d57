"""Coverage: how often the intervals of an estimate hold the truth in repeated trials."""

from dataclasses import dataclass

import numpy as np
from scipy import special


@dataclass(frozen=True)
class RepeatedTrials:
    """Normal approximations of independent trials, against the truth of each.

    Attributes
    ----------
    errors : (n_trials, n_params) estimate less truth
    covariances : (n_trials, n_params, n_params)
    """

    errors: np.ndarray
    covariances: np.ndarray

    @property
    def sds(self) -> np.ndarray:
        """(n_trials, n_params) stated standard deviations."""
        return np.sqrt(np.diagonal(self.covariances, axis1=1, axis2=2))

    @property
    def standardised(self) -> np.ndarray:
        """(n_trials, n_params) errors over sds: standard normal, each by itself, if the intervals are right."""
        return self.errors / self.sds

    def held(self, probability: float) -> np.ndarray:
        """(n_trials, n_params) whether the central interval of that probability holds the truth."""
        return np.abs(self.standardised) <= special.ndtri(0.5 + 0.5 * probability)

    def coverage(self, probability: float) -> np.ndarray:
        """(n_params,) share of the trials whose interval holds the truth."""
        return self.held(probability).mean(axis=0)

    def mean_coverage(self, probability: float) -> tuple[float, float]:
        """Coverage averaged over the parameters, and its standard error.

        The parameters of a trial are correlated and the trials are not: the error is that of the mean over trials.
        """
        shares = self.held(probability).mean(axis=1)
        return float(shares.mean()), float(shares.std(ddof=1) / np.sqrt(len(shares)))

    @property
    def joint(self) -> np.ndarray:
        """(n_trials,) squared errors in posterior standard deviations, averaged over all directions; one on average.

        Intervals of single parameters are as wide as their sloppiest direction. This counts the stiff ones as much.
        """
        lower = np.linalg.cholesky(self.covariances / (self.sds[:, :, None] * self.sds[:, None, :]))
        return np.mean(np.linalg.solve(lower, self.standardised[..., None])[..., 0] ** 2, axis=1)


def standard_errors_off(mean_coverage: tuple[float, float], probability: float, n_intervals: int) -> float:
    """Mean coverage less `probability`, in standard errors.

    Parameters
    ----------
    mean_coverage : mean and its standard error (:meth:`RepeatedTrials.mean_coverage`)
    n_intervals : number of intervals; the standard error is at least that of as many independent ones
    """
    mean, error = mean_coverage
    return (mean - probability) / max(error, np.sqrt(probability * (1 - probability) / n_intervals))
