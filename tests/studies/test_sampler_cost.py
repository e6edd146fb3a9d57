"""Rival samplers, costs and unseen directions, on problems with a known posterior."""

import emcee
import numpy as np
import pytest
from support.toys import ill_conditioned

from bayesub.inference.sampling import Posterior, sample
from thesis import sampler_cost


@pytest.fixture(scope="module")
def toy():
    problem, direction = ill_conditioned(singular_values=np.array([10.0, 3.0, 1.0, 0.0]))
    return problem, direction, sample(problem, rng=np.random.default_rng(2))


def test_a_rival_spends_its_budget_and_samples_the_posterior():
    problem, _ = ill_conditioned(singular_values=np.array([3.0, 1.0]))
    posterior = sampler_cost.rival(problem, lambda: emcee.moves.StretchMove(), np.random.default_rng(1), 40_000)
    cost = sampler_cost.cost(posterior)
    # Each ensemble starts with one more evaluation a walker, and one for the starts.
    assert 40_000 <= cost["evaluations"] < 41_000
    assert cost["per_sample"] == cost["evaluations"] / cost["ess"]
    error = 5 * np.sqrt(np.diag(problem.covariance) / cost["ess"])
    assert np.all(np.abs(posterior.mean - problem.mean) < error)


def test_unseen_directions_have_the_prior(toy):
    """The planted null direction is found, and its mean and sd are the prior's; a chain moved along it is noticed."""
    problem, direction, posterior = toy
    result = sampler_cost.unseen(problem, posterior)
    assert result["n"] == 1
    assert result["departure"] < 4
    moved = posterior.chain + 0.5 * problem.prior.sd * direction
    off = Posterior(
        posterior.names, moved, posterior.log_prob, problem.prior.mean, problem.prior.sd, 0, 0.5, 1, 1.0, {}
    )
    assert sampler_cost.unseen(problem, off)["departure"] > 10
