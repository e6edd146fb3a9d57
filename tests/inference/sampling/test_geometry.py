"""Whitened and straightened coordinates."""

import numpy as np
import pytest
from support.toys import Banana, Linear, ill_conditioned

from bayesub.inference.baselines import gauss_newton
from bayesub.inference.sampling.geometry import Bend, Geometry, draws_like
from bayesub.inference.sampling.polynomial import PLAIN, Polynomials, n_features
from bayesub.problem.priors import Normal, Uniform


@pytest.fixture
def bent_geometry(rng):
    """A geometry with arbitrary bends in two blocks of its six coordinates, and two active directions of each."""
    problem, _ = ill_conditioned()
    geometry = Geometry.whitened(problem, problem.mean)
    for start, stop in ((0, 1), (1, 3)):
        n_after = 6 - stop
        active = np.linalg.qr(rng.standard_normal((n_after, 2)))[0]
        factor = np.tril(rng.standard_normal((stop - start, stop - start)), -1) + 1.5 * np.eye(stop - start)
        coefficients = 0.3 * rng.standard_normal((n_features(n_after, 2), stop - start))
        linear, bent = coefficients[: 1 + n_after], coefficients[1 + n_after :]
        polynomials = Polynomials(active, linear, bent, np.eye(stop - start), PLAIN, np.ones(len(bent), dtype=bool))
        geometry.bends.append(Bend(start, stop, polynomials, factor))
    return geometry


def test_bend_map_is_triangular_with_constant_jacobian(bent_geometry, rng):
    """A block depends on those after it, and the determinant is that of the factors wherever one looks."""
    for y in rng.standard_normal((5, 6)):
        offsets = 1e-3 * np.eye(6)
        # The map is a polynomial of degree nine: central differences at 1e-3 and the half of it, extrapolated, leave
        # 1e-8 of its size.
        slopes = [
            (bent_geometry.bent(y + h * offsets) - bent_geometry.bent(y - h * offsets)).T / (2e-3 * h) for h in (1, 0.5)
        ]
        jacobian = (4 * slopes[1] - slopes[0]) / 3
        np.testing.assert_array_equal(np.tril(jacobian, -1)[[1, 3, 4, 5]], 0.0)
        np.testing.assert_array_equal(jacobian[2, 0], 0.0)
        assert np.linalg.det(jacobian) == pytest.approx(1.5**3, rel=1e-6)
        assert np.abs(np.triu(jacobian, 1)).max() > 0.1


def test_straightening_inverts_bending(bent_geometry, rng):
    """y -> z -> y and z -> y -> z lead back."""
    y = rng.standard_normal((20, 6))
    np.testing.assert_allclose(bent_geometry.straightened(bent_geometry.bent(y)), y, atol=1e-11)
    np.testing.assert_allclose(bent_geometry.bent(bent_geometry.straightened(y)), y, atol=1e-11)


def test_gradient(bent_geometry, rng):
    """Of the log posterior, through bends, prior and likelihood: against extrapolated central differences."""
    problem, _ = ill_conditioned()
    for y in rng.standard_normal((5, 6)):
        offsets = 1e-3 * np.eye(6)
        slopes = [
            (bent_geometry.log_prob(problem, y + h * offsets) - bent_geometry.log_prob(problem, y - h * offsets))
            / (2e-3 * h)
            for h in (1, 0.5)
        ]
        value, gradient = bent_geometry.with_gradient(problem, y)
        assert value == pytest.approx(bent_geometry.log_prob(problem, y[None])[0], rel=1e-12)
        np.testing.assert_allclose(
            gradient, (4 * slopes[1] - slopes[0]) / 3, rtol=1e-5, atol=1e-5 * np.abs(gradient).max()
        )


def test_whitening_turns_the_laplace_approximation_into_a_standard_normal():
    """Without bends the log posterior of a linear problem is -|y|^2 / 2, to the last null direction."""
    problem, _ = ill_conditioned()
    geometry = Geometry.whitened(problem, problem.mean)
    np.testing.assert_allclose(
        geometry.basis @ geometry.basis.T,
        problem.covariance / np.outer(problem.prior.sd, problem.prior.sd),
        atol=1e-9,  # round-off of an inverse of condition 1e6
    )
    y = np.random.default_rng(0).standard_normal((50, 6))
    difference = geometry.log_prob(problem, y) - geometry.log_prob(problem, np.zeros((1, 6)))
    np.testing.assert_allclose(difference, -0.5 * np.sum(y**2, axis=1), atol=1e-7)


def test_active_directions_are_those_of_the_quadratic():
    """Of the banana the sheet bends along x0 alone, which is the second whitened coordinate at its mode."""
    problem = Banana()
    geometry = Geometry.whitened(problem, gauss_newton(problem).values)
    geometry.find_active(problem, np.random.default_rng(0))
    slopes = problem.prior.sd[:, None] * geometry.basis
    # d(slope) / d(parameters) is 2 / width along x0 and zero along x1.
    expected = np.array([1.0, 0.0]) @ slopes
    assert geometry.active.shape[1] == 1
    assert abs(geometry.active[:, 0] @ expected) == pytest.approx(np.linalg.norm(expected), rel=1e-9)


def test_straight_problems_have_no_active_directions():
    """A linear problem has nothing to bend along."""
    problem, _ = ill_conditioned()
    geometry = Geometry.whitened(problem, problem.mean)
    geometry.find_active(problem, np.random.default_rng(0))
    assert geometry.active.shape == (6, 0)


def test_draws_stay_within_the_support(rng):
    """Draws of the Laplace approximation within bounds are those of the normal cut off there."""
    problem = Banana()
    problem.prior = Uniform(np.array([-1.0, -3.0]), np.array([2.0, 3.0]))
    geometry = Geometry.whitened(problem, np.array([0.0, 0.0]))
    y = geometry.draws(np.random.default_rng(1), 4000)
    assert np.isfinite(problem.prior.log_density(geometry.parameters(y))).all()
    plain = rng.standard_normal((40000, 2))
    plain = plain[np.isfinite(problem.prior.log_density(geometry.parameters(plain)))]
    # Both means have standard errors below 0.016; 4 of them, and the draws start at the mode a hundred sweeps ago.
    np.testing.assert_allclose(y.mean(axis=0), plain.mean(axis=0), atol=0.08)
    np.testing.assert_allclose(y.std(axis=0), plain.std(axis=0), atol=0.06)


@pytest.mark.parametrize("missing", [[], [1], [0, 3]])
def test_draws_like_those_of_some_parameters_are_draws_of_all(rng, missing):
    """From exact draws of some parameters come draws of the whole normal posterior, standard normal in y."""
    matrix = rng.standard_normal((9, 4)) * [1.0, 30.0, 2.0, 0.1]
    problem = Linear(matrix, rng.standard_normal(9), Normal(np.ones(4), np.array([1.0, 0.5, 20.0, 3.0])))
    geometry = Geometry.whitened(problem, problem.mean)
    known = rng.multivariate_normal(problem.mean, problem.covariance, 20_000)
    known[:, missing] = np.nan
    y = draws_like(geometry, known, rng, 10_000)
    # Standard errors of means and of covariances are 0.01 and, on the diagonal, 0.014, of draws without replacement.
    np.testing.assert_allclose(y.mean(axis=0), 0.0, atol=0.06)
    np.testing.assert_allclose(np.cov(y.T), np.eye(4), atol=0.08)
    exact = problem.prior.scaled(geometry.parameters(y))
    given = problem.prior.scaled(known)
    kept = np.setdiff1d(np.arange(4), missing)
    assert set(np.round(exact[:, kept[0]], 9)) <= set(np.round(given[:, kept[0]], 9))


def test_draws_like_others_stay_within_the_support(rng):
    """And where most of those are outside, the Laplace approximation is drawn from."""
    problem = Banana()
    problem.prior = Uniform(np.array([-1.0, -3.0]), np.array([2.0, 3.0]))
    geometry = Geometry.whitened(problem, np.array([0.0, 0.0]))
    far = np.column_stack([np.full(500, -1.5), np.full(500, np.nan)])
    for known in (np.column_stack([rng.uniform(-1.2, 2.0, 500), np.full(500, np.nan)]), far):
        y = draws_like(geometry, known, rng, 400)
        assert y.shape == (400, 2)
        assert np.isfinite(geometry.log_prior(y)).all()
    assert abs(geometry.parameters(y)[:, 0].mean()) < 0.5


def test_a_stored_geometry_is_the_same_map(bent_geometry, rng):
    """Restored from its arrays it gives the same parameters, bit for bit."""
    restored = Geometry.restored(bent_geometry.prior, bent_geometry.arrays())
    y = rng.standard_normal((50, bent_geometry.n_params))
    assert len(restored.bends) == len(bent_geometry.bends) > 0
    np.testing.assert_array_equal(restored.parameters(y), bent_geometry.parameters(y))
