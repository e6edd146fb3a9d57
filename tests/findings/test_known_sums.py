"""Weighted sums that data fix: those of the closed form, held by their intervals, and none that a prior knew."""

import numpy as np
import pytest

import bayesub as bs
from bayesub.findings.known_sums import KNOWN, known_quotients, known_sums, sentence
from bayesub.findings.run_numbers import null_changes
from bayesub.inference.baselines import gauss_newton
from bayesub.inference.identifiability import null_space
from bayesub.model.coefficients import HORIZONTAL

NAMES, AXES = ("Yuv", "Yur", "Nuv", "Nur"), ("Y", "Y", "N", "N")
MEAN = np.array([-0.03, 0.006, -0.013, -0.004])
PRIOR = np.diag((0.25 * MEAN) ** 2)


def posterior(rows, sd, truth, rng):
    """Mean and covariance of coefficients after readings (n,) of sums (n, 4) of them with an sd, in closed form."""
    precision = np.linalg.inv(PRIOR) + rows.T @ rows / sd**2
    readings = rows @ truth + sd * rng.standard_normal(len(rows))
    covariance = np.linalg.inv(precision)
    return covariance @ (np.linalg.solve(PRIOR, MEAN) + rows.T @ readings / sd**2), covariance


def draws_of(mean, covariance, rng, n=4000):
    return rng.multivariate_normal(mean, covariance, n, method="cholesky")


def test_the_sum_that_is_measured_is_found(rng):
    """Yuv - 3 Yur and the moment Nuv alone, each to half a per cent; nothing else."""
    rows = np.array([[1.0, -3.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]])
    scales = np.abs(rows @ MEAN)
    mean, covariance = posterior(rows / scales[:, None], 0.005, MEAN, rng)
    first, second = known_sums(NAMES, AXES, draws_of(mean, covariance, rng), PRIOR)
    assert first["weights"] == {"Yuv": 1.0, "Yur": -3.0}
    assert first["formula"] == "Yuv - 3 Yur"
    assert second["weights"] == {"Nuv": 1.0}
    assert (first["axis"], second["axis"]) == ("Y", "N")
    for row in (first, second):
        assert row["relative_sd"] == pytest.approx(0.005, rel=0.1)
        assert row["q5"] < row["mean"] < row["q95"]
    assert "Yuv - 3 Yur to 0.5 %" in sentence([first, second])
    assert sentence([second]) == ""


def test_the_quotients_that_are_known_are_found_each_once(rng):
    """Of three numbers that share a factor two quotients say all; none with another axis, or that the prior knew."""
    factor, small = 1.0 + 0.2 * rng.standard_normal((4000, 1)), rng.standard_normal((4000, 5))
    names, axes = ("Yuv", "Yur", "(m - Yvdot)", "Yuu_dr", "Nuv"), ("Y", "Y", "Y", "Y", "N")
    middle = np.array([-0.03, 0.006, 0.036, 0.01, -0.013])
    draws = (
        middle
        * np.where([True, True, True, False, True], factor, 1.0)
        * (1.0 + [0.002, 0.004, 0.001, 0.2, 0.0] * small)
    )
    before = middle * (1.0 + 0.25 * rng.standard_normal((4000, 5)))
    first, second = known_quotients(names, axes, draws, before)
    assert [row["formula"] for row in (first, second)] == ["Yuv / (m - Yvdot)", "Yur / (m - Yvdot)"]
    assert first["mean"] == pytest.approx(-0.03 / 0.036, rel=1e-3)
    assert first["relative_sd"] == pytest.approx(np.hypot(0.002, 0.001), rel=0.05)
    assert "Yuv / (m - Yvdot) to 0.2 %" in sentence([first, second])
    assert known_quotients(names, axes, draws, draws) == []
    assert known_quotients(names, axes, middle + 0.0 * draws, before) == [], "of numbers that are known themselves"


def test_no_other_sum_is_known_better():
    """The weights C^-1 m against random ones."""
    rng = np.random.default_rng(5)
    mean, covariance = posterior(rng.standard_normal((3, 4)) / np.abs(MEAN), 0.002, MEAN, rng)
    draws = draws_of(mean, covariance, rng)
    (best, *_) = sorted(known_sums(NAMES, ("Y",) * 4, draws, PRIOR), key=lambda row: row["relative_sd"])
    members = [NAMES.index(name) for name in best["weights"]]
    others = draws[:, members] @ rng.standard_normal((len(members), 2000))
    assert (others.std(axis=0) / np.abs(others.mean(axis=0))).min() > 0.99 * best["relative_sd"] / 1.2


def test_intervals_hold_the_truth_in_nine_of_ten_of_two_hundred_trials():
    """Of sums that are chosen by the draws themselves, boats from the prior."""
    rng, held = np.random.default_rng(11), []
    for _ in range(200):
        truth = MEAN + np.linalg.cholesky(PRIOR) @ rng.standard_normal(4)
        rows = np.array([[1.0, -2.0, 0.0, 0.0], [0.3, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 2.0], [0.0, 0.0, 1.0, 2.1]])
        mean, covariance = posterior(rows / np.abs(rows @ MEAN)[:, None], 0.006, truth, rng)
        for row in known_sums(NAMES, AXES, draws_of(mean, covariance, rng), PRIOR):
            value = sum(weight * truth[NAMES.index(name)] for name, weight in row["weights"].items())
            held.append(row["q5"] <= value <= row["q95"])
    assert len(held) > 300
    assert abs(np.mean(held) - 0.9) < 3.0 * np.sqrt(0.09 / len(held))


def test_what_the_prior_knew_or_the_sums_before_imply_is_left_out(rng):
    """Negative control: the posterior as the prior knows nothing new; two coefficients known are no sum besides."""
    rows = np.array([[1.0, -3.0, 0.0, 0.0]]) / abs(MEAN[0] - 3.0 * MEAN[1])
    mean, covariance = posterior(rows, 0.005, MEAN, rng)
    draws = draws_of(mean, covariance, rng)
    assert len(known_sums(NAMES, AXES, draws, PRIOR)) == 1
    assert known_sums(NAMES, AXES, draws, covariance) == []
    both = posterior(np.diag(1.0 / MEAN), 0.5 * KNOWN, MEAN, rng)
    assert all(len(row["weights"]) == 1 for row in known_sums(NAMES, AXES, draws_of(*both, rng), PRIOR))


def test_no_sum_changes_along_what_the_equations_leave_open():
    """On the horizontal plane null directions follow from the linear form alone: half of a coefficient moves no sum."""
    boat = bs.load_vehicle("suboff")
    spiral = bs.load_manoeuvre("horizontal", boat)
    rng = np.random.default_rng(3)
    record = bs.observe(bs.simulate(boat, spiral, dt=0.05), bs.sensors.Track(0.5, 0.1, channels=("x", "y", "yaw")), rng)
    problem = bs.Problem(boat, spiral, record, free=HORIZONTAL, prior=bs.priors.relative_normal(0.25), dt=0.5)
    mode = gauss_newton(problem)
    draws = rng.multivariate_normal(mode.values, mode.covariance, 4000, method="cholesky")
    axes = [boat.equations.term(name).axis for name in problem.names]
    sums = known_sums(problem.names, axes, draws, np.diag(problem.prior.sd**2))
    assert any(len(row["weights"]) > 1 for row in sums)
    null = null_changes(null_space(problem, mode.values), dict(zip(problem.names, mode.values, strict=True)))
    assert len(null) == 3
    values = dict(zip(problem.names, mode.values, strict=True))
    for row in sums:
        for direction in null:
            change = sum(w * values[n] * direction["changes"].get(n, 0.0) for n, w in row["weights"].items())
            assert abs(change / row["mean"]) < 0.05


def test_what_rounding_of_its_weights_makes_worse_is_not_said_to_be_known(rng):
    """No sum that is written is known to less than is said of all."""
    for factor in (0.3967, 0.4321, 0.8712):
        rows = np.array([[1.0, factor * MEAN[0] / MEAN[1], 0.0, 0.0]])
        mean, covariance = posterior(rows / np.abs(rows @ MEAN)[:, None], 0.0099, MEAN, rng)
        assert all(
            row["relative_sd"] < 1.02 * KNOWN for row in known_sums(NAMES, AXES, draws_of(mean, covariance, rng), PRIOR)
        )
