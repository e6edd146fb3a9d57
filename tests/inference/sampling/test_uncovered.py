"""Parts of a posterior that no walk comes to: found by values of the prior, drawn from then on, and never lost."""

import numpy as np
import pytest
from support.toys import Linear, Toy, ill_conditioned

import bayesub as bs
from bayesub.inference.baselines import posterior_mode
from bayesub.inference.sampling import sampler
from bayesub.inference.sampling.geometry import Geometry, redrawn
from bayesub.inference.sampling.posterior import PROBES
from bayesub.problem.distributions import CorrelatedNormal, Joint, LogNormal
from bayesub.problem.priors import Normal, Uniform
from bayesub.problem.shared_scale import SharedScale


class NotLarge(Toy):
    """``scale(c0)`` is read as zero with a unit sd, and c1 as one: c0 may be as small as its prior lets it be."""

    def __init__(self, prior, log_scale):
        super().__init__(Joint((prior, Normal(np.zeros(1), np.ones(1))), (np.array([0]), np.array([1]))))
        self.log_scale = log_scale

    def residuals(self, parameters):
        self.costs.simulations += len(parameters)
        return np.stack([np.exp(self.log_scale(parameters[:, 0])), (parameters[:, 1] - 1.0) / 0.1], axis=1)

    def slopes(self, parameters):
        at = parameters[0] + np.array([-0.5e-6, 0.5e-6]) * max(abs(parameters[0]), 1e-300)
        values = np.exp(self.log_scale(at))
        return np.diag([(values[1] - values[0]) / (at[1] - at[0]), 10.0])

    def below(self, draws):
        """The probability of values below each draw (n,) of c0, by quadrature over its prior."""
        t = np.linspace(-9.0, 9.0, 100_001)
        values = self.prior.parameters(np.stack([t, t], axis=1))[:, 0]
        density = np.exp(-0.5 * t**2 - 0.5 * np.exp(2.0 * self.log_scale(values)))
        return np.interp(draws, values, np.cumsum(density) / density.sum())


WIDE = {
    "log_sd 5": NotLarge(LogNormal(np.ones(1), np.array([5.0])), np.log),
    "log_sd 8": NotLarge(LogNormal(np.ones(1), np.array([8.0])), np.log),
    "six decades": NotLarge(Uniform(np.array([-6.0]), np.zeros(1)), lambda c: (c + 2.0) * np.log(10.0)),
}


def far_off(problem, seed):
    """By how many standard errors shares of draws below quantiles of the posterior are off, at most."""
    posterior = bs.sample(problem, rng=np.random.default_rng(seed))
    assert posterior.converged
    shares, exact = problem.below(posterior.draws[:, 0]), np.array([0.02, 0.05, 0.2, 0.8])
    found = (shares[:, None] < exact).mean(axis=0)
    ess = min(posterior.bulk_ess[0], posterior.tail_ess[0])
    return np.max(np.abs(found - exact) / np.sqrt(exact * (1.0 - exact) / ess))


@pytest.mark.parametrize("problem", WIDE.values(), ids=WIDE)
def test_a_tail_that_no_walk_comes_to_is_sampled(problem):
    """Of readings that say only "not large", against quadrature; four standard errors are one in 16,000."""
    assert max(far_off(problem, seed) for seed in range(1, 3)) < 4.0


def test_without_values_of_the_prior_it_is_cut_off(monkeypatch):
    """Negative control: a run that counted as converged, with a lower tail that lacks half of its draws."""
    monkeypatch.setattr(sampler, "PROBED", np.inf)
    assert max(far_off(WIDE["log_sd 8"], seed) for seed in range(1, 3)) > 6.0


def test_a_run_whose_moves_have_changed_resumes_to_the_same_bits(tmp_path):
    """Stopped before it was found that more moves are needed, and after it."""
    problem, begun = WIDE["log_sd 8"], []

    class Stopped(Exception):
        pass

    class Stopping:
        def update(self, done, total, unit="", note=""):  # noqa: ARG002
            begun.append(done)
            if unit == "steps" and len(begun) > 3:
                raise Stopped

    whole = bs.sample(problem, rng=np.random.default_rng(2))
    assert whole.n_warmup > 0.1 * (whole.n_warmup + whole.n_steps)  # what came before the moves is left out
    for _ in range(20):
        begun.clear()
        try:
            parts = bs.sample(problem, rng=np.random.default_rng(2), checkpoint=tmp_path, progress=Stopping())
        except Stopped:
            continue
        break
    np.testing.assert_array_equal(parts.chain, whole.chain)
    np.testing.assert_array_equal(parts.unvisited, whole.unvisited)
    assert (parts.n_warmup, parts.acceptance) == (whole.n_warmup, whole.acceptance)


def test_where_walks_come_everywhere_nothing_changes():
    """Parameters of which the data say nothing: every value of the prior is accepted, and hardly one is beyond."""
    for seed in range(4):
        problem, _ = ill_conditioned(singular_values=np.array([10.0, 0.0, 0.0, 0.0]))
        posterior = bs.sample(problem, rng=np.random.default_rng(seed))
        assert posterior.converged
        assert not posterior.uncovered.any()
        assert posterior.n_warmup == round(0.1 * (posterior.n_warmup + posterior.n_steps))


def test_values_where_draws_have_been_are_not_simulated(monkeypatch):
    """Of parameters of which the data say nothing that are nearly all of their prior."""

    def sampled():
        problem, _ = ill_conditioned(singular_values=np.array([10.0, 0.0, 0.0, 0.0]))
        return bs.sample(problem, rng=np.random.default_rng(1))

    probed = sampled()
    monkeypatch.setattr(sampler, "PROBED", np.inf)
    plain = sampled()
    np.testing.assert_array_equal(probed.chain, plain.chain)
    assert 0 < probed.evaluations - plain.evaluations < 0.02 * 4 * PROBES


def test_a_posterior_that_was_saved_says_what_was_not_visited(tmp_path):
    posterior = bs.sample(WIDE["log_sd 5"], rng=np.random.default_rng(1))
    lacking = posterior.given(WIDE["log_sd 5"].prior)
    vars(lacking)["unvisited"] = np.array([40.0, 0.0])
    (sentence,) = lacking.shortcomings
    assert sentence.startswith("c0: of 1024 values of its prior 40 are as likely as the draws")
    lacking.save(tmp_path / "posterior.nc")
    again = bs.Posterior.load(tmp_path / "posterior.nc")
    assert again.shortcomings == lacking.shortcomings
    assert again.part(np.array([1])).converged


PRIORS = {
    "normal": Normal(np.array([1.0, -2.0, 0.5]), np.array([0.1, 3.0, 1.0])),
    "uniform": Uniform(np.array([0.0, -4.0, 0.0]), np.array([2.0, 0.0, 1.0])),
    "log-normal": LogNormal(np.array([1.0, -2.0, 0.5]), np.array([0.1, 0.5, 1.0])),
    "hierarchical": SharedScale(np.array([1.0, -2.0, 0.5]), np.array([0.1, 0.2, 0.4])),
    "correlated": CorrelatedNormal(
        np.array([1.0, -2.0, 0.5]), np.array([[0.2, 0.0, 0.0], [0.1, 0.3, 0.0], [0.0, 0.1, 0.1]])
    ),
}


@pytest.mark.parametrize("prior", PRIORS.values(), ids=PRIORS)
def test_values_of_the_prior_are_accepted_by_the_ratio_of_likelihoods(prior, rng):
    """Whatever the prior and the coordinates; the other standard coordinates stay as they are."""
    matrix = np.array([[8.0, 1.0, 0.0], [0.0, 1.0, 0.3]])
    problem = Linear.__new__(Linear)
    Toy.__init__(problem, prior)
    problem.matrix, problem.readings, problem.sd = matrix, matrix @ prior.guess + 0.1, 0.7
    geometry = Geometry.whitened(problem, posterior_mode(problem, rng=rng).values)
    y = 0.3 * rng.standard_normal((50, 3))
    y = y[np.isfinite(geometry.log_prior(y))]
    anew, factors = redrawn(geometry, [1], y, rng)
    before, after = geometry.parameters(y), geometry.parameters(anew)
    expected = problem.log_likelihood(after) - problem.log_likelihood(before)
    found = geometry.log_prob(problem, anew) - geometry.log_prob(problem, y) + factors
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-8)
    kept = [0, 2]
    np.testing.assert_allclose(prior.standard(after)[:, kept], prior.standard(before)[:, kept], rtol=1e-6, atol=1e-8)
    assert np.ptp(prior.standard(after)[:, 1]) > 2.0
