"""What is known of coefficients, as a mean and a covariance: what one trial passes on to the next.

The posterior of the coefficients, all other parameters integrated out, is taken as normal. A trial with this prior then
ends at the posterior of both trials, if the posterior is normal and the trials share no other unknown.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesub.io.errors import InputError

SMALLEST = 1e-12  # eigenvalue of a matrix of correlations that is written: below, rounding would make it indefinite


@dataclass(frozen=True)
class Knowledge:
    """A normal distribution of coefficients.

    Attributes
    ----------
    names : (n,)
    mean : (n,)
    sd : (n,)
    correlation : (n, n)
    """

    names: tuple[str, ...]
    mean: np.ndarray
    sd: np.ndarray
    correlation: np.ndarray

    @property
    def covariance(self) -> np.ndarray:
        """(n, n)."""
        return self.correlation * np.outer(self.sd, self.sd)

    def part(self, names: Sequence[str]) -> "Knowledge":
        """What is known of some of them, the others integrated out."""
        places = [self.names.index(name) for name in names]
        return Knowledge(tuple(names), self.mean[places], self.sd[places], self.correlation[np.ix_(places, places)])

    def updated(self, new: "Knowledge") -> "Knowledge":
        """The same with what a trial has said of some coefficients, and through these of all that they go with.

        The trial has told nothing of the others directly: given the coefficients of `new` they are what they were, so
        that their means and covariances follow by regression.

        Parameters
        ----------
        new : of some of these coefficients, the posterior of a trial whose prior was their part of this
        """
        (a, b), names = self._split(new.names)
        before, covariance = self.part(new.names), self.covariance
        slopes = np.linalg.solve(before.covariance, covariance[np.ix_(a, b)]).T
        mean, result = self.mean.copy(), covariance.copy()
        mean[a], mean[b] = new.mean, self.mean[b] + slopes @ (new.mean - before.mean)
        result[np.ix_(a, a)] = new.covariance
        result[np.ix_(b, a)] = slopes @ new.covariance
        result[np.ix_(a, b)] = result[np.ix_(b, a)].T
        result[np.ix_(b, b)] += slopes @ (new.covariance - before.covariance) @ slopes.T
        return of_moments(names, mean, result)

    def _split(self, names):
        a = [self.names.index(name) for name in names]
        return (a, [k for k in range(len(self.names)) if k not in a]), self.names


def of_moments(names: Sequence[str], mean: np.ndarray, covariance: np.ndarray) -> Knowledge:
    """That of a mean (n,) and a covariance (n, n)."""
    sd = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(sd, sd)
    return Knowledge(tuple(names), np.asarray(mean), sd, _correlation(correlation))


def of_draws(names: Sequence[str], draws: np.ndarray) -> Knowledge:
    """That of draws (n_draws, n)."""
    return of_moments(names, draws.mean(axis=0), covariance_of_draws(names, draws))


def covariance_of_draws(names: Sequence[str], draws: np.ndarray) -> np.ndarray:
    """The covariance (n, n) of draws (n_draws, n), which has an inverse: widened where it is singular to rounding.

    Raises InputError where a coefficient is the same in all draws.
    """
    covariance = np.atleast_2d(np.cov(draws.T))
    sd = np.sqrt(np.diag(covariance))
    for name in (name for name, one in zip(names, sd, strict=True) if not one > 0.0):
        raise InputError(f"posterior: all draws of '{name}' are the same; sample it again", "data", name)
    if np.linalg.eigvalsh(covariance / np.outer(sd, sd))[0] >= SMALLEST:
        return covariance
    return of_moments(names, draws.mean(axis=0), covariance).covariance


def _correlation(matrix) -> np.ndarray:
    """The matrix, symmetric with ones on its diagonal to the last bit, widened where it is singular to rounding."""
    matrix = 0.5 * (matrix + matrix.T)
    lowest = np.linalg.eigvalsh(matrix)[0]
    if lowest < SMALLEST:
        matrix = matrix + (SMALLEST - lowest) * np.eye(len(matrix))
        matrix = matrix / matrix[0, 0]
    np.fill_diagonal(matrix, 1.0)
    return matrix
