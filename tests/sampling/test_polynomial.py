"""Polynomials with products in few directions."""

import numpy as np

from bayesub.sampling.polynomial import CUBIC, features, n_features, pullback


def directions(rng, n_params, n_active):
    return np.linalg.qr(rng.standard_normal((n_params, n_active)))[0]


def test_features_are_the_monomials(rng):
    """One, the coordinates, products of two components and of three: by hand for two active directions."""
    z, active = rng.standard_normal((4, 3)), directions(rng, 3, 2)
    a, b = (z @ active).T
    expected = [np.ones(4), *z.T, a * a, a * b, b * b, a**3, a * a * b, a * b * b, b**3]
    np.testing.assert_allclose(features(z, active), np.transpose(expected), rtol=1e-13)


def test_cubes_are_of_the_first_directions_only(rng):
    """Of ten directions all fifty-five products of two, and of three those of the first six."""
    z, active = rng.standard_normal((5, 12)), directions(rng, 12, 10)
    assert CUBIC == 6
    assert features(z, active).shape == (5, n_features(12, 10)) == (5, 1 + 12 + 55 + 56)
    along = z @ active
    np.testing.assert_allclose(features(z, active)[:, 1 + 12 + 54], along[:, 9] ** 2, rtol=1e-13)
    np.testing.assert_allclose(features(z, active)[:, -1], along[:, 5] ** 3, rtol=1e-13)


def test_pullback_is_the_gradient(rng):
    """Central differences of a cubic are off by third order alone: extrapolated, by round-off."""
    z, active = rng.standard_normal((5, 12)), directions(rng, 12, 10)
    slopes = rng.standard_normal((5, n_features(12, 10)))
    towards = rng.standard_normal(z.shape)

    def along(step):
        change = features(z + step * towards, active) - features(z - step * towards, active)
        return np.sum(change * slopes, axis=1) / (2 * step)

    expected = (4 * along(0.1) - along(0.2)) / 3
    np.testing.assert_allclose(np.sum(pullback(z, active, slopes) * towards, axis=1), expected, rtol=1e-11)
