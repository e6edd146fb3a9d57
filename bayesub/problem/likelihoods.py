"""Noise of the readings of one channel: log likelihoods, whitening for Gauss-Newton, and simulated readings.

Every noise model has the same methods. `predicted` is (n_batch, n), the noise-free readings of each member, not a
number where its simulation failed; `readings` and `times` (s) are (n,). Arrays that are contiguous are not copied.

- ``log_density(predicted, readings, times)`` is (n_batch,), minus infinity for failed simulations.
- ``residuals(predicted, readings, times)`` is (n_batch, n) and ``weigh(jacobian, predicted, readings, times)``, of the
  derivatives (n, p) of one member's predictions (n,), is (n, p): residuals z and weighed derivatives J such that J'z is
  the gradient of minus the log density and J'J its expected or observed information. For normal noise -|z|^2 / 2 is
  the log density but for a constant; for the others it is not, and a search must compare log densities.
- ``quantile_residuals(predicted, readings, times, rng)`` is (n_batch, n): the standard normal quantiles of the
  probabilities of what is below each reading, given those before it; standard normal and independent at the truth. An
  unknown sd, and where in its rounding interval a reading was, are drawn from `rng`. SetMembership has none.
- ``sample(truth, times, rng)`` is (n,): readings of the motion `truth` (n,).

The attributes of a noise model that may be unknown are its SAMPLED. Given by their names to ``log_density`` or
``residuals`` as (n_batch,), or to ``weigh`` as numbers, they take the place of the model's own; one that is not
positive has density zero. :func:`scale_rows` are the further rows of residuals and derivatives for them.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import gammaln, log_ndtr, ndtri, ndtri_exp, stdtr

from bayesub.io.errors import InputError
from bayesub.kernels import noise as kernel

_LOG_2_PI = math.log(2.0 * math.pi)
_LOG_STEP = 1e-4  # of differences by logarithms: second ones are then good to 1e-8 of a log density
_LEAST_INFORMATION = 1e-3  # next to a prior's, which is about one


def reading_noise(sd: float, resolution: float = 0.0) -> "Normal | Rounded | SetMembership":
    """The noise of a sensor with normal errors of `sd` that writes down multiples of `resolution`; either may be 0.

    Raises InputError if both are zero or one is negative.
    """
    _not_negative("sd", sd)
    _not_negative("resolution", resolution)
    if sd == 0 and resolution == 0:
        raise InputError("noise: sd and resolution are both zero; exact readings have no likelihood, give one of them")
    if resolution == 0:
        return Normal(sd)
    return Rounded(sd, resolution) if sd > 0 else SetMembership(resolution)


@dataclass(frozen=True)
class Normal:
    """Independent normal noise of standard deviation `sd`, in the unit of the readings."""

    SAMPLED = ("sd",)

    sd: float

    def __post_init__(self):
        _positive("sd", self.sd)

    def log_density(self, predicted, readings, times=None, sd=None) -> np.ndarray:
        predicted, readings = _aligned(predicted, readings, times)
        sd = _of_members(_chosen(sd, self.sd), len(predicted))
        squares = kernel.sums_of_squares(predicted, readings)
        return _possible(-0.5 * squares / sd**2 - len(readings) * (np.log(sd) + 0.5 * _LOG_2_PI))

    def residuals(self, predicted, readings, times=None, sd=None) -> np.ndarray:
        """(predicted - reading) / sd."""
        return _standardised(predicted, readings, times, _chosen(sd, self.sd))

    def weigh(self, jacobian, predicted, readings, times=None, sd=None) -> np.ndarray:
        """jacobian / sd, of which the expected and the observed information are the square."""
        return jacobian / _chosen(sd, self.sd)

    def quantile_residuals(self, predicted, readings, times, rng: np.random.Generator, sd=None) -> np.ndarray:
        """(reading - predicted) / sd."""
        return -self.residuals(predicted, readings, times, sd)

    def sample(self, truth, times, rng: np.random.Generator) -> np.ndarray:
        return truth + self.sd * rng.standard_normal(len(truth))


@dataclass(frozen=True)
class UnknownSd:
    """Independent normal noise whose standard deviation is integrated out under the prior density 1/sd:

        log p = log Gamma(n/2) - log 2 - n/2 log(pi sum_i (predicted_i - reading_i)^2),

    infinite if every reading is met exactly. `sd` is a guess of it, with which readings are drawn and pictures drawn.
    """

    SAMPLED = ()

    sd: float

    def __post_init__(self):
        _positive("sd", self.sd)

    def log_density(self, predicted, readings, times=None) -> np.ndarray:
        predicted, readings = _aligned(predicted, readings, times)
        half_n = 0.5 * len(readings)
        squares = kernel.sums_of_squares(predicted, readings)
        with np.errstate(divide="ignore"):
            return _possible(gammaln(half_n) - math.log(2.0) - half_n * np.log(math.pi * squares))

    def residuals(self, predicted, readings, times=None) -> np.ndarray:
        """(predicted - reading) over the root of their mean square; zero where every reading is met exactly."""
        errors = _standardised(predicted, readings, times, 1.0)
        sizes = self._sizes(errors)
        return np.divide(errors, sizes, out=np.zeros_like(errors), where=sizes != 0)

    def weigh(self, jacobian, predicted, readings, times=None) -> np.ndarray:
        """jacobian over the root of the mean square of (predicted - reading)."""
        return jacobian / self._sizes(_standardised(np.asarray(predicted)[None], readings, times, 1.0))

    def quantile_residuals(self, predicted, readings, times, rng: np.random.Generator) -> np.ndarray:
        """(reading - predicted) / sd with an sd drawn given the predictions: of n readings, their squares sum to
        chi-square with n degrees of freedom whatever they are.
        """
        relative = np.sqrt(rng.chisquare(len(readings), (len(predicted), 1)) / len(readings))
        return -self.residuals(predicted, readings, times) * relative

    @staticmethod
    def _sizes(errors):
        return np.sqrt(np.mean(errors**2, axis=1, keepdims=True))

    def sample(self, truth, times, rng: np.random.Generator) -> np.ndarray:
        return Normal(self.sd).sample(truth, times, rng)


@dataclass(frozen=True)
class Rounded:
    """Readings rounded to the nearest multiple of `resolution` after normal noise of `sd`, both in their unit.

    A reading y is the interval of values that round to it, and its density is the probability of that interval,

        p(y) = Phi((y + resolution/2 - predicted) / sd) - Phi((y - resolution/2 - predicted) / sd),

    (model section 11), in the limit of a small resolution the normal density times the resolution.

    The information is the observed one, minus the second derivative of log p by the prediction. In units of 1/sd^2 it
    is one minus the variance of a standard normal truncated to the interval, hence between zero and one: zero where
    the prediction lies far inside the interval, one far outside. The expected information at a given prediction
    vanishes between the edges even if the reading is from another interval, and its mean over all offsets of the
    prediction within the interval tells a search outside nothing of the walls, which are 1/sd^2 steep.
    """

    SAMPLED = ("sd",)

    sd: float
    resolution: float

    def __post_init__(self):
        _not_negative("sd", self.sd)
        _not_negative("resolution", self.resolution)
        if self.sd == 0 and self.resolution == 0:
            raise InputError("noise: sd and resolution are both zero; exact readings have no likelihood")
        if self.sd == 0:
            raise InputError("noise: sd is zero with a resolution; that is the noise SetMembership")
        if self.resolution == 0:
            raise InputError("noise: resolution is zero; that is the noise Normal")

    def log_density(self, predicted, readings, times=None, sd=None) -> np.ndarray:
        predicted, readings = _aligned(predicted, readings, times)
        sd = _of_members(_chosen(sd, self.sd), len(predicted))
        return _possible(kernel.rounded_log_probabilities(predicted, readings, 0.5 * self.resolution, sd))

    def residuals(self, predicted, readings, times=None, sd=None) -> np.ndarray:
        """Derivative of minus log p by the prediction, over the root of the information; zero where that vanishes."""
        slopes, roots = self._slopes(predicted, readings, times, sd)
        return np.divide(slopes, roots, out=np.zeros_like(slopes), where=roots != 0)

    def weigh(self, jacobian, predicted, readings, times=None, sd=None) -> np.ndarray:
        """jacobian times the root of the observed information."""
        _, roots = self._slopes(np.asarray(predicted)[None], readings, times, sd)
        return jacobian * (roots[0] / _chosen(sd, self.sd))[:, None]

    def quantile_residuals(self, predicted, readings, times, rng: np.random.Generator, sd=None) -> np.ndarray:
        """Draws from the standard normal distribution truncated to the interval of each reading."""
        predicted, readings = _aligned(predicted, readings, times)
        scale = _column(_chosen(sd, self.sd))
        middle = (readings - predicted) / scale
        below = -np.abs(middle)  # reflected, as far tails are exact on the lower side only
        upper, lower = (log_ndtr(below + side * self.resolution / scale) for side in (0.5, -0.5))
        share = rng.random(predicted.shape)
        drawn = ndtri_exp(upper + np.log(share + (1.0 - share) * np.exp(lower - upper)))
        return np.where(middle > 0, -drawn, drawn)

    def _slopes(self, predicted, readings, times, sd):
        predicted, readings = _aligned(predicted, readings, times)
        sd = _of_members(_chosen(sd, self.sd), len(predicted))
        slopes, information = kernel.rounded_slopes(predicted, readings, 0.5 * self.resolution, sd)
        return slopes, np.sqrt(information)

    def sample(self, truth, times, rng: np.random.Generator) -> np.ndarray:
        return _rounded(truth + self.sd * rng.standard_normal(len(truth)), self.resolution)


@dataclass(frozen=True)
class SetMembership:
    """Exact values rounded to the nearest multiple of `resolution`: :class:`Rounded` in the limit of sd zero.

    The density is one if every prediction lies in the interval that rounds to its reading and zero otherwise. Having
    no gradient, it has for residuals the distances to the intervals in units of half the resolution: a least-squares
    search that brings them to zero has found a feasible prediction. There is no sd to override.
    """

    SAMPLED = ()

    resolution: float

    def __post_init__(self):
        _positive("resolution", self.resolution)

    def log_density(self, predicted, readings, times=None) -> np.ndarray:
        predicted, readings = _aligned(predicted, readings, times)
        inside = np.abs(predicted - readings) <= self._half_width(readings)
        return np.where(inside.all(axis=1), 0.0, -np.inf)

    def residuals(self, predicted, readings, times=None) -> np.ndarray:
        """Signed distance from the interval over resolution / 2; zero inside."""
        return self._excess(*_aligned(predicted, readings, times)) / (0.5 * self.resolution)

    def weigh(self, jacobian, predicted, readings, times=None) -> np.ndarray:
        """jacobian over resolution / 2 where the prediction is outside its interval; zero inside."""
        outside = self._excess(np.asarray(predicted), readings) != 0
        return jacobian * (outside / (0.5 * self.resolution))[:, None]

    def _excess(self, predicted, readings):
        distance = predicted - readings
        return np.sign(distance) * np.maximum(np.abs(distance) - self._half_width(readings), 0.0)

    def _half_width(self, readings):
        # The intervals are closed; their ends are known to the rounding of the reading, a multiple of the resolution.
        return 0.5 * self.resolution + np.finfo(float).eps * np.abs(readings)

    def sample(self, truth, times, rng: np.random.Generator) -> np.ndarray:
        return _rounded(np.asarray(truth), self.resolution)


@dataclass(frozen=True)
class StudentT:
    """Independent noise with the t distribution of `dof` degrees of freedom and scale `sd`: normal with outliers.

    The standard deviation is sd sqrt(dof / (dof - 2)) if dof > 2, and infinite otherwise.
    """

    SAMPLED = ("sd", "dof")

    sd: float
    dof: float

    def __post_init__(self):
        _positive("sd", self.sd)
        _positive("dof", self.dof)

    def log_density(self, predicted, readings, times=None, sd=None, dof=None) -> np.ndarray:
        predicted, readings = _aligned(predicted, readings, times)
        sd, dof = (_of_members(_chosen(*pair), len(predicted)) for pair in ((sd, self.sd), (dof, self.dof)))
        logarithms = kernel.student_t_logarithms(predicted, readings, sd, dof)
        half = 0.5 * (dof + 1.0)
        constant = gammaln(half) - gammaln(0.5 * dof) - 0.5 * np.log(math.pi * dof)
        return _possible(len(readings) * (constant - np.log(sd)) - half * logarithms)

    def residuals(self, predicted, readings, times=None, sd=None, dof=None) -> np.ndarray:
        """(dof + 1) z / (dof + z^2) over the root of the expected information, z = (predicted - reading) / sd."""
        z, dof = _standardised(predicted, readings, times, _chosen(sd, self.sd)), _column(_chosen(dof, self.dof))
        return np.sqrt((dof + 1.0) * (dof + 3.0)) * z / (dof + z * z)

    def weigh(self, jacobian, predicted, readings, times=None, sd=None, dof=None) -> np.ndarray:
        """jacobian times the root of the expected information, (dof + 1) / (dof + 3) / sd^2."""
        dof = _chosen(dof, self.dof)
        return jacobian * (math.sqrt((dof + 1.0) / (dof + 3.0)) / _chosen(sd, self.sd))

    def quantile_residuals(self, predicted, readings, times, rng: np.random.Generator, sd=None, dof=None) -> np.ndarray:
        """Normal quantile of the t probability of what is below each reading, at most 37 in size."""
        z = _standardised(predicted, readings, times, _chosen(sd, self.sd))
        tails = stdtr(_column(_chosen(dof, self.dof)), -np.abs(z))
        return -np.copysign(ndtri(np.maximum(tails, np.finfo(float).tiny)), z)

    def sample(self, truth, times, rng: np.random.Generator) -> np.ndarray:
        return truth + self.sd * rng.standard_t(self.dof, len(truth))


@dataclass(frozen=True)
class AR1:
    """Normal noise of stationary standard deviation `sd` with correlation exp(-lag / correlation_time_s).

    It is the first-order autoregressive (Ornstein-Uhlenbeck) process seen at ascending times with any gaps.
    """

    SAMPLED = ("sd", "correlation_time_s")

    sd: float
    correlation_time_s: float

    def __post_init__(self):
        _positive("sd", self.sd)
        _positive("correlation_time_s", self.correlation_time_s)

    def log_density(self, predicted, readings, times, sd=None, correlation_time_s=None) -> np.ndarray:
        predicted, readings = _aligned(predicted, readings, times)
        times = _ascending(times)
        sd = _of_members(_chosen(sd, self.sd), len(predicted))
        correlation_times = _of_members(_chosen(correlation_time_s, self.correlation_time_s), len(predicted))
        squares, logarithms = kernel.autoregressive_sums(predicted, readings, times, correlation_times).T
        return _possible(-0.5 * (squares / sd**2 + logarithms) - len(readings) * (np.log(sd) + 0.5 * _LOG_2_PI))

    def residuals(self, predicted, readings, times, sd=None, correlation_time_s=None) -> np.ndarray:
        """Innovations over their standard deviations: the inverse Cholesky factor of the covariance times the error."""
        errors = _standardised(predicted, readings, times, _chosen(sd, self.sd))
        rho, innovation_sd = self._transitions(times, _column(_chosen(correlation_time_s, self.correlation_time_s)))
        return np.hstack([errors[:, :1], (errors[:, 1:] - rho * errors[:, :-1]) / innovation_sd])

    def weigh(self, jacobian, predicted, readings, times, sd=None, correlation_time_s=None) -> np.ndarray:
        """The inverse Cholesky factor of the covariance of the noise times jacobian."""
        time = _chosen(correlation_time_s, self.correlation_time_s)
        return self.residuals(jacobian.T, np.zeros(len(jacobian)), times, sd, time).T

    def quantile_residuals(
        self, predicted, readings, times, rng: np.random.Generator, sd=None, correlation_time_s=None
    ) -> np.ndarray:
        """Innovations of (reading - predicted) over their standard deviations."""
        return -self.residuals(predicted, readings, times, sd, correlation_time_s)

    @staticmethod
    def _transitions(times, correlation_time_s):
        """(.., n - 1) correlations of successive readings and standard deviations of the innovations over sd."""
        lags = np.diff(_ascending(times)) / correlation_time_s
        return np.exp(-lags), np.sqrt(-np.expm1(-2.0 * lags))

    def sample(self, truth, times, rng: np.random.Generator) -> np.ndarray:
        rho, innovation_sd = self._transitions(times, self.correlation_time_s)
        errors = rng.standard_normal(len(truth))
        for i in range(1, len(errors)):
            errors[i] = rho[i - 1] * errors[i - 1] + innovation_sd[i - 1] * errors[i]
        return truth + self.sd * errors


def scale_rows(noise, predicted, readings, times, given) -> tuple[np.ndarray, np.ndarray]:
    """Residuals and derivatives that stand for the unknown attributes of a noise model in Gauss-Newton steps.

    With the gradient g and the observed information I = L L' of the log density by the logarithms of the attributes,
    z = -L^-1 g and J = L' give J'z = -g and J'J = I, as the rows of readings do for what moves the predictions.
    Where I is not positive definite the absolute values of its eigenvalues are taken. Derivatives are central
    differences of the log density, which needs no simulation.

    Parameters
    ----------
    given : attribute -> (n_batch,) values, k attributes

    Returns
    -------
    z (n_batch, k), and J (n_batch, k, k) by the logarithms of the attributes in the order of `given`.
    """
    names, k = list(given), len(given)
    logs = np.log(np.stack([np.asarray(given[name], dtype=float) for name in names], axis=1))

    def density(offset):
        values = np.exp(logs + _LOG_STEP * np.array(offset))
        return noise.log_density(predicted, readings, times, **dict(zip(names, values.T, strict=True)))

    unit = np.eye(k)
    middle = density(np.zeros(k))
    gradient, information = np.empty(logs.shape), np.empty((*logs.shape, k))
    for i in range(k):
        plus, minus = density(unit[i]), density(-unit[i])
        gradient[:, i] = (plus - minus) / (2.0 * _LOG_STEP)
        information[:, i, i] = (2.0 * middle - plus - minus) / _LOG_STEP**2
        for j in range(i):
            mixed = [density(a * unit[i] + b * unit[j]) for a, b in ((1, 1), (-1, -1), (1, -1), (-1, 1))]
            cross = (mixed[2] + mixed[3] - mixed[0] - mixed[1]) / (4.0 * _LOG_STEP**2)
            information[:, i, j] = information[:, j, i] = cross
    failed = ~np.isfinite(information).all(axis=(1, 2))
    information[failed] = unit
    values, vectors = np.linalg.eigh(information)
    # The root V |D|^1/2 of I serves as L does.
    root = vectors * np.sqrt(np.maximum(np.abs(values), _LEAST_INFORMATION))[:, None, :]
    rows = -np.linalg.solve(root, gradient[..., None])[..., 0]
    rows[failed] = np.nan
    return rows, np.swapaxes(root, 1, 2)


def _positive(key, value):
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"noise: {key} must be positive, found {value}")


def _not_negative(key, value):
    if not (np.isfinite(value) and value >= 0):
        raise InputError(f"noise: {key} must not be negative, found {value}")


def _ascending(times):
    times = np.ascontiguousarray(times, dtype=float)
    steps = np.diff(times)
    if not np.all(steps > 0):
        i = int(np.argmin(steps > 0))
        raise InputError(f"noise: times must ascend, found {times[i]:g} s before {times[i + 1]:g} s")
    return times


def _aligned(predicted, readings, times):
    """Contiguous predicted (n_batch, n) and readings (n,), refused if the lengths differ."""
    predicted = np.ascontiguousarray(predicted, dtype=float)
    readings = np.ascontiguousarray(readings, dtype=float)
    lengths = {predicted.shape[-1], len(readings), len(readings if times is None else times)}
    if predicted.ndim != 2 or len(lengths) > 1 or not len(readings):
        n_times = "" if times is None else f" and times {np.shape(times)}"
        raise InputError(f"noise: predicted {predicted.shape} does not match readings {readings.shape}{n_times}")
    return predicted, readings


def _chosen(given, default):
    return default if given is None else given


def _of_members(value, n_batch):
    """(n_batch,) copies of a number, or the given values; not a number where one is not positive."""
    values = np.broadcast_to(np.asarray(value, dtype=float), (n_batch,))
    return np.where(values > 0, values, np.nan)


def _standardised(predicted, readings, times, sd):
    predicted, readings = _aligned(predicted, readings, times)
    return (predicted - readings) / _column(sd)


def _column(value):
    """(n_batch, 1) of the values of members, or (1, 1) of a number; not a number where one is not positive."""
    column = np.reshape(value, (-1, 1))
    return np.where(column > 0, column, np.nan)


def _possible(log_density):
    return np.where(np.isnan(log_density), -np.inf, log_density)


def _rounded(values, resolution):
    return resolution * np.round(values / resolution)
