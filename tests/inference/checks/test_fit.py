"""Checks of residuals: their distribution under a right model, in closed form and simulated, and planted faults."""

import json

import numpy as np
import pytest
from scipy import stats
from scipy.special import erfc

from bayesub.inference.checks.fit import anderson_darling, autocorrelations, criticise, slow_waves, tail_probabilities

TIMES = np.arange(300.0)


def found(residuals, times=TIMES):
    """The faults of one channel with the given residuals (n,)."""
    return criticise({"x": residuals[None]}, {"x": times}).checks["x"].faults


def test_tail_probabilities_are_those_of_scipy(rng):
    residuals = 1.1 * rng.standard_normal((4, 300))
    tails = tail_probabilities(residuals, TIMES)
    for k, row in enumerate(residuals):
        upper = stats.chi2.sf(row @ row, 300)
        assert tails["chi_square"][k] == pytest.approx(2 * min(upper, 1 - upper), rel=1e-9)
        assert tails["largest"][k] == pytest.approx(1 - (1 - 2 * stats.norm.sf(abs(row).max())) ** 300, rel=1e-9)
        count = stats.binom(300, 2 * stats.norm.sf(3.0))
        assert tails["outliers"][k] == pytest.approx(count.sf(np.sum(abs(row) > 3.0) - 1), rel=1e-9)
        fitted = slow_waves(TIMES) @ (slow_waves(TIMES).T @ row)
        ratio = (fitted @ fitted / 20) / (np.sum((row - fitted) ** 2) / 280)
        assert tails["drift"][k] == pytest.approx(stats.f.sf(ratio, 20, 280), rel=1e-9)


def test_anderson_darling_is_its_integral_and_its_tail_that_of_stephens():
    """A^2 = n int (F_n - F)^2 / (F (1 - F)) dF, by the midpoint rule; percentage points of Stephens (1974), case 0."""
    residuals = np.array([[-1.3, 0.2, 0.4, 2.1]])
    u = (np.arange(2_000_000) + 0.5) / 2_000_000
    steps = np.searchsorted(stats.norm.cdf(residuals[0]), u) / 4
    integral = 4 * np.mean((steps - u) ** 2 / (u * (1 - u)))
    assert anderson_darling(residuals)[0] == pytest.approx(integral, rel=1e-4)
    for point, probability in ((2.492, 0.05), (3.857, 0.01)):
        assert np.sqrt(3) * erfc(np.sqrt(point)) == pytest.approx(probability, rel=0.13)


@pytest.mark.parametrize("n", [12, 60, 300])
def test_p_values_of_standard_normal_residuals_are_what_they_say(n, rng):
    """No p-value is small more often than it says, also at irregular times and in the tail that Bonferroni uses."""
    times = np.cumsum(10.0 ** rng.uniform(-1, 1, n))
    n_trials = 10_000
    tails = tail_probabilities(rng.standard_normal((n_trials, n)), times)
    for name, values in tails.items():
        for level in (0.05, 0.001):
            expected = n_trials * level * (1.15 if name == "anderson_darling" else 1.0)  # its limit is an eighth off
            # four standard deviations of a Poisson count
            assert np.sum(values < level) < expected + 4 * np.sqrt(expected), (name, level)


def test_variances_of_correlations_are_exact_with_gaps(rng):
    """Pairs by distance in time, counted by hand; variances against simulation."""
    times = np.array([0.0, 1.0, 2.0, 3.0, 8.0, 9.0, 10.1, 14.0, 15.0, 16.0])
    residuals = rng.standard_normal((40_000, 10))
    correlations, variances = autocorrelations(residuals, times)
    squares = np.sum(residuals**2, axis=1)
    pairs = [[(0, 1), (1, 2), (2, 3), (4, 5), (5, 6), (7, 8), (8, 9)], [(0, 2), (1, 3), (4, 6), (7, 9)]]
    for lag, expected in enumerate(pairs):
        products = sum(residuals[:, i] * residuals[:, j] for i, j in expected)
        np.testing.assert_allclose(correlations[:, lag], products / squares, rtol=1e-9, atol=1e-12)
        # the variance of a variance from 40,000 draws: five of its standard errors
        assert correlations[:, lag].var() == pytest.approx(variances[lag], rel=0.035)


def test_at_a_draw_from_the_posterior_residuals_are_as_at_the_truth(rng):
    """Johnson (2007): a linear normal model with as many parameters as a third of its readings."""
    n, n_params, n_trials = 30, 10, 3000
    design = rng.standard_normal((n, n_params))
    covariance = np.linalg.inv(design.T @ design + np.eye(n_params))
    root = np.linalg.cholesky(covariance)
    truths = rng.standard_normal((n_trials, n_params))
    readings = truths @ design.T + rng.standard_normal((n_trials, n))
    draws = readings @ design @ covariance + rng.standard_normal((n_trials, n_params)) @ root.T
    tails = tail_probabilities(readings - draws @ design.T, np.arange(n))
    for name in ("chi_square", "largest", "drift"):
        assert stats.kstest(tails[name], "uniform").pvalue > 0.001, name


@pytest.mark.slow
def test_false_alarms_of_a_record_are_at_most_nominal(rng):
    """Three channels, 10 % so that 1000 records tell: Bonferroni keeps below it, and near it."""
    names = ("x", "y", "yaw")
    alarms = [
        not criticise(
            {name: rng.standard_normal((1, 60)) for name in names}, dict.fromkeys(names, TIMES[:60]), 0.1
        ).fits
        for _ in range(1000)
    ]
    assert 0.03 < np.mean(alarms) < 0.13  # three standard errors above


def test_planted_faults_are_named(rng):
    noise = rng.standard_normal(300)
    slow = np.zeros(300)
    for k in range(1, 300):
        slow[k] = 0.6 * slow[k - 1] + 0.8 * noise[k]
    tailed = noise * np.where(rng.random(300) < 0.04, 10.0, 1.0)
    assert found(noise) == ()
    assert found(slow)[0] == "correlated"
    assert found(noise + np.sin(TIMES / 50))[0] == "correlated"
    assert found(tailed) == ("outliers",)
    assert found(1.5 * noise) == ("large",)
    assert found(0.6 * noise) == ("small",)
    assert found(np.sign(noise)) == ("shape",)
    assert found(np.zeros(300)) == ("small",)
    assert found(100.0 * slow_waves(TIMES)[:, 3])[0] == "correlated"


def test_a_gap_is_no_fault_and_short_records_are_checked(rng):
    kept = (TIMES < 100) | (TIMES > 250)
    assert found(rng.standard_normal(kept.sum()), TIMES[kept]) == ()
    assert found(np.array([12.0]), np.array([3.0])) == ("large",)
    assert found(rng.standard_normal(4), np.arange(4.0)) == ()


def test_failed_draws_are_left_out_and_numbers_are_json(rng):
    residuals = rng.standard_normal((3, 300))
    alone = criticise({"x": residuals}, {"x": TIMES}).to_json()
    assert criticise({"x": np.vstack([residuals, np.full(300, np.nan)])}, {"x": TIMES}).to_json() == alone
    assert json.loads(json.dumps(alone)) == alone
    assert alone["n_tests"] == 6
    assert criticise({}, {}).fits
