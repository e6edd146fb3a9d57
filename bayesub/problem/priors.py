"""Priors on the coefficients and nuisance parameters of a problem.

A prior of coefficients (:class:`CoefficientPrior`) is a rule for whatever coefficients are free: a distance from a
centre (:func:`relative_normal`, ..), or values of single coefficients (:func:`from_vehicle`, :class:`Given`). A problem
makes of it the distribution of its free coefficients (:mod:`bayesub.problem.distributions`), and adds the priors of its
nuisance parameters (:func:`normal`, :func:`uniform`, :func:`log_normal`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesub.io.errors import InputError, nearest
from bayesub.model.vehicles import Vehicle
from bayesub.problem.distributions import CorrelatedNormal, Joint, LogNormal, Normal, Prior, Uniform

__all__ = [
    "CoefficientPrior",
    "CorrelatedNormal",
    "Given",
    "Joint",
    "LogNormal",
    "Normal",
    "Prior",
    "Spread",
    "Uniform",
    "from_vehicle",
    "log_normal",
    "normal",
    "perturbed",
    "relative_log_normal",
    "relative_normal",
    "relative_uniform",
    "uniform",
]


class CoefficientPrior:
    """A rule that gives any set of free coefficients its prior: a :class:`Spread`, or :class:`Given` values."""

    def check(self, names: Sequence[str]) -> None:
        """Raise an InputError if the prior is of a coefficient that is not among the `names` of a set's."""

    def has_scale(self, columns: np.ndarray, xi: np.ndarray, names: Sequence[str]) -> np.ndarray:
        """Whether each coefficient has a prior of positive width; one without stays fixed.

        Parameters
        ----------
        columns : (n,) positions of the coefficients in a set
        xi : (n_terms,) coefficient set that the prior is centred on unless it has a centre of its own
        names : names of all coefficients of the set

        Returns
        -------
        (n,) booleans
        """
        raise NotImplementedError

    def on(self, columns: np.ndarray, xi: np.ndarray, names: Sequence[str]) -> Prior:
        """The prior of the coefficients at `columns` (n,), parameters as in :meth:`has_scale`."""
        raise NotImplementedError


@dataclass(frozen=True)
class Spread(CoefficientPrior):
    """A prior for whatever coefficients are free, by their distance from a centre; see :func:`relative_normal`.

    Attributes
    ----------
    kind : "normal", "uniform" or "log-normal"
    spread : relative standard deviation, half width, or standard deviation of the logarithm
    centre : (n_terms,) coefficient set, or None for that of the problem
    """

    kind: str
    spread: float
    centre: np.ndarray | None

    def has_scale(self, columns: np.ndarray, xi: np.ndarray, names: Sequence[str] = ()) -> np.ndarray:  # noqa: ARG002
        """As :meth:`CoefficientPrior.has_scale`; a centre of zero gives none."""
        return self._centre(columns, xi) != 0.0

    def on(self, columns: np.ndarray, xi: np.ndarray, names: Sequence[str] = ()) -> Prior:  # noqa: ARG002
        """As :meth:`CoefficientPrior.on`; the names are not needed."""
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
class Given(CoefficientPrior):
    """Priors of single coefficients, such as values from a towing tank, and a :class:`Spread` for all others.

    Attributes
    ----------
    others : the prior of all other coefficients
    priors : name -> prior of one parameter (:func:`normal`, ..)
    correlations : (name, name, correlation) of coefficients with normal priors
    """

    others: Spread
    priors: dict[str, Prior]
    correlations: tuple[tuple[str, str, float], ...] = ()

    def __post_init__(self):
        for first, second, correlation in self.correlations:
            for name in (first, second):
                if not isinstance(self.priors.get(name), Normal):
                    raise InputError(f"prior: '{name}' is correlated but is not given a mean and an sd")
            if first == second or not -1.0 < correlation < 1.0:
                raise InputError(
                    f"prior: a correlation is of two coefficients and between -1 and 1, found {correlation} of "
                    f"{first} and {second}"
                )

    def check(self, names: Sequence[str]) -> None:
        """As :meth:`CoefficientPrior.check`."""
        for name in self.priors:
            if name not in names:
                raise InputError(f"prior: unknown coefficient '{name}'{nearest(name, names)}")

    def has_scale(self, columns: np.ndarray, xi: np.ndarray, names: Sequence[str]) -> np.ndarray:
        """As :meth:`CoefficientPrior.has_scale`; what is given has a scale."""
        return self.others.has_scale(columns, xi) | np.array([names[k] in self.priors for k in columns], dtype=bool)

    def on(self, columns: np.ndarray, xi: np.ndarray, names: Sequence[str]) -> Prior:
        """As :meth:`CoefficientPrior.on`; raises InputError if the correlations contradict each other."""
        names = [names[k] for k in columns]
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


def relative_normal(sd: float, centre: np.ndarray | None = None) -> Spread:
    """Normal prior with standard deviation ``sd * |centre|`` for each coefficient.

    Parameters
    ----------
    sd : relative standard deviation, 0.25 for 25 %
    centre : (n_terms,) coefficient set; by default the vehicle's own. A coefficient whose centre is zero has no scale
        and stays fixed.
    """
    return _spread("normal", "sd", sd, centre)


def relative_uniform(half_width: float, centre: np.ndarray | None = None) -> Spread:
    """Uniform prior within ``half_width * |centre|`` of the centre: 0.75 for the bounds of the thesis (section 7.4)."""
    return _spread("uniform", "half_width", half_width, centre)


def relative_log_normal(log_sd: float, centre: np.ndarray | None = None) -> Spread:
    """Log-normal prior with its median at the centre, whose sign the coefficient keeps."""
    return _spread("log-normal", "log_sd", log_sd, centre)


def _spread(kind, key, value, centre):
    _positive(key, value)
    return Spread(kind, float(value), None if centre is None else np.asarray(centre, dtype=float))


def from_vehicle(vehicle: Vehicle, otherwise: Spread | None = None, centre: np.ndarray | None = None) -> Given:
    """Normal priors with the standard deviations of a vehicle file, and `otherwise` for what has none.

    Parameters
    ----------
    vehicle : has `xi` and `sd`, both (n_terms,); an sd that is not a number is not given
    otherwise : such as ``relative_normal(0.25)``; without it a coefficient that has no sd has no scale and stays fixed
    centre : (n_terms,) means of what has an sd; by default the vehicle's `xi`
    """
    mean = vehicle.xi if centre is None else np.asarray(centre, dtype=float)
    names = vehicle.equations.names
    given = {names[k]: normal(mean[k], vehicle.sd[k]) for k in np.flatnonzero(np.isfinite(vehicle.sd))}
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


def perturbed(xi: np.ndarray, sd: float, rng: np.random.Generator) -> np.ndarray:
    """A guess: each coefficient of `xi` times ``1 + sd * standard normal``, with the sign of the original."""
    return xi * np.abs(1.0 + sd * rng.standard_normal(len(xi)))
