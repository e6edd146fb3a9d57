"""The second sampler: it agrees on a known posterior, and sees a planted disagreement."""

import signal
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from support.refusals import refused
from support.toys import Banana, Linear, ill_conditioned

import bayesub as bs
from bayesub.inference.checks import convergence
from bayesub.inference.sampling import nuts as module
from bayesub.inference.sampling.moments import Moments
from bayesub.inference.sampling.posterior import STANDARD
from bayesub.problem.priors import Normal, Uniform
from bayesub.report.plots.checks import draw_cross_check


def ensemble(problem, rng, n_steps=400):
    """Independent draws from a linear problem's posterior, as if sampled by four ensembles of 20 walkers."""
    factor = np.linalg.cholesky(problem.covariance)
    chain = problem.mean + rng.standard_normal((4, n_steps, 20, problem.n_params)) @ factor.T
    log_prob, prior = np.zeros(chain.shape[:3]), problem.prior
    return bs.Posterior(problem.names, chain, log_prob, prior.mean, prior.sd, 0, 0.5, 1, 1.0, {})


@pytest.fixture(scope="module")
def problem():
    """Linear with condition 10, so that draws in parameters are exact."""
    problem, _ = ill_conditioned(sd=1e3)
    return problem


def exact(problem, rng, n_draws=1000):
    """Draws (4, n_draws, n_params) that NUTS would make, independent."""
    factor = np.linalg.cholesky(problem.covariance)
    return problem.mean + rng.standard_normal((4, n_draws, problem.n_params)) @ factor.T


def compared(posterior, draws, *given, **named):
    return module.compare(posterior, Moments.of_chain(draws), *given, **named)


def test_equal_posteriors_agree(problem, rng):
    """In a hundred comparisons about one false alarm, and z that are standard normal."""
    checks = [compared(ensemble(problem, rng), exact(problem, rng, 400)) for _ in range(40)]
    z = np.concatenate([np.concatenate([c.mean_z, c.sd_z, c.correlation_z]) for c in checks])
    assert len(z) == 40 * (6 + 6 + 15)
    # Of about 1000 numbers the sd is known to 2-3 %; tau is never below 1, so that standard errors are a little wide.
    assert z.std() == pytest.approx(1.0, abs=0.1)
    assert sum(c.verdict == "disagree" for c in checks) <= 2


@pytest.mark.parametrize(
    ("plant", "what"),
    [
        (lambda draws: draws + np.eye(6)[2] * 0.3, "the mean of c2"),
        (lambda draws: draws * (1.0 + 0.25 * np.eye(6)[4]), "the sd of c4"),
        (lambda draws: draws + 0.3 * draws[..., [5]] * np.eye(6)[1], "the correlation of c1 with c5"),
    ],
)
def test_a_planted_disagreement_is_found_and_named(problem, rng, plant, what):
    """A third of a posterior sd, a quarter of an sd, a correlation of 0.3."""
    scale = np.sqrt(np.diag(problem.covariance))
    factor = np.linalg.cholesky(problem.covariance / np.outer(scale, scale))
    white = rng.standard_normal((4, 1000, 6))
    draws = plant(white) if "correlation" in what else plant(white @ factor.T)
    if "correlation" in what:
        draws = draws @ factor.T
    check = compared(ensemble(problem, rng), problem.mean + scale * draws)
    assert check.verdict == "disagree"
    if "correlation" not in what:  # a correlation in white coordinates is spread over several in parameters
        assert f"in {what}," in check.sentence
    assert "disagrees beyond Monte Carlo error" in check.sentence


def test_nuts_that_has_not_converged_proves_nothing(problem, rng):
    draws = exact(problem, rng)
    draws[1] += 0.5 * np.sqrt(np.diag(problem.covariance))
    check = compared(ensemble(problem, rng), draws)
    assert check.verdict == "inconclusive"
    assert "nothing follows" in check.sentence
    # Trajectories diverge where steps are too long for the density: what lies there is not drawn.
    assert compared(ensemble(problem, rng), exact(problem, rng), divergences=8).verdict == "agree"
    diverged = compared(ensemble(problem, rng), exact(problem, rng), divergences=9)
    assert diverged.verdict == "inconclusive"
    assert "9 divergent trajectories" in diverged.sentence


@pytest.mark.rendered
def test_it_is_saved_and_drawn(problem, rng, tmp_path):
    check = compared(ensemble(problem, rng), exact(problem, rng))
    again = module.CrossCheck.from_json(check.to_json())
    assert again.sentence == check.sentence
    np.testing.assert_array_equal(again.correlation_z, check.correlation_z)
    draw_cross_check(tmp_path / "check.png", check)
    assert (tmp_path / "check.png").stat().st_size > 5000


def test_moments_that_were_stored_say_the_same_as_the_draws(problem, rng, tmp_path):
    """What NUTS has cost hours for is compared with every further engine, from a file of its moments."""
    moments = Moments.of_chain(exact(problem, rng))
    np.savez(tmp_path / "moments.npz", **moments.arrays())
    with np.load(tmp_path / "moments.npz") as arrays:
        again = Moments.restored(dict(arrays))
    ours = ensemble(problem, rng)
    assert module.compare(ours, again).to_json() == module.compare(ours, moments).to_json()
    scale = np.sqrt(np.diag(problem.covariance))
    pairs = np.triu_indices(problem.n_params, 1)
    np.testing.assert_allclose(moments.means, problem.mean, atol=4.5 * scale.max() / np.sqrt(4000))
    np.testing.assert_allclose(moments.sds, scale, rtol=4.5 / np.sqrt(8000))
    np.testing.assert_allclose(moments.correlations, (problem.covariance / np.outer(scale, scale))[pairs], atol=0.075)
    # Independent draws: the variances of x, x^2 and x y are 1, 2 and 1 + rho^2.
    np.testing.assert_allclose(moments.mean_errors, np.sqrt(1.0 / 4000), rtol=0.1)
    np.testing.assert_allclose(moments.square_errors, np.sqrt(2.0 / 4000), rtol=0.15)
    np.testing.assert_allclose(moments.product_errors, np.sqrt((1.0 + moments.correlations**2) / 4000), rtol=0.15)


def test_costs_stand_beside_each_other(problem, rng):
    """A Jacobian at its price over the bulk ESS of the worst parameter; unknown of what knows no price."""
    ours = replace(ensemble(problem, rng), evaluations=9000, jacobians=20, jacobian_price=50.0, seconds=3.0)
    draws = exact(problem, rng)
    check = compared(ours, draws, spent=(4000, 2000, 7.0))
    first, second = check.efforts
    assert (first.work, second.work) == (10_000.0, 104_000.0)
    assert first.ess == ours.bulk_ess.min()
    assert second.ess == convergence.bulk_ess(draws[:, :, None]).min()
    assert second.per_effective_sample == second.work / second.ess
    assert check.sentence.endswith(
        f"cost {first.per_effective_sample:.3g} simulations here and {second.per_effective_sample:.3g} there."
    )
    assert module.CrossCheck.from_json(check.to_json()).efforts == check.efforts
    assert compared(replace(ours, jacobian_price=float("nan")), exact(problem, rng), spent=(1, 1, 1.0)).efforts == ()


def test_without_nutpie_one_line_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "nutpie", None)
    with refused("install", "nutpie"):
        module.require_nutpie()


@pytest.mark.slow
def test_nuts_and_emcee_agree_on_a_bent_sheet():
    """Exact gradients through the straightened coordinates: both samplers give the banana; a wider one is noticed."""
    _nutpie_or_skip()
    problem, rng = Banana(), np.random.default_rng(3)
    # As long as the study runs it: the shortest chains differ by chance one time in twenty.
    posterior = bs.sample(problem, rng=rng, n_walkers=16, criteria=replace(STANDARD, ess=10_000))
    before = problem.costs.simulations, problem.costs.jacobians
    check = bs.cross_check(problem, posterior, rng=np.random.default_rng(4))
    assert check.verdict == "agree", check.sentence
    ours, nuts = check.efforts
    assert (ours.simulations, ours.jacobians) == before
    assert (ours.simulations + nuts.simulations, ours.jacobians + nuts.jacobians) == (
        problem.costs.simulations,
        problem.costs.jacobians,
    )
    assert nuts.jacobians >= check.gradients  # and those of the search for coordinates
    wider = bs.cross_check(Banana(reach=2.0), posterior, rng=np.random.default_rng(4))
    assert wider.verdict == "disagree", wider.sentence


@pytest.mark.slow
def test_nuts_goes_within_bounds():
    """In coordinates in which bounds are at infinity: a normal cut off at a bound, and a uniform of which nothing is
    read, have the means and variances of their closed forms, and hardly a trajectory diverges."""
    _nutpie_or_skip()
    prior = Uniform(np.array([-1.0, -2.0]), np.array([4.0, 3.0]))
    problem = Linear(np.array([[1.0, 0.0]]), np.array([-0.5]), prior)
    draws, counts = module.sample_nuts(problem, rng=np.random.default_rng(3), n_draws=1000, n_tune=200, n_chains=2)
    cut = stats.truncnorm(-0.5, 4.5, -0.5, 1.0)
    for k, law in enumerate((cut, stats.uniform(-2.0, 5.0))):
        mean = law.mean()
        for moment, truth in ((draws[..., k], mean), ((draws[..., k] - mean) ** 2, law.var())):
            error = moment.std() / np.sqrt(convergence.ess(moment[:, :, None, None]))[0]
            assert abs(moment.mean() - truth) < 4.0 * error
    assert counts["divergences"] <= 4


class Stepped(Linear):
    """Eight independent normals of variance 1/2, each e times less likely above zero than below."""

    def __init__(self):
        super().__init__(np.eye(8), np.zeros(8), Normal(np.zeros(8), np.ones(8)))

    def log_likelihood(self, parameters):
        return super().log_likelihood(parameters) - np.count_nonzero(np.atleast_2d(parameters) > 0.0, axis=1)


@pytest.mark.slow
def test_jumps_that_no_gradient_shows_do_not_stop_nuts():
    """Means and variances are right, for the gradients that a smooth density takes and not hundreds a draw."""
    _nutpie_or_skip()
    draws, counts = module.sample_nuts(Stepped(), rng=np.random.default_rng(3), n_draws=1000, n_tune=200, n_chains=2)
    mean = -np.tanh(0.5) / np.sqrt(np.pi)
    for moment, truth in ((draws, mean), ((draws - mean) ** 2, 0.5 - mean**2)):
        chain = moment[:, :, None]
        error = moment.std(axis=(0, 1)) / np.sqrt(convergence.ess(chain))
        z = (moment.mean(axis=(0, 1)) - truth) / error
        assert np.abs(z).max() < 4.0  # 3 is passed by chance once in 25
    assert counts["gradients"] < 20 * 2400
    assert counts["divergences"] == 0


class Stopped(Linear):
    """A standard normal whose user presses Ctrl-C at one of the gradients that NUTS takes of it."""

    gradients = 0

    def __init__(self, at):
        super().__init__(np.eye(3), np.zeros(3), Normal(np.zeros(3), np.ones(3)))
        self.at = at

    def jacobian(self, parameters):
        self.gradients += 1
        if self.gradients == self.at:
            signal.raise_signal(signal.SIGINT)
        return super().jacobian(parameters)


@pytest.mark.parametrize("at", [200, 3000], ids=["tuning", "drawing"])
def test_ctrl_c_ends_nuts_with_no_draws(at):
    """nutpie hands over what it has got, and the rest is not numbers: no moments of them are those of the posterior."""
    _nutpie_or_skip()
    problem = Stopped(at)
    with pytest.raises(KeyboardInterrupt):
        module.sample_nuts(problem, rng=np.random.default_rng(3), n_draws=100_000, n_tune=100, n_chains=2)
    assert at <= problem.gradients < 400_000


def _nutpie_or_skip():
    try:
        module.require_nutpie()
    except bs.InputError:
        pytest.skip("nutpie is not installed")


def test_a_part_is_the_comparison_of_some_parameters(problem, rng):
    check = compared(ensemble(problem, rng), exact(problem, rng))
    part = check.part([check.names[3], check.names[1]])
    assert part.names == (check.names[1], check.names[3])
    assert np.array_equal(part.mean_z, check.mean_z[[1, 3]])
    assert part.correlation_z == pytest.approx([check.correlation_z[check.pairs.index(part.pairs[0])]])
