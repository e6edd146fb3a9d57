"""What is said of logs that were not fitted."""

import json
from dataclasses import replace

import numpy as np
import pytest

import bayesub as bs
from bayesub.findings import unseen
from bayesub.inference.sampling.posterior import Posterior
from bayesub.problem.unseen import UnseenTrial

SENSOR = bs.sensors.Track(0.5, 0.1, interval_s=5.0, channels=("x", "yaw"))


@pytest.fixture(scope="module")
def problem(suboff):
    track = bs.simulate(suboff, bs.load_manoeuvre("zigzag_20_20", suboff), dt=1.0)
    record = bs.observe(track, SENSOR, np.random.default_rng(0))
    prior = bs.priors.relative_normal(0.1)
    return bs.Problem(suboff, track.simulator.manoeuvre, record, free=("Nuv", "Nuu_dr", "Nur"), prior=prior, dt=1.0)


def posterior_at(problem, values, sd=0.0):
    chain = np.random.default_rng(1).normal(values, sd * np.abs(values), (4, 60, 8, problem.n_params))
    names, prior = problem.names, problem.prior
    return Posterior(names, chain, np.zeros(chain.shape[:3]), prior.mean, prior.sd, 10, 0.5, 100, 1.0, {"diverged": 0})


def predicted(problem, values, sd=0.0, name="second"):
    trial = UnseenTrial(name, problem, 0.0)
    return unseen.predicted_trial(trial, problem, posterior_at(problem, values, sd), [], np.random.default_rng(2))


def test_the_truth_predicts_and_a_wrong_set_that_is_sure_of_itself_does_not(problem):
    truth = problem.reference
    numbers = unseen.numbers([predicted(problem, truth), predicted(problem, 1.1 * truth, name="third")])
    assert json.loads(json.dumps(numbers, allow_nan=False)) == numbers
    right, wrong = numbers
    assert right["predicts"]
    assert not wrong["predicts"]
    assert right["crps_over_prior"] < 0.5
    assert right["channels"]["yaw"]["rms"]["posterior"] == pytest.approx(0.1, rel=0.3)
    assert right["false_alarms"] == pytest.approx(0.025)
    text = unseen.sentence(numbers, 1)["prediction"]
    assert text.startswith("third is NOT PREDICTED: ")
    assert "second is predicted" in text
    assert "whatever its residuals say" in text


def test_draws_that_do_not_fly_the_log_are_counted_in_the_words(problem):
    """Of a prediction that holds and of one that does not."""
    (one,) = unseen.numbers([predicted(problem, problem.reference, 0.01)])
    assert one["n_draws"] > one["failed_draws"]["posterior"] == 0
    assert "does not complete" not in one["sentence"]
    prediction = predicted(problem, problem.reference, 0.01)
    some = replace(prediction.posterior, n_failed=7)
    vars(some).update({key: value for key, value in vars(prediction.posterior).items() if key not in vars(some)})
    predictions = prediction.predictions | {"posterior": some}
    (one,) = unseen.numbers([replace(prediction, predictions=predictions)])
    lost = f"With 7 of {one['n_draws']} draws of the posterior the boat does not complete second; they are left out."
    assert one["sentence"].endswith(lost)
    assert unseen._sentence(one | {"predicts": False}).endswith(lost)


def test_trials_that_have_not_been_left_out_are_counted(problem):
    (one,) = unseen.numbers([predicted(problem, problem.reference)])
    trials = [one | {"kind": "left out"}]
    assert "Of 3 trials 1 have been left out." in unseen.sentence(trials, 3, 3)["prediction"]
    assert "have been left out" not in unseen.sentence(trials * 3, 3, 3)["prediction"]
    assert "have been left out" not in unseen.sentence([one], 3, 3)["prediction"]


def test_a_prediction_that_is_as_wide_as_the_prior_says_so(problem):
    numbers = unseen.numbers([predicted(problem, problem.prior.mean, sd=0.1)])
    assert "no better than the prior" in unseen.sentence(numbers, 1)["prediction"]


def test_a_boat_that_does_not_complete_the_log_does_not_predict(problem):
    numbers = unseen.numbers([predicted(problem, -50.0 * problem.reference)])
    assert json.loads(json.dumps(numbers, allow_nan=False)) == numbers
    assert not numbers[0]["predicts"]
    assert "does not complete it" in unseen.sentence(numbers, 1)["prediction"]


def test_of_simulated_trials_nothing_is_missing():
    assert unseen.sentence([], 0) == {}
    assert "second log" in unseen.sentence([], 1)["prediction"]
    assert "all 3 logs are fitted" in unseen.sentence([], 3)["prediction"]
