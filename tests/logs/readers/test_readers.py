"""Every reader gives back what the library of its format wrote."""

import contextlib
import gzip
import sqlite3
import sys
import warnings

import numpy as np
import pytest
from support import vehicle_logs
from support.refusals import refused
from support.vehicle_logs import COMPASS, FINS, GPS, MINUTE, START, WRITERS

from bayesub.io import toml_files
from bayesub.io.errors import InputError
from bayesub.logs import conversion, readers
from bayesub.logs.log_map import LogMap, read_map

# Column of the example maps -> what was flown, and how coarse a format may make it.
FLOWN = {
    "rudder_deg": (MINUTE.fin, 0.07),
    "roll_deg": (MINUTE.roll, 0.01),
    "pitch_deg": (MINUTE.pitch, 0.01),
    "heading_deg": (MINUTE.heading, 0.01),
    "yaw_deg": (lambda t: 350.0 + 2.0 * t, 1e-9),
    "r_degps": (lambda t: MINUTE.r(t) + 0.0 * t, 1e-6),
    "depth_m": (MINUTE.depth, 1e-3),
    "latitude_deg": (MINUTE.latitude, 2e-7),
    "longitude_deg": (MINUTE.longitude, 2e-7),
    "speed_over_ground_mps": (lambda t: MINUTE.speed + 0.0 * t, 1e-4),
    "course_over_ground_deg": (lambda t: MINUTE.course + 0.0 * t, 1e-4),
    "x_m": (lambda t: 1.5 * t, 1e-9),
    "y_m": (lambda t: 0.1 * t, 1e-9),
}
FLOWN |= {"stern_plane_deg": (MINUTE.fin, 1e-6), "mass_m": (lambda t: 0.01 + 0.0 * t, 1e-9)}
FLOWN["speed_through_water_mps"] = (lambda t: 1.2 + 0.0 * t, 1e-9)
FLOWN["buoyancy_cm3"] = (lambda t: 500.0 + t, 1e-3)
FLOWN |= {f"fin_{k + 1}_deg": (lambda t, k=k: MINUTE.fin(t, k), 1e-6) for k in range(4)}
ORDERS = ("rpm",)


def example(kind, folder, **options):
    """The log of the writer of a kind, by the example map."""
    file = toml_files.built_in("maps")[kind]
    log_map = read_map(file, kind)
    return conversion.convert(readers.read(kind, [WRITERS[kind](folder, **options)], log_map), log_map, file)


def cells(result, column):
    filled = np.isfinite(result.columns[column])
    return result.times[filled], result.columns[column][filled]


def test_every_kind_has_a_map_and_an_example():
    assert set(readers.KINDS) == set(toml_files.built_in("maps")) == set(WRITERS)


@pytest.mark.parametrize("kind", [kind for kind in WRITERS if kind != "kvlcc2"])
def test_a_log_comes_back_as_it_was_flown(kind, tmp_path):
    result = example(kind, tmp_path)
    for column in result.columns.keys() - set(ORDERS):
        flown, tolerance = FLOWN[column]
        times, values = cells(result, column)
        off = values - flown(times)
        off = (off + 180.0) % 360.0 - 180.0 if "heading" in column else off
        assert np.abs(off).max() <= tolerance, column
    assert len(result.times) > 10


@pytest.mark.parametrize(
    ("kind", "column", "n"), [("ros", "fin_1_deg", 600), ("imc", "heading_deg", 300), ("csv", "latitude_deg", 60)]
)
def test_each_signal_keeps_its_own_times(kind, column, n, tmp_path):
    times, _ = cells(example(kind, tmp_path), column)
    assert len(times) == n
    np.testing.assert_allclose(times, np.arange(n) * 60.0 / n, atol=1e-6)


def test_a_bag_without_filled_headers_has_the_times_of_recording(tmp_path):
    """And SQLite as its storage; a single file of a bag is read too."""
    path = vehicle_logs.ros(tmp_path, "bag", "SQLITE3", with_header=False)
    log = readers.read("ros", [path])
    np.testing.assert_allclose(log.signals["/imu.orientation.yaw"].times - START, COMPASS + 0.02, atol=1e-6)
    assert log.signals["/imu.orientation.yaw"].unit == "rad"
    assert not [name for name in log.signals if "covariance[" in name or "STATUS" in name]
    assert readers.read("ros", [path / "bag.db3"]).signals.keys() == log.signals.keys()


def test_messages_of_the_vehicle_s_own_are_read(tmp_path):
    """A bag of today defines them; for an older one the map names the files."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    (tmp_path / "fins_msgs" / "msg").mkdir(parents=True)
    definition = "std_msgs/Header header\nfloat32[4] angle\nfloat32 rpm\n"
    (tmp_path / "fins_msgs" / "msg" / "Fins.msg").write_text(definition)
    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg(definition, "fins_msgs/msg/Fins"))
    kinds = store.types
    with Writer(tmp_path / "bag", version=8, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connection = writer.add_connection("/tail", "fins_msgs/msg/Fins", typestore=store)
        for k in range(3):
            header = kinds["std_msgs/msg/Header"](kinds["builtin_interfaces/msg/Time"](k, 0), "")
            message = kinds["fins_msgs/msg/Fins"](header, np.arange(4, dtype=np.float32) + k, 900.0)
            writer.write(connection, k * 10**9, store.serialize_cdr(message, "fins_msgs/msg/Fins"))
    log = readers.read("ros", [tmp_path / "bag"])
    np.testing.assert_allclose(log.signals["/tail.angle[3]"].values, [3.0, 4.0, 5.0])
    bag = next((tmp_path / "bag").glob("*.db3"))
    with contextlib.closing(sqlite3.connect(bag)) as base, base:  # as bags were until 2023
        base.execute("DELETE FROM message_definitions")
    with refused("format"):
        readers.read("ros", [tmp_path / "bag"])
    log = readers.read("ros", [tmp_path / "bag"], LogMap(definitions=(str(tmp_path / "fins_msgs"),)))
    np.testing.assert_allclose(log.signals["/tail.rpm"].values, 900.0)


def test_joints_have_names(tmp_path):
    """Their order may change from message to message."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds, kind = store.types, "sensor_msgs/msg/JointState"
    with Writer(tmp_path / "bag", version=8, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connection = writer.add_connection("/joints", kind, typestore=store)
        for k in range(4):
            header = kinds["std_msgs/msg/Header"](kinds["builtin_interfaces/msg/Time"](k, 0), "")
            names, angles = [*zip(("rudder", "stern_plane"), (0.1, 0.2), strict=True)], np.zeros(0)
            names, at = zip(*(names[:: -1 if k % 2 else 1]), strict=True)
            message = kinds[kind](header, list(names), np.array(at) * k, angles, angles)
            writer.write(connection, k * 10**9, store.serialize_cdr(message, kind))
    log = readers.read("ros", [tmp_path / "bag"])
    np.testing.assert_allclose(log.signals["/joints.position[rudder]"].values, [0.0, 0.1, 0.2, 0.3])
    np.testing.assert_allclose(log.signals["/joints.position[stern_plane]"].values, [0.0, 0.2, 0.4, 0.6])
    assert not [name for name in log.signals if "velocity" in name]


def test_named_values_of_telemetry_are_signals_of_their_own(tmp_path):
    path = vehicle_logs.telemetry(tmp_path, named={"ballast": lambda t: 3.0 + t, "leak": lambda t: 0.0 * t})
    log = readers.read("mavlink", [path])
    times = COMPASS
    np.testing.assert_allclose(log.signals["NAMED_VALUE_FLOAT[ballast].value"].values, 3.0 + times, rtol=1e-6)
    np.testing.assert_array_equal(log.signals["NAMED_VALUE_FLOAT[leak].value"].values, 0.0)
    columns = {"mass_m": {"signal": "NAMED_VALUE_FLOAT[ballast].value", "unit": "m"}}
    assert len(readers.read("mavlink", [path], LogMap(columns=columns)).signals) == 2


def test_telemetry_has_the_times_of_the_autopilot(tmp_path):
    """Messages came 0.1 or 0.2 s late; those with a time of their own are even."""
    log = readers.read("mavlink", [vehicle_logs.telemetry(tmp_path)])
    yaw, servo = log.signals["ATTITUDE.yaw"], log.signals["SERVO_OUTPUT_RAW.servo1_raw"]
    assert (yaw.unit, servo.unit, log.signals["GLOBAL_POSITION_INT.lat"].unit) == ("rad", "us", "degE7")
    np.testing.assert_allclose(np.diff(yaw.times), 0.2, atol=1e-6)
    assert np.diff(servo.times).max() == pytest.approx(0.3, abs=1e-3)
    np.testing.assert_allclose(np.degrees(yaw.values), MINUTE.heading(COMPASS), atol=1e-4)


def test_units_are_those_of_the_autopilot(tmp_path):
    log = readers.read("mavlink", [WRITERS["mavlink"](tmp_path)])
    units = {name: log.signals[name].unit for name in ("ATT.Yaw", "BARO[0].Alt", "GPS[0].Lat", "GPS[0].Spd")}
    assert units == {"ATT.Yaw": "deg", "BARO[0].Alt": "m", "GPS[0].Lat": "deglatitude", "GPS[0].Spd": "m/s"}


def test_a_map_makes_large_logs_quick(tmp_path):
    """Only the messages that it names are read; a name that is missing has all of them to be compared with."""
    path = WRITERS["mavlink"](tmp_path)
    log_map = LogMap(columns={"heading_deg": {"signal": "ATT.Yaw"}})
    assert {name.partition(".")[0] for name in readers.read("mavlink", [path], log_map).signals} == {"ATT"}
    log_map = LogMap(columns={"heading_deg": {"signal": "ATT.Yow"}})
    with refused("unknown", "columns.heading_deg.signal"):
        conversion.convert(readers.read("mavlink", [path], log_map), log_map, tmp_path / "m.toml")


def test_stamps_of_a_logger_count_more_than_those_of_sentences(tmp_path):
    import pynmea2

    path, sentence = tmp_path / "compass.txt", str(pynmea2.HDT("HE", "HDT", ("10.0", "T")))
    stamps = {"1000.5,": 1000.5, "2026-05-01T10:00:00 ": 1777629600.0, "\\s:gps,c:1700000000*5A\\": 1.7e9}
    for stamp, time in stamps.items():
        path.write_text(stamp + sentence + "\n")
        assert readers.read("nmea", [path]).signals["HEHDT.heading"].times == pytest.approx([time])
    path.write_text(sentence + "\n")
    with refused("data"):
        readers.read("nmea", [path])


def test_nmea_past_midnight_and_a_damaged_sentence(tmp_path):
    import pynmea2

    path, place = (
        tmp_path / "gps.nmea",
        ("4110.8", "N", "00842.0", "W", "1", "8", "1.0", "0.0", "M", "0.0", "M", "", ""),
    )
    lines = [str(pynmea2.GGA("GP", "GGA", (clock, *place))) for clock in ("235959.00", "000001.00", "000002.00")]
    path.write_text("\n".join([*lines[:2], lines[2].replace("4110", "4210")]))
    log = readers.read("nmea", [path])
    assert np.diff(log.signals["GPGGA.latitude"].times) == pytest.approx([2.0])
    assert log.remarks == ("1 of 3 sentences are damaged and left out",)
    path.write_text(lines[2].replace("4110", "4210"))
    with refused("data"):
        readers.read("nmea", [path])


def positions(days_and_seconds):
    import pynmea2

    for day, second in days_and_seconds:
        place = (f"4110.{second:02d}", "N", "00842.0", "W", "3.0", "10.0", f"{day:02d}0521", "", "")
        yield str(pynmea2.RMC("GP", "RMC", (f"1000{second:02d}.00", "A", *place)))


STAMPS = {  # before sentence k -> the seconds between sentences
    "ms since 1970": lambda k: f"{1_619_863_200_000 + 1000 * k} ",
    "ms in a tag": lambda k: f"\\c:{1_619_863_200_000 + 1000 * k}*00\\",
    "a count": lambda k: f"{k // 5} ",
    "a number of a port": lambda _: "10110 ",
    "none": lambda _: "",
}


@pytest.mark.parametrize("stamp", STAMPS.values(), ids=STAMPS)
def test_numbers_before_sentences_are_times_if_they_run_as_those_inside(stamp, tmp_path):
    lines = [stamp(k) + line for k, line in enumerate(positions((1, k) for k in range(12)))]
    (tmp_path / "gps.nmea").write_text("\n".join(lines))
    times = readers.read("nmea", [tmp_path / "gps.nmea"]).signals["GPRMC.latitude"].times
    np.testing.assert_allclose(times, 1_619_863_200.0 + np.arange(12))


def test_nmea_of_several_days(tmp_path):
    lines = positions((day, k) for day in (1, 3) for k in range(5))
    other_ship = "!AIVDM,1,1,,B,177KQJ5000G?tO`K>RA1wUbN0TKH,0*5C"
    (tmp_path / "gps.nmea").write_text("\n".join([*lines, other_ship]))
    times = readers.read("nmea", [tmp_path / "gps.nmea"]).signals["GPRMC.latitude"].times
    np.testing.assert_allclose(times - times[0], [*range(5), *range(172800, 172805)])
    assert not readers.read("nmea", [tmp_path / "gps.nmea"]).remarks


def test_messages_of_several_entities_are_kept_apart(tmp_path):
    import imcpy

    packets = []
    for entity, label, psi in ((7, "AHRS", 0.1), (8, "Navigation", 0.2)):
        info, angles = imcpy.EntityInfo(), imcpy.EulerAngles()
        info.id, info.label, angles.psi = entity, label, psi
        for message in (info, angles):
            message.timestamp, message.src, message.src_ent = 1.0, 25, entity
            packets.append(imcpy.Packet.serialize(message))
    (tmp_path / "Data.lsf").write_bytes(b"".join(packets))
    signals = readers.read("imc", [tmp_path / "Data.lsf"]).signals
    assert signals["EulerAngles@AHRS.psi"].values == pytest.approx([0.1])
    assert signals["EulerAngles@Navigation.psi"].values == pytest.approx([0.2])


def test_values_of_imc_with_units_of_their_own_and_of_two_vehicles(tmp_path):
    """A speed that is ordered in m/s and in rpm is two signals; two vehicles may both have an AHRS."""
    import imcpy

    packets = []
    for source, speed, unit in ((25, 1.5, imcpy.SpeedUnits.METERS_PS), (26, 900.0, imcpy.SpeedUnits.RPM)):
        info, order, angles = imcpy.EntityInfo(), imcpy.DesiredSpeed(), imcpy.EulerAngles()
        info.id, info.label, order.value, order.speed_units, angles.psi = 7, "AHRS", speed, unit, 0.1 * source
        for message in (info, order, angles):
            message.timestamp, message.src, message.src_ent = 1.0, source, 7
            packets.append(imcpy.Packet.serialize(message))
    (tmp_path / "Data.lsf").write_bytes(b"".join(packets))
    signals = readers.read("imc", [tmp_path / "Data.lsf"]).signals
    assert signals["DesiredSpeed@25.AHRS.value[METERS_PS]"].unit == "m/s"
    assert signals["DesiredSpeed@26.AHRS.value[RPM]"].unit == "rpm"
    assert signals["EulerAngles@26.AHRS.psi"].values == pytest.approx([2.6])


def test_what_comes_before_the_end_of_a_broken_lsf_is_read(tmp_path):
    whole = gzip.decompress(WRITERS["imc"](tmp_path).read_bytes())
    (tmp_path / "cut.lsf").write_bytes(whole[: len(whole) // 2 + 3])
    (tmp_path / "cut.lsf.gz").write_bytes(gzip.compress(whole)[:20000])
    for name in ("cut.lsf", "cut.lsf.gz"):
        log = readers.read("imc", [tmp_path / name])
        assert 10 < len(log.signals["ServoPosition[0].value"].times) < len(FINS)
        assert log.remarks == ("the file ends within a message; what comes before is read",)


def test_an_estimated_state_has_its_place_on_earth(tmp_path):
    """Metres from a reference become latitude and longitude."""
    import imcpy

    state = imcpy.EstimatedState()
    state.timestamp, state.lat, state.lon, state.x = 1.0, np.radians(41.0), np.radians(-8.0), 1000.0
    (tmp_path / "Data.lsf").write_bytes(imcpy.Packet.serialize(state))
    signals = readers.read("imc", [tmp_path / "Data.lsf"]).signals
    assert np.degrees(signals["EstimatedState.latitude"].values) == pytest.approx([41.0 + 1000.0 / 111048.0], abs=2e-5)


def test_the_cache_of_a_glider_is_looked_for(tmp_path):
    """Beside the log, and in a folder that the map names; without it the message names it. Nothing is written."""
    path = WRITERS["slocum"](tmp_path)
    before = set(tmp_path.iterdir())
    n_signals = len(readers.read("slocum", [path]).signals)
    assert set(tmp_path.iterdir()) == before
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "1a2b3c4d.cac").rename(tmp_path / "elsewhere" / "1A2B3C4D.CAC")
    with refused("missing", "cache"):
        readers.read("slocum", [path])
    log = readers.read("slocum", [path], LogMap(cache=str(tmp_path / "elsewhere")))
    assert len(log.signals) == n_signals


def test_a_file_of_a_real_glider():
    """One that dbdreader brings along, of the computer for science, with its parameters in itself."""
    import dbdreader

    path = next(toml_files.Path(dbdreader.__file__).parent.glob("data/amadeus-2014-204-05-000.ebd"))
    log = readers.read("slocum", [path])
    assert log.signals["sci_water_pressure"].unit == "bar"


def test_a_damaged_header_of_a_glider_is_not_searched_for_ever(tmp_path):
    path = WRITERS["slocum"](tmp_path)
    whole = path.read_bytes()
    for line in (b"num_ascii_tags:    1\n", b"num_ascii_togs:    14\n", b"num_ascii_tags:    999999999\n"):
        path.write_bytes(whole.replace(b"num_ascii_tags:    14\n", line))
        with refused("format"):
            readers.read("slocum", [path])


def test_a_damaged_log_of_ardupilot_says_so(tmp_path, capfd):
    """And nothing is written to the terminal by others."""
    path = WRITERS["mavlink"](tmp_path)
    whole = bytearray(path.read_bytes())
    whole[5000:5100] = bytes(100)
    path.write_bytes(whole)
    log = readers.read("mavlink", [path])
    assert 500 < len(log.signals["RCOU.C1"].times) < 600
    assert log.remarks == ("parts of the file are damaged and left out",)
    assert capfd.readouterr() == ("", "")


def test_matlab_files_of_both_formats_agree(tmp_path):
    old, new = (readers.read("matlab", [WRITERS["matlab"](tmp_path, n)]) for n in ("trial.mat", "trial73.mat"))
    assert old.signals.keys() == new.signals.keys()
    for name, signal in old.signals.items():
        np.testing.assert_array_equal(signal.values, new.signals[name].values)
    assert old.remarks == ("left out, since no time is as long: gains",)


def test_the_times_of_a_matlab_file_may_have_any_name(tmp_path):
    from scipy import io

    io.savemat(tmp_path / "a.mat", {"clock": np.arange(5.0) * 1000.0, "psi": np.arange(5.0)})
    with refused("missing", "time.signal"):
        readers.read("matlab", [tmp_path / "a.mat"])
    with refused("unknown", "time.signal"):
        readers.read("matlab", [tmp_path / "a.mat"], LogMap(time={"signal": "clok"}))
    log = readers.read("matlab", [tmp_path / "a.mat"], LogMap(time={"signal": "clock", "unit": "ms"}))
    np.testing.assert_array_equal(log.signals["psi"].times, np.arange(5.0))


@pytest.mark.parametrize("signal", ["imu[0]", "imu[:,0]", "imu(:,1)"])
def test_the_times_of_a_matlab_file_may_be_a_column_of_a_matrix(signal, tmp_path):
    """And another matrix may have a clock of its own."""
    from scipy import io

    t = np.arange(0.0, 20.0, 0.1)
    matrices = {"imu": np.c_[t, np.sin(t)], "gps": np.stack([1e3 * t[::10], t[::10]]), "psi": t}
    io.savemat(tmp_path / "a.mat", matrices)
    with refused("missing", "time.signal"):
        readers.read("matlab", [tmp_path / "a.mat"])
    tables = {"gps": {"signal": "gps[:,0]", "unit": "ms"}}
    log_map = LogMap(time={"signal": signal, "tables": tables}, columns={"r_degps": {"signal": "imu(:,2)"}})
    signals = readers.read("matlab", [tmp_path / "a.mat"], log_map).signals
    np.testing.assert_array_equal(signals["imu(:,2)"].values, np.sin(t))
    for name, times in (("imu(:,2)", t), ("psi", t), ("gps[1]", t[::10])):
        np.testing.assert_allclose(signals[name].times, times)
    with refused("unknown", "time.tables.gpss"):
        readers.read("matlab", [tmp_path / "a.mat"], LogMap(time={"signal": signal, "tables": {"gpss": tables["gps"]}}))


@pytest.mark.parametrize("version", ["v7", "v7.3"])
def test_tables_and_arrays_of_structures_of_matlab(version, tmp_path, monkeypatch):
    """Timetables have their own times, structures of a reading each become vectors, others keep their numbers."""
    import pandas as pd

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the library, to pandas
        import matio
    t = np.arange(0.0, 5.0, 0.25)
    start = pd.Timestamp("2026-05-01")
    timetable = pd.DataFrame({"psi": 3.0 * t}, index=start + pd.to_timedelta(t, unit="s"))
    readings = np.array(list(zip(t, 4.0 * t, strict=True)), dtype=[("t", object), ("z", object)])
    runs = np.array([(t, t), (t[:9], 2.0 * t[:9])], dtype=[("t", object), ("q", object)])
    content = {"T": pd.DataFrame({"Time": t, "r": 2.0 * t}), "TT": timetable, "log": readings, "run": runs}
    content["boat"] = {"nav": {"time": t, "u": t}}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the library, to pandas
        matio.save_to_mat(str(tmp_path / "a.mat"), mdict=content, version=version)
    with monkeypatch.context() as patch, refused("install", "mat-io"):
        patch.setitem(sys.modules, "matio", None)
        readers.read("matlab", [tmp_path / "a.mat"])
    signals = readers.read("matlab", [tmp_path / "a.mat"]).signals
    assert set(signals) == {"T.r", "TT.psi", "log.z", "run[0].q", "run[1].q", "boat.nav.u"}
    np.testing.assert_allclose(signals["TT.psi"].times, start.timestamp() + t)
    for name, values in (("T.r", 2.0 * t), ("TT.psi", 3.0 * t), ("log.z", 4.0 * t), ("run[1].q", 2.0 * t[:9])):
        np.testing.assert_allclose(signals[name].values, values)


@pytest.mark.parametrize("version", ["v7", "v7.3"])
def test_a_timeseries_of_matlab_says_what_to_do_there(version, tmp_path):
    """Beside vectors with times it is a remark, and otherwise the reason why nothing is read."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the library, to pandas
        import matio
        from matio.utils.matclass import MatlabOpaque

        t = np.arange(0.0, 5.0, 0.25)[:, None]
        series = MatlabOpaque({"Data": 2.0 * t, "Time": t}, "timeseries")
        for name, content in {"a": {"yaw": series}, "b": {"log": {"yaw": series, "x": series}, "t": t, "y": t}}.items():
            matio.save_to_mat(str(tmp_path / f"{name}.mat"), mdict=content, version=version)
    with refused("format", "yaw"):
        readers.read("matlab", [tmp_path / "a.mat"], is_listed=True)
    log = readers.read("matlab", [tmp_path / "b.mat"])
    assert set(log.signals) == {"y"}
    (remark,) = log.remarks
    assert (
        "log_yaw_time = log.yaw.Time; log_yaw = log.yaw.Data; save('log_yaw.mat', 'log_yaw', 'log_yaw_time')" in remark
    )
    assert remark.endswith(", and so with log.x")


def test_netcdf_of_both_formats_and_records_of_hdf5(tmp_path):
    """What stands for no reading, scale and offset, and times since a date are as the file says."""
    import h5py
    import xarray

    depth = np.array([1.0, np.nan, 1.5, 2.0])
    times = np.datetime64("2026-05-01T10:00:00", "ns") + np.arange(4) * np.timedelta64(500, "ms")
    data = xarray.Dataset({"depth": ("time", depth, {"units": "m"})}, coords={"time": times})
    packed = {"depth": {"dtype": "i2", "scale_factor": 0.25, "add_offset": 1.0, "_FillValue": -99}}
    for engine in ("h5netcdf", "scipy"):
        data.to_netcdf(tmp_path / "a.nc", engine=engine, encoding=packed)
        signal = readers.read("netcdf", [tmp_path / "a.nc"]).signals["depth"]
        assert signal.unit == "m"
        np.testing.assert_array_equal(signal.values, depth)
        np.testing.assert_allclose(signal.times, 1777629600.0 + 0.5 * np.arange(4))
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file["log/nav"] = np.array([(k, 2 * k) for k in range(5)], dtype=[("t", "f8"), ("psi_deg", "f4")])
    signal = readers.read("netcdf", [tmp_path / "b.h5"]).signals["log.nav.psi_deg"]
    np.testing.assert_array_equal(signal.values, 2.0 * signal.times)
    assert signal.unit == "deg"


def test_marks_and_integers_of_netcdf(tmp_path):
    """Several marks for missing, integers without sign, numbers as texts, and dates as texts."""
    import h5py

    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["time"] = [f"2026-05-01T10:00:0{k}" for k in range(5)]
        yaw = file.create_dataset("yaw", data=np.array([0, 30000, 40000, 65535, 7], dtype="u2").view("i2"))
        yaw.attrs.update({"_Unsigned": "true", "_FillValue": np.int16(-1)})
        yaw.attrs.update({"scale_factor": "0.01", "units": "degrees_T"})
        file["z"] = np.array([1.0, -999.0, 2.0, -888.0, 3.0], dtype="f4")
        file["z"].attrs["missing_value"] = np.array([-999.0, -888.0], dtype="f4")
    signals = readers.read("netcdf", [tmp_path / "a.h5"]).signals
    np.testing.assert_allclose(signals["yaw"].values, [0.0, 300.0, 400.0, np.nan, 0.07])
    np.testing.assert_array_equal(signals["z"].values, [1.0, np.nan, 2.0, np.nan, 3.0])
    np.testing.assert_allclose(signals["z"].times, 1777629600.0 + np.arange(5.0))
    assert signals["yaw"].unit == "deg"


def test_what_hdf5_has_beside_the_signals_costs_none(tmp_path):
    """Texts that are empty or no UTF-8, and marks that no integer has or that are texts."""
    import h5py

    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["time"], file["note"] = np.arange(5.0), np.array([b"caf\xe9"] * 5, dtype="S6")
        file["nothing"] = h5py.Empty(h5py.string_dtype())
        file["z"] = np.array([0, 1, 0, 2, -32768], dtype="i2")
        file["z"].attrs.update({"missing_value": 1e20, "_FillValue": "none"})
    signals = readers.read("netcdf", [tmp_path / "a.h5"]).signals
    np.testing.assert_array_equal(signals["z"].values, [0.0, 1.0, 0.0, 2.0, -32768.0])
    assert set(signals) == {"z"}


def test_links_that_lead_nowhere_and_nothing_of_hdf5(tmp_path):
    import h5py

    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["time"], file["z"], file["nothing"] = np.arange(60.0), np.arange(60.0), h5py.Empty("f8")
        file["gone"], file["other"] = h5py.SoftLink("/nowhere"), h5py.ExternalLink("none.h5", "/z")
        file["adcp"] = np.arange(480.0).reshape(4, 60, 2)  # the time in the middle
    signals = readers.read("netcdf", [tmp_path / "a.h5"]).signals
    assert set(signals) == {"z", *(f"adcp[{k}]" for k in range(8))}
    np.testing.assert_array_equal(signals["adcp[1]"].values, 1.0 + 2.0 * np.arange(60))
    np.testing.assert_array_equal(signals["adcp[6]"].values, 360.0 + 2.0 * np.arange(60))


def test_what_netcdf_3_has_beside_the_signals_costs_none(tmp_path):
    """Letters and single numbers, as conventions demand them, and a sign of degrees that is no UTF-8."""
    from scipy.io import netcdf_file

    with netcdf_file(tmp_path / "a.nc", "w") as file:
        file.createDimension("time", 6)
        file.createDimension("letters", 4)
        for name, unit in (("time", "seconds since 2021-05-01"), ("heading", b"\xb0"), ("z", 3)):
            variable = file.createVariable(name, "f4", ("time",))
            variable[:], variable.units = np.arange(6.0), unit
        file.createVariable("vehicle", "c", ("letters",))[:] = list("auv1")
        file.createVariable("crs", "i4", ()).data = np.array(1, dtype=">i4")
    signals = readers.read("netcdf", [tmp_path / "a.nc"]).signals
    assert {name: signal.unit for name, signal in signals.items()} == {"heading": "°", "z": "3"}


def test_a_temperature_of_matlab_is_no_time(tmp_path):
    from scipy import io

    noise = np.random.default_rng(0).standard_normal(30)
    io.savemat(tmp_path / "a.mat", {"T": 15.0 + noise, "depth": np.arange(30.0), "time": np.arange(30.0)})
    signals = readers.read("matlab", [tmp_path / "a.mat"]).signals
    np.testing.assert_array_equal(signals["depth"].times, np.arange(30.0))
    np.testing.assert_array_equal(signals["T"].values, 15.0 + noise)


def test_a_table_of_matlab_with_words_is_no_timeseries(tmp_path):
    import pandas as pd

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import matio

        table = pd.DataFrame({"secs": np.arange(6.0), "mode": ["a"] * 6, "depth": np.arange(6.0)})
        matio.save_to_mat(str(tmp_path / "a.mat"), mdict={"T": table})
    log = readers.read("matlab", [tmp_path / "a.mat"], is_listed=True)
    assert 'such as signal = "T.secs"' in log.remarks[-1]


def test_dates_and_gaps_of_matlab(tmp_path):
    """Dates in a matrix of letters, and a structure of which one element is empty."""
    from scipy import io

    log = np.array([(np.array([[float(k)]]),) for k in range(5)], dtype=[("yaw", object)])
    log[3]["yaw"] = np.zeros((0, 0))
    io.savemat(tmp_path / "a.mat", {"time": [f"2026-05-01 10:00:0{k}" for k in range(5)], "log": log})
    signal = readers.read("matlab", [tmp_path / "a.mat"]).signals["log.yaw"]
    np.testing.assert_array_equal(signal.values, [0.0, 1.0, 2.0, np.nan, 4.0])
    np.testing.assert_allclose(signal.times, 1777629600.0 + np.arange(5.0))


def test_columns_of_parquet_that_hold_more_than_a_number(tmp_path):
    """They are left out; a column of moments is the time, whatever its name."""
    import pandas as pd

    when = pd.Timestamp("2026-05-01T10:00:00", tz="UTC") + pd.to_timedelta(np.arange(3), unit="s")
    data = {"psi": ["1,001.0", "2.002,0", "3"], "pose": [[1.0], [2.0], [3.0]], "gps": [{"x": 1}] * 3, "when": when}
    pd.DataFrame(data).to_parquet(tmp_path / "a.parquet")
    log = readers.read("parquet", [tmp_path / "a.parquet"])
    np.testing.assert_allclose(log.signals["psi"].times, 1777629600.0 + np.arange(3.0))
    np.testing.assert_array_equal(log.signals["psi"].values, [1001.0, 2002.0, 3.0])
    assert set(log.signals) == {"psi"}
    assert [remark.partition(" holds")[0] for remark in log.remarks] == ["'pose'", "'gps'"]


def test_moments_of_parquet(tmp_path):
    """In a column, of any time zone, or as the index; cells without a number are no readings."""
    import pandas as pd

    times = pd.Timestamp("2026-05-01T12:00:00", tz="Europe/Berlin") + pd.to_timedelta([0.0, 0.5, 1.0], unit="s")
    psi = pd.array([1, None, 3], dtype="Int64")
    pd.DataFrame({"when": times, "psi_deg": psi}).to_parquet(tmp_path / "a.parquet")
    pd.DataFrame({"psi_deg": psi}, index=times).to_parquet(tmp_path / "b.parquet")
    for name, time in (("a", {"signal": "when"}), ("b", {})):
        signal = readers.read("parquet", [tmp_path / f"{name}.parquet"], LogMap(time=time)).signals["psi_deg"]
        np.testing.assert_allclose(signal.times, [1777629600.0, 1777629601.0])
        np.testing.assert_array_equal(signal.values, [1.0, 3.0])


TABLES = {
    "commas": "t,yaw_deg\n0,1.5\n0.5,2.5\n",
    "semicolons and decimal commas": "t;yaw_deg\n0,0;1,5\n0,5;2,5\n",
    "tabs, units in a line of their own": "t\tyaw_deg\ns\tdeg\n0\t1.5\n0.5\t2.5\n",
    "spaces, names in a comment": "# made by hand\n#  t   yaw_deg\n  0.0   1.5\n  0.5   2.5\n",
    "dates": "timestamp,yaw_deg\n1970-01-01T00:00:00Z,1.5\n1970-01-01T00:00:00.5Z,2.5\n",
    "a head of two lines, quoted": 'Trial 7\n"Time [ms]","yaw_deg"\n"0","1.5"\n"500","2.5"\n',
    "text between, and a line that breaks off": "t,mode,yaw_deg\n0,AUTO,1.5\n0.5,MANUAL,2.5\n1.0,MA",
    "times of the day, past midnight": "date;time;yaw_deg\n1.5.26;23:59:59,75;1,5\n2.5.26;00:00:00,25;2,5\n",
    "Windows": "\ufefft,yaw_deg\r\n0,1.5\r\n0.5,2.5\r\n\r\n",
    "zeros of a power cut": "t,yaw_deg\n0,1.5\n0.5,2.5\n\0\0\0\0",
    "Unicode text of Excel": "\ufefft\tyaw_deg\r\n0\t1.5\r\n0.5\t2.5\r\n".encode("utf-16-le"),
    "UTF-16 without its mark": "t,yaw_deg\n0,1.5\n0.5,2.5\n".encode("utf-16-be"),
    "seconds and nanoseconds": "header.stamp.sec,header.stamp.nanosec,yaw_deg\n7,500000000,1.5\n8,0,2.5\n",
    "date and time": "Date,UTC Time,yaw_deg\n1/30/2021,23:59:59.5,1.5\n1/31/2021,00:00:00.0,2.5\n",
    "six columns": "Year,Month,Day,Hour,Min,Sec,yaw_deg\n21,1,30,23,59,59.5,1.5\n21,1,31,0,0,0,2.5\n",
    "GPS weeks": "GPS Week,GPS TOW [s],yaw_deg\n2142,604799.5,1.5\n2143,0,2.5\n",
    "a zone in the head": "Time (UTC),yaw_deg\n0,1.5\n0.5,2.5\n",
    "a separator in quotes": 't,note,yaw_deg\n0,"turn, port",1.5\n0.5,"said ""go"", went",2.5\n',
    "a separator in quotes of a head": '"t","note, ours","yaw_deg"\n"0","","1.5"\n"0.5","","2.5"\n',
    "spaces in quotes": 't note yaw_deg\n0 "turn to port" 1.5\n0.5 "went" 2.5\n',
    "an inch beside quotes": 't,note,yaw_deg\n0,5" pipe,"1.5"\n0.5,,"2.5"\n',
    "thousands in quotes": 't,yaw_deg\n"7,210.0","1.5"\n"7,210.5","2.5"\n',
    "thousands and decimal commas": "t;yaw_deg\n1.117.210,000;1,5\n1.117.210,500;2,5\n",
    "a separator at the end of each row": "t,yaw_deg\n0,1.5,\n0.5,2.5,\n",
    "a separator at the end of the head": "t,yaw_deg,\n0,1.5\n0.5,2.5\n",
    "an inch": 't,note,yaw_deg\n0,5" pipe,1.5\n0.5,,2.5\n',
    "two units of a quantity": "t,yaw_deg,yaw [deg],yaw [rad]\n0,1.5,1,2\n0.5,2.5,1,2\n",
}


@pytest.mark.parametrize("text", TABLES.values(), ids=TABLES)
def test_tables_of_all_sorts(text, tmp_path):
    (tmp_path / "t.txt").write_bytes(text if isinstance(text, bytes) else text.encode())
    signal = readers.read("csv", [tmp_path / "t.txt"]).signals["yaw_deg"]
    np.testing.assert_allclose(signal.times - signal.times[0], [0.0, 0.5])
    np.testing.assert_allclose(signal.values, [1.5, 2.5])
    assert signal.unit == "deg"


def test_the_only_separator_in_quotes_stands_in_a_late_row(tmp_path):
    rows = [f"{k},,{2 * k}" for k in range(40)]
    rows[30] = '30,"turn, port",60'
    (tmp_path / "t.csv").write_text("\n".join(["t,note,yaw_deg", *rows]))
    signal = readers.read("csv", [tmp_path / "t.csv"]).signals["yaw_deg"]
    np.testing.assert_array_equal(signal.times, np.arange(40.0))
    np.testing.assert_array_equal(signal.values, 2.0 * np.arange(40))


GROUPED = {  # text of a table -> the numbers of its second column
    't,rpm\n0,"990"\n1,"1,000"\n2,"1,010"\n': [990.0, 1000.0, 1010.0],
    "t\trpm\n0\t990\n1\t-1,000\n2\t1,234,567\n": [990.0, -1000.0, 1234567.0],
    "t;rpm;x\n0,5;990;0,1\n1,5;1.000;0,2\n2,5;1.010;0,3\n": [990.0, 1000.0, 1010.0],
    "t;rpm\n0.5;990\n1.5;1,000\n2.5;1,010.5\n": [990.0, 1000.0, 1010.5],
    # Decimal commas, or decimals with a point, though three digits follow.
    't,rpm\n0,"0,990"\n1,"1,000"\n2,"1,010"\n': [0.99, 1.0, 1.01],
    "t;rpm\n0;0,990\n1;1,000\n2;1,010\n": [0.99, 1.0, 1.01],
    "t;rpm\n0;1,990\n1;1,000\n2;1,010\n": [1.99, 1.0, 1.01],
    "t;rpm;x\n0;12.990;0,5\n1;1.000;0,25\n2;0.5;0,5\n": [12.99, 1.0, 0.5],
    "t;rpm\n0;990\n1;1.000\n2;1.010\n": [990.0, 1.0, 1.01],
    "t rpm\n0 1e3\n1 1.125\n2 1.25\n": [1000.0, 1.125, 1.25],
}


@pytest.mark.parametrize(("text", "values"), GROUPED.items())
def test_digits_are_grouped_or_decimals_by_what_else_the_table_has(text, values, tmp_path):
    (tmp_path / "t.txt").write_text(text)
    np.testing.assert_array_equal(readers.read("csv", [tmp_path / "t.txt"]).signals["rpm"].values, values)


MEASURES = {  # cells of a column -> its numbers and unit
    "12.5 m|13.25 m|14 m": ([12.5, 13.25, 14.0], "m"),
    "-2.5°|0°|3.5°": ([-2.5, 0.0, 3.5], "°"),
    "12,5 kn|13,25 kn|": ([12.5, 13.25, np.nan], "kn"),
    "1 200.5 rpm|990 rpm|1'200 rpm": ([1200.5, 990.0, 1200.0], "rpm"),
    "40 %|42.5 %|-3 %": ([40.0, 42.5, -3.0], "%"),
    "12.5 m|13500 mm|14 m|0.015 km": ([12.5, np.nan, 14.0, np.nan], "m"),  # what has another unit is no reading
    "12.5 m|3|4 m": ([12.5, 3.0, 4.0], "m"),
}


@pytest.mark.parametrize("separator", [";", "\t"])
@pytest.mark.parametrize(("cells", "expected"), MEASURES.items())
def test_units_stand_in_the_cells(cells, expected, separator, tmp_path):
    rows = [f"{k}{separator}{cell}" for k, cell in enumerate(cells.split("|"))]
    (tmp_path / "t.csv").write_text("\n".join([f"t{separator}value", *rows]))
    signal, (values, unit) = readers.read("csv", [tmp_path / "t.csv"]).signals["value"], expected
    filled = np.isfinite(signal.values)
    np.testing.assert_array_equal(signal.times[filled], np.flatnonzero(np.isfinite(values)))
    np.testing.assert_array_equal(signal.values[filled], np.array(values)[np.isfinite(values)])
    assert signal.unit == unit


def test_a_table_whose_cells_all_have_a_unit_is_not_cut_at_spaces(tmp_path):
    rows = [f"{k / 2} s,{k % 3}.5 m,{k} deg" for k in range(30)]
    (tmp_path / "t.csv").write_text("\n".join(["t,depth,heading", *rows]))
    signals = readers.read("csv", [tmp_path / "t.csv"]).signals
    np.testing.assert_array_equal(signals["depth"].times, np.arange(30) / 2)
    np.testing.assert_array_equal(signals["heading"].values, np.arange(30.0))


@pytest.mark.parametrize("space", ["", " "])
def test_sides_of_the_world_are_signs_of_places_only(space, tmp_path):
    rows = [f"{k},33.{k}{space}S,151.{k}{space}E,5.{k}{space}S" for k in range(10, 20)]
    (tmp_path / "t.csv").write_text("\n".join(["t,Latitude,lon,rudder", *rows]))
    log = readers.read("csv", [tmp_path / "t.csv"])
    np.testing.assert_allclose(log.signals["Latitude"].values, -33 - np.arange(10, 20) / 100)
    np.testing.assert_allclose(log.signals["lon"].values, 151 + np.arange(10, 20) / 100)
    assert "rudder" not in log.signals  # to starboard, or south?
    assert any("'rudder'" in remark for remark in log.remarks)


def test_digits_are_grouped_in_a_late_row_only(tmp_path):
    (tmp_path / "t.csv").write_text("t,rpm\n" + "".join(f'{k},"{990 + k:,}"\n' for k in range(3000)))
    signal = readers.read("csv", [tmp_path / "t.csv"]).signals["rpm"]
    np.testing.assert_array_equal(signal.values, 990.0 + np.arange(3000))


def test_a_minus_of_a_spreadsheet(tmp_path):
    (tmp_path / "t.csv").write_text("t,yaw_deg\n0,\u22121.5\n1,2.5\n", encoding="utf-8")
    np.testing.assert_array_equal(readers.read("csv", [tmp_path / "t.csv"]).signals["yaw_deg"].values, [-1.5, 2.5])


@pytest.mark.parametrize(("begin", "remedy"), [(b"PK\3\4", "save it as CSV"), (b"\x1f\x8b\x08", "unpack it")])
def test_what_is_packed_is_to_be_unpacked(begin, remedy, tmp_path):
    (tmp_path / "t.csv").write_bytes(begin + bytes(range(256)))
    with refused("format") as error:
        readers.read("csv", [tmp_path / "t.csv"])
    assert remedy in str(error.value)
    (tmp_path / "t.csv").write_text("PKT,t\n1,0\n2,1\n")
    assert list(readers.read("csv", [tmp_path / "t.csv"]).signals) == ["PKT"]


@pytest.mark.parametrize("void", ["ERR", "---", "NaN", ""])
@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("head", ["hour,minute,second", "secs,nsecs,mode", "year,month,day,hour,minute,second"])
def test_void_cells_among_the_parts_of_times(head, place, void, tmp_path):
    names = head.split(",")
    cells = [dict(zip(names, [2026, 5, 1, 0, 0, k][-len(names) :], strict=True)) for k in range(20)]
    cells = [row | {"secs": k, "nsecs": 500_000_000, "mode": 1} for k, row in enumerate(cells)]
    cells[7][names[place]] = void
    rows = [",".join(str(row[name]) for name in names) + f",{k}" for k, row in enumerate(cells)]
    (tmp_path / "t.csv").write_text("\n".join([f"{head},yaw_deg", *rows]))
    signal = readers.read("csv", [tmp_path / "t.csv"]).signals["yaw_deg"]
    np.testing.assert_array_equal(signal.values, np.delete(np.arange(20.0), 7))
    np.testing.assert_allclose(np.diff(signal.times), np.diff(signal.values))


def test_a_line_of_units_with_one_that_is_unknown(tmp_path):
    (tmp_path / "t.csv").write_text("time,yaw,depth\ns,degrees_true,m\n0,1,2\n1,2,3\n")
    signals = readers.read("csv", [tmp_path / "t.csv"]).signals
    assert {name: signal.unit for name, signal in signals.items()} == {"yaw": "degrees_true", "depth": "m"}
    with refused("unit", "columns.yaw_deg.unit") as error:
        log_map = LogMap(columns={"yaw_deg": {"signal": "yaw"}})
        conversion.convert(readers.read("csv", [tmp_path / "t.csv"], log_map), log_map, tmp_path / "m.toml")
    assert "the file says 'degrees_true', which is not known" in str(error.value)


def test_empty_cells_are_no_readings_and_other_words_are_none(tmp_path):
    """Of a cell that says NaN the conversion says so; one that is empty is as it should be."""
    (tmp_path / "t.txt").write_text("t,a,b\n0,,1\n1,NaN,2\n2,3.5,\n3,-,4\n")
    signals = readers.read("csv", [tmp_path / "t.txt"]).signals
    np.testing.assert_array_equal(signals["a"].times, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(signals["a"].values, [np.nan, 3.5, np.nan])
    np.testing.assert_array_equal(signals["b"].values, [1.0, 2.0, 4.0])


def test_signals_are_found_under_the_heads_of_the_file(tmp_path):
    """With its unit, and with the mark that makes the head a comment."""
    (tmp_path / "t.csv").write_text("%time,field.depth [m]\n0,1.5\n1,2.5\n")
    log_map = LogMap(time={"signal": "%time"}, columns={"depth_m": {"signal": "field.depth [m]"}})
    assert readers.read("csv", [tmp_path / "t.csv"], log_map).signals["field.depth [m]"].unit == "m"


def test_a_few_broken_rows_are_left_out_and_named(tmp_path):
    rows = [f"{k},{k}" for k in range(40)]
    rows[7], rows[20], rows[30] = "7", "x,20", ",30"
    (tmp_path / "t.csv").write_text("\n".join(["t,psi", *rows]))
    log = readers.read("csv", [tmp_path / "t.csv"])
    assert len(log.signals["psi"].times) == 37
    assert log.remarks == (
        "line 9: has 1 cells, expected 2; 1 such lines are left out",
        "row 20 from line 2, column 't': 'x' is not a time; 2 such rows are left out",
    )


UNTIMED = {
    "no time": ("a,b\n1,2\n3,4\n", {}, ("missing", "time.signal")),
    "many rows without a time": ("t,b\nx,2\n3,4\n", {}, ("data", "t")),
    "broken": ("t,b\n1,2\n3,4,5\n6,7\n", {}, ("format", "")),
    "another signal": ("t,b\n1,2\n3,4\n", {"signal": "tt"}, ("unknown", "time.signal")),
}


@pytest.mark.parametrize(("text", "time", "code"), UNTIMED.values(), ids=UNTIMED)
def test_what_cannot_be_converted_can_be_listed(text, time, code, tmp_path):
    """With the fault as a remark, so that the list helps to write the map."""
    (tmp_path / "t.csv").write_text(text)
    with refused(*code) as error:
        readers.read("csv", [tmp_path / "t.csv"], LogMap(time=time))
    log = readers.read("csv", [tmp_path / "t.csv"], LogMap(time=time), is_listed=True)
    assert "b" in log.signals
    assert log.remarks[-1] == str(error.value)


def test_a_map_for_another_kind_of_file_names_the_likely_signal(tmp_path):
    """Nothing that it names is in the file."""
    path = WRITERS["mavlink"](tmp_path)
    log_map = LogMap(columns={"heading_deg": {"signal": "ATTITUDE.yaw"}})
    with refused("unknown", "columns.heading_deg.signal") as error:
        conversion.convert(readers.read("mavlink", [path], log_map), log_map, tmp_path / "m.toml")
    assert "did you mean 'ATT.Yaw'?" in str(error.value)


def test_tables_with_clocks_of_their_own(tmp_path):
    """The receipt of one, the stamp of the other; a clock that wraps."""
    (tmp_path / "nav.csv").write_text("time,stamp,yaw_deg\n" + "".join(f"{k // 3},{100 + k},{k}\n" for k in range(9)))
    (tmp_path / "fins.csv").write_text("time,rudder_deg\n" + "".join(f"{(101 + k) % 105},{k}\n" for k in range(7)))
    tables = {"nav": {"signal": "stamp"}, "fins": {"wraps_every_s": 105.0}}
    log = readers.read("csv", [tmp_path / "nav.csv", tmp_path / "fins.csv"], LogMap(time={"tables": tables}))
    np.testing.assert_array_equal(log.signals["nav.yaw_deg"].times, np.arange(100.0, 109.0))
    np.testing.assert_array_equal(log.signals["fins.rudder_deg"].times, np.arange(101.0, 108.0))


WRONG_TABLES = {
    "": ("format", ""),
    "time\n": ("data", ""),
    "a,b\nx,y\n": ("format", ""),
    "a,b\n1,2\n3,4\n": ("missing", "time.signal"),
    "t,a\n0,1\n1,2,3\n2,3\n3,4\n": ("format", ""),
    "t,a\n0,1\nx,2\n3,4\n": ("data", "t"),
    "t [fortnight],a\n0,1\n1,2\n": ("unit", "time.unit"),
    "t,a,a\n0,1,2\n1,2,3\n": ("conflict", "a"),
}


@pytest.mark.parametrize(("text", "code"), WRONG_TABLES.items())
def test_a_table_that_is_wrong(text, code, tmp_path):
    (tmp_path / "t.txt").write_text(text)
    with refused(*code):
        readers.read("csv", [tmp_path / "t.txt"])


@pytest.mark.parametrize("tank", ["HSVA", "MARIN"])
def test_trials_of_kvlcc2(tank, tmp_path):
    """Earth-axis velocities as such; rounded times of MARIN become even ones again."""
    path = vehicle_logs.kvlcc2(tmp_path, "trial.dat", tank)
    log = readers.read("kvlcc2", [path])
    times, signals = log.signals["x"].times, log.signals
    assert len(times) == 2000
    np.testing.assert_allclose(np.diff(times), 0.05 if tank == "HSVA" else 0.13526, rtol=1e-4)
    file = toml_files.built_in("maps")["kvlcc2"]
    result = conversion.convert(log, read_map(file, "kvlcc2"), file)
    east = np.diff(signals["y"].values) / np.diff(times)
    np.testing.assert_allclose(result.columns["velocity_east_mps"][:-1].mean(), east.mean(), atol=2e-3)
    assert result.columns["rpm"][0] == pytest.approx(612.0 if tank == "HSVA" else 91.7)
    path.write_bytes(path.read_bytes()[:-20])
    with refused("format"):
        readers.read("kvlcc2", [path])


def test_pieces_of_a_log_are_joined(tmp_path):
    path = WRITERS["csv"](tmp_path)
    head, *rows = path.read_text().splitlines(keepends=True)[1:]
    for name, part in (("b.txt", rows[300:]), ("a.txt", rows[:300])):
        (tmp_path / name).write_text(head + "".join(part))
    joined = readers.read("csv", [tmp_path / "b.txt", tmp_path / "a.txt"]).signals
    np.testing.assert_array_equal(joined["Rudder"].values, readers.read("csv", [path]).signals["Rudder"].values)


def test_pieces_of_a_log_in_other_units(tmp_path):
    for name, text in (("a", "t,z [m]\n0,10\n1,11\n"), ("b", "t,z [ft]\n2,100\n"), ("c", "t,z [rad]\n3,1\n")):
        (tmp_path / f"{name}.csv").write_text(text)
    signal = readers.read("csv", [tmp_path / "a.csv", tmp_path / "b.csv"]).signals["z"]
    np.testing.assert_allclose(signal.values, [10.0, 11.0, 30.48])
    with refused("unit", "unit"):
        readers.read("csv", [tmp_path / "a.csv", tmp_path / "c.csv"])


def test_pieces_of_a_log_that_overlap_are_tables_and_a_map_of_the_whole_is_told_so(tmp_path):
    for name, first in (("a", 0), ("b", 8)):
        rows = "".join(f"{k},{k}\n" for k in range(first, first + 10))
        (tmp_path / f"{name}.csv").write_text(f"t,z [m]\n{rows}")
    log_map = LogMap(columns={"z_m": {"signal": "z"}})
    log = readers.read("csv", [tmp_path / "a.csv", tmp_path / "b.csv"], log_map)
    with refused("unknown", "columns.z_m.signal") as error:
        conversion.convert(log, log_map, tmp_path / "m.toml")
    assert "'a.z' or 'b.z'? Pieces of one log must not overlap" in str(error.value)


def test_a_table_for_each_message(tmp_path):
    """As the viewer of LSTS exports them: two files with a column of the same name."""
    head = "timestamp (seconds since 01/01/1970), system, entity , value ({})\n"
    for name, unit, value in (("Depth", "m", 2.5), ("Rpm", "rpm", 900.0)):
        rows = [f"{START + k:.3f}, lauv-one, Motor, {value + k}\n" for k in range(3)]
        (tmp_path / f"{name}.csv").write_text(head.format(unit) + "".join(rows))
    log = readers.read("csv", [tmp_path / "Depth.csv", tmp_path / "Rpm.csv"])
    assert {name: signal.unit for name, signal in log.signals.items()} == {"Depth.value": "m", "Rpm.value": "rpm"}
    np.testing.assert_allclose(log.signals["Rpm.value"].times, START + np.arange(3))


def test_a_bag_of_ros_1(tmp_path):
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    with Writer(tmp_path / "old.bag") as writer:
        connection = writer.add_connection("/depth", "std_msgs/msg/Float64", typestore=store)
        for k in range(5):
            message = store.types["std_msgs/msg/Float64"](2.0 + k)
            writer.write(connection, k * 10**9, store.serialize_ros1(message, "std_msgs/msg/Float64"))
    signal = readers.read("ros", [tmp_path / "old.bag"]).signals["/depth.data"]
    np.testing.assert_allclose(signal.times, np.arange(5.0))
    np.testing.assert_allclose(signal.values, 2.0 + np.arange(5))


@pytest.mark.parametrize("kind", readers.KINDS)
@pytest.mark.parametrize("content", [b"", b"\x00\xff" * 300, b"no log at all\n", b"\xa3\x95", b"MATLAB 5.0 MAT-file"])
def test_what_is_no_such_log_is_one_line(kind, content, tmp_path):
    path = tmp_path / readers.KINDS[kind].example
    path.write_bytes(content)
    with pytest.raises(InputError) as error:
        readers.read(kind, [path])
    assert str(error.value).startswith(str(path))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("kind", [kind for kind in WRITERS if kind != "ros"])
def test_a_log_that_breaks_off_is_read_or_one_line(kind, tmp_path):
    path = WRITERS[kind](tmp_path)
    whole = path.read_bytes()
    for share in (0.1, 0.5, 0.9, 0.999):
        path.write_bytes(whole[: int(share * len(whole))])
        with contextlib.suppress(InputError):
            readers.read(kind, [path])


@pytest.mark.parametrize("storage", ["MCAP", "SQLITE3"])
def test_a_bag_that_breaks_off_is_one_line(storage, tmp_path):
    path = next(p for p in vehicle_logs.ros(tmp_path, "bag", storage).iterdir() if p.suffix != ".yaml")
    path.write_bytes(path.read_bytes()[:5000])
    for source in (path, path.parent):
        with refused("format"):
            readers.read("ros", [source])


def test_missing_files_and_folders(tmp_path):
    for kind in readers.KINDS:
        with refused("file"):
            readers.read(kind, [tmp_path / "none.xyz"])
    with refused("file"):
        readers.read("imc", [tmp_path])
    with refused("format"):
        readers.read("ros", [tmp_path])


def test_gps_times(tmp_path):
    """Those of the sentence, of the message, of the header: the same second everywhere."""
    for kind in ("ros", "nmea", "imc"):
        times, _ = cells(example(kind, tmp_path), "latitude_deg")
        np.testing.assert_allclose(times, GPS, atol=1e-6)
