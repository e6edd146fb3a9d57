"""The same posterior by samplers that users reach for, as their manuals say to use them, until a budget is spent.

They share likelihood and prior with ours and nothing else: no search for a mode, no straightened coordinates, no
surrogate. :func:`nutpie_draws` gives nutpie exact gradients in the standard normal coordinates t of the prior and
leaves masses and steps to it; :func:`dynesty_draws` gives dynesty the likelihood on the unit cube of the prior.
"""

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import count
from operator import itemgetter

import numpy as np
from scipy import special

from bayesub.inference.checks import convergence
from bayesub.inference.sampling import sample
from bayesub.inference.sampling.moments import Effort, Moments
from bayesub.inference.sampling.nuts import MOST_RHAT, compare, require_nutpie
from bayesub.inference.sampling.posterior import STANDARD
from bayesub.io.errors import InputError
from bayesub.problem.problem import Problem
from bayesub.report import markdown
from thesis.sampler_cost import starts

OURS = "ours"
MAX_STEPS = 6000  # of the ensemble sampler
TARGET = STANDARD.ess  # effective samples of the worst parameter, to which costs are compared
TUNE, DRAWS = 400, 1000  # of each chain of nutpie, its defaults
N_CHAINS, N_RUNS = 4, 2  # of nutpie, and independent runs of dynesty
_THINNED = 4.0  # effective samples of a nested run to a draw
_LEAST = 20  # draws of each chain, fewer of which are not judged


@dataclass(frozen=True)
class EngineDraws:
    """What an engine has drawn for its budget.

    Attributes
    ----------
    chain : (n_chains, n_draws, n_params) draws of equal weight; none if the budget was spent before the first
    worth : effective samples that an independent draw stands for, where draws have been thinned
    spent : (n_draws,) share of all work that had been done at each draw, up to one
    simulations : all of them, those within a Jacobian not among them
    jacobians : Jacobians
    seconds : wall time
    reached : in words, how far it came
    """

    chain: np.ndarray
    worth: float
    spent: np.ndarray
    simulations: int
    jacobians: int
    seconds: float
    reached: str

    def ess(self, n: int) -> float:
        """Bulk effective sample size of the worst parameter after `n` draws of each chain; zero of too few."""
        return self.worth * float(convergence.bulk_ess(self.chain[:, :n, None]).min()) if n >= _LEAST else 0.0

    def rhat(self, n: int) -> float | None:
        """The largest of all parameters after `n` draws of each chain; None of too few."""
        return float(convergence.rhat(self.chain[:, :n, None]).max()) if n >= _LEAST else None

    def cost(self, jacobian_price: float) -> dict:
        """What the draws cost, and what the first of them cost that have an effective size of :data:`TARGET`.

        Returns
        -------
        dict
            `simulations`, `jacobians`, `seconds`, `work`, `ess`, `rhat` and `reached` of all draws; `to_target`, the
            seconds and the work to that size with chains that agree, or None where it was not reached.
        """
        n_draws, n = self.chain.shape[1], self._first()
        numbers = {"simulations": self.simulations, "jacobians": self.jacobians, "seconds": self.seconds}
        effort = Effort(**numbers, jacobian_price=jacobian_price, ess=self.ess(n_draws))
        to_target = None if n is None else [float(self.spent[n - 1] * all_) for all_ in (self.seconds, effort.work)]
        diagnostics = {"ess": effort.ess, "rhat": self.rhat(n_draws), "reached": self.reached}
        return numbers | {"work": effort.work, "to_target": to_target} | diagnostics

    def _first(self) -> int | None:
        """The smallest of twenty numbers of draws that reach the target with chains that agree."""
        for n in np.linspace(0, self.chain.shape[1], 21, dtype=int)[1:]:
            if self.ess(n) >= TARGET and self.rhat(n) < MOST_RHAT:
                return int(n)
        return None


def compared(problem: Problem, engines: dict[str, tuple[Callable, int, dict]], seed: int, ess: float) -> dict:
    """What each engine makes of a problem for its budget, beside the ensemble sampler.

    Parameters
    ----------
    problem : to be sampled
    engines : name -> :func:`nutpie_draws` or :func:`dynesty_draws`, its budget, and its settings
    seed : of all random numbers
    ess : that the ensemble sampler goes on to where there is an engine to be compared with

    Returns
    -------
    dict
        `n_params`, `jacobian_price`, `ours`, and for each engine what :meth:`EngineDraws.cost` returns with the
        `verdict` of a comparison and its `sentence`, or why it is `skipped`.
    """
    ours = sample(problem, rng=np.random.default_rng(seed), max_steps=MAX_STEPS)
    price = float(ours.jacobian_price)
    result = {"n_params": problem.n_params, "jacobian_price": price, OURS: _cost_of_ours(ours)}
    longer = None
    for name, (engine, budget, settings) in engines.items():
        try:
            draws = engine(problem, np.random.default_rng(seed), budget, **settings)
        except InputError as missing:
            result[name] = {"skipped": str(missing)}
            continue
        result[name] = draws.cost(price) | {"budget": budget, "verdict": None}
        if result[name]["to_target"] is not None:
            criteria = replace(STANDARD, ess=ess)
            longer = longer or sample(problem, rng=np.random.default_rng(seed), max_steps=MAX_STEPS, criteria=criteria)
            check = compare(longer, Moments.of_chain(draws.chain), engine=name)
            result[name] |= {"verdict": check.verdict, "sentence": check.sentence}
    return result


def _cost_of_ours(posterior) -> dict:
    """As :meth:`EngineDraws.cost`; the ensemble sampler ends where it has reached the target."""
    cost = {"simulations": posterior.evaluations, "jacobians": posterior.jacobians, "seconds": posterior.seconds}
    to_target = [posterior.seconds, posterior.work] if posterior.converged else None
    diagnostics = {"ess": float(posterior.bulk_ess.min()), "rhat": float(posterior.rhat.max())}
    reached = "; ".join(posterior.shortcomings) or f"{posterior.n_steps} steps of each ensemble"
    return cost | {"work": posterior.work, "to_target": to_target, "reached": reached} | diagnostics


def nutpie_draws(problem: Problem, rng: np.random.Generator, n_gradients: int, **settings) -> EngineDraws:
    """Four chains of NUTS in the coordinates t, from draws of the prior, with nutpie's own adaptation.

    A chain whose share of the gradients is spent finds no density any more, and what it draws from then on is not
    kept; so no result depends on a clock.

    Parameters
    ----------
    problem : to be sampled
    rng : source of all random numbers
    n_gradients : of all chains
    **settings : what else ``nutpie.sample`` takes, such as ``low_rank_modified_mass_matrix=True``

    Raises
    ------
    InputError : if nutpie is not installed
    """
    nutpie, prior, share = require_nutpie(), problem.prior, n_gradients // N_CHAINS
    before, began = _counts(problem), time.perf_counter()

    def density():
        """The log density of a chain, which counts its own gradients."""
        gradients = count()

        def log_prob(t):
            if next(gradients) >= share:
                return -np.inf, np.zeros_like(t)
            parameters = prior.parameters(t)
            residuals, (deviance,) = problem.misfit(parameters[None])
            if not np.isfinite(deviance):
                return -np.inf, np.zeros_like(t)
            slope = residuals[0] @ prior.chain(problem.jacobian(parameters), t)
            return -0.5 * (deviance + t @ t), -slope - t

        return log_prob

    model = nutpie.compiled_pyfunc.from_pyfunc(
        problem.n_params,
        density,
        lambda *_: lambda t: {"parameters": prior.parameters(t)},
        [np.dtype(float)],
        [(problem.n_params,)],
        ["parameters"],
        make_initial_point_fn=lambda seed: starts(problem, np.random.default_rng(seed), 1)[0],
    )
    own = {"draws": DRAWS, "tune": TUNE, "chains": N_CHAINS, "cores": 1, "seed": int(rng.integers(2**31))}
    trace = nutpie.sample(model, **own, **settings, progress_bar=False)
    steps = [np.asarray(part["n_steps"].values) for part in (trace.warmup_sample_stats, trace.sample_stats)]
    gradients = np.cumsum(np.concatenate(steps, axis=1), axis=1)  # (n_chains, TUNE + DRAWS)
    n_drawn = int(np.count_nonzero((gradients < share).all(axis=0)))  # by the slowest chain
    n_kept = max(0, n_drawn - TUNE)
    simulations, jacobians = (int(n) for n in _counts(problem) - before)
    return EngineDraws(
        chain=np.asarray(trace.posterior["parameters"].values)[:, :n_kept],
        worth=1.0,
        spent=gradients.sum(axis=0)[TUNE:n_drawn] / np.minimum(gradients[:, -1], share).sum(),
        simulations=simulations,
        jacobians=jacobians,
        seconds=time.perf_counter() - began,
        reached=f"{n_kept} draws of each chain" if n_kept else f"{n_drawn} of {TUNE} draws of the adaptation",
    )


def dynesty_draws(problem: Problem, rng: np.random.Generator, n_simulations: int, **settings) -> EngineDraws:
    """Two independent runs of nested sampling with dynesty's own choice of bounds, moves and end, as equal draws.

    The effective size of a run is Kish's of its weights. A quarter as many draws are taken by weight, so that drawing
    them adds little to the error that they have. The correlation that the moves leave shows in R-hat between the runs.

    Parameters
    ----------
    problem : to be sampled
    rng : source of all random numbers
    n_simulations : of both runs; one that has not ended by then has no draws, and no other is begun
    **settings : what else ``dynesty.NestedSampler`` takes, such as ``nlive``

    Raises
    ------
    InputError : if dynesty is not installed
    """
    dynesty, prior = require_dynesty(), problem.prior
    before, began = _counts(problem), time.perf_counter()
    left, runs = n_simulations, []
    for stream in rng.spawn(N_RUNS):
        sampler = dynesty.NestedSampler(
            lambda parameters: float(problem.log_likelihood(parameters[None])[0]),
            lambda cube: prior.parameters(special.ndtri(cube)),
            problem.n_params,
            rstate=stream,
            **settings,
        )
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")  # of its own arithmetic, and that it was stopped
            sampler.run_nested(maxcall=left, print_progress=False)
        results, last = sampler.results, -sampler.nlive - 1  # the last point that is not live
        if sampler.ncall >= left:
            rest = results.logl.max() + results.logvol[last] - results.logz[last]
            reached = f"its evidence may still grow by {rest:.3g} nats"
            break
        left -= sampler.ncall
        weights = results.importance_weights()
        n = int(1.0 / (_THINNED * np.sum(weights**2)))
        runs.append(results.samples[stream.choice(len(weights), n, p=weights)])
    ended = len(runs) == N_RUNS
    n = min(map(len, runs)) if ended else 0
    simulations, jacobians = (int(n) for n in _counts(problem) - before)
    return EngineDraws(
        chain=np.stack([draws[:n] for draws in runs]) if ended else np.empty((N_RUNS, 0, problem.n_params)),
        worth=_THINNED,
        spent=np.ones(n),
        simulations=simulations,
        jacobians=jacobians,
        seconds=time.perf_counter() - began,
        reached=f"{n} draws of each run" if ended else reached,
    )


def rivals(results: dict) -> dict[str, dict]:
    """The costs of the engines among the results of :func:`compared` that were not skipped, without ours."""
    return {
        name: cost
        for name, cost in results.items()
        if name != OURS and isinstance(cost, dict) and "skipped" not in cost
    }


def table(numbers: dict[str, dict]) -> list[str]:
    """The lines of a table with a row for each engine on each problem: problem -> what :func:`compared` returns."""
    rows = [
        {"problem": problem, "engine": name} | cost
        for problem, results in numbers.items()
        for name, cost in results.items()
        if isinstance(cost, dict)
    ]
    done, left_out = [row for row in rows if "skipped" not in row], [row for row in rows if "skipped" in row]
    cells = {
        "problem": itemgetter("problem"),
        "engine": itemgetter("engine"),
        "simulations": itemgetter("simulations"),
        "Jacobians": itemgetter("jacobians"),
        "seconds": lambda r: f"{r['seconds']:.0f}",
        "R-hat": lambda r: "" if r["rhat"] is None else f"{r['rhat']:.3f}",
        "ESS": lambda r: f"{r['ess']:.0f}",
        "to 400: seconds": lambda r: f"{r['to_target'][0]:.0f}" if r["to_target"] else "not reached",
        "simulations, with Jacobians at their price": lambda r: f"{r['to_target'][1]:.3g}" if r["to_target"] else "",
        "what was reached": itemgetter("reached"),
        "agrees with ours": lambda r: r.get("verdict") or "",
    }
    skipped = [f"{row['problem']}, {row['engine']}: {row['skipped']}." for row in left_out]
    return [*markdown.columns(done, cells), *([""] if skipped else []), *skipped]


def require_dynesty():
    """The module, or an InputError that says how to install it."""
    try:
        import dynesty
    except ImportError:
        raise InputError(
            "this needs dynesty; install it with: pip install 'bayesub[cross-check]'", "install", "dynesty"
        ) from None
    return dynesty


def _counts(problem) -> np.ndarray:
    """Simulations and Jacobians so far."""
    return np.array([problem.costs.simulations, problem.costs.jacobians])
