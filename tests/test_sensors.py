"""Sensors and records."""

import numpy as np
import pytest

import bayesub as bs
from bayesub.logs import STATES, read_log


def test_readings_are_the_truth_plus_noise_of_the_stated_size(spiral_track, rng):
    """Noise is normal, unbiased, of the sensor's standard deviation and independent from reading to reading."""
    sensor = bs.sensors.Track(position_sd_m=0.5, attitude_sd_deg=0.1, interval_s=0.1, channels=("x", "yaw"))
    record = bs.observe(spiral_track, sensor, rng)
    for channel, sd in zip(record.channels, (0.5, np.radians(0.1)), strict=True):
        assert channel.sd == pytest.approx(sd, rel=1e-15)
        truth = spiral_track.states[0, 1:, STATES.index(channel.state)]
        noise = (channel.values - truth) / sd
        n = len(noise)
        assert n == 6000
        assert abs(noise.mean()) < 4 / np.sqrt(n)
        assert abs(noise.std() - 1) < 4 / np.sqrt(2 * n)
        assert abs(np.mean(noise[1:] * noise[:-1])) < 4 / np.sqrt(n)


def test_times_are_multiples_of_the_interval(spiral_track, rng):
    """The first reading comes after one interval and the last at the end, also when the interval is a rounded third."""
    record = bs.observe(spiral_track, bs.sensors.Track(1.0, 1.0, interval_s=0.3), rng)
    times = record.channels[0].times
    np.testing.assert_allclose(times, 0.3 * np.arange(1, 2001), rtol=1e-15)
    assert record.n_readings == 6 * 2000


def test_several_sensors_and_the_file_of_a_record(tmp_path, spiral_track, rng):
    """Sensors with intervals of their own make one record, in whose file a missing reading is an empty cell."""
    sensors = [
        bs.sensors.Track(0.5, 0.1, interval_s=2.0, channels=("x", "y")),
        bs.sensors.Track(0.5, 0.1, interval_s=3.0, channels=("yaw",)),
    ]
    record = bs.observe(spiral_track, sensors, rng)
    record.save(tmp_path / "record.csv")
    log = read_log(tmp_path / "record.csv")
    assert set(log) == {"time", "x", "y", "psi"}
    np.testing.assert_allclose(log["x"][np.isfinite(log["x"])], record.channels[0].values, rtol=1e-11)
    np.testing.assert_allclose(log["psi"][np.isfinite(log["psi"])], record.channels[2].values, rtol=1e-11, atol=1e-14)
    assert np.isnan(log["x"][log["time"] == 3.0]).all()


def test_the_same_seed_gives_the_same_record(spiral_track):
    """Every random number comes from the generator that was passed in."""
    sensor = bs.sensors.Track(0.5, 0.1)
    first, again, other = (bs.observe(spiral_track, sensor, np.random.default_rng(seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.channels[0].values, again.channels[0].values)
    assert not np.array_equal(first.channels[0].values, other.channels[0].values)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"position_sd_m": -0.5}, "position_sd_m must be positive, found -0.5"),
        ({"position_sd_m": 0.0}, "position_sd_m must be positive"),
        ({"attitude_sd_deg": np.nan}, "attitude_sd_deg must be positive"),
        ({"interval_s": np.inf}, "interval_s must be positive"),
        ({"channels": ("x", "jaw")}, "unknown channel 'jaw': did you mean 'yaw'"),
        ({"channels": ()}, "channels is empty"),
    ],
)
def test_bad_sensors(options, message):
    """A sensor that cannot exist is refused."""
    with pytest.raises(bs.InputError, match=message):
        bs.sensors.Track(**{"position_sd_m": 0.5, "attitude_sd_deg": 0.1} | options)


def test_an_interval_longer_than_the_trial(spiral_track, rng):
    """A sensor that never reads is refused."""
    with pytest.raises(bs.InputError, match="interval_s 601 is longer than the manoeuvre"):
        bs.observe(spiral_track, bs.sensors.Track(0.5, 0.1, interval_s=601.0), rng)
