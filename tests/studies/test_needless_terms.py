"""Savage-Dickey ratios, and terms taken away one by one, against evidences of linear problems in closed form."""

import numpy as np
import pytest
from scipy import stats

from how_many_terms.needless_terms import Approximation, log_ratio, log_ratio_of_draws

N_READINGS = 30


def linear(rng, n=6):
    """Slopes (N_READINGS, n) of very different size, readings, centre and sd of the priors, of n terms."""
    slopes = rng.standard_normal((N_READINGS, n)) * 10.0 ** rng.uniform(-2, 1, n)
    centre, sd = rng.uniform(-2.0, 2.0, n), rng.uniform(0.5, 1.0, n)
    readings = slopes @ (centre + sd * rng.standard_normal(n)) + rng.standard_normal(N_READINGS)
    return slopes, readings, centre, sd


def log_evidence(slopes, readings, centre, sd, left):
    """Of the model with the terms that are left, the others zero: the readings are normal."""
    scaled = slopes[:, left] * sd[left]
    covariance = np.eye(N_READINGS) + scaled @ scaled.T
    return stats.multivariate_normal(slopes[:, left] @ centre[left], covariance).logpdf(readings)


def approximation(slopes, readings, centre, sd, at):
    """The posterior in t, about any point `at`, for it is normal."""
    return Approximation(slopes * sd, slopes @ (centre + sd * at) - readings, at)


def test_a_ratio_is_that_of_the_evidences_without_and_with_the_term(rng):
    case = linear(rng)
    n = len(case[-1])
    everything = log_evidence(*case, np.arange(n))
    exact = [log_evidence(*case, np.delete(np.arange(n), k)) - everything for k in range(n)]
    zeros = -case[2] / case[3]
    np.testing.assert_allclose(approximation(*case, rng.standard_normal(n)).ratios(zeros), exact, rtol=1e-9, atol=1e-9)


def test_terms_that_go_one_by_one_have_ratios_that_add_up_to_that_of_all(rng):
    """Each time the one that is missed least goes, and the mode is that of the terms that are left."""
    slopes, readings, centre, sd = case = linear(rng)
    zeros, left, total = -centre / sd, list(range(len(sd))), log_evidence(*case, np.arange(len(sd)))
    for removal in approximation(*case, rng.standard_normal(len(sd))).removals(zeros):
        without = {k: log_evidence(*case, [j for j in left if j != k]) for k in left}
        assert removal.position == max(without, key=without.get)
        left.remove(removal.position)
        assert removal.log_ratio == pytest.approx(without[removal.position] - total, abs=1e-7)
        total = without[removal.position]
        rows = np.vstack([slopes[:, left] * sd[left], np.eye(len(left))])
        off = readings - slopes[:, left] @ centre[left]
        mode = np.linalg.lstsq(rows, np.concatenate([off, np.zeros(len(left))]))[0] if left else np.zeros(0)
        np.testing.assert_allclose(removal.t[left], mode, atol=1e-8)
        gone = np.setdiff1d(np.arange(len(sd)), left)
        np.testing.assert_array_equal(removal.t[gone], zeros[gone])
    assert left == []


def test_what_another_imitates_is_seen_alone_and_not_missed(rng):
    """Two terms with the same slope: each alone is seen, either may go, and then the other may not."""
    slopes = np.repeat(5.0 * rng.standard_normal((N_READINGS, 1)), 2, axis=1)
    centre, sd = np.ones(2), np.ones(2)
    readings = slopes @ np.ones(2) + rng.standard_normal(N_READINGS)
    about, zeros = approximation(slopes, readings, centre, sd, np.zeros(2)), -centre / sd
    assert about.ratios_alone(zeros).max() < -50.0
    assert about.ratios(zeros).min() > -2.0  # the other is two then, one prior sd off
    first, second = about.removals(zeros)
    assert first.log_ratio > -2.0
    assert second.log_ratio < -100.0


def test_a_term_that_is_not_there_goes_first_and_one_that_is_stays(rng):
    slopes = rng.standard_normal((N_READINGS, 3))
    centre, sd = np.array([0.3, 1.0, 1.0]), np.array([1.0, 0.5, 0.5])
    readings = slopes @ np.array([0.0, 1.0, 1.0]) + 0.1 * rng.standard_normal(N_READINGS)
    about = approximation(slopes / 0.1, readings / 0.1, centre, sd, np.zeros(3))
    removals = list(about.removals(-centre / sd))
    assert removals[0].position == 0
    assert removals[0].log_ratio > 0.0
    assert removals[1].log_ratio < -100.0


def test_ratios_of_draws_are_those_of_the_normal_they_are_from(rng):
    """To the error of a kernel density estimate; beyond the draws there is none."""
    t = 0.4 + 0.7 * rng.standard_normal(8000)
    for zero in (-0.5, 0.0, 1.0):
        assert log_ratio_of_draws(zero, t) == pytest.approx(log_ratio(zero, 0.4, 0.7), abs=0.1)
    assert np.isnan(log_ratio_of_draws(-6.0, t))
