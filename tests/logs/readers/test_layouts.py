"""How tables are laid out: which column is the time, what stands above the numbers, and rows that are not whole."""

import numpy as np
import pytest

from bayesub.logs import readers
from bayesub.logs.log_map import LogMap


def read(folder, text, log_map=None):
    (folder / "log.csv").write_text(text, encoding="utf-8")
    return readers.read("csv", [folder / "log.csv"], log_map)


def rows(form, n=12):
    return "".join(form(k) + "\n" for k in range(n))


CLOCKS = {  # a table whose depth is 0, 1, 2, .. at 0, 1, 2, .. s
    "Timestamp,T,depth\n": lambda k: f"2021-05-01 10:00:{k:02d},{15 - 0.01 * k:.2f},{k}",
    "Clock,Altimeter,depth\n": lambda k: f"10:00:{k:02d},{20 - 0.1 * k:.1f},{k}",
    "sentiment,gps_time,depth\n": lambda k: f"{7 - k},{k},{k}",
    "Date,T,depth\n": lambda k: f"2021-05-01 10:00:{k:02d},{15 + k % 3},{k}",
    "date;t;depth\n": lambda k: f"2021-05-01;10:00:{k:02d};{k}",
    "t,depth\n": lambda k: f"{k},{k}",
    "T,depth\n": lambda k: f"10:00:{k:02d},{k}",
    "year,month,day,hour,minute,second,millisecond,depth\n": lambda k: (
        f"2021,5,1,10,0,{k - (k > 0)},{1000 * (k > 0)},{k}"
    ),
    "Date,Time,depth\n": lambda k: f"{'2021-05-01' * (k == 0)},10:00:{k:02d},{k}",
}


@pytest.mark.parametrize(("head", "row"), CLOCKS.items())
def test_the_column_of_times_is_a_clock(head, row, tmp_path):
    """No temperature called T, and no altimeter, which has the letters of a time."""
    signal = read(tmp_path, head + rows(row)).signals["depth"]
    np.testing.assert_allclose(signal.times - signal.times[0], np.arange(12.0))
    np.testing.assert_array_equal(signal.values, np.arange(12.0))


def test_a_temperature_alone_is_no_clock(tmp_path):
    (tmp_path / "log.csv").write_text("T,depth\n" + rows(lambda k: f"{15 + k % 3},{k}"))
    log = readers.read("csv", [tmp_path / "log.csv"], is_listed=True)
    assert "which column is the time" in log.remarks[-1]


@pytest.mark.parametrize("gap", [0.5, 1.0, 2.0, 40.0])
def test_days_between_dates_are_kept(gap, tmp_path):
    """Times of the day begin again after one; dates do not."""
    import pandas as pd

    moments = pd.to_datetime(["2021-05-01 10:00:00", "2021-05-01 10:00:01"])
    moments = moments.append(moments + pd.Timedelta(days=gap))
    pd.DataFrame({"time": moments, "depth": range(4)}).to_parquet(tmp_path / "log.parquet")
    form = lambda m: f"{m.year},{m.month},{m.day},{m.hour},{m.minute},{m.second},1"  # noqa: E731
    parts = read(tmp_path, "year,month,day,hour,minute,second,depth\n" + "\n".join(map(form, moments)))
    for log in (parts, readers.read("parquet", [tmp_path / "log.parquet"])):
        assert np.ptp(log.signals["depth"].times) == 86400.0 * gap + 1.0


def test_a_count_behind_a_colon_may_lack_zeros(tmp_path):
    """12:00:00:50 is 50 ms if others have three digits, and half a second if all have two."""
    times = read(tmp_path, "time,x\n" + rows(lambda k: f"12:00:0{k // 4}:{k % 4 * 50},{k}")).signals["x"].times
    np.testing.assert_allclose(times - times[0], [k // 4 + k % 4 * 0.05 for k in range(12)])
    times = read(tmp_path, "time,x\n" + rows(lambda k: f"12:00:{k // 2:02d}:{50 * (k % 2):02d},{k}")).signals["x"].times
    np.testing.assert_allclose(times - times[0], 0.5 * np.arange(12))


HEADS = {  # what stands above rows of time, depth and heading -> the units of the last two
    "time,depth,heading\n": ("", ""),
    "# made by hand\n# time,depth,heading\n# s,m,deg\n": ("m", "deg"),
    "time,depth,heading\ns,PSU,deg\n": ("PSU", "deg"),
    "Vehicle,AUV1,\nSerial,12345,\ntime,depth,heading\n": ("", ""),
    "Serial,12345,2\ntime,depth [m],heading (deg)\n": ("m", "deg"),
    '"TOA5","CR1000","1234"\n"time","depth","heading"\n"TS","m","deg"\n"","Avg","Smp"\n': ("m", "deg"),
    "time,lat,lon\ntime,depth,heading\n": ("", ""),
}


@pytest.mark.parametrize(("head", "expected"), HEADS.items())
def test_names_and_units_stand_above_the_numbers(head, expected, tmp_path):
    log = read(tmp_path, head + rows(lambda k: f"{k},{k / 8},{90 + k}"))
    assert [(name, one.unit) for name, one in log.signals.items()] == list(
        zip(("depth", "heading"), expected, strict=True)
    )
    np.testing.assert_array_equal(log.signals["depth"].values, np.arange(12) / 8)


@pytest.mark.parametrize("names", [["time", "lat", "lon", "x"], ["timestamp", "lat", "lon", "m"]])
def test_names_that_are_units_too_are_names(names, tmp_path):
    text = f"# a, b, c, d\n# {', '.join(names)}\n" + rows(lambda k: f"{k},1.5,2.5,{k}")
    assert list(read(tmp_path, text).signals) == names[1:]


def test_rows_above_another_head_are_left_out_with_their_lines(tmp_path):
    """A logger was changed in the middle; the same head again, as after a restart, costs one row only."""
    before = "time,depth\n" + rows(lambda k: f"{k},{k}", 30)
    log = read(tmp_path, before + "time,depth,yaw\n" + rows(lambda k: f"{30 + k},{k},{k}", 30))
    assert "lines 2 to 31" in " ".join(log.remarks)
    again = read(tmp_path, before + "time,depth\n" + rows(lambda k: f"{30 + k},{k}", 30))
    assert len(again.signals["depth"].values) == 60


@pytest.mark.parametrize("mode", ["AUTO", '"AUTO"', '"turn, port"'])
@pytest.mark.parametrize(("row", "said"), [("30,3.5,93", "has 3 cells"), ("30,X,3.5,93,7", "has 5 cells")])
def test_cells_are_counted_whether_quoted_or_not(row, said, mode, tmp_path):
    lines = rows(lambda k: f"{k},{mode},{k / 8},{90 + k}", 60).splitlines()
    lines[30] = row.replace("X", mode)
    log = read(tmp_path, "\n".join(["time,mode,depth,heading", *lines, '60,"AU']))
    assert said in " ".join(log.remarks)
    assert "the last line is not whole" in " ".join(log.remarks)
    np.testing.assert_array_equal(log.signals["heading"].values, np.delete(90 + np.arange(60), 30))


def test_a_decimal_comma_may_come_late(tmp_path):
    """5,123 groups no digits in a column that has 5,1 too."""
    cells = ["0"] * 210 + ["5", "5,1", "5,12", "5,123"] * 3
    text = "Zeit;Tiefe_m\n" + "\n".join(f"10:{k // 60:02d}:{k % 60:02d};{cell}" for k, cell in enumerate(cells))
    np.testing.assert_allclose(read(tmp_path, text).signals["Tiefe_m"].values[-4:], [5.0, 5.1, 5.12, 5.123])


@pytest.mark.parametrize("case", [str.upper, str.lower])
def test_sides_of_the_world_in_columns_of_their_own(case, tmp_path):
    south, west = case("S"), case("w")
    text = "time,lat,NS,lon,EW\n" + rows(lambda k: f"{k},33.9{k:02d},{south},151.2{k:02d},{west}")
    log = read(tmp_path, text)
    np.testing.assert_allclose(log.signals["lat"].values, -33.9 - np.arange(12) / 1000)
    np.testing.assert_allclose(log.signals["lon"].values, -151.2 - np.arange(12) / 1000)


@pytest.mark.parametrize("form", ["{d}°{m}'{s}", "{d:03d}°{m}′ {s}", "{d}:{m}{s}"])
def test_places_in_degrees_and_minutes(form, tmp_path):
    """Minutes with decimals, or with seconds."""
    minutes = [f"{20 + k / 8:06.3f}" for k in range(12)]
    row = lambda k: f"{k},{form.format(d=33, m=minutes[k], s='S')},{form.format(d=18, m=minutes[k], s='E')}"  # noqa: E731
    log = read(tmp_path, "time,lat,lon\n" + rows(row))
    np.testing.assert_allclose(log.signals["lat"].values, -33 - (20 + np.arange(12) / 8) / 60, atol=1e-8)
    np.testing.assert_allclose(log.signals["lon"].values, 18 + (20 + np.arange(12) / 8) / 60, atol=1e-8)
    log = read(tmp_path, "time,lat,lon\n" + rows(lambda k: f"{k},33°20'{k}\"S,018°20'{k}\"W"))
    np.testing.assert_allclose(log.signals["lat"].values, -33 - 20 / 60 - np.arange(12) / 3600, atol=1e-8)
    np.testing.assert_allclose(log.signals["lon"].values, -18 - 20 / 60 - np.arange(12) / 3600, atol=1e-8)


def test_a_boat_is_told_apart_behind_hundreds_of_flags(tmp_path):
    """Of columns that may tell boats apart those of text are first, and twenty are looked at."""
    rng, n = np.random.default_rng(0), 400
    flags, boats = rng.integers(0, 2, (n, 200)), np.where(np.arange(n) % 2, "b", "a")
    depth = np.arange(n) / 10 + 50 * (boats == "b")
    text = "time," + ",".join(f"f{k}" for k in range(200)) + ",vehicle,depth\n"
    text += "\n".join(f"{k},{','.join(map(str, flags[k]))},{boats[k]},{depth[k]}" for k in range(n))
    assert "'vehicle' tells 2 boats or runs apart" in " ".join(read(tmp_path, text).remarks)


WRITINGS = {
    "a decimal comma": "33°{m}'S;151°12,5'E".replace("{m}", "20,{k}"),
    "spaces": "33 20.{k} S;151 12.5 E",
    "the side first": "S 33 20.{k};E 151 12.5",
    "dashes": "33-20.{k}S;151-12.5E",
    "seconds, the side first": "S33° 20' {k6}\";E151° 12' 30.0\"",
}


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("writing", WRITINGS.values(), ids=WRITINGS)
def test_places_as_people_write_them(writing, separator, tmp_path):
    if "," in writing and separator == ",":
        pytest.skip("a decimal comma separates")
    place = [writing.format(k=k % 10, k6=f"{6 * (k % 10):.1f}").replace(";", separator) for k in range(12)]
    text = f"time{separator}lat{separator}lon\n" + rows(lambda k: f"{k}{separator}{place[k]}")
    log = read(tmp_path, text)
    np.testing.assert_allclose(log.signals["lat"].values, -33 - (20 + np.arange(12) % 10 / 10) / 60, atol=1e-8)
    np.testing.assert_allclose(log.signals["lon"].values, 151 + 12.5 / 60, atol=1e-8)


@pytest.mark.parametrize("head", ["time{}speed", "# a run at sea\ntime{}speed", "date and time{}speed"])
def test_dates_with_spaces_do_not_separate(head, tmp_path):
    """Day, year and seconds are three numbers beside the one of the other column, but the head has two cells."""
    for separator in ",;":
        day = lambda k: f"30 nov 2026 10:00:{k:02d}"  # noqa: E731
        text = head.format(separator) + "\n" + rows(lambda k, s=separator, day=day: f"{day(k)}{s}{k / 8}")
        (signal,) = read(tmp_path, text).signals.values()
        np.testing.assert_allclose(signal.values, np.arange(12) / 8)
        np.testing.assert_allclose(np.diff(signal.times), 1.0)


@pytest.mark.parametrize("head", ["lat", "LAT", "Lat_deg", "latDeg", "Latitude (deg)", "latitud", "Latitudine"])
def test_names_of_places(head, tmp_path):
    log = read(tmp_path, f"time,{head},depth\n" + rows(lambda k: f"{k},33.{k:02d} S,{k}"))
    (name,) = log.signals.keys() - {"depth"}
    np.testing.assert_allclose(log.signals[name].values, -33.0 - np.arange(12) / 100)


def test_what_is_called_nearly_like_a_place(tmp_path):
    """A date with dashes is not an angle, nor is what goes to the side."""
    text = "latest_fix,lateral,longDeg\n" + rows(lambda k: f"2026-11-30T10:00:{k:02d},{k}-5,{k} E")
    log = read(tmp_path, text, LogMap(time={"signal": "latest_fix"}))
    np.testing.assert_allclose(np.diff(log.signals["longDeg"].times), 1.0)
    np.testing.assert_allclose(log.signals["longDeg"].values, np.arange(12.0))
    assert "lateral" not in log.signals


def test_tables_of_one_name_have_the_names_of_their_folders(tmp_path):
    """Of those whose name no other has, and of pieces that follow on each other, that of the file is enough."""
    files = {"bow/Depth.csv": 0.0, "stern/Depth.csv": 0.5, "stern/Yaw.csv": 0.25}
    for name, begin in files.items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text("\n".join(["time_s,value", *(f"{begin + k},{k}" for k in range(9))]))
    paths = [tmp_path / name for name in files]
    assert set(readers.read("csv", paths).signals) == {"bow/Depth.value", "stern/Depth.value", "Yaw.value"}
    log_map = LogMap(columns={"depth_m": {"signal": "stern/Depth.value"}})
    assert readers.read("csv", paths, log_map).signals["stern/Depth.value"].times[0] == 0.5
    paths[1].write_text("\n".join(["time_s,value", *(f"{10 + k},{k}" for k in range(9))]))
    assert len(readers.read("csv", paths[:2]).signals["value"].times) == 18
