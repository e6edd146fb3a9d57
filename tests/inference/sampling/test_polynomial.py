"""Polynomials with products in few directions, and of few combinations."""

from itertools import combinations_with_replacement
from math import comb

import numpy as np
import pytest

from bayesub.inference.sampling.polynomial import PLAIN, RICH, Polynomials, features, fitted, n_features, pullback_at


def directions(rng, n_params, n_active):
    return np.linalg.qr(rng.standard_normal((n_params, n_active)))[0]


def polynomials(rng, active, degrees, k=4, n_bent=2, share=1.0):
    """Polynomials with coefficients at random, and a share of all products."""
    n_params = len(active)
    chosen = rng.random(n_features(*active.shape, degrees) - 1 - n_params) < share
    sizes = (1 + n_params, k), (np.count_nonzero(chosen), n_bent), (n_bent, k)
    return Polynomials(active, *map(rng.standard_normal, sizes), degrees, chosen)


def of_all_terms(z, found):
    """Values of polynomials by their features."""
    products = np.zeros((len(found.chosen), found.mix.shape[1]))
    products[found.chosen] = found.bent @ found.mix
    return features(z, found.active, found.degrees) @ np.concatenate([found.linear, products])


def test_features_are_the_monomials(rng):
    """One, the coordinates, products of two, three and four components: by hand for two active directions."""
    z, active = rng.standard_normal((4, 3)), directions(rng, 3, 2)
    a, b = (z @ active).T
    expected = [np.ones(4), *z.T, a * a, a * b, b * b, a**3, a * a * b, a * b * b, b**3]
    np.testing.assert_allclose(features(z, active), np.transpose(expected), rtol=1e-13)
    expected += [a**4, a**3 * b, a * a * b * b, a * b**3, b**4]
    np.testing.assert_allclose(features(z, active, RICH), np.transpose(expected), rtol=1e-13)


@pytest.mark.parametrize("degrees", [PLAIN, RICH])
def test_higher_products_are_of_the_first_directions_only(rng, degrees):
    """Of fourteen directions all products of two, and of three and four those of the first few, in their order."""
    z, active = rng.standard_normal((5, 16)), directions(rng, 16, 14)
    along, found = z @ active, features(z, active, degrees)[:, 17:]
    expected = [
        np.prod(along[:, chosen], axis=1)
        for order, n in enumerate((14, *degrees), start=2)
        for chosen in map(list, combinations_with_replacement(range(n), order))
    ]
    assert found.shape[1] == len(expected) == sum(comb(n + o, o + 1) for o, n in enumerate((14, *degrees), start=1))
    np.testing.assert_allclose(found, np.transpose(expected), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("n_bent", "share"), [(0, 1.0), (2, 1.0), (2, 0.3)])
@pytest.mark.parametrize("degrees", [PLAIN, RICH])
def test_values_are_sums_over_the_features(rng, degrees, n_bent, share):
    """As many places as do not fit into one batch, in memory in either order; without products too, or with some."""
    z = rng.standard_normal((12, 150)).T
    found = polynomials(rng, directions(rng, 12, 10), degrees, n_bent=n_bent, share=share)
    np.testing.assert_allclose(found(z), of_all_terms(z, found), rtol=1e-11, atol=1e-10)
    np.testing.assert_allclose(found(z[:, ::-1][:, ::-1]), found(z), rtol=1e-12)
    assert found(z[:0]).shape == (0, 4)
    matrix = rng.standard_normal((4, 3))
    np.testing.assert_allclose(found.mixed(matrix)(z), found(z) @ matrix, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize(("n_bent", "share"), [(0, 1.0), (2, 1.0), (2, 0.3)])
@pytest.mark.parametrize("degrees", [PLAIN, RICH])
def test_pullback_is_the_gradient(rng, degrees, n_bent, share):
    """Central differences of a quartic are off by third order alone: extrapolated, by round-off."""
    z, slopes, towards = (rng.standard_normal((70, n)) for n in (12, 4, 12))
    found = polynomials(rng, directions(rng, 12, 10), degrees, n_bent=n_bent, share=share)

    def along(step):
        return np.sum((found(z + step * towards) - found(z - step * towards)) * slopes, axis=1) / (2 * step)

    expected = (4 * along(0.1) - along(0.2)) / 3
    gradient = pullback_at(np.ascontiguousarray(z.T), found, np.ascontiguousarray(slopes.T)).T
    np.testing.assert_allclose(np.sum(gradient * towards, axis=1), expected, rtol=1e-9, atol=1e-8)


def test_a_fit_finds_what_bends(rng):
    """Of eight values two combinations are quartic, all are linear besides, and noise is small: it finds these."""
    z, active = rng.standard_normal((3000, 6)), directions(rng, 6, 3)
    truth = polynomials(rng, active, RICH, k=8)
    noise = 0.01 * rng.standard_normal((3000, 8))
    found, misfit = fitted(z, active, truth(z) + noise, 0.1, degrees=RICH)
    assert found.mix.shape == (2, 8)
    # Each value has noise of 0.01 sd, of which the terms that are fitted take a few per cent of the variance.
    assert misfit.std() == pytest.approx(0.01, rel=0.05)
    fresh = rng.standard_normal((500, 6))
    assert np.std(found(fresh) - truth(fresh)) < 0.005
    # The control: cubics do not follow quartics.
    assert fitted(z, active, truth(z) + noise, 0.1, degrees=PLAIN)[1].std() > 0.1


def test_a_sparing_fit_finds_which_products_there_are(rng):
    """Of 1,056 products twenty: it has these, and at places that it was not fitted to is wrong by a third as much."""
    z, active = rng.standard_normal((1300, 12)), directions(rng, 12, 12)
    truth = polynomials(rng, active, RICH, share=0.02)
    values, fresh = truth(z) + 0.1 * rng.standard_normal((1300, 4)), rng.standard_normal((500, 12))
    (all_of_them, _), (found, _) = (fitted(z, active, values, 0.0, degrees=RICH, least=least) for least in (0.0, 0.3))
    np.testing.assert_array_equal(found.chosen, truth.chosen)
    assert all_of_them.chosen.all()
    assert np.std(found(fresh) - truth(fresh)) < np.std(all_of_them(fresh) - truth(fresh)) / 3.0


def test_noise_is_not_worth_products(rng):
    """Values that are straight but for noise get none, however many terms there are to fit it; flat ones neither."""
    z, active = rng.standard_normal((400, 10)), directions(rng, 10, 8)
    straight, noise = z @ rng.standard_normal((10, 5)), rng.standard_normal((400, 5))
    found, misfit = fitted(z, active, straight + noise, 0.1)
    assert found.mix.shape == (0, 5)
    np.testing.assert_allclose(
        misfit,
        straight
        + noise
        - np.linalg.lstsq(features(z, active)[:, :11], straight + noise, rcond=None)[0]
        .T.dot(features(z, active)[:, :11].T)
        .T,
        atol=1e-6,
    )
    # In units of something ten times as large a bend of the size of the noise is not worth it either.
    bend = 3.0 * (z @ active[:, :1]) ** 2
    assert fitted(z, active, straight + 0.1 * noise + bend, 0.1)[0].mix.shape == (1, 5)
    assert fitted(z, active, straight + 0.1 * noise + bend, 0.1, unit=1e4 * np.eye(5))[0].mix.shape == (0, 5)


def test_they_are_restored_bit_for_bit(rng):
    """From arrays as they are stored."""
    found, z = polynomials(rng, directions(rng, 12, 10), RICH, share=0.5), rng.standard_normal((9, 12))
    restored = Polynomials.restored(found.arrays())
    assert restored.degrees == RICH
    np.testing.assert_array_equal(restored(z), found(z))


def test_places_far_out_are_fitted_without_a_warning(rng):
    """Terms of very different sizes, as of a log that is off by many noise sds; the units of terms change no bit."""
    active = directions(rng, 4, 2)
    z, target = 2.0**10 * rng.standard_normal((400, 4)), polynomials(rng, active, PLAIN)
    found, misfit = fitted(z, active, target(z), 0.0, ridge=1e-13)
    assert np.abs(misfit).max() < 1e-6 * np.abs(target(z)).max()
    near, _ = fitted(z / 2.0**10, active, target(z), 0.0, ridge=1e-13)
    np.testing.assert_array_equal(found.linear[1:], near.linear[1:] / 2.0**10)
