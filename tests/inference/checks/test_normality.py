"""How far draws are from normal: closed forms of known distributions, and a bend that no marginal shows."""

import numpy as np
import pytest
from scipy import stats

from bayesub.inference.checks.normality import CLOSE, PROBABILITIES, normality

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
