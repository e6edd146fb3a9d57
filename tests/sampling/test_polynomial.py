"""Polynomials with products in few directions."""

import numpy as np

from bayesub.sampling.polynomial import CUBIC, features, n_features, pullback_at, values


def directions(rng, n_params, n_active):
    return np.linalg.qr(rng.standard_normal((n_params, n_active)))[0]


def test_features_are_the_monomials(rng):
    """One, the coordinates, products of two components and of three: by hand for two active directions."""
    z, active = rng.standard_normal((4, 3)), directions(rng, 3, 2)
    a, b = (z @ active).T
    expected = [np.ones(4), *z.T, a * a, a * b, b * b, a**3, a * a * b, a * b * b, b**3]
    np.testing.assert_allclose(features(z, active), np.transpose(expected), rtol=1e-13)


def test_cubes_are_of_the_first_directions_only(rng):
    """Of ten directions all fifty-five products of two, and of three those of the first eight."""
    z, active = rng.standard_normal((5, 12)), directions(rng, 12, 10)
    assert CUBIC == 8
    assert features(z, active).shape == (5, n_features(12, 10)) == (5, 1 + 12 + 55 + 120)
    along = z @ active
    np.testing.assert_allclose(features(z, active)[:, 1 + 12 + 54], along[:, 9] ** 2, rtol=1e-13)
    np.testing.assert_allclose(features(z, active)[:, -1], along[:, 7] ** 3, rtol=1e-13)


def test_values_are_sums_over_the_features(rng):
    """As many places as do not fit into one batch, in memory in either order."""
    z, active = rng.standard_normal((12, 150)).T, directions(rng, 12, 10)
    coefficients = rng.standard_normal((n_features(12, 10), 4))
    found = values(z, active, coefficients)
    np.testing.assert_allclose(found, features(z, active) @ coefficients, rtol=1e-12, atol=1e-12)
    assert values(z[:0], active, coefficients).shape == (0, 4)
    np.testing.assert_allclose(
        values(z[:, ::2], active[::2], coefficients[: n_features(6, 10)]),
        features(z[:, ::2], active[::2]) @ coefficients[: n_features(6, 10)],
        rtol=1e-11,
        atol=1e-11,
    )


def test_pullback_is_the_gradient(rng):
    """Central differences of a cubic are off by third order alone: extrapolated, by round-off."""
    z, active = rng.standard_normal((70, 12)), directions(rng, 12, 10)
    coefficients, slopes = rng.standard_normal((n_features(12, 10), 3)), rng.standard_normal((70, 3))
    towards = rng.standard_normal(z.shape)

    def along(step):
        change = values(z + step * towards, active, coefficients) - values(z - step * towards, active, coefficients)
        return np.sum(change * slopes, axis=1) / (2 * step)

    expected = (4 * along(0.1) - along(0.2)) / 3
    gradient = pullback_at(np.ascontiguousarray(z.T), active, coefficients, np.ascontiguousarray(slopes.T)).T
    found = np.sum(gradient * towards, axis=1)
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-10)
