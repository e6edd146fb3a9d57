"""The search of thesis section 7.2.2: its programme, its line search, its rule, and what its differences do."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import optimize

from stopping_rule import halving_search
from stopping_rule.halving_search import LIMIT, SOLVED, Reading, search
from thesis.cases import streams, track_problem


def asked(function):
    """What a search asks: costs of a point, or of a point and its neighbours."""
    return lambda question: np.array([function(question[0])])


def test_the_programme_is_the_least_of_the_model_within_its_limits(rng):
    factor = rng.normal(size=(6, 6))
    hessian, slope = factor @ factor.T + 0.1 * np.eye(6), 3.0 * rng.normal(size=6)
    limits = np.full(6, -0.3), np.full(6, 0.4)
    step = halving_search._programme(hessian, slope, *limits)
    expected = optimize.minimize(
        lambda s: slope @ s + 0.5 * s @ hessian @ s,
        np.zeros(6),
        jac=lambda s: slope + hessian @ s,
        bounds=optimize.Bounds(*limits),
        tol=1e-14,
    )
    assert np.abs(step - 0.4).min() < 1e-9
    np.testing.assert_allclose(step, expected.x, atol=1e-5)


def test_a_step_is_halved_until_the_cost_is_no_higher():
    """From 1 downhill to 0, a step of -4 overshoots, -2 gives the same cost."""
    fraction = halving_search._line_search(np.array([1.0]), np.array([-4.0]), 1.0, asked(lambda x: float(x[0] ** 2)))
    assert fraction == 0.5


def test_a_direction_without_a_lower_cost_is_reversed_and_then_given_up():
    """Uphill the other way is downhill; at the bottom there is none, where the thesis's loop does not end."""
    up = halving_search._line_search(np.array([1.0]), np.array([1.0]), 1.0, asked(lambda x: float(x[0] ** 2)))
    assert -halving_search.SMALLEST <= up < 0.0
    assert halving_search._line_search(np.zeros(1), np.ones(1), 0.0, asked(lambda x: abs(float(x[0])))) is None


def test_the_update_keeps_the_matrix_positive_definite(rng):
    """Against the curvature too, where BFGS without damping would lose it; with it, the secant condition holds."""
    hessian, moved = np.eye(4), rng.normal(size=4)
    assert np.linalg.eigvalsh(halving_search._updated(hessian, moved, -moved)).min() > 0.0
    updated = halving_search._updated(hessian, moved, 3.0 * moved)
    np.testing.assert_allclose(updated @ moved, 3.0 * moved, rtol=1e-12)


def test_long_differences_end_a_search_far_from_the_track(suboff):
    """Two coefficients of a track: the search ends by its rule at a cost that falls with the step of differences."""
    problem = track_problem(suboff, "horizontal", ("Xuu", "Nuv"))
    starts = streams("suboff", "horizontal")[0].uniform(0.9, 1.1, (2, 2))
    history = []
    short = search(problem, starts[:1], Reading(), history=history)
    assert set(short.statuses) == {SOLVED}
    assert len(history) == short.efforts[0]
    assert min(history) == pytest.approx(short.costs[0], rel=1e-6)
    long = search(problem, starts, Reading(difference=1e-4, max_iterations=30))
    assert short.costs.max() < 1e-2 * long.costs.min()
    limited = search(problem, starts, replace(Reading(), max_iterations=1))
    assert set(limited.statuses) <= {LIMIT, SOLVED}
