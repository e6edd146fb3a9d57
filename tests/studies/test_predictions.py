"""Errors of predictions, and which share of their variance sets and manoeuvres have."""

import numpy as np
import pytest

from thesis import predictions


def test_largest_error_and_cost():
    """A metre off once is one metre; the cost is ten times sum(m^2) + sum(deg^2), as the samples are weighted."""
    truth, states = np.zeros((5, 12)), np.zeros((2, 5, 12))
    states[0, 2, 1], states[1, :, 5], states[1, 4, 0] = 1.0, np.radians(2.0), 3.0
    largest, cost = predictions.largest_and_cost(states, truth)
    np.testing.assert_allclose(largest, [1.0, 3.0])
    np.testing.assert_allclose(cost, [10.0, 10.0 * (5 * 4.0 + 9.0)])


def test_shares_of_variance(rng):
    """Errors that are products of a factor of the set and one of the manoeuvre are shared out whole."""
    of_set, of_manoeuvre = rng.standard_normal((40, 1)), 2.0 * rng.standard_normal((1, 60))
    shares = predictions.shares_of_variance(np.exp(of_set + of_manoeuvre))
    assert shares["set"] + shares["manoeuvre"] == pytest.approx(1.0)
    assert shares["set"] == pytest.approx(np.var(of_set) / (np.var(of_set) + np.var(of_manoeuvre)))


def test_failed_predictions_count_for_nothing():
    """Statistics are of those that completed."""
    spread = predictions.spread(np.array([[1.0, np.nan], [3.0, 2.0]]))
    assert spread == {"max": 3.0, "mean": 2.0, "median": 2.0, "min": 1.0}


def test_the_band_of_chance_is_as_wide_as_draws_err_together(rng):
    """Draws that err apart on each manoeuvre have the share of a level inside; those that err alike all or none."""
    apart, alike = rng.random((100, 400, 10, 3)), np.broadcast_to(rng.random((400, 1, 1)), (100, 400, 10, 3))
    # A share of 3000 has a standard deviation of 0.009.
    assert predictions.coverage_of_draws(apart, 0.5) == pytest.approx([0.485, 0.515], abs=0.005)
    assert predictions.coverage_of_draws(alike, 0.5) == [0.0, 1.0]
    apart[:50, 0] = np.nan  # half of the flights of a draw fail
    assert np.isfinite(predictions.coverage_of_draws(apart, 0.5)).all()
