"""Priors on the coefficients and nuisance parameters of a problem.

A prior of coefficients (:class:`CoefficientPrior`) is a rule for whatever coefficients are free: a distance from a
centre (:func:`relative_normal`, ..), or values of single coefficients (:func:`from_vehicle`, :class:`Given`). A problem
makes of it the distribution of its free coefficients (:mod:`bayesub.problem.distributions`), and adds the priors of its
nuisance parameters (:func:`normal`, :func:`uniform`, :func:`log_normal`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import SupportsFloat

import numpy as np

from bayesub.io.arguments import check_class
from bayesub.io.equality import ByContent
from bayesub.io.errors import InputError, check_known, error_source
from bayesub.model.equations import EquationSet
from bayesub.model.vehicles import Vehicle
from bayesub.problem.distributions import CorrelatedNormal, Joint, LogNormal, Normal, Prior, Uniform
from bayesub.problem.shared_scale import SharedScale

__all__ = [
    "CoefficientPrior", "CorrelatedNormal", "Given", "Joint", "LogNormal", "Normal", "Prior", "SharedScale", "Spread",
    "Uniform", "from_vehicle", "log_normal", "normal", "perturbed", "relative_hierarchical", "relative_log_normal",
    "relative_normal", "relative_uniform", "uniform",
]  # fmt: skip

# Widths of priors, over the size of what they are about and by themselves: a narrower one is a fixed value, whose
# sensitivities in units of the width are rounding errors, and a wider one says nothing that a number can hold.
NARROWEST, LEAST, WIDEST = 1e-9, 1e-15, 1e15
WIDEST_SPREAD = {"sd": 1e6, "half_width": 1e6, "log_sd": 10.0}  # relative; ten is a factor of 22,000
SCALES = 4.0 ** np.linspace(-1.0, 1.0, 65)  # times the middle one, each as probable, of :func:`relative_hierarchical`


class CoefficientPrior(ByContent):
    """A rule that gives any set of free coefficients its prior: a :class:`Spread`, or :class:`Given` values."""

    def check(self, names: Sequence[str]) -> None:
        """Raise an InputError if the prior is of a coefficient that is not among the `names` of a set's."""

    def has_scale(self, columns: np.ndarray, xi: np.ndarray, equations: EquationSet) -> np.ndarray:
        """Whether each coefficient has a prior of positive width; one without stays fixed.

        `columns` (n,) are the positions of the coefficients in a set, and `xi` (n_terms,) is the one that the prior is
        centred on unless it has a centre of its own. Returned are (n,) booleans.
        """
        raise NotImplementedError

    def on(self, columns: np.ndarray, xi: np.ndarray, equations: EquationSet) -> Prior:
        """The prior of the coefficients at `columns` (n,), parameters as in :meth:`has_scale`."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class Spread(CoefficientPrior):
    """A prior for whatever coefficients are free, by their distance from a centre; see :func:`relative_normal`."""

    kind: str  # "normal", "uniform", "log-normal" or "hierarchical"
    spread: float  # relative standard deviation, half width, or standard deviation of the logarithm
    centre: np.ndarray | None  # (n_terms,) coefficient set, or None for that of the problem
    by_axis: bool = False  # whether a hierarchical prior has a scale for each axis, and not one for all coefficients

    def has_scale(self, columns: np.ndarray, xi: np.ndarray, equations: EquationSet) -> np.ndarray:  # noqa: ARG002
        """Whether each coefficient has a centre that is not zero."""
        return self._centre(columns, xi) != 0.0

    def on(self, columns: np.ndarray, xi: np.ndarray, equations: EquationSet) -> Prior:
        """The prior of the coefficients at `columns` (n,) about their centre."""
        centre = self._centre(columns, xi)
        reach = self.spread * np.abs(centre)
        if self.kind == "uniform":
            return Uniform(centre - reach, centre + reach)
        if self.kind == "log-normal":
            return SharedScale(centre, np.array([self.spread]))
        if self.kind == "hierarchical":
            axes = np.array([equations.terms[k].axis if self.by_axis else "" for k in columns])
            positions = tuple(np.flatnonzero(axes == axis) for axis in dict.fromkeys(axes))
            return Joint(tuple(SharedScale(centre[p], self.spread * SCALES) for p in positions), positions)
        return Normal(centre, reach)

    def _centre(self, columns, xi):
        return (xi if self.centre is None else coefficient_set("centre", self.centre, len(xi)))[columns].copy()


@dataclass(frozen=True, eq=False)
class Given(CoefficientPrior):
    """Priors of single coefficients, such as values from a towing tank, and a :class:`Spread` for all others."""

    others: Spread  # the prior of all other coefficients
    priors: dict[str, Prior]  # name -> prior of one parameter (:func:`normal`, ..)
    correlations: tuple[tuple[str, str, float], ...] = ()  # (name, name, correlation) of normal priors

    def __post_init__(self):
        for name, prior in self.priors.items():
            check_class(f"prior: '{name}'", prior, Prior, key=name)
        for first, second, correlation in self.correlations:
            for name in (first, second):
                if not isinstance(self.priors.get(name), Normal):
                    message = f"prior: '{name}' is correlated but is not given a mean and an sd"
                    raise InputError(message, "missing", name)
            if first == second or not -1.0 < correlation < 1.0:
                fault = "prior: a correlation is of two coefficients and between -1 and 1"
                raise InputError(f"{fault}, found {correlation} of {first} and {second}", "value", "correlations")
        pairs = [" and ".join(sorted(pair)) for *pair, _ in self.correlations]
        if len({*pairs}) < len(pairs):
            twice = max(pairs, key=pairs.count)
            raise InputError(f"prior: {twice} have two correlations; give them one", "conflict", "correlations")

    def check(self, names: Sequence[str]) -> None:
        """Raise an InputError if a prior is given of a coefficient that is not among the `names` of a set's."""
        for name in self.priors:
            check_known(name, names, f"prior: unknown coefficient '{name}'")

    def has_scale(self, columns: np.ndarray, xi: np.ndarray, equations: EquationSet) -> np.ndarray:
        """Whether each coefficient has a scale; what is given has one."""
        given = np.array([equations.names[k] in self.priors for k in columns], dtype=bool)
        return self.others.has_scale(columns, xi, equations) | given

    def on(self, columns: np.ndarray, xi: np.ndarray, equations: EquationSet) -> Prior:
        """The prior of the coefficients at `columns` (n,); InputError if the correlations contradict each other."""
        names = [equations.names[k] for k in columns]
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
            parts.append(self.others.on(columns[positions[-1]], xi, equations))
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
        matrix, place = np.eye(len(names)), {name: k for k, name in enumerate(names)}
        for first, second, correlation in self.correlations:
            if first in place and second in place:
                i, j = place[first], place[second]
                matrix[i, j] = matrix[j, i] = correlation
        mean, sd = self._moments(names)
        try:
            factor = np.linalg.cholesky(matrix)
        except np.linalg.LinAlgError:
            fault = f"prior: the correlations of {', '.join(names)} contradict each other"
            raise InputError(f"{fault}: their matrix is not positive definite", "conflict", "correlations") from None
        return CorrelatedNormal(mean, sd[:, None] * factor)


def relative_normal(sd: float, centre: np.ndarray | None = None) -> Spread:
    """Normal prior with standard deviation ``sd * |centre|`` for each coefficient.

    The `sd` is relative, 0.25 for 25 %. `centre` (n_terms,) is a coefficient set, by default the vehicle's own. A
    coefficient whose centre is zero has no scale and stays fixed.
    """
    return _spread("normal", "sd", sd, centre)


def relative_uniform(half_width: float, centre: np.ndarray | None = None) -> Spread:
    """Uniform prior within ``half_width * |centre|`` of the centre: 0.75 for the bounds of the thesis (section 7.4)."""
    return _spread("uniform", "half_width", half_width, centre)


def relative_log_normal(log_sd: float, centre: np.ndarray | None = None) -> Spread:
    """Log-normal prior with its median at the centre, whose sign the coefficient keeps."""
    return _spread("log-normal", "log_sd", log_sd, centre)


def relative_hierarchical(log_sd: float, centre: np.ndarray | None = None, *, by_axis: bool = False) -> Spread:
    """Log-normal prior about the centre with an unknown sd of the logarithm, the same for all coefficients.

    Its own logarithm is uniform within a factor of four of `log_sd`, and the data say more of it
    (:class:`bayesub.problem.shared_scale.SharedScale`). A coefficient keeps the sign of its centre. `log_sd` says how
    far the guesses may be off, 0.25 for some 25 %; `centre` is as of :func:`relative_normal`, and with `by_axis` each
    axis has an sd of its own.
    """
    return replace(_spread("hierarchical", "log_sd", log_sd, centre), by_axis=by_axis)


def _spread(kind, key, value, centre):
    _check_width(key, value, NARROWEST, WIDEST_SPREAD[key])
    return Spread(kind, float(value), None if centre is None else coefficient_set("centre", centre))


def from_vehicle(vehicle: Vehicle, otherwise: Spread | None = None, centre: np.ndarray | None = None) -> Given:
    """Normal priors with the standard deviations and correlations of a vehicle file, and `otherwise` for the rest.

    Of coefficients that are correlated in the file and of which only some are free, these have the same joint prior:
    the others are integrated out, not held.

    Of the `vehicle` are taken `xi` and `sd`, both (n_terms,), and `correlation`; an sd that is not a number is not
    given. Without `otherwise`, such as ``relative_normal(0.25)``, a coefficient that has no sd has no scale and stays
    fixed. `centre` (n_terms,) are the means of what has an sd; by default the vehicle's `xi`.
    """
    mean = vehicle.xi if centre is None else coefficient_set("centre", centre, len(vehicle.xi))
    names = vehicle.equations.names
    given: dict[str, Prior] = {}
    for k in np.flatnonzero(np.isfinite(vehicle.sd)):
        with error_source(f"coefficient '{names[k]}'"):
            given[names[k]] = normal(mean[k], vehicle.sd[k])
    correlations: tuple[tuple[str, str, float], ...] = ()
    if vehicle.correlation is not None:
        related = np.argwhere(np.triu(vehicle.correlation, 1))
        correlations = tuple((names[i], names[j], float(vehicle.correlation[i, j])) for i, j in related)
    return Given(otherwise or relative_normal(1.0, np.zeros(len(mean))), given, correlations)


def normal(mean: float, sd: float) -> Normal:
    """Normal prior of one parameter."""
    _check_width("sd", sd, _least(_finite("mean", mean)), WIDEST)
    return Normal(np.array([float(mean)]), np.array([float(sd)]))


def uniform(lower: float, upper: float) -> Uniform:
    """Uniform prior of one parameter."""
    if not _finite("lower", lower) < _finite("upper", upper):
        raise InputError(f"prior: lower must be below upper, found {lower} and {upper}", "value", "lower")
    _check_width("upper - lower", upper - lower, _least(max(abs(lower), abs(upper))), WIDEST)
    return Uniform(np.array([float(lower)]), np.array([float(upper)]))


def log_normal(median: float, log_sd: float) -> LogNormal:
    """Log-normal prior of one parameter, such as a standard deviation; it has the sign of `median`."""
    _check_width("log_sd", log_sd, NARROWEST, WIDEST_SPREAD["log_sd"])
    if _finite("median", median) == 0.0:
        raise InputError("prior: the median of a log-normal prior must not be zero", "value", "median")
    _check_width("log_sd times median", abs(median) * log_sd, LEAST, WIDEST)
    return LogNormal(np.array([float(median)]), np.array([float(log_sd)]))


def _least(size: float) -> float:
    """The smallest width of a prior that is about numbers of a size."""
    return max(NARROWEST * abs(size), LEAST)


def _check_width(key: str, value: float, least: float, most: float) -> None:
    if not _finite(key, value) > 0:
        raise InputError(f"prior: {key} must be positive, found {value}", "value", key)
    if value < least:
        message = f"prior: {key} must be at least {least:.3g} here, found {value:g}; what is known better is fixed"
        raise InputError(f"{message}: give its value, or take it out of what is free", "value", key)
    if value > most:
        raise InputError(f"prior: {key} must be at most {most:g}, found {value:g}", "value", key)


def _finite(key, value) -> float:
    if not (isinstance(value, SupportsFloat) and np.ndim(value) == 0 and np.isfinite(float(value))):  # type: ignore[arg-type]
        raise InputError(f"prior: {key} must be a finite number, found {value}", "value", key)
    return float(value)


def perturbed(xi: np.ndarray, sd: float, rng: np.random.Generator) -> np.ndarray:
    """A guess: each coefficient of `xi` times ``1 + sd * standard normal``, with the sign of the original."""
    return coefficient_set("xi", xi) * np.abs(1.0 + sd * rng.standard_normal(len(xi)))


def coefficient_set(key: str, values: object, n: int | None = None) -> np.ndarray:
    """A copy (n,) of what is given for the `key`; InputError unless it is so many finite numbers, or any if None."""
    try:
        numbers = np.array(values, dtype=float)
    except (TypeError, ValueError):
        numbers = np.array(np.nan)
    if numbers.shape != (numbers.size if n is None else n,) or not np.isfinite(numbers).all():
        text = f"{key}: must have a finite number for each coefficient{f', {n}' if n else ''}, as the vehicle's xi has"
        raise InputError(f"{text}; found {np.isfinite(numbers).sum()} in shape {numbers.shape}", "value", key)
    return numbers
