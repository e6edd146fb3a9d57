"""Headings of a log, which are known up to whole turns."""

from dataclasses import replace

import numpy as np
import pytest

import bayesub as bs
from bayesub.logs.log_files import write_log
from bayesub.sensors import Compass, Record, Sensor, Track

TURN = 2 * np.pi
SD = 0.5  # deg


@pytest.fixture(scope="module")
def trials(suboff, spiral):
    """trials(heading): the spiral from a start at a heading (deg), and its motion with a reading every second."""

    def make(heading):
        initial = spiral.initial_state.copy()
        initial[5] = np.radians(heading)
        flown = replace(spiral, initial_state=initial)
        return flown, bs.simulate(suboff, flown, dt=1.0, sample=1.0)

    return make


def problem_of(suboff, flown, record):
    prior = bs.priors.relative_normal(0.25)
    return bs.Problem(suboff, flown, record, free=("Xuu", "Yuv", "Nuv"), prior=prior, dt=1.0)


@pytest.mark.parametrize("quantity", ["psi", "heading"])
@pytest.mark.parametrize("start", [0.0, 179.9, 350.0])
@pytest.mark.parametrize("interval", [1, 40, 130])
@pytest.mark.parametrize(
    "column",
    [
        lambda truth, noise: truth % 360 + noise,  # noise about north: -0.05 and 360.1
        lambda truth, noise: (truth + noise) % 360,
        lambda truth, noise: (truth + 180) % 360 - 180 + noise,
        lambda truth, noise: truth + noise,
        lambda truth, noise: truth + noise - 720,
        lambda truth, noise: truth % 720 + noise,
    ],
)
def test_a_perfect_boat_has_residuals_of_order_one(tmp_path, suboff, trials, rng, column, interval, start, quantity):
    """Whatever the range of the column, however long the gaps, and wherever north is."""
    flown, track = trials(start)
    truth = np.degrees(track.states[0, :, 5])
    assert np.ptp(truth) > 360
    noise = SD * rng.standard_normal(len(truth))
    noise[np.argmin(truth % 360)] = -1.5 * SD  # below north, where a turn ends
    rows = np.arange(1, len(truth), interval)
    log = {"time": track.times[rows], quantity: np.radians(column(truth, noise)[rows])}
    write_log(tmp_path / "log.csv", log)
    sensor = Compass(sd_deg=SD) if quantity == "heading" else Sensor("yaw_deg", SD)
    record = Record.load(tmp_path / "log.csv", sensor)
    problem = problem_of(suboff, flown, record)
    residuals = problem.residuals(problem.prior.mean)
    np.testing.assert_allclose(residuals, -noise[None, rows] / SD, rtol=0, atol=1e-6)


def test_a_log_weighs_as_the_record_it_was_written_from(suboff, trials, rng):
    """Within half a turn of the readings nothing changes, to the last bit; a simulated record knows its turns."""
    flown, track = trials(350.0)
    record = bs.observe(track, Track(0.5, 0.1, 5.0, channels=("x", "y", "yaw")), rng)
    modulo = Record(tuple(replace(c, modulo_turn=c.state == "psi") for c in record.channels))
    known, unknown = (problem_of(suboff, flown, one) for one in (record, modulo))
    parameters = known.prior.mean + 0.05 * known.prior.sd * rng.standard_normal((50, 3))
    assert np.abs(known.residuals(parameters)[:, known.rows["yaw"]]).max() < np.radians(180) / np.radians(0.1)
    np.testing.assert_array_equal(known.residuals(parameters), unknown.residuals(parameters))
    np.testing.assert_array_equal(known.log_prob(parameters), unknown.log_prob(parameters))
    # A whole turn more is another motion for the one, and the same reading for the other.
    turned = [replace(c, values=c.values + TURN * (c.state == "psi")) for c in record.channels]
    moved = [
        problem_of(suboff, flown, Record(tuple(replace(c, modulo_turn=flag and c.state == "psi") for c in turned)))
        for flag in (False, True)
    ]
    assert moved[0].log_prob(parameters[:1])[0] < known.log_prob(parameters[:1])[0] - 1e6
    np.testing.assert_allclose(moved[1].log_prob(parameters), known.log_prob(parameters), rtol=1e-9)


def test_failed_simulations_have_no_heading(tmp_path, suboff, trials, rng):
    """They stay not a number."""
    flown, track = trials(0.0)
    record = bs.observe(track, Compass(sd_deg=SD, interval_s=5.0), rng)
    record.save(tmp_path / "log.csv")
    problem = problem_of(suboff, flown, Record.load(tmp_path / "log.csv", Compass(sd_deg=SD)))
    wild = problem.prior.mean * [1.0, -1e4, 1e4]
    assert np.isnan(problem.predicted(wild)).any()
    assert problem.log_prob(wild)[0] == -np.inf
