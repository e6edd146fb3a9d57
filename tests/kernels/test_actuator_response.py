"""The response of an actuator to its history, against the differential equation and against differences."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bayesub.kernels.actuator_response import line_slopes, response, straight_lines

TIMES = np.array([0.0, 1.3, 1.9, 4.0, 6.6, 7.1, 9.5, 12.0])
VALUES = np.array([0.2, 1.5, -0.4, -0.4, 0.9, -1.2, 0.3, 0.1])
LINES, HELD = np.append(np.diff(VALUES) / np.diff(TIMES), 0.0), np.zeros(len(TIMES))
STEP = 0.5
BOUNDARIES = np.arange(29) * STEP
DELAY, LAG = 0.33, 0.7


def answer(slopes, rate, delay=DELAY, lag=LAG):
    points, integrals = np.empty((len(BOUNDARIES), 2)), np.empty((len(BOUNDARIES) - 1, 4))
    response(TIMES, VALUES, slopes, rate, BOUNDARIES, delay, lag, points, integrals)
    return points, integrals


def solved(slopes, rate):
    """Value and its integrals since zero by a solver with small steps, from one change of the demand to the next."""
    state, time, rows = np.array([VALUES[0], 0.0, 0.0]), 0.0, {}
    changes = np.append(TIMES + DELAY, BOUNDARIES[-1])
    for end in np.unique(np.concatenate([changes, BOUNDARIES])):
        k = np.searchsorted(TIMES + DELAY, time + 1e-9, side="right") - 1

        def rates(t, y, k=k):
            demand = VALUES[0] if k < 0 else VALUES[k] + slopes[k] * (t - TIMES[k] - DELAY)
            return [np.clip((demand - y[0]) / LAG, -rate, rate), y[0], t * y[0]]

        if end > time:
            state = solve_ivp(rates, (time, end), state, rtol=1e-11, atol=1e-12, max_step=0.01).y[:, -1]
            time = end
        rows[end] = state
    return np.array([rows[boundary] for boundary in BOUNDARIES])


@pytest.mark.parametrize("rate", [np.inf, 0.9, 0.3])
@pytest.mark.parametrize("slopes", [LINES, HELD], ids=["lines", "held"])
def test_solves_the_equation(slopes, rate):
    points, integrals = answer(slopes, rate)
    expected = solved(slopes, rate)
    np.testing.assert_allclose(points[:, 0], expected[:, 0], rtol=0, atol=1e-8)
    over_steps = np.diff(expected[:, 1:], axis=0)
    np.testing.assert_allclose(integrals[:, 0], over_steps[:, 0], rtol=0, atol=1e-8)
    first = over_steps[:, 1] - BOUNDARIES[:-1] * over_steps[:, 0]
    np.testing.assert_allclose(integrals[:, 1], first, rtol=0, atol=1e-7)


@pytest.mark.parametrize("rate", [np.inf, 0.9, 0.3])
@pytest.mark.parametrize("slopes", [LINES, HELD], ids=["lines", "held"])
def test_derivatives(slopes, rate):
    """By the lag and by the delay, to the truncation of differences."""
    by_delay, by_lag = line_slopes(*answer(slopes, rate), STEP)
    for exact, change in ((by_delay, {"delay": 1e-5}), (by_lag, {"lag": 1e-5})):
        ((name, size),) = change.items()
        centre = {"delay": DELAY, "lag": LAG}
        plus, minus = (
            straight_lines(answer(slopes, rate, **centre | {name: centre[name] + sign * size})[1], STEP)
            for sign in (1, -1)
        )
        np.testing.assert_allclose(exact, (plus - minus) / (2 * size), rtol=0, atol=1e-8)


def test_without_a_lag_it_is_the_demand_later():
    """The mean over each step, and the first moment, of straight lines, by the trapezia between their ends."""
    points, integrals = answer(LINES, np.inf, lag=0.0)
    np.testing.assert_allclose(points[:, 0], np.interp(BOUNDARIES - DELAY, TIMES, VALUES), rtol=0, atol=1e-14)
    fine = np.unique(np.concatenate([np.linspace(0.0, BOUNDARIES[-1], 28 * 5000 + 1), TIMES + DELAY]))
    values = np.interp(fine - DELAY, TIMES, VALUES)
    sums = np.append(0.0, np.cumsum(np.diff(fine) * (values[1:] + values[:-1]) / 2))
    at = np.interp(BOUNDARIES, fine, sums)
    np.testing.assert_allclose(integrals[:, 0], np.diff(at), rtol=0, atol=1e-12)
    ends = straight_lines(integrals, STEP)
    np.testing.assert_allclose(ends.mean(axis=1) * STEP, integrals[:, 0], rtol=0, atol=1e-14)
    # A history that is straight throughout a step is taken as it is.
    kinked = np.floor((TIMES + DELAY) / STEP).astype(int)
    straight = np.setdiff1d(np.arange(28), kinked)
    np.testing.assert_allclose(ends[straight, 0], points[:-1, 0][straight], rtol=0, atol=1e-13)
    np.testing.assert_allclose(ends[straight, 1], points[1:, 0][straight], rtol=0, atol=1e-13)
