"""A log-normal prior whose scale is unknown and the same for several parameters: a hierarchical one.

Guesses of the coefficients of an axis come from one source, whose accuracy is unknown. With the logarithms
``u_k = log(parameter_k / median_k)`` of one axis

    u | scale ~ N(0, scale^2 I),    scale one of several values, each as probable:

what the data say of some coefficients says how far off the others may be. The scale is summed over, so that it is no
parameter and there is no funnel (Neal 2003). What is left depends on ``|u|`` only, and a stretch along the radius makes
it standard normal: ``u = t h(r) / r`` with ``r = |t|``, and h the function that gives ``|u|`` the distribution it has.

Searches work in t. The sampler's coordinates are linear in the parameters: combinations that leave the motion the same
are straight in these, and bent by far more than the width of the posterior in their logarithms.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayesub.problem.distributions import Prior

_NEAR, _FAR = 0.1, 15.0  # radius of the first knot of the stretch, and how far the last is beyond the usual radius
_RARE = 1e-250  # probability of a radius below the first knot, at least
_KNOTS = 600
_DRAWS = 2000  # that say what the scale is
_FOUND = 512  # scales of the prior with the scale that was found
_ITERATIONS = 4  # of Newton's method for its inverse


@dataclass(frozen=True, eq=False)
class SharedScale(Prior):
    """Log-normal prior about `median`, not zero, with one unknown sd of the logarithm for all parameters."""

    median: np.ndarray  # (n_params,), whose signs the parameters have
    scales: np.ndarray  # (n_scales,) values of that sd, each as probable

    @property
    def mean(self) -> np.ndarray:
        return self.median * np.mean(np.exp(0.5 * self.scales**2))

    @property
    def guess(self) -> np.ndarray:
        return self.median

    @property
    def sd(self) -> np.ndarray:
        return np.sqrt(self.median**2 * np.mean(np.exp(2.0 * self.scales**2)) - self.mean**2)

    @cached_property
    def _stretch(self) -> "_Stretch":
        return _Stretch(len(self.median), self.scales)

    def parameters(self, t: np.ndarray) -> np.ndarray:
        factor, _ = self._stretch.factor(np.linalg.norm(t, axis=-1, keepdims=True))
        return self.median * np.exp(t * factor)

    def standard(self, parameters: np.ndarray) -> np.ndarray:
        u = _logarithms(parameters, self.median)
        r = self._stretch.radius(np.linalg.norm(u, axis=-1, keepdims=True))
        return u / self._stretch.factor(r)[0]

    def chain(self, jacobian: np.ndarray, t: np.ndarray) -> np.ndarray:
        r = np.linalg.norm(t)
        factor, slope = self._stretch.factor(r)
        by_u = jacobian * (self.median * np.exp(t * factor))
        towards = t / r if r > 0.0 else t
        return factor * (by_u + slope * np.outer(by_u @ towards, towards))

    @property
    def _unit(self):
        return self.median * np.exp(np.mean(np.log(self.scales)))

    def scaled(self, parameters: np.ndarray) -> np.ndarray:
        """Linear in the parameters, as the directions are that leave the motion the same."""
        return (parameters - self.median) / self._unit

    def unscaled(self, x: np.ndarray) -> np.ndarray:
        return self.median + self._unit * x

    def scaled_chain(self, jacobian: np.ndarray, x: np.ndarray) -> np.ndarray:
        return jacobian * self._unit

    def scaled_log_density(self, x: np.ndarray) -> np.ndarray:
        return self.log_density(self.unscaled(x))

    def scaled_slope(self, x: np.ndarray) -> np.ndarray:
        parameters = self.unscaled(x)
        precision = self.scale_probabilities(parameters) @ self.scales**-2.0
        return -self._unit * (_logarithms(parameters, self.median) * precision[..., None] + 1.0) / parameters

    def scaled_form(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        n = len(self.median)
        return np.full(n, np.inf), self._unit / self.median, np.zeros(n, dtype=int), self.scales[None]

    def log_density(self, parameters: np.ndarray) -> np.ndarray:
        inside = np.all(parameters / self.median > 0.0, axis=-1, keepdims=True)
        parameters = np.where(inside, parameters, self.median)
        logs = np.logaddexp.reduce(self._log_densities(parameters), axis=-1) - np.log(len(self.scales))
        return np.where(inside[..., 0], logs - np.log(np.abs(parameters)).sum(axis=-1), -np.inf)

    def _log_densities(self, parameters):
        """(.., n_scales) log densities of u given each scale."""
        square = np.sum(_logarithms(parameters, self.median) ** 2, axis=-1)[..., None]
        return -0.5 * square / self.scales**2 - len(self.median) * np.log(np.sqrt(2.0 * np.pi) * self.scales)

    def scale_probabilities(self, parameters: np.ndarray) -> np.ndarray:
        """(.., n_scales) probability of each scale given parameters (.., n_params) within the support."""
        logs = self._log_densities(parameters)
        return np.exp(logs - np.logaddexp.reduce(logs, axis=-1, keepdims=True))

    def scales_of(self, draws: np.ndarray) -> np.ndarray:
        """(n_scales,) probability of each scale given the data, of draws (n, n_params) of the posterior."""
        return self.scale_probabilities(draws[:: max(1, len(draws) // _DRAWS)]).mean(axis=0)

    def found(self, draws: np.ndarray) -> "SharedScale":
        """The same with scales that are each as probable as the draws (n, n_params) say."""
        if len(self.scales) == 1:
            return self
        below = np.cumsum(self.scales_of(draws))
        places = np.searchsorted(below, (np.arange(_FOUND) + 0.5) / _FOUND * below[-1])
        return SharedScale(self.median, self.scales[places])

    def quantiles(self, probability: float) -> np.ndarray:
        from scipy import optimize, special

        far = (abs(special.ndtri(probability)) + 1.0) * self.scales.max()
        u = optimize.brentq(lambda u: np.mean(special.ndtr(u / self.scales)) - probability, -far, far, xtol=1e-12)
        return self.median * np.exp(np.sign(self.median) * u)


def _logarithms(parameters, median):
    ratio = parameters / median
    return np.log(np.where(ratio > 0.0, ratio, np.nan))


class _Stretch:
    """The stretch h along the radius of standard normal coordinates t, of n parameters with one of several scales.

    Over the `radii` of t, increasing, `logs` is a spline of log(h(r) / r).
    """

    def __init__(self, n_params: int, scales: np.ndarray):
        from scipy import interpolate, special

        half = 0.5 * n_params
        shortest = max(_NEAR, np.sqrt(2.0 * special.gammaincinv(half, _RARE)))
        at_zero = -0.5 * np.log(np.mean(scales ** (-2.0 * half))) / half
        # Radii exceeded as often as these lengths of u; in the upper half the survival function has the digits.
        lengths = np.geomspace(shortest * np.exp(at_zero), (np.sqrt(2.0 * half) + _FAR) * scales.max(), _KNOTS)
        squares = 0.5 * (lengths[:, None] / scales) ** 2
        below, above = (np.mean(f(half, squares), axis=1) for f in (special.gammainc, special.gammaincc))
        radii = np.sqrt(
            2.0 * np.where(below < 0.5, special.gammaincinv(half, below), special.gammainccinv(half, above))
        )
        logs = np.append(at_zero, np.log(lengths / radii))
        radii = np.append(0.0, radii)
        self.radii, self.logs = radii, interpolate.make_interp_spline(radii, logs, k=5)

    def factor(self, r: np.ndarray | np.floating) -> tuple[np.ndarray, np.ndarray]:
        """h(r) / r, and its derivative by log r over itself."""
        r = np.minimum(r, self.radii[-1])
        return np.exp(self.logs(r)), r * self.logs(r, 1)

    def radius(self, length: np.ndarray) -> np.ndarray:
        """The radius r of t with h(r) = length."""
        r = np.interp(length, self.radii * np.exp(self.logs(self.radii)), self.radii)
        for _ in range(_ITERATIONS):
            factor, slope = self.factor(r)
            r = np.maximum(r + (length / factor - r) / (1.0 + slope), 0.0)
        return r
