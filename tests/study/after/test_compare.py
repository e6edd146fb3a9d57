"""Finished runs side by side, through the command line."""

import json
import re
import shutil
from pathlib import Path

import pandas as pd
import pytest
from support import refusals, small_study

from bayesub.study.after import compare


@pytest.fixture
def runs(finished):
    """A run, and one of coarser sensors."""
    coarse = small_study.track(position_sd_m=1.0, attitude_sd_deg=2.0, interval_s=5.0)
    return finished(), finished("coarse", sensors=[coarse])


def test_a_run_and_its_copy_are_nowhere_apart_and_another_is(runs, tmp_path, bayesub):
    copy = shutil.copytree(runs[0], tmp_path / "copy")
    config = (copy / "config.toml").read_text()
    (copy / "config.toml").write_text(re.sub(r'begun = ".*"', 'begun = "2026-01-01 00:00 UTC"', config))
    small_study.forget_config(copy)
    assert (copy / "config.toml").read_text() != config  # when a run was begun is no difference
    status, out, _ = bayesub("compare", *runs, copy, "-o", tmp_path / "c", "--draws", 60)
    assert status == 0, out
    assert out.splitlines()[-1] == f"page: {tmp_path / 'c' / 'comparison.html'}"
    numbers = json.loads((tmp_path / "c" / "numbers.json").read_text())
    apart = {(pair["first"], pair["second"]): pair for pair in numbers["pairs"]}
    assert apart["tiny", "copy"]["hellinger"] < 1e-6
    assert apart["tiny", "coarse"]["hellinger"] > 0.3
    assert numbers["differences"].keys() == {"sensors"}
    assert numbers["manoeuvre"] == "turning_circle"
    places = {label: one["distance_m"]["posterior"]["at_end"] for label, one in numbers["predictions"].items()}
    assert places["tiny"] == places["copy"] < places["coarse"]
    table = pd.read_csv(tmp_path / "c" / "coefficients.csv").set_index(["parameter", "run"])
    assert len(table) == 9
    assert table.loc[("Nuv", "tiny"), "sd"] < table.loc[("Nuv", "coarse"), "sd"]
    assert len(pd.read_csv(tmp_path / "c" / "distances.csv")) == 9


def test_the_same_seed_gives_the_same_numbers(runs, tmp_path, bayesub):
    for name in ("one", "two"):
        given = ("--manoeuvre", "zigzag_10_10", "--draws", 60, "--seed", 4)
        assert bayesub("compare", *runs, "-o", tmp_path / name, *given)[0] == 0
    first, second = ((tmp_path / name / "numbers.json").read_bytes() for name in ("one", "two"))
    assert first == second


def test_a_run_that_cannot_fly_the_manoeuvre_says_why(runs, finished, tmp_path, bayesub):
    """One that infers nothing of what moves in the other plane; if no run can, it is bad input."""
    steering = finished("steering", free={"coefficients": ["Nuv", "Nuu_dr"]})
    status, out, _ = bayesub("compare", runs[0], steering, "-o", tmp_path / "c", "--manoeuvre", "vertical")
    assert status == 0
    assert "not predicted steering: vertical: no coefficient is free" in " ".join(out.split())
    status, out, err = bayesub("compare", steering, runs[0], "-o", tmp_path / "d", "--manoeuvre", "zigzag")
    assert (status, out, err.count("\n")) == (2, "", 1)
    refusals.check(bayesub.error, "unknown", "zigzag")
    assert not (tmp_path / "d").exists()


def test_runs_that_cannot_be_compared_are_one_line(runs, tmp_path, bayesub):
    for given, kind, key in (
        (runs[:1], "missing", "runs"),
        ((runs[0], runs[0]), "conflict", "runs"),
        ((*runs, *[runs[0]] * 6), "limit", "runs"),
        ((runs[0], tmp_path / "none"), "state", "config.toml"),
    ):
        status, out, err = bayesub("compare", *given, "-o", tmp_path / "c")
        assert (status, out, err.count("\n")) == (2, "", 1)
        refusals.check(bayesub.error, kind, key)
        assert not (tmp_path / "c").exists()


def test_runs_are_named_by_what_tells_them_apart(runs, tmp_path, monkeypatch):
    """However the folders are given, and one that is given by two paths is given twice."""
    (tmp_path / "one" / "here").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "one" / "here")
    assert compare._labels([Path(), Path("..")]) == ["here", "one"]
    with refusals.refused("conflict", "runs"):
        compare._labels([runs[0], Path(runs[0].parent / "x" / ".." / runs[0].name)])
