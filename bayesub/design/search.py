"""Search a family of manoeuvres for the one that a goal likes best, within limits.

The optimiser is the covariance matrix adaptation of a kept library, with a diagonal matrix (Ros & Hansen 2008): there
are a hundred numbers and more, and a generation asks for a dozen or two of manoeuvres at once. It depends on nothing
but its seed and the costs that it has been given, so that a search continues from the costs on file.
"""

import itertools
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from cmaes import SepCMA

from bayesub.design.families import Family
from bayesub.design.information import Goal
from bayesub.design.judge import Judge
from bayesub.design.limits import Range
from bayesub.io.atomic import write_text
from bayesub.io.errors import InputError
from bayesub.io.terminal import Progress
from bayesub.model.manoeuvres import Manoeuvre

BEYOND = 100.0  # cost of a manoeuvre beyond a limit, and as much again for each share of the limit that it is beyond
OUTSIDE = 1e3  # cost of a manoeuvre that no boat flies
SIGMA = 0.5


@dataclass(frozen=True)
class Cost:
    """The cost of a set of manoeuvres, flown one after the other by the same boat; a function of numbers (n_dims,)."""

    judge: Judge
    range: Range
    families: tuple[Family, ...]
    goal: Goal
    robust: bool = False  # whether the goal is averaged over the loss of any instrument and of any of the manoeuvres

    @property
    def n_dims(self) -> int:
        """Numbers of the whole set."""
        return sum(family.n_dims for family in self.families)

    def manoeuvres(self, numbers: np.ndarray) -> list[Manoeuvre]:
        """The manoeuvres of numbers (n_dims,)."""
        return [family.manoeuvre(part) for family, part in self._parts(numbers)]

    def orders(self, numbers: np.ndarray) -> list[dict[str, tuple[np.ndarray, np.ndarray]]]:
        """As of :meth:`Family.orders`, of each manoeuvre."""
        return [family.orders(part) for family, part in self._parts(numbers)]

    def _parts(self, numbers):
        ends = np.cumsum([family.n_dims for family in self.families])
        return zip(self.families, np.split(numbers, ends[:-1]), strict=True)

    def __call__(self, numbers: np.ndarray) -> float:
        """What the goal says of all manoeuvres together, on average over sets and losses, plus the penalty."""
        manoeuvres = self.manoeuvres(numbers)
        penalty = sum(self.range.penalty(self.range.margins(manoeuvre)) for manoeuvre in manoeuvres)
        if penalty > 1.0:
            return OUTSIDE + BEYOND * penalty
        if self.robust:
            cases = list(zip(*map(self.judge.losses, manoeuvres), strict=True))
            cases += itertools.combinations(cases[0], len(manoeuvres) - 1) if len(manoeuvres) > 1 else []
        else:
            cases = [tuple(map(self.judge.information, manoeuvres))]
        goal = np.mean([self.goal(sum(rest, first)) for case in cases for first, *rest in zip(*case, strict=True)])
        return float(goal + (BEYOND * (1.0 + penalty) if penalty > 0.0 else 0.0))


@dataclass(frozen=True)
class Found:
    """The best of a search."""

    numbers: np.ndarray  # (n_dims,)
    cost: float
    n_judgements: int
    best: np.ndarray  # (n_generations,), least cost after each generation, that of the start included


def search(
    cost: Cost,
    rng: np.random.Generator,
    *,
    n_judgements: int,
    start: np.ndarray | None = None,
    sigma: float = SIGMA,
    mapped: Callable[..., Iterable] = map,
    saved: Path | None = None,
    progress: Progress | None = None,
) -> Found:
    """Search for the least cost; InputError if no manoeuvre that was tried could be flown within the limits.

    `rng`: of the start, and of the seed of the optimiser; `n_judgements`: manoeuvres to judge, rounded up to whole
    generations; `start` (n_dims,): which is judged too, by default the best of a generation's random ones; `sigma`: how
    far the first generation spreads; `mapped`: as :func:`map`, possibly over processes; `saved`: file of all costs so
    far, from which a search of the same seed continues.
    """
    seed = int(rng.integers(2**31))
    costs = _Costs(cost, mapped, saved)
    size = 4 + int(3.0 * np.log(cost.n_dims))
    if start is not None:
        starts = [np.clip(start, -1.0, 1.0)]
    else:
        starts = [np.concatenate([family.start(rng) for family in cost.families]) for _ in range(size)]
        starts = [share * numbers for numbers in starts for share in (0.1, 0.3, 1.0)]
    of_starts = costs(starts)
    start = starts[int(np.argmin(of_starts))]
    bounds = np.tile([-1.0, 1.0], (cost.n_dims, 1))
    optimiser = SepCMA(start.copy(), sigma, bounds=bounds, seed=seed, population_size=size)  # which moves its mean
    least, numbers, history = min(of_starts), start, []
    while costs.n < n_judgements:
        asked = [optimiser.ask() for _ in range(size)]
        answers = costs(asked)
        optimiser.tell(list(zip(asked, answers, strict=True)))
        k = int(np.argmin(answers))
        if answers[k] < least:
            least, numbers = answers[k], asked[k]
        history.append(least)
        if progress is not None:
            progress.update(min(costs.n, n_judgements), n_judgements, "manoeuvres")
        if optimiser.should_stop():
            break
    if least >= OUTSIDE:
        what = f"design: none of {costs.n} manoeuvres keeps the limits for the required share of boats"
        raise InputError(f"{what}; widen the limits, lower share_of_draws, or shorten the trial", "conflict", "limits")
    return Found(numbers, float(least), costs.n, np.array(history))


class _Costs:
    """The costs of manoeuvres, taken from a file where it has them, and written there."""

    def __init__(self, cost, mapped, saved):
        self._cost, self._mapped, self._saved, self.n = cost, mapped, saved, 0
        text = saved.read_text(encoding="utf-8") if saved is not None and saved.exists() else ""
        self._known = [float(line) for line in text[: text.rfind("\n") + 1].split()]
        if saved is not None:
            write_text(saved, "".join(f"{known!r}\n" for known in self._known))

    def __call__(self, candidates):
        """The costs of some candidates (n_dims,)."""
        done = self._known[self.n : self.n + len(candidates)]
        fresh = list(self._mapped(self._cost, candidates[len(done) :]))
        if self._saved is not None and fresh:
            with self._saved.open("a", encoding="utf-8") as stream:
                stream.write("".join(f"{value!r}\n" for value in fresh))
        self.n += len(candidates)
        return done + fresh
