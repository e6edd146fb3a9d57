"""The page of a prediction where there is nothing to draw."""

import json

import numpy as np
import pytest

import bayesub as bs
from bayesub.findings import unseen
from bayesub.findings.predicted_trial import STATES, PredictedTrial, predicted_motion
from bayesub.findings.unseen import POSTERIOR, PRIOR
from bayesub.inference.sampling.posterior import Posterior
from bayesub.problem.unseen import UnseenTrial
from bayesub.report import prediction_page

TIMES = np.linspace(0.0, 10.0, 5)


@pytest.fixture
def readings(suboff, rng):
    """The prediction of a log by draws with which the boat does not complete it."""
    track = bs.simulate(suboff, bs.load_manoeuvre("zigzag_20_20", suboff), dt=1.0)
    record = bs.observe(track, bs.sensors.Track(0.5, 0.1, interval_s=5.0, channels=("x", "yaw")), rng)
    prior = bs.priors.relative_normal(0.1)
    problem = bs.Problem(suboff, track.simulator.manoeuvre, record, free=("Nuv", "Nur"), prior=prior, dt=1.0)
    chain = np.tile(-50.0 * problem.reference, (4, 60, 8, 1))
    given = problem.prior.mean, problem.prior.sd, 10, 0.5, 100, 1.0, {"diverged": 0}
    posterior = Posterior(problem.names, chain, np.zeros(chain.shape[:3]), *given)
    return unseen.predicted_trial(UnseenTrial("second", problem, 0.0), problem, posterior, [], rng)


def test_a_boat_that_does_not_complete_it_has_no_figures_and_says_so(suboff, readings, rng, tmp_path):
    states = rng.standard_normal((100, len(TIMES), len(STATES)))
    motions = {
        POSTERIOR: predicted_motion(TIMES, np.full_like(states, np.nan)),
        PRIOR: predicted_motion(TIMES, states),
    }
    trial = PredictedTrial("first", suboff, motions, readings)
    numbers = trial.numbers
    assert json.loads(json.dumps(numbers, allow_nan=False)) == numbers
    assert numbers["sentences"]["motion"] == "With most draws of the posterior the boat does not complete second."
    assert "NOT PREDICTED" in numbers["sentences"]["prediction"]
    assert prediction_page.figures(trial) == []
    prediction_page.sheet(trial).write(tmp_path / "page.html")
    assert "does not complete second" in (tmp_path / "page.html").read_text()
