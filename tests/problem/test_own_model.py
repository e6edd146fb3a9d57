"""Somebody else's model: closed forms by both kinds, rows that sum to the deviance, refusals, a public posterior."""

import warnings

import numpy as np
import pytest
from scipy import stats
from support.refusals import refused
from support.toys import AGREE, disagreement, ill_conditioned, second_moments

import bayesub as bs
from bayesub.inference.interface import Modal, Sampled
from bayesub.problem.own_model import OfSciPy
from reference_posteriors import densities

N = 12
TIMES = np.linspace(-1.0, 1.0, N)
MATRIX = np.column_stack([np.ones(N), TIMES, np.sin(3.0 * TIMES)])
READINGS = MATRIX @ [1.0, 2.0, -0.5] + 0.3 * np.random.default_rng(4).standard_normal(N)
FLAT = {name: bs.priors.normal(0.0, 1e3) for name in "abc"} | {"s": stats.halfcauchy(scale=2.0)}


def errors(p):
    return p[..., :3] @ MATRIX.T - READINGS


def log_likelihood(p):
    return -0.5 * np.sum(errors(p) ** 2, axis=-1) / p[..., 3] ** 2 - N * np.log(p[..., 3])


def gradient(p):
    e, s = errors(p), p[..., 3:]
    return np.concatenate([-e @ MATRIX / s**2, np.sum(e**2, axis=-1, keepdims=True) / s**3 - N / s], axis=-1)


KINDS = {
    "residuals": lambda: bs.LeastSquaresModel(errors, FLAT, sd="s", vectorized=True),
    "residuals, Jacobian": lambda: bs.LeastSquaresModel(
        errors, FLAT, lambda _: np.insert(MATRIX, 3, 0.0, axis=1), sd=("s",) * N
    ),
    "density, gradient": lambda: bs.DensityModel(log_likelihood, FLAT, gradient, vectorized=True),
    "density": lambda: bs.DensityModel(log_likelihood, FLAT),
}


def exact():
    """Means and variances of a, b, c and log s, by quadrature over log s."""
    best = np.linalg.solve(MATRIX.T @ MATRIX, MATRIX.T @ READINGS)
    log_s = np.linspace(-4.0, 3.0, 20_001)
    logs = (4.0 - N) * log_s - 0.5 * np.sum((MATRIX @ best - READINGS) ** 2) * np.exp(-2.0 * log_s)
    weights = np.exp(logs - logs.max()) / (1.0 + 0.25 * np.exp(2.0 * log_s))
    weights /= weights.sum()
    mean = weights @ log_s
    spread = weights @ np.exp(2.0 * log_s) * np.diag(np.linalg.inv(MATRIX.T @ MATRIX))
    return np.append(best, mean), np.append(spread, weights @ (log_s - mean) ** 2)


@pytest.mark.parametrize("kind", [*list(KINDS)[:-1], pytest.param("density", marks=pytest.mark.slow)])
def test_a_regression_with_unknown_noise(kind):
    """Moments of the closed form; and negative control, not those of half the variance."""
    model = KINDS[kind]()
    assert isinstance(model, Sampled)
    posterior = bs.sample(model, rng=np.random.default_rng(1))
    assert posterior.converged
    assert posterior.acceptance > 0.8
    chain = posterior.chain.copy()
    chain[..., 3] = np.log(chain[..., 3])
    mean, variance = exact()
    x = (chain - mean) / np.sqrt(variance)
    assert disagreement(np.concatenate([x, x**2 - 1.0], axis=-1)) < AGREE
    narrow = (chain - mean) / np.sqrt(0.5 * variance)
    assert disagreement(narrow**2 - 1.0) > 2 * AGREE


@pytest.mark.parametrize("kind", KINDS)
def test_rows_sum_to_the_deviance_about_a_fit(kind):
    """Of residuals that are linear, to all orders; and their Jacobian gives the gradient there."""
    model = KINDS[kind]()
    best = np.linalg.solve(MATRIX.T @ MATRIX, MATRIX.T @ READINGS)
    centre = np.append(best, 0.35)
    if isinstance(model, Modal):
        centre = model.posterior_mode(np.random.default_rng(0))
    near = centre * (1.0 + 0.1 * np.random.default_rng(2).standard_normal((50, 4)))
    rows, log_likelihoods = model.misfit_about(centre, near)
    deviances = np.sum(rows**2, axis=1) + 2.0 * log_likelihoods
    assert np.ptp(deviances) < 1e-4 * np.ptp(log_likelihoods)
    (row,), _ = model.misfit_about(centre, centre[None])
    slope = row @ model.jacobian(centre)
    np.testing.assert_allclose(slope, -gradient(centre), atol=1e-4 * np.abs(gradient(centre * 1.1)).max())


def test_known_noise_is_a_linear_problem():
    """All first and second moments, also of what the data do not see."""
    toy, _ = ill_conditioned()
    priors = {n: bs.priors.normal(m, s) for n, m, s in zip(toy.names, toy.prior.mean, toy.prior.sd, strict=True)}
    model = bs.LeastSquaresModel(lambda p: toy.matrix @ p - toy.readings, priors)
    posterior = bs.sample(model, rng=np.random.default_rng(1))
    assert posterior.converged
    assert disagreement(second_moments(toy.standardised(posterior.chain))) < AGREE


@pytest.mark.parametrize(
    "distribution", [stats.halfcauchy(scale=3.0), stats.gamma(25.0, scale=0.2), stats.beta(2.0, 5.0)]
)
def test_a_distribution_of_scipy_is_a_prior(distribution):
    """There and back, with the slope of differences, and the probabilities of a normal number."""
    prior, t = OfSciPy(distribution), np.linspace(-6.0, 6.0, 25)[:, None]
    x = prior.parameters(t)
    np.testing.assert_allclose(prior.standard(x), t, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(distribution.cdf(x), stats.norm.cdf(t), rtol=1e-9, atol=1e-15)
    by_differences = (prior.parameters(t + 1e-5) - prior.parameters(t - 1e-5)) / 2e-5
    np.testing.assert_allclose(prior.chain(np.ones_like(t), t), by_differences, rtol=1e-5)
    assert np.isfinite([prior.mean, prior.sd]).all()


def test_refusals():
    """One line that says what is wrong and what is wanted."""
    with refused("value", "a"):
        bs.LeastSquaresModel(errors, {"a": 3.0})
    with refused("value", "a"):
        bs.DensityModel(log_likelihood, {"a": bs.priors.relative_normal(0.25)})
    with refused("missing", "priors"):
        bs.LeastSquaresModel(errors, {})
    for model, function in ((bs.LeastSquaresModel, errors), (bs.DensityModel, log_likelihood)):
        with refused("value", "priors"):
            model(function, {0: bs.priors.normal(0.0, 1.0), 1: bs.priors.normal(0.0, 1.0)})
    with refused("unknown", "noise"):
        bs.LeastSquaresModel(errors, FLAT, sd="noise")
    with refused("value", "sd"):
        bs.LeastSquaresModel(errors, FLAT, sd=("s", "s"))
    with refused("value", "jacobian"):
        bs.LeastSquaresModel(errors, FLAT, lambda _: MATRIX, sd="s")
    with refused("value", "log_likelihood"):
        bs.DensityModel(lambda_of_batch, FLAT)
    with refused("value", "gradient"):
        bs.DensityModel(log_likelihood, FLAT, lambda_gradient)
    nowhere = bs.DensityModel(lambda _: -np.inf, FLAT)
    with refused("model", "prior"), warnings.catch_warnings():
        bs.sample(nowhere, rng=np.random.default_rng(0))


def lambda_of_batch(p):
    return np.zeros((2, len(p)))


def lambda_gradient(_):
    return np.zeros(3)


lambda_of_batch.__name__, lambda_gradient.__name__ = "log_likelihood", "gradient"


def test_a_posterior_that_others_drew():
    """Gaussian process regression: means and sds of the reference draws of posteriordb within their errors."""
    name = "gp_pois_regr-gp_regr"
    reference = densities.pose(name, densities.data_of(name, None))
    posterior = bs.sample(reference.model, rng=np.random.default_rng(1))
    mean, sd, *_ = np.array(list(densities.SHIPPED["moments"][name].values())).T
    x = (posterior.chain - mean) / sd
    assert disagreement(np.concatenate([x, x**2 - 1.0], axis=-1)) < AGREE


@pytest.mark.parametrize(
    "prior", [stats.halfcauchy(scale=-1.0), stats.norm(0.0, np.nan), stats.gamma, stats.norm([0.0, 1.0], [1.0, 2.0])]
)
def test_a_prior_that_is_none_is_refused(prior):
    """SciPy takes wrong parameters, none and several without a word."""
    with refused("value", "a"):
        bs.LeastSquaresModel(lambda a: a - 1.0, {"a": prior})
