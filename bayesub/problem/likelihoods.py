"""Noise models of the readings of one channel: normal, rounded, heavy-tailed, correlated, of unknown size.

What their methods take and return is said at :class:`bayesub.problem.noise.Noise`. SciPy and kernels are imported where
they are needed, so that a study file is read without.
"""

import math
from dataclasses import dataclass

import numpy as np

from bayesub.io.errors import InputError
from bayesub.io.toml_files import Positive
from bayesub.problem.noise import (
    Noise,
    aligned,
    ascending,
    column,
    each_member,
    not_negative,
    positive,
    possible,
    standardised,
)
from bayesub.sensors.sensor import rounded

__all__ = ["AR1", "Noise", "Normal", "Rounded", "SetMembership", "StudentT", "UnknownSd", "reading_noise"]

_LOG_2_PI = math.log(2.0 * math.pi)


def reading_noise(sd: float, resolution: float = 0.0) -> Noise:
    """The noise of a sensor with normal errors of `sd` that writes down multiples of `resolution`; either may be 0.

    Raises InputError if both are zero or one is negative.
    """
    not_negative("sd", sd)
    not_negative("resolution", resolution)
    if sd == 0 and resolution == 0:
        message = "noise: sd and resolution are both zero; exact readings have no likelihood, give one of them"
        raise InputError(message, "value", "sd")
    if resolution == 0:
        return Normal(sd)
    return Rounded(sd, resolution) if sd > 0 else SetMembership(resolution)


@dataclass(frozen=True)
class Normal(Noise, kind="normal"):
    """Independent normal noise of standard deviation `sd`, in the unit of the readings."""

    SAMPLED = ("sd",)
    is_normal = True

    sd: float

    def log_density(self, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None = None) -> np.ndarray:
        from bayesub.kernels import noise as kernel

        predicted, readings = aligned(predicted, readings, times)
        sd = each_member(self.sd, len(predicted))
        squares = kernel.sums_of_squares(predicted, readings)
        return possible(-0.5 * squares / sd**2 - len(readings) * (np.log(sd) + 0.5 * _LOG_2_PI))

    def residuals(self, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None = None) -> np.ndarray:
        """(predicted - reading) / sd."""
        return standardised(predicted, readings, times, self.sd)

    def weigh(
        self, jacobian: np.ndarray, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None = None
    ) -> np.ndarray:
        """jacobian / sd, of which the expected and the observed information are the square."""
        return jacobian / self.sd

    def sample(self, truth: np.ndarray, times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        return truth + self.sd * rng.standard_normal(len(truth))


@dataclass(frozen=True)
class UnknownSd(Noise, kind="unknown_sd"):
    """Independent normal noise whose standard deviation is integrated out under the prior density 1/sd.

    The log density is

        log p = log Gamma(n/2) - log 2 - n/2 log(pi sum_i (predicted_i - reading_i)^2),

    infinite if every reading is met exactly. `sd` is a guess of it, with which readings are drawn and pictures drawn.
    """

    words = "of unknown size, guessed"

    sd: float

    def __post_init__(self):
        positive("sd", self.sd)

    def log_density(self, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None = None) -> np.ndarray:
        from scipy.special import gammaln

        from bayesub.kernels import noise as kernel

        predicted, readings = aligned(predicted, readings, times)
        half_n = 0.5 * len(readings)
        squares = kernel.sums_of_squares(predicted, readings)
        with np.errstate(divide="ignore"):
            return possible(gammaln(half_n) - math.log(2.0) - half_n * np.log(math.pi * squares))

    def residuals(self, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None = None) -> np.ndarray:
        """(predicted - reading) over the root of their mean square; zero where every reading is met exactly."""
        errors = standardised(predicted, readings, times, 1.0)
        sizes = self._sizes(errors)
        return np.divide(errors, sizes, out=np.zeros_like(errors), where=sizes != 0)

    def weigh(
        self, jacobian: np.ndarray, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None = None
    ) -> np.ndarray:
        """jacobian over the root of the mean square of (predicted - reading)."""
        return jacobian / self._sizes(standardised(np.asarray(predicted)[None], readings, times, 1.0))

    def quantile_residuals(
        self, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray, rng: np.random.Generator
    ) -> np.ndarray:
        """(reading - predicted) / sd with an sd drawn given the predictions.

        Of n readings, their squares sum to chi-square with n degrees of freedom whatever they are.
        """
        relative = np.sqrt(rng.chisquare(len(readings), (len(predicted), 1)) / len(readings))
        return -self.residuals(predicted, readings, times) * relative

    def widened(self, scale: float) -> Noise:
        """The noise itself, which is as large as the errors are."""
        return self

    @staticmethod
    def _sizes(errors):
        return np.sqrt(np.mean(errors**2, axis=1, keepdims=True))

    def sample(self, truth: np.ndarray, times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        return Normal(self.sd).sample(truth, times, rng)


@dataclass(frozen=True)
class StudentT(Noise, kind="student_t"):
    """Independent noise with the t distribution of `dof` degrees of freedom and scale `sd`: normal with outliers.

    The standard deviation is sd sqrt(dof / (dof - 2)) if dof > 2, and infinite otherwise.
    """

    words = "Student t"
    SAMPLED = ("sd", "dof")
    heavy_tailed = True

    sd: float
    dof: Positive

    def log_density(self, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None = None) -> np.ndarray:
        from scipy.special import gammaln

        from bayesub.kernels import noise as kernel

        predicted, readings = aligned(predicted, readings, times)
        sd, dof = (each_member(value, len(predicted)) for value in (self.sd, self.dof))
        logarithms = kernel.student_t_logarithms(predicted, readings, sd, dof)
        half = 0.5 * (dof + 1.0)
        constant = gammaln(half) - gammaln(0.5 * dof) - 0.5 * np.log(math.pi * dof)
        return possible(len(readings) * (constant - np.log(sd)) - half * logarithms)

    def residuals(self, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None = None) -> np.ndarray:
        """(dof + 1) z / (dof + z^2) over the root of the expected information, z = (predicted - reading) / sd."""
        z, dof = standardised(predicted, readings, times, self.sd), column(self.dof)
        return np.sqrt((dof + 1.0) * (dof + 3.0)) * z / (dof + z * z)

    def weigh(
        self, jacobian: np.ndarray, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None = None
    ) -> np.ndarray:
        """jacobian times the root of the expected information, (dof + 1) / (dof + 3) / sd^2."""
        return jacobian * (math.sqrt((self.dof + 1.0) / (self.dof + 3.0)) / self.sd)

    def quantile_residuals(
        self, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray, rng: np.random.Generator
    ) -> np.ndarray:
        """Normal quantile of the t probability of what is below each reading, at most 37 in size."""
        from scipy.special import ndtri, stdtr

        z = standardised(predicted, readings, times, self.sd)
        tails = stdtr(column(self.dof), -np.abs(z))
        return -np.copysign(ndtri(np.maximum(tails, np.finfo(float).tiny)), z)

    def sample(self, truth: np.ndarray, times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        return truth + self.sd * rng.standard_t(self.dof, len(truth))


@dataclass(frozen=True)
class AR1(Noise, kind="ar1"):
    """Normal noise of stationary standard deviation `sd` with correlation exp(-lag / correlation_time_s).

    It is the first-order autoregressive (Ornstein-Uhlenbeck) process seen at ascending times with any gaps.
    """

    words = "first-order autoregressive"
    SAMPLED = ("sd", "correlation_time_s")
    is_normal = True

    sd: float
    correlation_time_s: Positive

    def log_density(self, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None = None) -> np.ndarray:
        from bayesub.kernels import noise as kernel

        predicted, readings = aligned(predicted, readings, times)
        times = ascending(times)
        sd = each_member(self.sd, len(predicted))
        correlation_times = each_member(self.correlation_time_s, len(predicted))
        squares, logarithms = kernel.autoregressive_sums(predicted, readings, times, correlation_times).T
        return possible(-0.5 * (squares / sd**2 + logarithms) - len(readings) * (np.log(sd) + 0.5 * _LOG_2_PI))

    def residuals(self, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None = None) -> np.ndarray:
        """Innovations over their standard deviations: the inverse Cholesky factor of the covariance times the error."""
        errors = standardised(predicted, readings, times, self.sd)
        rho, innovation_sd = self._transitions(times, column(self.correlation_time_s))
        return np.hstack([errors[:, :1], (errors[:, 1:] - rho * errors[:, :-1]) / innovation_sd])

    def weigh(
        self, jacobian: np.ndarray, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None = None
    ) -> np.ndarray:
        """The inverse Cholesky factor of the covariance of the noise times jacobian."""
        return self.residuals(jacobian.T, np.zeros(len(jacobian)), times).T

    @staticmethod
    def _transitions(times, correlation_time_s):
        """(.., n - 1) correlations of successive readings and standard deviations of the innovations over sd."""
        lags = np.diff(ascending(times)) / correlation_time_s
        return np.exp(-lags), np.sqrt(-np.expm1(-2.0 * lags))

    def sample(self, truth: np.ndarray, times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        rho, innovation_sd = self._transitions(times, self.correlation_time_s)
        errors = rng.standard_normal(len(truth))
        for i in range(1, len(errors)):
            errors[i] = rho[i - 1] * errors[i - 1] + innovation_sd[i - 1] * errors[i]
        return truth + self.sd * errors


@dataclass(frozen=True)
class Rounded(Noise):
    """Readings rounded to the nearest multiple of `resolution` after normal noise of `sd`, both in their unit.

    A reading y is the interval of values that round to it, and its density is the probability of that interval,

        p(y) = Phi((y + resolution/2 - predicted) / sd) - Phi((y - resolution/2 - predicted) / sd),

    (model manual, section 11), in the limit of a small resolution the normal density times the resolution.

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
        not_negative("sd", self.sd)
        not_negative("resolution", self.resolution)
        if self.sd == 0 and self.resolution == 0:
            raise InputError("noise: sd and resolution are both zero; exact readings have no likelihood", "value", "sd")
        if self.sd == 0:
            raise InputError("noise: sd is zero with a resolution; that is the noise SetMembership", "value", "sd")
        if self.resolution == 0:
            raise InputError("noise: resolution is zero; that is the noise Normal", "value", "resolution")

    def log_density(self, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None = None) -> np.ndarray:
        from bayesub.kernels import noise as kernel

        predicted, readings = aligned(predicted, readings, times)
        sd = each_member(self.sd, len(predicted))
        return possible(kernel.rounded_log_probabilities(predicted, readings, 0.5 * self.resolution, sd))

    def residuals(self, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None = None) -> np.ndarray:
        """Derivative of minus log p by the prediction, over the root of the information; zero where that vanishes."""
        slopes, roots = self._slopes(predicted, readings, times)
        return np.divide(slopes, roots, out=np.zeros_like(slopes), where=roots != 0)

    def weigh(
        self, jacobian: np.ndarray, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None = None
    ) -> np.ndarray:
        """jacobian times the root of the observed information."""
        _, roots = self._slopes(np.asarray(predicted)[None], readings, times)
        return jacobian * (roots[0] / self.sd)[:, None]

    def quantile_residuals(
        self, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray, rng: np.random.Generator
    ) -> np.ndarray:
        """Draws from the standard normal distribution truncated to the interval of each reading."""
        from scipy.special import log_ndtr, ndtri_exp

        predicted, readings = aligned(predicted, readings, times)
        scale = column(self.sd)
        middle = (readings - predicted) / scale
        below = -np.abs(middle)  # reflected, as far tails are exact on the lower side only
        upper, lower = (log_ndtr(below + side * self.resolution / scale) for side in (0.5, -0.5))
        share = rng.random(predicted.shape)
        drawn = ndtri_exp(upper + np.log(share + (1.0 - share) * np.exp(lower - upper)))
        return np.where(middle > 0, -drawn, drawn)

    def _slopes(self, predicted, readings, times):
        from bayesub.kernels import noise as kernel

        predicted, readings = aligned(predicted, readings, times)
        sd = each_member(self.sd, len(predicted))
        slopes, information = kernel.rounded_slopes(predicted, readings, 0.5 * self.resolution, sd)
        return slopes, np.sqrt(information)

    def sample(self, truth: np.ndarray, times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        return rounded(truth + self.sd * rng.standard_normal(len(truth)), self.resolution)


@dataclass(frozen=True)
class SetMembership(Noise):
    """Exact values rounded to the nearest multiple of `resolution`: :class:`Rounded` in the limit of sd zero.

    The density is one if every prediction lies in the interval that rounds to its reading and zero otherwise. Having
    no gradient, it has for residuals the distances to the intervals in units of half the resolution: a least-squares
    search that brings them to zero has found a feasible prediction. There is no sd to infer.
    """

    has_density = False

    resolution: float

    def __post_init__(self):
        positive("resolution", self.resolution)

    def log_density(self, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None = None) -> np.ndarray:
        predicted, readings = aligned(predicted, readings, times)
        inside = np.abs(predicted - readings) <= self._half_width(readings)
        return np.where(inside.all(axis=1), 0.0, -np.inf)

    def residuals(self, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None = None) -> np.ndarray:
        """Signed distance from the interval over resolution / 2; zero inside."""
        return self._excess(*aligned(predicted, readings, times)) / (0.5 * self.resolution)

    def weigh(
        self, jacobian: np.ndarray, predicted: np.ndarray, readings: np.ndarray, times: np.ndarray | None = None
    ) -> np.ndarray:
        """jacobian over resolution / 2 where the prediction is outside its interval; zero inside."""
        outside = self._excess(np.asarray(predicted), readings) != 0
        return jacobian * (outside / (0.5 * self.resolution))[:, None]

    def smoothed(self, share: float) -> Noise:
        """Rounded normal noise whose sd is `share` of the resolution, which has slopes outside the interval."""
        return Rounded(share * self.resolution, self.resolution)

    def widened(self, scale: float) -> Noise:
        """The noise itself, which has no sd."""
        return self

    def _excess(self, predicted, readings):
        distance = predicted - readings
        return np.sign(distance) * np.maximum(np.abs(distance) - self._half_width(readings), 0.0)

    def _half_width(self, readings):
        # The intervals are closed; their ends are known to the rounding of the reading, a multiple of the resolution.
        return 0.5 * self.resolution + np.finfo(float).eps * np.abs(readings)

    def sample(self, truth: np.ndarray, times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        return rounded(np.asarray(truth), self.resolution)
