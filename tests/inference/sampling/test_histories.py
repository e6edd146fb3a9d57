"""Histories of forces: integrated out against closed forms, and sampled with all other parameters."""

import numpy as np
import pytest
from scipy import optimize
from support.toys import AGREE, Pushed

import bayesub as bs
from bayesub.inference.baselines import gauss_newton, posterior_mode
from bayesub.inference.checks import convergence
from bayesub.inference.sampling import nuts, sampler
from bayesub.inference.sampling.histories import marginal_mode, with_process
from bayesub.inference.sampling.marginalised import Marginalised
from bayesub.inference.sampling.posterior import Criteria

PLACES = np.array([[0.4, 1.5], [0.2, 0.8], [0.55, 2.5], [0.4, 0.3]])


@pytest.fixture(scope="module")
def toy():
    return Pushed()


@pytest.fixture(scope="module")
def marginalised(toy):
    """Fitted to draws that are wider than the posterior."""
    rng = np.random.default_rng(1)
    mode = posterior_mode(toy.with_wide_process(), rng=rng)
    marginalised = marginal_mode(toy, with_process(toy, mode))[0]
    marginalised.fit(marginalised.prior.sample(rng, 40), rng)
    return marginalised


def test_the_density_without_histories_is_the_closed_form(toy, marginalised):
    """Readings are normal given the others, whose response is linear; the constant is the same everywhere."""
    exact = np.array([toy.marginal(*place) for place in PLACES])
    np.testing.assert_allclose(np.diff(marginalised.log_likelihood(PLACES)), np.diff(exact), atol=1e-6)


def test_an_exact_one_is_right_far_from_its_centre(toy):
    """Also in batches; the response at the centre alone is wrong there, and so is the mode that it leads to."""
    centre, places = toy.prior.parameters(np.full(toy.n_params, 0.5)), np.tile(PLACES, (20, 1))
    expected = np.diff([toy.marginal(*place) for place in places])
    found = Marginalised(toy, centre, exact=True).log_likelihood(places)
    np.testing.assert_allclose(np.diff(found), expected, atol=1e-6)
    assert np.abs(np.diff(Marginalised(toy, centre).log_likelihood(places)) - expected).max() > 0.1


def test_the_marginal_mode_is_that_of_the_closed_form(toy):
    """To a tenth of a posterior sd, from afar; by the response where the search begins it is a whole one off."""
    start = with_process(toy, posterior_mode(toy.with_wide_process(), rng=np.random.default_rng(1)))
    start[0] = 1.2
    marginalised, values = marginal_mode(toy, start)
    prior, sds = marginalised.prior, np.sqrt(toy.moments()[1])

    def height(x):
        return toy.marginal(*prior.unscaled(x[None])[0]) + prior.scaled_log_density(x[None])[0]

    best = prior.unscaled(optimize.minimize(lambda x: -height(x), prior.scaled(values), method="Nelder-Mead").x[None])

    def off(values):
        theta, s = np.ravel(best)
        return np.abs([values[0] - theta, np.log(values[1] / s)]) / sds

    assert off(values).max() < 0.1
    rough = Marginalised(toy, start)
    assert off(gauss_newton(rough, rough.centre[rough.others]).values).max() > 1.0


def test_residuals_and_deviance_agree(marginalised):
    """The squares of the residuals, the determinant among them, sum to the deviance."""
    squares = np.sum(marginalised.residuals(PLACES) ** 2, axis=1)
    np.testing.assert_allclose(squares, marginalised.misfit(PLACES)[1], rtol=1e-9)
    np.testing.assert_allclose(np.diff(marginalised.log_likelihood(PLACES)), -0.5 * np.diff(squares), atol=1e-6)


def test_the_jacobian_is_that_of_the_residuals(marginalised):
    """Against differences of another length."""
    place, step = np.array([0.4, 1.5]), 1e-4
    sides = marginalised.residuals(place + step * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]))
    np.testing.assert_allclose(marginalised.jacobian(place), (sides[:2] - sides[2:]).T / (2.0 * step), atol=1e-4)


def test_the_density_with_y_is_exact_whatever_the_expansion(toy, marginalised):
    """Elsewhere in psi too: log likelihood, prior of w, and the derivative of w by y, by differences."""
    other = Marginalised(toy, toy.prior.parameters(np.full(toy.n_params, 0.5)))
    for part in (marginalised, other):
        place, y = PLACES[:1], np.random.default_rng(2).standard_normal((1, toy.N_WHITE))
        log_density, full = part.density(toy, place, y)
        steps = 1e-5 * np.eye(toy.N_WHITE)
        moved = part.density(toy, np.repeat(place, 2 * toy.N_WHITE, axis=0), np.vstack([y + steps, y - steps]))[1]
        by_y = (moved[: toy.N_WHITE] - moved[toy.N_WHITE :])[:, 2:] / 2e-5
        expected = toy.log_likelihood(full)[0] - 0.5 * np.sum(full[0, 2:] ** 2) + np.linalg.slogdet(by_y)[1]
        assert log_density[0] == pytest.approx(expected, abs=1e-6)


def test_the_mode_of_all_parameters_is_not_that_of_the_others(toy, marginalised):
    """Negative control of the determinant: the sd of the forces has no mode together with their histories."""
    means, variances = toy.moments()
    mode = gauss_newton(marginalised, marginalised.centre[:2]).values
    assert abs(np.log(mode[1]) - means[1]) < 0.5 * np.sqrt(variances[1])
    joint = gauss_newton(toy).values
    assert np.log(joint[1]) - means[1] > 2.0 * np.sqrt(variances[1])


@pytest.mark.slow
def test_samples_the_closed_form(toy):
    """Moments of theta and of the sd of the forces are those of quadrature; those of another record are not."""
    criteria = Criteria(ess=2000.0)
    posterior = bs.sample(toy, rng=np.random.default_rng(5), n_walkers=16, criteria=criteria, max_steps=4000)
    assert posterior.converged
    others = np.stack([posterior.chain[..., 0], np.log(posterior.chain[..., 1])], axis=-1)
    n = convergence.ess(others)

    def off(problem):
        means, variances = problem.moments()
        return np.abs(others.mean(axis=(0, 1, 2)) - means) / np.sqrt(variances / n)

    assert off(toy).max() < AGREE
    assert off(Pushed(seed=4)).max() > 3 * AGREE


def test_resuming_is_bit_identical(toy, tmp_path, monkeypatch):
    """Also of parameters, which cost a simulation, across blocks of a step or two."""
    endless = Criteria(ess=1e12)

    def run(folder, max_steps):
        rng = np.random.default_rng(7)
        return bs.sample(toy, rng=rng, n_walkers=8, max_steps=max_steps, criteria=endless, checkpoint=folder)

    straight = run(None, 120)
    monkeypatch.setattr(sampler, "BLOCK_SECONDS", 0.0)
    run(tmp_path / "chain", 100)
    resumed = run(tmp_path / "chain", 120)
    np.testing.assert_array_equal(resumed.chain, straight.chain)
    np.testing.assert_array_equal(resumed.log_prob, straight.log_prob)


@pytest.mark.slow
def test_nuts_agrees():
    """Another sampler, in coordinates of its own, for which a noise that leaves the forces some room is easier."""
    pytest.importorskip("nutpie")
    toy = Pushed(sd=5.0)
    criteria = Criteria(ess=1000.0)
    posterior = bs.sample(toy, rng=np.random.default_rng(5), n_walkers=16, criteria=criteria, max_steps=4000)
    check = nuts.cross_check(toy, posterior, rng=np.random.default_rng(6), n_draws=1200)
    assert check.verdict == "agree", check.sentence


def test_the_response_is_learned(toy, marginalised):
    """Negative control: the density by the response at the centre alone is not the closed form."""
    exact = np.array([toy.marginal(*place) for place in PLACES])
    other = Marginalised(toy, marginalised.centre)
    assert np.abs(np.diff(other.log_likelihood(PLACES)) - np.diff(exact)).max() > 0.1


def test_what_was_learned_is_restored(toy, marginalised):
    """Bit for bit, without a simulation."""
    before = toy.costs.simulations
    restored = Marginalised(toy, marginalised.centre, marginalised.arrays())
    assert toy.costs.simulations == before
    np.testing.assert_array_equal(restored.log_likelihood(PLACES), marginalised.log_likelihood(PLACES))


def test_where_a_simulation_fails_there_is_no_density(toy, marginalised, monkeypatch):
    """And no error stops a search, nor other members of the batch."""
    residuals = toy.residuals

    def failing(parameters, *predicted):
        return np.where(parameters[:, :1] > 0.5, np.nan, residuals(parameters, *predicted))

    monkeypatch.setattr(toy, "residuals", failing)
    fails = PLACES[:, 0] > 0.5
    np.testing.assert_array_equal(np.isfinite(marginalised.log_likelihood(PLACES)), ~fails)
    np.testing.assert_array_equal(np.isinf(marginalised.misfit(PLACES)[1]), fails)
