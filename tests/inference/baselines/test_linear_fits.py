"""Fits of the equations of motion: least squares, total least squares, linear programming."""

import importlib
import itertools

import numpy as np
import pytest
from scipy.optimize import OptimizeResult
from support.refusals import refused

from bayesub.inference.baselines import Estimate, linear_least_squares, linear_programme
from bayesub.model.coefficients import HORIZONTAL, INDEX, columns
from bayesub.model.linear_form import LinearSystem, linear_systems
from rounding.total_least_squares import total_least_squares

linear_programme_module = importlib.import_module("bayesub.inference.baselines.linear_programme")
HELD = ("Yvdot", "Nvdot", "Nrdot")


@pytest.fixture(scope="module")
def guess(suboff):
    return {name: 1.3 * suboff.xi[k] for name, k in INDEX.items()}


@pytest.fixture
def planted(rng):
    """Two axes with columns of very different size: systems, truth and a guess 20 % off."""
    truth = {"a": 1.0, "b": -2e-4, "c": 30.0, "d": 5e3, "e": -0.7}
    systems = {}
    for axis, names in (("Y", ("a", "b", "c")), ("N", ("d", "e"))):
        values = np.array([truth[name] for name in names])
        matrix = rng.standard_normal((200, len(names))) / values
        systems[axis] = LinearSystem(axis, names, matrix, matrix @ values)
    return systems, truth, {name: 1.2 * value for name, value in truth.items()}


def noisy(systems, sd, rng):
    """The same systems with normal noise in their loads."""
    return {
        axis: LinearSystem(axis, s.names, s.matrix, s.load + sd * rng.standard_normal(len(s.load)))
        for axis, s in systems.items()
    }


def test_linear_least_squares_recovers_the_truth(spiral_track, suboff, guess):
    """On data without noise all coefficients come back, once the added masses that are not unique are held."""
    free = [name for name in HORIZONTAL if name not in HELD]
    systems = linear_systems(spiral_track, free=free)
    found = linear_least_squares(systems, guess)
    truth = suboff.xi[columns(found.names)]
    assert set(found.names) == set(free)
    assert found.statuses == ("unique",)
    # Round-off of the rows, 1e-15 of the load, over singular values down to 1e-5 of the largest: 1e-10 of the terms.
    np.testing.assert_allclose(found.values, truth, rtol=1e-9, atol=1e-12)
    assert found.costs[0] < 1e-13


def test_linear_least_squares_says_what_is_not_unique(spiral_track, guess):
    """With every coefficient free it fits as well, and names the axes that lack rank."""
    found = linear_least_squares(linear_systems(spiral_track), guess)
    assert found.costs[0] < 1e-13
    assert found.statuses[0].startswith("not unique: Y rank 8/9, N rank 8/10")


def test_along_null_directions_the_answer_is_the_guess(rng):
    """What the data do not determine stays where it was guessed, and the rest is determined all the same."""
    matrix, null = rng.standard_normal((50, 3)), np.array([1.0, 1.0, -1.0]) / np.sqrt(3)
    matrix -= np.outer(matrix @ null, null)
    matrix /= np.linalg.norm(matrix, axis=0)
    truth, guess = np.array([1.0, 2.0, 3.0]), np.array([5.0, -1.0, 2.0])
    null = np.linalg.svd(matrix)[2][-1]
    system = LinearSystem("Y", ("a", "b", "c"), matrix, matrix @ truth)
    found = linear_least_squares({"Y": system}, dict(zip("abc", guess, strict=True))).values
    np.testing.assert_allclose(found, truth + null * (null @ (guess - truth)), rtol=1e-13)


FITS = (linear_least_squares, total_least_squares, linear_programme)


@pytest.mark.parametrize("fit", FITS)
def test_planted_answers_come_back(fit, planted):
    """Without noise every fit finds the truth, whatever the size of the columns."""
    systems, truth, guess = planted
    found = fit(systems, guess)
    np.testing.assert_allclose(found.values, [truth[name] for name in found.names], rtol=1e-11)
    assert found.evaluations == 0


@pytest.mark.parametrize("fit", FITS)
def test_held_coefficients_move_to_the_load(fit, planted):
    """Held at the truth they change nothing; held elsewhere the others give way as if the load had been another."""
    systems, truth, guess = planted
    found = fit(systems, guess | {"b": truth["b"], "d": truth["d"], "e": truth["e"]}, held=("b", "d", "e"))
    assert found.names == ("a", "c")
    np.testing.assert_allclose(found.values, [truth["a"], truth["c"]], rtol=1e-11)
    elsewhere = fit(systems, guess, held=("b", "d", "e")).values
    y = systems["Y"]
    moved = {"Y": LinearSystem("Y", ("a", "c"), y.matrix[:, [0, 2]], y.load - y.matrix[:, 1] * guess["b"])}
    np.testing.assert_allclose(elsewhere, fit(moved, guess).values, rtol=1e-7)


def test_standard_errors_are_the_classical_ones(planted, rng):
    """The covariance is sigma^2 (A'A)^-1 of each axis with the unbiased sigma; its intervals cover."""
    systems, truth, guess = planted
    trials = [noisy(systems, 0.05, rng) for _ in range(400)]
    found = [linear_least_squares(trial, guess) for trial in trials]
    normal = systems["Y"].matrix.T @ systems["Y"].matrix
    residuals = trials[0]["Y"].load - systems["Y"].matrix @ found[0].values[:3]
    expected = residuals @ residuals / (200 - 3) * np.linalg.inv(normal)
    np.testing.assert_allclose(found[0].covariance[:3, :3], expected, rtol=1e-9)
    assert not found[0].covariance[:3, 3:].any()
    standardised = [
        (f.values - [truth[name] for name in f.names]) / np.sqrt(np.diag(f.covariance)) for f in found
    ]  # (400, 5)
    # 2000 draws of a normal: 1.96 sd hold 95 % of them to 3.5 binomial standard errors.
    assert np.mean(np.abs(standardised) < 1.96) == pytest.approx(0.95, abs=3.5 * np.sqrt(0.95 * 0.05 / 2000))


def test_total_least_squares_is_the_smallest_correction(rng):
    """No other solution asks for smaller errors of matrix and load: |A x - b|^2 / (1 + |x|^2)."""
    matrix, x = rng.standard_normal((60, 3)), np.array([1.0, -2.0, 0.5])
    system = LinearSystem(
        "X", ("a", "b", "c"), matrix + 0.1 * rng.standard_normal((60, 3)), matrix @ x + 0.1 * rng.standard_normal(60)
    )
    errors = {"X": np.full(4, 0.1)}
    found = total_least_squares({"X": system}, dict.fromkeys("abc", 3.0), errors=errors).values

    def correction(x):
        return np.sum((system.matrix @ x - system.load) ** 2) / (1 + x @ x)

    for direction in np.concatenate([np.eye(3), -np.eye(3), rng.standard_normal((20, 3))]):
        assert correction(found) < correction(found + 1e-4 * direction)


def test_total_least_squares_is_unbiased_where_least_squares_is_not(rng):
    """Errors of known size in one of two columns shrink the ordinary estimate by 1 / (1 + noise / signal)."""
    n, truth = 4000, np.array([2.0, -1.0])
    matrix = rng.standard_normal((n, 2))
    measured = matrix + [0.5, 0.0] * rng.standard_normal((n, 2))
    system = LinearSystem("Z", ("a", "b"), measured, matrix @ truth + 0.1 * rng.standard_normal(n))
    ordinary = linear_least_squares({"Z": system}, {"a": 1.0, "b": 1.0})
    mixed = total_least_squares({"Z": system}, {"a": 1.0, "b": 1.0}, errors={"Z": [0.5, 0.0, 0.1]})
    # Standard errors are about 1 / sqrt(4000) = 0.016 a coefficient; four of them.
    np.testing.assert_allclose(ordinary.values, [2.0 / 1.25, -1.0], atol=0.065)
    np.testing.assert_allclose(mixed.values, truth, atol=0.065)
    assert abs(ordinary.values[0] - 2.0) > 0.3


def test_total_least_squares_with_exact_columns_is_least_squares(planted, rng):
    """With errors in the load only, total is ordinary."""
    systems, _, guess = planted
    trial = noisy(systems, 0.1, rng)
    errors = {"Y": [0, 0, 0, 0.1], "N": [0, 0, 0.1]}
    total = total_least_squares(trial, guess, errors=errors).values
    np.testing.assert_allclose(total, linear_least_squares(trial, guess).values, rtol=1e-12)


def test_the_linear_programme_is_minimax(rng):
    """Its largest residual is that of the best fit through every choice of n + 1 rows (Chebyshev's alternation)."""
    matrix, load = rng.standard_normal((12, 2)), rng.standard_normal(12)
    found = linear_programme({"K": LinearSystem("K", ("a", "b"), matrix, load)}, {"a": 0.3, "b": -0.4})
    residuals = np.abs(matrix @ found.values - load)
    best = 0.0
    for rows in itertools.combinations(range(12), 3):
        # The minimax residual of three rows in two unknowns is |y'b| / |y|_1 with y'A = 0.
        y = np.linalg.svd(matrix[list(rows)].T)[2][-1]
        best = max(best, abs(y @ load[list(rows)]) / np.abs(y).sum())
    assert residuals.max() == pytest.approx(best, rel=1e-9)
    assert np.sum(residuals > best * (1 - 1e-9)) == 3
    assert found.costs[0] == pytest.approx(best / np.abs(load).max(), rel=1e-9)


def test_the_linear_programme_keeps_bounds_and_constraints(planted):
    """A bound and a linear constraint that exclude the truth are active at the answer; those that do not are idle."""
    systems, _, guess = planted
    free = linear_programme(systems, guess).values
    idle = linear_programme(systems, guess, bounds={"a": (0.0, 2.0)}, constraints=[({"d": 1.0, "e": 1.0}, 1e5)])
    np.testing.assert_allclose(idle.values, free, rtol=1e-10)
    found = linear_programme(systems, guess, bounds={"b": (None, -2.2e-4)}, constraints=[({"d": 1.0, "e": 10.0}, 4e3)])
    values = dict(zip(found.names, found.values, strict=True))
    assert values["b"] == pytest.approx(-2.2e-4, rel=1e-9)
    assert values["d"] + 10 * values["e"] == pytest.approx(4e3, rel=1e-9)


def test_the_linear_programme_says_what_is_wrong(planted):
    """Limits that exclude each other are named with a remedy, and a constraint across axes is refused."""
    systems, _, guess = planted
    found = linear_programme(systems, guess, bounds={"a": (2.0, 3.0)}, constraints=[({"a": 1.0}, 1.0)])
    assert found.statuses[0].startswith("Y: ")
    assert "relax bounds or constraints" in found.statuses[0]
    assert np.isinf(found.costs[0])
    with refused("conflict", "constraints"):
        linear_programme(systems, guess, constraints=[({"a": 1.0, "d": 1.0}, 1.0)])


def test_the_linear_programme_of_a_boat(spiral_track, suboff, guess):
    """Six correct digits from 6,001 samples of the spiral, the added masses held (thesis section 9.3)."""
    true_masses = {name: suboff.xi[INDEX[name]] for name in HELD}
    found = linear_programme(linear_systems(spiral_track), guess | true_masses, held=HELD)
    truth = suboff.xi[columns(found.names)]
    present = truth != 0
    np.testing.assert_allclose(found.values[present], truth[present], rtol=1e-6)
    assert found.statuses == ("optimal",)


@pytest.mark.parametrize("fit", FITS)
def test_an_estimate_survives_its_file(fit, planted):
    """to_json and from_json are inverse, with and without covariance and starts."""
    systems, _, guess = planted
    found = fit(systems, guess)
    again = Estimate.from_json(found.to_json())
    assert again.to_json() == found.to_json()
    assert again.starts is None


def test_the_linear_programme_falls_back_to_the_simplex(planted, monkeypatch):
    """Where the interior point method gives up, as it does for rounding's sake, the answer is the same."""
    systems, truth, guess = planted
    linprog = linear_programme_module.optimize.linprog

    def without_interior_point(*arguments, method, **options):
        if method == "highs-ipm":
            return OptimizeResult(x=None, status=4, message="HiGHS Status 15: Unknown")
        return linprog(*arguments, method=method, **options)

    monkeypatch.setattr(linear_programme_module.optimize, "linprog", without_interior_point)
    solution = linear_programme(systems, guess)
    assert solution.statuses == ("optimal",)
    np.testing.assert_allclose(solution.values, [truth[name] for name in solution.names], rtol=1e-11)


def test_a_guess_is_not_a_solution(planted, monkeypatch):
    """An axis that no method solves has no values, an infinite cost and a status that names it; the others have."""
    systems, truth, guess = planted
    infeasible = linear_programme(systems, guess, bounds={"a": (2.0, 3.0)}, constraints=[({"a": 1.0}, 1.0)])
    assert np.isnan(infeasible.values[:3]).all()
    np.testing.assert_allclose(infeasible.values[3:], [truth["d"], truth["e"]], rtol=1e-11)

    failure = OptimizeResult(x=None, status=4, message="HiGHS Status 15: Unknown")
    monkeypatch.setattr(linear_programme_module.optimize, "linprog", lambda *_, **__: failure)
    failed = linear_programme(systems, guess)
    assert np.isnan(failed.values).all()
    assert np.isinf(failed.costs[0])
    assert failed.statuses[0].startswith("Y: no solution: HiGHS Status 15: Unknown; hold a coefficient")


def test_the_linear_programme_leaves_the_guess_along_what_is_not_determined(spiral_track, guess):
    """With every coefficient free the fit is as good, and no coefficient runs away; least squares does the same."""
    systems = linear_systems(spiral_track)
    solution, other = linear_programme(systems, guess), linear_least_squares(systems, guess)
    assert solution.statuses == ("optimal",)
    assert solution.costs[0] < 1e-12
    np.testing.assert_allclose(solution.values, other.values, rtol=1e-6, atol=1e-12)
