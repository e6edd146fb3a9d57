"""Treatments of rounded readings over repeated trials."""

import numpy as np
import pytest

import bayesub as bs
from rounded import readings, tables
from thesis.coverage import RepeatedTrials
from thesis.prior_trials import PriorTrials

PRIOR = bs.priors.relative_normal(0.25)
HELD = ["Yvdot", "Nvdot", "Nrdot"]


def trials(sensors):
    return PriorTrials("npsauv", "horizontal", sensors, free=bs.coefficients.NAMES, prior=PRIOR, dt=0.5)


@pytest.fixture(scope="module")
def rounded():
    return trials(bs.sensors.thesis_rounding(velocity_sd_mps=1e-3, acceleration_sd_mps2=1e-4))


def test_linear_least_squares_on_fine_readings(rng):
    """With hardly any noise and no rounding the linear fit gives the truth that was drawn, the held ones given."""
    fine = bs.sensors.autosub(
        velocity_sd_mps=1e-12,
        velocity_resolution_mps=0.0,
        acceleration_sd_mps2=1e-12,
        attitude_sd_deg=1e-10,
        rate_sd_degps=1e-11,
        angular_acceleration_sd_degps2=1e-11,
    )
    truth, problem, _ = trials(fine).trial(rng)
    estimate, places = readings.linear_fit(truth, problem, HELD)
    assert set(estimate.names) | set(HELD) == set(problem.names)
    errors = np.abs(estimate.values / truth[places] - 1)
    # Noise of 1e-12 of the motion, times the 1e6 or so by which the most collinear columns amplify it.
    assert errors.max() < 1e-5


def test_largest_ratio(rng):
    """The direction in which one covariance exceeds another the most is found whatever their scales."""
    root = rng.standard_normal((4, 4)) * 10.0 ** np.arange(4)[:, None]
    covariance = root @ root.T
    stretched = root @ np.diag([1.0, 9.0, 0.25, 1.0]) @ root.T
    assert readings.largest_ratio(stretched, covariance) == pytest.approx(9.0, rel=1e-9)


def test_summary(rounded):
    """A constant error of one sd is the bias, in sd and over the truth, of every coefficient."""
    problem = rounded.problem
    sds = 0.1 * problem.prior.sd
    repeated = RepeatedTrials(np.tile(sds, (5, 1)), np.tile(np.diag(sds**2), (5, 1, 1)))
    result = readings.summary(repeated, problem.names, rounded.boat.xi)
    np.testing.assert_allclose(result["bias_in_sd"], 1.0)
    np.testing.assert_allclose(result["bias_over_truth"], 0.025, rtol=1e-3)
    assert set(result["coverage_95"]) == {1.0}
    assert set(result["coverage_50"]) == {0.0}
    assert result["joint"] == pytest.approx(1.0)


def test_comparisons_and_their_tables(rounded, rng):
    """Two trials of each comparison: searches end where they should, and every table has its rows."""
    case = readings.compare(rounded, rng, 2, 1, HELD)
    assert case["converged"] == case["found_from_centre"] == 1.0
    assert case["n_params"] == len(case["fits"]["rounded"]["names"]) == len(case["fits"]["linear"]["names"]) + 3
    determined = readings.determined(rounded.problem, 0.5)
    assert 0 < determined.sum() < len(determined)
    cell = readings.compare_widths(rounded, rng, 2, determined)
    # Rounding errors of a hundredth m/s hardly matter beside what a reading a second leaves unknown.
    assert 0.9 < cell["width_ratio"] < 1.1
    assert cell["largest_width_ratio"] >= cell["width_ratio"]
    sampled = {"shift_in_sd": [0.1], "sd_ratio": [1.0], "shortcomings": [], "seconds": 1.0}
    grid = [{"ratio": 10.0, "interval_s": 1.0} | cell]
    lines = "\n".join(tables.tables({"cases": {"one": case}, "grid": grid, "sampled": {"two": sampled}}))
    rows = [line for line in lines.splitlines() if line.startswith("| ")]
    assert len(rows) == (2 + 3 + 3) + (2 + 1) + (2 + 1) + (2 + 1)
