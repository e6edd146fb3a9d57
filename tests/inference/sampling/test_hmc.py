"""Compiled flights on a surrogate: they are the slow ones, on the density that is documented, and exact."""

import numpy as np
import pytest
from support import slow_hmc
from support.toys import Banana, ill_conditioned, second_moments, standardised

from bayesub.inference.baselines import gauss_newton
from bayesub.inference.sampling.geometry import Geometry
from bayesub.inference.sampling.hmc import log_prior, reflecting_trajectories, slope_of_prior, trajectories
from bayesub.inference.sampling.surrogate import learn
from bayesub.problem.distributions import Joint, Normal, Uniform
from bayesub.problem.shared_scale import SharedScale

ONE = np.ones(1)
MIXED = Joint(
    (
        SharedScale(np.array([1.0, -2.0, 3.0]), np.array([0.1, 0.3, 0.5])),
        Uniform(np.zeros(2), np.ones(2)),
        Normal(np.zeros(2), np.ones(2)),
        SharedScale(np.array([1.0, -2.0]), np.array([0.2])),
    ),
    tuple(map(np.array, ([0, 3, 5], [1, 2], [4, 6], [7, 8]))),
)
PRIORS = {
    "normal": Normal(np.zeros(2), np.array([1.0, 3.0])),
    "uniform": Uniform(np.array([-2.0, -3.0]), np.array([1.5, 3.0])),
    "half": Joint((Uniform(-2.0 * ONE, ONE), Normal(0.0 * ONE, 3.0 * ONE)), (np.array([0]), np.array([1]))),
    "shared scale": SharedScale(np.array([0.5, -0.4]), np.array([0.2, 0.5])),
}


def surrogate_of(name):
    problem = Banana()
    problem.prior = PRIORS[name]
    geometry = Geometry.whitened(problem, gauss_newton(problem).values)
    return learn(problem, geometry, np.random.default_rng(0))


@pytest.fixture(scope="module", params=PRIORS)
def learned(request):
    """A surrogate with walls or without, bent, and draws of it."""
    return surrogate_of(request.param)


def walls_of(surrogate, y):
    """Rows of places that are outside, and gradients of what is bounded."""
    geometry = surrogate.geometry
    z = geometry.bent(y)
    rows, beyond = np.nonzero(np.abs(geometry.scaled(z)) > geometry.prior.scaled_form()[0])
    return rows, geometry.pullback(z[rows], geometry.basis[beyond])


def test_the_prior_in_numbers_is_the_prior(rng):
    """Log density but for a constant, gradient, and nothing outside, of normal, uniform and grouped parameters."""
    x = 1.3 * rng.standard_normal((500, len(MIXED.mean)))
    x[:3, 0] = 0.0, 1e6, -1e6
    numbers = MIXED.scaled_form()
    with np.errstate(invalid="ignore", divide="ignore"):
        log_density, slope = MIXED.scaled_log_density(x), MIXED.scaled_slope(x)
    ours = log_prior(np.ascontiguousarray(x.T), numbers)
    inside = np.isfinite(log_density)
    assert 50 < inside.sum() < 450
    np.testing.assert_array_equal(np.isfinite(ours), inside)
    off = (ours - np.where(inside, log_density, 0.0))[inside]
    np.testing.assert_allclose(off, off[0], rtol=1e-12)
    found = slope_of_prior(np.ascontiguousarray(x.T), numbers).T
    np.testing.assert_allclose(found[inside], slope[inside], rtol=1e-12)


@pytest.mark.parametrize("temperature", [1.0, 2.5])
def test_the_density_is_that_of_the_docstring(learned, temperature):
    """A t density of the emulated residuals, continued by its tangent, times the prior."""
    surrogate, draws = learned
    geometry = surrogate.geometry
    z = geometry.bent(draws)
    residuals = surrogate.polynomials(z)
    k = residuals.shape[1]
    nu, q = 30.0 + k, np.sum(residuals**2, axis=1) - np.sum(surrogate.polynomials.linear[0] ** 2)
    power = surrogate.power / temperature
    expected = -0.5 * power * (nu + k) * np.where(q > 0.0, np.log1p(np.maximum(q, 0.0) / nu), q / nu)
    expected += geometry.prior.scaled_log_density(geometry.scaled(z))
    off = surrogate.log_prob(draws, temperature) - expected
    np.testing.assert_allclose(off, off[0], atol=1e-9)
    np.testing.assert_array_equal(
        surrogate.with_gradient(draws, temperature)[0], surrogate.log_prob(draws, temperature)
    )


def test_flights_are_the_slow_ones(learned):
    """The same numbers lead to the same places, of walkers that fill several blocks and one in part."""
    surrogate, draws = learned
    y, random = draws[:150], np.random.default_rng(1)
    target = surrogate.packed()
    drawn = slow_hmc.numbers(random, y, (0.1, 0.4), 3)
    slow = slow_hmc.trajectories(surrogate.with_gradient, y, *drawn, 3)
    for ours, expected in zip(trajectories(y, *drawn, 3, *target), slow, strict=True):
        np.testing.assert_allclose(ours, expected, rtol=1e-6, atol=1e-7)
    assert slow[2].mean() > 0.2
    drawn = slow_hmc.numbers(random, y, (0.2, 0.4), 2, 6)
    slow = slow_hmc.reflecting_trajectories(surrogate.with_gradient, lambda y: walls_of(surrogate, y), y, *drawn)
    for ours, expected in zip(reflecting_trajectories(y, *drawn, *target), slow, strict=True):
        np.testing.assert_allclose(ours, expected, rtol=1e-6, atol=1e-7)
    assert slow[2].mean() > 0.5


@pytest.mark.parametrize("name", ["uniform", "half", "normal"])
def test_flights_leave_the_surrogate_invariant(name):
    """Exact draws of a bent density between walls, by rejection, are draws of it after flights of either kind."""
    surrogate, draws = surrogate_of(name)
    rng = np.random.default_rng(2)
    low, high = (3.0 * ends for ends in (draws.min(axis=0), draws.max(axis=0)))
    candidates = rng.uniform(low, high, (3_000_000, 2))
    log_prob = surrogate.log_prob(candidates)
    y = candidates[np.log(rng.random(len(candidates))) < log_prob - log_prob.max()]
    assert len(y) > 50_000
    assert np.abs(y / np.where(y > 0.0, high, low)).max() < 0.95  # none is cut off
    mean, covariance = y.mean(axis=0), np.cov(y.T)
    target = surrogate.packed()
    for ends in (
        trajectories(y, *slow_hmc.numbers(rng, y, (0.1, 0.4), 4), 3, *target)[0],
        reflecting_trajectories(y, *slow_hmc.numbers(rng, y, (0.2, 0.4), 4, 6), *target)[0],
    ):
        assert np.isfinite(surrogate.log_prob(ends)).all()
        assert np.mean(np.all(ends != y, axis=1)) > 0.7
        off = second_moments(standardised(ends, mean, covariance)) - second_moments(standardised(y, mean, covariance))
        assert np.all(np.abs(off.mean(axis=0)) < 4.5 * off.std(axis=0) / np.sqrt(len(y)))


def test_walls_are_turned_back_from_along_their_normals():
    """Gradients of the parameters that are bounded, through the bends, against differences."""
    surrogate, draws = surrogate_of("uniform")
    geometry = surrogate.geometry
    assert geometry.bends
    y = draws[:50] * 3.0
    rows, normals = walls_of(surrogate, y)
    _, beyond = np.nonzero(np.abs(geometry.scaled(geometry.bent(y))) > np.sqrt(3.0))
    assert len(rows) > 20
    for row, wall, normal in zip(rows, beyond, normals, strict=True):
        ends = (geometry.scaled(geometry.bent(y[row] + sign * 1e-5 * np.eye(2)))[:, wall] for sign in (1, -1))
        np.testing.assert_allclose(normal, np.subtract(*ends) / 2e-5, rtol=1e-6, atol=1e-6)


def test_a_flight_to_infinity_is_refused():
    """Without a word, and the walker stays."""
    problem, _ = ill_conditioned()
    geometry = Geometry.whitened(problem, gauss_newton(problem).values)
    surrogate, draws = learn(problem, geometry, np.random.default_rng(0))
    surrogate.polynomials = surrogate.polynomials.mixed(1e200 * np.eye(surrogate.polynomials.linear.shape[1]))
    y = draws[:10]
    target = surrogate.packed()
    drawn = slow_hmc.numbers(np.random.default_rng(3), y, (0.4,), 1)
    np.testing.assert_array_equal(trajectories(y, *drawn, 3, *target)[0], y)
    drawn = slow_hmc.numbers(np.random.default_rng(3), y, (0.4,), 1, 4)
    np.testing.assert_array_equal(reflecting_trajectories(y, *drawn, *target)[0], y)
