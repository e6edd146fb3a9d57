"""Optimality criteria against closed forms of small matrices, and the goals of a search."""

import numpy as np
import pytest

from bayesub.design import information as goals
from bayesub.design.information import Information


def information(gram, precision=None, values=None, sd=None):
    n = len(gram)
    values = np.arange(1.0, n + 1.0) if values is None else values
    precision = np.eye(n) if precision is None else precision
    return Information(
        tuple("abcdef"[:n]), values, 0.25 * np.abs(values) if sd is None else sd, np.asarray(precision), np.array(gram)
    )


def matrix(rng, n, rank=None):
    rows = rng.standard_normal((rank or n, n))
    return rows.T @ rows


def test_two_coefficients_in_closed_form():
    told = information([[3.0, 1.0], [1.0, 2.0]])
    covariance = np.array([[3.0, -1.0], [-1.0, 4.0]]) / 11.0
    assert told.covariance == pytest.approx(covariance, rel=1e-14)
    assert told.posterior_sd == pytest.approx(np.array([0.25, 0.5]) * np.sqrt([3.0 / 11.0, 4.0 / 11.0]), rel=1e-14)
    assert told.relative_sd == pytest.approx(0.25 * np.sqrt([3.0 / 11.0, 4.0 / 11.0]), rel=1e-14)
    assert told.d_optimality == pytest.approx(-0.25 * np.log(11.0), rel=1e-14)
    assert told.a_optimality == pytest.approx(7.0 / 22.0, rel=1e-14)
    least = 0.5 * (5.0 - np.sqrt(5.0))
    assert told.e_optimality(0) == pytest.approx(1.0 / np.sqrt(1.0 + least), rel=1e-14)
    assert told.e_optimality(1) == pytest.approx(1.0 / np.sqrt(1.0 + 5.0 - least), rel=1e-14)
    assert told.singular_values == pytest.approx(np.sqrt([5.0 - least, least]), rel=1e-14)
    assert told.n_sharper == 2
    assert told.n_known(0.14) == 1
    assert told.n_known(0.2) == 2


def test_a_null_direction_keeps_the_uncertainty_of_the_prior(rng):
    told = information(matrix(rng, 4, rank=3))
    assert told.singular_values[-1] == pytest.approx(0.0, abs=1e-6)
    assert told.e_optimality(0) == pytest.approx(1.0, abs=1e-10)
    assert told.e_optimality(1) == pytest.approx(1.0 / np.sqrt(1.0 + told.singular_values[2] ** 2))
    null = np.linalg.svd(told.gram)[2][-1]
    assert told.sd_of(null / told.prior_sd) == pytest.approx(1.0, rel=1e-10)


def test_criteria_with_a_sharper_prior_are_ratios_to_it(rng):
    precision, gram = np.eye(4) + matrix(rng, 4), matrix(rng, 4)
    told = information(gram, precision)
    before, after = np.linalg.inv(precision), np.linalg.inv(precision + gram)
    ratio = np.linalg.slogdet(after)[1] - np.linalg.slogdet(before)[1]
    assert told.d_optimality == pytest.approx(0.5 * ratio / 4.0)
    assert told.a_optimality == pytest.approx(np.mean(np.diag(after) / np.diag(before)))
    generalised = np.linalg.eigvals(np.linalg.solve(precision, gram)).real
    assert np.sort(told.singular_values**2) == pytest.approx(np.sort(generalised))
    gradient = rng.standard_normal(4)
    scaled = gradient * told.prior_sd
    assert told.sd_of(gradient) == pytest.approx(np.sqrt(scaled @ after @ scaled))
    assert told.prior_sd_of(gradient) == pytest.approx(np.sqrt(scaled @ before @ scaled))


def test_counts_and_criteria_do_not_depend_on_units(rng):
    """The same coefficients in other units have other values, sds and gradients, and the same information."""
    gram, units = 1e3 * matrix(rng, 5), 10.0 ** rng.uniform(-6.0, 6.0, 5)
    one = information(gram)
    other = information(gram, values=one.values * units, sd=one.prior_sd * units)
    assert other.relative_sd == pytest.approx(one.relative_sd, rel=1e-14)
    for share in (0.02, 0.05, 0.1, 0.25):
        assert other.n_known(share) == one.n_known(share)
    assert (other.d_optimality, other.a_optimality, other.e_optimality(0)) == (
        one.d_optimality, one.a_optimality, one.e_optimality(0),
    )  # fmt: skip
    gradient = rng.standard_normal(5)
    assert other.sd_of(gradient / units) == pytest.approx(one.sd_of(gradient), rel=1e-12)
    goal = goals.Known(0.1)
    assert goal(other) == pytest.approx(goal(one), rel=1e-14)


def test_a_value_measured_besides_is_a_reading_of_it(rng):
    told = information(matrix(rng, 3))
    with_second = told.with_known([1], 0.02)
    sd = 0.02 * told.values[1] / told.prior_sd[1]
    row = np.array([[0.0, 1.0 / sd, 0.0]])
    assert with_second.covariance == pytest.approx(np.linalg.inv(np.eye(3) + told.gram + row.T @ row), rel=1e-12)


def test_two_trials_add_up(rng):
    one, other = (information(matrix(rng, 3)) for _ in range(2))
    assert (one + other).covariance == pytest.approx(np.linalg.inv(np.eye(3) + one.gram + other.gram), rel=1e-12)
    later = information(other.gram, np.eye(3) + one.gram)
    assert later.posterior_sd == pytest.approx((one + other).posterior_sd, rel=1e-12)


def test_goals_are_least_for_the_best(rng):
    gram = matrix(rng, 4)
    poor, good = information(gram), information(100.0 * gram)
    of_interest = goals.Sharpest([np.eye(4)[1], rng.standard_normal(4)])
    for goal in (goals.Known(0.1), goals.d_optimality, goals.a_optimality, goals.EOptimality(0), of_interest):
        assert goal(good) < goal(poor)
    exact = information(1e12 * np.eye(4))
    assert goals.Known(0.1)(exact) == pytest.approx(-4.0)
    assert goals.Known(0.1)(information(np.zeros((4, 4)))) > -0.2
    assert of_interest(information(np.zeros((4, 4)))) == pytest.approx(0.0)
