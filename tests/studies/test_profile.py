"""Profile likelihoods of problems whose profiles are known."""

import numpy as np
import pytest
from support.toys import Banana, Linear

from bayesub.inference.identifiability import fisher
from bayesub.problem.priors import Normal
from ill_conditioning.profile import LEVEL_95, profile
from ill_conditioning.sds import cramer_rao_sd

N = 5
STEPS = np.linspace(-1.0, 1.0, 9)


@pytest.fixture
def linear(rng):
    """A noise-ridden linear problem, and its maximum of likelihood."""
    matrix = rng.standard_normal((30, N)) * [1.0, 10.0, 0.1, 1.0, 1.0]
    matrix[:, 4] += 0.99 * matrix[:, 0]
    prior = Normal(mean=rng.uniform(1.0, 3.0, N), sd=rng.uniform(0.1, 1.0, N))
    problem = Linear(matrix, matrix @ prior.mean + rng.standard_normal(30), prior)
    return problem, np.linalg.lstsq(matrix, problem.readings, rcond=None)[0]


@pytest.mark.parametrize("name", ["c0", "c2"])
def test_profile_of_a_linear_problem_is_the_parabola(linear, name):
    """((value - best) / Cramer-Rao sd)^2, which reaches 3.84 at 1.96 standard deviations."""
    problem, best = linear
    k = problem.names.index(name)
    sd = np.sqrt(np.linalg.inv(problem.matrix.T @ problem.matrix)[k, k])
    found = profile(problem, best, name, best[k] + 4.0 * sd * STEPS)
    # Costs of a few tens are known to 1e-13 or so of themselves, and the best to the root of that.
    np.testing.assert_allclose(found.cost, 16.0 * STEPS**2, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(found.laplace, 16.0 * STEPS**2, rtol=1e-9, atol=1e-10)
    ends = (np.array(found.interval()) - best[k]) / sd
    np.testing.assert_allclose(ends, np.sqrt(LEVEL_95) * np.array([-1.0, 1.0]), rtol=1e-9)
    np.testing.assert_allclose(LEVEL_95, 1.96**2, rtol=1e-4)


def test_the_path_is_at_its_best(linear):
    """Each point of the path is the constrained least-squares solution."""
    problem, best = linear
    found = profile(problem, best, "c1", best[1] + STEPS)
    for value, point in zip(found.grid, found.path, strict=True):
        others = [0, 2, 3, 4]
        readings = problem.readings - value * problem.matrix[:, 1]
        expected = np.linalg.lstsq(problem.matrix[:, others], readings, rcond=None)[0]
        assert point[1] == pytest.approx(value, abs=1e-14)
        np.testing.assert_allclose(point[others], expected, rtol=1e-8)


def test_profile_with_the_prior_is_the_posterior(linear):
    """The same with the prior as more readings: the parabola has the posterior sd."""
    problem, _ = linear
    sd = np.sqrt(problem.covariance[2, 2])
    found = profile(problem, problem.mean, "c2", problem.mean[2] + 3.0 * sd * STEPS, prior=True)
    np.testing.assert_allclose(found.cost, 9.0 * STEPS**2, rtol=1e-9, atol=1e-10)


@pytest.mark.parametrize("told", [True, False])
def test_profile_is_flat_along_a_planted_null(linear, told):
    """c0 and c3 enter as their sum: no value of c0 costs anything, whether or not the search is told so."""
    problem, _ = linear
    problem.matrix[:, 3] = problem.matrix[:, 0]
    best = np.linalg.lstsq(problem.matrix, problem.readings, rcond=None)[0]
    null = [{"c0": 1.0, "c3": -1.0}] if told else []
    found = profile(problem, best, "c0", best[0] + 100.0 * STEPS, null=null)
    # A hundred units cost nothing where one would cost thirty readings dear; round-off of a cost of that size.
    np.testing.assert_allclose(found.cost, 0.0, atol=1e-9)
    np.testing.assert_allclose(found.laplace, 0.0, atol=1e-9)
    assert found.interval() == (-np.inf, np.inf)
    # The others of the null vector follow; what has no part in it is known as ever.
    np.testing.assert_allclose(found.path[:, 0] + found.path[:, 3], best[0] + best[3], rtol=1e-10)
    other = profile(problem, best, "c1", best[1] + STEPS, null=null)
    s = fisher(problem, best, [{"c0": 1.0, "c3": -1.0}])
    np.testing.assert_allclose(other.cost, (STEPS / cramer_rao_sd(s)[1]) ** 2, rtol=1e-8, atol=1e-9)


def test_profile_of_a_bent_valley_is_flat_where_the_parabola_is_not():
    """x1 = -x0^2 costs nothing at any x0, nor at any negative x1; at a positive x1 the best is x0 = 0."""
    banana = Banana()
    best = np.array([1.0, -1.0])
    found = profile(banana, best, "c0", np.linspace(0.0, 2.0, 9))
    np.testing.assert_allclose(found.cost, 0.0, atol=1e-6)
    np.testing.assert_allclose(found.path[:, 1], -(found.grid**2), atol=1e-4)
    across = profile(banana, best, "c1", np.array([-1.5, -0.5, -0.1, 0.05]))
    np.testing.assert_allclose(across.cost[:3], 0.0, atol=1e-6)
    assert across.cost[3] == pytest.approx(1.0, rel=2e-3)  # one width; the search stops a thousandth short
