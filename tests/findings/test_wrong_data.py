"""Wrong data that fit: logs flown in finer steps than they are fitted in, with one thing changed, and what is said.

Of a wrong scale, clock, size of noise or control the name comes out, and how far off it is; of the right log nothing.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import bayesub as bs
from bayesub.findings import remedies, rests_on
from bayesub.inference.baselines import gauss_newton
from bayesub.inference.checks.fit import criticise
from bayesub.problem.priors import normal, relative_normal
from bayesub.study.run.run import run
from bayesub.study.schema.study_file import load_study

FREE = ("Xuu", "Yuv", "Nuv", "Nur", "Yuu_dr", "Nuu_dr")
SENSORS = (
    bs.sensors.DVL(sd_mps=0.005, interval_s=0.5, channels=("u_ground", "v_ground")),
    bs.sensors.INS(sd_degps=0.05, interval_s=0.5, channels=("r",)),
    bs.sensors.Compass(sd_deg=0.5, interval_s=1.0),
    bs.sensors.Track(0.3, 1.0, interval_s=2.0, channels=("x", "y")),
)
OPTIONS = {"free": FREE, "prior": relative_normal(0.2), "dt": 0.25}


@pytest.fixture(scope="module")
def flown(auv):
    """A zig-zag in steps of 20 ms and its readings."""
    manoeuvre = bs.load_manoeuvre("zigzag_20_20", auv)
    record = bs.observe(bs.simulate(auv, manoeuvre, dt=0.02), SENSORS, np.random.default_rng(4))
    return replace(manoeuvre, subproblem="horizontal"), replace(record, truth=None)


def changed(record, change):
    """The record with other channels."""
    return replace(record, channels=tuple(map(change, record.channels)))


def scaled(factor, *names):
    return lambda c: replace(c, values=factor * c.values) if c.name in names else c


def noisy(factor):
    return lambda c: replace(c, sd=factor * c.sd)


def late(seconds):
    def change(channel):
        kept = channel.times + seconds <= 100.0
        return replace(channel, times=channel.times[kept] + seconds, values=channel.values[kept])

    return change


def said(auv, manoeuvre, record, **options):
    """The fit, its rows of what it rests on, and the sentences about them."""
    problem = bs.Problem(auv, manoeuvre, record, **OPTIONS | options)
    fit = gauss_newton(problem)
    n, sd = problem.n_coefficients, np.sqrt(np.diag(fit.covariance))
    rows = rests_on.numbers(problem, fit.values, fit.values[:n], sd[:n])
    return problem, fit, {row["name"]: row for row in rows}, rests_on.sentences(rows)


def test_a_right_log_contradicts_nothing_and_its_drag_rests_on_the_scales(auv, flown):
    """1 % of speed is 2 % of a quadratic drag whose thrust is known, and 5 % of thrust is 5 % of it.

    But for the drag of the turns, which is held and no fifth of all.
    """
    _, _, rows, sentences = said(auv, *flown)
    assert "contradiction" not in sentences
    assert max(abs(row["off"]) for row in rows.values() if row["off"]) < rests_on.CONTRADICTION
    for name, share in (("scale_propeller", 0.05), ("scale_u_ground", 0.02)):
        move = rows[name]["moves"][0]
        assert move["name"] == "Xuu"
        assert move["relative"] == pytest.approx(share, rel=0.2)
        assert f"in {name} changes" in sentences["rests_on"]


@pytest.mark.parametrize(
    ("name", "change", "truth"),
    [
        ("scale_u_ground", scaled(1.03, "u_ground", "v_ground"), 1.03),
        ("scale_r", scaled(1.03, "r"), 1.03),
        ("clock_offset_s", late(1.0), 1.0),
    ],
)
def test_what_is_wrong_with_sensors_is_named(auv, flown, name, change, truth):
    """As far off as it is, within four of its standard deviations, where another column knows it as well."""
    _, _, rows, sentences = said(auv, flown[0], changed(flown[1], change))
    assert ("all readings were taken" if "offset" in name else f"{name} is") in sentences["contradiction"]
    assert abs(rows[name]["off"]) > rests_on.CONTRADICTION
    assert rows[name]["estimate"] == pytest.approx(truth, abs=max(4.0 * rows[name]["estimate_sd"], 0.2 * abs(truth)))


def test_linear_change_is_that_of_a_fit_to_the_wrong_log(auv, flown):
    """What 1 % of a scale moves, against a second fit; the fit that infers the scale is told what is said."""
    manoeuvre, record = flown
    _, right, rows, _ = said(auv, manoeuvre, record)
    problem, wrong, *_ = said(auv, manoeuvre, changed(record, scaled(1.01, "u_ground")))
    move = rows["scale_u_ground"]["moves"][0]
    k = problem.names.index(move["name"])
    assert wrong.values[k] - right.values[k] == pytest.approx(move["change"], rel=0.05)
    unknown = {"scale_u_ground": normal(1.0, 10.0)}
    inferred = gauss_newton(bs.Problem(auv, manoeuvre, record, nuisance=unknown, **OPTIONS))
    k = inferred.names.index("scale_u_ground")
    assert inferred.values[k] == pytest.approx(
        rows["scale_u_ground"]["estimate"], abs=0.1 * rows["scale_u_ground"]["estimate_sd"]
    )
    assert np.sqrt(inferred.covariance[k, k]) == pytest.approx(rows["scale_u_ground"]["estimate_sd"], rel=0.05)


@pytest.mark.parametrize("column", ["propeller", "rudder"])
def test_wrong_controls_cannot_be_told_and_the_answer_says_what_it_rests_on(auv, flown, column):
    """A thrust or a rudder that is 1.2 times as strong trades off with what it is to tell."""
    *_, rows, sentences = said(auv, *flown)
    assert f"in scale_{column} changes" in sentences["rests_on"]
    assert {"propeller": "Xuu", "rudder": "Nuu_dr"}[column] in [
        move["name"] for move in rows[f"scale_{column}"]["moves"]
    ]


@pytest.mark.parametrize(("factor", "words"), [(10.0, "deviations too large"), (0.1, "deviations too small")])
def test_wrong_sizes_of_noise_are_told_as_such(auv, flown, factor, words, rng):
    """Not as slow noise, at the mode and over draws of a posterior that is ten times too wide."""
    problem, fit, *_ = said(auv, flown[0], changed(flown[1], noisy(factor)))
    found = remedies.fit_of_mode(problem, fit.values, rng)
    assert words in found.sentences["fit_of_the_mode"]
    assert "lines_to_add" not in found.sentences
    assert bool(found.small_sd) == (factor < 1.0)
    draws = rng.multivariate_normal(fit.values, fit.covariance, 200, method="cholesky")
    residuals = problem.quantile_residuals(draws, rng)
    criticism = criticise(residuals, {name: problem.channels[name][0].times for name in residuals})
    assert not remedies.explain(problem, criticism, fit.values)
    assert words in remedies.advise(criticism, problem)


def test_a_control_that_steps_between_its_rows_is_named(auv, flown, rng):
    """Sampled every four seconds, the rudder of a zig-zag is a ramp; negative control: ten times as often it is not."""
    manoeuvre, record = flown
    for interval, named in ((4.0, True), (0.1, False)):
        times = np.linspace(0.0, manoeuvre.duration, round(manoeuvre.duration / interval))
        parts = {"controls": manoeuvre.controls, "rpm": manoeuvre.rpm[:, None]}
        sampled = {
            key: np.stack([np.interp(times, manoeuvre.times, column) for column in part.T], axis=1)
            for key, part in parts.items()
        }
        slow = replace(manoeuvre, times=times, controls=sampled["controls"], rpm=sampled["rpm"][:, 0])
        problem, fit, *_ = said(auv, slow, record)
        residuals = problem.quantile_residuals(fit.values[None], rng)
        words = remedies.on_steps(problem, residuals)
        assert ("rudder_command_deg" in words) == named
        # Where other misfits make outliers everywhere, those after steps are larger all the same.
        waves = {name: 10.0 * r + 5.0 * np.sign(np.sin(np.arange(r.shape[1]))) for name, r in residuals.items()}
        assert ("rudder_command_deg" in remedies.on_steps(problem, waves)) == named


OWN_LOG = Path(__file__).parents[2] / "studies" / "own_log.toml"


def with_late_readings(log):
    """Readings a second, ten rows, later than the controls."""
    readings = log.columns.difference(["time_s", "rudder_deg", "bow_plane_deg", "stern_plane_deg", "rpm"])
    return log.assign(**{name: log[name].shift(10) for name in readings})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "topic", "words"),
    [
        (lambda log: log, "", ""),
        (lambda log: log.assign(u_ground_mps=1.03 * log.u_ground_mps), "contradiction", "scale_u_ground is 1.03"),
        (lambda log: log.assign(rpm=1.1 * log.rpm), "contradiction", "scale_propeller is 0."),
        (lambda log: log.assign(rudder_deg=1.2 * log.rudder_deg), "rests_on", "in scale_rudder"),
        (with_late_readings, "contradiction", "s earlier than the study has it"),
    ],
)
def test_what_the_sampled_posterior_of_the_own_log_says(tmp_path, change, topic, words):
    """The study of the manual with one thing changed in its log; of the log itself nothing is contradicted."""
    (tmp_path / "trial").mkdir()
    change(pd.read_csv(OWN_LOG.parent / "trial" / "trial.csv")).to_csv(tmp_path / "trial" / "trial.csv", index=False)
    (tmp_path / "own_log.toml").write_text(OWN_LOG.read_text())
    said = run(load_study(tmp_path / "own_log.toml", quick=True), tmp_path / "run").sentences
    assert words in said.get(topic, "")
    assert ("contradiction" in said) == (topic == "contradiction")
    assert "in scale_propeller changes Xuu by 5 %" in said["rests_on"]
