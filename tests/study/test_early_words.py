"""What a run says of its mode before it samples, and when it does not sample at all."""

import json

import numpy as np
import pytest

from bayesub.io import log_files
from bayesub.io.errors import InputError
from bayesub.report.early import fit_of_mode
from bayesub.sampling.posterior import Posterior
from bayesub.study.prepare import prepare
from bayesub.study.run import run
from bayesub.study.study_file import load_study

STUDY = """
name = "early"
question = "Is a bad fit told before it is sampled?"
vehicle = "auv690"
manoeuvre = "horizontal"
seed = 3
dt_s = 0.4
[[sensors]]
kind = "track"
channels = ["x", "y", "yaw"]
position_sd_m = 0.2
attitude_sd_deg = 0.1
interval_s = 2.0
[free]
coefficients = ["Xuu", "Yuv", "Nuv", "Yuu_dr"]
[prior]
kind = "relative_normal"
sd = 0.25
[baselines]
sqp_starts = 0
[sampler]
max_steps = 200
"""
CURRENT = "[truth]\ncurrent_mps = [0.005, 0.0]\n"


class Remarks:
    """Progress that keeps what is said."""

    def __init__(self):
        self.sentences, self.stages = [], []

    def stage(self, name):
        self.stages.append(name)

    def update(self, *numbers, **words):
        """Nobody looks at bars here."""

    def remark(self, sentence):
        self.sentences.append((sentence, self.stages[-1]))


def written(tmp_path, text):
    path = tmp_path / "early.toml"
    path.write_text(text)
    return path


def test_a_mode_that_fits_is_not_spoken_of(tmp_path, few_figures):  # noqa: ARG001
    """Nothing is said before sampling, and the mode is kept with the run."""
    remarks = Remarks()
    run(written(tmp_path, STUDY), tmp_path / "run", progress=remarks)
    assert remarks.sentences == []
    mode = json.loads((tmp_path / "run" / "mode.json").read_text())
    assert mode["misfit"] < 1.3
    assert mode["values"].keys() == {"Xuu", "Yuv", "Nuv", "Yuu_dr"}


def test_a_missing_current_is_named_before_sampling(tmp_path, few_figures):  # noqa: ARG001
    """The sentence and the lines to add come in the stage of sampling, and the run goes on."""
    remarks = Remarks()
    run(written(tmp_path, STUDY + CURRENT), tmp_path / "run", progress=remarks)
    (fit, stage), (lines, _) = remarks.sentences
    assert stage == "sample the posterior"
    assert fit.startswith("fit of the mode: The model does not fit")
    assert "a current were missing" in fit
    assert "current_north_mps" in lines


def test_a_log_with_the_rudder_the_other_way_round_is_not_sampled(tmp_path):
    """One clear line in place of sampling; with another limit it is sampled all the same."""
    setup = prepare(load_study(written(tmp_path, STUDY)))
    trial = setup.trials[""]
    trial.record.save(tmp_path / "log.csv", trial.manoeuvre)
    log = log_files.read_log(tmp_path / "log.csv")
    log["delta_r"] = -log["delta_r"]
    log_files.write_log(tmp_path / "log.csv", log)
    text = STUDY.replace(
        'manoeuvre = "horizontal"', 'data = "log.csv"\nsubproblem = "horizontal"\nmax_control_gap_s = 1e3'
    )
    remarks = Remarks()
    with pytest.raises(InputError, match=r"early.toml: nothing is sampled, .* misses '.*' by \S+ times its noise"):
        run(written(tmp_path, text), tmp_path / "run", progress=remarks)
    assert remarks.sentences
    assert json.loads((tmp_path / "run" / "mode.json").read_text())["misfit"] > 4.0
    assert not (tmp_path / "run" / "posterior.nc").exists()


def test_outliers_do_not_stop_a_run(tmp_path):
    """One reading in twenty of a hundred times the noise is told, but the misfit is that of the others."""
    problem = prepare(load_study(written(tmp_path, STUDY))).problem
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
    ("acceptance", "correlation", "stuck"), [(0.04, 0.999, True), (0.4, 0.999, False), (0.04, 0.9, False)]
)
def test_sampling_without_a_chance_ends(acceptance, correlation, stuck):
    """Only where few proposals are accepted, and the pace is too slow by far; not before a quarter of the steps."""
    posterior = posterior_of(acceptance, correlation)
    assert posterior.stuck(4000) == stuck
    assert not posterior.stuck(40_000)
    if stuck:
        assert "only 4 % of the proposals are accepted" in posterior.shortcomings[0]
