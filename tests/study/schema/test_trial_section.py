"""Trials in study files: logs as data, and several trials at once.

The log is of a boat of which all coefficients are off, and four are fitted: the model does not fit.
"""

import json
import re
import tomllib

import numpy as np
import pytest
from support import refusals, small_study

import bayesub as bs
from bayesub.findings.verdicts import DOES_NOT_FIT, STATUS, in_words
from bayesub.io import toml_files
from bayesub.study.run.prepare import prepare
from bayesub.study.schema.study_file import load_study

INSTRUMENT = small_study.track(interval_s=None)
QUICK = {"name": "logged", "sensors": [INSTRUMENT], "baselines": {"sqp_starts": 1}, "sampler": {"ess": 50.0}}
LOG = small_study.text(**QUICK | small_study.LOG)
ZIGZAG = {
    "name": "zigzag",
    "manoeuvre": "zigzag_20_20",
    "nuisance": {"yaw0_deg": {"mean": 0.0, "sd": 1.0}},
    "truth": {"current_mps": [0.02, 0.0]},
}
READ = {"name": "logged", "data": "log.csv", "subproblem": "horizontal"}
JOINT = {**QUICK, "manoeuvre": None, "trials": [READ, ZIGZAG]}


@pytest.fixture
def folder(tmp_path, bayesub):
    """A folder with a log and the studies of it."""
    instruments = small_study.write_sensors(tmp_path / "instruments.toml", INSTRUMENT)
    options = ("--sensors", instruments, "--perturb", 0.1, "--seed", 5, "--sample", 0.1)
    assert bayesub("simulate", "auv690", "horizontal", "-o", tmp_path / "log.csv", *options)[0] == 0
    (tmp_path / "log.toml").write_text(LOG)
    small_study.write(tmp_path / "joint.toml", **JOINT)
    return tmp_path


@pytest.mark.slow
def test_a_log_runs_to_a_report_about_the_vehicle_file(folder, bayesub, monkeypatch, draw_only):
    """From another folder: the path is from the study file. No truth, no linear least squares, and no other log."""
    monkeypatch.chdir("/")
    status, out, _ = bayesub("run", folder / "log.toml", "-o", folder / "run")
    assert (status, out.splitlines()[-1]) == (STATUS[DOES_NOT_FIT], in_words(DOES_NOT_FIT))
    numbers = json.loads((folder / "run" / "numbers.json").read_text())
    assert numbers["reference_is_truth"] is False
    assert [b["method"] for b in numbers["baselines"]] == ["SQP"]
    assert [row["name"] for row in numbers["nuisance"]] == ["x0_m", "y0_m", "yaw0_deg", "u0_mps", "v0_mps", "r0_degps"]
    assert "the vehicle file" in (folder / "run" / "report.html").read_text()
    config = tomllib.loads((folder / "run" / "config.toml").read_text())
    assert list(config["files_sha256"]) == ["log.csv"]
    with (folder / "log.csv").open("a") as file:
        file.write("176.5,0,0,0,,,,\n")
    assert bayesub("run", folder / "log.toml", "-o", folder / "run", "--resume")[0] == 2
    refusals.check(bayesub.error, "state", "--resume")
    draw_only("forest_small")
    refuses_a_changed_copy_of("log.csv", folder / "run", bayesub, STATUS[DOES_NOT_FIT])


def refuses_a_changed_copy_of(name, run, bayesub, status=0):
    """The report is drawn from the copies that a run keeps, whatever became of the files; a changed copy is named."""
    assert bayesub("report", run)[0] == status
    (copy,) = (run / "inputs").glob(f"*-{name}")
    copy.write_text(copy.read_text() + "\n")
    assert bayesub("report", run)[0] == 2
    refusals.check(bayesub.error, "state")


def test_a_log_needs_no_suffix(folder, monkeypatch):
    """It is never a built-in name: its path is from the study file, and its content is part of the run."""
    (folder / "log.csv").rename(folder / "log")
    (folder / "log.toml").write_text(LOG.replace("log.csv", "log"))
    monkeypatch.chdir("/")
    posed = load_study(folder / "log.toml")
    assert posed.files == ["log"]
    assert prepare(posed).problem.record.n_readings


@pytest.mark.usefixtures("few_figures")
@pytest.mark.slow
def test_a_run_belongs_to_the_vehicle_file_that_it_began_with(tmp_path, bayesub):
    """A changed vehicle is neither continued with nor drawn into the report of another, whatever its name."""
    boat = tmp_path / "boat.toml"
    boat.write_bytes(toml_files.built_in("vehicles")["auv690"].read_bytes())
    path = small_study.write(tmp_path / "log.toml", **small_study.TINY, vehicle="boat.toml")
    assert small_study.run(path, tmp_path / "run").good
    boat.write_text(boat.read_text() + "# another\n")
    assert bayesub("run", tmp_path / "log.toml", "-o", tmp_path / "run", "--resume")[0] == 2
    refusals.check(bayesub.error, "state", "--resume")
    refuses_a_changed_copy_of("boat.toml", tmp_path / "run", bayesub)


def test_the_clock_of_a_log_adds_to_those_of_its_sensors(folder):
    """Readings are earlier by as much as the clock is ahead, and those before the first control are left out."""
    (folder / "late.toml").write_text(LOG.replace("data =", "clock_offset_s = 0.5\ndata ="))
    own, late = (prepare(load_study(folder / name)).problem.record.channels for name in ("log.toml", "late.toml"))
    for channel, other in zip(own, late, strict=True):
        assert other.clock_offset_s == channel.clock_offset_s + 0.5
        np.testing.assert_allclose(other.times[-5:], channel.times[-5:] - 0.5, atol=1e-9)


def test_the_joint_posterior_of_two_trials_is_the_product(folder, rng):
    """Likelihoods of a log and of a simulated trial multiply; each has its own start, and the prior counts once."""
    joint = prepare(load_study(folder / "joint.toml")).problem
    assert "yaw0_deg[logged]" in joint.names
    assert "yaw0_deg[zigzag]" in joint.names
    parameters = joint.prior.mean + 0.1 * joint.prior.sd * rng.standard_normal((4, joint.n_params))
    parts = [problem.log_likelihood(own) for _, problem, own in joint.each_trial(parameters)]
    assert len(parts) == 2
    np.testing.assert_allclose(joint.log_likelihood(parameters), np.sum(parts, axis=0), rtol=1e-12)
    alone = prepare(load_study(folder / "log.toml")).problem
    places = [joint.names.index(n if n in bs.coefficients.INDEX else f"{n}[logged]") for n in alone.names]
    np.testing.assert_allclose(alone.log_likelihood(parameters[:, places]), parts[0], rtol=1e-12)


@pytest.mark.slow
def test_a_joint_study_reports_each_trial(folder, bayesub, draw_only):
    draw_only("fan_logged", "fan_zigzag")
    status, out, _ = bayesub("run", folder / "joint.toml", "-o", folder / "run")
    assert (status, out.splitlines()[-1]) == (STATUS[DOES_NOT_FIT], in_words(DOES_NOT_FIT))
    numbers = json.loads((folder / "run" / "numbers.json").read_text())
    by_name = {trial["name"]: trial for trial in numbers["trials"]}
    assert list(by_name) == ["logged", "zigzag"]
    n = [trial["n_readings"] for trial in by_name.values()]
    squares = sum(trial["n_readings"] * trial["chi_square_per_reading"] for trial in by_name.values())
    assert squares / sum(n) == pytest.approx(numbers["chi_square_per_reading"], rel=1e-9)
    for name in by_name:
        assert (folder / "run" / f"fan_{name}.png").stat().st_size > 5000
        assert (folder / "run" / f"record_{name}.csv").exists()
    page = (folder / "run" / "report.html").read_text()
    assert page.count("Track and residuals: ") == 2


@pytest.mark.rendered
def test_check_draws_the_card_of_the_data(folder, bayesub):
    status, out, _ = bayesub("check", folder / "joint.toml", "--card", folder / "card.png")
    assert status == 0
    assert re.search(r"\n  yaw\[logged\] +176 ", out)
    assert "of 11 directions" in out
    assert (folder / "card.png").stat().st_size > 5000
    _, out, _ = bayesub("check", folder / "log.toml", "--json")
    (found,) = json.loads(out).values()
    assert [channel["column"] for channel in found["channels"]] == ["x_m", "y_m", "yaw_deg"]


REFUSED = [
    (
        ("seed = 3", 'seed = 3\nmanoeuvre = "horizontal"'),
        "conflict",
        "",
    ),
    (('data = "log.csv"\n', ""), "missing", ""),
    (('data = "log.csv"', 'manoeuvre = "horizontal"'), "conflict", ""),
    (("[free]", "[truth]\ncurrent_mps = [0.1, 0.0]\n[free]"), "conflict", ""),
    (("sd = 0.25", 'sd = 0.25\ncentre = "perturbed"'), "conflict", ""),
    (("attitude_sd_deg", "dropout = 0.1\nattitude_sd_deg"), "conflict", "sensors.0.dropout"),
    (
        ("attitude_sd_deg", "interval_s = 2.0\nattitude_sd_deg = 0.1\nclock_offset_s = 500.0\n#"),
        "data",
        "x_m",
    ),
    (('data = "log.csv"', 'data = "lag.csv"'), "file", ""),
    (("[baselines]", "[nuisance]\nmass_kg = { value = 1.0 }\n[baselines]"), "conflict", "nuisance.mass_kg"),
]


@pytest.mark.parametrize(("change", "kind", "key"), REFUSED)
def test_what_contradicts_a_log(folder, bayesub, change, kind, key):
    """Is refused in one line with the reason."""
    assert change[0] in LOG
    (folder / "log.toml").write_text(LOG.replace(*change))
    status, _, err = bayesub("check", folder / "log.toml")
    assert status == 2
    assert err.count("\n") == 1
    refusals.check(bayesub.error, kind, key)


def test_trials_that_do_not_fit(folder, bayesub):
    for change, kind, key in (
        (('name = "zigzag"', 'name = "logged"'), "conflict", ""),
        (
            ("seed = 3", 'seed = 3\nsubproblem = "horizontal"'),
            "conflict",
            "",
        ),
        (("yaw0_deg", "mass_kg"), "conflict", "trials.1"),
        (("yaw0_deg", "yaw9_deg"), "unknown", "yaw9_deg"),
        (("zigzag_20_20", "zigzag_20"), "unknown", "zigzag_20"),
    ):
        (folder / "joint.toml").write_text(small_study.text(**JOINT).replace(*change))
        assert bayesub("check", folder / "joint.toml")[0] == 2
        refusals.check(bayesub.error, kind, key)


def test_simulate_takes_presets_and_names_them(bayesub, tmp_path):
    options = ("suboff", "horizontal", "-o", tmp_path / "log.csv", "--dt", 1, "--sample", 1)
    assert bayesub("simulate", *options, "--sensors", "tracking_range")[0] == 0
    assert "yaw_deg" in toml_files.read_line(tmp_path / "log.csv")
    assert bayesub("simulate", *options, "--sensors", "tracking_rang")[0] == 2
    refusals.check(bayesub.error, "unknown", "tracking_rang")
