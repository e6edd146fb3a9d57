"""The search that follows the mode from large noise and a short record, where ordinary searches end in local modes."""

import importlib
from dataclasses import replace

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.inference.baselines import continuation, gauss_newton, posterior_mode

FREE = ("Xu", "Xvv", "Yv", "Yr", "Yd", "Yvvv", "Yvvr", "Nv", "Nr", "Nd", "Nvvv", "Nvvr")
ZIGZAG = """
name = "zigzag"
kind = "zigzag"
subproblem = "horizontal"
duration_s = 2400.0
plane = "rudder"
angle_deg = 15.0
reversal_deg = 15.0
executes = 40
start_s = 5.0
"""
module = importlib.import_module("bayesub.inference.baselines.posterior_mode")


def ship(n_v):
    """The Mariner with another moment by drift: of 2.5 times it, and less damping, no straight motion is stable."""
    mariner = bs.load_vehicle("mariner")
    xi, names = mariner.xi.copy(), mariner.equations.names
    xi[names.index("Nv")] *= n_v
    xi[names.index("Nr")] *= 0.8
    return replace(mariner, xi=xi)


def posed(tmp_path, n_v, spread):
    """Forty minutes of a zig-zag, and a prior whose every mean is a standard deviation off."""
    boat, rng = ship(n_v), np.random.default_rng(1)
    (tmp_path / "zigzag.toml").write_text(ZIGZAG)
    zigzag = bs.load_manoeuvre(tmp_path / "zigzag.toml", boat)
    track = bs.sensors.Track(position_sd_m=0.5, attitude_sd_deg=0.1, interval_s=4.0, channels=("x", "y", "yaw"))
    record = bs.observe(bs.simulate(boat, zigzag), track, rng)
    centre, columns = boat.xi.copy(), boat.equations.columns(FREE)
    centre[columns] *= 1.0 + spread * np.sign(rng.standard_normal(len(FREE)))
    return bs.Problem(boat, zigzag, record, free=FREE, prior=bs.priors.relative_normal(spread, centre), dt=1.0)


@pytest.fixture(scope="module")
def unstable(tmp_path_factory):
    """A long record of an unstable ship, with guesses that are half off."""
    return posed(tmp_path_factory.mktemp("unstable"), 2.5, 0.5)


def deviance_per_reading(problem, values):
    """One at the truth, nearly."""
    return problem.misfit(values[None])[1][0] / len(problem.readings)


@pytest.mark.slow
def test_the_mode_of_a_long_record_of_an_unstable_ship(unstable):
    """From a draw of the prior Gauss-Newton ends in a local mode, continuation at the truth."""
    (start,) = unstable.prior.sample(np.random.default_rng(3), 1)
    ordinary, mode = gauss_newton(unstable, start), continuation(unstable, start)
    assert deviance_per_reading(unstable, ordinary.values) > 2.0  # negative control
    assert deviance_per_reading(unstable, mode.values) < 1.1
    assert mode.statuses == ("converged",)
    off = (mode.values - unstable.reference) / np.sqrt(np.diag(mode.covariance))
    assert np.sum(off**2) < 35.0  # the 99.95 % point of chi-square with twelve degrees of freedom


def test_the_mode_does_not_depend_on_the_start(unstable):
    """From draws of the prior it is the same."""
    mode = continuation(unstable)
    for start in unstable.prior.sample(np.random.default_rng(3), 2):
        assert continuation(unstable, start).costs[0] == pytest.approx(mode.costs[0], abs=0.01)


@pytest.mark.slow
def test_the_search_of_a_run_continues_where_starts_disagree(tmp_path, monkeypatch):
    """The posterior mode that samplers begin from is that of continuation; the guesses are 70 % off."""
    problem = posed(tmp_path, 2.5, 0.7)
    monkeypatch.setattr(module, "_SEARCHES", 1)
    mode = posterior_mode(problem, rng=np.random.default_rng(0))
    assert mode.method == "posterior mode by continuation"
    assert deviance_per_reading(problem, mode.values) < 1.1


def test_an_ordinary_problem_is_searched_as_ever(tmp_path, monkeypatch):
    """With a stable ship and fair guesses two searches agree and fit, and their mode is taken, bit for bit."""
    problem = posed(tmp_path, 1.0, 0.1)
    monkeypatch.setattr(module, "continuation", None)
    mode = posterior_mode(problem, rng=np.random.default_rng(0))
    np.testing.assert_array_equal(mode.values, gauss_newton(problem).values)


def test_a_bad_fit_that_continuation_does_not_better_is_left_as_it_is(tmp_path):
    """Readings with five times their noise: both searches end at the same mode, and the ordinary one stays."""
    problem = posed(tmp_path, 1.0, 0.1)
    off = problem.readings - problem.predicted(problem.reference[None])[0]
    noisy = problem.with_readings(problem.readings + 4.0 * off)
    mode = posterior_mode(noisy, rng=np.random.default_rng(0))
    assert deviance_per_reading(noisy, mode.values) > 10.0
    np.testing.assert_array_equal(mode.values, gauss_newton(noisy).values)


def test_a_start_that_completes_only_a_part_of_the_record(tmp_path):
    """A ship that drift drives leaves the range of the equations; the search begins with what she completes."""
    problem = posed(tmp_path, 1.0, 0.1)
    start = problem.prior.mean.copy()
    start[problem.names.index("Yv")] *= -3.0
    with pytest.raises(ValueError, match="fails at the start"):
        gauss_newton(problem, start)
    assert continuation(problem, start).costs[0] == pytest.approx(gauss_newton(problem).costs[0], abs=0.01)


def test_a_beginning_of_the_record_predicts_the_same(unstable):
    """Its readings are the first of each channel, and its predictions those of the whole record."""
    part = unstable.truncated(600.0)
    values = unstable.reference[None]
    whole = unstable.predicted(values)[0]
    for name, rows in part.rows.items():
        first = slice(unstable.rows[name].start, unstable.rows[name].start + rows.stop - rows.start)
        np.testing.assert_array_equal(part.readings[rows], unstable.readings[first])
        np.testing.assert_allclose(part.predicted(values)[0, rows], whole[first], rtol=1e-13)
    assert part.duration == 600.0
    assert unstable.truncated(unstable.duration) is unstable
    joint = bs.JointProblem({"a": unstable, "b": part})
    assert joint.duration == unstable.duration
    assert joint.truncated(300.0).duration == 300.0


def test_a_record_begins_with_a_reading_of_each_channel(unstable):
    """A time before the first reading leaves one reading a channel."""
    assert unstable.truncated(0.0).record.n_readings == 3


def test_a_problem_that_no_search_completes(tmp_path):
    """One clear line."""
    problem = posed(tmp_path, 1.0, 0.1)
    hopeless = bs.JointProblem({"only": problem})
    hopeless.misfit = lambda batch: (np.full((len(batch), 3), np.nan), np.full(len(batch), np.inf))
    hopeless.within = hopeless.smoothed = lambda _: hopeless
    with refused("model", "prior"):
        posterior_mode(hopeless, rng=np.random.default_rng(0))
