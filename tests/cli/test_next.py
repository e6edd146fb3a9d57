"""`bayesub next`: what a further trial, a manoeuvre or a tank value promises, against sums done by hand."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from support import refusals

from bayesub.design.plan import with_ready_made
from bayesub.findings.verdicts import IN_CONFLICT, STATUS, in_words
from bayesub.inference.sampling import posterior_file
from bayesub.io.errors import InputError
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.study.after import design
from bayesub.study.after.finished_run import finished_run
from bayesub.study.run.prescribed import judge_of_next, prescription


@pytest.fixture(autouse=True)
def soon(monkeypatch):
    """A brief search."""
    monkeypatch.setattr("bayesub.design.plan.N_JUDGED", 20)


@pytest.mark.slow
def test_promises_are_those_of_the_sums(bayesub, finished, tmp_path):
    """A tank value by the variance of the draws; a trial again halves it; what is promised is never worse than now."""
    folder = finished()
    posterior = posterior_file.load(folder / "posterior.nc")
    file = tmp_path / "next.csv"
    status, out, err = bayesub("next", str(folder), "--for", "Nuv", "--json", "-o", str(file))
    assert status == 0, err
    (one,) = json.loads(out).values()
    k = posterior.names.index("Nuv")
    assert one["sd"] == pytest.approx(posterior.sd[k], rel=1e-6)
    assert one["value"] == pytest.approx(posterior.mean[k], rel=1e-6)
    (tank,) = (way for way in one["after"] if "tank" in way)
    assert tank == "Nuv from a tank, to 5 %"
    exact = (posterior.sd[k] ** -2 + (0.05 * posterior.mean[k]) ** -2) ** -0.5
    assert one["after"][tank] == pytest.approx(exact, rel=1e-6)
    assert one["after"]["the last trial again"] == pytest.approx(one["sd"] / np.sqrt(2.0), rel=0.1)
    assert max(one["after"].values()) <= one["sd"]
    assert bayesub("simulate", "auv690", str(file), "-o", str(tmp_path / "track.csv"))[0] == 0


def test_by_default_what_the_trial_sees_most_of_and_the_best_way_first(bayesub, finished):
    """A table with a column for each; ways are in the order of what they leave."""
    status, out, err = bayesub("next", str(finished()))
    assert status == 0, err
    assert out.splitlines()[-1] == "in per cent: what is left of the sd of now"
    rows = [line for line in out.splitlines() if line.rstrip().endswith("%") and "manoeuvres" not in line]
    left = [
        np.mean(np.log([float(word) for word in row.replace("to 5 %", "").replace("%", "").split()[-3:]]))
        for row in rows
    ]
    assert len(rows) == 5
    assert left == sorted(left)


def test_the_report_of_a_run_ends_in_the_same_but_for_the_manoeuvre(bayesub, finished):
    """Its numbers, a figure and a sentence."""
    folder = finished()
    numbers = json.loads((folder / "numbers.json").read_text())
    content = json.loads(bayesub("next", str(folder), "--json")[1])
    for name, one in numbers["prescription"].items():
        searched = [way for way in content[name]["after"] if way.startswith("another manoeuvre")]
        assert {way: sd for way, sd in content[name]["after"].items() if way not in searched} == pytest.approx(
            one["after"], rel=1e-9
        )
        assert len(searched) == 1
        assert name in numbers["verdict"]["next"]
    assert (folder / "next.png").exists()


def test_the_ready_made_manoeuvre_is_the_best_that_keeps_the_limits(finished):
    """By a study's name for it, so that it can be flown at once; all others tell less, or go beyond."""
    run = finished_run(finished())
    found, flights = prescription(run.setup(), run.posterior)
    (way,) = (way for way in found.ways if way.startswith("the manoeuvre "))
    allowed = {}
    built_in = ("horizontal", "turning_circle", "zigzag_10_10", "zigzag_20_20")
    for name in (*built_in, *(f"random:{k}" for k in range(1, 13))):
        manoeuvre = load_manoeuvre(name, run.vehicle)
        if flights.penalty(flights.margins(manoeuvre)) == 0.0:
            allowed[name] = found.goal(found.judge.information(manoeuvre)[0])
    assert len(allowed) > 5
    allowed.pop(found.again.name, None)  # which is "the last trial again"
    assert way == f"the manoeuvre {min(allowed, key=allowed.get)}"
    assert found.goal(found.ways[way]) == pytest.approx(min(allowed.values()), rel=1e-12)


def test_the_manoeuvre_that_was_flown_is_not_proposed_as_another(finished):
    """The best of all, once it has been flown, gives way to the next."""
    run = finished_run(finished())
    found, flights = prescription(run.setup(), run.posterior)
    (best,) = (way.removeprefix("the manoeuvre ") for way in found.ways if way.startswith("the manoeuvre "))
    before = replace(found, ways={}, again=load_manoeuvre(best, run.vehicle))
    (way,) = with_ready_made(before, flights).ways
    assert way.startswith("the manoeuvre ")
    assert way != f"the manoeuvre {best}"


@pytest.fixture
def fixed_controls(monkeypatch):
    """No control may move, so that no manoeuvre is looked for, which takes longest."""

    def none(*_):
        raise InputError("suboff: has no control that may move; give limits of one", "missing", "limits")

    monkeypatch.setattr(design, "families", none)


@pytest.mark.usefixtures("fixed_controls")
def test_a_boat_that_may_move_no_control_is_told_what_needs_none(bayesub, finished):
    """No manoeuvre is looked for, and the other ways are given."""
    status, out, err = bayesub("next", str(finished()), "--json")
    assert status == 0, err
    assert all(set(one["after"]) and "another" not in str(one) for one in json.loads(out).values())


@pytest.mark.usefixtures("fixed_controls")
def test_an_answer_in_doubt_is_said_to_be_so(bayesub, finished, tmp_path):
    """The table all the same, and the status of the verdict, in JSON too."""
    run = tmp_path / "run"
    shutil.copytree(finished(), run)
    outcome = json.loads((run / "outcome.json").read_text())
    (run / "outcome.json").write_text(json.dumps(outcome | {"verdict": IN_CONFLICT, "status": STATUS[IN_CONFLICT]}))
    status, out, _ = bayesub("next", str(run))
    assert (status, out.splitlines()[-1]) == (STATUS[IN_CONFLICT], in_words(IN_CONFLICT))
    status, out, _ = bayesub("next", str(run), "--json")
    assert status == STATUS[IN_CONFLICT]
    assert json.loads(out)


def test_what_is_no_run_or_no_coefficient_of_it_is_refused(bayesub, finished, tmp_path):
    """In one line."""
    for arguments, kind, key in (
        ([str(tmp_path)], "state", "config.toml"),
        ([str(finished()), "--for", "Zuw"], "conflict", "--for"),
        ([str(finished()), "--for", "Nonsense"], "unknown", "--for"),
        ([str(finished()), "--for", "D"], "unknown", "--for"),
        ([str(finished()), "--for", "known:10"], "unknown", "--for"),
    ):
        status, _, err = bayesub("next", *arguments)
        assert (status, err.count("\n")) == (2, 1)
        refusals.check(bayesub.error, kind, key)


def test_a_manoeuvre_beyond_the_limits_is_not_proposed(bayesub, finished, monkeypatch):
    """Where the search finds none within them."""
    monkeypatch.setattr("bayesub.design.limits.Range.penalty", lambda *_: 0.001)
    status, out, err = bayesub("next", str(finished()), "--for", "Nuv")
    assert status == 0, err
    assert "another manoeuvre" not in out
    assert "none of those that were tried keeps the limits" in out + err


@pytest.mark.usefixtures("fixed_controls")
def test_a_quantity_is_refused_where_more_of_the_boat_is_inferred_than_coefficients(bayesub, finished, tmp_path):
    """Its sd would be that of another boat; coefficients are not refused."""
    folder = str(finished("scaled", nuisance={"scale_rudder": {"mean": 1.0, "sd": 0.2}}))
    after = ("design", "auv690", "--after", folder, "--subproblem", "horizontal", "-o", str(tmp_path / "designed"))
    for command in (("next", folder), after):
        status, _, err = bayesub(*command, "--for", "tactical_diameter_m")
        assert (status, err.count("\n")) == (2, 1)
        refusals.check(bayesub.error, "conflict", "--for")
        assert "scale_rudder" in err
    assert not (tmp_path / "designed").exists()
    assert bayesub("next", folder, "--for", "Nuv")[0] == 0


def test_what_else_is_unknown_is_expected_where_the_run_found_it(finished):
    """The start is slower than its prior has it: derivatives are taken there, and a rival has to find it out too."""
    start = {"mean": 3.0, "sd": 1.0}
    folder = finished("slow", nuisance={"u0_mps": start})
    run = finished_run(folder)
    judge, _ = judge_of_next(run.setup(), run.posterior)
    found = run.posterior.mean[run.posterior.names.index("u0_mps")]
    assert judge.expected == {"u0_mps": pytest.approx(found, rel=1e-12)}
    assert abs(found - start["mean"]) > 0.5 * start["sd"]
    asked = {"after": folder, "wanted": ("apart:auv690",), "subproblem": "horizontal"}
    posed = design.pose(design.Request("auv690", **asked)).judge
    assert posed.rival is not None
    assert posed.rival.nuisance.keys() == posed.nuisance.keys() == {"u0_mps"}


def test_limits_that_are_read_are_not_written(bayesub, finished, tmp_path):
    limits = tmp_path / "limits.toml"
    limits.write_text("duration_s = 40.0\n")
    assert bayesub("next", str(finished()), "--limits", str(limits), "-o", str(limits))[0] == 2
    refusals.check(bayesub.error, "conflict", "-o")
    assert limits.read_text() == "duration_s = 40.0\n"
