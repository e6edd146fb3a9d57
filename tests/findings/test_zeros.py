"""Zeros of actuators against the steady terms of the equations: which combinations only a trial knows."""

import numpy as np
import pytest
from scipy import stats
from support import small_study

import bayesub as bs
from bayesub.findings import data_card, zeros
from bayesub.inference.baselines import gauss_newton
from bayesub.study.run.prepare import prepare
from bayesub.study.schema.study_file import load_study

STUDY = small_study.SUBOFF | {
    "manoeuvre": "zigzag_20_20",
    "dt_s": 0.5,
    "sensors": [small_study.track(position_sd_m=0.5)],
    "free": {"coefficients": ["Nuv", "Yuu", "Nuu"]},
    "prior": {"sd": 0.2, "given": {"Yuu": {"mean": 0.0, "sd": 1e-4}, "Nuu": {"mean": 0.0, "sd": 5e-5}}},
}
BIAS = {"bias_rudder_deg": {"mean": 0.0, "sd": 1.0}}


@pytest.fixture
def posed(tmp_path):
    """posed(source, nuisance): the problem of the study."""

    def pose(source, nuisance=None, seed=1):
        changes = STUDY | source | {"nuisance": nuisance or {}, "seed": seed}
        return prepare(load_study(small_study.write(tmp_path / "study.toml", **changes))).problem

    return pose


def with_bias(bias):
    return {"truth": {"actuators": {"bias_rudder_deg": bias}}}


@pytest.fixture
def logged(tmp_path, suboff):
    """A log of the zigzag."""
    track = bs.simulate(suboff, bs.load_manoeuvre("zigzag_20_20", suboff), dt=0.5, sample=1.0)
    sensors = bs.sensors.Track(0.5, 0.1, 2.0, ("x", "y", "yaw"))
    bs.observe(track, sensors, np.random.default_rng(2)).save(tmp_path / "log.csv", track)
    return small_study.LOG


def test_a_degree_of_rudder_is_the_force_of_its_term(suboff):
    """By hand: the terms of the rudder are Yuu_dr u^2 and Nuu_dr u^2, those of the asymmetry Yuu u^2 and Nuu u^2."""
    track = bs.simulate(suboff, bs.load_manoeuvre("zigzag_20_20", suboff), dt=0.5, sample=5.0)
    changes, rest = zeros.equivalents(track, "bias_rudder_deg")
    degree = np.radians(1.0)
    expected = {name: suboff.xi[suboff.equations.index[f"{name}_dr"]] * degree for name in ("Yuu", "Nuu")}
    assert changes == pytest.approx(expected, rel=1e-9)
    assert rest < 1e-12
    assert zeros.rank_lines(track)[0].startswith(
        "not unique with bias_rudder_deg unknown: a unit of it is exactly like"
    )


def test_planes_of_each_motion(suboff):
    """Of booth's controls; a turn does not feel the stern planes."""
    assert zeros.biases(suboff, "horizontal") == {"bias_rudder_deg": {"Y", "K", "N"}}
    assert set(zeros.biases(suboff, None)) == {"bias_rudder_deg", "bias_bow_plane_deg", "bias_stern_plane_deg"}
    assert set(zeros.steady(suboff.equations)) == {"Yuu", "Zuu", "Kuu", "Muu", "Nuu"}


def test_what_is_known_only_together(posed):
    """Eight truths: the sums come out within their sds, which are a small part of those of the terms themselves.

    Sixteen squares of standard normal errors; the probability of a sum outside is 1 in 1000. Where the zero is held,
    the terms stand in for it by many standard deviations.
    """
    errors, blind = [], []
    for seed in range(8):
        bias = np.random.default_rng(seed).normal()
        problem = posed(with_bias(bias), BIAS, seed)
        fit = gauss_newton(problem)
        rows = zeros.together(problem.names, fit.covariance, problem.vehicle)
        assert [row["coefficient"] for row in rows] == ["Yuu", "Nuu"]
        for row in rows:
            value = dict(zip(problem.names, fit.values, strict=True))
            (zero, factor), *_ = row["with"].items()
            assert zero == "bias_rudder_deg"
            steered = problem.vehicle.xi[problem.equations.index[f"{row['coefficient']}_dr"]]
            # But for what Xuu_drdr and the other coefficient tell of the zero.
            assert factor == pytest.approx(steered * np.radians(1.0), rel=0.2)
            assert row["alone"] > 2.0 * row["sd"]
            errors.append((value[row["coefficient"]] + factor * value[zero] - factor * bias) / row["sd"])
        problem = posed(with_bias(bias), None, seed)
        fit = gauss_newton(problem)
        k = problem.names.index("Nuu")
        blind.append(fit.values[k] / np.sqrt(fit.covariance[k, k]))
    low, high = stats.chi2.ppf([0.0005, 0.9995], 16)
    assert low < np.sum(np.square(errors)) < high
    assert np.median(np.abs(blind)) > 5.0


def test_words(posed, logged):
    """The card of a study says what is known only together, and of a log what it should infer besides."""
    lines = data_card.check(posed(with_bias(0.5), BIAS), "").lines()
    assert lines[-1].startswith("Known only together with the zeros of actuators: Yuu +")
    assert "bias_rudder_deg to" in lines[-1]
    assert not any("advice" in line for line in data_card.check(posed(with_bias(0.5)), "").lines())
    lines = data_card.check(posed(logged), "").lines()
    assert lines[-1].startswith("advice: Yuu, Nuu are free, and no zero of an actuator is: 1 deg of bias_rudder_deg is")
    assert lines[-1].endswith("give bias_rudder_deg a prior in [nuisance], or hold Yuu, Nuu")
    assert not zeros.advice(posed(logged, BIAS))
