"""Hard cases of the search for the mode: each ends where a search from the truth does, and plain searches do not."""

from dataclasses import replace

import numpy as np
import pytest
from support.toys import Banana

import bayesub as bs
from bayesub.inference.baselines import gauss_newton, posterior_mode
from bayesub.model.coefficients import HORIZONTAL, NAMES
from bayesub.problem.likelihoods import AR1, Normal, Rounded, StudentT

SEVEN = ("Xuu", "Yuv", "Yur", "Nuv", "Nur", "Yuu_dr", "Nuu_dr")
SAME = 0.1  # of twice a log density
TRACK = bs.sensors.Track(0.5, 0.1, 4.0, ("x", "y", "yaw"))


@pytest.fixture(scope="module")
def record(spiral_track):
    """A position to half a metre and a heading to a tenth of a degree every four seconds."""
    return bs.observe(spiral_track, TRACK, np.random.default_rng(1))


def off(suboff, spread, seed):
    """A guess whose every coefficient is off by about the spread, to either side."""
    return suboff.xi * (1.0 + spread * np.clip(np.random.default_rng(seed).standard_normal(len(suboff.xi)), -1.8, 1.8))


def lowest(problem):
    """Where a search from the truth ends."""
    return gauss_newton(problem, problem.reference, max_iterations=200).costs[0]


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_student_t_noise_from_a_far_start(suboff, spiral, record, seed):
    """From afar every reading is an outlier, and a plain search stays there."""
    noise = {channel.name: StudentT(channel.sd, 4.0) for channel in record.channels}
    prior = bs.priors.relative_normal(0.6, off(suboff, 0.6, seed))
    problem = bs.Problem(suboff, spiral, record, free=SEVEN, prior=prior, dt=1.0, noise=noise)
    rng = np.random.default_rng(seed)
    problem = problem.with_readings(problem.replicated(problem.reference, rng)[0])
    assert gauss_newton(problem).costs[0] > lowest(problem) + 1e3  # negative control
    assert posterior_mode(problem, rng=rng).costs[0] == pytest.approx(lowest(problem), abs=SAME)


@pytest.mark.parametrize("seed", [2, 5])
def test_uniform_priors_on_the_spiral(suboff, spiral, record, seed):
    """Of a prior that is flat within 75 % of a guess, with the truth anywhere in it; the valley is bent and walled."""
    inside = np.random.default_rng(seed).uniform(-0.7, 0.7, len(suboff.xi))
    prior = bs.priors.relative_uniform(0.75, suboff.xi / (1.0 + inside))
    problem = bs.Problem(suboff, spiral, record, free=HORIZONTAL, prior=prior, dt=1.0)
    mode = posterior_mode(problem, rng=np.random.default_rng(seed))
    assert mode.costs[0] == pytest.approx(lowest(problem), abs=SAME)
    assert mode.jacobians < 200  # with straight steps a thousand


@pytest.mark.parametrize("seed", [3, 4])
def test_seven_of_fifty_free_coefficients(suboff, seed):
    """Whatever few of the terms of all six equations are free, from guesses that are half off."""
    rng = np.random.default_rng(seed)
    manoeuvre = bs.load_manoeuvre("coupled", suboff)
    sensors = bs.sensors.tracking_range(position_sd_m=0.5, interval_s=4.0)
    record = bs.observe(bs.simulate(suboff, manoeuvre, dt=0.5), sensors, rng)
    active = [name for name, value in zip(NAMES, suboff.xi, strict=True) if value != 0.0]
    fifty = rng.permutation(active)[:50]
    prior = bs.priors.relative_normal(0.5, off(suboff, 0.5, seed))
    problem = bs.Problem(suboff, manoeuvre, record, free=fifty[:7], prior=prior, dt=1.0)
    mode = posterior_mode(problem, rng=rng)
    assert mode.costs[0] == pytest.approx(lowest(problem), abs=SAME)


def test_a_thin_and_bent_valley_is_gone_along_in_long_steps():
    """The floor is a parabola, on which a straight step of length h is h^2 off; the mode is at its middle."""
    problem = Banana(width=1e-3, reach=100.0)
    found = gauss_newton(problem, np.array([3.0, -9.0]), max_iterations=200)
    np.testing.assert_allclose(found.values, 0.0, atol=1e-2)
    assert problem.costs.jacobians < 40


@pytest.mark.parametrize("noise", [Normal(0.5), Rounded(0.5, 0.1), AR1(0.5, 30.0), StudentT(0.5, 4.0)])
def test_noise_that_is_widened_is_noise_with_a_larger_sd(suboff, spiral, record, noise):
    """Also where its sd is inferred; what else the noise has stays."""
    prior = bs.priors.relative_normal(0.25)
    pose = {"free": ("Xuu", "Nuv"), "prior": prior, "dt": 1.0}
    plain, wide = (bs.Problem(suboff, spiral, record, noise={"x": replace(noise, sd=sd)}, **pose) for sd in (0.5, 2.0))
    values = plain.prior.mean
    by_view, by_noise = plain.widened(4.0).log_likelihoods(values), wide.log_likelihoods(values)
    np.testing.assert_allclose(by_view["x"], by_noise["x"], rtol=1e-12)
    unknown = {"sd_x_m": bs.priors.log_normal(0.5, 0.7)}
    inferred = bs.Problem(suboff, spiral, record, noise={"x": noise}, nuisance=unknown, **pose)
    joint = bs.JointProblem({"a": inferred})
    values = np.append(values, 0.5)
    np.testing.assert_allclose(inferred.widened(4.0).log_likelihoods(values)["x"], by_noise["x"], rtol=1e-12)
    assert joint.widened(4.0).log_likelihood(values) == inferred.widened(4.0).log_likelihood(values)
    assert joint.heavy_tailed == plain.heavy_tailed == isinstance(noise, StudentT)
