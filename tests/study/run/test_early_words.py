"""What a run says of its mode before it samples, and when it does not sample at all."""

import json

import numpy as np
import pytest
from support import small_study
from support.refusals import refused

import bayesub as bs
from bayesub.findings.remedies import fit_of_mode
from bayesub.findings.suspect_columns import suspect
from bayesub.inference.baselines import gauss_newton
from bayesub.inference.sampling import histories
from bayesub.inference.sampling.posterior import Posterior
from bayesub.logs import log_files
from bayesub.study.run.infer import refuse_misread, say_if_long
from bayesub.study.run.prepare import prepare
from bayesub.study.run.run import run
from bayesub.study.schema.study_file import load_study

SHORT = {"name": "early", "baselines": {"sqp_starts": 0}, "sampler": {"max_steps": 200}}
READ = small_study.LOG | {"max_control_gap_s": 1e3}
TWO = [small_study.track(channels=["x", "yaw"])]


class Remarks:
    """Progress that keeps what is said."""

    def __init__(self):
        self.sentences, self.stages = [], []

    def stage(self, name):
        self.stages.append(name)

    def update(self, *numbers, **words):
        """Nobody looks at bars here."""

    def remark(self, sentence):
        self.sentences.append((sentence, self.stages[-1] if self.stages else ""))


def written(tmp_path, **changes):
    return small_study.write(tmp_path / "early.toml", **SHORT | changes)


def test_a_mode_that_fits_is_not_spoken_of(tmp_path, few_figures):  # noqa: ARG001
    """Nothing is said before sampling, and the mode is kept with the run."""
    remarks = Remarks()
    run(written(tmp_path), tmp_path / "run", progress=remarks)
    assert remarks.sentences == []
    mode = json.loads((tmp_path / "run" / "mode.json").read_text())
    assert mode["misfit"] < 1.3
    assert mode["values"].keys() == {"Xuu", "Yuv", "Nuv", "Yuu_dr"}


def test_a_prior_that_plays_no_part_is_spoken_of(tmp_path, few_figures):  # noqa: ARG001
    """That of a coefficient that is not free; a value holds it where it is."""
    given = {"Yur": {"mean": 0.01, "sd": 0.001}, "Nur": {"value": -0.002}, "Nuv": {"mean": -0.01, "sd": 0.01}}
    path = small_study.write(tmp_path / "s.toml", **small_study.TINY | SHORT, prior={"given": given})
    remarks = Remarks()
    run(path, tmp_path / "run", progress=remarks)
    (said,) = [sentence for sentence, _ in remarks.sentences if "[prior.given]" in sentence]
    assert "of Yur plays no part" in said


@pytest.mark.slow
def test_a_missing_current_is_named_before_sampling(tmp_path, few_figures):  # noqa: ARG001
    """The sentence comes in the stage of sampling, with a study that has the lines to add, and the run goes on."""
    remarks = Remarks()
    run(written(tmp_path, truth={"current_mps": [0.005, 0.0]}), tmp_path / "run", progress=remarks)
    (fit, stage), (suggestion, _) = remarks.sentences
    assert stage == "sample the posterior"
    assert fit.startswith("fit of the mode: The model does not fit")
    assert "a current were missing" in fit
    file = tmp_path / "run" / "suggested.toml"
    assert suggestion.endswith(f"\n  bayesub run {file} -o {tmp_path / 'run'}_again")
    assert {"current_north_mps", "current_east_mps"} == load_study(file).nuisance.keys()


def logged(tmp_path, damage=dict, **changes):
    """A study of the log of the trial, some of whose columns are not what they should be."""
    setup = prepare(load_study(written(tmp_path)))
    trial = setup.trials[""]
    trial.record.save(tmp_path / "log.csv", trial.manoeuvre)
    log = log_files.read_log(tmp_path / "log.csv")
    log_files.write_log(tmp_path / "log.csv", log | damage(log))
    return written(tmp_path, **READ, **changes)


MISREAD = {
    "rudder_deg": lambda log: {"delta_r": -log["delta_r"]},
    "x_m, y_m": lambda log: {"x": log["y"], "y": log["x"]},
    "y_m": lambda log: {"y": -log["y"]},
    "yaw_deg": lambda log: {"psi": np.radians(log["psi"])},
    "rudder_rad": None,
}


@pytest.mark.parametrize("columns", MISREAD)
def test_a_column_that_holds_something_else_is_refused_before_any_search(tmp_path, columns):
    """One line with file, column and remedy, and no simulation."""
    file = logged(tmp_path, MISREAD[columns] or dict)
    if MISREAD[columns] is None:
        path = tmp_path / "log.csv"
        path.write_text(path.read_text().replace("rudder_deg", "rudder_rad", 1))
    with refused("data", columns):
        run(file, tmp_path / "run", progress=Remarks())
    assert not (tmp_path / "run" / "mode.json").exists()


def test_a_column_that_is_not_used_may_hold_anything(tmp_path):
    """Without its sensor a column of the other sign is nobody's business; other faults are said and no more."""
    file = logged(tmp_path, lambda log: {"y": -log["y"]}, ignore=["y_m"], sensors=TWO)
    remarks = Remarks()
    refuse_misread(prepare(load_study(file)), remarks)
    assert remarks.sentences == []


def test_a_heading_that_wraps_is_no_fault(tmp_path):
    """A log of a boat that crosses south, within -180 to 180 degrees, is not refused, and fits as it does without."""

    def misfit(folder, damage=dict):
        folder.mkdir()
        setup = prepare(load_study(logged(folder, damage)))
        refuse_misread(setup, Remarks())
        return fit_of_mode(setup.problem, setup.problem.reference, np.random.default_rng(0)).misfit

    plain = misfit(tmp_path / "plain")
    turned = misfit(tmp_path / "turned", lambda log: {"psi": np.mod(log["psi"] + np.pi, 2.0 * np.pi) - np.pi})
    crossed = log_files.read_log(tmp_path / "turned" / "log.csv")["psi"]
    assert np.nanmax(np.abs(np.diff(crossed[np.isfinite(crossed)]))) > np.pi
    assert turned == pytest.approx(plain, rel=1e-6)


@pytest.mark.slow
def test_a_log_with_the_rudder_the_other_way_round_is_not_sampled(tmp_path):
    """Trusted all the same it is searched, and then one clear line comes in place of sampling."""
    file = logged(tmp_path, lambda log: {"delta_r": -log["delta_r"]}, trust_log=True)
    remarks = Remarks()
    with refused("data", "yaw"):
        run(file, tmp_path / "run", progress=remarks)
    assert remarks.sentences
    assert json.loads((tmp_path / "run" / "mode.json").read_text())["misfit"] > 4.0
    assert not (tmp_path / "run" / "posterior.nc").exists()


def suspected(problem):
    return suspect(problem, problem.prior.mean)


def test_the_column_that_would_make_the_boat_of_the_prior_agree_is_named(tmp_path):
    """By its sign or its unit; nothing is named of a good record, nor where no change would do."""
    problem = prepare(load_study(written(tmp_path))).problem
    assert suspect(problem, gauss_newton(problem).values) == ""
    readings, x, y = problem.readings, problem.rows["x"], problem.rows["y"]
    for words, part, factor in (("x_m in feet", x, 1 / 0.3048), ("y_m of the other sign", y, -1.0)):
        damaged = readings.copy()
        damaged[part] *= factor
        assert suspected(problem.with_readings(damaged)).startswith(words)
    damaged = readings.copy()
    damaged[x], damaged[y] = readings[y], readings[x]
    joint = bs.JointProblem({"first": problem.with_readings(damaged)})
    assert suspected(joint).startswith("first: x_m, y_m: each holds the other")
    noise = np.random.default_rng(0).standard_normal(len(readings))
    assert suspected(problem.with_readings(10.0 * np.abs(readings).max() * noise)) == ""


@pytest.mark.slow
def test_a_heading_that_is_trusted_to_be_in_radians_and_is_not_is_named(tmp_path):
    """Known but for whole turns, and 57 times as large."""
    file = logged(tmp_path, trust_log=True)
    path = tmp_path / "log.csv"
    path.write_text(path.read_text().replace("yaw_deg", "yaw_rad", 1))
    with refused("data", "yaw"):
        run(file, tmp_path / "run", progress=Remarks())


def stamped(log, late):
    """The readings of a log stamped so many seconds later than they were taken."""
    columns = {"time": log["time"]}
    for name in ("x", "y", "psi"):
        taken = np.flatnonzero(np.isfinite(log[name]))
        n = round(late / np.diff(log["time"][taken])[0])
        columns[name] = np.full(len(log["time"]), np.nan)
        columns[name][taken[max(n, 0) :][: len(taken) - abs(n)]] = log[name][taken[max(-n, 0) :][: len(taken) - abs(n)]]
    return columns


@pytest.mark.slow
@pytest.mark.parametrize("late", [6.0, -8.0])
def test_readings_with_another_clock_than_the_controls_are_named(tmp_path, late):
    """By how much, before anything is sampled; with that offset the log is sampled."""
    file = logged(tmp_path, lambda log: stamped(log, late), trust_log=True)
    with refused("data", "yaw"):
        run(file, tmp_path / "run", progress=Remarks())
    file = written(tmp_path, **READ, trust_log=True, sensors=[small_study.track(clock_offset_s=late)])
    problem = prepare(load_study(file)).problem
    assert fit_of_mode(problem, gauss_newton(problem).values, np.random.default_rng(0)).misfit < 1.5


def test_outliers_do_not_stop_a_run(tmp_path):
    """One reading in twenty of a hundred times the noise is told, but the misfit is that of the others."""
    problem = prepare(load_study(written(tmp_path))).problem
    readings = problem.readings.copy()
    readings[::20] += 100.0 * problem.sds[::20] * np.random.default_rng(1).standard_normal(len(readings[::20]))
    fit = fit_of_mode(problem.with_readings(readings), problem.reference, np.random.default_rng(0))
    assert fit.misfit < 1.5
    assert "Outliers" in fit.sentences["fit_of_the_mode"]


def posterior_of(acceptance, correlation, n_steps=1250):
    """Four ensembles of eight walkers in one parameter, an autoregressive chain."""
    rng = np.random.default_rng(0)
    chain = np.zeros((4, n_steps, 8, 1))
    for k in range(1, n_steps):
        chain[:, k] = correlation * chain[:, k - 1] + np.sqrt(1 - correlation**2) * rng.standard_normal((4, 8, 1))
    density = -0.5 * chain[..., 0] ** 2
    none = np.zeros(1)
    return Posterior(("a",), chain, density, none, none + 1.0, n_steps // 3, acceptance, 0, 0.0, {})


@pytest.mark.parametrize(
    ("acceptance", "correlation", "stuck"),
    [(0.04, 0.9999, True), (0.04, 0.999, True), (0.4, 0.9999, False), (0.04, 0.9, False), (0.04, 0.98, False)],
)
def test_sampling_without_a_chance_ends(acceptance, correlation, stuck):
    """Only where few proposals are accepted, and no pace is seen; not before a tenth of the steps."""
    posterior = posterior_of(acceptance, correlation)
    assert posterior.stuck(4000) == stuck
    assert not posterior.stuck(40_000)
    if stuck:
        assert "only 4 % of the proposals are accepted" in posterior.shortcomings[0]


def test_long_sampling_with_forces_is_said_before_it(tmp_path, monkeypatch):
    """With the estimate and what takes less; a short one is not."""
    forces = {"axes": ["Y", "N"], "share": {"median": 0.01, "log_sd": 1.0}, "correlation_time_s": 10.0}
    setup = prepare(load_study(written(tmp_path, disturbance=forces)))
    said = Remarks()
    say_if_long(setup, said)
    assert said.sentences == []
    monkeypatch.setattr(histories, "_EVALUATIONS", 10_000_000)
    say_if_long(setup, said)
    ((line, _),) = said.sentences
    assert "knots on each of Y, N" in line
    assert f"knot_interval_s = {2.0 * setup.problem.forward.disturbances.knots.interval:.3g}" in line
