"""The study of rounded readings: its trials, and what it makes of them."""

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest

import bayesub as bs
from bayesub.checks.coverage import RepeatedTrials
from bayesub.problem import likelihoods
from bayesub.study import script


@pytest.fixture(scope="module")
def study():
    path = Path(__file__).parents[2] / "studies" / "rounded.py"
    spec = importlib.util.spec_from_file_location("study_rounded", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def case(study):
    return study.Case("npsauv", "horizontal", study.PRESETS["thesis_rounding"]())


def test_a_trial_is_a_draw_from_the_model(case, rng):
    """Truths are spread as the prior is; readings are whole steps, and true to a step of them."""
    truth, problem = case.trial(rng)
    assert problem.names == case.problem.names
    t = problem.prior.standard(truth)
    assert np.abs(t).max() < 4
    assert t.std() == pytest.approx(1.0, abs=4 / np.sqrt(2 * len(t)))
    channel = problem.record.channels[0]
    np.testing.assert_allclose(channel.values / 0.01, np.round(channel.values / 0.01), atol=1e-9)
    off = problem.predicted(truth)[0, : len(channel.values)] - channel.values
    assert np.abs(off).max() < 0.5 * 0.01 + 6 * 0.001
    assert isinstance(problem.noises[0], likelihoods.Rounded)
    assert isinstance(problem.naive().noises[0], likelihoods.Normal)


def test_linear_least_squares_on_fine_readings(study, rng):
    """With hardly any noise and no rounding the linear fit finds the truth that was drawn, the held ones told."""
    fine = bs.sensors.autosub(
        velocity_sd_mps=1e-12,
        velocity_resolution_mps=0.0,
        acceleration_sd_mps2=1e-12,
        attitude_sd_deg=1e-10,
        rate_sd_degps=1e-11,
        angular_acceleration_sd_degps2=1e-11,
    )
    case = study.Case("npsauv", "horizontal", fine)
    truth, problem = case.trial(rng)
    held = ["Yvdot", "Nvdot", "Nrdot"]
    found, place = case.linear(truth, problem, held)
    assert set(found.names) | set(held) == set(problem.names)
    errors = np.abs(found.values / truth[place] - 1)
    # Noise of 1e-12 of the motion, times the 1e6 or so by which the most collinear columns amplify it.
    assert errors.max() < 1e-5


def test_largest_ratio(study, rng):
    """The direction in which one covariance exceeds another the most is found whatever their scales."""
    root = rng.standard_normal((4, 4)) * 10.0 ** np.arange(4)[:, None]
    covariance = root @ root.T
    stretched = root @ np.diag([1.0, 9.0, 0.25, 1.0]) @ root.T
    assert study.largest_ratio(stretched, covariance) == pytest.approx(9.0, rel=1e-9)


def test_summary(case):
    """A constant error of one sd is the bias, in sd and over the truth, of every coefficient."""
    sds = 0.1 * case.problem.prior.sd
    trials = RepeatedTrials(np.tile(sds, (5, 1)), np.tile(np.diag(sds**2), (5, 1, 1)))
    result = case.summary(case.problem.names, trials)
    np.testing.assert_allclose(result["bias_in_sd"], 1.0)
    np.testing.assert_allclose(result["bias_over_truth"], 0.025, rtol=1e-3)
    assert set(result["coverage_95"]) == {1.0}
    assert set(result["coverage_50"]) == {0.0}
    assert result["joint"] == pytest.approx(1.0)


def test_a_finished_part_is_read_back(tmp_path):
    """What a file holds is not computed again."""
    file = tmp_path / "part.json"
    first = script.resumed(file, lambda: {"errors": [0.1 + 0.2]})
    assert script.resumed(file, lambda: pytest.fail("computed again")) == first == json.loads(file.read_text())
