"""A log that is converted part by part is the one that is converted at once."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from support.refusals import refused

from bayesub.logs import conversion, log_files
from bayesub.logs.log_map import LogMap
from bayesub.logs.readers import Signal, VehicleLog

MAP, N = Path("map.toml"), 4000
ROWS = {name: np.arange(N) for name in ("rudder", "yaw", "u", "depth")}  # of the table in which a signal has readings
ROWS |= {"order": np.arange(0, N, 50), "fix": np.arange(N // 2, N, 7)}
STEPS = np.arange(100, N, 100)  # rows at which the rudder changes


def a_log(rng):
    """Signals of a log of which some stamps are late or repeated, readings are no numbers, and one begins late."""
    times = 0.1 * np.cumsum(rng.integers(1, 4, N))
    times += 1.7 * (np.arange(N) // 40) + 40.0 * (np.arange(N) > N // 3)  # pauses
    mixed = times - np.where(rng.random(N) < 0.3, 0.85 * rng.random(N), 0.0)
    again = np.flatnonzero(rng.random(N - 1) < 0.05)
    mixed[again + 1] = mixed[again]
    noisy = np.where(rng.random(N) < 0.1, np.nan, rng.normal(size=N))
    steps = np.repeat(10.0 * rng.integers(-3, 4, N // 100), 100)
    return {
        "rudder": Signal(mixed, steps),
        "order": Signal(times[ROWS["order"]], np.round(rng.normal(size=N // 50), 1)),
        "yaw": Signal(mixed, np.mod(np.cumsum(rng.normal(0.5, 3.0, N)), 360.0)),
        "u": Signal(times, noisy),
        "fix": Signal(times[ROWS["fix"]], rng.normal(size=len(ROWS["fix"]))),
        "depth": Signal(times, np.where(rng.random(N) < 0.01, -9999.0, np.sin(times))),
    }


COLUMNS = {
    "rudder_deg": {"signal": "rudder", "held": True},
    "thruster_n": {"signal": "order", "held": True},
    "yaw_deg": {"signal": "yaw"},
    "u_mps": {"signal": "u", "delay_s": 0.25},
    "x_m": {"signal": "fix"},
    "depth_m": {"signal": "depth", "missing": (-9999.0,)},
}
CASES = {
    "as they are": {},
    "thinned": {"yaw_deg": {"interval_s": 0.7}, "u_mps": {"interval_s": 1.3}, "rudder_deg": {"interval_s": 0.5}},
    "averaged": {"yaw_deg": {"interval_s": 2.0, "average": True}, "u_mps": {"interval_s": 0.9, "average": True}},
    "averaged and wrapped": {"yaw_deg": {"interval_s": 1.0, "average": True, "wrap": True}},
    "long intervals": {"yaw_deg": {"interval_s": 90.0, "average": True}, "depth_m": {"interval_s": 60.0}},
}
TIMES = {
    "all": {},
    "a start": {"start_s": 333.3},
    "an end": {"end_s": 722.2},
    "both, from a zero": {"zero": 50.0, "start_s": 10.0, "end_s": 700.0},
}


def parts_of(signals, cuts):
    """Logs that hold the readings of the rows between these."""
    for first, last in pairwise([0, *cuts, N]):
        part = {}
        for name, signal in signals.items():
            inside = slice(*np.searchsorted(ROWS[name], [first, last]))
            part[name] = Signal(signal.times[inside], signal.values[inside])
        yield VehicleLog(Path("a.csv"), part)


def made(signals, log_map, cuts=()):
    parts = list(conversion.in_parts(parts_of(signals, cuts), log_map, MAP))
    columns = [part.columns for part in parts]
    rows = np.concatenate([part.times for part in parts])
    return rows, {name: np.concatenate([one[name] for one in columns]) for name in columns[0]}, parts[-1].remarks


@pytest.mark.parametrize("time", TIMES.values(), ids=TIMES)
@pytest.mark.parametrize("changed", CASES.values(), ids=CASES)
def test_a_log_in_parts_is_the_same(changed, time, rng):
    """Whatever the rules of its columns, and wherever it is cut: rows, cells and remarks."""
    columns = {name: {"unit": name.rpartition("_")[2]} | one | changed.get(name, {}) for name, one in COLUMNS.items()}
    log_map = LogMap(time=time, columns=columns)
    signals = a_log(rng)
    whole = made(signals, log_map)
    for cuts in (*(np.sort(rng.choice(N, n, replace=False)) for n in (2, 7, 60, 400)), STEPS):
        rows, cells, remarks = made(signals, log_map, cuts)
        np.testing.assert_array_equal(rows, whole[0])
        for name, values in whole[1].items():
            np.testing.assert_allclose(cells[name], values, rtol=1e-12, atol=1e-9, err_msg=name)
        assert remarks == whole[2]


def test_what_is_wrong_with_a_log_in_parts_is_told_as_of_a_whole_one():
    for signals, columns, kind, key in [
        ({"u": Signal(np.append(np.arange(500.0), np.arange(400.0, 500.0)), np.zeros(600))}, {}, "data", "u"),
        ({"u": Signal(np.arange(500.0), np.full(500, np.nan))}, {}, "data", "columns.u_mps"),
        ({"u": Signal(np.arange(500.0), np.ones(500))}, {"valid": (2.0, 3.0)}, "data", "columns.u_mps"),
    ]:
        log_map = LogMap(columns={"u_mps": {"signal": "u", "unit": "m/s"} | columns})
        for cuts in ((), (100, 300)):
            with refused(kind, key):
                made(signals, log_map, cuts)


def test_a_log_in_parts_is_written_as_a_whole_one(tmp_path, rng):
    log_map = LogMap(columns={name: {"unit": name.rpartition("_")[2]} | one for name, one in COLUMNS.items()})
    signals = a_log(rng)
    whole = conversion.convert(VehicleLog(Path("a.csv"), signals), log_map, MAP)
    whole.save(tmp_path / "whole.csv")
    parts = conversion.in_parts(parts_of(signals, (1500, 2500)), log_map, MAP)
    last, extents = conversion.save(tmp_path / "parts.csv", parts)
    assert (tmp_path / "parts.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()
    assert last.zero == whole.zero
    assert last.remarks == whole.remarks
    for name, cells in whole.columns.items():
        assert extents[name] == (np.isfinite(cells).sum(), np.nanmin(cells), np.nanmax(cells))
    assert extents["time_s"] == (len(whole.times), whole.times[0], whole.times[-1])
    assert set(log_files.read_log(tmp_path / "parts.csv", ["thruster_n"])) >= {"time", "delta_r", "psi", "u", "x"}


def test_the_last_moment_of_an_order_is_written_with_the_part_in_which_it_changes():
    """It is a row of its own, a millisecond before the change, which the next part has."""
    times = np.arange(20.0)
    times[9] += 0.0005
    signals = {"rudder": Signal(times, np.where(times < 9.0, 0.0, 5.0)), "u": Signal(np.arange(20.0), np.arange(20.0))}
    columns = {"rudder_deg": {"signal": "rudder", "held": True, "unit": "deg"}, "u_mps": {"signal": "u", "unit": "m/s"}}
    whole = made(signals, LogMap(columns=columns))
    assert 8.9995 in whole[0].round(6)
    for cut in range(8, 13):
        np.testing.assert_array_equal(made(signals, LogMap(columns=columns), (cut,))[0], whole[0])


def test_late_readings_are_sorted_into_the_part_before():
    """By each row of the table as the first of another part; stamps may go back more than once in a row."""
    columns = {"u_mps": {"signal": "u", "unit": "m/s"}}
    for stamps in ([10.0, 9.3, 9.7, 10.5], [10.0, 9.1, 8.2, 7.3, 10.5], [10.0, 9.2, 9.2, 10.0, 9.2]):
        times = np.concatenate([np.arange(10.0), stamps, np.arange(11.0, 30.0)])
        signals = {"u": Signal(times, np.arange(len(times)) * 1.0)}
        whole = made(signals, LogMap(columns=columns))
        for cut in range(1, len(times)):
            rows, cells, remarks = made(signals, LogMap(columns=columns), (cut,))
            np.testing.assert_array_equal(rows, whole[0])
            np.testing.assert_array_equal(cells["u_mps"], whole[1]["u_mps"])
            assert remarks == whole[2]
