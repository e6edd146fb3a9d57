"""Proposal moves for several independent ensembles of walkers inside one emcee sampler.

The walkers of one emcee sampler are arranged as ``(n_ensembles, n_walkers)``. A move proposes for all ensembles in one
vectorised call and never lets one ensemble see another, so that their comparison (R-hat) is one of independent chains.
"""

import emcee
import numpy as np


class LaplacePCN(emcee.moves.MHMove):
    """Preconditioned Crank-Nicolson step around the Laplace approximation.

    In coordinates whitened at the mode the Laplace approximation is N(0, I). The proposal

        z' = sqrt(1 - step^2) z + step xi,   xi ~ N(0, I)

    leaves it invariant, so the acceptance ratio holds only what the posterior adds to it:
    ``log p(z') - log p(z) + (|z'|^2 - |z|^2) / 2`` (Cotter et al. 2013, section 4).
    Every walker draws its step from `steps`: long ones cross where the approximation is good, short ones where it is
    not.
    """

    def __init__(self, steps):
        self.steps = np.array(steps, dtype=float)
        super().__init__(self._propose)

    def _propose(self, coords, random):
        return _crank_nicolson(coords, self.steps, random)


def crank_nicolson(density, coords, log_prob, random, *, steps, n_sweeps):
    """Sweeps of preconditioned Crank-Nicolson steps over all walkers.

    Every walker draws its step from `steps` at each sweep. Returns coords, log_prob and the fraction accepted (n,).
    """
    steps = np.array(steps, dtype=float)
    coords, log_prob, accepted = coords.copy(), log_prob.copy(), np.zeros(len(coords))
    for _ in range(n_sweeps):
        proposed, factors = _crank_nicolson(coords, steps, random)
        new = density(proposed)
        taken = np.log(random.random_sample(len(coords))) < new - log_prob + factors
        coords[taken], log_prob[taken] = proposed[taken], new[taken]
        accepted += taken / n_sweeps
    return coords, log_prob, accepted


def _crank_nicolson(coords, steps, random):
    step = steps[random.randint(len(steps), size=(len(coords), 1))]
    proposed = np.sqrt(1.0 - step**2) * coords + step * random.standard_normal(coords.shape)
    return proposed, 0.5 * (np.sum(proposed**2, axis=1) - np.sum(coords**2, axis=1))


def hamiltonian(density, gradient, coords, log_prob, random, *, steps, n_leaps, n_flights):
    """Flights of Hamiltonian dynamics over all walkers, each of `n_leaps` leapfrog steps (Neal 2011, section 5.3.2).

    Every walker draws its step from `steps` at each flight. Returns coords, log_prob and the fraction accepted (n,).
    """
    steps = np.array(steps, dtype=float)
    coords, log_prob, accepted = coords.copy(), log_prob.copy(), np.zeros(len(coords))
    for _ in range(n_flights):
        step = steps[random.randint(len(steps), size=(len(coords), 1))]
        momentum = random.standard_normal(coords.shape)
        energy = 0.5 * np.sum(momentum**2, axis=1)
        with np.errstate(over="ignore", invalid="ignore"):  # a flight may end at infinity, and is then refused
            proposed, momentum = coords, momentum + 0.5 * step * gradient(coords)
            for leap in range(n_leaps):
                proposed = proposed + step * momentum
                momentum = momentum + (step if leap < n_leaps - 1 else 0.5 * step) * gradient(proposed)
            new = density(proposed)
            gain = new - log_prob + energy - 0.5 * np.sum(momentum**2, axis=1)
            taken = np.log(random.random_sample(len(coords))) < gain
        coords[taken], log_prob[taken] = proposed[taken], new[taken]
        accepted += taken / n_flights
    return coords, log_prob, accepted


class SurrogateTransition(emcee.moves.MHMove):
    """A walk that leaves a surrogate density invariant, then one acceptance on the true one.

    ``walk(coords, log_prob, random)`` returns coords, their log surrogate density and what else it likes. It is
    reversible, so that S(y) q(y, y') = S(y') q(y', y) and the acceptance ratio is ``p(y') S(y) / (p(y) S(y'))`` (Liu
    2001, section 9.4.3; Christen & Fox 2005).
    """

    def __init__(self, density, walk):
        self.density, self.walk = density, walk
        super().__init__(self._propose)

    def _propose(self, coords, random):
        before = self.density(coords)
        proposed, after, *_ = self.walk(coords, before, random)
        return proposed, before - after


class _Halves(emcee.moves.Move):
    """Moves one half of each ensemble with the help of the other half, then the other way round."""

    def __init__(self, n_ensembles: int):
        self.n_ensembles = n_ensembles

    def proposal(self, moving, resting, random):
        """Proposed coordinates (n_ensembles, n_moving, n_params) and log factors (n_ensembles, n_moving)."""
        raise NotImplementedError

    def propose(self, model, state):
        n_walkers, n_params = len(state.coords) // self.n_ensembles, state.coords.shape[1]
        order = model.random.random_sample((self.n_ensembles, n_walkers)).argsort(axis=1)
        order += n_walkers * np.arange(self.n_ensembles)[:, None]
        halves = order[:, : n_walkers // 2], order[:, n_walkers // 2 :]
        accepted = np.zeros(len(state.coords), dtype=bool)
        for moving, resting in (halves, halves[::-1]):
            proposed, factors = self.proposal(state.coords[moving], state.coords[resting], model.random)
            proposed, subset = proposed.reshape(-1, n_params), moving.ravel()
            log_prob, _ = model.compute_log_prob_fn(proposed)
            ratio = log_prob - state.log_prob[subset] + factors.ravel()
            taken = np.log(model.random.random_sample(len(subset))) < ratio
            accepted[subset[taken]] = True
            state.coords[subset[taken]] = proposed[taken]
            state.log_prob[subset[taken]] = log_prob[taken]
        return state, accepted


class DifferentialEvolution(_Halves):
    """Step along the difference of two resting walkers (ter Braak 2006), scaled by 2.38 / sqrt(2 n_params)."""

    def proposal(self, moving, resting, random):
        n_ensembles, n_moving, n_params = moving.shape
        first, second = _distinct(random, n_ensembles, n_moving, resting.shape[1], 2)
        ensemble = np.arange(n_ensembles)[:, None]
        scale = 2.38 / np.sqrt(2 * n_params) * (1.0 + 0.1 * random.standard_normal((n_ensembles, n_moving, 1)))
        return moving + scale * (resting[ensemble, first] - resting[ensemble, second]), np.zeros(
            (n_ensembles, n_moving)
        )


class Snooker(_Halves):
    """Step along the line to a resting walker, by the projected difference of two more (ter Braak & Vrugt 2008)."""

    def proposal(self, moving, resting, random):
        n_ensembles, n_moving, n_params = moving.shape
        pivot, first, second = _distinct(random, n_ensembles, n_moving, resting.shape[1], 3)
        ensemble = np.arange(n_ensembles)[:, None]
        pivot = resting[ensemble, pivot]
        line = moving - pivot
        distance = np.linalg.norm(line, axis=2, keepdims=True)
        line /= distance
        shift = np.sum(line * (resting[ensemble, first] - resting[ensemble, second]), axis=2, keepdims=True)
        proposed = moving + 1.7 * shift * line
        ratio = np.linalg.norm(proposed - pivot, axis=2) / distance[..., 0]
        return proposed, (n_params - 1) * np.log(ratio)


def _distinct(random, n_ensembles, n_moving, n_resting, n):
    """`n` arrays (n_ensembles, n_moving) of positions in the resting half that differ from each other."""
    picks = random.random_sample((n_ensembles, n_moving, n_resting)).argpartition(n, axis=2)[..., :n]
    # argpartition orders within the first n by size in part, which no rule may depend on: rotate them at random.
    turn = random.randint(n, size=(n_ensembles, n_moving, 1))
    return np.moveaxis(np.take_along_axis(picks, (np.arange(n) + turn) % n, axis=2), 2, 0)
