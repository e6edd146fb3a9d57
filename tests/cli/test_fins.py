"""The commands with a boat that is steered by fins: from its file to the data card of a study on its log."""

import json
import tomllib

import numpy as np
import pytest
import tomli_w
from support import refusals
from support.fins import BOW, PORT, STARBOARD, X_TAIL, fins, with_actuators

from bayesub.logs import log_files
from bayesub.study.run.prepare import prepare
from bayesub.study.schema.study_file import load_study

COLUMNS = [*(f"fin_{k}_deg" for k in range(1, 5)), "port_rpm", "starboard_rpm", "bow_thruster_n"]


@pytest.fixture
def finned(suboff_file, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    pushers = (PORT | {"kt0": 0.5}, STARBOARD | {"kt0": 0.5}, BOW)
    content = with_actuators(tomllib.loads(suboff_file), *fins(*X_TAIL), *pushers, propulsion={"model": "none"})
    (tmp_path / "finned.toml").write_text(tomli_w.dumps(content))
    return tmp_path


@pytest.mark.rendered
def test_the_card_shows_the_fins(bayesub, finned):
    """Lines, JSON and a sketch; a tail without stern planes is flown without them."""
    status, out, _ = bayesub("check", "finned.toml", "--card", "card.png")
    assert status == 0
    assert "fin_1_deg         at 45 deg from the top, to 25 deg, +0.354 rudder, -0.354 stern_plane" in out
    assert "bow_thruster_n    to 1e+05 N, 1 N make Y 1 N" in out
    assert (finned / "card.png").stat().st_size > 10_000
    numbers = json.loads(bayesub("check", "finned.toml", "--json")[1])["finned.toml"]
    assert list(numbers["actuators"]) == COLUMNS
    assert numbers["actuators"]["fin_2_deg"]["controls"] == pytest.approx(
        {"rudder_deg": -np.sqrt(0.125), "stern_plane_deg": -np.sqrt(0.125)}
    )
    # Both propellers push; the thrust of the file counts as theirs.
    forces = [numbers["actuators"][name]["forces"]["X"] for name in ("port_rpm", "starboard_rpm")]
    drag = sum(forces) / numbers["thrust_over_drag"]["above_self_propulsion"]
    assert drag == pytest.approx(0.5 * 1025.0 * 102.2606**2 * 7.5**2 * 0.001, rel=0.1)
    content = tomllib.loads((finned / "finned.toml").read_text()) | {"actuators": fins(0.0, 180.0)}
    (finned / "rudders.toml").write_text(tomli_w.dumps(content))
    status, out, _ = bayesub("check", "rudders.toml")
    assert status == 0
    assert "stern planes      not examined: no actuator moves stern_plane_deg" in out


def test_from_simulation_to_study(bayesub, finned):
    """A simulated log has the columns of the fins, and is checked, made a study and read with them."""
    status, out, _ = bayesub(
        "simulate", "finned.toml", "random:3", "-o", "log.csv", "--dt", "0.5", "--sensors", "autosub", "--plot", "t.png"
    )
    assert status == 0
    log = log_files.read_log(finned / "log.csv", COLUMNS)
    assert set(COLUMNS) <= log.keys()
    assert not set(log_files.CONTROLS) & log.keys()
    status, out, _ = bayesub("check", "finned.toml", "log.csv")
    assert status == 0
    assert "fin_4_deg" in out.splitlines()[-2]
    assert out.splitlines()[-1] == "no column contradicts another"
    assert bayesub("check", "log.csv")[0] == 2
    refusals.check(bayesub.error, "unknown", "fin_1_deg")
    assert bayesub("new", "study", "bent", "--vehicle", "finned.toml", "--data", "log.csv")[0] == 0
    text = (finned / "bent.toml").read_text()
    assert "subproblem" not in text
    text = text.replace("[nuisance] ", "[nuisance]\nbias_fin_2_deg = { mean = 0, sd = 1 }\n# ")
    text = text.replace('coefficients = "all"', 'coefficients = ["Xuu", "Yuu_dr"]') + "\ndt_s = 0.5\n"
    (finned / "bent.toml").write_text(toml_with(text))
    problem = prepare(load_study(finned / "bent.toml")).problem
    assert "bias_fin_2_deg" in problem.names
    assert np.isfinite(problem.log_likelihood(problem.prior.mean)[0])
    np.testing.assert_allclose(problem.manoeuvre.inputs[:, 4:6], 90.0)
    status, out, _ = bayesub("check", "bent.toml")
    assert status == 0
    assert "bias_fin_2_deg" in out


def toml_with(text):
    """The text with keys that were added at its end moved to the top."""
    head, _, tail = text.rpartition("\ndt_s")
    return f"dt_s{tail}\n{head}"


def test_a_log_of_one_plane(bayesub, finned):
    """Fins that make rudder alone keep the boat in the horizontal plane; a log of rudders is not one of fins."""
    assert bayesub("simulate", "finned.toml", "horizontal", "-o", "log.csv", "--dt", "0.5")[0] == 0
    assert bayesub("new", "study", "turn", "--vehicle", "finned.toml", "--data", "log.csv")[0] == 0
    assert 'subproblem = "horizontal"' in (finned / "turn.toml").read_text()
    assert bayesub("simulate", "suboff", "horizontal", "-o", "rudder.csv", "--dt", "0.5")[0] == 0
    assert bayesub("new", "study", "other", "--vehicle", "finned.toml", "--data", "rudder.csv")[0] == 2
    refusals.check(bayesub.error, "unknown", "rudder_deg")
