"""Stamps of every sort are the seconds that they were written from."""

import numpy as np
import pandas as pd
import pytest
from support.refusals import refused

from bayesub.logs.log_map import Clock
from bayesub.logs.readers import stamps

BEGIN = pd.Timestamp("2021-01-30 23:59:58.5")  # past midnight after two rows
UNIX = BEGIN.timestamp()
ROWS = UNIX + np.arange(5.0)
MOMENTS = [BEGIN + pd.Timedelta(seconds=k) for k in range(5)]


def written(pattern):
    return [f"{moment:{pattern}}" for moment in MOMENTS]


def read(cells, name="t", dates=None, unit="", of_map=None, **clock):
    dates, clock = dates if dates is None else pd.Series(dates, name="date"), {"unit": of_map} | clock
    return stamps.seconds(pd.Series(cells), Clock(**clock), unit, name, dates)[:2]


COUNTED = {
    "ms": (np.round(ROWS * 1e3).astype("int64"), 1e-3),
    "us": (np.round(ROWS * 1e6).astype("int64"), 1e-6),
    "ns": (np.round(ROWS * 1e9).astype("int64"), 1e-6),
    "excel": (ROWS / 86400.0 + 25569.0, 1e-6),
    "matlab": (ROWS / 86400.0 + 719529.0, 2e-5),
    "julian": (ROWS / 86400.0 + 2440587.5, 1e-4),
    "mjd": (ROWS / 86400.0 + 40587.0, 1e-6),
    "labview": (ROWS + 2082844800.0, 1e-6),
    "filetime": (np.round((ROWS + 11644473600.0) * 1e7).astype("int64"), 1e-5),
}


@pytest.mark.parametrize(("cells", "tolerance"), COUNTED.values(), ids=COUNTED)
def test_what_numbers_count_is_seen_from_them(cells, tolerance):
    times, remark = read(cells)
    np.testing.assert_allclose(times, ROWS, atol=tolerance, rtol=0)
    assert "begins on 2021-01-30 23:59:58 UTC" in remark


SECONDS = [[0.0, 0.1, 0.2], [103.0, 104.0, 0.0, 1.0], [1e5, 1e5 + 1], [45000.0, 45000.5], [UNIX, UNIX + 0.02], [7.0]]
SECONDS.append([0.0, 1e-4, 2e-4, 1.0, 1.0001, 1.0002])  # rows in bursts


@pytest.mark.parametrize("cells", SECONDS)
def test_seconds_are_seconds(cells):
    times, remark = read(cells)
    np.testing.assert_array_equal(times, cells)
    assert remark == ""


@pytest.mark.parametrize("damaged", [1e15, 9.96921e36, -1e20])
def test_a_stamp_that_no_clock_shows_is_no_time(damaged):
    times, remark = read([*np.arange(200.0), damaged])
    np.testing.assert_array_equal(times, [*np.arange(200.0), np.nan])
    assert remark == ""


@pytest.mark.parametrize(
    ("name", "size"),
    {
        **{"time_h": 3600.0, "hours": 1.0, "time_min": 60.0, "elapsed_hrs": 3600.0, "time_secs": 1.0, "0": 1.0},
        **{"time_boot_ms": 1e-3, "TimeMS": 1e-3, "Time/ms": 1e-3, "time_msec": 1e-3, "TimeUS": 1e-6, "t_ns": 1e-9},
        **{"time": 1.0, "times": 1.0, "seconds": 1.0, "uptime": 1.0, "TIME": 1.0, "time_UTC": 1.0, "time_m": 1.0},
    }.items(),
)
def test_the_name_of_a_column_of_times_may_end_in_its_unit(name, size):
    cells = np.arange(10.0, 60.0)
    np.testing.assert_allclose(read(cells, name=name)[0], size * cells)
    np.testing.assert_allclose(read(cells, name=name, unit="s")[0], cells)  # what stands in brackets counts more


@pytest.mark.parametrize(("name", "zero"), [("julian_day", 2440587.5), ("MATLAB days", 719529.0), ("t_d", 25569.0)])
def test_days_at_the_end_of_a_name_are_counted_from_what_they_show(name, zero):
    times, remark = read(ROWS / 86400.0 + zero, name=name)
    np.testing.assert_allclose(times, ROWS, atol=1e-4, rtol=0)
    assert "begins on 2021-01-30" in remark


@pytest.mark.parametrize("unit", ["h", "hours", "hr", "HRS", "min", "minutes", "d", "msec", "secs", "second", "us"])
def test_units_of_times_in_a_map(unit):
    size = {"h": 3600.0, "m": 60.0, "d": 86400.0, "s": 1.0, "u": 1e-6}[unit[0].lower()]
    size = 1e-3 if unit == "msec" else size
    np.testing.assert_allclose(read([0.0, 1.0, 2.0], unit="ns", of_map=unit)[0], size * np.arange(3.0))


def test_what_the_map_or_the_head_says_counts():
    np.testing.assert_allclose(read([0, 500], unit="ms")[0], [0.0, 0.5])
    np.testing.assert_allclose(read([0, 0.5], unit="days since 1970-01-02")[0], [86400.0, 129600.0])
    np.testing.assert_allclose(read([0, 0.5], unit="days since 13/1/1970")[0], [12 * 86400.0, 12.5 * 86400.0])
    np.testing.assert_allclose(read([0, 5e7], unit="s", **{})[0], [0.0, 5e7])
    np.testing.assert_allclose(read(["44226,5"], format="excel")[0], [UNIX - UNIX % 86400.0 + 43200.0])
    np.testing.assert_allclose(read([UNIX - 315964800.0 + 18.0], format="gps")[0], [UNIX])


WRITTEN = {
    "month first": (written("%m/%d/%Y %H:%M:%S.%f"), {}),
    "month first, two digits": (written("%m/%d/%y %I:%M:%S.%f %p"), {}),
    "day first": (written("%d/%m/%Y %H:%M:%S.%f"), {}),
    "points and a decimal comma": ([cell[:-5].replace(".5", ",5") for cell in written("%d.%m.%Y %H:%M:%S.%f")], {}),
    "names of months": (written("%d-%b-%Y %H:%M:%S.%f"), {}),
    "ISO": (written("%Y-%m-%dT%H:%M:%S.%fZ"), {}),
    "digits": (written("%Y%m%d_%H%M%S.%f"), {}),
    "weeks": (written("%G-W%V-%uT%H:%M:%S.%f"), {}),
    "a dash before the time": (written("%Y/%m/%d-%H:%M:%S.%f"), {}),
    "one separator": (written("%Y_%m_%d_%H_%M_%S.%f"), {}),
    "brackets": (written("[%Y-%m-%d %H:%M:%S.%f]"), {}),
    "days of the year": (written("%Y-%jT%H:%M:%S.%fZ"), {}),
    "as the command date has it": (written("%a %b %d %H:%M:%S.%f UTC %Y"), {}),
    "as C's asctime has it": (written("%a %b %d %H:%M:%S.%f %Y"), {}),
    "h, m and s": (written("%d.%m.%Y %Hh%Mm%S.%fs"), {}),
    "a pattern": (written("%y|%d|%m %H-%M-%S.%f"), {"format": "%y|%d|%m %H-%M-%S.%f"}),
    "a pattern without its fraction": (written("%a %b %d %H:%M:%S.%f %Y"), {"format": "%a %b %d %H:%M:%S %Y"}),
}


@pytest.mark.parametrize(("cells", "clock"), WRITTEN.values(), ids=WRITTEN)
def test_dates_in_any_order(cells, clock):
    np.testing.assert_allclose(read(cells, **clock)[0], ROWS, atol=1e-6, rtol=0)


DATED = {
    "month first": (written("%m/%d/%Y"), written("%H:%M:%S.%f")),
    "NMEA": ([int(cell) for cell in written("%d%m%y")], written("%H%M%S.%f")),
    "a spreadsheet": (np.floor(ROWS / 86400.0) + 25569.0, ROWS % 86400.0 / 86400.0),
    "tow": (np.floor((ROWS - stamps.GPS_ZERO) / 604800.0), (ROWS - stamps.GPS_ZERO) % 604800.0),
    "iTOW": (np.floor((ROWS - stamps.GPS_ZERO) / 604800.0), (ROWS - stamps.GPS_ZERO) % 604800.0 * 1e3),
}


@pytest.mark.parametrize("name", DATED)
def test_date_and_time_in_two_columns(name):
    dates, cells = DATED[name]
    clock = {"format": "%d%m%y"} if name == "NMEA" else {}
    np.testing.assert_allclose(read(cells, name, dates, **clock)[0], ROWS, atol=1e-4, rtol=0)


@pytest.mark.parametrize(("zone", "hours"), [("+0100", 1.0), ("-03:30", -3.5), ("+00:00", 0.0)])
@pytest.mark.parametrize("pattern", ["%d/%m/%Y %H:%M:%S.%f ", "%Y/%m/%d-%H:%M:%S.%f", "%a %b %d %Y %H:%M:%S.%f GMT"])
def test_hours_from_utc_are_subtracted(pattern, zone, hours):
    cells = [cell + zone for cell in written(pattern)]
    np.testing.assert_allclose(read(cells)[0], ROWS - 3600.0 * hours, atol=1e-6, rtol=0)


def test_times_of_the_day_go_on_past_midnight():
    """So do parts of a day, minutes and seconds past the hour, and the half of a day."""
    for cells, step in (
        (["23:59:59.5", "00:00:00,5"], 1.0),
        (["59:59.5", "00:00.5"], 1.0),
        (["11:59:59 AM", "12:00:00 PM"], 1.0),
        (["12:42:39:500", "12:42:40:500"], 1.0),
        (["T+00:59:59.5", "T+01:00:00.5"], 1.0),
        (["0 days 23:59:59.5", "1 days 00:00:00.5"], 1.0),
        ([0.5, 0.5 + 1 / 86400.0], 1.0),
        ([235900 + k for k in range(60)] + list(range(60)) + [100], 1.0),
    ):
        np.testing.assert_allclose(np.diff(read(cells)[0]), step, atol=1e-6)


ASKED = {
    "a date in two orders": (["03/01/2021 10:00:00", "03/01/2021 10:00:01"], {}, "%d/%m/%Y", 1.0),
    "six digits": (["030121 100000", "030121 100001"], {}, "%d%m%y %H%M%S", 1.0),
    "minutes or hours": (["03:44", "03:45"], {}, "%M:%S", 1.0),
    "hours or minutes": (["03:44", "03:45"], {}, "%H:%M", 60.0),
}


@pytest.mark.parametrize(("cells", "clock", "pattern", "step"), ASKED.values(), ids=ASKED)
def test_what_can_be_read_in_two_ways_is_asked_for(cells, clock, pattern, step):
    with refused("missing", "time.format") as error:
        read(cells, **clock)
    assert f'format = "{pattern.partition(" ")[0]}"' in str(error.value)
    np.testing.assert_allclose(np.diff(read(cells, format=pattern)[0]), step)


def test_counts_that_nothing_explains():
    for cells, clock, code in (
        ([1e11, 1e11 + 5e7], {}, ("missing", "time.unit")),  # nanoseconds since the start
        (np.arange(3) * 1e9 + 1.7e18, {"unit": "s"}, ("unit", "time.unit")),
        ([0.0, 1.0], {"unit": "days since 1/5/2026"}, ("missing", "time.unit")),  # in May, or in January
        ([1.0, 2.0], {"format": "exel"}, ("unknown", "time.format")),
    ):
        with refused(*code):
            read(cells, **clock)


def test_a_message_from_before_a_clock_began_again():
    day = ["23:59:59.0", "23:59:59.4", "00:00:00.2", "23:59:59.8", "00:00:00.6", "00:00:01.0"]
    late, pause = [57, 58, 0, 59, 1, 2], [57, 58, 0, 1, 30, 31]
    np.testing.assert_allclose(read(day)[0] - 86399.0, [0.0, 0.4, 1.2, 0.8, 1.6, 2.0], atol=1e-6)
    np.testing.assert_allclose(read(late, wraps_every_s=60.0)[0] - 57, [0, 1, 3, 2, 4, 5])
    np.testing.assert_allclose(read(pause, wraps_every_s=60.0)[0] - 57, [0, 1, 3, 4, 33, 34])  # no message is so late


def test_a_clock_that_begins_again():
    np.testing.assert_allclose(np.diff(read([190, 195, 0, 5], wraps_every_s=200.0)[0]), 5.0)
