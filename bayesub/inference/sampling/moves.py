"""Proposal moves for emcee, in which no walker sees another: their comparison (R-hat) is one of independent chains.

A source of random numbers, `random`, is a ``numpy.random.Generator``, or the ``RandomState`` that emcee hands to its
moves: only methods that both have are called.
"""

from collections.abc import Callable, Sequence

import emcee
import numpy as np
from scipy import special

RARELY = 0.02  # share of short walks where a surrogate is right
OFTEN = 0.9  # and where it is far too low; before it was 0.1 everywhere, and walkers were held for long
DOUBTFUL = 2.0  # natural logarithm of the factor half way between these
STEEPNESS = 2.0  # how fast the share rises there
BLOCK = 5  # coordinates that are moved together within walls; before all, and three times as many sweeps
BLOCK_STEPS = (0.4, 0.8, 1.0)  # how far


class LaplacePCN(emcee.moves.MHMove):
    """Preconditioned Crank-Nicolson step around the Laplace approximation.

    In coordinates whitened at the mode the Laplace approximation is N(0, I). The proposal

        z' = sqrt(1 - step^2) z + step xi,   xi ~ N(0, I)

    leaves it invariant, so the acceptance ratio holds only what the posterior adds to it:
    ``log p(z') - log p(z) + (|z'|^2 - |z|^2) / 2`` (Cotter et al. 2013, section 4). Every walker draws its step from
    `steps`: long ones cross where the approximation is good, short ones where it is not.
    """

    def __init__(self, steps: Sequence[float]):
        lengths = np.array(steps, dtype=float)
        super().__init__(lambda coords, random: _crank_nicolson(coords, lengths, random))


def crank_nicolson(
    density: Callable[[np.ndarray], np.ndarray],
    coords: np.ndarray,
    log_prob: np.ndarray,
    random: np.random.Generator | np.random.RandomState,
    *,
    steps: Sequence[float],
    n_sweeps: int,
    blocks: float = 0.0,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sweeps of preconditioned Crank-Nicolson steps over all walkers.

    Every walker draws its step from `steps` at each sweep. A fraction `blocks` of the sweeps moves about five of each
    walker's coordinates, by long steps: of eighty coordinates within walls a step of all hits one, however short.
    Returns coords, log_prob and the fraction accepted (n,).
    """
    lengths = np.array(steps, dtype=float)
    coords, log_prob, accepted = coords.copy(), log_prob.copy(), np.zeros(len(coords))
    for _ in range(n_sweeps):
        if random.random() < blocks:
            moved = random.random(coords.shape) < BLOCK / coords.shape[1]
            proposed, factors = _crank_nicolson(coords, np.array(BLOCK_STEPS), random, moved)
        else:
            proposed, factors = _crank_nicolson(coords, lengths, random)
        new = density(proposed)
        taken = np.log(random.random(len(coords))) < new - log_prob + factors
        coords[taken], log_prob[taken] = proposed[taken], new[taken]
        accepted += taken / n_sweeps
    return coords, log_prob, accepted


def _crank_nicolson(coords, steps, random, moved=True):
    """Proposals (n, n_params) by steps of the coordinates that are `moved`, and what their acceptance has besides."""
    step = np.where(moved, random.choice(steps, size=(len(coords), 1)), 0.0)
    proposed = np.sqrt(1.0 - step**2) * coords + step * random.standard_normal(coords.shape)
    return proposed, 0.5 * (np.sum(proposed**2, axis=1) - np.sum(coords**2, axis=1))


class SurrogateTransition(emcee.moves.Move):
    """Walks that leave a surrogate density S invariant, each with one acceptance on the true density p in the end.

    ``walk(coords, random, taken)`` returns new coords of the walkers that are `taken` (n,), their log surrogate density
    and what else it likes. Every walk is reversible, so that S(y) q(y, y') = S(y') q(y', y) and the acceptance ratio is
    ``p(y') S(y) / (p(y) S(y'))`` (Liu 2001, section 9.4.3; Christen & Fox 2005).

    Where S is too low by a factor of w = exp(d), a long walk is refused but for one in w, but the next places have the
    same error. There a walker takes a short walk more often: it takes one with probability s(d), and a long one
    otherwise. As this depends on the place, the ratio has s(d') / s(d) besides, or that of 1 - s, as for any mixture of
    moves whose shares vary (Green 1995, section 3).

    The `density` is log S (n,) of coords (n, n_params). One of the long walks is taken at each step. Where S is right,
    d = log p - log S is at the `level`. The first `n_judged` coordinates say who moved: a walk may end where it began,
    and histories are drawn anew all the same.
    """

    def __init__(
        self, density: Callable, short: Callable, long: Sequence[Callable], level=0.0, n_judged: int | None = None
    ):
        self.density, self.short, self.long, self.level, self.n_judged = density, short, long, level, n_judged

    def propose(self, model: emcee.model.Model, state: emcee.State) -> tuple[emcee.State, np.ndarray]:
        """One step of all walkers, and which of them moved."""
        random, before = model.random, self.density(state.coords)
        excess = state.log_prob - before - self.level
        near = random.random(len(before)) < _share(excess)
        proposed, after = np.empty_like(state.coords), np.empty_like(before)
        for taken, walk in (near, self.short), (~near, self.long[random.randint(len(self.long))]):
            proposed[taken], after[taken], *_ = walk(state.coords, random, taken)
        log_prob, blobs = model.compute_log_prob_fn(proposed)
        reached = log_prob - after - self.level
        gain = reached - excess + self.log_share(reached, near) - self.log_share(excess, near)
        accepted = np.log(random.random(len(before))) < gain
        moved = (proposed != state.coords)[:, : self.n_judged].any(axis=1)
        new = emcee.State(proposed, log_prob=log_prob, blobs=blobs)
        return self.update(state, new, accepted), accepted & moved

    @staticmethod
    def log_share(excess: np.ndarray, near: np.ndarray) -> np.ndarray:
        """(n,) logarithms of how often a walker with d (n,) takes the walk that it took, short where it is `near`."""
        share = _share(excess)
        return np.log(np.where(near, share, 1.0 - share))


def _share(excess):
    """(n,) how often short walks are taken where the surrogate is too low by exp(excess)."""
    return RARELY + (OFTEN - RARELY) * special.expit(STEEPNESS * (excess - DOUBTFUL))


class EachEnsemble(emcee.moves.Move):
    """A move of emcee, taken in one ensemble after the other."""

    def __init__(self, move: emcee.moves.Move, n_ensembles: int):
        self.move, self.n_ensembles = move, n_ensembles

    def propose(self, model: emcee.model.Model, state: emcee.State) -> tuple[emcee.State, np.ndarray]:
        """One step of all walkers, and which of them moved."""
        accepted = []
        for walkers in np.split(np.arange(len(state.coords)), self.n_ensembles):
            blobs = None if state.blobs is None else state.blobs[walkers]
            ensemble = emcee.State(state.coords[walkers], log_prob=state.log_prob[walkers], blobs=blobs)
            moved, taken = self.move.propose(model, ensemble)
            state.coords[walkers], state.log_prob[walkers] = moved.coords, moved.log_prob
            if state.blobs is not None:
                state.blobs[walkers] = moved.blobs
            accepted.append(taken)
        return state, np.concatenate(accepted)
