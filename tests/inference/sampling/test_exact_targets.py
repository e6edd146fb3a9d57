"""The sampler on hard posteriors in closed form: ill-conditioned, high-dimensional, and cut off by bounds."""

import numpy as np
import pytest
from support.toys import AGREE, Linear, disagreement, ill_conditioned, second_moments, standardised

import bayesub as bs
from bayesub.problem.priors import Normal, Uniform


@pytest.mark.parametrize(
    "singular_values",
    [
        pytest.param(10.0 ** np.linspace(5, 0, 8), id="condition number 1e10"),
        pytest.param(
            np.concatenate([10.0 ** np.linspace(4, -2, 90), np.zeros(10)]), id="100 dimensions", marks=pytest.mark.slow
        ),
    ],
)
def test_normal_posteriors(singular_values):
    """All first and second moments of the closed form; and negative control, not those of a wrong noise.

    The covariance has the condition number 1 + s^2 of the largest singular value, in prior standard deviations.
    """
    problem, _ = ill_conditioned(singular_values=singular_values)
    posterior = bs.sample(problem, rng=np.random.default_rng(3))
    assert posterior.converged
    n = len(singular_values)
    some = slice(None) if n < 20 else slice(0, None, 5)  # features of all would not fit into memory
    features = second_moments(problem.standardised(posterior.chain)[..., some])
    assert disagreement(features) < AGREE
    wrong = Linear(problem.matrix, problem.readings, problem.prior, sd=1.5)
    features = second_moments(wrong.standardised(posterior.chain)[..., some])
    assert disagreement(features) > 2 * AGREE


@pytest.mark.slow
def test_bounds_cut_a_normal_off():
    """Moments within bounds that hold a small part of the likelihood, against rejection sampling.

    Two coordinates are stiff and correlated across the walls, one ends at a wall and one is not seen at all.
    """
    matrix = np.array([[4.0, 3.0, 0.0, 0.0], [1.0, -1.0, 2.0, 0.0], [0.0, 0.0, 1.5, 0.0]])
    lower, upper = np.array([-1.0, -1.0, 0.0, -2.0]), np.ones(4)
    problem = Linear(matrix, np.array([4.0, 0.5, -0.5]), Uniform(lower, upper))
    rng = np.random.default_rng(6)
    proposals = rng.uniform(lower, upper, (3_000_000, 4))
    exact = proposals[np.log(rng.random(len(proposals))) < problem.log_likelihood(proposals)]
    posterior = bs.sample(problem, rng=rng)
    assert posterior.converged
    mean, covariance = exact.mean(axis=0), np.cov(exact.T)
    # Some hundred thousand accepted ones have a twentieth of the chain's variance: that much of the error is theirs.
    assert len(exact) > 20 * posterior.bulk_ess.max()
    assert disagreement(second_moments(standardised(posterior.chain, mean, covariance))) < AGREE
    assert np.all((posterior.draws >= lower) & (posterior.draws <= upper))
    # Negative control: the normal that nothing cuts off.
    flat = Linear(matrix, problem.readings, Normal(problem.prior.mean, 1e3 * problem.prior.sd))
    assert disagreement(second_moments(standardised(posterior.chain, flat.mean, covariance))) > 2 * AGREE
