"""What minutes, sensors and towing-tank values bring."""

from dataclasses import replace

import numpy as np
import pytest

from bayesub.design import worth
from bayesub.design.information import Information
from bayesub.design.judge import Judge
from bayesub.problem.likelihoods import Normal
from bayesub.problem.priors import normal
from bayesub.sensors import DVL, Pressure, Track
from bayesub.sensors.sensor import channel_name

STEP = 2.0


@pytest.fixture(scope="module")
def judge(boat):
    sensors = (*Track(0.5, 0.1, interval_s=5.0), *Pressure(sd_m=0.1, interval_s=5.0))
    return Judge(boat, sensors, free=("Xuu", "Yuv", "Nuv", "Nur", "Nuu_dr"), step_s=STEP)


def test_a_minute_is_a_shorter_trial(judge, manoeuvre):
    minutes = worth.by_minute(judge, manoeuvre, (2.0, 5.0, manoeuvre.duration / 60.0))
    n = int(np.searchsorted(manoeuvre.times, 120.0)) + 1
    history = {key: getattr(manoeuvre, key)[:n] for key in ("times", "controls", "rpm")}
    (shorter,) = judge.information(replace(manoeuvre, **history))
    assert minutes[2.0].relative_sd == pytest.approx(shorter.relative_sd, rel=1e-6)
    (whole,) = judge.information(manoeuvre)
    *early, last = minutes.values()
    assert last.relative_sd == pytest.approx(whole.relative_sd, rel=1e-12)
    assert np.all(early[0].relative_sd >= early[1].relative_sd)
    assert np.all(early[1].relative_sd >= last.relative_sd)


def test_a_channel_left_out(judge, manoeuvre):
    channels = worth.by_sensor(judge, manoeuvre)
    assert list(channels) == ["x", "y", "z", "roll", "pitch", "yaw", "depth"]
    for channel, sensor in zip(channels, judge.sensors, strict=True):
        (without,) = replace(judge, sensors=tuple(set(judge.sensors) - {sensor})).information(manoeuvre)
        assert channels[channel].relative_sd == pytest.approx(without.relative_sd, rel=1e-9)


def test_a_better_instrument_reads_when_the_present_one_does_with_its_own_noise(judge, manoeuvre):
    """Whether the noise of the present one stands with its sensors or in the study, and whatever it is called."""
    present = [replace(sensor, instrument="log") for sensor in DVL(sd_mps=0.01, interval_s=2.0)]
    better, nuisance = DVL(sd_mps=0.001), {"clock_log_s": normal(0.0, 0.1)}
    noise = {channel_name(sensor.quantity): Normal(0.01) for sensor in present}
    given = replace(judge, sensors=tuple(present), nuisance=nuisance)
    by_sensors, by_study = (
        worth.further_sensors(one, manoeuvre, {"log": better})["log"] for one in (given, replace(given, noise=noise))
    )
    sharp = tuple(replace(sensor, sd=0.001) for sensor in present)
    (expected,) = replace(given, sensors=sharp).information(manoeuvre)
    assert by_sensors.relative_sd == pytest.approx(expected.relative_sd, rel=1e-9)
    assert by_study.relative_sd == pytest.approx(expected.relative_sd, rel=1e-9)
    unknown = replace(given, noise=noise, nuisance=nuisance | {"sd_u_ground_mps": normal(0.01, 0.002)})
    found = worth.further_sensors(unknown, manoeuvre, {"log": better})["log"]
    assert found.relative_sd == pytest.approx(expected.relative_sd, rel=1e-9)


def test_a_further_sensor_adds_or_takes_the_place_of_one_that_reads_the_same(judge, manoeuvre):
    log = DVL(sd_mps=0.005, interval_s=5.0)
    extra = worth.further_sensors(judge, manoeuvre, {"log": log, "pressure": Pressure(sd_m=0.1, interval_s=5.0)})
    (present,) = judge.information(manoeuvre)
    assert np.all(extra["log"].relative_sd <= present.relative_sd)
    assert extra["log"].relative_sd[0] < 0.9 * present.relative_sd[0]
    assert extra["pressure"].relative_sd == pytest.approx(present.relative_sd, rel=1e-9)


def told(gram):
    n = len(gram)
    return Information(tuple("abcdef"[:n]), np.ones(n), np.full(n, 0.25), np.eye(n), np.array(gram))


def test_the_first_value_from_a_tank_is_the_one_that_unlocks_most():
    """A sum of a, b and c is known exactly, d by itself: any of a, b or c tells of the others, d of none."""
    row = np.array([1.0, 2.0, 1.0, 0.0])
    information = told(1e8 * np.outer(row, row) + np.diag([0.0, 0.0, 0.0, 9.0]))
    first, second, *_ = worth.unlocking(information, 1e-3, 4)
    gains = {}
    for k in range(4):
        rest = np.delete(np.arange(4), k)
        after = information.with_known([k], 1e-3)
        gains["abcd"[k]] = np.mean(np.log(information.posterior_sd / after.posterior_sd)[rest])
    assert first.name == max(gains, key=gains.__getitem__)
    assert first.gain == pytest.approx(gains[first.name], rel=1e-6)
    assert "d" not in (first.name, second.name)
    both = information.with_known(["abcd".index(first.name), "abcd".index(second.name)], 1e-3)
    assert second.n_known == both.n_known(0.1)


def test_half_of_the_gain_takes_the_relative_sd_that_is_said(rng):
    rows = rng.standard_normal((3, 6)) * 30.0
    information = told(rows.T @ rows)
    (first,) = worth.unlocking(information, 1e-4, 1)
    k = information.names.index(first.name)
    sds = np.array([1e-9, first.half_gain_sd]) * abs(information.values[k]) / information.prior_sd[k]
    sharp, half = (worth.gain(information.covariance, k, sd) for sd in sds)
    assert half == pytest.approx(0.5 * sharp, rel=1e-6)
    assert worth.gain(information.covariance, k, 1e3) == pytest.approx(0.0, abs=1e-5)


def test_a_coefficient_that_is_zero_is_not_taken_from_a_tank():
    """It has no relative sd."""
    zero = replace(told(np.zeros((2, 2))), values=np.array([1.0, 0.0]))
    assert [value.name for value in worth.unlocking(zero, 0.05, 2)] == ["a"]
