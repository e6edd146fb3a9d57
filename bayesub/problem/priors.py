"""Priors on the parameters.

Every prior is a map from a standard normal vector t to the parameters, so that whatever samples or searches works in t,
where the prior is N(0, I): bounds are at infinity, and a direction that the data do not see keeps its prior exactly.
"""

from dataclasses import dataclass

import numpy as np
from scipy import special

from bayesub.io.errors import InputError, nearest
from bayesub.model import coefficients


class Prior:
    """What the priors of this module share.

    Attributes
    ----------
    mean, sd : (n_params,) of each parameter by itself
    """

    def parameters(self, t) -> np.ndarray:
        """Parameters (..., n_params) of standard normal coordinates t (..., n_params)."""
        raise NotImplementedError

    def standard(self, parameters) -> np.ndarray:
        """Standard normal coordinates of parameters; not finite outside the support."""
        raise NotImplementedError

    def chain(self, jacobian, t) -> np.ndarray:
        """Derivatives with respect to t (n_params,) of what has the Jacobian (n, n_params) in the parameters."""
        raise NotImplementedError

    def scaled(self, parameters) -> np.ndarray:
        """Parameters (..., n_params) in units in which the prior has a standard deviation of one.

        They are the standard coordinates, but linear in a uniform parameter: those would bend where a bound is near.
        """
        return self.standard(parameters)

    def unscaled(self, x) -> np.ndarray:
        """Parameters (..., n_params) of such coordinates x."""
        return self.parameters(x)

    def scaled_chain(self, jacobian, x) -> np.ndarray:
        """As :meth:`chain`, with respect to such coordinates x (n_params,)."""
        return self.chain(jacobian, x)

    def scaled_log_density(self, x) -> np.ndarray:
        """(n_batch,) log densities in such coordinates x (n_batch, n_params), up to a constant."""
        return -0.5 * np.sum(x**2, axis=-1)

    def scaled_slope(self, x) -> np.ndarray:
        """(n_batch, n_params) gradient of :meth:`scaled_log_density` within the support."""
        return -x

    def log_density(self, parameters) -> np.ndarray:
        """(n_batch,) log densities of parameters (n_batch, n_params); -inf outside the support."""
        raise NotImplementedError

    def quantiles(self, probability: float) -> np.ndarray:
        """(n_params,) quantile of each parameter by itself."""
        return self.parameters(np.full(len(self.mean), special.ndtri(probability)))

    def sample(self, rng: np.random.Generator, n: int) -> np.ndarray:
        """(n, n_params) draws."""
        return self.parameters(rng.standard_normal((n, len(self.mean))))


def _log_normal(t) -> np.ndarray:
    return -0.5 * np.sum(t**2, axis=-1) - 0.5 * t.shape[-1] * np.log(2.0 * np.pi)


@dataclass(frozen=True)
class Normal(Prior):
    """Independent normal prior: `mean` and `sd`, both (n_params,)."""

    mean: np.ndarray
    sd: np.ndarray

    def parameters(self, t):
        return self.mean + self.sd * t

    def standard(self, parameters):
        return (parameters - self.mean) / self.sd

    def chain(self, jacobian, t):  # noqa: ARG002
        return jacobian * self.sd

    def log_density(self, parameters):
        return _log_normal(self.standard(parameters)) - np.log(self.sd).sum()


@dataclass(frozen=True)
class LogNormal(Prior):
    """Independent log-normal prior: `median` (n_params,), not zero, and `log_sd` (n_params,), sd of the logarithm.

    A parameter has the sign of its median.
    """

    median: np.ndarray
    log_sd: np.ndarray

    @property
    def mean(self):
        return self.median * np.exp(0.5 * self.log_sd**2)

    @property
    def sd(self):
        return np.abs(self.mean) * np.sqrt(np.expm1(self.log_sd**2))

    def parameters(self, t):
        return self.median * np.exp(self.log_sd * t)

    def standard(self, parameters):
        ratio = parameters / self.median
        return np.log(np.where(ratio > 0.0, ratio, np.nan)) / self.log_sd

    def chain(self, jacobian, t):
        return jacobian * (self.log_sd * self.parameters(t))

    def log_density(self, parameters):
        log_slopes = np.log(self.log_sd * np.abs(parameters)).sum(axis=-1)
        return np.nan_to_num(_log_normal(self.standard(parameters)) - log_slopes, nan=-np.inf)

    def quantiles(self, probability):
        t = special.ndtri(probability) * np.sign(self.median)
        return self.parameters(t)


@dataclass(frozen=True)
class Uniform(Prior):
    """Independent uniform prior between `lower` and `upper`, both (n_params,)."""

    lower: np.ndarray
    upper: np.ndarray

    @property
    def mean(self):
        return 0.5 * (self.lower + self.upper)

    @property
    def sd(self):
        return (self.upper - self.lower) / np.sqrt(12.0)

    def parameters(self, t):
        return self.lower + (self.upper - self.lower) * special.ndtr(t)

    def standard(self, parameters):
        return special.ndtri((parameters - self.lower) / (self.upper - self.lower))

    def chain(self, jacobian, t):
        return jacobian * ((self.upper - self.lower) * np.exp(-0.5 * t**2) / np.sqrt(2.0 * np.pi))

    def scaled(self, parameters):
        return (parameters - self.mean) / self.sd

    def unscaled(self, x):
        return self.mean + self.sd * x

    def scaled_chain(self, jacobian, x):  # noqa: ARG002
        return jacobian * self.sd

    def scaled_log_density(self, x):
        return np.where(np.all(np.abs(x) <= np.sqrt(3.0), axis=-1), 0.0, -np.inf)

    def scaled_slope(self, x):
        return np.zeros_like(x)

    def log_density(self, parameters):
        inside = np.all((parameters >= self.lower) & (parameters <= self.upper), axis=-1)
        return np.where(inside, -np.log(self.upper - self.lower).sum(), -np.inf)


@dataclass(frozen=True)
class CorrelatedNormal(Prior):
    """Normal prior with `mean` (n_params,) and the Cholesky `factor` (n_params, n_params) of its covariance."""

    mean: np.ndarray
    factor: np.ndarray

    @property
    def sd(self):
        return np.linalg.norm(self.factor, axis=1)

    def parameters(self, t):
        return self.mean + t @ self.factor.T

    def standard(self, parameters):
        return np.linalg.solve(self.factor, (parameters - self.mean)[..., None])[..., 0]

    def chain(self, jacobian, t):  # noqa: ARG002
        return jacobian @ self.factor

    def log_density(self, parameters):
        return _log_normal(self.standard(parameters)) - np.log(np.diag(self.factor)).sum()

    def quantiles(self, probability):
        return self.mean + self.sd * special.ndtri(probability)


@dataclass(frozen=True)
class Joint(Prior):
    """Independent priors of groups of parameters: `parts`, and for each the (n,) positions of its parameters."""

    parts: tuple[Prior, ...]
    positions: tuple[np.ndarray, ...]

    def _gathered(self, values):
        result = np.empty((*np.shape(values[0])[:-1], sum(len(p) for p in self.positions)))
        for position, value in zip(self.positions, values, strict=True):
            result[..., position] = value
        return result

    def _each(self, method, argument):
        pairs = zip(self.parts, self.positions, strict=True)
        return [getattr(part, method)(argument[..., position]) for part, position in pairs]

    @property
    def mean(self):
        return self._gathered([part.mean for part in self.parts])

    @property
    def sd(self):
        return self._gathered([part.sd for part in self.parts])

    def parameters(self, t):
        return self._gathered(self._each("parameters", np.asarray(t)))

    def standard(self, parameters):
        return self._gathered(self._each("standard", np.asarray(parameters)))

    def chain(self, jacobian, t):
        pairs = zip(self.parts, self.positions, strict=True)
        return self._gathered([part.chain(jacobian[..., p], t[p]) for part, p in pairs])

    def scaled(self, parameters):
        return self._gathered(self._each("scaled", np.asarray(parameters)))

    def unscaled(self, x):
        return self._gathered(self._each("unscaled", np.asarray(x)))

    def scaled_chain(self, jacobian, x):
        pairs = zip(self.parts, self.positions, strict=True)
        return self._gathered([part.scaled_chain(jacobian[..., p], x[p]) for part, p in pairs])

    def scaled_log_density(self, x):
        return sum(self._each("scaled_log_density", np.asarray(x)))

    def scaled_slope(self, x):
        return self._gathered(self._each("scaled_slope", np.asarray(x)))

    def log_density(self, parameters):
        return sum(self._each("log_density", np.asarray(parameters)))

    def quantiles(self, probability):
        return self._gathered([part.quantiles(probability) for part in self.parts])


@dataclass(frozen=True)
class Spread:
    """A prior for whatever coefficients are free, by their distance from a centre; see :func:`relative_normal`."""

    kind: str
    spread: float
    centre: np.ndarray | None

    def has_scale(self, columns: np.ndarray, xi: np.ndarray) -> np.ndarray:
        """Whether each coefficient at `columns` has a centre other than zero, from which distances are measured."""
        return self._centre(columns, xi) != 0.0

    def on(self, columns: np.ndarray, xi: np.ndarray) -> Prior:
        """The prior of the coefficients at `columns`, centred on `xi` unless a centre was given."""
        centre = self._centre(columns, xi)
        reach = self.spread * np.abs(centre)
        if self.kind == "uniform":
            return Uniform(centre - reach, centre + reach)
        if self.kind == "log-normal":
            return LogNormal(centre, np.full(len(centre), self.spread))
        return Normal(centre, reach)

    def _centre(self, columns, xi):
        return (xi if self.centre is None else self.centre)[columns].copy()


@dataclass(frozen=True)
class Given:
    """Priors of single coefficients, such as values from a towing tank, and a :class:`Spread` for all others.

    priors : name -> prior of one parameter (:func:`normal`, ..)
    correlations : (name, name, correlation) of coefficients with normal priors
    """

    others: Spread
    priors: dict[str, Prior]
    correlations: tuple[tuple[str, str, float], ...] = ()

    def __post_init__(self):
        for name in self.priors:
            if name not in coefficients.INDEX:
                raise InputError(f"prior: unknown coefficient '{name}'{nearest(name, coefficients.NAMES)}")
        for first, second, correlation in self.correlations:
            for name in (first, second):
                if not isinstance(self.priors.get(name), Normal):
                    raise InputError(f"prior: '{name}' is correlated but is not given a mean and an sd")
            if first == second or not -1.0 < correlation < 1.0:
                raise InputError(
                    f"prior: a correlation is of two coefficients and between -1 and 1, found {correlation} of "
                    f"{first} and {second}"
                )

    def has_scale(self, columns: np.ndarray, xi: np.ndarray) -> np.ndarray:
        """As :meth:`Spread.has_scale`; what is given has a scale."""
        return self.others.has_scale(columns, xi) | np.isin(columns, coefficients.columns(self.priors))

    def on(self, columns: np.ndarray, xi: np.ndarray) -> Prior:
        """The prior of the coefficients at `columns`; raises InputError if the correlations contradict each other."""
        names = [coefficients.NAMES[k] for k in columns]
        related = {name for *pair, _ in self.correlations for name in pair}
        single = {name for name in self.priors if name not in related}
        normal = {name for name in single if isinstance(self.priors[name], Normal)}
        groups = {
            "others": [k for k, name in enumerate(names) if name not in self.priors],
            "related": [k for k, name in enumerate(names) if name in related],
            "normal": [k for k, name in enumerate(names) if name in normal],
        }
        parts, positions = [], []
        if groups["others"]:
            positions.append(np.array(groups["others"]))
            parts.append(self.others.on(columns[positions[-1]], xi))
        if groups["related"]:
            positions.append(np.array(groups["related"]))
            parts.append(self._correlated([names[k] for k in groups["related"]]))
        if groups["normal"]:
            positions.append(np.array(groups["normal"]))
            parts.append(Normal(*self._moments([names[k] for k in groups["normal"]])))
        for k, name in enumerate(names):
            if name in single - normal:
                positions.append(np.array([k]))
                parts.append(self.priors[name])
        return Joint(tuple(parts), tuple(positions))

    def _moments(self, names) -> list[np.ndarray]:
        """Means and standard deviations, both (n,)."""
        return [np.concatenate([getattr(self.priors[name], key) for name in names]) for key in ("mean", "sd")]

    def _correlated(self, names) -> CorrelatedNormal:
        matrix = np.eye(len(names))
        for first, second, correlation in self.correlations:
            if first in names and second in names:
                i, j = names.index(first), names.index(second)
                matrix[i, j] = matrix[j, i] = correlation
        mean, sd = self._moments(names)
        try:
            factor = np.linalg.cholesky(matrix)
        except np.linalg.LinAlgError:
            raise InputError(
                f"prior: the correlations of {', '.join(names)} contradict each other: their matrix is not positive "
                "definite"
            ) from None
        return CorrelatedNormal(mean, sd[:, None] * factor)


def relative_normal(sd: float, centre=None) -> Spread:
    """Normal prior with standard deviation ``sd * |centre|`` for each coefficient.

    Parameters
    ----------
    sd : relative standard deviation, 0.25 for 25 %
    centre : (101,) coefficient set; by default the vehicle's own. A coefficient whose centre is zero has no scale
        and stays fixed.
    """
    return _spread("normal", "sd", sd, centre)


def relative_uniform(half_width: float, centre=None) -> Spread:
    """Uniform prior within ``half_width * |centre|`` of the centre: 0.75 for the bounds of the thesis (section 7.4)."""
    return _spread("uniform", "half_width", half_width, centre)


def relative_log_normal(log_sd: float, centre=None) -> Spread:
    """Log-normal prior with its median at the centre, whose sign the coefficient keeps."""
    return _spread("log-normal", "log_sd", log_sd, centre)


def _spread(kind, key, value, centre):
    _positive(key, value)
    return Spread(kind, float(value), None if centre is None else np.asarray(centre, dtype=float))


def from_vehicle(vehicle, otherwise: Spread | None = None, centre=None) -> Given:
    """Normal priors with the standard deviations of a vehicle file, and `otherwise` for what has none.

    Parameters
    ----------
    vehicle : has `xi` and `sd`, both (101,); an sd that is not a number is not given
    otherwise : such as ``relative_normal(0.25)``; without it a coefficient that has no sd has no scale and stays fixed
    centre : (101,) means of what has an sd; by default the vehicle's `xi`
    """
    mean = vehicle.xi if centre is None else np.asarray(centre, dtype=float)
    given = {coefficients.NAMES[k]: normal(mean[k], vehicle.sd[k]) for k in np.flatnonzero(np.isfinite(vehicle.sd))}
    return Given(otherwise or relative_normal(1.0, np.zeros(len(mean))), given)


def normal(mean: float, sd: float) -> Normal:
    """Normal prior of one parameter."""
    _positive("sd", sd)
    return Normal(np.array([_finite("mean", mean)]), np.array([float(sd)]))


def uniform(lower: float, upper: float) -> Uniform:
    """Uniform prior of one parameter."""
    if not _finite("lower", lower) < _finite("upper", upper):
        raise InputError(f"prior: lower must be below upper, found {lower} and {upper}")
    return Uniform(np.array([float(lower)]), np.array([float(upper)]))


def log_normal(median: float, log_sd: float) -> LogNormal:
    """Log-normal prior of one parameter, such as a standard deviation; it has the sign of `median`."""
    _positive("log_sd", log_sd)
    if _finite("median", median) == 0.0:
        raise InputError("prior: the median of a log-normal prior must not be zero")
    return LogNormal(np.array([float(median)]), np.array([float(log_sd)]))


def _positive(key, value):
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"prior: {key} must be positive, found {value}")


def _finite(key, value) -> float:
    if not np.isfinite(value):
        raise InputError(f"prior: {key} must be a finite number, found {value}")
    return float(value)


def perturbed(xi, sd: float, rng: np.random.Generator) -> np.ndarray:
    """A guess: each coefficient of `xi` times ``1 + sd * standard normal``, with the sign of the original."""
    return xi * np.abs(1.0 + sd * rng.standard_normal(len(xi)))
