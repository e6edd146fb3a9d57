"""Trials of boats from the prior."""

import numpy as np
import pytest

import bayesub as bs
from bayesub.problem import likelihoods
from thesis.prior_trials import PriorTrials

SENSORS = bs.sensors.thesis_rounding(velocity_sd_mps=1e-3, acceleration_sd_mps2=1e-4)


@pytest.fixture(scope="module")
def trials():
    return PriorTrials(
        "npsauv", "horizontal", SENSORS, free=bs.coefficients.NAMES, prior=bs.priors.relative_normal(0.25)
    )


def test_a_trial_is_a_draw_from_the_model(trials, rng):
    """Truths are spread as the prior is; readings are whole steps, and true to a step of them."""
    truth, problem, n_failed = trials.trial(rng)
    assert n_failed == 0
    assert problem.names == trials.problem.names
    t = problem.prior.standard(truth)
    assert np.abs(t).max() < 4
    assert t.std() == pytest.approx(1.0, abs=4 / np.sqrt(2 * len(t)))
    channel = problem.record.channels[0]
    np.testing.assert_allclose(channel.values / 0.01, np.round(channel.values / 0.01), atol=1e-9)
    off = problem.predicted(truth)[0, : len(channel.values)] - channel.values
    assert np.abs(off).max() < 0.5 * 0.01 + 6 * 0.001
    assert isinstance(problem.noises[0], likelihoods.Rounded)
    assert isinstance(problem.naive().noises[0], likelihoods.Normal)


def test_a_likelihood_may_have_another_sd_than_the_sensors(trials):
    """The same record, and normal noise with the total sd times the factor."""
    _, problem, _ = trials.trial(np.random.default_rng(1))
    _, other, _ = trials.trial(np.random.default_rng(1), sd_factor=0.5)
    np.testing.assert_array_equal(problem.readings, other.readings)
    for channel, noise in zip(other.record.channels, other.noises, strict=True):
        assert isinstance(noise, likelihoods.Normal)
        assert noise.sd == 0.5 * channel.total_sd
