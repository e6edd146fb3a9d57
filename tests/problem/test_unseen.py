"""What the parameters of an unseen trial are, given draws of those of fitted ones."""

import numpy as np
import pytest

import bayesub as bs
from bayesub.problem import likelihoods
from bayesub.problem.unseen import UnseenTrial

SENSOR = bs.sensors.Track(0.5, 0.1, interval_s=5.0, channels=("x", "y", "yaw"))
NUISANCE = {
    "u0_mps": bs.priors.normal(7.5, 0.1),
    "current_north_mps": bs.priors.normal(0.0, 0.2),
    "bias_yaw_deg": bs.priors.normal(0.0, 1.0),
    "sd_yaw_deg": bs.priors.log_normal(0.1, 0.5),
    "mass_kg": bs.priors.normal(4e6, 1e5),
    "bias_rudder_deg": bs.priors.normal(0.0, 1.0),
}
YAW = likelihoods.Normal(np.radians(0.1))
OF_LOG = ("u0_mps", "current_north_mps", "bias_yaw_deg")


@pytest.fixture(scope="module")
def posed(suboff):
    """posed(free, ..): a problem of the horizontal spiral."""
    track = bs.simulate(suboff, bs.load_manoeuvre("turning_circle", suboff), dt=1.0)
    record = bs.observe(track, SENSOR, np.random.default_rng(0))
    prior = bs.priors.relative_normal(0.25)

    def problem(free=("Xuu", "Nuv"), nuisance=NUISANCE, yaw=YAW):
        given = {"free": free, "prior": prior, "nuisance": nuisance, "noise": {"yaw": yaw}, "dt": 1.0}
        return bs.Problem(suboff, track.simulator.manoeuvre, record, **given)

    return problem


def test_boat_and_noise_are_transferred_and_the_log_keeps_its_own(posed, rng):
    fitted, problem = posed(), posed()
    trial = UnseenTrial("second", problem, 10.0)
    assert tuple(problem.names[k] for k in trial.own(fitted)) == OF_LOG
    draws = fitted.prior.sample(rng, 50)
    parameters = trial.transferred(fitted, draws, rng)
    known = [k for k, name in enumerate(problem.names) if name not in OF_LOG]
    np.testing.assert_array_equal(parameters[:, known], draws[:, known])
    assert not np.any(parameters[:, trial.own(fitted)] == draws[:, trial.own(fitted)])


def test_what_no_fitted_trial_tells_comes_from_the_prior(posed, rng):
    """A coefficient and a parameter of the boat; sd of noise that was not inferred is the log's own."""
    fitted = posed(nuisance={"u0_mps": NUISANCE["u0_mps"]})
    problem = posed(free=("Xuu", "Nuv", "Nur"))
    trial = UnseenTrial("second", problem, 10.0)
    assert tuple(problem.names[k] for k in trial.own(fitted)) == (*OF_LOG, "sd_yaw_deg")
    parameters = trial.transferred(fitted, fitted.prior.sample(rng, 2000), rng)
    for name in ("Nur", "mass_kg"):
        k = problem.names.index(name)
        assert parameters[:, k].std() == pytest.approx(problem.prior.sd[k], rel=4 / np.sqrt(4000))


def test_noise_of_several_trials_is_that_of_any_of_them(posed, rng):
    """Two trials with noise of different size: half of the draws have that of each."""
    joint = bs.JointProblem({"first": posed(), "second": posed()})
    draws = np.repeat(joint.prior.mean[None], 1000, axis=0)
    draws[:, joint.names.index("sd_yaw_deg[first]")] = 1.0
    draws[:, joint.names.index("sd_yaw_deg[second]")] = 2.0
    problem = posed()
    parameters = UnseenTrial("third", problem, 10.0).transferred(joint, draws, rng)
    values, counts = np.unique(parameters[:, problem.names.index("sd_yaw_deg")], return_counts=True)
    assert tuple(values) == (1.0, 2.0)
    assert abs(counts[0] - 500) < 64  # four standard errors


def test_noise_of_a_size_that_is_integrated_out_is_as_large_as_the_fitted_errors(posed):
    """The guess of the sd is ten times too large; the errors of the truth are 0.1 degrees."""
    nuisance, yaw = {"u0_mps": NUISANCE["u0_mps"]}, likelihoods.UnknownSd(np.radians(1.0))
    fitted, problem = (posed(nuisance=nuisance, yaw=yaw) for _ in range(2))
    trial = UnseenTrial("second", problem, 10.0).with_fitted_noise(fitted, fitted.reference)
    _, noise = trial.problem.channels["yaw"]
    n = len(problem.channels["yaw"][0].times)
    assert np.degrees(noise.sd) == pytest.approx(0.1, rel=4 / np.sqrt(2 * n))
    assert trial.problem.channels["x"] == problem.channels["x"]
    same = UnseenTrial("second", posed(), 10.0)
    assert same.with_fitted_noise(fitted, fitted.reference) is same
