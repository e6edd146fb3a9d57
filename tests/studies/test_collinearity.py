"""Collinearity of regressors: that of regression, and of planted relations."""

import numpy as np
import pytest

from bayesub.model.linear_form import LinearSystem
from ill_conditioning.collinearity import collinearity


@pytest.fixture
def system(rng):
    """Five regressors of very different size, of which b and d nearly cancel."""
    matrix = rng.standard_normal((300, 5)) + 0.5
    matrix[:, 3] = -matrix[:, 1] + 1e-3 * rng.standard_normal(300)
    return LinearSystem("Y", tuple("abcde"), matrix * 10.0 ** np.arange(-4, 6, 2), np.zeros(300))


def r_squared(matrix, k):
    """R^2 about zero of regressing column k on the others."""
    others = np.delete(matrix, k, axis=1)
    rest = matrix[:, k] - others @ np.linalg.lstsq(others, matrix[:, k], rcond=None)[0]
    return 1.0 - (rest @ rest) / (matrix[:, k] @ matrix[:, k])


def test_variance_inflation_is_that_of_regression(system):
    """VIF = 1 / (1 - R^2), column by column."""
    found = collinearity(system)
    scaled = system.matrix / np.linalg.norm(system.matrix, axis=0)
    expected = [1.0 / (1.0 - r_squared(scaled, k)) for k in range(5)]
    # The residual of the regression is known to round-off over itself, here 1e-16 / 1e-3, and enters squared.
    np.testing.assert_allclose(found.vif, expected, rtol=1e-9)


def test_correlation_is_a_cosine(system):
    """Between columns as they are: no mean is taken off, and scale does not matter."""
    a, b = system.matrix[:, 0], system.matrix[:, 1]
    found = collinearity(system).correlation
    assert found[0, 1] == pytest.approx(a @ b / np.sqrt((a @ a) * (b @ b)), abs=1e-14)
    np.testing.assert_allclose(np.diag(found), 1.0, rtol=1e-14)
    assert found[1, 3] < -0.999


def test_variance_proportions_find_the_planted_dependency(system):
    """One condition index beyond 30, and it carries the variance of b and d but not of the others."""
    found = collinearity(system)
    np.testing.assert_allclose(found.proportions.sum(axis=0), 1.0, rtol=1e-12)
    assert np.all(np.diff(found.condition_indices) >= 0)
    assert found.condition_indices[0] == 1.0
    assert np.count_nonzero(found.condition_indices > 30) == 1
    assert set(found.involved(-1)) == {"b", "d"}
    assert found.proportions[-1, [1, 3]].min() > 0.999
    assert found.proportions[-1, [0, 2, 4]].max() < 0.1


def test_an_exact_relation_is_not_collinearity(system):
    """A null vector makes its columns' inflation infinite and leaves the indices of the rest as they were."""
    matrix = np.column_stack([system.matrix, 3.0 * system.matrix[:, 0] - system.matrix[:, 4]])
    found = collinearity(LinearSystem("Y", tuple("abcdef"), matrix, system.load), [{"a": 3.0, "e": -1.0, "f": -1.0}])
    np.testing.assert_array_equal(np.isinf(found.vif), [True, False, False, False, True, True])
    assert len(found.condition_indices) == 5
    assert set(found.involved(-1)) == {"b", "d"}
    np.testing.assert_allclose(found.vif[1:4], collinearity(system).vif[1:4], rtol=1e-9)
