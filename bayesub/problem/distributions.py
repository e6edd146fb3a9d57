"""Prior distributions of parameters, and the coordinates in which one searches and samples.

Every distribution is a map from a standard normal vector t to the parameters. Searches work in t, where the prior is
N(0, I): bounds are at infinity, and a direction that the data do not see keeps its prior exactly. The sampler works in
the scaled coordinates x, which differ from t for uniform priors only: these have walls in x, at plus and minus the root
of three. All coordinates of the sampler stand in one table in :mod:`bayesub.inference.sampling`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import wraps
from itertools import count, groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from bayesub.io.equality import ByContent


class Prior(ByContent):
    """Common base of the priors of this module."""

    if TYPE_CHECKING:  # attributes of some priors, properties of others

        @property
        def mean(self) -> np.ndarray:
            """(n_params,) of each parameter by itself."""

        @property
        def sd(self) -> np.ndarray:
            """(n_params,) of each parameter by itself."""

    @property
    def guess(self) -> np.ndarray:
        """(n_params,) values that the prior is about: its means, or the medians of a skew one of coefficients."""
        return self.mean

    def parameters(self, t: np.ndarray) -> np.ndarray:
        """Parameters (..., n_params) of standard normal coordinates t (..., n_params)."""
        raise NotImplementedError

    def standard(self, parameters: np.ndarray) -> np.ndarray:
        """Standard normal coordinates of parameters; not finite outside the support."""
        raise NotImplementedError

    def chain(self, jacobian: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Derivatives with respect to t (n_params,) of what has the Jacobian (n, n_params) in the parameters."""
        raise NotImplementedError

    def scaled(self, parameters: np.ndarray) -> np.ndarray:
        """Parameters (..., n_params) in units in which the prior has a standard deviation of one.

        They are the standard coordinates, but linear in a uniform parameter: those would bend where a bound is near.
        """
        return self.standard(parameters)

    def unscaled(self, x: np.ndarray) -> np.ndarray:
        """Parameters (..., n_params) of such coordinates x."""
        return self.parameters(x)

    def scaled_chain(self, jacobian: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Derivatives with respect to such coordinates x (n_params,) of what has the Jacobian (n, n_params)."""
        return self.chain(jacobian, x)

    def scaled_log_density(self, x: np.ndarray) -> np.ndarray:
        """(n_batch,) log densities in such coordinates x (n_batch, n_params), up to a constant."""
        return -0.5 * np.sum(x**2, axis=-1)

    def scaled_slope(self, x: np.ndarray) -> np.ndarray:
        """(n_batch, n_params) gradient of :meth:`scaled_log_density` within the support."""
        return -x

    def scaled_form(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The density in such coordinates as numbers, for what is compiled.

        Walls (n_params,) are where a uniform parameter ends, on either side, infinite of all others. Stretches
        (n_params,) are of one of a group: of x, how much the parameter grows, in units of its median. Groups
        (n_params,) are the number of the group of parameters whose scale is common and unknown, -1 of all others, and
        scales (n_groups, n_scales) those that it may have, each as probable, and not a number beyond them. Parameters
        without walls and groups are standard normal.
        """
        n = len(self.mean)
        return np.full(n, np.inf), np.zeros(n), np.full(n, -1), np.empty((0, 0))

    def log_density(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch,) log densities of parameters (n_batch, n_params); -inf outside the support."""
        raise NotImplementedError

    def quantiles(self, probability: float) -> np.ndarray:
        """(n_params,) quantile of each parameter by itself."""
        from scipy import special  # in the methods that need it, so that a study file is read without SciPy

        return self.parameters(np.full(len(self.mean), special.ndtri(probability)))

    def found(self, draws: np.ndarray) -> "Prior":
        """What was known before: this prior, an unknown scale as draws (n, n_params) of the posterior say it.

        A scale that the data say narrows the prior of parameters that they do not see, and says nothing about these.
        """
        return self

    def sample(self, rng: np.random.Generator, n: int) -> np.ndarray:
        """(n, n_params) draws."""
        return self.parameters(rng.standard_normal((n, len(self.mean))))


def _log_normal(t) -> np.ndarray:
    return -0.5 * np.sum(t**2, axis=-1) - 0.5 * t.shape[-1] * np.log(2.0 * np.pi)


@dataclass(frozen=True, eq=False)
class Normal(Prior):
    """Independent normal prior: `mean` and `sd`, both (n_params,)."""

    mean: np.ndarray
    sd: np.ndarray

    def parameters(self, t: np.ndarray) -> np.ndarray:
        return self.mean + self.sd * t

    def standard(self, parameters: np.ndarray) -> np.ndarray:
        return (parameters - self.mean) / self.sd

    def chain(self, jacobian: np.ndarray, t: np.ndarray) -> np.ndarray:
        return jacobian * self.sd

    def log_density(self, parameters: np.ndarray) -> np.ndarray:
        return _log_normal(self.standard(parameters)) - np.log(self.sd).sum()


@dataclass(frozen=True, eq=False)
class LogNormal(Prior):
    """Independent log-normal prior: `median` (n_params,), not zero, and `log_sd` (n_params,), sd of the logarithm.

    A parameter has the sign of its median.
    """

    median: np.ndarray
    log_sd: np.ndarray

    @property
    def mean(self) -> np.ndarray:
        return self.median * np.exp(0.5 * self.log_sd**2)

    @property
    def sd(self) -> np.ndarray:
        return np.abs(self.mean) * np.sqrt(np.expm1(self.log_sd**2))

    def parameters(self, t: np.ndarray) -> np.ndarray:
        return self.median * np.exp(self.log_sd * t)

    def standard(self, parameters: np.ndarray) -> np.ndarray:
        ratio = parameters / self.median
        return np.log(np.where(ratio > 0.0, ratio, np.nan)) / self.log_sd

    def chain(self, jacobian: np.ndarray, t: np.ndarray) -> np.ndarray:
        return jacobian * (self.log_sd * self.parameters(t))

    def log_density(self, parameters: np.ndarray) -> np.ndarray:
        log_slopes = np.log(self.log_sd * np.abs(parameters)).sum(axis=-1)
        return np.nan_to_num(_log_normal(self.standard(parameters)) - log_slopes, nan=-np.inf)

    def quantiles(self, probability: float) -> np.ndarray:
        from scipy import special

        t = special.ndtri(probability) * np.sign(self.median)
        return self.parameters(t)


@dataclass(frozen=True, eq=False)
class Uniform(Prior):
    """Independent uniform prior between `lower` and `upper`, both (n_params,)."""

    lower: np.ndarray
    upper: np.ndarray

    @property
    def mean(self) -> np.ndarray:
        return 0.5 * (self.lower + self.upper)

    @property
    def sd(self) -> np.ndarray:
        return (self.upper - self.lower) / np.sqrt(12.0)

    def parameters(self, t: np.ndarray) -> np.ndarray:
        from scipy import special

        return self.lower + (self.upper - self.lower) * special.ndtr(t)

    def standard(self, parameters: np.ndarray) -> np.ndarray:
        from scipy import special

        return special.ndtri((parameters - self.lower) / (self.upper - self.lower))

    def chain(self, jacobian: np.ndarray, t: np.ndarray) -> np.ndarray:
        return jacobian * ((self.upper - self.lower) * np.exp(-0.5 * t**2) / np.sqrt(2.0 * np.pi))

    def scaled(self, parameters: np.ndarray) -> np.ndarray:
        return (parameters - self.mean) / self.sd

    def unscaled(self, x: np.ndarray) -> np.ndarray:
        return self.mean + self.sd * x

    def scaled_chain(self, jacobian: np.ndarray, x: np.ndarray) -> np.ndarray:
        return jacobian * self.sd

    def scaled_log_density(self, x: np.ndarray) -> np.ndarray:
        return np.where(np.all(np.abs(x) <= np.sqrt(3.0), axis=-1), 0.0, -np.inf)

    def scaled_slope(self, x: np.ndarray) -> np.ndarray:
        return np.zeros_like(x)

    def scaled_form(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        return np.full(len(self.lower), np.sqrt(3.0)), *super().scaled_form()[1:]

    def log_density(self, parameters: np.ndarray) -> np.ndarray:
        inside = np.all((parameters >= self.lower) & (parameters <= self.upper), axis=-1)
        return np.where(inside, -np.log(self.upper - self.lower).sum(), -np.inf)


@dataclass(frozen=True, eq=False)
class CorrelatedNormal(Prior):
    """Normal prior with `mean` (n_params,) and the Cholesky `factor` (n_params, n_params) of its covariance."""

    mean: np.ndarray
    factor: np.ndarray

    @property
    def sd(self) -> np.ndarray:
        return np.linalg.norm(self.factor, axis=1)

    def parameters(self, t: np.ndarray) -> np.ndarray:
        return self.mean + t @ self.factor.T

    def standard(self, parameters: np.ndarray) -> np.ndarray:
        return np.linalg.solve(self.factor, (parameters - self.mean)[..., None])[..., 0]

    def chain(self, jacobian: np.ndarray, t: np.ndarray) -> np.ndarray:
        return jacobian @ self.factor

    def log_density(self, parameters: np.ndarray) -> np.ndarray:
        return _log_normal(self.standard(parameters)) - np.log(np.diag(self.factor)).sum()

    def quantiles(self, probability: float) -> np.ndarray:
        from scipy import special

        return self.mean + self.sd * special.ndtri(probability)


def _of_parts(name: str, together: str) -> Callable[..., Any]:
    """The method of a joint prior that has each part say it of its own parameters, the last axis of all arguments."""

    @wraps(getattr(Prior, name))
    def method(joint: "Joint", *arguments: np.ndarray) -> np.ndarray:
        pairs = zip(joint.parts, joint.positions, strict=True)
        of_each = [getattr(part, name)(*(np.asarray(a)[..., own] for a in arguments)) for part, own in pairs]
        return getattr(joint, together)(of_each)

    return method


@dataclass(frozen=True, eq=False)
class Joint(Prior):
    """Independent priors of groups of parameters: `parts`, and for each the (n,) positions of its parameters."""

    parts: tuple[Prior, ...]
    positions: tuple[np.ndarray, ...]

    parameters, standard, chain = (_of_parts(name, "gathered") for name in ("parameters", "standard", "chain"))
    scaled, unscaled, scaled_chain = (_of_parts(name, "gathered") for name in ("scaled", "unscaled", "scaled_chain"))
    scaled_slope = _of_parts("scaled_slope", "gathered")
    log_density, scaled_log_density = (_of_parts(name, "summed") for name in ("log_density", "scaled_log_density"))
    found = _of_parts("found", "like")

    @property
    def mean(self) -> np.ndarray:
        return self.gathered([part.mean for part in self.parts])

    @property
    def sd(self) -> np.ndarray:
        return self.gathered([part.sd for part in self.parts])

    @property
    def guess(self) -> np.ndarray:
        return self.gathered([part.guess for part in self.parts])

    @staticmethod
    def summed(values: Sequence[np.ndarray]) -> np.ndarray:
        """(n_batch,) the sum of those of each part."""
        return sum(values, np.zeros(()))

    def like(self, parts: Sequence[Prior]) -> "Joint":
        """The same of other parts."""
        return Joint(tuple(parts), self.positions)

    def gathered(self, values: Sequence[np.ndarray]) -> np.ndarray:
        """(.., n_params) numbers, of those (.., n) of each part."""
        result = np.empty((*np.shape(values[0])[:-1], sum(len(p) for p in self.positions)))
        for position, value in zip(self.positions, values, strict=True):
            result[..., position] = value
        return result

    def quantiles(self, probability: float) -> np.ndarray:
        return self.gathered([part.quantiles(probability) for part in self.parts])

    def scaled_form(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        walls, stretches, groups, scales = zip(*(part.scaled_form() for part in self.parts), strict=True)
        n_groups, n_scales = np.transpose([each.shape for each in scales])
        before = np.cumsum(n_groups) - n_groups
        numbered = [np.where(own < 0, own, own + first) for own, first in zip(groups, before, strict=True)]
        wide = [np.pad(each, ((0, 0), (0, n_scales.max() - each.shape[1])), constant_values=np.nan) for each in scales]
        together = self.gathered(walls), self.gathered(stretches), self.gathered(numbered).astype(int)
        return *together, np.concatenate(wide)


WHITE = Normal(np.zeros(1), np.ones(1))  # of white coordinates; one object, so that runs of them are found


def joined(coefficient_prior: Prior, nuisance_priors: dict[str, Prior]) -> Prior:
    """The prior of coefficients followed by nuisance parameters."""
    if not nuisance_priors:
        return coefficient_prior
    n = len(coefficient_prior.mean)
    parts, positions, first = [coefficient_prior], [np.arange(n)], n
    numbers = count()
    # Hundreds of white coordinates are one part; all others are one each.
    for _, run in groupby(nuisance_priors.values(), key=lambda prior: -1 if prior is WHITE else next(numbers)):
        prior, *others = run
        length = 1 + len(others)
        parts.append(Normal(np.zeros(length), np.ones(length)) if others else prior)
        positions.append(np.arange(first, first + length))
        first += length
    return Joint(tuple(parts), tuple(positions))
