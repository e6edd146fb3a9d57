"""The response of an actuator to its history in a log: later by a delay, behind a command by lag and rate limit."""

import math

import numpy as np

from bayesub.kernels.jit import inline, jit


@inline
def _lagging(length, error, slope, start, sensitivity, lag):
    """The value of a first-order lag behind a demand that goes straight, after `length` s, and its integrals.

    The demand is ``start + error`` at first. With x the time, E = exp(-x / lag) and C = lag slope - error the value is
    ``start + error - lag slope + slope x + C E``.
    """
    fall = math.exp(-length / lag)
    once = -math.expm1(-length / lag) * lag  # integral of E
    twice = lag * once - lag * length * fall  # of x E
    thrice = 2.0 * lag * twice - lag * length * length * fall  # of x^2 E
    constant, decaying = start + error - lag * slope, lag * slope - error
    of_start = sensitivity + slope
    half = 0.5 * length * length
    return (
        constant + slope * length + decaying * fall,
        of_start * fall - slope + decaying * fall * length / lag**2,
        constant * length + slope * half + decaying * once,
        constant * half + slope * length * half / 1.5 + decaying * twice,
        of_start * once - slope * length + decaying * twice / lag**2,
        of_start * twice - slope * half + decaying * thrice / lag**2,
    )


@inline
def _straight(length, slope, start, sensitivity):
    """The same for a value that goes straight, of which the derivative stays what it is."""
    half = 0.5 * length * length
    return (
        start + slope * length,
        sensitivity,
        start * length + slope * half,
        start * half + slope * length * half / 1.5,
        sensitivity * length,
        sensitivity * half,
    )


@inline
def response(times, values, slopes, rate, boundaries, delay, lag, points, integrals):
    """Values at the boundaries of steps, and their integrals over the steps.

    The demand is ``values[k] + slopes[k] (t - times[k])`` from ``times[k]`` on, and ``values[0]`` before. The value
    follows by ``value' = clip((demand - value) / lag, -rate, rate)`` (model manual, equation 7.3), in closed form from
    one change to the next, and starts settled; without a lag it is the demand itself. It acts `delay` later. Times are
    in s and ascend, values in SI units; the largest rate may be infinite.

    Written are the value at each of the `boundaries` (m + 1,), and its derivative by the lag, into `points` (m + 1, 2);
    and for each step the integrals of the value and of the time since the begin of the step times the value, and the
    derivatives of both by the lag, into `integrals` (m, 4).
    """
    integrals[:] = 0.0
    limit = rate * lag
    k, j = -1, 0
    now = min(times[0], boundaries[0] - delay)
    demand, slope = values[0], 0.0
    value, sensitivity = values[0], 0.0
    while j < len(boundaries):
        boundary = boundaries[j] - delay
        change = times[k + 1] if k + 1 < len(times) else math.inf
        remaining = min(change, boundary) - now
        slewing = lag > 0.0 and abs(demand - value) > limit
        while remaining > 0.0:
            error = demand - value
            length = remaining
            if lag == 0.0:
                piece = _straight(length, slope, demand, 0.0)
            elif slewing:
                sign = math.copysign(1.0, error)
                if sign * slope < rate:
                    length = min(length, max(0.0, (abs(error) - limit) / (rate - sign * slope)))
                slewing = length == remaining
                piece = _straight(length, sign * rate, value, sensitivity)
            else:
                if abs(slope) > rate:
                    left = lag * slope - math.copysign(limit, slope)
                    length = min(length, max(0.0, lag * math.log((lag * slope - error) / left)))
                slewing = length < remaining
                piece = _lagging(length, error, slope, value, sensitivity, lag)
            if j > 0:
                since = now - (boundaries[j - 1] - delay)
                integrals[j - 1, 0] += piece[2]
                integrals[j - 1, 1] += piece[3] + since * piece[2]
                integrals[j - 1, 2] += piece[4]
                integrals[j - 1, 3] += piece[5] + since * piece[4]
            value, sensitivity = piece[0], piece[1]
            demand += slope * length
            now += length
            remaining -= length
        now = min(change, boundary)
        if change <= boundary:
            k += 1
            demand, slope = values[k], slopes[k]
            if lag == 0.0:
                value = demand
        else:
            points[j, 0], points[j, 1] = value, sensitivity
            j += 1


@jit
def responses(times, values, slopes, rate, boundaries, delays, lags, points, integrals):
    """The :func:`response` for each of a batch of delays and lags (n_batch,), which lead `points` and `integrals`."""
    for member in range(len(delays)):
        response(
            times, values, slopes, rate, boundaries, delays[member], lags[member], points[member], integrals[member]
        )


def straight_lines(integrals: np.ndarray, step: float) -> np.ndarray:
    """The straight line in each step that has the mean and the first moment of a value, by its two ends (.., m, 2).

    What it leaves out of a kink or a jump inside a step (s) moves a boat by the third power of the step, where values
    taken at the stages leave out the first; and it changes smoothly with a delay. Of the `integrals` (.., m, 2 or more)
    of :func:`response` the first two count.
    """
    mean = integrals[..., 0] / step
    half_rise = integrals[..., 1] * (6.0 / step**2) - 3.0 * mean
    ends = np.empty((*mean.shape, 2))
    np.subtract(mean, half_rise, out=ends[..., 0])
    np.add(mean, half_rise, out=ends[..., 1])
    return ends


def line_slopes(points: np.ndarray, integrals: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """The derivatives of :func:`straight_lines` by the delay and by the lag, (.., m, 2) each.

    Points (.., m + 1, 2) and integrals (.., m, 4) are those of :func:`response`.
    """
    after, before = points[..., 1:, 0], points[..., :-1, 0]
    by_delay = np.stack([before - after, integrals[..., 0] - step * after], axis=-1)
    return straight_lines(by_delay, step), straight_lines(integrals[..., 2:], step)
