"""The plan of a design: every family of manoeuvres briefly, the two best for longer, then free curves from the best.

A family that is searched on continues its own search (:func:`bayesub.design.search.search`): the optimiser gets the
costs on file again, and goes on where it was. Zig-zags have few numbers and are good soon; curves that begin as the
best zig-zag, with many numbers, become better than it in ten times as many judgements.
"""

import hashlib
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from bayesub.design.families import KINDS, RPM, Family, controls
from bayesub.design.information import Goal
from bayesub.design.judge import Judge
from bayesub.design.limits import Limits, Range
from bayesub.design.prescription import Prescription
from bayesub.design.search import Cost, Found, search
from bayesub.io import toml_files
from bayesub.io.errors import InputError, check_known
from bayesub.io.terminal import SILENT, Progress
from bayesub.model.manoeuvres import Manoeuvre, load_manoeuvre
from bayesub.model.vehicles import Vehicle

Mapped = Callable[..., Iterable]
AUTOPILOT, HELMSMAN = ("standard", "curves", "multisines"), ("steps",)  # the soonest good one first
AMPLITUDES = (0.1, 0.3, 1.0)  # shares of the range of the controls, of manoeuvres that are tried before any search
SAME = 1e-3  # relative change of an expected sd below which the readings say nothing
_TIMED = 4  # judgements, of each process, by which the pace is measured
_LEAST = 120  # judgements of a family: its starts and some generations
N_JUDGED = _LEAST  # of a short search
N_RANDOM = 12  # that are judged after every run
REFINED = "refined"  # curves that begin as the best manoeuvre of any family
_KNOTS, _SIGMA = 60, 0.1  # of the refined
_SHARE = 0.25  # of the judgements after the first answer, for the best family


def kinds(limits: Limits, asked: Sequence[str] = ()) -> tuple[str, ...]:
    """The families to search: those asked for (InputError for one that is unknown, or that a helmsman cannot follow).

    Of none those that a helmsman or an autopilot can follow.
    """
    for kind in asked:
        check_known(kind, KINDS, f"--family {kind}: unknown", hint=f"expected {', '.join(KINDS)}", key="--family")
        if limits.orders_an_hour is not None and kind not in HELMSMAN:
            what = f"--family {kind} contradicts orders_an_hour of the limits, which a helmsman follows in steps"
            raise InputError(f"{what}; leave one of them out", "conflict", "--family")
    return tuple(dict.fromkeys(asked)) or (AUTOPILOT if limits.orders_an_hour is None else HELMSMAN)


def families(
    vehicle: Vehicle, limits: Limits, asked: Sequence[str] = (), subproblem: str | None = None
) -> dict[str, Family]:
    """Kind -> family of the manoeuvres of a vehicle within limits, as :func:`kinds`."""
    actuators = vehicle.actuators
    acting = [i for name, (i, _) in actuators.parameters.items() if actuators.moves(name, subproblem)]
    columns = {RPM, *(actuators.members[i].column for i in acting)}
    moved = tuple(control for control in controls(vehicle, limits) if control.column in columns)
    if not moved:
        text = f"{vehicle.name}: has no control that may move; give limits of one (bayesub new limits)"
        raise InputError(text, "missing", "limits")
    return {kind: Family(kind, vehicle, limits, moved, subproblem) for kind in kinds(limits, asked)}


def tried(families: Iterable[Family], rng: np.random.Generator) -> list[Manoeuvre]:
    """Random manoeuvres of each family, small and large, that need not keep any limit."""
    return [family.manoeuvre(share * family.start(rng)) for family in families for share in AMPLITUDES]


def refuse_uninformed(judge: Judge, manoeuvres: Sequence[Manoeuvre], gradients: dict[str, np.ndarray]) -> None:
    """InputError if the readings do not depend on a quantity, or of any coefficient, whatever is flown of these.

    Gradients (n,) of coefficients or quantities by the coefficients are given by name; none for criteria of all.
    """
    judged = [judge.information(manoeuvre)[0] for manoeuvre in manoeuvres]
    what = f"design: the sensors ({', '.join(sensor.column for sensor in judge.sensors)}) say nothing about"
    for name, gradient in gradients.items():
        if all(i.sd_of(gradient) > (1.0 - SAME) * i.prior_sd_of(gradient) for i in judged):
            text = f"{what} {name}: on none of {len(judged)} manoeuvres of any size is it known better than before"
            raise InputError(f"{text}; give other sensors, or ask for something else", "data", name)
    if not any(i.singular_values[0] > SAME for i in judged):
        text = f"{what} any coefficient on {len(judged)} manoeuvres of any size; give other sensors"
        raise InputError(text, "data", "sensors")


Budget = tuple[int, int]  # manoeuvres judged of each family before the first answer, and of all after it


def of_total(n_judgements: int, n_families: int) -> Budget:
    """A tenth for the first answer, shared among families."""
    brief = max(_LEAST, n_judgements // (10 * n_families))
    return brief, max(0, n_judgements - brief * n_families)


def of_time(seconds: float, first_s: float, pace_s: float, n_families: int) -> Budget:
    """What fits into a time of which so many seconds are for the first answer, at so many seconds a judgement."""
    brief = max(_LEAST, int(min(first_s, seconds) / pace_s / n_families))
    return brief, max(0, int(seconds / pace_s) - brief * n_families)


def at_knots(family: Family, manoeuvre: Manoeuvre) -> np.ndarray:
    """(n_dims,) numbers of the curves that go through the orders of a manoeuvre at the knots."""
    inputs = manoeuvre.controls if manoeuvre.inputs is None else manoeuvre.inputs
    columns = [member.column for member in family.vehicle.actuators.members]
    knots, numbers = np.linspace(0.0, family.duration, family.n_knots), []
    for control in family.controls:
        history = manoeuvre.rpm if control.column == RPM else inputs[:, columns.index(control.column)]
        numbers.append(control.shape(np.interp(knots, manoeuvre.times, history)))
    return np.clip(np.concatenate(numbers), -1.0, 1.0)


@dataclass(frozen=True)
class Plan:
    """The searches to be made."""

    judge: Judge
    range: Range
    families: dict[str, Family]  # by their kind
    goal: Goal
    n_trials: int  # manoeuvres of the set
    seed: int
    folder: Path  # for the costs of each family, from which a search continues
    robust: bool = False  # as of :class:`bayesub.design.search.Cost`
    mapped: Mapped = map  # as :func:`map`, possibly over processes

    def family(self, kind: str) -> Family:
        """The family of a kind, or the refined curves."""
        return replace(self.families["curves"], n_knots=_KNOTS) if kind == REFINED else self.families[kind]

    def cost(self, kind: str) -> Cost:
        """The cost of a set of manoeuvres of a family."""
        return Cost(self.judge, self.range, (self.family(kind),) * self.n_trials, self.goal, self.robust)

    def pace(self) -> float:
        """Seconds of a judgement, in as many processes as there are."""
        cost = self.cost(next(iter(self.families)))
        still = [np.zeros(cost.n_dims)] * _TIMED
        list(self.mapped(cost, still))  # processes begin, and kernels are loaded
        began = time.perf_counter()
        list(self.mapped(cost, still))
        return (time.perf_counter() - began) / _TIMED

    def search(self, kind: str, n_judgements: int, progress: Progress = SILENT, **start: Any) -> Found:
        """Search a family, or continue its search, until so many manoeuvres are judged; more for ``search``."""
        rng = np.random.default_rng([self.seed, [*KINDS, REFINED].index(kind)])
        # costs of a search with one start are not those of another
        digest = f"_{hashlib.sha256(start['start'].tobytes()).hexdigest()[:8]}" if start else ""
        saved = self.folder / f"costs_{kind}{digest}.txt"
        given: dict[str, Any] = {"mapped": self.mapped, "saved": saved, "progress": progress, **start}
        return search(self.cost(kind), rng, n_judgements=n_judgements, **given)

    def stages(self, budget: Budget, progress: Progress = SILENT) -> Iterator[tuple[str, dict[str, Found]]]:
        """The searches by kind, when a first family has found something within the limits, and at the end.

        InputError if no family finds anything within the limits.
        """
        answers: dict[str, Found] = {}
        faults = []
        for kind in self.families:
            progress.stage(f"{kind}, briefly")
            try:
                answers[kind] = self.search(kind, budget[0], progress)
            except InputError as error:
                faults.append(error)
            else:
                if len(answers) == 1:
                    yield "first answer", dict(answers)
        if not answers:
            raise faults[-1]
        yield "answer", self.thorough(answers, budget[1], progress) if budget[1] else answers

    def thorough(self, answers: dict[str, Found], n_judgements: int, progress: Progress = SILENT) -> dict[str, Found]:
        """The answers after more judgements: of the two best families, and of curves that begin as the best manoeuvres.

        After a brief search the second is often the better one: curves are good at once, zig-zags soon.
        """
        n_refined = int((1.0 - _SHARE) * n_judgements) if "curves" in self.families else 0
        chosen = sorted(answers, key=lambda kind: answers[kind].cost)[:2]
        for kind in chosen:
            progress.stage(f"{kind}, thoroughly")
            n = answers[kind].n_judgements + (n_judgements - n_refined) // len(chosen)
            answers = answers | {kind: self.search(kind, n, progress)}
        if not n_refined:
            return answers
        progress.stage("curves from the best")
        kind = best(answers)
        manoeuvres = self.cost(kind).manoeuvres(answers[kind].numbers)
        start = np.concatenate([at_knots(self.family(REFINED), manoeuvre) for manoeuvre in manoeuvres])
        return answers | {REFINED: self.search(REFINED, n_refined, progress, start=start, sigma=_SIGMA)}


def best(answers: dict[str, Found]) -> str:
    """The family with the least cost."""
    return min(answers, key=lambda kind: answers[kind].cost)


def with_ready_made(found: Prescription, flights: Range) -> Prescription:
    """The same with the best within the limits of the built-in manoeuvres and of random ones of the first seeds.

    The manoeuvre of the last trial is not among them: to fly it again is a way of its own.
    """
    known, judge = {}, found.judge
    for name in (*toml_files.built_in("manoeuvres"), *(f"random:{seed}" for seed in range(1, N_RANDOM + 1))):
        with suppress(InputError):  # about controls that this boat does not have
            manoeuvre = load_manoeuvre(name, judge.vehicle)
            planes_agree = len({manoeuvre.subproblem, judge.subproblem} - {None}) < 2
            if planes_agree and manoeuvre.name != found.again.name:
                known[name] = manoeuvre, judge.information(manoeuvre)[0]
    for name in sorted(known, key=lambda name: found.goal(known[name][1])):
        manoeuvre, information = known[name]
        if flights.penalty(flights.margins(manoeuvre)) == 0.0:
            return found.with_ways({f"the manoeuvre {name}": information})
    return found


def with_manoeuvre(
    found: Prescription, kinds: dict[str, Family], flights: Range, seed: int, progress: Progress = SILENT
) -> tuple[Prescription, Manoeuvre | None]:
    """The same with the best of a short search in families of manoeuvres, and that manoeuvre; None within no limits."""
    with TemporaryDirectory() as costs:
        plan = Plan(found.judge, flights, kinds, found.goal, 1, seed, Path(costs))
        *_, (_, searches) = plan.stages((N_JUDGED, 0), progress)
    kind = best(searches)
    (manoeuvre,) = plan.cost(kind).manoeuvres(searches[kind].numbers)
    if flights.penalty(flights.margins(manoeuvre)) > 0.0:
        progress.remark(f"no other manoeuvre: none of those that were tried keeps the limits; widen them ({kind})")
        return found, None
    return found.with_ways({f"another manoeuvre ({kind})": found.judge.information(manoeuvre)[0]}), manoeuvre
