"""What the report says of unmodelled forces: numbers, sentences, figures, and what is left out elsewhere."""

import dataclasses

import numpy as np
import pytest

import bayesub as bs
from bayesub.findings import disturbances
from bayesub.findings.results import Results, numbers_of
from bayesub.inference import identifiability
from bayesub.inference.baselines import gauss_newton
from bayesub.inference.sampling.posterior import Posterior
from bayesub.problem.disturbances import of_history
from bayesub.problem.joint import JointProblem
from bayesub.problem.priors import log_normal
from bayesub.report import report
from bayesub.report.figures import figures

BOAT = bs.load_vehicle("auv690")
SPIRAL = bs.load_manoeuvre("horizontal", BOAT)
SENSORS = [bs.sensors.Track(0.1, 0.1, channels=("x", "y", "yaw"), interval_s=2.0), bs.sensors.Sensor("u_mps", sd=0.005)]
FREE = ["Xuu", "Yuv", "Nuv", "Nur"]
SD = {"X": 4.0 / 76900.0, "Y": log_normal(1e-5, 1.0)}  # X in N over the unit of a force


def posed(seed):
    rng = np.random.default_rng(seed)
    truth = bs.simulate(
        BOAT, SPIRAL, dt=0.1, disturbance=bs.Disturbance(("X", "Y"), np.array([4.0, 1.0]), 8.0), rng=rng
    )
    unknown = bs.UnknownDisturbance(("X", "Y"), SD, log_normal(8.0, 0.5), knot_interval_s=8.0)
    record = bs.observe(truth, SENSORS, rng)
    prior = bs.priors.relative_normal(0.25)
    return bs.Problem(BOAT, SPIRAL, record, free=FREE, prior=prior, dt=0.8, disturbance=unknown)


def posterior_of(problem, rng):
    """Draws of the Laplace approximation about the joint mode, as a chain of four ensembles."""
    mode = gauss_newton(problem)
    t = problem.prior.standard(mode.values)
    jacobian = problem.prior.chain(problem.jacobian(mode.values), t)
    factor = np.linalg.cholesky(np.linalg.inv(jacobian.T @ jacobian + np.eye(len(t))))
    chain = problem.prior.parameters(t + rng.standard_normal((4, 60, 8, len(t))) @ factor.T)
    log_prob = problem.log_prob(chain.reshape(-1, len(t))).reshape(4, 60, 8)
    prior = problem.prior
    return Posterior(problem.names, chain, log_prob, prior.mean, prior.sd, 10, 0.5, 100, 1.0, {"diverged": 0})


def results_of(problem):
    posterior = posterior_of(problem, np.random.default_rng(1))
    spectrum = identifiability.fisher(problem, posterior.best)
    return Results(problem, [], spectrum, posterior, None, 1)


@pytest.fixture(scope="module")
def problem():
    return posed(0)


@pytest.fixture(scope="module")
def results(problem):
    return results_of(problem)


@pytest.fixture(scope="module")
def numbers(results):
    return numbers_of(results) | {"name": "gusts", "question": "", "seconds": {}}


def test_the_truth_is_that_of_the_record_and_the_reference_its_nearest_history(problem):
    readings, states = problem.truth()
    off = (readings - problem.readings) / problem.sds
    assert np.mean(off**2) == pytest.approx(1.0, abs=5.0 * np.sqrt(2.0 / len(off)))
    undisturbed = problem.predicted(np.where([of_history(n) for n in problem.names], 0.0, problem.reference))[0]
    nearest = problem.predicted(problem.reference)[0]
    assert np.abs((undisturbed - readings) / problem.sds).max() > 10.0
    assert np.sqrt(np.mean(((nearest - readings) / problem.sds) ** 2)) < 0.3
    assert states.shape == problem.motion(problem.reference)[0].shape
    forces, fine = problem.forces(problem.reference)[0], problem.record.forces
    knots = problem.simulator.knots
    rows, places, weights = knots.hats(fine.times)
    lines = np.zeros((len(fine.times), 2))
    np.add.at(lines, rows, weights[:, None] * forces.T[places])
    lost = fine.values[fine.times <= knots.times[-1]] - lines[fine.times <= knots.times[-1]]
    assert np.abs(np.mean(lost, axis=0)).max() < 0.02  # N: the impulse of the nearest line is that of the force


def test_without_unknown_forces_the_truth_is_disturbed_all_the_same(problem):
    plain = bs.Problem(BOAT, SPIRAL, problem.record, free=FREE, prior=bs.priors.relative_normal(0.25), dt=0.8)
    assert plain.truth()[0] == pytest.approx(problem.truth()[0], rel=1e-12)
    assert plain.record.forces is problem.record.forces


def test_forces_at_knots_are_in_no_table_and_no_figure_of_parameters(problem, results, numbers):
    others = [name for name in problem.names if not of_history(name)]
    assert [row["name"] for row in numbers["parameters"] + numbers["nuisance"]] == others
    assert results.spectrum.names == results.summary.names == tuple(others)
    assert numbers["convergence"]["n_parameters"] == problem.n_params > len(others) + 40
    text = str({key: value for key, value in numbers.items() if key != "convergence"})
    assert "disturbance_X_" not in text
    assert "disturbance_Y_" not in text.replace("sd_disturbance_Y", "")
    page = report.page(numbers, dict.fromkeys(PICTURES, ("What it is.", b"")))
    assert f"Every one of {problem.n_params} parameters" in page or "NOT CONVERGED" in page
    assert "Unmodelled forces" in page
    assert "disturbance_X_1" not in page.replace("&", "").split("NOT CONVERGED")[0]


PICTURES = (
    "coefficients",
    "criticism",
    "disturbance",
    "ladder",
    "correlation",
    "directions",
)


def test_numbers_are_those_of_the_draws(problem, results, numbers):
    said = numbers["disturbance"]
    (row, other) = said["trials"][0]["axes"]
    forces = problem.forces(results.posterior.draws)
    times = np.linspace(0.0, problem.simulator.knots.times[-1], 4001)
    lines = np.array([np.interp(times, problem.simulator.knots.times, line) for line in forces[::8, 0]])
    assert row["rms_n"]["median"] == pytest.approx(np.median(np.sqrt(np.mean(lines**2, axis=1))), rel=0.03)
    assert row["share"]["median"] == pytest.approx(row["rms_n"]["median"] / row["hull_rms_n"], rel=1e-9)
    assert row["posterior_over_prior_sd"] < disturbances.UNSEEN
    assert row["rms_n"]["q5"] < row["true_rms_n"] < row["rms_n"]["q95"]
    assert other["axis"] == "Y"
    known, inferred = said["sds"]
    assert known["sd_n"]["value"] == pytest.approx(4.0, rel=0.01)
    assert inferred["sd_n"]["prior_median"] == pytest.approx(0.77, rel=0.01)
    assert said["correlation_time_s"]["prior_median"] == pytest.approx(8.0)
    assert said["followed"] == []


def test_knots_farther_apart_than_the_correlation_time_are_named(numbers):
    """With the knot interval that is right; nothing is said of knots that are closer."""
    section = numbers["disturbance"]
    time = section["correlation_time_s"]["median"]
    assert "may bias" not in disturbances.sentences(section | {"knot_interval_s": 0.9 * time})["disturbance"]
    said = disturbances.sentences(section | {"knot_interval_s": 1.1 * time})["disturbance"]
    assert f"give [disturbance] knot_interval_s = {0.5 * time:.2g}." in said


def test_sentences_say_which_axis_lacks_what(numbers):
    said = disturbances.sentences(numbers["disturbance"])
    assert said["disturbance"].startswith("surge: ")
    assert " of the hull's force, " in said["disturbance"]
    assert "Correlation time " in said["disturbance"]
    assert "sd of Y " in said["disturbance"]
    assert "sd of X " not in said["disturbance"]
    assert said["missing_terms"].startswith("No history follows a regressor")
    assert disturbances.sentences({}) == {}
    assert numbers["verdict"]["disturbance"] == said["disturbance"]


def test_what_sensors_do_not_see_and_what_is_missing_is_said(numbers):
    content = numbers["disturbance"]
    (row, _) = content["trials"][0]["axes"]
    rows = [row | {"posterior_over_prior_sd": 0.97}, row | {"axis": "Y", "largest": "in the turns"}]
    held = {"regressor": "v*nu", "name": "Yv_absnu", "free": False, "change": -0.03, "change_sd": 0.004, "unit": None}
    followed = [
        {
            "axis": "Y",
            "terms": [held | {"held_at": 0.1}, {"regressor": "v*v", "name": None}],
            "rms_n": 1.7,
            "p_value": 0.0,
        },
        {"axis": "X", "terms": [{"regressor": "v*v", "name": None}], "rms_n": 2.0, "p_value": 2e-3},
        {"axis": "Y", "terms": [held | {"free": True}], "rms_n": 1.7, "p_value": 1e-3},
    ]
    said = disturbances.sentences(content | {"trials": [{"name": "first", "axes": rows}], "followed": followed})
    beginning = "first: surge: not determined by these sensors (posterior sd 0.97 of the prior's)"
    assert said["disturbance"].startswith(beginning)
    assert "largest in the turns" in said["disturbance"]
    missing = said["missing_terms"]
    assert "Sway follows v*nu (or v*v, which this motion cannot distinguish)" in missing
    assert "as if Yv_absnu were off by -0.03 ± 0.004 (1.7 N rms)" in missing
    assert "held at 0.1, 30 % of it: a missing or wrongly held term" in missing
    assert "no such term on X; it would be 2 N rms" in missing
    assert "Yv_absnu is free" in missing


def test_a_history_that_comes_with_the_turns_is_largest_there(results):
    (forces,) = results.forces
    turning = forces.turning.reshape(len(forces.times) - 1, -1).mean(axis=1)
    at_knots = np.interp(np.arange(len(forces.times)), np.arange(len(turning)) + 0.5, turning)
    rng = np.random.default_rng(0)
    noise = 0.05 * rng.standard_normal(forces.draws.shape)
    for shape, place in ((0.1 + at_knots, "in the turns"), (1.1 - at_knots, "out of the turns")):
        planted = dataclasses.replace(forces, draws=4.0 * shape + noise)
        assert disturbances._axes(planted)[0]["largest"] == place
    level = dataclasses.replace(forces, draws=4.0 + noise)
    assert disturbances._axes(level)[0]["largest"] is None


@pytest.mark.slow
@pytest.mark.rendered
def test_each_trial_of_several_has_its_own_figure(tmp_path):
    joint = JointProblem({"first": posed(1), "second": posed(2)})
    results = results_of(joint)
    numbers = numbers_of(results)
    assert [trial["name"] for trial in numbers["disturbance"]["trials"]] == ["first", "second"]
    drawn = {figure.name: figure for figure in figures(results, joint.reference[joint.others], "truth", [])}
    assert {"disturbance_first", "disturbance_second", "fan_first"} <= drawn.keys()
    drawn["disturbance_second"].draw([tmp_path / "a.png"])
    assert (tmp_path / "a.png").stat().st_size > 10_000
    assert "in the trial second" in drawn["disturbance_second"].caption
