"""What one trial passes on to the next: in two steps as jointly, in closed form."""

import numpy as np
import pytest
from support.refusals import refused
from support.toys import Linear

from bayesub.design.knowledge import SMALLEST, Knowledge, covariance_of_draws, of_draws, of_moments
from bayesub.inference.identifiability import fisher
from bayesub.problem.distributions import CorrelatedNormal, Normal

NAMES = ("a", "b", "c", "d", "e")
N = len(NAMES)


@pytest.fixture
def prior(rng):
    return Normal(rng.uniform(1.0, 3.0, N), 10.0 ** rng.uniform(-3.0, 1.0, N))


def trial(rng, prior, sees, n=12, noise=0.05):
    """Readings that see some parameters (their positions), of the combinations of a matrix in prior sds."""
    matrix = np.zeros((n, N))
    matrix[:, sees] = rng.standard_normal((n, len(sees))) / prior.sd[sees]
    return matrix, matrix @ (prior.mean + prior.sd * rng.standard_normal(N)) + noise * rng.standard_normal(n), noise


def posterior(trials, prior) -> Knowledge:
    """The closed form of linear regression with a normal prior, by its precision."""
    spread = prior.chain(np.eye(N), np.zeros(N))
    precision = np.linalg.inv(spread @ spread.T) + sum(m.T @ m / s**2 for m, _, s in trials)
    push = np.linalg.solve(spread @ spread.T, prior.mean) + sum(m.T @ y / s**2 for m, y, s in trials)
    return of_moments(NAMES, np.linalg.solve(precision, push), np.linalg.inv(precision))


def as_prior(known):
    return CorrelatedNormal(known.mean, known.sd[:, None] * np.linalg.cholesky(known.correlation))


def assert_same(first, second, tolerance=1e-7):
    np.testing.assert_allclose((first.mean - second.mean) / second.sd, 0.0, atol=tolerance)
    np.testing.assert_allclose(first.sd, second.sd, rtol=tolerance)
    np.testing.assert_allclose(first.correlation, second.correlation, atol=tolerance)


def test_two_steps_are_the_joint_posterior(rng, prior):
    first, second = (trial(rng, prior, range(N)) for _ in range(2))
    step = posterior([second], as_prior(posterior([first], prior)))
    assert_same(step, posterior([first, second], prior))
    assert not np.allclose(step.sd, posterior([second], prior).sd, rtol=1e-2)  # the first trial has told something


def test_a_second_trial_of_some_coefficients_tells_of_what_goes_with_them(rng, prior):
    """It frees a and b only; c, d and e follow by regression, in any order of names."""
    first, second = trial(rng, prior, range(N), n=4), trial(rng, prior, [0, 1])
    known = posterior([first], prior)
    few = posterior([second], as_prior(known)).part(["b", "a"])
    updated = known.updated(few)
    assert_same(updated, posterior([first, second], prior))
    assert np.any(np.abs(updated.mean - known.mean)[2:] > 0.1 * known.sd[2:])  # and it does tell


def test_a_null_direction_stays_as_wide_as_it_was(rng, prior):
    """Along it the second trial starts from the prior of the first, and its spectrum calls it null again."""
    matrix, readings, noise = trial(rng, prior, range(N), n=20)
    matrix[:, 4] = 2.0 * matrix[:, 1]  # b and e enter as b + 2 e only
    null = np.array([0.0, 2.0, 0.0, 0.0, -1.0]) / np.sqrt(5.0)
    known = posterior([(matrix, readings, noise)], prior)
    along = np.linalg.solve(np.diag(prior.sd**2), null)  # the functional that is independent of all that is read
    along /= np.sqrt(along @ np.diag(prior.sd**2) @ along)
    assert along @ known.covariance @ along == pytest.approx(1.0, rel=1e-9)
    again = Linear(matrix, readings, as_prior(known), sd=noise)
    again.names = NAMES
    spectrum = fisher(again, again.mean, [{"b": 2.0, "e": -1.0}])
    assert (spectrum.n_null, spectrum.n_informed) == (1, 0)  # the same readings add less than they have said
    assert along @ again.covariance @ along == pytest.approx(1.0, rel=1e-9)


def test_draws_give_their_moments(rng, prior):
    known = posterior([trial(rng, prior, range(N))], prior)
    draws = as_prior(known).sample(rng, 20_000)
    found = of_draws(NAMES, draws)
    np.testing.assert_allclose((found.mean - known.mean) / known.sd, 0.0, atol=5.0 / np.sqrt(20_000))
    np.testing.assert_allclose(found.sd, known.sd, rtol=5.0 / np.sqrt(40_000))
    assert np.array_equal(found.correlation, found.correlation.T)
    assert np.all(np.diag(found.correlation) == 1.0)


def test_the_covariance_of_draws_has_an_inverse(rng):
    """As it is where it has one, widened where two coefficients are the same, and refused where one never changes."""
    draws = rng.standard_normal((50, 2))
    np.testing.assert_array_equal(covariance_of_draws(("a", "b"), draws), np.cov(draws.T))
    np.linalg.cholesky(covariance_of_draws(("a", "b"), draws[:, [0, 0]]))
    with refused("data", "b"):
        covariance_of_draws(("a", "b"), draws * [1.0, 0.0] + 0.3)


def test_what_rounding_makes_indefinite_is_widened_a_little():
    """Two coefficients of which only the sum is known, to one part in a billion."""
    matrix = np.array([[1.0, -1.0 + 1e-18], [-1.0 + 1e-18, 1.0]])
    known = of_moments(("a", "b"), np.zeros(2), matrix)
    np.linalg.cholesky(known.correlation)
    total = np.ones(2) @ known.covariance @ np.ones(2)
    assert 0.0 < total < 10.0 * SMALLEST
