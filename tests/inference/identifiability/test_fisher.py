"""The Fisher information, and what the study ill_conditioning makes of it; null is not ill-conditioned."""

import numpy as np
import pytest
from support.toys import Linear, ill_conditioned

from bayesub.inference.identifiability import conditional_sd, fisher
from bayesub.inference.identifiability.fisher import integrated_out
from bayesub.inference.identifiability.linalg import null_basis, split_svd
from bayesub.problem.distributions import CorrelatedNormal, Normal, Uniform
from bayesub.problem.shared_scale import SharedScale
from ill_conditioning.sds import alone_sd, cramer_rao_sd, held_sd, null_part, sharper_sensors

N = 6


def linear(rng, matrix):
    prior = Normal(mean=rng.uniform(1.0, 3.0, N), sd=10.0 ** rng.uniform(-1.0, 0.5, N))
    return Linear(matrix, matrix @ prior.mean, prior, sd=0.3)


@pytest.fixture
def unique(rng):
    return linear(rng, rng.standard_normal((40, N)))


@pytest.fixture
def planted(rng):
    """A problem in which c1 and c4 enter only as c1 + 2 c4, and that null vector."""
    matrix = rng.standard_normal((40, N))
    matrix[:, 4] = 2.0 * matrix[:, 1]
    return linear(rng, matrix), {"c1": 1.0, "c4": -0.5}


def test_bounds_are_the_covariances_of_linear_problems(unique):
    """Alone, in company, and with the prior: the closed forms of linear regression."""
    s = fisher(unique, unique.mean)
    information = unique.matrix.T @ unique.matrix / unique.sd**2
    np.testing.assert_allclose(alone_sd(s), np.diag(information) ** -0.5, rtol=1e-12)
    np.testing.assert_allclose(cramer_rao_sd(s), np.sqrt(np.diag(np.linalg.inv(information))), rtol=1e-10)
    np.testing.assert_allclose(s.posterior_sd, np.sqrt(np.diag(unique.covariance)), rtol=1e-10)
    np.testing.assert_array_equal(held_sd(s), cramer_rao_sd(s))
    assert not null_part(s).any()


def test_data_alone_say_nothing_along_a_null_direction(planted):
    """Infinite for the two coefficients of the null vector and for no other; the sum that is read is known."""
    problem, vector = planted
    s = fisher(problem, problem.mean, [vector])
    assert s.n_null == 1
    np.testing.assert_array_equal(np.isinf(cramer_rao_sd(s)), [False, True, False, False, True, False])
    np.testing.assert_array_equal(null_part(s) > 0, np.isinf(cramer_rao_sd(s)))
    scaled = problem.matrix / problem.sd * problem.prior.sd
    pseudo = np.sqrt(np.diag(np.linalg.pinv(scaled.T @ scaled, rcond=1e-10))) * problem.prior.sd
    np.testing.assert_allclose(held_sd(s), pseudo, rtol=1e-8)
    # Holding one of the pair fixed gives the others the same bounds: they have no part in the null space.
    kept = [0, 1, 2, 3, 5]
    information = problem.matrix[:, kept].T @ problem.matrix[:, kept] / problem.sd**2
    fixed = np.sqrt(np.diag(np.linalg.inv(information)))
    np.testing.assert_allclose(cramer_rao_sd(s)[[0, 2, 3, 5]], fixed[[0, 2, 3, 4]], rtol=1e-10)
    # With the prior all is finite, and right.
    np.testing.assert_allclose(s.posterior_sd, np.sqrt(np.diag(problem.covariance)), rtol=1e-10)


def test_a_nearly_null_direction_stays_finite(planted, rng):
    """What the data know to one part in a million is ill-conditioned, not null, whatever the threshold of a solver."""
    problem, _ = planted
    problem.matrix[:, 4] += 1e-6 * rng.standard_normal(40)
    s = fisher(problem, problem.mean)
    assert s.n_null == 0
    assert np.all(np.isfinite(cramer_rao_sd(s)))
    assert cramer_rao_sd(s)[4] > 1e4 * cramer_rao_sd(s)[0]


def test_sharper_sensors_reach_what_was_asked(unique):
    """Dividing the noise by the factor makes the posterior sd what was asked for: solved again from the start."""
    for target in (0.2, 1e-3, 1e-6):
        factors = sharper_sensors(fisher(unique, unique.mean), target)
        already = unique.prior.sd <= target * np.abs(unique.mean)
        np.testing.assert_array_equal(factors == 0.0, already)
        for k in np.flatnonzero(~already):
            sharper = Linear(unique.matrix, unique.readings, unique.prior, unique.sd / factors[k])
            assert np.sqrt(sharper.covariance[k, k]) == pytest.approx(target * abs(unique.mean[k]), rel=1e-8)


def test_no_sensor_helps_along_a_null_direction(planted):
    """The two coefficients of the null vector never reach a tenth of their prior sd; the others do."""
    problem, vector = planted
    s = fisher(problem, problem.mean, [vector])
    wanted = 0.1 * (problem.prior.sd / np.abs(problem.mean))
    for k in range(N):
        assert np.isinf(sharper_sensors(s, wanted[k])[k]) == (k in (1, 4))
    # Asked for no more than the null space leaves to the prior, sensors help again.
    k = 1
    modest = 1.1 * null_part(s)[k] * problem.prior.sd[k] / abs(problem.mean[k])
    assert modest * abs(problem.mean[k]) < problem.prior.sd[k]
    assert np.isfinite(sharper_sensors(s, modest)[k])


def test_directions_in_names(unique):
    """Largest entries first, and none lost."""
    s = fisher(unique, unique.mean)
    named = s.direction(2)
    sizes = np.abs(list(named.values()))
    assert np.all(np.diff(sizes) <= 0)
    assert [named[name] for name in unique.names] == list(s.directions[2])


def test_split_svd_multiplies_back_and_keeps_zeros(planted):
    """The decomposition is one of the matrix; columns that no null vector names are exactly zero in the null rows."""
    problem, vector = planted
    null = null_basis(problem.names, [vector], problem.prior.sd)
    matrix = problem.matrix * problem.prior.sd
    u, s, vt = split_svd(matrix, null)
    np.testing.assert_allclose(u * s @ vt, matrix, atol=1e-13 * s[0])
    np.testing.assert_allclose(vt @ vt.T, np.eye(N), atol=1e-14)
    np.testing.assert_array_equal(vt[-1] != 0.0, [False, True, False, False, True, False])
    assert s[-1] < 1e-14 * s[0]


def test_null_vectors_of_other_coefficients_are_refused(unique):
    """The null space of more coefficients is not that of those that are free."""
    with pytest.raises(ValueError, match="c9, which is not free"):
        fisher(unique, unique.mean, [{"c0": 1.0, "c9": 1.0}])


def test_directions_have_their_largest_entry_positive(unique):
    """Not the sign that a decomposition happens to give them."""
    s = fisher(unique, unique.mean)
    largest = np.argmax(np.abs(s.directions), axis=1)
    assert np.all(s.directions[np.arange(N), largest] > 0.0)


def test_standard_normal_unknowns_are_integrated_out(rng):
    by_others, by_white = rng.standard_normal((30, 4)), rng.standard_normal((30, 50))
    jacobian = integrated_out(by_others, by_white)
    exact = by_others.T @ np.linalg.solve(np.eye(30) + by_white @ by_white.T, by_others)
    assert jacobian.T @ jacobian == pytest.approx(exact, rel=1e-10)


def test_a_prior_that_correlates_takes_its_share(planted, rng):
    """What an earlier trial has told counts as prior: the null direction stays null, and nothing is told twice."""
    problem, vector = planted
    factor = np.linalg.cholesky(problem.covariance)
    again = Linear(problem.matrix, problem.readings, CorrelatedNormal(problem.mean, factor), sd=problem.sd)
    first, second = (fisher(p, p.mean, [vector]) for p in (problem, again))
    # The same readings once more: each of the five directions that they sharpened has now a signal below one.
    assert (first.n_informed, second.n_informed, second.n_null) == (5, 0, 1)
    s = first.singular_values[:5]
    np.testing.assert_allclose(second.singular_values[:5], (s / np.sqrt(1.0 + s**2)), rtol=1e-9)
    np.testing.assert_allclose(second.posterior_sd, np.sqrt(np.diag(again.covariance)), rtol=1e-9)
    information = again.matrix.T @ again.matrix / again.sd**2
    np.testing.assert_allclose(alone_sd(second), np.diag(information) ** -0.5, rtol=1e-9)
    # Along the null direction the posterior is the prior; along every direction draws of the prior have a sd of one.
    draws = again.prior.sample(rng, 20_000)
    along = (draws - again.prior.mean) / again.prior.sd @ second.coordinates.T
    np.testing.assert_allclose(np.cov(along.T), np.eye(N), atol=5.0 / np.sqrt(20_000))
    null = second.coordinates[-1] / again.prior.sd
    assert null @ again.covariance @ null == pytest.approx(1.0, abs=1e-9)


def given_others(problem):
    """Root of 1 over the diagonal of the precision of a normal posterior: each if all the others were known."""
    precision = problem.matrix.T @ problem.matrix / problem.sd**2 + np.linalg.inv(problem.spread @ problem.spread.T)
    return np.diag(precision) ** -0.5


def test_what_is_known_if_all_others_are_is_that_of_the_normal_posterior(unique, planted, rng):
    """With and without null directions, and with a prior that has correlations."""
    planted, _ = planted
    factor = rng.standard_normal((N, N))
    prior = CorrelatedNormal(unique.prior.mean, factor @ factor.T + np.eye(N))
    for problem in (unique, planted, linear(rng, 1e-3 * unique.matrix), Linear(unique.matrix, unique.readings, prior)):
        np.testing.assert_allclose(conditional_sd(problem, problem.mean[None]), given_others(problem), rtol=1e-9)


def test_what_is_known_if_all_others_are_does_not_come_from_a_covariance():
    """Of a posterior whose covariance has a condition number of 1e16, of which the inverse has no digit left."""
    problem, _ = ill_conditioned(singular_values=10.0 ** np.linspace(8.0, 0.0, N))
    exact = given_others(problem)
    np.testing.assert_allclose(conditional_sd(problem, problem.mean[None]), exact, rtol=1e-9)
    by_covariance = np.abs(np.diag(np.linalg.inv(problem.covariance))) ** -0.5
    assert np.abs(by_covariance / exact - 1.0).max() > 1e-3


def test_without_data_what_is_known_of_a_coefficient_is_its_prior(rng):
    """Between bounds too, and of a prior whose scale is unknown with that which the draws have."""
    median, scales = rng.uniform(1.0, 3.0, N), np.array([0.05, 0.2, 0.8])
    shared = SharedScale(median, scales)
    narrow = SharedScale(median, scales[:1]).sample(rng, 500)
    for prior, draws in ((Uniform(median, median + 2.0), None), (shared, narrow)):
        problem = Linear(np.zeros((1, N)), np.zeros(1), Normal(median, np.ones(N)))
        problem.prior = prior
        draws = prior.sample(rng, 100) if draws is None else draws
        np.testing.assert_allclose(conditional_sd(problem, draws), prior.found(draws).sd, rtol=1e-9)
    assert np.all(shared.found(narrow).sd < 0.3 * shared.sd)
