"""Coverage of normal intervals over trials."""

import numpy as np
import pytest

from thesis.coverage import RepeatedTrials, standard_errors_off


@pytest.fixture
def honest(rng):
    """4000 trials of six correlated parameters whose errors have the covariance that is stated."""
    factor = rng.standard_normal((6, 6)) * 10.0 ** -np.arange(6)[:, None]
    errors = rng.standard_normal((4000, 6)) @ factor.T
    return RepeatedTrials(errors, np.tile(factor @ factor.T, (4000, 1, 1)))


def test_honest_intervals(honest):
    """Intervals of the true covariance hold the truth as often as they say, and the joint error is one on average."""
    for probability in (0.5, 0.95):
        expected_error = np.sqrt(probability * (1 - probability) / 4000)
        assert np.abs(honest.coverage(probability) - probability).max() < 4 * expected_error
        mean, error = honest.mean_coverage(probability)
        assert abs(mean - probability) < 4 * error
        # Independent trials give at most the error of one parameter, at least that of six independent ones.
        assert 0.95 * expected_error / np.sqrt(6) < error < 1.05 * expected_error
    assert abs(honest.joint.mean() - 1) < 4 * np.sqrt(2 / 6 / 4000)


def test_intervals_that_claim_too_much(honest):
    """At half the true sd a 95 % interval holds the truth 67 % of the time, and the joint error is four-fold."""
    bold = RepeatedTrials(honest.errors, honest.covariances / 4)
    assert abs(bold.mean_coverage(0.95)[0] - 0.6729) < 4 * bold.mean_coverage(0.95)[1]  # erf(1.96 / 2 / sqrt 2)
    np.testing.assert_allclose(bold.joint, 4 * honest.joint, rtol=1e-9)


def test_a_stiff_direction_shows_in_the_joint_error_only():
    """An error of ten sd along the difference of two parameters hides in intervals as wide as their sum."""
    sum_sd, difference_sd = 1.0, 1e-3
    axes = np.array([[1.0, 1.0], [1.0, -1.0]]) / np.sqrt(2)
    covariance = axes.T @ np.diag([sum_sd**2, difference_sd**2]) @ axes
    trials = RepeatedTrials(10 * difference_sd * axes[1][None], covariance[None])
    assert trials.held(0.05).all()
    assert trials.joint[0] == pytest.approx(10**2 / 2, rel=1e-6)


def test_standard_errors_of_a_coverage():
    """They are those of the trials, or of independent intervals where trials agree by chance."""
    assert standard_errors_off((0.9, 0.025), 0.95, 1000) == pytest.approx(-2.0)
    assert standard_errors_off((0.5, 0.0), 0.4, 24) == pytest.approx(0.1 / 0.1)
