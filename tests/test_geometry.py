"""Whitened and straightened coordinates."""

import numpy as np
import pytest
from toys import Banana, ill_conditioned

from bayesub.baselines import gauss_newton
from bayesub.sampling.geometry import Bend, Geometry


@pytest.fixture
def bent_geometry(rng):
    """A geometry with arbitrary bends in three of its six coordinates."""
    problem, _ = ill_conditioned()
    geometry = Geometry(problem, problem.mean)
    for i in (0, 1, 3):
        n_rest = 5 - i
        geometry.bends[i] = Bend(
            rng.standard_normal(), rng.standard_normal(n_rest), rng.standard_normal((n_rest, n_rest)), 1.5 + i
        )
    return geometry


def test_bend_map_is_triangular_with_constant_jacobian(bent_geometry, rng):
    """Coordinate i depends on those after it, and the determinant is the product of the scales wherever one looks."""
    for y in rng.standard_normal((5, 6)):
        offsets = 1e-3 * np.eye(6)
        # The map is a polynomial of degree at most eight, made steep by random bends: central differences at 1e-3
        # and the half of it, extrapolated, leave 1e-8 of its size.
        slopes = [
            (bent_geometry.bent(y + h * offsets) - bent_geometry.bent(y - h * offsets)).T / (2e-3 * h) for h in (1, 0.5)
        ]
        jacobian = (4 * slopes[1] - slopes[0]) / 3
        np.testing.assert_array_equal(np.tril(jacobian, -1), 0.0)
        assert np.linalg.det(jacobian) == pytest.approx(1.5 * 2.5 * 4.5, rel=1e-6)
        assert np.abs(np.triu(jacobian, 1)).max() > 0.1


def test_bends_are_measured_from_whitened_coordinates(bent_geometry, rng):
    """z_i = q_i(z_{i+1}, ..) + scale_i y_i, with the later coordinates already bent; the others are left alone."""
    y = rng.standard_normal((20, 6))
    z = bent_geometry.bent(y)
    for i in range(6):
        bend = bent_geometry.bends.get(i)
        expected = y[:, i] if bend is None else bend(z[:, i + 1 :]) + bend.scale * y[:, i]
        np.testing.assert_allclose(z[:, i], expected, rtol=1e-14)
    rest = z[0, 2:]
    bend = bent_geometry.bends[1]
    by_hand = bend.constant + bend.linear @ rest + rest @ bend.quadratic @ rest
    assert bend(z[:1, 2:])[0] == pytest.approx(by_hand, rel=1e-12)


def test_whitening_turns_the_laplace_approximation_into_a_standard_normal():
    """Without bends the log posterior of a linear problem is -|y|^2 / 2, to the last null direction."""
    problem, _ = ill_conditioned()
    geometry = Geometry(problem, problem.mean)
    np.testing.assert_allclose(
        geometry.basis @ geometry.basis.T,
        problem.covariance / np.outer(problem.prior.sd, problem.prior.sd),
        atol=1e-9,  # round-off of an inverse of condition 1e6
    )
    y = np.random.default_rng(0).standard_normal((50, 6))
    difference = geometry.log_prob(problem, y) - geometry.log_prob(problem, np.zeros((1, 6)))
    np.testing.assert_allclose(difference, -0.5 * np.sum(y**2, axis=1), atol=1e-7)


def test_straightening_finds_the_bend(rng):
    """In straightened coordinates the banana is nearly normal, and no longer bent."""
    problem = Banana()
    geometry = Geometry(problem, gauss_newton(problem).values)
    y = rng.standard_normal((500, 2))

    def misfit():
        """Spread of the log posterior about that of a standard normal."""
        return np.std(geometry.log_prob(problem, y) + 0.5 * np.sum(y**2, axis=1))

    before = misfit()
    geometry.straighten(problem, rng)
    assert list(geometry.bends) == [0]
    x = geometry.parameters(np.column_stack([np.zeros(9), np.linspace(-2, 2, 9)]))
    # The ridge is x1 = -x0^2 up to the pull of the prior, width^2 / 9 = 3e-4 of it.
    np.testing.assert_allclose(x[:, 1], -(x[:, 0] ** 2), atol=0.01)
    assert before > 100.0
    assert misfit() < 1.5  # left is the prior on x1 along the ridge, x0^4 / 18


def test_straight_problems_stay_straight(rng):
    """A linear problem has nothing to straighten."""
    problem, _ = ill_conditioned()
    geometry = Geometry(problem, problem.mean)
    geometry.straighten(problem, rng)
    assert geometry.bends == {}


def test_a_stored_geometry_is_the_same_map(bent_geometry, rng):
    """Restored from its arrays it gives the same parameters, bit for bit."""
    restored = Geometry.restored(bent_geometry.prior, bent_geometry.arrays())
    y = rng.standard_normal((50, bent_geometry.n_params))
    assert restored.bends.keys() == bent_geometry.bends.keys()
    np.testing.assert_array_equal(restored.parameters(y), bent_geometry.parameters(y))
