"""What searches from random starts share: normalised unknowns, evaluation in batches and the estimate they make.

Searches advance side by side, so that one batch of simulations answers all of them.
"""

import queue
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import threadpoolctl

from bayesub.inference.baselines.estimate import Estimate, meter
from bayesub.inference.interface import LeastSquares, Progress

_CHUNK = 512  # simulations a batch: enough to fill the lanes, few enough to keep their readings in memory
_INFORMED = 0.25  # change of the unknown of an informed parameter for an sd of its prior
_DRAWS = 100  # times that starts are drawn again because their simulation fails
_ENDED, _ABANDONED = object(), object()


@dataclass(frozen=True)
class Normalised:
    """A problem in the unknowns ``x_i = xi_i / guess_i``, with that of the prior as the guess (thesis section 7.2).

    Currents, biases and clocks have guesses of zero, and readings may not tell them all. With the standard normal
    coordinate t of the prior, the unknown of a parameter that is `informed` is ``1 + t / 4``, as of one that is guessed
    to 25 %, and t is a residual besides those of readings: what is known counts like a reading. So are zero guesses.
    """

    problem: LeastSquares
    informed: Collection[str] = ()

    def __post_init__(self) -> None:
        zero = [name for name, one in zip(self.problem.names, self.guess, strict=True) if one == 0.0]
        object.__setattr__(self, "informed", tuple(dict.fromkeys([*self.informed, *zero])))

    @property
    def guess(self) -> np.ndarray:
        """(n_params,) coefficients at which every unknown is one."""
        return self.problem.prior.guess

    @property
    def _positions(self) -> list[int]:
        return [self.problem.names.index(name) for name in self.informed]

    def _standard(self, x) -> np.ndarray:
        """Standard normal coordinates (.., n_params) of the informed parameters, zero for all others."""
        t = np.zeros_like(x)
        t[..., self._positions] = (x[..., self._positions] - 1.0) / _INFORMED
        return t

    def parameters(self, x: np.ndarray) -> np.ndarray:
        """Parameters (.., n_params) of the unknowns x (.., n_params)."""
        parameters = self.guess * x
        if self.informed:
            own = self._positions
            parameters[..., own] = self.problem.prior.parameters(self._standard(x))[..., own]
        return parameters

    def unknowns(self, parameters: np.ndarray) -> np.ndarray:
        """The inverse of :meth:`parameters`, of (n_params,)."""
        own = self._positions
        x = parameters / np.where(np.isin(np.arange(len(parameters)), own), 1.0, self.guess)
        if own:
            x[own] = 1.0 + _INFORMED * self.problem.prior.standard(parameters)[own]
        return x

    def scales(self, x: np.ndarray) -> np.ndarray:
        """(n_params,) derivatives of the parameters by their unknowns at x (n_params,)."""
        if not self.informed:
            return self.guess
        own, scales = self._positions, self.guess.copy()
        slopes = self.problem.prior.chain(np.eye(len(x)), self._standard(x))
        scales[own] = np.diag(slopes)[own] / _INFORMED
        return scales

    def _residuals(self, x) -> np.ndarray:
        residuals = self.problem.residuals(self.parameters(x))
        return np.hstack([residuals, self._standard(x)[:, self._positions]]) if self.informed else residuals

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """(n_batch, n_readings) residuals at x (n_batch, n_params), not a number where the simulation failed."""
        chunks = [x[first : first + _CHUNK] for first in range(0, len(x), _CHUNK)]
        return np.concatenate([self._residuals(chunk) for chunk in chunks])

    @np.errstate(over="ignore", invalid="ignore")  # squares of what runs away
    def costs(self, x: np.ndarray) -> np.ndarray:
        """(n_batch,) sums of squared residuals at x (n_batch, n_params), infinite where the simulation failed."""
        chunks = [x[first : first + _CHUNK] for first in range(0, len(x), _CHUNK)]
        # Row by row, so that the rounding of a sum does not depend on what else is in the batch.
        costs = [row @ row for chunk in chunks for row in self._residuals(chunk)]
        return np.where(np.isnan(costs), np.inf, costs)

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """(n_readings, n_params) derivatives of the residuals at x (n_params,)."""
        jacobian = self.problem.jacobian(self.parameters(x)) * self.scales(x)
        return np.vstack([jacobian, np.eye(len(x))[self._positions] / _INFORMED]) if self.informed else jacobian

    def draw(self, rng: np.random.Generator, n_starts: int, spread: float) -> np.ndarray:
        """(n_starts, n_params) uniform within ``1 +- spread``; those whose simulation fails are drawn again."""
        starts = np.empty((n_starts, self.problem.n_params))
        missing = np.ones(n_starts, dtype=bool)
        for _ in range(_DRAWS):
            starts[missing] = rng.uniform(1.0 - spread, 1.0 + spread, (missing.sum(), self.problem.n_params))
            missing = ~np.isfinite(self.costs(starts))
            if not missing.any():
                return starts
        raise ValueError(f"the simulation fails at starts within {100 * spread:g} % of the guess; lower start_spread")


@threadpoolctl.threadpool_limits.wrap(1, "blas")  # its threads wait for each other in busy loops
@np.errstate(over="ignore", invalid="ignore")  # squares of what runs away
def search_from(
    starts: np.ndarray,
    search: Callable[[np.ndarray, Callable], tuple[np.ndarray, str]],
    answer: Callable[[list], list],
    *,
    method: str,
    unknowns: Normalised,
    progress: Progress | None = None,
) -> Estimate:
    """Search from every start (n_starts, n_params) in `unknowns`, side by side, by a method of that name.

    A search is ``search(start, ask) -> (x, status)``, and `answer` a function of the list of questions asked at the
    same time -> list of (answer, effort); a simulation or a Jacobian is an effort of one. Progress is in starts.
    """
    problem, spent = unknowns.problem, meter(unknowns.problem.costs)
    efforts = np.zeros(len(starts), dtype=int)

    @np.errstate(over="ignore", invalid="ignore")  # as above, in the thread of the search
    def counted(n, ask):
        def ask_and_count(question):
            reply, effort = ask(question)
            efforts[n] += effort
            return reply

        return search(starts[n], ask_and_count)

    ends = together([partial(counted, n) for n in range(len(starts))], answer, progress)
    x = np.array([x for x, _ in ends])
    costs = unknowns.costs(x)
    order = np.argsort(costs, kind="stable")
    found = problem.names, unknowns.parameters(x[order]), costs[order], tuple(ends[n][1] for n in order), None
    begun = unknowns.parameters(starts[order])
    return Estimate(method, *found, starts=begun, efforts=efforts[order], **spent())


class Abandoned(Exception):
    """The batch that a search waits for has failed."""


def together(searches: Sequence[Callable], answer: Callable[[list], list], progress: Progress | None = None) -> list:
    """Results of searches, run so that the questions of all are answered in batches.

    Each search, ``search(ask) -> result`` with ``ask(question)`` returning an answer, has a thread. It waits at its
    question until every other search has asked or ended; then one call of `answer`, with the questions in the order of
    the searches, serves all of them. What a search does depends on its own questions and answers only, so if answers do
    not depend on what else is in the batch, the result is that of running one search after the other. An exception in a
    search is raised when the others have ended.
    """
    events: queue.SimpleQueue[tuple[int, Any]] = queue.SimpleQueue()
    replies: list[queue.SimpleQueue[Any]] = [queue.SimpleQueue() for _ in searches]

    def work(n):
        def ask(question):
            events.put((n, question))
            reply = replies[n].get()
            if reply is _ABANDONED:
                raise Abandoned
            return reply

        return searches[n](ask)

    def end(n, _):
        events.put((n, _ENDED))

    with ThreadPoolExecutor(max(1, len(searches))) as pool:
        futures = [pool.submit(work, n) for n in range(len(searches))]
        for n, future in enumerate(futures):
            future.add_done_callback(partial(end, n))
        n_live = len(searches)
        try:
            while n_live:
                arrived = sorted((events.get() for _ in range(n_live)), key=lambda event: event[0])
                waiting = [(n, question) for n, question in arrived if question is not _ENDED]
                if len(waiting) < n_live and progress is not None:
                    progress.update(len(searches) - len(waiting), len(searches), "starts")
                n_live = len(waiting)
                if waiting:
                    numbers, questions = zip(*waiting, strict=True)
                    for n, reply in zip(numbers, answer(list(questions)), strict=True):
                        replies[n].put(reply)
        finally:
            for reply in replies:
                reply.put(_ABANDONED)
    return [future.result() for future in futures]
