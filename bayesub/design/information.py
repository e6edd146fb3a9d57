"""What a trial will tell of the coefficients, before it is flown: expected standard deviations, criteria and goals.

All matrices are in prior standard deviations of the coefficients, so that the prior precision is the identity unless an
earlier trial has narrowed it. Criteria are those of optimal experiment design (Goodwin & Payne 1977, Morelli 2016).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import linalg, special

Goal = Callable[["Information"], float]  # of what makes it small, the least is the best
SHARPNESS = 4.0  # with which the count of known coefficients falls about the share that is asked for
FALSE_ALARMS = 0.01  # of telling a boat from a rival
SHARES = (0.05, 0.10, 0.25)  # of the value, to which coefficients are counted as known


@dataclass(frozen=True)
class Information:
    """Expected information of readings on coefficients, in the normal approximation."""

    names: tuple[str, ...]  # the n coefficients
    values: np.ndarray  # (n,), where they were taken, in the units of their names
    prior_sd: np.ndarray  # (n,), the unit of all matrices
    precision: np.ndarray  # (n, n), of the prior, the identity if it knows no correlation
    gram: np.ndarray  # (n, n), Fisher information of the readings, all else integrated out
    apart: float = 0.0  # squared distance, in sds of the noise, from the readings of a rival boat that fits best

    def __add__(self, other: "Information") -> "Information":
        """The joint information of two independent trials of the same boat; a rival may fit each for itself."""
        return replace(self, gram=self.gram + other.gram, apart=self.apart + other.apart)

    @cached_property
    def _factor(self) -> np.ndarray:
        return linalg.cholesky(self.precision + self.gram, lower=True)

    @cached_property
    def covariance(self) -> np.ndarray:
        """(n, n) expected posterior covariance, in prior sds."""
        return linalg.cho_solve((self._factor, True), np.eye(len(self.names)))

    @property
    def posterior_sd(self) -> np.ndarray:
        """(n,) expected posterior standard deviations, in the units of the coefficients."""
        return self.prior_sd * np.sqrt(np.diag(self.covariance))

    @property
    def relative_sd(self) -> np.ndarray:
        """(n,) expected posterior standard deviations over the size of the values, infinite of what is zero."""
        with np.errstate(divide="ignore"):
            return self.posterior_sd / np.abs(self.values)

    def n_known(self, share: float) -> int:
        """Number of coefficients with an expected posterior sd of at most a share of their value."""
        return int(np.count_nonzero(self.relative_sd <= share))

    @cached_property
    def singular_values(self) -> np.ndarray:
        """(n,) descending: along a direction with s the data alone have an sd of 1/s of the prior's.

        They follow from the information, and those below 1e-8 of the largest are rounding errors.
        """
        lower = linalg.cholesky(self.precision, lower=True)
        white = linalg.solve_triangular(lower, linalg.solve_triangular(lower, self.gram, lower=True).T, lower=True)
        return np.sqrt(np.maximum(np.linalg.eigvalsh(white)[::-1], 0.0))

    @property
    def n_sharper(self) -> int:
        """Number of directions that the data determine better than the prior."""
        return int(np.count_nonzero(self.singular_values > 1.0))

    @property
    def d_optimality(self) -> float:
        """Mean logarithm of the posterior over the prior sd along the principal directions."""
        factors = linalg.cholesky(self.precision), self._factor
        before, after = (2.0 * np.log(np.diag(factor)).sum() for factor in factors)  # logarithms of determinants
        return 0.5 * (before - after) / len(self.names)

    @property
    def a_optimality(self) -> float:
        """Mean posterior variance of the coefficients over that of the prior."""
        before = np.diag(linalg.inv(self.precision))
        return float(np.mean(np.diag(self.covariance) / before))

    def e_optimality(self, n_null: int) -> float:
        """Largest posterior over prior sd along a direction that is not one of `n_null` null directions."""
        return float(1.0 / np.sqrt(1.0 + self.singular_values[len(self.names) - 1 - n_null] ** 2))

    def sd_of(self, gradient: np.ndarray) -> float:
        """Expected posterior sd of a quantity with a gradient (n,) by the coefficients, in its own unit."""
        scaled = gradient * self.prior_sd
        return float(np.sqrt(scaled @ self.covariance @ scaled))

    def prior_sd_of(self, gradient: np.ndarray) -> float:
        """As :meth:`sd_of`, before the trial."""
        scaled = gradient * self.prior_sd
        return float(np.sqrt(scaled @ np.linalg.solve(self.precision, scaled)))

    @property
    def power(self) -> float:
        """Probability that a test which takes one boat in a hundred for its rival tells the boat from it.

        Of the ratio of likelihoods, whose logarithm is normal with the variance :attr:`apart` either way.
        """
        return float(special.ndtr(np.sqrt(self.apart) + special.ndtri(FALSE_ALARMS)))

    def with_known(self, members: Sequence[int], relative_sd: float) -> "Information":
        """The same if some coefficients, by position, had been measured to a relative sd besides."""
        precision = self.precision.copy()
        for k in members:
            precision[k, k] += (self.prior_sd[k] / (relative_sd * abs(self.values[k]))) ** 2
        return replace(self, precision=precision)


class Known:
    """Minus the number of coefficients known to a share of their value, smooth so that a search sees where it rises."""

    def __init__(self, share: float):
        self.share = share

    def __call__(self, information: Information) -> float:
        """Minus the sum of 1 / (1 + (sd / share)^4)."""
        with np.errstate(over="ignore"):
            return -float(np.sum(1.0 / (1.0 + (information.relative_sd / self.share) ** SHARPNESS)))


def d_optimality(information: Information) -> float:
    """Logarithm of the volume of the posterior (:attr:`Information.d_optimality`)."""
    return information.d_optimality


def a_optimality(information: Information) -> float:
    """Logarithm of the mean variance."""
    return float(np.log(information.a_optimality))


def distance(information: Information) -> float:
    """Minus the logarithm of the distance from a rival, in sds."""
    return -0.5 * float(np.log(max(information.apart, np.finfo(float).tiny)))


class EOptimality:
    """Logarithm of the sd of the least known direction that is not null."""

    def __init__(self, n_null: int):
        self.n_null = n_null

    def __call__(self, information: Information) -> float:
        """Logarithm of :meth:`Information.e_optimality`."""
        return float(np.log(information.e_optimality(self.n_null)))


class Sharpest:
    """Mean logarithm of the sds of some coefficients and quantities over those before the trial."""

    def __init__(self, gradients: Sequence[np.ndarray]):
        self.gradients = gradients

    def __call__(self, information: Information) -> float:
        """Mean of log(sd after / sd before)."""
        return float(np.mean([np.log(information.sd_of(g) / information.prior_sd_of(g)) for g in self.gradients]))
