"""Likelihoods."""

import numpy as np
from scipy import stats

from bayesub.likelihoods import gaussian


def test_gaussian_is_the_density_of_the_readings(rng):
    """The log likelihood is normalised over the readings, in their own units."""
    sds = 10.0 ** rng.uniform(-4, 2, 30)
    readings, predicted = rng.standard_normal(30), rng.standard_normal((4, 30)) * sds
    expected = stats.norm.logpdf(readings * sds, predicted, sds).sum(axis=1)
    np.testing.assert_allclose(gaussian((predicted - readings * sds) / sds, sds), expected, rtol=1e-13)


def test_failed_simulations_are_impossible(rng):
    """A member with a missing prediction has likelihood zero, and its neighbours keep theirs."""
    residuals = rng.standard_normal((3, 5))
    alone = gaussian(residuals, np.ones(5))
    residuals[1, 4] = np.nan
    np.testing.assert_array_equal(gaussian(residuals, np.ones(5)), [alone[0], -np.inf, alone[2]])
