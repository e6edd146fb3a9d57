"""Instruments, presets and the quantities that they measure."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from support.refusals import refused

import bayesub as bs
from bayesub.logs.log_files import ACCELERATIONS, HEADERS, STATES
from bayesub.sensors import ADCP, DVL, INS, QUANTITIES, Compass, Pressure, Track, velocity


@pytest.fixture(scope="module")
def flown(full, coupled):
    """The full boat in six degrees of freedom."""
    return bs.simulate(full, coupled, dt=1 / 16)


def test_every_quantity_is_read_from_what_it_is(flown, rng):
    """Without noise and without current readings are the states, with pressure reading z and a compass psi."""
    sensors = [bs.sensors.Sensor(HEADERS[name], sd=1e-13) for name in QUANTITIES]
    record = bs.observe(flown, sensors, rng)
    assert [channel.quantity for channel in record.channels] == list(QUANTITIES)
    sampled = flown.resampled(np.arange(1.0, 49.0))
    motion = dict(zip(STATES, sampled.states[0].T, strict=True))
    motion |= dict(zip(ACCELERATIONS, sampled.accelerations[0].T, strict=True))
    by_name = {channel.name: channel for channel in record.channels}
    assert len(by_name) == len(QUANTITIES)
    assert (by_name["depth"].state, by_name["heading"].state, by_name["u_ground"].state) == ("z", "psi", "u")
    assert {channel.quantity for channel in record.channels if channel.over_ground} == {
        "x", "y", "u_ground", "v_ground", "w_ground", *velocity.OVER_GROUND
    }  # fmt: skip
    for channel in record.channels:
        if channel.state in velocity.QUANTITIES:  # tests/sensors/test_velocity.py
            continue
        np.testing.assert_allclose(channel.values, motion[channel.state], rtol=0, atol=1e-11)


def test_accelerations_are_the_slopes_of_velocities_and_rates(flown, rng):
    """What an INS says of accelerations is the derivative of what a profiler says of velocities and gyros of rates."""
    options = {"interval_s": 1 / 16}
    exact = INS(sd_degps=1e-13, sd_mps2=1e-13, sd_degps2=1e-13, channels=("p", "q", "r", *ACCELERATIONS), **options)
    record = bs.observe(flown, [ADCP(sd_mps=1e-13, **options), exact], rng)
    channels = {channel.quantity: channel for channel in record.channels}
    for name in ACCELERATIONS:
        velocity, slope = channels[name[0]], channels[name].values
        found = CubicSpline(velocity.times, velocity.values)(velocity.times, 1)
        # Away from the start, where a spline has one neighbour only, and until thrust changes branch at 11.5 s, which
        # makes the acceleration jump, a cubic spline is good to (h / time scale)^3 with a time scale above a second.
        inner = slice(8, 170)
        np.testing.assert_allclose(found[inner], slope[inner], rtol=0, atol=16**-3 * np.ptp(slope[inner]))


def test_instruments_give_each_unit_its_noise_and_resolution():
    """sd and resolution are those of the unit of the channel."""
    ins = INS(sd_deg=0.1, sd_degps=0.2, sd_mps2=0.3, sd_degps2=0.4, resolution_mps2=0.5, channels=INS.CHANNELS)
    found = {sensor.column: (sensor.sd, sensor.resolution) for sensor in ins}
    assert len(found) == 12
    assert found["pitch_deg"] == (0.1, 0.0)
    assert found["q_degps"] == (0.2, 0.0)
    assert found["vdot_mps2"] == (0.3, 0.5)
    assert found["rdot_degps2"] == (0.4, 0.0)
    assert [sensor.column for sensor in Pressure(sd_m=0.1)] == ["depth_m"]
    assert [sensor.column for sensor in Compass(resolution_deg=1.0, interval_s=2.0)] == ["heading_deg"]
    assert [sensor.column for sensor in DVL(sd_mps=0.01)] == ["u_ground_mps", "v_ground_mps", "w_ground_mps"]
    assert [sensor.column for sensor in ADCP(sd_mps=0.01, channels=("w", "u"))] == ["w_mps", "u_mps"]
    assert {sensor.interval_s for sensor in Track(1.0, 2.0, 3.0)} == {3.0}
    assert [sensor.sd for sensor in Track(1.0, 2.0)] == [1.0] * 3 + [2.0] * 3


@pytest.mark.parametrize(
    ("make", "kind", "key"),
    [
        (lambda: INS(sd_deg=0.1), "value", "sd"),
        (lambda: DVL(sd_mps=-0.1), "value", "sd"),
        (lambda: DVL(sd_mps=0.1, channels=("u",)), "unknown", "u"),
        (lambda: ADCP(sd_mps=0.1, channels=()), "missing", "channels"),
        (lambda: Compass(sd_deg=1.0, interval_s=0.0), "value", "interval_s"),
        (lambda: bs.sensors.autosub(channels=("u_grund",)), "unknown", "u_grund"),
        (lambda: bs.sensors.thesis_rounding(rate_sd_degps=0.0), "value", "sd"),
    ],
)
def test_bad_instruments(make, kind, key):
    """Refused when made, before any trial."""
    with refused(kind, key):
        make()


def table(sensors):
    return {sensor.column: (sensor.sd, sensor.resolution) for sensor in sensors}


def test_autosub_has_the_numbers_of_its_instruments():
    """Bottom track 0.3 to 0.6 cm/s rounded to 0.1 cm/s, accelerometers 50 micro-g; attitude and rates of an INS."""
    found = table(bs.sensors.autosub())
    for name in "uvw":
        sd, resolution = found[f"{name}_ground_mps"]
        assert 0.003 <= sd <= 0.006
        assert resolution == 0.001
        assert found[f"{name}dot_mps2"] == (pytest.approx(50e-6 * 9.81), 0.0)
    assert set(found) == {"depth_m", "u_ground_mps", "v_ground_mps", "w_ground_mps"} | {
        HEADERS[name] for name in ("phi", "theta", "psi", "p", "q", "r", *ACCELERATIONS)
    }


def test_thesis_rounding_has_the_steps_of_the_thesis():
    """1 cm/s and 1 mm/s^2 of exact values; what the thesis takes as exact is normal with a stated sd."""
    found = table(bs.sensors.thesis_rounding())
    for name in "uvw":
        assert found[f"{name}_mps"] == (0.0, 0.01)
        assert found[f"{name}dot_mps2"] == (0.0, 0.001)
    exact = [column for column, (sd, resolution) in found.items() if sd > 0 and resolution == 0]
    assert set(exact) == {HEADERS[name] for name in ("phi", "theta", "psi", "p", "q", "r", "pdot", "qdot", "rdot")}
    noisy = table(bs.sensors.thesis_rounding(velocity_sd_mps=0.002, channels=("v", "u")))
    assert noisy == {"v_mps": (0.002, 0.01), "u_mps": (0.002, 0.01)}


def test_the_tracking_range_is_a_track():
    assert bs.sensors.tracking_range(interval_s=2.0) == tuple(Track(0.5, 0.1, 2.0))
    assert [sensor.column for sensor in bs.sensors.tracking_range(channels=("yaw", "x"))] == ["yaw_deg", "x_m"]


def test_thesis_data_are_rounded_true_values(flown, rng):
    """Velocities and linear accelerations are the nearest steps to the truth."""
    record = bs.observe(flown, bs.sensors.thesis_rounding(), rng)
    sampled = flown.resampled(record.channels[0].times)
    for channel in record.channels:
        if channel.state in ("u", "v", "w"):
            truth = sampled.states[0, :, STATES.index(channel.state)]
            np.testing.assert_allclose(channel.values, np.round(truth, 2), rtol=0, atol=1e-12)
        if channel.state in ("udot", "vdot", "wdot"):
            truth = sampled.accelerations[0, :, ACCELERATIONS.index(channel.state)]
            np.testing.assert_allclose(channel.values, np.round(truth, 3), rtol=0, atol=1e-12)
