"""A log that is converted part by part is the one that is converted at once."""

from pathlib import Path

import numpy as np
import pytest
from support.refusals import refused

from bayesub.logs import conversion, log_files
from bayesub.logs.log_map import LogMap
from bayesub.logs.readers import Signal, VehicleLog

MAP, N = Path("map.toml"), 4000


def a_log(rng, *, interval=0.1, late=0.3, repeated=0.02, empty=0.1):
    """Signals of a log of which some stamps are late or repeated, readings are no numbers, and one begins late."""
    times = interval * np.cumsum(rng.integers(1, 4, N))
    times[N // 3 :] += 40.0  # a pause
    times[2 * N // 3 :] += 1.9 * interval
    mixed = times - np.where(rng.random(N) < late, 0.4 * rng.random(N), 0.0)
    again = np.flatnonzero(rng.random(N - 1) < repeated)
    mixed[again + 1] = mixed[again]
    noisy = np.where(rng.random(N) < empty, np.nan, rng.normal(size=N))
    steps = np.repeat(10.0 * rng.integers(-3, 4, N // 100), 100)
    return {
        "rudder": Signal(mixed, steps),
        "order": Signal(times[::50], np.round(rng.normal(size=N // 50), 1)),
        "yaw": Signal(mixed, np.mod(np.cumsum(rng.normal(0.5, 3.0, N)), 360.0)),
        "u": Signal(times, noisy),
        "fix": Signal(times[N // 2 :: 7], rng.normal(size=len(times[N // 2 :: 7]))),
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
    "an end": {"end_s": 522.2},
    "both, from a zero": {"zero": 50.0, "start_s": 10.0, "end_s": 500.0},
}


def parts_of(signals, ends):
    """Logs that hold the readings between these times, in the order of the file."""
    places = {name: np.searchsorted(np.maximum.accumulate(one.times), ends) for name, one in signals.items()}
    for k in range(len(ends) - 1):
        cut = {name: slice(*places[name][[k, k + 1]]) for name in signals}
        yield VehicleLog(Path("a.csv"), {n: Signal(s.times[cut[n]], s.values[cut[n]]) for n, s in signals.items()})


def made(signals, log_map, ends):
    parts = list(conversion.in_parts(parts_of(signals, ends), log_map, MAP))
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
    whole = made(signals, log_map, np.array([-np.inf, np.inf]))
    for n in (2, 7, 60):
        inside = np.sort(rng.uniform(signals["u"].times[0], signals["u"].times[-1], n))
        rows, cells, remarks = made(signals, log_map, np.array([-np.inf, *inside, np.inf]))
        np.testing.assert_array_equal(rows, whole[0])
        for name, values in whole[1].items():
            np.testing.assert_allclose(cells[name], values, rtol=1e-12, atol=1e-9, err_msg=name)
        assert remarks == whole[2]


def test_what_is_wrong_with_a_log_in_parts_is_told_as_of_a_whole_one():
    ends = np.array([-np.inf, 100.0, 300.0, np.inf])
    for signals, columns, kind, key in [
        ({"u": Signal(np.append(np.arange(500.0), np.arange(400.0, 500.0)), np.zeros(600))}, {}, "data", "u"),
        ({"u": Signal(np.arange(500.0), np.full(500, np.nan))}, {}, "data", "columns.u_mps"),
        ({"u": Signal(np.arange(500.0), np.ones(500))}, {"valid": (2.0, 3.0)}, "data", "columns.u_mps"),
    ]:
        log_map = LogMap(columns={"u_mps": {"signal": "u", "unit": "m/s"} | columns})
        for some in (ends, ends[[0, -1]]):
            with refused(kind, key):
                made(signals, log_map, some)


def test_a_log_in_parts_is_written_as_a_whole_one(tmp_path, rng):
    log_map = LogMap(columns={name: {"unit": name.rpartition("_")[2]} | one for name, one in COLUMNS.items()})
    signals = a_log(rng)
    ends = np.array([-np.inf, 200.0, 400.0, np.inf])
    whole = conversion.convert(VehicleLog(Path("a.csv"), signals), log_map, MAP)
    whole.save(tmp_path / "whole.csv")
    parts = conversion.in_parts(parts_of(signals, ends), log_map, MAP)
    last, extents = conversion.save(tmp_path / "parts.csv", parts)
    assert (tmp_path / "parts.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()
    assert last.zero == whole.zero
    assert last.remarks == whole.remarks
    for name, cells in whole.columns.items():
        assert extents[name] == (np.isfinite(cells).sum(), np.nanmin(cells), np.nanmax(cells))
    assert extents["time_s"] == (len(whole.times), whole.times[0], whole.times[-1])
    assert set(log_files.read_log(tmp_path / "parts.csv", ["thruster_n"])) >= {"time", "delta_r", "psi", "u", "x"}
