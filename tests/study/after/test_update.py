"""A log more: the study of all trials together, as a person would have written it, and what is refused."""

import numpy as np
import pytest
from support import refusals, small_study

from bayesub.inference.sampling import posterior_file
from bayesub.study.after.update import FIRST, updated
from bayesub.study.run.prepare import prepare
from bayesub.study.schema.study_file import load_study

SENSORS = [small_study.track(position_sd_m=0.5, interval_s=10.0)]
FREE = ("Xuu", "Yuv", "Nuv")


@pytest.fixture(scope="module")
def folder(tmp_path_factory, suboff):
    """Logs of two trials, and the run of a study of the first, which is to predict the second."""
    manoeuvres = {"spiral": "horizontal", "zig-zag 1": "zigzag_20_20"}
    folder = small_study.save_logs(tmp_path_factory.mktemp("update"), suboff, manoeuvres)
    small_study.run(small_study.write(folder / "one.toml", **of_logs(of_one())), folder / "one")
    return folder


def of_one():
    """The only trial of a study: how it starts is known, and the other log is not fitted."""
    nuisance = {"u0_mps": {"value": 7.5}, "bias_yaw_deg": {"mean": 0.0, "sd": 0.2}}
    check = [{"data": "zig-zag 1.csv", "subproblem": "horizontal"}]
    return {"data": "spiral.csv", "subproblem": "horizontal", "nuisance": nuisance, "check": check}


def of_logs(trials):
    given = {"sensors": SENSORS, "free": {"coefficients": FREE}, "prior": {"sd": 0.2}, "name": "one"}
    return small_study.SUBOFF | given | {"manoeuvre": None, "baselines": {"sqp_starts": 1}} | trials


@pytest.mark.slow
def test_the_study_is_that_of_both_trials(folder):
    """The same densities, to the last bit, as those of a study that has both logs from the beginning."""
    both = updated(folder / "one", folder / "zig-zag 1.csv")
    assert both.name == "one_zig-zag_1"
    assert not both.check
    assert (both.baselines.linear_least_squares, both.baselines.sqp_starts) == (False, 0)
    assert both.path(both.sampler.start) == str(folder / "one" / "posterior.nc")
    still = {"u0_mps": {"value": 7.5}}
    trials = [
        {"name": FIRST, "data": "spiral.csv", "subproblem": "horizontal", "nuisance": still},
        {"name": "zig-zag_1", "data": "zig-zag 1.csv", "subproblem": "horizontal"},
    ]
    bias = {"bias_yaw_deg": {"mean": 0.0, "sd": 0.2}}
    by_hand = small_study.write(folder / "both.toml", **of_logs({"trials": trials, "nuisance": bias}))
    problem, expected = (prepare(study).problem for study in (both, load_study(by_hand)))
    assert problem.names == expected.names
    places = expected.prior.sample(np.random.default_rng(1), 8)
    assert np.array_equal(problem.log_likelihood(places), expected.log_likelihood(places))


@pytest.mark.slow
def test_an_update_is_a_run_that_the_next_log_updates(folder, bayesub):
    log = folder / "zig-zag 1.csv"
    status, out, err = bayesub("update", folder / "one", log, "-o", folder / "two")
    assert status in (0, 3), err  # of so few readings perhaps not all checks pass
    assert "one_zig-zag_1" in out
    posteriors = [posterior_file.load(folder / name / "posterior.nc") for name in ("one", "two")]
    sds = [dict(zip(one.names, one.sd, strict=True)) for one in posteriors]
    assert all(sds[1][name] < sds[0][name] for name in FREE)
    (folder / "third.csv").write_bytes((folder / "spiral.csv").read_bytes() + b"\n")
    three = updated(folder / "two", folder / "third.csv")
    assert [name for name, *_ in three.each_trial()] == [FIRST, "zig-zag_1", "third"]


@pytest.mark.parametrize(
    ("run", "log", "kind", "key"),
    [
        ("one", "none.csv", "file", ""),
        ("one", "spiral.csv", "conflict", ""),
        ("nowhere", "zig-zag 1.csv", "state", "config.toml"),
    ],
)
def test_what_cannot_be_a_log_more_is_refused(folder, run, log, kind, key):
    with refusals.refused(kind, key):
        updated(folder / run, folder / log)


def test_the_guess_of_a_simulated_trial_stays_the_prior(tmp_path, folder):
    """Its truth does not, and faults of its sensors are not those of the log."""
    faulty = [SENSORS[0] | {"dropout": 0.1}]
    changes = {"sensors": faulty, "free": {"coefficients": FREE}, "prior": {"sd": 0.2, "centre": "perturbed"}}
    study = load_study(small_study.write(tmp_path / "guess.toml", **(small_study.SUBOFF | changes)))
    small_study.run(tmp_path / "guess.toml", tmp_path / "guess")
    both = prepare(updated(tmp_path / "guess", folder / "zig-zag 1.csv"))
    alone = prepare(study).problem
    n = alone.n_coefficients
    assert np.array_equal(both.problem.prior.mean[:n], alone.prior.mean[:n])
    assert np.array_equal(both.problem.prior.sd[:n], alone.prior.sd[:n])
    assert not np.array_equal(alone.prior.mean[:n], both.vehicle.xi[alone.columns])
    first, second = both.trials.values()
    assert len(first.record.channels[0].times) < len(second.record.channels[0].times) * 2
    assert np.array_equal(first.record.channels[0].values, prepare(study).trials[""].record.channels[0].values)
