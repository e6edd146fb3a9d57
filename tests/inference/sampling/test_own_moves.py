"""Moves that a user gives to the sampler: on a normal posterior in closed form, in each ensemble by itself."""

import emcee
import numpy as np
import pytest
from support.refusals import refused
from support.toys import AGREE, disagreement, ill_conditioned, second_moments, standardised

import bayesub as bs

N_WALKERS = 32
LONG = bs.Criteria(ess=2000.0)


class Mirror(emcee.moves.Move):
    """A step to the other side of the mode, accepted or refused; a `scale` below one makes it a wrong move."""

    def __init__(self, scale=1.0):
        self.scale, self.seen = scale, []

    def propose(self, model, state):
        self.seen.append(state.coords.copy())
        proposed = -self.scale * state.coords
        log_prob, blobs = model.compute_log_prob_fn(proposed)
        accepted = np.log(model.random.rand(len(proposed))) < log_prob - state.log_prob
        return self.update(state, emcee.State(proposed, log_prob=log_prob, blobs=blobs), accepted), accepted


def off(problem, moves):
    """How far the moments of a sample are from the closed form, in standard errors."""
    posterior = bs.sample(problem, rng=np.random.default_rng(5), n_walkers=N_WALKERS, criteria=LONG, moves=moves)
    assert posterior.converged
    return disagreement(second_moments(standardised(posterior.chain, problem.mean, problem.covariance)))


@pytest.mark.parametrize(
    "move", [Mirror, lambda: emcee.moves.DEMove(sigma=1e-3)], ids=["own class", "differential evolution"]
)
def test_moves_leave_the_posterior_what_it_is(move):
    """Nine steps of ten are such moves."""
    problem, _ = ill_conditioned()
    assert off(problem, [(move(), 9.0)]) < AGREE


def test_a_wrong_move_is_not_corrected():
    """Negative control: a step that is not its own inverse draws from something else."""
    problem, _ = ill_conditioned()
    assert off(problem, [(Mirror(scale=0.8), 9.0)]) > 2 * AGREE


def test_a_move_sees_one_ensemble_at_a_time():
    """And a move without a weight is taken as often as our own together."""
    problem, _ = ill_conditioned()
    mirror = Mirror()
    bs.sample(problem, rng=np.random.default_rng(1), max_steps=100, moves=[mirror])
    assert {coords.shape for coords in mirror.seen} == {(16, problem.n_params)}
    assert len(mirror.seen) == pytest.approx(4 * 50, abs=4 * 20)  # sd of a hundred coins 5


def test_a_run_is_not_resumed_with_other_moves(tmp_path):
    problem, _ = ill_conditioned()
    options = {"max_steps": 20, "checkpoint": tmp_path / "chain"}
    bs.sample(problem, rng=np.random.default_rng(1), moves=[(Mirror(), 0.5)], **options)
    for moves in ([(Mirror(), 0.25)], []):
        with refused("state", "moves"):
            bs.sample(problem, rng=np.random.default_rng(1), moves=moves, **options)
