"""The card of a log."""

import json
import tomllib

import numpy as np
import pytest
from support.fins import X_TAIL, fins, with_actuators
from support.refusals import told

import bayesub as bs
from bayesub.findings import log_card
from bayesub.logs import log_files
from bayesub.study.before import check


@pytest.fixture
def finned(suboff_file, vehicle_with):
    """A boat with an X-tail."""
    content = tomllib.loads(suboff_file)
    content.pop("actuators", None)
    return vehicle_with(with_actuators(content, *fins(*X_TAIL)))


def test_fins_are_compared_with_the_turn_that_follows(finned, suboff, tmp_path):
    """Together they are a rudder and stern planes; all of the other sign are named, with the boat and not without."""
    suboff_track = bs.simulate(suboff, bs.load_manoeuvre("coupled", suboff))
    suboff_track.save(tmp_path / "track.csv")
    log = log_files.read_log(tmp_path / "track.csv")
    orders = np.stack([log.pop("delta_r"), np.zeros(len(log["time"])), log.pop("delta_s")], axis=1)
    log.pop("delta_b", None)
    actuators = finned.actuators
    angles = orders @ actuators.allocation[:, :3].T
    columns = dict(zip(actuators.columns, angles.T, strict=True))
    for sign, n_lines in ((1.0, 0), (-1.0, 2)):
        whole = log | {column: sign * values for column, values in columns.items()}
        headers = [log_files.HEADERS.get(name, name) for name in whole]
        card = log_card.check(whole, headers, actuators.log_columns, finned)
        assert len(card.findings) == n_lines
    rudder, planes = card.findings
    for finding in (rudder, planes):
        told(finding, "sign", ", ".join(f"fin_{k}_deg" for k in range(1, 5)))
    assert log_card.check(whole, headers, actuators.log_columns).lines() == ["no column contradicts another"]


def test_a_long_log_is_examined_part_by_part(bayesub, tmp_path, monkeypatch):
    """A clean one has no findings; what is wrong in a later part, or between two of them, is told once."""
    boat = bs.load_vehicle("auv690")
    bs.simulate(boat, bs.load_manoeuvre("random", boat), sample=0.1).save(tmp_path / "track.csv")
    clean = log_files.read_log(tmp_path / "track.csv")
    n = len(clean["time"])
    monkeypatch.setattr(check, "MOST", n // 3)
    monkeypatch.setattr(log_files, "CHUNK", n // 12)
    late, stuck = dict(clean), dict(clean)
    late["time"] = clean["time"] - np.where(np.arange(n) >= n // 3, 5.0, 0.0)
    stuck["psi"] = np.where(
        (np.arange(n) > 0.7 * n) & (np.arange(n) < 0.8 * n), clean["psi"][n * 7 // 10], clean["psi"]
    )
    for log, kinds in ((clean, []), (late, ["clock"]), (stuck, ["stuck"])):
        log_files.write_log(tmp_path / "log.csv", log)
        status, said, _ = bayesub("check", str(tmp_path / "log.csv"), "--json")
        ((_, card),) = json.loads(said).items()
        assert status == 0
        assert card["found"].startswith(f"log of {n} rows from 0 to {log['time'][-1]:g} s")
        assert [finding["kind"] for finding in card["findings"]] == kinds


def test_a_boat_may_drift_throughout_a_part_of_a_long_log(bayesub, tmp_path, monkeypatch):
    """With its propeller at rest, sideways; a column that holds another than its name says is still found, once."""
    boat = bs.load_vehicle("auv690")
    bs.simulate(boat, bs.load_manoeuvre("random", boat), sample=0.1).save(tmp_path / "track.csv")
    flown = log_files.read_log(tmp_path / "track.csv")
    n, rng = len(flown["time"]), np.random.default_rng(1)
    idle = {name: np.full(n, values[0]) + 1e-6 * rng.standard_normal(n) for name, values in flown.items()}
    idle |= {"u": 0.01 + 1e-3 * rng.standard_normal(n), "v": 0.2 + 1e-3 * rng.standard_normal(n), "rpm": np.zeros(n)}
    idle |= {"time": flown["time"]}
    names = ("time", "delta_r", "rpm", "u", "v", "r", "psi")
    later = {name: flown[name] + (flown["time"][-1] + 0.1 if name == "time" else 0.0) for name in names}
    log = {name: np.append(idle[name], later[name]) for name in names}
    monkeypatch.setattr(check, "MOST", n)
    monkeypatch.setattr(log_files, "CHUNK", n // 4)
    for sign, kinds in ((1.0, []), (-1.0, ["sign"])):
        log_files.write_log(tmp_path / "log.csv", log | {"r": sign * log["r"]})
        status, said, _ = bayesub("check", "auv690", str(tmp_path / "log.csv"), "--json")
        assert status == 0
        card = json.loads(said)[str(tmp_path / "log.csv")]
        assert [finding["kind"] for finding in card["findings"]] == kinds
