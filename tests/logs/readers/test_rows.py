"""Rows of tables: of one boat among several, with cells of text, and with times of receipt."""

import numpy as np
import pytest
from support.refusals import refused

from bayesub.io.errors import InputError
from bayesub.logs import conversion, readers
from bayesub.logs.log_map import LogMap

N = 200
TIMES = 0.1 * np.arange(N)
YAW = np.round(10.0 + 0.5 * TIMES + 0.01 * np.sin(7.0 * TIMES), 3)
FLEET = np.where(np.arange(N) % 2, "auv 2", "auv 1")


def table(folder, **columns):
    """The file of a table."""
    cells = [[head, *map(str, column)] for head, column in columns.items()]
    path = folder / "log.csv"
    path.write_text("\n".join(map(",".join, zip(*cells, strict=True))))
    return path


def read(path, **keys):
    return readers.read("csv", [path], LogMap(**keys))


def said(path, **keys):
    return " ".join(read(path, **keys).remarks)


@pytest.mark.parametrize("text", ["---", "ERR", "*", "#N/A", "<NA>", "n.a.", "NULL", "inf", "", "OFF"])
def test_a_cell_of_text_costs_one_reading_and_not_the_column(text, tmp_path):
    cells = list(map(str, YAW))
    cells[5] = cells[77] = text
    path = table(tmp_path, time=TIMES, yaw=cells)
    log = read(path)
    assert np.isfinite(log.signals["yaw"].values).sum() == N - 2
    assert any(f"'{text}' in 2 of {N} cells" in remark for remark in log.remarks) == (text not in {"NULL", "inf", ""})


@pytest.mark.parametrize("mark", [" ", "\u202f", "\xa0", "'", "’"])
@pytest.mark.parametrize("decimal", [".", ","])
def test_thousands_may_be_apart(mark, decimal, tmp_path):
    """As spreadsheets show them in France and in Switzerland; a column need not reach the thousands in all rows."""
    x = 990.25 + 100.0 * np.arange(N)
    cells = [f"{value:,.2f}".replace(",", mark).replace(".", decimal) for value in x]
    rows = [f"{t};{cell}".replace(".", decimal) for t, cell in zip(TIMES, cells, strict=True)]
    (tmp_path / "log.csv").write_text("\n".join(["temps (s);x (m)", *rows]), encoding="utf-8")
    np.testing.assert_array_equal(read(tmp_path / "log.csv").signals["x"].values, x)
    assert not read(tmp_path / "log.csv").remarks


def test_a_column_of_text_is_left_out_and_a_map_of_it_says_why(tmp_path):
    path = table(tmp_path, time=TIMES, yaw=YAW, mode=["AUTO"] * (N - 2) + ["1", "2"])
    assert list(read(path).signals) == ["yaw"]
    log_map = LogMap(columns={"x_m": {"signal": "mode", "unit": "m"}})
    with refused("unknown", "columns.x_m.signal"):
        conversion.convert(read(path), log_map, tmp_path / "map.toml")


@pytest.mark.parametrize(
    ("labels", "line"),
    [
        (FLEET, 'where = { vehicle = "auv 1" }'),
        (np.arange(N) % 2 + 7, "where = { vehicle = 7 }"),
        (np.array(["a", "b"])[np.random.default_rng(0).integers(0, 2, N)], 'where = { vehicle = "b" }'),
    ],
)
def test_rows_of_several_boats_are_told_apart_by_a_column(labels, line, tmp_path):
    yaw = np.where(labels == labels[0], YAW, YAW + 150.0)
    path = table(tmp_path, time=TIMES, yaw=yaw, vehicle=labels)
    assert line in said(path)
    label = labels[0].item()
    kept = read(path, where={"vehicle": label}).signals["yaw"].values
    np.testing.assert_array_equal(kept, YAW[labels == labels[0]])
    assert "where" not in said(path, where={"vehicle": label})


def test_rows_of_two_runs_are_told_apart_by_a_column(tmp_path):
    path = table(tmp_path, time=np.tile(TIMES[:100], 2), yaw=YAW, run=np.repeat([1, 2], 100))
    assert "where = { run = 1 }" in said(path)
    assert read(path, where={"run": 2}).end == TIMES[99]
    with refused("data", "yaw"):
        columns = {"heading_deg": {"signal": "yaw", "unit": "deg"}}
        conversion.convert(read(path), LogMap(columns=columns), tmp_path / "map.toml")


@pytest.mark.parametrize("labels", [np.repeat(["AUTO", "HAND"], 100), np.arange(N) // 3 % 2, np.arange(N) % 4])
def test_nothing_is_said_of_a_column_that_tells_nothing_apart(labels, tmp_path):
    assert "where" not in said(table(tmp_path, time=TIMES, yaw=YAW, rudder=5.0 * (np.arange(N) % 4 < 2), mode=labels))


def test_rows_from_the_last_to_the_first_are_of_one_boat(tmp_path):
    assert said(table(tmp_path, time=TIMES[::-1], yaw=YAW, rudder=np.repeat([10.0, 0.0], 100))) == ""


def test_where_names_a_column_and_what_it_has(tmp_path):
    path = table(tmp_path, time=TIMES, yaw=YAW, vehicle=FLEET)
    with refused("unknown", "where.vehicl"):
        read(path, where={"vehicl": "auv 1"})
    with refused("value", "where.vehicle"):
        read(path, where={"vehicle": "auv 3"})
    with pytest.raises(InputError, match="where selects rows of tables"):
        readers.read("nmea", [path], LogMap(where={"vehicle": "auv 1"}))


@pytest.mark.parametrize("size", [3, 5, 10])
def test_times_of_receipt_and_those_of_the_header(size, tmp_path):
    rows = np.arange(N)
    receipt = np.round(TIMES[np.minimum(rows // size * size + size - 1, N - 1)] + 1e-3 * (rows % size), 3)
    columns = {"time": receipt, "field.header.stamp": TIMES, "yaw": YAW}
    assert 'signal = "field.header.stamp"' in said(table(tmp_path, **columns))
    assert said(table(tmp_path, **columns), time={"signal": "field.header.stamp"}) == ""


def test_a_rudder_that_is_elsewhere_where_a_run_begins_tells_no_boats_apart(tmp_path):
    """Neither as a signal of the map nor, if it moves at other times too, in a list; a number of the run does."""
    time, rudder = np.tile(np.arange(60.0), 2), np.repeat([0, 10, -10, 10, -10, 0], 20)
    path = table(tmp_path, time=time, rudder=rudder, run=np.repeat([1, 2], 60))
    assert [remark.split()[0] for remark in read(path).remarks] == ["'run'"]
    path = table(tmp_path, time=time, rudder=np.repeat([0, 10], 60), u=time)
    assert read(path, columns={"rudder_deg": {"signal": "rudder"}}).remarks == ()
    assert len(read(path).remarks) == 1  # without a map it may be the number of a run
