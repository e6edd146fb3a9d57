"""A sampler that goes nowhere ends early, and says so; one that is slow and arrives is left to arrive."""

import numpy as np
import pytest
from support.toys import Toy

import bayesub as bs
from bayesub.inference.sampling import Posterior
from bayesub.problem.priors import Normal


class Rough(Toy):
    """A bowl with a texture of wells, far finer than the bowl, that neither Jacobian nor polynomial sees."""

    def __init__(self, n, depth):
        super().__init__(Normal(np.zeros(n), np.ones(n)))
        self.depth = depth

    def residuals(self, parameters):
        self.costs.simulations += len(parameters)
        return np.concatenate([0.3 * parameters, self.depth * np.sin(300.0 * parameters)], axis=1)

    def slopes(self, _):
        return np.concatenate([0.3 * np.eye(self.n_params), np.zeros((self.n_params, self.n_params))])


@pytest.fixture(scope="module")
def lost(tmp_path_factory):
    """Twelve parameters, of whose proposals one in thirty falls into a well as deep; and its checkpoint."""
    folder = tmp_path_factory.mktemp("lost") / "chain"
    return bs.sample(Rough(12, 3.0), rng=np.random.default_rng(0), max_steps=4000, checkpoint=folder), folder


def test_sampling_that_goes_nowhere_ends_early(lost):
    """After a tenth of the steps, with what is wrong and what to try."""
    posterior, _ = lost
    assert posterior.acceptance < 0.06
    assert posterior.n_warmup + posterior.n_steps <= 1000
    assert not posterior.converged
    assert "of the proposals are accepted, and more steps are of little use: see whether" in posterior.shortcomings[0]
    assert "narrow the prior or free fewer coefficients" in posterior.shortcomings[0]


def test_what_there_is_is_kept_as_not_converged(lost, tmp_path):
    """In a file, and in the checkpoint, from which more steps than were allowed go on."""
    posterior, folder = lost
    posterior.save(tmp_path / "posterior.nc")
    kept = Posterior.load(tmp_path / "posterior.nc")
    assert not kept.converged
    assert kept.shortcomings == posterior.shortcomings
    again = {"rng": np.random.default_rng(0), "checkpoint": folder}
    same = bs.sample(Rough(12, 3.0), max_steps=4000, **again)
    np.testing.assert_array_equal(same.chain, posterior.chain)
    longer = bs.sample(Rough(12, 3.0), max_steps=8000, **again)
    assert longer.n_steps > posterior.n_steps


def test_few_acceptances_alone_do_not_end_it():
    """With shallower wells in one parameter proposals are refused too, and the chain arrives."""
    posterior = bs.sample(Rough(2, 3.0), rng=np.random.default_rng(0), max_steps=8000)
    assert posterior.converged
