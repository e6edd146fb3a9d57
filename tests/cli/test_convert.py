"""The command `convert`, and the way of a torpedo AUV's log from its bag to the card of a study."""

import re
import sys
import tomllib

import numpy as np
import pytest
import tomli_w
from support import refusals, torpedo, vehicle_logs

from bayesub.io import toml_files
from bayesub.logs import log_files, readers


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("kind", readers.KINDS)
def test_from_a_new_map_to_a_log(kind, folder, bayesub):
    """The example of `new map` converts a log of its kind; signals of the log stand in it."""
    file = vehicle_logs.WRITERS[kind](folder)
    assert bayesub("new", "map", kind, "--data", file, "-o", "map.toml")[0] == 0
    text = (folder / "map.toml").read_text()
    assert f"# Signals of {file}:" in text
    assert "[columns.fin_1_deg]" in text or "[columns.rudder_deg]" in text
    status, out, err = bayesub("convert", kind, file, "-o", "log.csv", "--map", "map.toml")
    assert (status, err) == (0, "")
    columns = (folder / "log.csv").read_text().partition("\n")[0].split(",")
    assert columns[0] == "time_s"
    assert set(columns[1:]) == set(tomllib.loads(text)["columns"])
    assert all(f"  {name} " in out for name in columns[1:])


def test_the_list_of_signals(folder, bayesub):
    status, out, _ = bayesub("convert", "ros", vehicle_logs.ros(folder), "--list")
    assert status == 0
    (line,) = [line.split() for line in out.splitlines() if "/imu.angular_velocity.z " in line]
    assert line == ["/imu.angular_velocity.z", "rad/s", "300", "5", "0", "59.8", "-0.0349066", "-0.0349066"]
    assert "times count from 2026-09-21 14:13:20.000 UTC" in out


def test_what_is_missing_is_one_line(folder, bayesub):
    file = vehicle_logs.csv(folder)
    for arguments, kind, key in (
        (["csv", file], "missing", "-o"),
        (["csv", file, "-o", "log.csv"], "missing", "--map"),
        (["csv", file, "-o", file, "--map", "m.toml"], "conflict", "-o"),
        (["csv", file, "-o", "log.csv", "--map", "none.toml"], "file", ""),
        (
            ["csv", file, "-o", "no/log.csv", "--map", toml_files.built_in("maps")["csv"]],
            "file",
            "",
        ),
    ):
        status, out, err = bayesub("convert", *arguments)
        assert (status, out, err.count("\n")) == (2, "", 1)
        refusals.check(bayesub.error, kind, key)
    status, out, err = bayesub("convert", "rosbag", file)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "'rosbag' is not one of" in err  # in the words of click
    assert file.read_text().startswith("Logger")


LIBRARIES = {"ros": "rosbags", "mavlink": "pymavlink", "nmea": "pynmea2", "imc": "imcpy", "slocum": "dbdreader"}
LIBRARIES |= {"ulog": "pyulog", "parquet": "pyarrow"}


@pytest.mark.parametrize(("kind", "library"), LIBRARIES.items())
def test_a_library_that_is_not_installed(kind, library, folder, bayesub, monkeypatch):
    file = vehicle_logs.WRITERS[kind](folder)
    for name in [name for name in sys.modules if name.partition(".")[0] == library]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, library, None)
    status, _, err = bayesub("convert", kind, file, "--list")
    assert (status, err.count("\n")) == (2, 1)
    refusals.check(bayesub.error, "install", library)


def test_a_torpedo_auv_from_its_bag_to_the_card_of_a_study(folder, bayesub, rng):
    """Four fins in counts, one of them mirrored and two off centre; a motor in per cent; no Doppler log.

    The bag is made of a simulated trial. What comes back is what was flown, within the counts of the servos; the log
    is checked with the boat, made a study, and the study is checked.
    """
    content = tomllib.loads(toml_files.read_text(toml_files.built_in("vehicles")["auv690"]))
    (folder / "torpedo.toml").write_text(tomli_w.dumps(torpedo.boat(content)))
    simulate = ("simulate", "torpedo.toml", "zigzag_20_20", "-o", "flown.csv", "--sample", "0.1")
    assert bayesub(*simulate)[0] == 0
    flown = log_files.read_log(folder / "flown.csv", torpedo.COLUMNS)
    bag = torpedo.bag(folder, folder / "flown.csv", rng)
    (folder / "map.toml").write_text(torpedo.log_map())
    status, out, err = bayesub("convert", "ros", bag, "-o", "log.csv", "--map", "map.toml")
    assert (status, err) == (0, "")
    assert re.search(r"latitude_deg +120 cells", out)

    columns = (folder / "log.csv").read_text().partition("\n")[0].split(",")
    table = np.genfromtxt(folder / "log.csv", delimiter=",", names=True)
    assert len(table) == 1200
    for name in torpedo.COLUMNS:
        true = np.degrees(np.interp(table["time_s"], flown["time"], flown[name]))
        np.testing.assert_allclose(table[name], true, atol=0.0879)
    read = np.isfinite(table["heading_deg"])
    off = table["heading_deg"][read] - np.degrees(np.interp(table["time_s"][read], flown["time"], flown["psi"]))
    assert np.std((off + 180.0) % 360.0 - 180.0) == pytest.approx(0.5, rel=0.2)
    fixes = table[np.isfinite(table["latitude_deg"])]
    north = np.radians(fixes["latitude_deg"] - torpedo.LATITUDE) * torpedo.RADIUS
    assert np.std(north - np.interp(fixes["time_s"], flown["time"], flown["x"])) == pytest.approx(1.0, rel=0.3)

    status, out, err = bayesub("check", "torpedo.toml", "log.csv")
    assert (status, err) == (0, "")
    assert all(name in out for name in columns)
    assert bayesub("new", "study", "tail", "--vehicle", "torpedo.toml", "--data", "log.csv")[0] == 0
    text = (folder / "tail.toml").read_text()
    text = re.sub(r"(?m)^coefficients = .*$", 'coefficients = ["Nuv", "Nuu_dr"]', text)
    (folder / "tail.toml").write_text("dt_s = 0.5\n" + text)
    status, out, err = bayesub("check", "tail.toml")
    assert (status, err) == (0, "")
    assert "study 'tail': torpedo" in out
    assert "heading" in out
