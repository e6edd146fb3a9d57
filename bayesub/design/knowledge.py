"""What is known of coefficients after a trial, as a normal distribution or as draws, and the judge of the next one."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesub.design.judge import Judge
from bayesub.inference.sampling import Posterior
from bayesub.io.errors import InputError
from bayesub.model.vehicles import Vehicle

SMALLEST = 1e-12  # eigenvalue of a matrix of correlations that is written: below, rounding would make it indefinite


@dataclass(frozen=True)
class Knowledge:
    """A normal distribution of coefficients."""

    names: tuple[str, ...]  # (n,)
    mean: np.ndarray  # (n,)
    sd: np.ndarray  # (n,)
    correlation: np.ndarray  # (n, n)

    @property
    def covariance(self) -> np.ndarray:
        """(n, n)."""
        return self.correlation * np.outer(self.sd, self.sd)

    def part(self, names: Sequence[str]) -> "Knowledge":
        """The marginal of some of them."""
        places = [self.names.index(name) for name in names]
        return Knowledge(tuple(names), self.mean[places], self.sd[places], self.correlation[np.ix_(places, places)])

    def updated(self, new: "Knowledge") -> "Knowledge":
        """The same with what a trial has said of some coefficients, and through these of all that they go with.

        The trial does not determine the others directly: given the coefficients of `new` they are what they were, so
        that their means and covariances follow by regression.
        """
        a = [self.names.index(name) for name in new.names]
        b = [k for k in range(len(self.names)) if k not in a]
        before, covariance = self.part(new.names), self.covariance
        slopes = np.linalg.solve(before.covariance, covariance[np.ix_(a, b)]).T
        mean, result = self.mean.copy(), covariance.copy()
        mean[a], mean[b] = new.mean, self.mean[b] + slopes @ (new.mean - before.mean)
        result[np.ix_(a, a)] = new.covariance
        result[np.ix_(b, a)] = slopes @ new.covariance
        result[np.ix_(a, b)] = result[np.ix_(b, a)].T
        result[np.ix_(b, b)] += slopes @ (new.covariance - before.covariance) @ slopes.T
        return of_moments(self.names, mean, result)


def of_moments(names: Sequence[str], mean: np.ndarray, covariance: np.ndarray) -> Knowledge:
    """That of a mean (n,) and a covariance (n, n).

    The correlation is symmetric with ones on its diagonal to the last bit, widened where rounding makes it singular.
    """
    sd = np.sqrt(np.diag(covariance))
    matrix = covariance / np.outer(sd, sd)
    matrix = 0.5 * (matrix + matrix.T)
    lowest = np.linalg.eigvalsh(matrix)[0]
    if lowest < SMALLEST:
        matrix = matrix + (SMALLEST - lowest) * np.eye(len(matrix))
        matrix = matrix / matrix[0, 0]
    np.fill_diagonal(matrix, 1.0)
    return Knowledge(tuple(names), np.asarray(mean), sd, matrix)


def of_draws(names: Sequence[str], draws: np.ndarray) -> Knowledge:
    """That of draws (n_draws, n)."""
    return of_moments(names, draws.mean(axis=0), covariance_of_draws(names, draws))


def covariance_of_draws(names: Sequence[str], draws: np.ndarray) -> np.ndarray:
    """The covariance (n, n) of draws (n_draws, n), which has an inverse: widened where it is singular to rounding.

    Raises InputError where a coefficient is the same in all draws.
    """
    covariance = np.atleast_2d(np.cov(draws.T))
    sd = np.sqrt(np.diag(covariance))
    for name in (name for name, spread in zip(names, np.ptp(draws, axis=0), strict=True) if not spread > 0.0):
        raise InputError(f"posterior: all draws of '{name}' are the same; sample it again", "data", name)
    if np.linalg.eigvalsh(covariance / np.outer(sd, sd))[0] >= SMALLEST:
        return covariance
    return of_moments(names, draws.mean(axis=0), covariance).covariance


@dataclass(frozen=True)
class KnownBefore:
    """The posterior of the coefficients of a run."""

    names: tuple[str, ...]  # the coefficients, n of them
    draws: np.ndarray  # (n_draws, n)

    @classmethod
    def by(cls, posterior: Posterior, vehicle: Vehicle) -> "KnownBefore":
        """That of the coefficients of a vehicle by a posterior."""
        places = [k for k, name in enumerate(posterior.names) if name in vehicle.equations.index]
        return cls(tuple(posterior.names[k] for k in places), posterior.draws[:, places])

    def vehicle(self, vehicle: Vehicle) -> Vehicle:
        """The vehicle of the posterior means."""
        xi = vehicle.xi.copy()
        xi[vehicle.equations.columns(self.names)] = self.draws.mean(axis=0)
        return replace(vehicle, xi=xi)

    def judge(self, judge: Judge) -> Judge:
        """The judge whose prior is the posterior; coefficients of the judge are among those of the posterior."""
        places = [self.names.index(name) for name in judge.names]
        prior_sd = judge.empty().prior_sd
        covariance = covariance_of_draws(judge.names, self.draws[:, places])
        return replace(judge, precision=np.linalg.inv(covariance / np.outer(prior_sd, prior_sd)))

    def sets(self, vehicle: Vehicle, n: int, rng: np.random.Generator) -> np.ndarray:
        """(n, n_terms) coefficient sets of draws."""
        sets = np.tile(vehicle.xi, (n, 1))
        sets[:, vehicle.equations.columns(self.names)] = self.draws[rng.choice(len(self.draws), n)]
        return sets
