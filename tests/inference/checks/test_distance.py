"""Distances between posteriors against their closed forms for normal ones."""

import numpy as np
import pytest
from scipy import integrate, stats

from bayesub.inference.checks.distance import halves, hellinger, wasserstein

N = 200_000


def test_the_same_draws_are_nowhere_apart(rng):
    draws = rng.standard_normal((500, 4)) @ rng.standard_normal((4, 4))
    assert hellinger(draws, draws) == pytest.approx(0.0, abs=1e-7)
    assert wasserstein(draws, draws) == pytest.approx(np.zeros(4), abs=1e-12)


def test_wasserstein_is_a_shift_and_a_difference_of_sds(rng):
    """Of equal shapes the shift; of normal ones with equal means sqrt(2 / pi) |s1 - s2|; in pooled sds."""
    first = rng.standard_normal((N, 2))
    second = rng.standard_normal((N, 2)) * [1.0, 3.0] + [0.7, 0.0]
    pooled = np.sqrt(0.5 * (1.0 + np.array([1.0, 9.0])))
    expected = np.array([0.7, np.sqrt(2.0 / np.pi) * 2.0]) / pooled
    assert wasserstein(first, second) == pytest.approx(expected, abs=5 * 3.0 / np.sqrt(N))


def test_hellinger_is_the_integral_of_normal_densities(rng):
    """1 - integral of sqrt(p q), whatever the units of a parameter are."""
    p, q = stats.norm(1.0, 2.0), stats.norm(0.0, 1.0)
    overlap, _ = integrate.quad(lambda x: np.sqrt(p.pdf(x) * q.pdf(x)), -30.0, 30.0)
    first, second = p.rvs((N, 1), random_state=rng), q.rvs((N, 1), random_state=rng)
    expected = np.sqrt(1.0 - overlap)
    assert hellinger(first, second) == pytest.approx(expected, abs=0.01)
    assert hellinger(1e-9 * first, 1e-9 * second) == pytest.approx(hellinger(first, second), rel=1e-9)


def test_hellinger_sees_a_correlation_that_no_margin_shows(rng):
    """With unit sds and correlations r and -r: 1 - H^2 is the root of the root of (1 - r^2)."""
    root = np.linalg.cholesky(np.array([[1.0, 0.9], [0.9, 1.0]]))
    first = rng.standard_normal((N, 2)) @ root.T
    second = (rng.standard_normal((N, 2)) @ root.T) * [1.0, -1.0]
    assert hellinger(first, second) ** 2 == pytest.approx(1.0 - np.sqrt(1.0 - 0.81), abs=0.01)
    assert wasserstein(first, second).max() < 0.02


def test_halves_are_near_of_one_problem_and_apart_of_two(rng):
    chain = rng.standard_normal((4, 100, 20, 3))
    assert halves(chain) < 0.1
    chain[2:] += 3.0
    assert halves(chain) > 0.8
    assert np.isnan(halves(chain[:1]))
