"""Control planes: a rate-limited first-order lag."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bayesub.model.actuator import Actuator, step_response

RATE, TAU, LIMIT = 0.087, 1.3, 0.5


def response(times, demand_times, demands, rate, time_constant, limit):
    """Angles of a plane, which makes no force from outside."""
    dynamics = {"rate": rate, "time_constant": time_constant, "limit": limit}
    plane = Actuator("plane", "plane_deg", np.ones(1), np.zeros(6), np.zeros(6), np.zeros(6), **dynamics)
    return plane.response(times, demand_times, demands)


def integrated(times, demand_times, demands):
    """The differential equation, solved numerically from step to step of the demand."""
    edges = [*demand_times, times[-1] + 1.0]
    angles, angle = np.zeros(len(times)), 0.0
    for begin, end, demand in zip(edges[:-1], edges[1:], np.clip(demands, -LIMIT, LIMIT), strict=True):
        solution = solve_ivp(
            lambda _, delta, demand=demand: np.clip((demand - delta) / TAU, -RATE, RATE),
            (begin, end),
            [angle],
            dense_output=True,
            rtol=1e-10,
            atol=1e-13,
            max_step=0.01,
        )
        inside = (times >= begin) & (times < end)
        angles[inside] = solution.sol(times[inside])[0]
        angle = solution.y[0, -1]
    return angles


def test_closed_form_solves_the_differential_equation():
    """Slewing, settling, interrupted and limited steps follow delta' = clip((demand - delta) / tau, -rate, rate)."""
    times = np.linspace(0.0, 60.0, 601)
    demand_times, demands = [1.0, 9.0, 10.5, 20.0, 22.0, 40.0], [0.4, 0.41, -0.7, 0.3, -0.3, 0.0]
    found = response(times, np.array(demand_times), np.array(demands), RATE, TAU, LIMIT)
    # The integrator steps over the corner of the clip with steps of 0.01 s: rate / tau * 0.01^2 = 7e-6 would be one
    # missed corner; its error control leaves less than 1e-7.
    np.testing.assert_allclose(found, integrated(times, demand_times, demands), rtol=0, atol=1e-7)


def test_limits_and_rate_are_respected(rng):
    """Whatever is demanded, the plane stays within its limit and its rate."""
    times = np.linspace(0.0, 200.0, 20_001)
    angles = response(times, np.arange(0.0, 200.0, 4.0), rng.uniform(-2, 2, 50), RATE, TAU, LIMIT)
    assert np.abs(angles).max() <= LIMIT * (1 + 1e-15)
    assert np.abs(angles).max() > 0.9 * LIMIT
    assert np.abs(np.diff(angles) / np.diff(times)).max() <= RATE * (1 + 1e-10)  # differences of angles 0.01 s apart


def test_a_big_step_slews_until_rate_times_tau_from_the_demand():
    """A step of rate * (tau + 3 s) slews for 3 s and then approaches exponentially."""
    demand = RATE * (TAU + 3.0)
    times = np.array([1.0, 2.9, 3.0, 3.0 + TAU, 3.0 + 5 * TAU])
    expected = [RATE, 2.9 * RATE, 3 * RATE, demand - RATE * TAU / np.e, demand - RATE * TAU * np.exp(-5)]
    np.testing.assert_allclose(step_response(times, 0.0, demand, RATE, TAU), expected, rtol=1e-14)
    np.testing.assert_allclose(step_response(times, 0.0, -demand, RATE, TAU), np.negative(expected), rtol=1e-14)


@pytest.mark.parametrize("size", [1e-9, 0.5, 1.0])
def test_a_small_step_is_a_pure_exponential(size):
    """Up to rate * tau the limit on the rate never acts."""
    times = np.linspace(0.0, 10.0, 50)
    found = step_response(times, 0.1, 0.1 + size * RATE * TAU, RATE, TAU)
    expected = 0.1 - size * RATE * TAU * np.expm1(-times / TAU)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-16)
