"""Studies made ready: at which steps trials are flown and fitted."""

import numpy as np
import pandas as pd
import pytest
from support import small_study
from support.refusals import refused

import bayesub as bs
from bayesub.study.run import prepare as preparation
from bayesub.study.run.prepare import prepare
from bayesub.study.schema.study_file import load_study

STUDY = {
    "name": "finer",
    "vehicle": "npsauv",
    "manoeuvre": None,
    "trials": [
        {"name": "spiral", "manoeuvre": "horizontal"},
        {
            "name": "zigzag",
            "manoeuvre": "zigzag_20_20",
            "nuisance": {"yaw0_deg": {"mean": 0.0, "sd": 1.0}},
            "sensors": [{"kind": "dvl", "sd_mps": 0.00001}],
        },
    ],
    "sensors": [small_study.track(position_sd_m=0.5, dropout=0.1, interval_s=None)],
    "free": {"coefficients": "horizontal"},
    "prior": {"centre": "perturbed", "perturbation_sd": 0.1},
}
SENSORS = {
    "spiral": bs.sensors.Track(0.5, 0.1, channels=("x", "y", "yaw")),
    "zigzag": bs.sensors.DVL(sd_mps=0.00001),
}
TRACK = bs.sensors.Track(0.2, 0.1, channels=("x", "y", "yaw"), interval_s=0.5)


@pytest.fixture
def ready(tmp_path):
    """ready(dt): the study with a step, or without, made ready."""
    return lambda dt=None: prepare(load_study(small_study.write(tmp_path / "study.toml", **STUDY, dt_s=dt)))


def test_every_record_is_flown_at_a_tenth_of_the_step_of_its_fit(ready):
    """That step is the one which the problem would choose by itself, and is each trial's own."""
    setup = ready()
    steps = {}
    for name, trial in setup.trials.items():
        problem = setup.problem.problems[name]
        steps[name] = problem.simulator.step
        assert trial.truth.simulator.step == pytest.approx(0.1 * steps[name])
        again = bs.Problem(
            setup.vehicle,
            trial.manoeuvre,
            trial.record,
            free=problem.names[: problem.n_coefficients],
            prior=problem.spread,
            nuisance=trial.nuisance,
        )
        assert again.simulator.step == steps[name]
    assert steps["zigzag"] < steps["spiral"]


def test_a_step_that_is_given_is_that_of_the_fit(ready):
    setup = ready(0.25)
    for name, trial in setup.trials.items():
        assert setup.problem.problems[name].simulator.step == 0.25
        assert trial.truth.simulator.step == pytest.approx(0.025)


def test_the_noise_of_a_record_does_not_depend_on_the_step(ready):
    """Its stream of random numbers is begun when the trial is measured: other steps, the same noise."""
    one, other = (ready(dt) for dt in (0.02, 0.01))
    for name in one.trials:
        first, second = (setup.trials[name].record for setup in (one, other))
        assert [len(c.times) for c in first.channels] == [len(c.times) for c in second.channels]
        assert np.abs((first.values - second.values) / first.total_sds).max() < 1e-3


def test_the_model_is_as_good_as_its_sensors(ready):
    """What the problem predicts at the truth is within a tenth of an sd of what was measured, but for the noise."""
    setup = ready()
    for name, trial in setup.trials.items():
        problem, sensors = setup.problem.problems[name], SENSORS[name]
        exact = bs.observe(trial.truth, sensors, None)
        places = [np.isin(c.times, r.times) for c, r in zip(exact.channels, trial.record.channels, strict=True)]
        exact = np.concatenate([c.values[there] for c, there in zip(exact.channels, places, strict=True)])
        truth = np.append(setup.vehicle.xi[problem.columns], [0.0] * (problem.n_params - problem.n_coefficients))
        assert np.abs((problem.predicted(truth)[0] - exact) / problem.sds).max() < 0.1


def test_a_problem_is_posed_for_the_step_only_if_none_is_given(ready, monkeypatch):
    count = []
    monkeypatch.setattr(preparation, "Problem", lambda *a, **k: count.append(1) or bs.Problem(*a, **k))
    ready(0.25)
    assert len(count) == 2
    ready()
    assert len(count) == 2 + 4


def test_readings_of_a_trial_are_in_no_other(tmp_path, auv_log):
    """Neither in a second trial, in a copy with other times and another name, nor in a log to predict.

    Negative control: other parts of one log, and the same beginning without noise.
    """
    copy = pd.read_csv(auv_log)
    copy.assign(time_s=copy["time_s"] + 1e-5).iloc[1:].to_csv(tmp_path / "copy.csv", index=False)
    log = {key: value for key, value in small_study.LOG.items() if value is not None}

    def posed(*trials, **others):
        pairs = zip(("first", "second"), trials, strict=False)
        given = {"manoeuvre": None, "trials": [log | {"name": name} | trial for name, trial in pairs]}
        return prepare(load_study(small_study.write(tmp_path / "study.toml", **given, **others)))

    with refused("conflict", "data"):
        posed({}, {})
    with refused("conflict", "data"):
        posed({}, {"data": "copy.csv"})
    with refused("conflict", "data"):
        posed({"window_s": [0.0, 80.0]}, {"window_s": [30.0, 110.0]})
    with refused("conflict", "data"):
        posed({}, check=[{"name": "unseen", "data": "copy.csv", "subproblem": "horizontal"}])
    assert posed({"window_s": [0.0, 50.0]}, {"window_s": [60.0, 110.0]}).problem.n_params
    boat = bs.load_vehicle("auv690")
    for name in ("zigzag_20_20", "turning_circle"):
        flown = bs.simulate(boat, bs.load_manoeuvre(name, boat), dt=0.1)
        bs.observe(flown, TRACK, None).save(tmp_path / f"{name}.csv", flown.simulator.manoeuvre)
    assert posed({"data": "zigzag_20_20.csv"}, {"data": "turning_circle.csv"}).problem.n_params


@pytest.fixture
def auv_log(tmp_path):
    """log.csv, of a zig-zag, two readings of the track a second."""
    boat = bs.load_vehicle("auv690")
    zigzag = bs.load_manoeuvre("zigzag_20_20", boat)
    record = bs.observe(bs.simulate(boat, zigzag, dt=0.1), TRACK, np.random.default_rng(1))
    record.save(tmp_path / "log.csv", zigzag)
    return tmp_path / "log.csv"
