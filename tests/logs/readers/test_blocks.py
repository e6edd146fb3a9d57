"""Tables and logs that are longer than what is taken of them at a time."""

import tracemalloc

import numpy as np
import pytest
from support.refusals import refused

from bayesub.logs import columns, conversion, log_files, readers
from bayesub.logs.log_map import LogMap
from bayesub.logs.readers import stamps, table

N = 300
T = 0.5 * np.arange(N)
YAW = np.round(30.0 * np.sin(0.1 * T), 3)


def with_one(cell, column=YAW, place=250):
    """The cells of a column of which one is another."""
    cells = list(map(str, column))
    cells[place] = cell
    return cells


# Columns of a table -> cells, of which most blocks have another kind than one of them.
TABLES = {
    "numbers": {"t": T, "yaw": YAW},
    "whole numbers": {"t": np.arange(N), "yaw": np.arange(N) % 7},
    "an empty cell": {"t": T, "yaw": with_one("", np.arange(N))},
    "a text": {"t": T, "yaw": with_one("---", np.arange(N))},
    "no number": {"t": T, "yaw": with_one("nan")},
    "yes and no": {"t": T, "yaw": with_one("", np.arange(N) % 2 == 0)},
    "texts": {"t": T, "yaw": YAW, "mode": np.where(T < 100.0, "AUTO", "HAND")},
    "texts, then numbers": {"t": T, "yaw": YAW, "id": ["?"] * 90 + ["none of them"] * 100 + list(range(N - 190))},
    "a stamp that is none": {"t": with_one("x", T), "yaw": YAW},
    "nanoseconds": {"t": 1790000000000000000 + np.arange(N) * 500000000, "yaw": YAW},
    "dates": {"t": np.datetime64("2026-05-13T23:59:00.5") + np.arange(N) * np.timedelta64(500, "ms"), "yaw": YAW},
    "two runs": {"t": np.tile(T[:150], 2), "yaw": YAW, "run": np.repeat([1, 2], 150)},
    "two boats": {"t": T, "yaw": YAW + 150.0 * (np.arange(N) % 2), "boat": np.arange(N) % 2},
    "no times": {"a": YAW, "yaw": YAW},
}


def written(folder, columns, separator=",", broken=()):
    lines = [separator.join(map(str, row)) for row in zip(*columns.values(), strict=True)]
    for k in broken:
        lines[k] += separator + "1"
    (folder / "t.txt").write_text("\n".join([separator.join(columns), *lines]))
    return folder / "t.txt"


def in_blocks(patch):
    """Take 700 characters, some 60 rows, and ten texts at a time."""
    patch.setattr(table, "BLOCK", 700)
    patch.setattr(table, "ROWS", 50)
    patch.setattr(stamps, "BLOCK", 10)


def same(one, other):
    assert one.signals.keys() == other.signals.keys()
    for name, signal in one.signals.items():
        np.testing.assert_array_equal(signal.times, other.signals[name].times)
        np.testing.assert_array_equal(signal.values, other.signals[name].values)
    assert one.remarks == other.remarks


@pytest.mark.parametrize("separator", [",", ";", " "])
@pytest.mark.parametrize("cells", TABLES.values(), ids=TABLES)
def test_a_table_is_the_same_in_blocks(cells, separator, tmp_path, monkeypatch):
    """Numbers, times and remarks, also where the kinds of cells differ from block to block."""
    if separator == " " and any("" in map(str, column) for column in cells.values()):
        pytest.skip("no empty cells between spaces")
    texts = {name: [str(cell).replace(" ", "_") for cell in column] for name, column in cells.items()}
    path = written(tmp_path, texts, separator)
    whole = readers.read("csv", [path], is_listed=True)
    in_blocks(monkeypatch)
    same(readers.read("csv", [path], is_listed=True), whole)


@pytest.mark.parametrize("broken", [[5], [N - 2], range(100, 250)])
def test_broken_lines_are_counted_over_all_blocks(broken, tmp_path, monkeypatch):
    path = written(tmp_path, TABLES["numbers"], broken=broken)
    whole = readers.read("csv", [path], is_listed=True)
    assert len(whole.signals["yaw"].times) == N - len(broken)
    in_blocks(monkeypatch)
    same(readers.read("csv", [path], is_listed=True), whole)


def test_rows_of_one_boat_in_blocks(tmp_path, monkeypatch):
    """A number by which they are told apart may be whole in one block and not in the next."""
    boats = with_one("", np.repeat([1, 2], 150), 20)
    path = written(tmp_path, {"t": T, "yaw": YAW, "boat": boats})
    in_blocks(monkeypatch)
    for wanted in (2, "2"):
        log = readers.read("csv", [path], LogMap(where={"boat": wanted}))
        np.testing.assert_array_equal(log.signals["yaw"].values, YAW[150:])
    with refused("value", "where.boat"):
        readers.read("csv", [path], LogMap(where={"boat": 3}))


def test_parquet_in_blocks(tmp_path, monkeypatch):
    import pandas as pd

    frame = pd.DataFrame({"t": T, "yaw": YAW, "n": pd.array([None, *range(N - 1)], dtype="Int64"), "mode": "AUTO"})
    frame.to_parquet(tmp_path / "t.parquet")
    whole = readers.read("parquet", [tmp_path / "t.parquet"])
    np.testing.assert_array_equal(whole.signals["n"].times, T[1:])
    in_blocks(monkeypatch)
    same(readers.read("parquet", [tmp_path / "t.parquet"]), whole)


def test_only_what_a_map_names_is_kept(tmp_path):
    """By the name of the file too; with a name that is missing all is read, to be compared with."""
    path = written(tmp_path, {"t": T, "yaw": YAW, "x": T, "mode": ["AUTO"] * N})
    for signal in ("yaw", "t.yaw"):
        log_map = LogMap(columns={"yaw_deg": {"signal": signal}})
        assert set(readers.read("csv", [path], log_map).signals) == ({"yaw"} if signal == "yaw" else {"yaw", "x"})


@pytest.mark.slow
def test_memory_does_not_grow_with_a_table(tmp_path, monkeypatch):
    """While it is converted, and while what came of it is read part by part."""
    monkeypatch.setattr(table, "BLOCK", 1 << 17)
    monkeypatch.setattr(readers, "MOST", 8000)
    monkeypatch.setattr(log_files, "CHUNK", 2000)
    log_map = LogMap(columns={name: {"signal": name, "unit": "m"} for name in ("x_m", "y_m")})
    peaks = []
    for n in (60_000, 240_000):
        t = 0.01 * np.arange(n)
        cells = dict.fromkeys(("a", "b", "c", "x_m", "y_m"), np.round(np.sin(t), 4))
        path = written(tmp_path, {"t": t, "mode": np.where(t < 5.0, "AUTO", "MANUAL")} | cells)
        del t, cells
        tracemalloc.start()
        parts = conversion.in_parts(readers.parts("csv", [path], log_map), log_map, tmp_path / "map.toml")
        conversion.save(tmp_path / "log.csv", parts)
        assert sum(len(log["x"]) for log in log_files.read_parts(tmp_path / "log.csv", most=8000)) == n
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.1 * peaks[0]


def test_a_log_is_the_same_in_blocks(tmp_path, monkeypatch):
    """Blank rows at any place do not move the line that a message names."""
    rows = [f"{t},{45.0 + 1e-5 * t},7.0,{y}" for t, y in zip(T, YAW, strict=True)]
    for k in (280, 120, 20):
        rows.insert(k, "")
    text = "\n".join(["time_s,latitude_deg,longitude_deg,yaw_deg", *rows])
    (tmp_path / "log.csv").write_text(text)
    whole = log_files.read_log(tmp_path / "log.csv")
    monkeypatch.setattr(log_files, "CHUNK", 50)
    log = log_files.read_log(tmp_path / "log.csv")
    parts = list(log_files.read_parts(tmp_path / "log.csv", most=100))
    assert len(parts) == 3
    for name, values in log.items():
        np.testing.assert_array_equal(np.concatenate([part[name] for part in parts]), values)
    log_files.write_log(tmp_path / "again.csv.gz", log)
    again = log_files.read_log(tmp_path / "again.csv.gz")
    for name, values in whole.items():
        np.testing.assert_array_equal(log[name], values)
        np.testing.assert_allclose(again[name], values, rtol=1e-11, atol=1e-9)
    (tmp_path / "log.csv").write_text(text.replace(rows[-1], f"{T[-1]},45,7,1e7"))
    with refused("unit", "yaw_deg") as error:
        log_files.read_log(tmp_path / "log.csv")
    assert f"line {len(rows) + 1}," in str(error.value)


def test_marks_of_a_long_log_are_found_part_by_part(monkeypatch, rng):
    values = 10.0 + np.cumsum(rng.normal(size=4000))
    values[[7, 1500, 3900]] = -9999.0
    whole = columns.marks(values)
    monkeypatch.setattr(columns, "MOST", 20)
    assert columns.marks(values) == whole == {-9999.0: 3}
