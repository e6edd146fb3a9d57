"""The campaign of the deterministic methods: its cost, what it says of axes without a solution, and of its starts."""

import numpy as np
import pytest

from baselines import smoothing, tables
from bayesub.inference.baselines import Estimate
from bayesub.model.linear_form import linear_systems
from thesis import optimisers
from thesis.cases import held, track_problem


def test_the_cost_is_that_of_the_thesis(suboff):
    """The sum of squared residuals is ten times sum(m^2) + sum(deg^2) over samples every second."""
    problem = track_problem(suboff, "horizontal", ("Xuu", "Nuv"))
    x = 1.02 * problem.prior.mean
    off = problem.trajectory(x).states[0, :, :6] - problem.trajectory(problem.prior.mean).states[0, :, :6]
    off[:, 3:] = np.degrees(off[:, 3:])
    assert len(off) == 600
    assert np.sum(problem.residuals(x[None]) ** 2) == pytest.approx(10.0 * np.sum(off**2), rel=1e-9)


def test_an_axis_without_solution_is_none_and_never_the_guess(suboff, spiral_track, monkeypatch):
    """Where linear programming finds nothing its errors are None, and the table names the axis."""
    solve = optimisers.linear_programme

    def fails_for_y(systems, guess, **options):
        estimate = solve(systems, guess, **options)
        lost = np.full_like(estimate.solutions, np.nan) if "Y" in systems else estimate.solutions
        return Estimate(**vars(estimate) | {"solutions": lost})

    monkeypatch.setattr(optimisers, "linear_programme", fails_for_y)
    systems = {axis: system for axis, system in linear_systems(spiral_track).items() if axis in ("X", "Y")}
    names = [name for name in ("Xuu", "Xvv", "Yuv", "Yur") if any(name in system.names for system in systems.values())]
    linear = optimisers.linear_fits(suboff, systems, held("horizontal"), names)
    lost = {name for name, error in zip(names, linear["errors"]["LP"], strict=True) if error is None}
    assert lost == {"Yuv", "Yur"}
    assert max(linear["errors"]["LLS"]) < 1e-9
    case = {"names": names, "errors": linear.pop("errors"), "linear": linear}
    assert "no solution for Y" in tables.linear_table({"suboff horizontal": case})[2]


def test_shares_are_of_the_coefficients_of_a_search():
    """Two of four further than they began in the first search, none in the second."""
    search = {"starts": [[1.1, 0.9, 1.1, 1.0], [1.1] * 4], "ratios": [[1.2, 0.95, 0.8, 1.0], [1.05] * 4]}
    np.testing.assert_array_equal(optimisers.shares_further(search), [0.5, 0.0])


def test_the_error_of_a_mean_is_that_of_its_spread(rng):
    """The interval of three values holds the true mean 95 times of 100, within four standard errors."""
    hits = 0
    for values in rng.normal(2.0, 3.0, (2000, 3)):
        mean, error = optimisers.mean_with_error(values)
        hits += abs(mean - 2.0) < error
    assert hits / 2000 == pytest.approx(0.95, abs=4 * np.sqrt(0.95 * 0.05 / 2000))


def test_regression_on_smoothed_motion_loses_what_the_best_fit_to_the_same_track_finds():
    """From a seed, so that the same numbers come again."""
    found = smoothing.smoothed("auv690", "vertical", 1)
    assert found == smoothing.smoothed("auv690", "vertical", 1)
    (lost,), (kept,) = (found[method]["off"] for method in ("smoothing", "best fit"))
    assert lost > 0.25 > kept
    assert found["best fit"]["held"][0] > 0.7 > found["smoothing"]["held"][0]
