"""A table that is read part by part has the times and cells of one that is read at once, whatever its stamps are."""

import numpy as np
import pytest
from support.refusals import refused

from bayesub.logs import readers
from bayesub.logs.log_map import LogMap
from bayesub.logs.readers import table

N = 400
SECONDS = 0.5 * np.arange(N)
MOMENTS = np.datetime64("2026-05-13T23:58:40") + (1000 * SECONDS).astype("timedelta64[ms]")


def pattern(text):
    import pandas as pd

    return pd.Series(MOMENTS).dt.strftime(text).tolist()


# Columns of a table -> cells; the map's [time]. The day changes in the first part, whose end is in the next minute.
STAMPS = {
    "seconds": ({"t": SECONDS}, {}),
    "milliseconds since 1970": ({"time": MOMENTS.astype("int64")}, {}),
    "Excel's days": ({"time": 46155.0 + SECONDS / 86400.0}, {}),
    "a part of a day": ({"date": ["2026-05-13"] * N, "time": np.round(0.5 + SECONDS / 86400.0, 9)}, {}),
    "ISO": ({"time": pattern("%Y-%m-%dT%H:%M:%S.%f")}, {}),
    "day first": ({"time": pattern("%d/%m/%Y %H:%M:%S.%f")}, {}),
    "day first, in two columns": ({"date": pattern("%d.%m.%Y"), "time": pattern("%H:%M:%S.%f")}, {}),
    "the date in the first row of a day": (
        {"date": ["2026-05-13", *[""] * 159, "2026-05-14", *[""] * 239], "time": pattern("%H:%M:%S.%f")},
        {},
    ),
    "times of the day": ({"time": pattern("%H:%M:%S.%f")}, {}),
    "digits": ({"time": pattern("%H%M%S.%f")}, {}),
    "hours, minutes, seconds": (
        {k: pattern(f) for k, f in {"hour": "%H", "minute": "%M", "second": "%S.%f"}.items()},
        {},
    ),
    "seconds and nanoseconds": ({"sec": SECONDS.astype(int), "nanosec": (SECONDS % 1 * 1e9).astype(int)}, {}),
    "a GPS week": ({"gps_week": 2417 + (SECONDS > 50), "tow": (604750 + SECONDS) % 604800}, {}),
    "a clock that wraps": ({"time": (10.0 + SECONDS) % 60}, {"wraps_every_s": 60.0}),
    "a pattern of the map": ({"time": pattern("%m-%d-%Y %H:%M:%S")}, {"format": "%m-%d-%Y %H:%M:%S"}),
    "some that are none": ({"time": [("x" if k % 37 == 5 else s) for k, s in enumerate(SECONDS)]}, {}),
}


def written(folder, columns):
    columns = {name: list(map(str, cells)) for name, cells in columns.items()}
    lines = [";".join(row) for row in zip(*columns.values(), strict=True)]
    (folder / "t.txt").write_text("\n".join([";".join(columns), *lines]))
    return folder / "t.txt"


def in_parts(monkeypatch, most=90):
    monkeypatch.setattr(table, "BLOCK", 700)
    monkeypatch.setattr(table, "ROWS", 50)
    monkeypatch.setattr(readers, "MOST", most)


@pytest.mark.parametrize(("columns", "time"), STAMPS.values(), ids=STAMPS)
def test_a_table_is_the_same_in_parts(columns, time, tmp_path, monkeypatch):
    """With a column of numbers, one with empty cells and texts in some, and one that the map does not name."""
    u = [("" if k % 7 == 3 else "---" if k % 90 == 8 else f"{np.sin(0.1 * k):.4f}") for k in range(N)]
    path = written(tmp_path, columns | {"u": u, "yaw": np.round(SECONDS, 2), "mode": ["AUTO"] * N})
    log_map = LogMap(time=time, columns={"u_mps": {"signal": "u"}, "yaw_deg": {"signal": "yaw"}})
    whole = readers.read("csv", [path], log_map)
    in_parts(monkeypatch)
    parts = list(readers.parts("csv", [path], log_map))
    assert len(parts) > 3
    assert parts[-1].remarks == whole.remarks
    for name, signal in whole.signals.items():
        assert len(signal.times) > 0.8 * (N - N // 7)
        np.testing.assert_array_equal(np.concatenate([part.signals[name].times for part in parts]), signal.times)
        np.testing.assert_array_equal(np.concatenate([part.signals[name].values for part in parts]), signal.values)


def test_what_the_first_part_cannot_show_is_read_at_once(tmp_path, monkeypatch):
    """An order of dates that only a later day decides, rows from last to first, and a signal that is missing."""
    hours = np.datetime64("2026-05-09T00:00:00") + np.arange(N) * np.timedelta64(1800, "s")
    dates = [f"{day[8:10]}/{day[5:7]}/{day[:4]} {day[11:19]}" for day in hours.astype(str)]
    in_parts(monkeypatch, 20)
    for time, signal in ((dates, "u"), (SECONDS[::-1], "u"), (SECONDS, "w")):
        path = written(tmp_path, {"time": time, "u": SECONDS})
        log_map = LogMap(columns={"u_mps": {"signal": signal}})
        (log,) = readers.parts("csv", [path], log_map)
        assert len(log.signals["u"].times) == N
        np.testing.assert_allclose(np.abs(np.diff(log.signals["u"].times)), 0.5 if time is not dates else 1800.0)


def test_a_fault_of_a_later_part_is_told(tmp_path, monkeypatch):
    in_parts(monkeypatch)
    time = np.where(np.arange(N) < 200, SECONDS.astype(str), "none")
    log_map = LogMap(columns={"u_mps": {"signal": "u"}})
    with refused("data", "time"):
        list(readers.parts("csv", [written(tmp_path, {"time": time, "u": SECONDS})], log_map))
    boats = {"time": np.tile(SECONDS[:200], 2), "u": SECONDS, "boat": np.repeat(["a", "b"], 200)}
    parts = list(readers.parts("csv", [written(tmp_path, boats)], log_map))
    assert "'boat' tells 2 boats or runs apart" in parts[-1].remarks[0]
