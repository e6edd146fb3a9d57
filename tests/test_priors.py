"""Priors."""

import numpy as np
import pytest
from scipy import stats

from bayesub import InputError
from bayesub.priors import Normal, perturbed, relative_normal


def test_log_density_is_that_of_independent_normals(rng):
    """The density is normalised and the product of the marginals."""
    prior = Normal(mean=rng.standard_normal(5), sd=10.0 ** rng.uniform(-6, 2, 5))
    points = prior.mean + prior.sd * rng.standard_normal((7, 5))
    expected = stats.norm.logpdf(points, prior.mean, prior.sd).sum(axis=1)
    np.testing.assert_allclose(prior.log_density(points), expected, rtol=1e-13)


def test_draws_follow_the_density(rng):
    """Draws have the mean and the standard deviation of the prior, and are independent."""
    prior = Normal(mean=np.array([1e-3, -2.0]), sd=np.array([1e-4, 5.0]))
    scaled = (prior.sample(rng, 20_000) - prior.mean) / prior.sd
    assert np.abs(scaled.mean(axis=0)).max() < 4 / np.sqrt(20_000)
    assert np.abs(np.cov(scaled.T) - np.eye(2)).max() < 4 * np.sqrt(2 / 20_000)


def test_relative_normal_has_the_size_of_its_centre(rng):
    """Means are the centre, standard deviations the stated fraction of its size, whatever its sign."""
    xi, centre, columns = rng.standard_normal(101), rng.standard_normal(101), np.array([3, 90, 7])
    for prior, expected in ((relative_normal(0.25), xi), (relative_normal(0.25, centre), centre)):
        normal = prior.on(columns, xi)
        np.testing.assert_array_equal(normal.mean, expected[columns])
        np.testing.assert_array_equal(normal.sd, 0.25 * np.abs(expected[columns]))


def test_perturbed_keeps_signs_and_zeros(rng):
    """A guess has the signs of the truth, also when it is off by more than its size."""
    xi = np.tile([1.0, -2.0, 0.0], 1000)
    guess = perturbed(xi, 1.5, rng)
    np.testing.assert_array_equal(np.sign(guess), np.sign(xi))
    assert perturbed(np.ones(20_000), 0.1, rng).std() == pytest.approx(0.1, rel=4 / np.sqrt(2 * 20_000))


@pytest.mark.parametrize("sd", [0.0, -0.25, np.nan, np.inf])
def test_bad_spreads(sd):
    """A prior needs a positive spread."""
    with pytest.raises(InputError, match="prior: sd must be positive"):
        relative_normal(sd)
