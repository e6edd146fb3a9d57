"""Noise models of readings that an instrument rounds to multiples of its resolution.

What their methods take and return is said at :class:`bayesub.problem.noise.Noise`.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr, ndtri_exp

from bayesub.io.errors import InputError
from bayesub.kernels import noise as kernel
from bayesub.problem.noise import Noise, aligned, column, each_member, not_negative, positive, possible
from bayesub.sensors.sensor import rounded


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
        """As :meth:`Noise.log_density`."""
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
        predicted, readings = aligned(predicted, readings, times)
        scale = column(self.sd)
        middle = (readings - predicted) / scale
        below = -np.abs(middle)  # reflected, as far tails are exact on the lower side only
        upper, lower = (log_ndtr(below + side * self.resolution / scale) for side in (0.5, -0.5))
        share = rng.random(predicted.shape)
        drawn = ndtri_exp(upper + np.log(share + (1.0 - share) * np.exp(lower - upper)))
        return np.where(middle > 0, -drawn, drawn)

    def _slopes(self, predicted, readings, times):
        predicted, readings = aligned(predicted, readings, times)
        sd = each_member(self.sd, len(predicted))
        slopes, information = kernel.rounded_slopes(predicted, readings, 0.5 * self.resolution, sd)
        return slopes, np.sqrt(information)

    def sample(self, truth: np.ndarray, times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """As :meth:`Noise.sample`."""
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
        """As :meth:`Noise.log_density`."""
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
        """As :meth:`Noise.sample`."""
        return rounded(np.asarray(truth), self.resolution)
