"""Sample a posterior until independent ensembles agree, and keep what has been sampled."""

import hashlib
import importlib.metadata
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import cast

import emcee
import numpy as np
import threadpoolctl

from bayesub.inference.baselines import posterior_mode
from bayesub.inference.identifiability.linear_model import marginal_jacobian
from bayesub.inference.interface import (
    SMOOTH,
    Emulated,
    Forced,
    InferencePrior,
    Modal,
    Progress,
    Sampled,
    mostly_bounded,
)
from bayesub.inference.sampling import checkpoint as store
from bayesub.inference.sampling.geometry import Geometry, redrawn
from bayesub.inference.sampling.histories import (
    HistoryGeometry,
    HistorySurrogate,
    learn_with_histories,
    search_marginal_mode,
)
from bayesub.inference.sampling.moves import EachEnsemble, LaplacePCN, SurrogateTransition, crank_nicolson
from bayesub.inference.sampling.posterior import PROBES, STANDARD, Criteria, Posterior
from bayesub.inference.sampling.surrogate import Surrogate, learn
from bayesub.io.arguments import check_class, checked
from bayesub.io.errors import InputError
from bayesub.io.interrupts import deferred

N_WALKERS = 16  # of an ensemble
N_WITHIN_BOUNDS = 8  # where a step takes longest, and draws are enough long before the chain is as long as it must be
MOVE_SHARE = 0.02  # of the steps that go round the Laplace approximation; before 0.05
MOVE_STEPS = (0.2, 0.5, 1.0)  # of these
START_STEPS = (0.1, 0.2, 0.4, 0.8)  # of Crank-Nicolson, before a walker starts
START_SWEEPS = 50  # of such steps
DISPERSION = 2.0  # sd of the starts in sampling coordinates, where the posterior has about 1
WARMUP = 0.1  # fraction of the steps so far that is discarded; before 0.25
BLOCK_SECONDS = 10.0  # of sampling, which is the most that a kill costs
CHAIN_BYTES = 2**30  # of a chain that takes more room every second step is forgotten
FORMAT = 9  # of checkpoints; those of a former one lack what this one counts, and are refused
PRICE_BATCH = 64  # simulations at once, as in a step, to which the time of a Jacobian is compared; and values tried
PRICE_REPEATS = 3  # measurements, of which the fastest counts
FIRST_PROBES = 4096  # values from the prior that are tried first, of all parameters
PROBED = 0.05  # sd of the walkers in t, from which on values of its prior are tried for a parameter
PRIOR_SHARE = 0.2  # of the steps that draw parameters anew from their prior which the other steps do not cover
_SAME = 1e-6  # difference of log posteriors: a thousand times what the order of sums in a matrix product makes


Search = Callable[[Sampled, np.random.Generator], np.ndarray]


def search_mode(problem: Sampled, rng: np.random.Generator) -> np.ndarray:
    """The posterior mode (n_params,)."""
    return problem.posterior_mode(rng) if isinstance(problem, Modal) else posterior_mode(problem, rng=rng).values


def search_from(before: Posterior, problem: Sampled, rng: np.random.Generator) -> np.ndarray:
    """The posterior mode, and below it draws of a posterior of fewer readings (1 + n_draws, n_params).

    The search begins at its mean. What it does not have is not a number in the draws. InputError if it has no parameter
    of the problem.
    """
    places = [before.names.index(name) if name in before.names else -1 for name in problem.names]
    shared = np.array(places) >= 0
    if not shared.any():
        text = "the posterior from which a search is to begin has no parameter of this problem; leave it out"
        raise InputError(text, "conflict", "start")
    draws = np.where(shared, before.draws[:, places], np.nan)
    start = {name: before.mean[k] for name, k in zip(problem.names, places, strict=True) if k >= 0}
    return np.vstack([posterior_mode(problem, rng=rng, start=start).values, draws])


@checked
@threadpoolctl.threadpool_limits.wrap(1, "blas")
@np.errstate(over="ignore", invalid="ignore")  # far out densities overflow, and what is proposed there is refused
def sample(
    problem: Sampled,
    *,
    rng: np.random.Generator,
    n_ensembles: int = 4,
    n_walkers: int | None = None,
    max_steps: int = 20_000,
    criteria: Criteria = STANDARD,
    checkpoint: str | Path | None = None,
    progress: Progress | None = None,
    search: Search = search_mode,
    moves: Sequence[emcee.moves.Move | tuple[emcee.moves.Move, float]] = (),
) -> Posterior:
    """Sample the posterior of a problem with emcee.

    All ensembles live in one emcee sampler, so that a step is one vectorised call, but no move lets one see another.
    They start over-dispersed around the mode. At every look the first tenth is discarded as warm-up and the rest
    judged; sampling stops when every parameter meets the criteria, at `max_steps`, or where it makes no progress
    (:meth:`bayesub.inference.sampling.posterior.Posterior.stuck`), and then the result says which do not. InputError
    for numbers of walkers that cannot be, a checkpoint of another run, or a problem without a mode.

    Parameters
    ----------
    problem : anything with that interface, such as a problem of bayesub; one with histories of forces is
        :class:`bayesub.inference.interface.Forced` too
    rng : source of all random numbers
    n_ensembles : independent ensembles, four or more for R-hat
    n_walkers : of each ensemble, by default 16, or 8 if most parameters have bounds; they do not see each other
    max_steps : of each ensemble
    criteria : of convergence
    checkpoint : folder to continue from if it holds this very run, and to save to every ten seconds; with it, Ctrl-C
        lets the step in hand be finished and saved, and a second Ctrl-C does not
    progress : object with ``update(done, total, unit, note)``, or None
    search : finds the posterior mode (n_params,) of the problem with a source of random numbers, and may raise; below
        the mode it may give draws from near the posterior, as :func:`search_from` does. Not called by a run that is
        resumed, and not where forces have unknown histories, which follow the readings before they are sampled
    moves : of emcee, or pairs of one and its weight (one by default), besides our own, which have the weight one
        together. They move the sampling coordinates y, in which the posterior is nearly a standard normal. Each is
        taken in one ensemble after the other, so that it sees no walker of another; those of emcee that take two
        walkers want at least twice as many in an ensemble as there are parameters
    """
    check_class("sample: problem", problem, Emulated, key="problem")
    if n_walkers is None:
        n_walkers = N_WITHIN_BOUNDS if mostly_bounded(problem.prior) else N_WALKERS
    if n_ensembles < 1 or n_walkers < 2:
        text = f"sampler: at least one ensemble of two walkers is needed, found {n_ensembles} of {n_walkers}"
        raise InputError(text, "value", "n_ensembles" if n_ensembles < 1 else "n_walkers")
    if max_steps < 1:
        raise InputError(f"sampler: max_steps must be one at least, found {max_steps}", "value", "max_steps")
    looks = partial(_looks, criteria.look)
    with store.opened(checkpoint) as saved:
        run = _Run(problem, rng, n_ensembles, n_walkers, saved, progress, search, moves)
        with nullcontext(lambda: False) if saved is None else deferred() as interrupted:
            while True:
                if run.n_kept and (run.n_kept * run.state.thin >= max_steps or run.n_kept in looks(run.n_kept)):
                    posterior = run.posterior(criteria)
                    if progress is not None:
                        progress.update(*_pace(posterior, max_steps))
                    if run.n_kept * run.state.thin >= max_steps or posterior.converged or posterior.stuck(max_steps):
                        return posterior
                    run.cover(posterior.uncovered)
                look = next(k for k in looks() if k > run.n_kept)
                run.advance(min(look, -(-max_steps // run.state.thin)), interrupted)


class _Run:
    """The steps so far, and what the next one needs; a new run, or one continued from a checkpoint."""

    def __init__(self, problem, rng, n_ensembles, n_walkers, saved, progress, search, others):
        self.problem, self.n_ensembles, self.saved = problem, n_ensembles, saved
        others = [others] if isinstance(others, str | emcee.moves.Move) else others
        weighted = [move if isinstance(move, tuple) else (move, 1.0) for move in others]
        for move, _ in weighted:
            check_class("sample: moves", move, emcee.moves.Move, key="moves")
        settings = _settings(problem, rng, n_ensembles, n_walkers, weighted)
        self.marked = _costs(problem)
        content = None if saved is None else saved.load(settings)
        if content is None:
            before, starts, steps = rng.spawn(3)
            self.geometry, surrogate, draws = learn_coordinates(problem, before, progress, search)
            n = n_ensembles * n_walkers
            # What the log posterior is above the log density of the surrogate, for most draws of that.
            y = _with_histories(problem, draws[:n], starts)
            densities = self.geometry.log_prob(problem, y)
            known = np.isfinite(densities)
            level = float(np.median((densities - surrogate.log_prob(y))[known])) if known.any() else 0.0
            coords, log_prob = _starts(problem, self.geometry, surrogate, draws, starts, n)
            marginal = isinstance(self.geometry, HistoryGeometry)
            centre = self.geometry.marginalised.centre if marginal else problem.prior.unscaled(self.geometry.mode)
            price = jacobian_price(problem, centre)
            # emcee has no other generator than the legacy one; its bits come from ours.
            random_state = np.random.RandomState(np.random.MT19937(steps.bit_generator.seed_seq)).get_state()
            spent = self._charged(store.Spent(jacobian_price=price))
            self.state = store.State(coords, log_prob, random_state, spent)
            self.blocks = []
            if saved is not None:
                arrays = self.geometry.arrays() | surrogate.arrays() | {"level": np.array(level)}
                saved.begin(settings, arrays, self.state)
        else:
            arrays, self.state, self.blocks = content
            self.geometry, surrogate = _restored(problem, arrays)
            level = float(arrays["level"])
            if self.blocks:
                self.state = self.blocks[-1].state
                self.blocks = [self._joined()]
            log_prob = self.geometry.log_prob(problem, self.state.coords)
            if not np.allclose(log_prob, self.state.log_prob, rtol=1e-9, atol=_SAME):
                fault = f"{saved.folder}: cannot be resumed: was made by another problem, whose log posterior differs"
                raise InputError(f"{fault}; remove it to start afresh", "state", "checkpoint")
            self.marked = _costs(problem)
        self._parameters: np.ndarray | None = None  # of the walkers, if they cost a simulation
        if problem.histories:
            last = self.blocks[-1].chain[-1] if self.blocks else None
            self._parameters = self.geometry.evaluate(problem, self.state.coords)[1] if last is None else last
        marginal = isinstance(self.geometry, HistoryGeometry)
        self._of_others = self.geometry.geometry if marginal else self.geometry
        self._others = self.geometry.marginalised.others if marginal else np.arange(problem.n_params)
        short, long = surrogate.walks()
        self._moves = [
            (SurrogateTransition(surrogate.log_prob, short, long, level, len(self._others)), 1.0 - MOVE_SHARE),
            (LaplacePCN(MOVE_STEPS), MOVE_SHARE),
            *((EachEnsemble(move, n_ensembles), weight) for move, weight in weighted),
        ]
        self.sampler = self._sampler()

    def _sampler(self) -> emcee.EnsembleSampler:
        """That of all moves, and of draws from the prior of the parameters that these do not cover."""
        moves = list(self._moves)
        if len(self.state.wide):
            move = emcee.moves.MHMove(partial(redrawn, self._of_others, self.state.wide))
            moves.append((move, sum(weight for _, weight in moves) * PRIOR_SHARE / (1.0 - PRIOR_SHARE)))
        sampler = emcee.EnsembleSampler(*self.state.coords.shape, self._evaluate, moves=moves, vectorize=True)
        sampler.log_prob_fn = self._evaluate  # without emcee's wrapper, which prints a traceback at Ctrl-C
        return sampler

    def _evaluate(self, y):
        """Log densities (n,) of walkers, and beside them their parameters if these cost a simulation."""
        if self._parameters is None:
            return self.geometry.log_prob(self.problem, y)
        return np.column_stack(self.geometry.evaluate(self.problem, y))

    @property
    def n_kept(self) -> int:
        return sum(len(block.chain) for block in self.blocks)

    def advance(self, n_kept: int, interrupted: Callable[[], bool]) -> None:
        """Sample until `n_kept` steps are kept, block by block; KeyboardInterrupt after the block in hand."""
        while self.n_kept < n_kept:
            block = self._block(n_kept - self.n_kept, interrupted)
            self.blocks.append(block)
            self.state = block.state
            if self.saved is not None:
                self.saved.append(block)
            if interrupted():
                raise KeyboardInterrupt

    def _block(self, n_kept, interrupted) -> store.Block:
        """At most `n_kept` further kept steps; fewer when the time of a block is over."""
        began = time.perf_counter()
        state = emcee.State(
            self.state.coords,
            log_prob=self.state.log_prob,
            blobs=self._parameters,
            random_state=self.state.random_state,
        )
        self.sampler.reset()
        steps = self.sampler.sample(state, iterations=n_kept, thin_by=self.state.thin, skip_initial_state_check=True)
        for _ in steps:
            if interrupted() or time.perf_counter() - began > BLOCK_SECONDS:
                break
        after = self.sampler.get_last_sample()
        if self._parameters is None:
            coords = self.sampler.get_chain()
            parameters = self.geometry.parameters(coords.reshape(-1, coords.shape[-1])).reshape(coords.shape)
        else:
            parameters = self.sampler.get_blobs()
            self._parameters = parameters[-1].copy()
        state = replace(
            self.state,
            coords=after.coords.copy(),
            log_prob=after.log_prob.copy(),
            random_state=after.random_state,
            accepted=self.state.accepted + int(self.sampler.backend.accepted.sum()),
            proposed=self.state.proposed + self.sampler.get_log_prob().size,
            spent=self._charged(self.state.spent),
        )
        return store.Block(parameters, self.sampler.get_log_prob(), state)

    def _joined(self) -> store.Block:
        """All blocks as one, with every step that is a multiple of `thin`."""
        chains, log_probs, number = [], [], 0  # of steps before a block
        for block in self.blocks:
            every = self.state.thin // block.state.thin
            kept = slice((every - 1 - number // block.state.thin) % every, None, every)
            chains.append(block.chain[kept])
            log_probs.append(block.log_prob[kept])
            number += len(block.chain) * block.state.thin
        if len(chains) == 1:
            return store.Block(chains[0], log_probs[0], self.state)
        return store.Block(np.concatenate(chains), np.concatenate(log_probs), self.state)

    def posterior(self, criteria: Criteria) -> Posterior:
        """The verdict on convergence of the steps so far."""
        whole = self._joined()
        while whole.chain.nbytes > CHAIN_BYTES and len(whole.chain) > STANDARD.look:
            self.blocks, self.state = [whole], replace(self.state, thin=2 * self.state.thin)
            whole = self._joined()
        self.blocks = [whole]
        n_warmup = max(int(WARMUP * self.n_kept), self.state.begun // self.state.thin)
        posterior = Posterior(
            names=self.problem.names,
            chain=_by_ensemble(whole.chain[n_warmup:], self.n_ensembles),
            log_prob=_by_ensemble(whole.log_prob[n_warmup:], self.n_ensembles),
            prior_mean=self.problem.prior.mean,
            prior_sd=self.problem.prior.sd,
            n_warmup=n_warmup * self.state.thin,
            acceptance=self.state.accepted / self.state.proposed,
            criteria=criteria,
            thin=self.state.thin,
            **vars(self.state.spent),
        ).given(self.problem.prior)
        if not posterior.converged:
            return posterior
        unvisited = self._unvisited(posterior)
        self.state = replace(self.state, spent=self._charged(self.state.spent))
        posterior = posterior.given(self.problem.prior, **vars(self.state.spent))
        vars(posterior)["unvisited"] = unvisited
        return posterior

    def _unvisited(self, posterior: Posterior) -> np.ndarray:
        """(n_params,) of values of each parameter's prior, those that are accepted where the draws have not been.

        They are accepted or not with the other parameters as they are at the walkers. A value is where the draws have
        not been if there are fewer beyond it than one independent one. If none of the first is, no more are tried.
        """
        random, geometry = np.random.RandomState(self.state.random_state[1]), self._of_others
        first = np.clip(FIRST_PROBES // geometry.n_params, PROBES // 8, PROBES // 4)
        spread = np.std(geometry.prior.standard(geometry.parameters(self.state.coords[:, : geometry.n_params])), axis=0)
        draws, rare = posterior.thinned().draws, 1.0 / np.minimum(posterior.bulk_ess, posterior.tail_ess)
        counts, n_walkers = np.zeros(posterior.chain.shape[-1]), len(self.state.coords)
        n_at_once, walkers = n_walkers * -(-PRICE_BATCH // n_walkers), np.arange(PROBES) % n_walkers
        for j in np.flatnonzero(spread > PROBED):
            k = self._others[j]
            low, high = np.quantile(draws[:, k], [rare[k], 1.0 - rare[k]])
            for tried in range(0, PROBES, n_at_once):
                if tried >= first and not counts[k]:
                    break
                some = walkers[tried : tried + n_at_once]
                y, log_prob = self.state.coords[some], self.state.log_prob[some]
                anew, factors = redrawn(geometry, np.array([j]), y, random)
                values, chances = geometry.parameters(anew[:, : geometry.n_params])[:, j], random.random_sample(len(y))
                beyond = (values < low) | (values > high)
                if beyond.any():  # the others count for nothing, and are not simulated
                    gain = (self.geometry.log_prob(self.problem, anew[beyond]) - log_prob[beyond]) + factors[beyond]
                    counts[k] += np.count_nonzero(np.log(chances[beyond]) < gain)
        return counts

    def cover(self, uncovered: np.ndarray) -> None:
        """Draw parameters anew from their prior from now on, those that are `uncovered` (n_params,)."""
        wide = np.union1d(self.state.wide, np.flatnonzero(uncovered[self._others]))
        if len(wide) > len(self.state.wide):
            self.state = replace(self.state, wide=wide, begun=self.n_kept * self.state.thin)
            self.sampler = self._sampler()

    def _charged(self, spent: store.Spent) -> store.Spent:
        """The costs so far, with those since the last call."""
        before, now = self.marked, _costs(self.problem)
        self.marked = now
        return replace(
            spent,
            seconds=spent.seconds + now.seconds - before.seconds,
            evaluations=spent.evaluations + now.evaluations - before.evaluations,
            jacobians=spent.jacobians + now.jacobians - before.jacobians,
            failures={k: spent.failures.get(k, 0) + now.failures[k] - before.failures[k] for k in now.failures},
            simulation_seconds=spent.simulation_seconds + now.simulation_seconds - before.simulation_seconds,
        )


def _costs(problem) -> store.Spent:
    """The counts of the problem now, and the time."""
    costs = problem.costs
    return store.Spent(
        costs.simulations, time.perf_counter(), dict(costs.failures), costs.jacobians, simulation_seconds=costs.seconds
    )


@threadpoolctl.threadpool_limits.wrap(1, "blas")
def learn_coordinates(
    problem: Sampled,
    rng: np.random.Generator,
    progress: Progress | None = None,
    search: Search = search_mode,
    prior: InferencePrior | None = None,
) -> tuple[Geometry | HistoryGeometry, Surrogate | HistorySurrogate, np.ndarray]:
    """Sampling coordinates, whitened at the mode and straightened, a surrogate of the posterior, and draws of that.

    The `prior` is as of :meth:`bayesub.inference.sampling.geometry.Geometry.whitened`.
    """
    if progress is not None:
        progress.update(0, 1, note="posterior mode")
    searches, surrogates = rng.spawn(2)
    smooth = problem.smoothed(SMOOTH)
    if problem.histories:
        marginal = search_marginal_mode(cast(Forced, problem), cast(Forced, smooth), searches)
        return learn_with_histories(*marginal, surrogates, progress)
    mode, *near = np.atleast_2d(search(problem, searches))
    geometry = Geometry.whitened(smooth, mode, prior)
    surrogate, draws = learn(smooth, geometry, surrogates, progress, near=np.array(near))
    return geometry, surrogate, draws


def jacobian_price(problem: Emulated, parameters: np.ndarray) -> float:
    """The time of a Jacobian over the time per simulation in a batch, on this machine.

    They are counted like any others. At the parameters (n_params,) the simulation completes. What a problem counts as
    several Jacobians, such as the gradients of differences, is as many.
    """
    batch = np.repeat(np.asarray(parameters, dtype=float)[None], PRICE_BATCH, axis=0)
    simulation = _fastest(lambda: problem.log_likelihood(batch)) / PRICE_BATCH
    before = problem.costs.jacobians
    seconds = _fastest(lambda: marginal_jacobian(problem, batch[0]))
    return seconds * PRICE_REPEATS / max(problem.costs.jacobians - before, 1) / simulation


def _fastest(work) -> float:
    """The shortest of several times, s."""
    times = []
    for _ in range(PRICE_REPEATS):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return max(min(times), 1e-9)


def _restored(problem, arrays):
    """Geometry and surrogate of a checkpoint."""
    if problem.histories:
        with_histories = HistoryGeometry.restored(problem.smoothed(SMOOTH), arrays)
        return with_histories, HistorySurrogate.restored(with_histories.geometry, arrays)
    geometry = Geometry.restored(problem.prior, arrays)
    return geometry, Surrogate.restored(geometry, arrays)


def _settings(problem, rng, n_ensembles, n_walkers, moves) -> dict:
    """Settings that a run must share with the one it continues."""
    prior = hashlib.sha256(problem.prior.mean.tobytes() + problem.prior.sd.tobytes()).hexdigest()[:12]
    seed = hashlib.sha256(repr(rng.bit_generator.state).encode()).hexdigest()[:12]
    names = ", ".join(f"{type(move).__name__} {weight:g}" for move, weight in moves)
    settings = {"parameters": ", ".join(problem.names), "n_ensembles": n_ensembles, "n_walkers": n_walkers}
    settings |= {"prior": prior, "seed": seed, "checkpoint format": FORMAT} | ({"moves": names} if moves else {})
    return settings | {f"{one} version": importlib.metadata.version(one) for one in ("bayesub", "emcee", "numpy")}


def _starts(problem, geometry, surrogate, draws, rng, n):
    """Starts (n, n_params) with a finite log posterior, and that (n,): draws of the surrogate, over-dispersed."""
    of_others = getattr(surrogate, "surrogate", surrogate)
    density = partial(of_others.log_prob, temperature=DISPERSION**2)
    starts, log_prob = np.empty((0, problem.n_params)), np.empty(0)
    y = draws[rng.permutation(len(draws))[: 2 * n]]
    for _ in range(100):
        y, *_ = crank_nicolson(
            density, y, density(y), rng, steps=START_STEPS, n_sweeps=START_SWEEPS, blocks=geometry.blocks
        )
        candidates = _with_histories(problem, y[rng.permutation(len(y))[:n]], rng)
        densities = geometry.log_prob(problem, candidates)
        finite = np.isfinite(densities)
        starts, log_prob = np.concatenate([starts, candidates[finite]]), np.concatenate([log_prob, densities[finite]])
        if len(starts) >= n:
            return starts[:n], log_prob[:n]
    raise InputError("nearly every simulation around the posterior mode fails; narrow the prior", "model", "prior")


def _with_histories(problem, others, rng) -> np.ndarray:
    """Sampling coordinates (n, n_params) of the others; histories are where they are likely, given these."""
    n_white = problem.n_params - others.shape[1]
    return np.hstack([others, rng.standard_normal((len(others), n_white))])


def _looks(every: int, up_to: int | None = None) -> Iterator[int]:
    """The numbers of kept steps at which convergence is judged: `every` so many at first, then a tenth of the chain."""
    look = every
    while up_to is None or look <= up_to:
        yield look
        look = every * max(look // every + 1, int(np.ceil(1.1 * look / every)))


def _by_ensemble(steps, n_ensembles):
    """Steps (n_steps, n_all_walkers, ...) as (n_ensembles, n_steps, n_walkers, ...)."""
    return np.moveaxis(steps.reshape(len(steps), n_ensembles, -1, *steps.shape[2:]), 1, 0)


def _pace(posterior, max_steps) -> tuple[float, float, str, str]:
    """Steps so far, how many are needed by the criterion of length, their unit, and a note."""
    n_steps, done = posterior.n_steps, posterior.n_warmup + posterior.n_steps
    if posterior.chain.shape[1] < 50 or posterior.constants:
        return done, max_steps, "steps", f"acceptance {posterior.acceptance:.0%}"
    needed = int(np.ceil(posterior.criteria.taus * posterior.tau.max() * done / n_steps))
    ess = min(posterior.bulk_ess.min(), posterior.tail_ess.min())
    note = f"R-hat {posterior.rhat.max():.4f}, ESS {ess:.0f}"
    return done, done if posterior.converged else min(max(needed, done + 1), max_steps), "steps", note
