"""The surrogate against problems that it can and cannot emulate."""

import numpy as np
import pytest
from support.toys import Banana, Cliff, Linear, Toy, ill_conditioned

import bayesub as bs
from bayesub.inference.baselines import gauss_newton
from bayesub.inference.sampling import surrogate as surrogates
from bayesub.inference.sampling.geometry import Geometry
from bayesub.inference.sampling.surrogate import learn
from bayesub.problem.distributions import Uniform


def learned(problem, seed=0):
    geometry = Geometry.whitened(problem, gauss_newton(problem).values)
    surrogate, draws = learn(problem, geometry, np.random.default_rng(seed))
    return geometry, surrogate, draws


def errors(problem, geometry, surrogate, draws):
    """Log posterior less log surrogate at draws, from their median."""
    off = geometry.log_prob(problem, draws) - surrogate.log_prob(draws)
    return off - np.median(off)


def test_follows_a_thin_bent_sheet():
    """The banana is quadratic, so that the surrogate differs by its heavier tails alone.

    The t density of 31 degrees of freedom is within a tenth of the normal one up to 1.65 standard deviations.
    """
    problem = Banana()
    geometry, surrogate, draws = learned(problem)
    assert np.quantile(np.abs(errors(problem, geometry, surrogate, draws)), 0.9) < 0.3
    sheet = geometry.parameters(draws)
    assert np.std(sheet[:, 1]) > 10 * problem.width
    # A few hundred draws know their standard deviation to a few per cent; that of the t density is 3 % larger.
    assert np.std(sheet[:, 1] + sheet[:, 0] ** 2) == pytest.approx(problem.width, rel=0.2)


def test_straightening_finds_the_bend():
    """In the coordinates that learning leaves behind, the ridge of the banana is a straight line."""
    problem = Banana()
    geometry, _, _ = learned(problem)
    x = geometry.parameters(np.column_stack([np.zeros(9), np.linspace(-2, 2, 9)]))
    assert np.ptp(x[:, 0]) > 2.0
    # The ridge is x1 = -x0^2; the fit is of a few hundred draws that scatter by the width about it.
    np.testing.assert_allclose(x[:, 1], -(x[:, 0] ** 2), atol=problem.width)


def test_linear_problems_are_whitened():
    """Straightened coordinates of a linear problem are the standard normal ones again, null direction included."""
    problem, _ = ill_conditioned()
    geometry, surrogate, draws = learned(problem)
    # Six coordinates of some three hundred draws of a density with slightly heavier tails than normal.
    assert np.abs(draws.mean(axis=0)).max() < 0.3
    np.testing.assert_allclose(draws.std(axis=0), 1.0, atol=0.3)
    assert np.quantile(np.abs(errors(problem, geometry, surrogate, draws)), 0.9) < 1.0


def test_prior_and_data_at_odds():
    """Eight prior sds apart, half way each at the mode: the residuals there are large, and the posterior is no tail."""
    problem, _ = ill_conditioned()
    scaled = problem.matrix * problem.prior.sd
    direction = np.linalg.svd(scaled, full_matrices=False)[2][3]  # as well known before as by the data
    far = Linear(problem.matrix, scaled @ (8.0 * direction) + problem.matrix @ problem.prior.mean, problem.prior)
    geometry, surrogate, draws = learned(far)
    assert np.linalg.norm((far.mean - far.prior.mean) / far.prior.sd) == pytest.approx(4.0, rel=0.1)
    np.testing.assert_allclose(draws.std(axis=0), 1.0, atol=0.3)
    assert np.quantile(np.abs(errors(far, geometry, surrogate, draws)), 0.9) < 1.0


def test_gradient():
    """Against central differences, through features, bends and prior."""
    problem = Banana()
    _, surrogate, draws = learned(problem)
    shifts = 1e-5 * np.eye(2)
    for temperature in (1.0, 2.0):
        log_prob, gradients = surrogate.with_gradient(draws[:5], temperature)
        np.testing.assert_array_equal(log_prob, surrogate.log_prob(draws[:5], temperature))
        for y, gradient in zip(draws[:5], gradients, strict=True):
            plus, minus = (surrogate.log_prob(y + sign * shifts, temperature) for sign in (1, -1))
            np.testing.assert_allclose(gradient, (plus - minus) / 2e-5, rtol=1e-6, atol=1e-6)


def test_temperature_widens():
    """At temperature four the surrogate falls off a quarter as fast as the data make it."""
    problem, _ = ill_conditioned()
    geometry, surrogate, draws = learned(problem)
    log_prior = geometry.log_prior(draws)
    cold, hot = surrogate.log_prob(draws) - log_prior, surrogate.log_prob(draws, 4.0) - log_prior
    np.testing.assert_allclose(hot, cold / 4.0, rtol=1e-12, atol=1e-13 * np.abs(log_prior).max())


def test_its_power_is_that_of_the_simulated_likelihood():
    """A likelihood that is the emulated one to some power gives that power, one that has none changes nothing."""
    problem, _ = ill_conditioned()
    geometry, surrogate, draws = learned(problem)
    surrogate.power = 1.0
    log_prior = geometry.log_prior(draws)
    likelihood = surrogate.log_prob(draws) - log_prior
    simulated = log_prior + 0.8 * likelihood
    simulated[0] = -np.inf
    for before in (1.0, 0.6):
        surrogate.power = before
        surrogate.temper(draws, simulated)
        assert surrogate.power == pytest.approx(0.8, rel=1e-9)
    surrogate.temper(draws, log_prior + 1.3 * likelihood)
    assert surrogate.power == 1.0


def test_errors_of_the_emulator_lower_the_power(rng):
    """Noise of its log likelihood flattens the regression: the power is the share of the variance without noise."""
    problem, _ = ill_conditioned()
    geometry, surrogate, draws = learned(problem)
    surrogate.power = 1.0
    log_prior = geometry.log_prior(draws)
    ours = surrogate.log_prob(draws) - log_prior
    share = 0.9
    simulated = share * ours + np.sqrt(share * (1.0 - share)) * np.std(ours) * rng.standard_normal(len(ours))
    surrogate.temper(draws, log_prior + simulated)
    assert surrogate.power == pytest.approx(share, abs=4.0 * np.sqrt(share * (1.0 - share) / len(ours)))


def test_failed_simulations_are_left_out():
    """Where the simulation fails nothing is learned, and nothing breaks."""
    _, surrogate, draws = learned(Cliff())
    assert np.isfinite(surrogate.polynomials.linear).all()
    assert np.isfinite(draws).all()


def test_the_same_seed_gives_the_same_surrogate():
    """Learning depends on the generator alone, which is what lets a run be resumed."""
    first, second, other = (learned(Banana(), seed)[1].polynomials.linear for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, second)
    assert first.shape != other.shape or not np.array_equal(first, other)


class Box(Toy):
    """Twenty parameters within bounds, of which the sum is read."""

    def __init__(self):
        super().__init__(Uniform(-np.ones(20), np.ones(20)))

    def residuals(self, parameters):
        self.costs.simulations += len(parameters)
        return np.sum(parameters, axis=1, keepdims=True)

    def slopes(self, _):
        return np.ones((1, 20))


def test_walks_lead_out_of_corners():
    """From next to twenty walls at once flights without bounces all end outside; some of the walks bounce."""
    geometry, surrogate, _ = learned(Box())
    corner = 0.99 * np.where(np.arange(20) % 2, 1.0, -1.0)
    z = np.linalg.solve(geometry.basis, geometry.prior.scaled(corner) - geometry.mode)
    y = np.repeat(geometry.straightened(z[None]), 64, axis=0)
    rng = np.random.default_rng(4)
    for flies in (True, False):  # whatever else is taken
        surrogate.flies = flies
        _, long = surrogate.walks()
        assert np.mean([np.any(walk(y, rng)[0] != y, axis=1).mean() for walk in long]) > 0.3
    surrogate.flies = True
    _, (*_, flight) = surrogate.walks()
    np.testing.assert_array_equal(flight(y, rng)[0], y)


@pytest.mark.parametrize("bounded", [True, False])
def test_within_bounds_it_has_only_products_that_explain_something(bounded):
    """The banana is a square: within bounds neither the cube nor the fourth power is kept."""
    problem = Banana()
    if bounded:
        problem.prior = Uniform(np.array([-2.0, -5.0]), np.array([2.0, 5.0]))
    _, surrogate, _ = learned(problem)
    np.testing.assert_array_equal(surrogate.polynomials.chosen, [True, not bounded, not bounded])


@pytest.mark.parametrize(("problem", "is_normal"), [(ill_conditioned()[0], True), (Banana(), False)])
def test_a_long_record_has_a_normal_surrogate_if_it_is_normal(monkeypatch, problem, is_normal):
    """The squares of its rows are the deviance of a linear problem; of a bent one its draws are refused."""
    monkeypatch.setattr(surrogates, "_LONG", 0.0)
    geometry, adapted = Geometry.whitened(problem, gauss_newton(problem).values), []
    surrogate, draws = learn(problem, geometry, np.random.default_rng(3), adapt=adapted.append)
    assert (surrogate.polynomials.active.shape[1] == 0 and len(adapted) == 1) == is_normal
    if is_normal:
        squares = np.sum(surrogate.polynomials(geometry.bent(draws)) ** 2, axis=1)
        deviances = -2.0 * problem.log_likelihood(geometry.parameters(draws))
        np.testing.assert_allclose(np.diff(squares), np.diff(deviances), atol=1e-3)


@pytest.mark.parametrize("scale", [0.0, 1e-9, 1e-3])
def test_data_that_say_nothing_leave_the_prior(scale):
    """There is nothing that the emulated likelihood could be tempered by."""
    priors = {"a": bs.priors.normal(1.0, 2.0), "b": bs.priors.normal(0.0, 1.0)}
    model = bs.LeastSquaresModel(lambda x: scale * x, priors, vectorized=True)
    posterior = bs.sample(model, rng=np.random.default_rng(1), max_steps=3000)
    assert posterior.converged
    np.testing.assert_allclose(posterior.mean, [1.0, 0.0], atol=0.1)
    np.testing.assert_allclose(posterior.sd, [2.0, 1.0], rtol=0.05)
