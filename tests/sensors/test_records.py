"""Records to and from files."""

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.logs.log_files import ACCELERATIONS, read_log, write_log
from bayesub.sensors import ADCP, INS, Channel, Compass, Record, Sensor, Track, modified


@pytest.fixture
def everything():
    """Sensors with intervals of their own, gaps, dropouts and rounding, every quantity but z and yaw."""
    return [
        modified(bs.sensors.autosub(channels=None, interval_s=3.0), gaps=((100, 200),), dropout=0.1),
        bs.sensors.tracking_range(interval_s=7.0, channels=("x", "y")),
        ADCP(resolution_mps=0.01, interval_s=0.7),
        Compass(sd_deg=0.5, resolution_deg=1.0, interval_s=5.0),
    ]


def test_a_record_reads_back_as_it_was(tmp_path, spiral_track, rng, everything):
    """Each channel keeps its times, its values to the digits of the file, and its noise."""
    record = bs.observe(spiral_track, everything, rng)
    record.save(tmp_path / "record.csv")
    back = Record.load(tmp_path / "record.csv", everything)
    assert len(record.channels) == 1 + 3 + 12 + 2 + 3 + 1
    assert back.truth is None
    assert back.n_readings == record.n_readings
    for old, new in zip(record.channels, back.channels, strict=True):
        assert (new.quantity, new.sd, new.resolution) == (old.quantity, old.sd, old.resolution)
        np.testing.assert_allclose(new.times, old.times, rtol=1e-11)
        np.testing.assert_allclose(new.values, old.values, rtol=1e-11, atol=1e-14)


def test_missing_cells_are_missing_readings(tmp_path, spiral_track, rng, everything):
    """The file has a row for every time of any channel, and an empty cell where a channel has no reading."""
    record = bs.observe(spiral_track, everything, rng)
    record.save(tmp_path / "record.csv")
    log = read_log(tmp_path / "record.csv")
    for channel in record.channels:
        assert np.isfinite(log[channel.quantity]).sum() == len(channel.times) < len(log["time"])
    assert np.isnan(log["u_ground"][(log["time"] >= 100) & (log["time"] <= 200)]).all()


def test_a_track_file_is_a_record_with_its_controls_left_out(tmp_path, spiral_track):
    """What `simulate` writes is read with sensors for its motion; rudder, planes and rpm need none."""
    spiral_track.save(tmp_path / "track.csv")
    ins = INS(sd_degps=0.1, sd_mps2=0.1, sd_degps2=0.1, channels=("p", "q", "r", *ACCELERATIONS))
    record = Record.load(tmp_path / "track.csv", [Track(0.5, 0.1), ADCP(sd_mps=0.1), ins])
    assert len(record.channels) == 18
    np.testing.assert_allclose(record.channels[5].values, spiral_track.states[0, :, 5], rtol=1e-11, atol=1e-13)


def test_times_that_differ_by_round_off_share_a_row(tmp_path, spiral_track, rng):
    """90 times 0.7 s and 9 times 7 s are both 63 s, and are not the same number."""
    sensors = [Sensor("x_m", 1.0, interval_s=0.7), Sensor("y_m", 1.0, interval_s=7.0)]
    record = bs.observe(spiral_track, sensors, rng)
    assert record.channels[0].times[89] != record.channels[1].times[8]
    record.save(tmp_path / "record.csv")
    assert len(read_log(tmp_path / "record.csv")["time"]) == len(record.channels[0].times)


@pytest.mark.parametrize("column", ["yaw_deg", "heading_deg", "yaw_rad"])
@pytest.mark.parametrize("centre", [0.0, 180.0])
def test_wrapped_headings_are_unwrapped(tmp_path, spiral_track, rng, column, centre):
    """A heading that a log keeps within a turn comes back without jumps, across missing cells too."""
    quantity = Sensor(column, 1.0).quantity
    record = bs.observe(spiral_track, modified(Sensor(column, 0.01), interval_s=5.0, dropout=0.3), rng)
    (channel,) = record.channels
    assert np.ptp(channel.values) > 2 * np.pi
    log = {"time": np.arange(1, 601.0), quantity: np.full(600, np.nan)}
    wrapped = (channel.values - np.radians(centre) + np.pi) % (2 * np.pi) - np.pi + np.radians(centre)
    log[quantity][np.round(channel.times).astype(int) - 1] = wrapped
    write_log(tmp_path / "log.csv", log)
    (back,) = Record.load(tmp_path / "log.csv", Sensor(column, 0.01)).channels
    np.testing.assert_allclose(back.values, channel.values, rtol=0, atol=1e-9)
    # A trial that was logged from another heading on: the first reading is taken near that.
    (back,) = Record.load(tmp_path / "log.csv", Sensor(column, 0.01), start_heading_deg=725.0).channels
    np.testing.assert_allclose(back.values, channel.values + 4 * np.pi, rtol=0, atol=1e-9)


def test_a_heading_that_leaves_the_turn_is_left_alone(tmp_path):
    """Continuous yaw is not unwrapped, however long its steps; a wrapped one takes the short way round."""
    for yaw, expected in (([0, 200, 400], [0, 200, 400]), ([0, 200, 40], [0, -160, -320]), ([350, 10], [-10, 10])):
        write_log(tmp_path / "log.csv", {"time": np.arange(len(yaw)), "psi": np.radians(yaw)})
        (channel,) = Record.load(tmp_path / "log.csv", Sensor("yaw_deg", 0.1)).channels
        np.testing.assert_allclose(np.degrees(channel.values), expected, rtol=0, atol=1e-9)


def test_noise_about_north_is_no_turn(tmp_path):
    """A column of 0 to 360 deg that noise leads below zero or above a turn comes back without jumps."""
    write_log(tmp_path / "log.csv", {"time": np.arange(5.0), "psi": np.radians([359.9, 0.1, -0.05, 360.2, 0.3])})
    (channel,) = Record.load(tmp_path / "log.csv", Sensor("yaw_deg", 0.1)).channels
    np.testing.assert_allclose(np.degrees(channel.values), [-0.1, 0.1, -0.05, 0.2, 0.3], rtol=0, atol=1e-9)
    assert channel.modulo_turn


@pytest.mark.parametrize(
    ("text", "sensors", "kind", "key"),
    [
        ("time_s,x_m,y_m\n1,2,3\n", Sensor("x_m", 1.0), "conflict", "y_m"),
        ("time_s,x_m\n1,2\n", [Sensor("x_m", 1.0), Sensor("u_mps", 1.0)], "missing", "u_mps"),
        ("time_s,x_m,y_m\n1,2,\n", Track(1.0, 1.0, channels=("x", "y")), "data", "y_m"),
        ("time_s,x_m\n1,two\n", Sensor("x_m", 1.0), "data", "x_m"),
        ("time_s,yaw_degs\n1,2\n", Sensor("yaw_deg", 1.0), "unknown", "yaw_degs"),
    ],
)
def test_files_that_do_not_fit_the_sensors(tmp_path, text, sensors, kind, key):
    """Refused in one line with file, column and remedy."""
    path = tmp_path / "log.csv"
    path.write_text(text)
    with refused(kind, key) as error:
        Record.load(path, sensors)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


def test_bad_records():
    """No channels, a channel without readings, and two of one name."""
    x = Channel("x", np.array([1.0]), np.array([2.0]), 0.5)
    with refused("missing", "channels"):
        Record(())
    with refused("data", "yaw"):
        Record((x, Channel("psi", np.array([]), np.array([]), 0.5)))
    with refused("conflict", "x"):
        Record((x, x))
