"""Sensors and records."""

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.logs.log_files import STATES, read_log


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
    ("options", "kind", "key"),
    [
        ({"position_sd_m": -0.5}, "value", "position_sd_m"),
        ({"position_sd_m": 0.0}, "value", "position_sd_m"),
        ({"attitude_sd_deg": np.nan}, "value", "attitude_sd_deg"),
        ({"interval_s": np.inf}, "value", "interval_s"),
        ({"channels": ("x", "jaw")}, "unknown", "jaw"),
        ({"channels": ()}, "missing", "channels"),
    ],
)
def test_bad_sensors(options, kind, key):
    """A sensor that cannot exist is refused."""
    with refused(kind, key):
        bs.sensors.Track(**{"position_sd_m": 0.5, "attitude_sd_deg": 0.1} | options)


def test_an_interval_longer_than_the_trial(spiral_track, rng):
    """A sensor that never reads is refused."""
    with refused("value", "interval_s"):
        bs.observe(spiral_track, bs.sensors.Track(0.5, 0.1, interval_s=601.0), rng)


N = 200_000
TIMES = 0.1 * np.arange(1, N + 1)
RAMP = np.sqrt(2) * TIMES  # never in step with a resolution


def errors(sensor, rng):
    """Errors of many readings of a ramp, in the unit of the sensor's column."""
    times, values = sensor.read(TIMES, RAMP, rng)
    return (values - np.interp(times, TIMES, RAMP)) / sensor.factor


@pytest.mark.parametrize(
    ("options", "mean", "variance", "fourth"),
    [
        ({"sd": 0.3}, 0.0, 0.09, 3 * 0.3**4),
        ({"sd": 0.3, "bias": -0.7}, -0.7, 0.09, 3 * 0.3**4),
        ({"resolution": 0.5}, 0.0, 0.5**2 / 12, 0.5**4 / 80),
        # Noise of a step makes the rounding error uniform and independent but for exp(-2 pi^2) (Sheppard).
        ({"sd": 0.5, "resolution": 0.5}, 0.0, 0.25 + 0.25 / 12, 3 * 0.5**4 + 6 * 0.25 * 0.25 / 12 + 0.5**4 / 80),
        (
            {"sd": 0.3, "outlier_probability": 0.05, "outlier_scale": 6.0},
            0.0,
            0.09 * (0.95 + 0.05 * 36),
            3 * 0.3**4 * (0.95 + 0.05 * 6**4),
        ),
    ],
)
@pytest.mark.parametrize("column", ["x_m", "yaw_deg"])
def test_moments_of_the_errors(rng, column, options, mean, variance, fourth):
    """Mean and variance are those of normal noise, bias, uniform rounding error (step^2 / 12) and outliers."""
    found = errors(bs.sensors.Sensor(column, **options), rng)
    assert abs(found.mean() - mean) < 4 * np.sqrt(variance / N)
    assert abs(found.var() - variance) < 4 * np.sqrt((fourth - variance**2) / N)


def test_the_total_sd_of_a_channel_is_that_of_noise_and_rounding(spiral_track, rng):
    """sqrt(sd^2 + step^2 / 12) in SI units, whatever the unit of the column."""
    sensor = bs.sensors.Sensor("yaw_deg", sd=0.2, resolution=0.2)
    (channel,) = bs.observe(spiral_track, sensor, rng).channels
    assert channel.total_sd == pytest.approx(np.radians(0.2) * np.sqrt(13 / 12), rel=1e-14)
    assert errors(sensor, rng).std() == pytest.approx(0.2 * np.sqrt(13 / 12), rel=4 / np.sqrt(2 * N))


def test_noise_then_bias_then_rounding():
    """With the same random numbers a rounded reading is the nearest step to the reading that is not rounded."""

    def values(**options):
        return bs.sensors.Sensor("u_mps", sd=0.02, **options).read(TIMES, RAMP, np.random.default_rng(1))[1]

    np.testing.assert_allclose(values(bias=0.3), values() + 0.3, rtol=1e-15)
    rounded = values(bias=0.3, resolution=0.01)
    np.testing.assert_allclose(rounded / 0.01, np.round(values(bias=0.3) / 0.01), rtol=1e-15)


def test_dropouts_and_gaps(rng):
    """Readings go missing independently with the stated probability, and all between the ends of a gap."""
    times, values = bs.sensors.Sensor("x_m", sd=1.0, dropout=0.2).read(TIMES, RAMP, rng)
    assert len(times) == len(values)
    assert abs(len(times) - 0.8 * N) < 4 * np.sqrt(0.2 * 0.8 * N)
    missing = ~np.isin(TIMES, times)
    assert abs(np.mean(missing[1:] & missing[:-1]) - 0.04) < 4 * np.sqrt(0.04 / N)
    times, _ = bs.sensors.Sensor("x_m", sd=1.0, gaps=[(0.25, 0.5), (3.0, 9.0)]).read(TIMES[:100], RAMP[:100], rng)
    np.testing.assert_allclose(times, [0.1, 0.2, *np.arange(6, 30) / 10, *np.arange(91, 101) / 10], rtol=1e-14)


def test_readings_at_given_times(spiral_track, rng):
    """The first may be at the start and the last at the end; the truth is that of just these times."""
    times = (0.0, 17.3, 600.0)
    sensor = bs.sensors.Sensor("u_mps", sd=1e-12, times=times)
    (channel,) = bs.observe(spiral_track, sensor, rng).channels
    np.testing.assert_array_equal(channel.times, times)
    truth = spiral_track.states[0, [0, 173, 6000], STATES.index("u")]
    np.testing.assert_allclose(channel.values, truth, atol=1e-10)


def test_every_choice_is_reproducible(spiral_track):
    """Noise, outliers and dropouts come from the generator alone."""
    sensor = bs.sensors.Sensor("x_m", 0.5, 0.1, dropout=0.3, outlier_probability=0.1, gaps=((20, 30),))
    first, again = (bs.observe(spiral_track, sensor, np.random.default_rng(5)).channels[0] for _ in range(2))
    np.testing.assert_array_equal(first.times, again.times)
    np.testing.assert_array_equal(first.values, again.values)


@pytest.mark.parametrize(
    ("options", "kind", "key"),
    [
        ({"column": "u_kts"}, "unknown", "u_kts"),
        ({"column": "yaw"}, "unknown", "yaw"),
        ({"column": "rudder_deg"}, "unknown", "rudder_deg"),
        ({"sd": 0.0}, "value", "sd"),
        ({"sd": -1.0}, "value", "sd"),
        ({"sd": np.nan}, "value", "sd"),
        ({"resolution": -0.1}, "value", "resolution"),
        ({"bias": np.inf}, "value", "bias"),
        ({"dropout": 1.0}, "value", "dropout"),
        ({"dropout": -0.1}, "value", "dropout"),
        ({"outlier_probability": 1.5}, "value", "outlier_probability"),
        ({"outlier_scale": 0.0}, "value", "outlier_scale"),
        ({"sd": 0.0, "resolution": 0.1, "outlier_probability": 0.1}, "missing", "sd"),
        ({"interval_s": 0.0}, "value", "interval_s"),
        ({"gaps": [(3.0, 2.0)]}, "value", "gaps"),
        ({"gaps": [(3.0,)]}, "value", "gaps"),
        ({"times": (1.0, 1.0)}, "value", "times"),
        ({"times": ()}, "value", "times"),
    ],
)
def test_sensors_that_cannot_exist(options, kind, key):
    """Each is refused in one line that names the sensor and the setting."""
    with refused(kind, key) as error:
        bs.sensors.Sensor(**{"column": "x_m", "sd": 1.0} | options)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("sensors", "kind", "key"),
    [
        ([], "missing", "sensors"),
        ("x_m", "value", "sensors"),
        (3, "value", "sensors"),
        ([bs.sensors.Track(1.0, 1.0), bs.sensors.Sensor("yaw_rad", 0.1)], "conflict", "yaw"),
        (bs.sensors.Sensor("x_m", 1.0, times=(1.0, 600.1)), "value", "times"),
        (bs.sensors.Sensor("x_m", 1.0, times=(-1.0, 1.0)), "value", "times"),
        (bs.sensors.Sensor("x_m", 1.0, times=(np.nan,)), "value", "times"),
        (bs.sensors.Sensor("x_m", 1.0, gaps=((0, 601),)), "data", "x_m"),
    ],
)
def test_sensors_that_do_not_fit_a_trial(spiral_track, rng, sensors, kind, key):
    """Each is refused in one line that names the channel."""
    with refused(kind, key) as error:
        bs.observe(spiral_track, sensors, rng)
    assert "\n" not in str(error.value)


def test_modified_sensors():
    """Some or all sensors get other settings, and the rest stay as they are."""
    track = bs.sensors.Track(0.5, 0.1)
    changed = bs.sensors.modified(track, ["yaw"], bias=2.0)
    assert [sensor.bias for sensor in changed] == [0.0] * 5 + [2.0]
    assert bs.sensors.modified(track) == tuple(track)
    assert {sensor.dropout for sensor in bs.sensors.modified(track, dropout=0.1)} == {0.1}
    with refused("unknown", "yow"):
        bs.sensors.modified(track, ["yow"], bias=2.0)
