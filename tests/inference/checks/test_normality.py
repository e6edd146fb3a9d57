"""How far draws are from normal: closed forms of known distributions, and a bend that no marginal shows."""

import numpy as np
import pytest
from scipy import integrate, stats

from bayesub.inference.checks.normality import CLOSE, PROBABILITIES, halves, hellinger, normality, wasserstein

N = 40_000


def test_a_normal_is_close_whatever_its_scales_and_correlations(rng):
    factor = np.tril(rng.standard_normal((4, 4))) * [[1e-6], [1.0], [30.0], [1e-3]]
    found = normality("abcd", 5.0 + rng.standard_normal((N, 4)) @ factor.T, np.ones(4), N)
    assert found.close
    # Standard errors: of a skewness sqrt(6/n), of a quantile at 5 % the `noise`; 5 of them over 8 values.
    assert max(np.abs(found.skewness).max(), np.abs(found.skewness_along).max()) < 5.0 * np.sqrt(6.0 / N)
    assert max(found.distance.max(), found.distance_along.max()) < 5.0 * found.noise
    assert found.sentence.startswith("The posterior is close to normal")


def test_skewness_and_distance_of_a_log_normal(rng):
    """In closed form; only it is named."""
    scale = 0.5
    draws = np.stack([rng.standard_normal(N), np.exp(scale * rng.standard_normal(N))], axis=1)
    found = normality(("plain", "skew"), draws, np.ones(2), N)
    law = stats.lognorm(scale)
    mean, variance, skewness = law.stats("mvs")
    distance = np.abs((law.ppf(PROBABILITIES) - mean) / np.sqrt(variance) - stats.norm.ppf(PROBABILITIES)).max()
    assert found.skewness[1] == pytest.approx(skewness, rel=0.15)  # of 40,000 draws; its own law has heavy tails
    assert found.distance[1] == pytest.approx(distance, abs=0.03)
    assert found.distance[1] > CLOSE > found.distance[0]
    assert not found.close
    assert "not normal in skew:" in found.sentence
    assert found.to_json()["parameters"][1]["name"] == "skew"


def test_a_thin_bent_sheet_is_seen_across_it(rng):
    """Both parameters look nearly normal; across the sheet, a hundred times thinner, the bend is all there is."""
    along, across = rng.standard_normal((2, N))
    straight = normality("xy", np.stack([along + 0.01 * across, along], axis=1), np.ones(2), N)
    bent = normality("xy", np.stack([along + 0.01 * across, along + 0.02 * along**2], axis=1), np.ones(2), N)
    assert straight.close
    assert max(bent.distance) < CLOSE < bent.distance_along[0]
    assert not bent.close
    assert "together they are not" in bent.sentence


N_APART = 200_000


def test_the_same_draws_are_nowhere_apart(rng):
    draws = rng.standard_normal((500, 4)) @ rng.standard_normal((4, 4))
    assert hellinger(draws, draws) == pytest.approx(0.0, abs=1e-7)
    assert wasserstein(draws, draws) == pytest.approx(np.zeros(4), abs=1e-12)


def test_wasserstein_is_a_shift_and_a_difference_of_sds(rng):
    """Of equal shapes the shift; of normal ones with equal means sqrt(2 / pi) |s1 - s2|; in pooled sds."""
    first = rng.standard_normal((N_APART, 2))
    second = rng.standard_normal((N_APART, 2)) * [1.0, 3.0] + [0.7, 0.0]
    pooled = np.sqrt(0.5 * (1.0 + np.array([1.0, 9.0])))
    expected = np.array([0.7, np.sqrt(2.0 / np.pi) * 2.0]) / pooled
    assert wasserstein(first, second) == pytest.approx(expected, abs=5 * 3.0 / np.sqrt(N_APART))


def test_hellinger_is_the_integral_of_normal_densities(rng):
    """1 - integral of sqrt(p q), whatever the units of a parameter are."""
    p, q = stats.norm(1.0, 2.0), stats.norm(0.0, 1.0)
    overlap, _ = integrate.quad(lambda x: np.sqrt(p.pdf(x) * q.pdf(x)), -30.0, 30.0)
    first, second = p.rvs((N_APART, 1), random_state=rng), q.rvs((N_APART, 1), random_state=rng)
    expected = np.sqrt(1.0 - overlap)
    assert hellinger(first, second) == pytest.approx(expected, abs=0.01)
    assert hellinger(1e-9 * first, 1e-9 * second) == pytest.approx(hellinger(first, second), rel=1e-9)


def test_hellinger_sees_a_correlation_that_no_margin_shows(rng):
    """With unit sds and correlations r and -r: 1 - H^2 is the root of the root of (1 - r^2)."""
    root = np.linalg.cholesky(np.array([[1.0, 0.9], [0.9, 1.0]]))
    first = rng.standard_normal((N_APART, 2)) @ root.T
    second = (rng.standard_normal((N_APART, 2)) @ root.T) * [1.0, -1.0]
    assert hellinger(first, second) ** 2 == pytest.approx(1.0 - np.sqrt(1.0 - 0.81), abs=0.01)
    assert wasserstein(first, second).max() < 0.02


def test_halves_are_near_of_one_problem_and_apart_of_two(rng):
    chain = rng.standard_normal((4, 100, 20, 3))
    assert halves(chain) < 0.1
    chain[2:] += 3.0
    assert halves(chain) > 0.8
    assert np.isnan(halves(chain[:1]))


def test_what_never_moves_has_no_distance_of_its_own(rng):
    """Draws of a singular covariance, by a constant or by a copy: as far apart as the others say."""
    first, second = rng.standard_normal((2, 4000, 1))
    second += 1.0
    for more in (np.zeros_like, np.copy):
        one, two = (np.hstack([draws, more(draws)]) for draws in (first, second))
        assert hellinger(one, one) == pytest.approx(0.0, abs=1e-6)
        assert 0.0 < hellinger(one, two) <= 1.0
    constant = np.hstack([first, np.zeros_like(first)])
    moved = constant + np.array([1.0, 0.0])
    assert hellinger(constant, moved) == pytest.approx(np.sqrt(1 - np.exp(-1 / 8)), abs=0.01)
    assert not normality(("a", "b"), constant, np.ones(2), 4000.0).close
    assert np.isfinite(wasserstein(constant, moved)).all()
