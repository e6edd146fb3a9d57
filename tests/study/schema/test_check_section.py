"""Logs that are not fitted, and trials that are left out, from the study file to the verdict."""

import json
import re
import shutil
from types import SimpleNamespace

import numpy as np
import pytest
from support import refusals, small_study

import bayesub as bs
from bayesub.campaign import executors
from bayesub.findings.verdicts import STATUS, in_words
from bayesub.inference.sampling import posterior_file
from bayesub.io import seeds
from bayesub.logs import log_files
from bayesub.study.after.finished_run import redraw
from bayesub.study.run import infer, leave_out
from bayesub.study.run.prepare import prepare
from bayesub.study.run.run_folder import RunContext
from bayesub.study.schema.study_file import load_study

LOGS = ("log", "other", "third")
QUICK = {"name": "checked", "baselines": {"sqp_starts": 1}, "sampler": {"ess": 50.0}}
FITTED = small_study.text(**QUICK | small_study.LOG)
SIMULATED = small_study.text(**QUICK, manoeuvre="zigzag_10_10")
CHECK = '[[check]]\ndata = "other.csv"\nsubproblem = "horizontal"\n'


def joint(*names, **changes):
    """The text of a study of several logs."""
    trials = [{"name": name, "data": f"{name}.csv", "subproblem": "horizontal"} for name in names]
    return small_study.text(**QUICK | changes, manoeuvre=None, trials=trials)


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """A folder with logs of the boat on different manoeuvres."""
    folder, boat, rng = tmp_path_factory.mktemp("logs"), bs.load_vehicle("auv690"), np.random.default_rng(8)
    sensor = bs.sensors.Track(0.2, 0.1, interval_s=2.0, channels=("x", "y", "yaw"))
    for name, manoeuvre in zip(LOGS, ("zigzag_10_10", "zigzag_20_20", "turning_circle"), strict=True):
        flown = bs.simulate(boat, bs.load_manoeuvre(manoeuvre, boat), dt=0.04)
        bs.observe(flown, sensor, rng).save(folder / f"{name}.csv", flown.simulator.manoeuvre)
    return folder


@pytest.fixture
def folder(logs, tmp_path):
    shutil.copytree(logs, tmp_path, dirs_exist_ok=True)
    (tmp_path / "study.toml").write_text(FITTED + CHECK)
    (tmp_path / "joint.toml").write_text(joint(*LOGS))
    return tmp_path


def prepared(folder, text):
    (folder / "study.toml").write_text(text)
    return prepare(load_study(folder / "study.toml"))


def test_a_check_leaves_the_fit_as_it_was(folder):
    """The same readings and prior with and without it, of a simulated trial too."""
    with_check, without = prepared(folder, FITTED + CHECK), prepared(folder, FITTED)
    np.testing.assert_array_equal(with_check.problem.readings, without.problem.readings)
    np.testing.assert_array_equal(with_check.problem.prior.mean, without.problem.prior.mean)
    with_check, without = prepared(folder, SIMULATED + CHECK), prepared(folder, SIMULATED)
    np.testing.assert_array_equal(with_check.problem.readings, without.problem.readings)
    assert "check" not in load_study(folder / "study.toml").config()  # runs of studies without checks resume


def test_a_check_has_its_own_start_and_what_of_the_study_applies(folder):
    nuisance = """
[nuisance]
u0_mps = { mean = 3.0, sd = 0.01 }
bias_yaw_deg = { mean = 0.0, sd = 2.0 }
bias_rudder_deg = { mean = 0.0, sd = 1.0 }
"""
    sensors = '[[check.sensors]]\nkind = "track"\nchannels = ["x", "y"]\nposition_sd_m = 0.2\nattitude_sd_deg = 0.1\n'
    check = CHECK + 'name = "second"\nignore = ["yaw_deg"]\nnuisance = { yaw0_deg = { mean = 0.0, sd = 1.0 } }\n'
    setup = prepared(folder, FITTED + nuisance + check + sensors)
    (unseen,) = setup.unseen
    assert unseen.name == "second"
    priors = unseen.problem.nuisance_priors
    assert "bias_yaw_deg" not in priors  # of a channel that this log has not
    assert abs(priors["u0_mps"].mean[0] - 1.75) < 0.2  # from its own readings
    own = [unseen.problem.names[k] for k in unseen.own(setup.problem)]
    assert set(own) == {"x0_m", "y0_m", "yaw0_deg", "u0_mps", "v0_mps", "r0_degps"}  # the rudder's zero is the boat's


def test_a_check_ignores_what_the_study_does(folder):
    """Of the columns that its log has: without an instrument for them they would be refused."""
    for name in ("log", "other"):
        log = log_files.read_log(folder / f"{name}.csv")
        log_files.write_log(folder / f"{name}.csv", log | {"u": np.full(len(log["time"]), 1.5)})
    ignoring = small_study.text(**QUICK | small_study.LOG, ignore=["u_mps"])
    for log in ("other.csv", "third.csv"):  # the last has no such column
        (unseen,) = prepared(folder, ignoring + CHECK.replace("other.csv", log)).unseen
        assert "u" not in {channel.quantity for channel in unseen.problem.record.channels}


def test_a_manoeuvre_with_a_known_start_needs_no_warm_up(folder):
    (unseen,) = prepared(folder, SIMULATED + '[[check]]\nmanoeuvre = "turning_circle"\n').unseen
    assert unseen.name == "turning_circle"
    assert unseen.warm_up_s == 0.0
    with refusals.refused("data", "warm_up_s"):
        prepared(folder, SIMULATED + '[[check]]\nmanoeuvre = "turning_circle"\nwarm_up_s = 1e5\n')


def test_the_warm_up_is_some_ship_lengths_with_some_readings(folder):
    boat = bs.load_vehicle("auv690")
    (unseen,) = prepared(folder, FITTED + CHECK).unseen
    assert unseen.warm_up_s == pytest.approx(4.0 * boat.length_m / boat.speed_mps)
    (unseen,) = prepared(folder, FITTED + CHECK + "warm_up_s = 30.0\n").unseen
    assert unseen.warm_up_s == 30.0
    log = log_files.read_log(folder / "other.csv")
    for name in ("x", "y", "psi"):
        log[name][np.flatnonzero(np.isfinite(log[name]))[::2]] = np.nan
    log_files.write_log(folder / "other.csv", log)
    (unseen,) = prepared(folder, FITTED + CHECK).unseen
    assert unseen.warm_up_s == pytest.approx(32.0, abs=2.0)  # of eight readings


def test_parts_of_one_log_are_fitted_and_predicted(folder):
    """Two windows of a log that do not overlap are two logs; those that do are refused."""
    fitted = FITTED.replace('data = "log.csv"', 'data = "log.csv"\nwindow_s = [0.0, 60.0]')
    check = CHECK.replace("other.csv", "log.csv")
    (unseen,) = prepared(folder, f"{fitted}{check}window_s = [60.0, 110.0]\n").unseen
    assert unseen.problem.duration == pytest.approx(48.0, abs=1.0)
    for window in ("window_s = [50.0, 110.0]\n", ""):
        with refusals.refused("conflict", "check.data"):
            prepared(folder, fitted + check + window)


def cut(folder, last):
    log = log_files.read_log(folder / "other.csv")
    log_files.write_log(folder / "other.csv", {key: values[log["time"] <= last] for key, values in log.items()})


def other_controls(folder):
    text = (folder / "other.csv").read_text()
    (folder / "other.csv").write_text(text.replace("rudder_deg", "fin_1_deg", 1))


def without_yaw(folder):
    log = log_files.read_log(folder / "other.csv")
    del log["psi"]
    log_files.write_log(folder / "other.csv", log)


@pytest.mark.parametrize(
    ("spoil", "check", "kind", "key"),
    [
        (lambda folder: cut(folder, 20.0), CHECK, "data", "warm_up_s"),
        (other_controls, CHECK, "unknown", "fin_1_deg"),
        (without_yaw, CHECK, "missing", "yaw_deg"),
        (lambda folder: shutil.copy(folder / "log.csv", folder / "other.csv"), CHECK, "conflict", "check.data"),
        (lambda _: None, CHECK.replace("other.csv", "log.csv"), "conflict", "check.data"),
        (lambda _: None, CHECK.replace("other.csv", "nobody.csv"), "file", ""),
        (lambda _: None, CHECK + CHECK, "conflict", ""),
        (lambda _: None, CHECK + "warm_up_s = -1.0\n", "value", "check.0.warm_up_s"),
        (lambda _: None, CHECK + "warm_up_s = 100.0\n", "data", "warm_up_s"),
        (lambda _: None, CHECK + "warmup_s = 9.0\n", "unknown", "check.0.warmup_s"),
        (lambda _: None, '[[check]]\nname = "x"\n', "missing", "check.0"),
        (lambda _: None, CHECK + "nuisance = { mass_kg = { mean = 1.0, sd = 1.0 } }\n", "conflict", "check.0"),
        (lambda _: None, CHECK + "nuisance = { bias_depth_m = { mean = 0.0, sd = 1.0 } }\n", "unknown", "bias_depth_m"),
    ],
)
def test_a_bad_check_is_one_line(bayesub, folder, spoil, check, kind, key):
    spoil(folder)
    (folder / "study.toml").write_text(FITTED + check)
    status, _, err = bayesub("run", folder / "study.toml", "-o", folder / "run")
    assert status == 2
    assert err.count("\n") == 1
    refusals.check(bayesub.error, kind, key)
    assert not (folder / "run").exists()


def test_a_check_and_a_trial_have_different_names(bayesub, folder):
    (folder / "joint.toml").write_text(joint(*LOGS) + CHECK)
    status, _, err = bayesub("run", folder / "joint.toml", "-o", folder / "run")
    assert (status, err.count("\n")) == (2, 1)
    refusals.check(bayesub.error, "conflict")


@pytest.mark.slow
@pytest.mark.rendered
def test_a_run_predicts_and_says_so_at_the_end(bayesub, folder, draw_only):
    draw_only("prediction_other")
    assert "to predict 'other'" in bayesub("check", folder / "study.toml")[1]
    run = folder / "run"
    status, out, err = bayesub("run", folder / "study.toml", "-o", run)
    assert status == 0, err
    assert re.search(r"\n  checks +converged \(R-hat .*\), fits, predicts\n", out)
    assert out.splitlines()[-1] == "CONVERGED AND FITS"
    numbers = json.loads((run / "numbers.json").read_text())
    (other,) = numbers["predictions"]
    assert other["predicts"]
    assert set(other["channels"]["yaw"]["rms"]) == {"posterior", "prior", "posterior mode", "prior mean", "SQP"}
    assert other["channels"]["yaw"]["column"] == "yaw_deg"
    assert (run / "prediction_other.png").stat().st_size > 20_000
    assert (run / "check_other.csv").exists()
    page = (run / "report.html").read_text()
    assert page.index("prediction: predicts") < page.index("<img")
    redraw(run)
    assert json.loads((run / "numbers.json").read_text())["predictions"] == [other]


@pytest.mark.slow
@pytest.mark.usefixtures("few_figures")
def test_a_fit_that_is_accepted_and_does_not_predict_ends_with_that_verdict(bayesub, folder):
    """The rudder of the other log has another zero."""
    log = log_files.read_log(folder / "other.csv")
    log["delta_r"] += np.radians(3.0)
    log_files.write_log(folder / "other.csv", log)
    status, out, _ = bayesub("run", folder / "study.toml", "-o", folder / "run")
    assert (status, out.splitlines()[-1]) == (STATUS["does not predict"], in_words("does not predict"))
    assert re.search(r"\n  checks +converged \(.*\), fits\n  prediction +other is NOT PREDICTED: ", out)
    page = (folder / "run" / "report.html").read_text()
    assert page.index("DOES NOT PREDICT") < page.index("<img")


@pytest.mark.usefixtures("few_figures")
def test_what_nobody_has_tried_is_said(bayesub, folder):
    (folder / "study.toml").write_text(FITTED)
    _, out, _ = bayesub("run", folder / "study.toml", "-o", folder / "run")
    assert ", fits, prediction not tried\n" in out
    page = (folder / "run" / "report.html").read_text()
    assert page.index("prediction: not tried") < page.index("<img")


@pytest.mark.usefixtures("few_figures")
@pytest.mark.slow
def test_each_trial_is_left_out_once_and_a_run_that_was_stopped_goes_on(bayesub, folder, monkeypatch):
    run, study = folder / "run", folder / "joint.toml"
    study.write_text(joint(*LOGS[:2], sampler={"ess": 50.0, "rhat": 1.1, "taus": 10.0}))
    status, out, _ = bayesub("run", study, "-o", run)
    assert status == 0
    assert "prediction not tried" in out
    assert "--resume --leave-out" in (run / "report.html").read_text()

    names, sample = [], leave_out.sample_posterior

    def counted(setup, problem, rng, **given):
        names.append(tuple(problem.problems))
        if len(names) == 2:
            raise KeyboardInterrupt
        return sample(setup, problem, rng, **given)

    monkeypatch.setattr(leave_out, "sample_posterior", counted)
    monkeypatch.setattr(executors, "local", executors.Serial)  # other processes do not count
    assert bayesub("run", study, "-o", run, "--resume", "--leave-out")[0] == 130
    status, out, err = bayesub("run", study, "-o", run, "--resume", "--leave-out")
    assert status == 0, err
    assert names == [("other",), ("log",), ("log",)]
    assert ", fits, predicts\n" in out
    for name in LOGS[:2]:
        assert f"{name} (left out) is predicted" in (run / "report.html").read_text()
        assert posterior_file.load(run / "left_out" / f"{name}.nc").converged
    predictions = json.loads((run / "numbers.json").read_text())["predictions"]
    assert [(one["name"], one["kind"]) for one in predictions] == [(name, "left out") for name in LOGS[:2]]
    redraw(run)
    assert json.loads((run / "numbers.json").read_text())["predictions"] == predictions
    setup = prepare(load_study(study))
    posteriors = {tuple(problem.problems): one for problem, one in leave_out.posteriors(setup, run).values()}
    rng = setup.generator(seeds.PREDICTIONS)
    found = bs.leave_one_out(setup.problem, rng, draw=lambda others, *_: posteriors[tuple(others.problems)])
    assert [found[one["name"]].p_value for one in predictions] == [one["p_value"] for one in predictions]


def test_a_fit_that_fails_without_a_trial_is_told_and_the_others_go_on(folder, monkeypatch):
    """Nothing of a long run is lost by one trial that the others need."""
    setup, remarks, saved = prepare(load_study(folder / "joint.toml")), [], []
    progress = SimpleNamespace(stage=lambda _: None, update=lambda *_: None, remark=remarks.append)

    def sample(problem, **_):
        if "log" not in problem.problems:
            raise bs.InputError("no mode")
        return tuple(problem.problems)

    monkeypatch.setattr(infer, "sample", sample)
    monkeypatch.setattr(leave_out.posterior_file, "save", lambda posterior, _: saved.append(posterior))
    leave_out.fit(setup, RunContext(folder, progress=progress, executor=executors.Serial()))
    assert remarks == ["without 'log': no mode"]
    assert saved == [("log", "third"), ("log", "other")]


@pytest.mark.parametrize("text", [FITTED, joint("log")])
def test_one_log_cannot_be_left_out(bayesub, folder, text):
    (folder / "study.toml").write_text(text)
    status, _, err = bayesub("run", folder / "study.toml", "-o", folder / "run", "--leave-out")
    assert (status, err.count("\n")) == (2, 1)
    refusals.check(bayesub.error, "conflict", "--leave-out")
