"""Sample a posterior until independent ensembles agree."""

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import emcee
import numpy as np

from bayesub.baselines import gauss_newton
from bayesub.errors import InputError
from bayesub.sampling import checkpoint as store
from bayesub.sampling.geometry import Geometry
from bayesub.sampling.moves import LaplacePCN, SurrogateTransition, crank_nicolson
from bayesub.sampling.posterior import STANDARD, Criteria, Posterior
from bayesub.sampling.surrogate import STEPS, learn

N_WALKERS = 16
PCN_STEPS = (0.2, 0.5, 1.0)
SWEEPS = (10, 50, 200)  # on the surrogate before each simulation
DISPERSION = 2.0  # of the starts: the surrogate is drawn from with readings of so many times their sd
LOOK = 100  # steps before the first look at convergence
WARMUP = 0.25  # fraction of the steps so far that is discarded
_SAVE_SHARE = 20.0  # a checkpoint is due when this many times the last one's cost has passed


def sample(
    problem,
    *,
    rng: np.random.Generator,
    n_ensembles: int = 4,
    n_walkers: int | None = None,
    max_steps: int = 20_000,
    criteria: Criteria = STANDARD,
    checkpoint: str | Path | None = None,
    progress: Callable[[float, str], None] = lambda *_: None,
) -> Posterior:
    """Sample the posterior of a problem with emcee.

    All ensembles live in one emcee sampler, so that a step is one vectorised call, but no move lets one see another.
    They start over-dispersed around the mode. At every look the first quarter is discarded as warm-up and the rest
    judged; sampling stops when every parameter meets the criteria, or at `max_steps`, and then the result says which
    do not.

    Parameters
    ----------
    problem : anything with names, n_params, prior, residuals, jacobian and log_likelihood
    rng : source of all random numbers
    n_walkers : of each ensemble, 16 by default; they do not see each other
    checkpoint : file to continue from if it exists and to save to after each block
    progress : called with the fraction done and a line of text
    """
    n_walkers = N_WALKERS if n_walkers is None else n_walkers
    if n_ensembles < 1 or n_walkers < 2:
        raise InputError(f"sampler: at least one ensemble of two walkers is needed, found {n_ensembles} of {n_walkers}")
    began, evaluations = time.perf_counter(), problem.evaluations
    progress(0.0, "posterior mode")
    geometry = Geometry(problem, gauss_newton(problem).values)
    surrogate, draws = learn(problem, geometry, rng, lambda fraction: progress(0.0, f"surrogate {fraction:.0%}"))

    sampler = emcee.EnsembleSampler(
        n_ensembles * n_walkers,
        problem.n_params,
        lambda y: geometry.log_prob(problem, y),
        moves=[
            *((SurrogateTransition(surrogate.log_prob, STEPS, n), 0.9 / len(SWEEPS)) for n in SWEEPS),
            (LaplacePCN(PCN_STEPS), 0.1),
        ],
        vectorize=True,
    )
    starts = _starts(problem, geometry, surrogate, draws, rng, n_ensembles * n_walkers)
    random_state = np.random.RandomState(rng.integers(2**32)).get_state()
    path = None if checkpoint is None else Path(checkpoint)
    if path is not None and path.exists():
        done = store.load(path, geometry.fingerprint())
    else:
        done = store.Progress(np.empty((0, *starts.shape)), np.empty((0, len(starts))), 0, random_state)
    chain = np.empty((0, *starts.shape))
    last_save, save_seconds = -np.inf, 0.0
    while True:
        fresh = done.coords[len(chain) :]
        chain = np.concatenate([chain, geometry.parameters(fresh.reshape(-1, problem.n_params)).reshape(fresh.shape)])
        n_steps = len(chain)
        if n_steps > 0:
            n_warmup = int(WARMUP * n_steps)
            posterior = Posterior(
                names=problem.names,
                chain=_by_ensemble(chain[n_warmup:], n_ensembles),
                log_prob=_by_ensemble(done.log_prob[n_warmup:], n_ensembles),
                prior_mean=problem.prior.mean,
                prior_sd=problem.prior.sd,
                n_warmup=n_warmup,
                acceptance=done.accepted / (n_steps * len(starts)),
                evaluations=problem.evaluations - evaluations,
                seconds=time.perf_counter() - began,
                failures=dict(problem.failures),
                criteria=criteria,
            )
            progress(*_describe(posterior))
            if n_steps >= max_steps or posterior.converged:
                break
        _advance(sampler, starts, done, min(_next_look(n_steps), max_steps) - n_steps)
        if path is not None and time.perf_counter() - last_save > _SAVE_SHARE * save_seconds:
            last_save = time.perf_counter()
            store.save(path, done, geometry.fingerprint())
            save_seconds = time.perf_counter() - last_save
    if path is not None:
        store.save(path, done, geometry.fingerprint())
    return posterior


def _starts(problem, geometry, surrogate, draws, rng, n):
    """(n, n_params) starts with a finite log posterior: draws of the surrogate with its likelihood tempered."""
    random = np.random.RandomState(rng.integers(2**32))
    density = partial(surrogate.log_prob, temperature=DISPERSION**2)
    starts, y = np.empty((0, problem.n_params)), draws
    for _ in range(100):
        y, _, _ = crank_nicolson(density, y, density(y), STEPS, 50, random)
        some = y[random.permutation(len(y))[:n]]
        starts = np.concatenate([starts, some[np.isfinite(geometry.log_prob(problem, some))]])
        if len(starts) >= n:
            return starts[:n]
    raise InputError("nearly every simulation around the posterior mode fails; narrow the prior")


def _advance(sampler, starts, done, n_steps):
    """Append `n_steps` steps to `done`."""
    coords, log_prob = (done.coords[-1], done.log_prob[-1]) if len(done.coords) else (starts, None)
    sampler.reset()
    state = emcee.State(coords, log_prob=log_prob, random_state=done.random_state)
    state = sampler.run_mcmc(state, n_steps, skip_initial_state_check=True)
    done.coords = np.concatenate([done.coords, sampler.get_chain()])
    done.log_prob = np.concatenate([done.log_prob, sampler.get_log_prob()])
    done.accepted += int(sampler.backend.accepted.sum())
    done.random_state = state.random_state


def _next_look(n_steps):
    """The step after `n_steps` at which convergence is judged: every 100 at first, then every tenth of the chain."""
    return LOOK * max(n_steps // LOOK + 1, int(np.ceil(1.1 * n_steps / LOOK)))


def _by_ensemble(steps, n_ensembles):
    """(n_steps, n_all_walkers, ...) -> (n_ensembles, n_steps, n_walkers, ...)"""
    return np.moveaxis(steps.reshape(len(steps), n_ensembles, -1, *steps.shape[2:]), 1, 0)


def _describe(posterior):
    """Fraction done, judged by the length of the chain, and a line of text."""
    n_steps = posterior.chain.shape[1]
    text = f"{posterior.n_warmup + n_steps} steps, acceptance {posterior.acceptance:.0%}"
    if n_steps < 50:
        return 0.0, text
    needed = posterior.criteria.taus * posterior.tau.max()
    return min(0.99, n_steps / needed), f"{text}, longest tau {posterior.tau.max():.0f}"
