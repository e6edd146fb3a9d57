"""Deterministic fits."""

import numpy as np
import pytest
from toys import Banana, Linear, ill_conditioned

import bayesub as bs
from bayesub.baselines import gauss_newton, linear_least_squares, sqp
from bayesub.coefficients import HORIZONTAL, INDEX, columns
from bayesub.priors import Normal
from bayesub.problem import LinearSystem, linear_systems


def test_linear_least_squares_recovers_the_truth(spiral_track, suboff):
    """On data without noise all coefficients come back, once the added masses that are not unique are held."""
    free = [name for name in HORIZONTAL if name not in ("Yvdot", "Nvdot", "Nrdot")]
    systems = linear_systems(spiral_track, free=free)
    found = linear_least_squares(systems, {name: 1.3 * suboff.xi[k] for name, k in INDEX.items()})
    truth = suboff.xi[columns(found.names)]
    assert set(found.names) == set(free)
    assert found.statuses == ("unique",)
    # Round-off of the rows, 1e-15 of the load, over singular values down to 1e-5 of the largest: 1e-10 of the terms.
    np.testing.assert_allclose(found.values, truth, rtol=1e-9, atol=1e-12)
    assert found.costs[0] < 1e-13


def test_linear_least_squares_says_what_is_not_unique(spiral_track, suboff):
    """With every coefficient free it fits as well, and names the axes that lack rank."""
    found = linear_least_squares(linear_systems(spiral_track), {name: 1.3 * suboff.xi[k] for name, k in INDEX.items()})
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


def test_gauss_newton_finds_the_mode_of_a_linear_problem():
    """In one step: mean and covariance of the posterior are the closed form, null direction included."""
    problem, null = ill_conditioned()
    found = gauss_newton(problem)
    sd = np.sqrt(np.diag(problem.covariance))
    assert np.abs((found.values - problem.mean) / sd).max() < 1e-3  # its tolerance
    np.testing.assert_allclose(found.covariance / np.outer(sd, sd), problem.covariance / np.outer(sd, sd), atol=1e-8)
    whitened = found.covariance / np.outer(problem.prior.sd, problem.prior.sd)
    assert null @ whitened @ null == pytest.approx(1.0, rel=1e-9)
    assert found.statuses == ("converged",)


def test_gauss_newton_from_a_bad_start():
    """Damping leads along the bend of a thin valley to its mode."""
    found = gauss_newton(Banana(), start=[3.0, 2.0])
    np.testing.assert_allclose(found.values, 0.0, atol=1e-3)
    assert found.statuses[0].startswith("converged")


def test_gauss_newton_with_fewer_readings_than_parameters():
    """The prior makes the mode unique also then, and its directions keep their variance."""
    prior = Normal(np.array([1.0, -2.0, 0.5]), np.array([0.5, 1.0, 2.0]))
    problem = Linear(np.array([[1.0, 2.0, -1.0]]), np.array([3.0]), prior)
    found = gauss_newton(problem, start=prior.mean + prior.sd)
    np.testing.assert_allclose(found.values, problem.mean, atol=1e-3)
    np.testing.assert_allclose(found.covariance, problem.covariance, rtol=1e-12)


def test_gauss_newton_reports_a_limit_and_a_failed_start():
    """It says when it stopped short, and refuses to start from a simulation that fails."""
    assert "stopped after 1 iterations" in gauss_newton(Banana(), start=[3.0, 2.0], max_iterations=1).statuses[0]
    with pytest.raises(ValueError, match="fails at the start"):
        gauss_newton(Banana(), start=[np.nan, 0.0])


def test_gauss_newton_recovers_a_boat(suboff, spiral, spiral_track):
    """From the record of a spiral it finds coefficients that explain it, and whose posterior holds the truth."""
    record = bs.observe(spiral_track, bs.sensors.Track(0.5, 0.1, 2.0, ("x", "y", "yaw")), np.random.default_rng(8))
    centre = bs.priors.perturbed(suboff.xi, 0.2, np.random.default_rng(9))
    prior = bs.priors.relative_normal(0.25, centre)
    problem = bs.Problem(suboff, spiral, record, free=HORIZONTAL, prior=prior, dt=1.0)
    found = gauss_newton(problem)
    assert found.statuses[0].startswith("converged")
    residuals = problem.residuals(found.values[None])[0]
    assert residuals @ residuals < len(residuals) + 4 * np.sqrt(2 * len(residuals))
    off = found.values - suboff.xi[problem.columns]
    chi2 = off @ np.linalg.solve(found.covariance, off)
    # 21 degrees of freedom; the Laplace approximation is an approximation, so three times the sd of chi2 from its mean.
    assert chi2 < 21 + 3 * np.sqrt(42)


@pytest.fixture
def overdetermined(rng):
    """A linear problem in three unknowns with noise, whose guess is 5 % off."""
    truth = np.array([1.0, -2e-3, 30.0])
    matrix = rng.standard_normal((40, 3)) / truth
    guess = 1.05 * truth
    return Linear(matrix, matrix @ truth + 0.01 * rng.standard_normal(40), Normal(guess, 0.25 * np.abs(guess)))


def test_sqp_minimises_the_residuals(overdetermined):
    """Every start ends at the least-squares solution; the best comes first."""
    problem = overdetermined
    found = sqp(problem, rng=np.random.default_rng(1), n_starts=3)
    best = np.linalg.lstsq(problem.matrix, problem.readings)[0]
    # SLSQP stops when the logarithm of the cost changes by 1e-10: the unknowns are good to about its square root.
    np.testing.assert_allclose(found.solutions, np.tile(best, (3, 1)), rtol=1e-4)
    assert np.all(np.diff(found.costs) >= 0)
    assert found.costs[0] == pytest.approx(np.sum(problem.residuals(found.values[None]) ** 2), rel=1e-9)
    assert found.evaluations > 0


def test_sqp_keeps_to_its_bounds_and_seed(overdetermined):
    """Solutions stay within the bounds about the guess, and the same seed gives the same answer."""
    narrow = [
        sqp(overdetermined, rng=np.random.default_rng(1), n_starts=2, start_spread=0.01, bounds=0.02) for _ in "ab"
    ]
    assert np.abs(narrow[0].solutions / overdetermined.prior.mean - 1).max() <= 0.02 + 1e-9
    np.testing.assert_array_equal(narrow[0].solutions, narrow[1].solutions)
