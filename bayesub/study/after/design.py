"""A design goes one way: what is asked is posed as a question, searched family by family, and answered with a page.

Briefer is the prescription of what to measure or fly next, after a run in a folder, with one manoeuvre besides.
"""

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bayesub.campaign import executors
from bayesub.campaign.executors import Executor
from bayesub.design import information as goals
from bayesub.design.families import Family
from bayesub.design.judge import Judge
from bayesub.design.knowledge import KnownBefore
from bayesub.design.limits import N_DRAWS, Limits, Range, load_limits, usual_limits
from bayesub.design.plan import Plan, best, families, of_time, of_total, refuse_uninformed, tried, with_manoeuvre
from bayesub.design.prescription import Asked, Prescription, asked_by_name
from bayesub.design.search import Found
from bayesub.findings.designed_trial import DesignedTrial, structural
from bayesub.io import toml_files
from bayesub.io.atomic import write_text
from bayesub.io.errors import InputError, check_known
from bayesub.io.terminal import SILENT, Progress, duration
from bayesub.io.words import measured
from bayesub.logs.log_files import write_log
from bayesub.model.manoeuvres import Manoeuvre, load_manoeuvre
from bayesub.model.vehicles import Vehicle, load_vehicle
from bayesub.problem.distributions import Prior
from bayesub.problem.problem import channel_noises
from bayesub.report import design as report
from bayesub.sensors import unread
from bayesub.sensors.sensor import channel_name
from bayesub.study.after.finished_run import FinishedRun, finished_run
from bayesub.study.provenance import CODE, copies, of_request
from bayesub.study.run.prepare import present
from bayesub.study.run.prescribed import judge_of_next, prescription
from bayesub.study.run.run import interruptions
from bayesub.study.run.run_folder import open_folder
from bayesub.study.schema.design_file import PRIOR_SD, read_design, usual_sensors

DEFAULT, MINUTES, APART = "known:10", 10.0, "apart:"
OPTIMALITY = {
    "D": "a small volume of the posterior (D-optimality)",
    "A": "small variances on average (A-optimality)",
    "E": "the least known direction that is not null known best (E-optimality)",
}
FIRST_S, FIRST_SHARE = 25.0, 0.25  # before the first answer, of a long time and of a short one
COSTS, PACE = "costs", "pace.json"


@dataclass(frozen=True)
class Request:
    """What is asked of a design."""

    vehicle: str  # built-in name or path
    # ``known:10``, ``D``, ``A``, ``E``, ``apart:`` and another vehicle, coefficients or quantities
    wanted: tuple[str, ...] = (DEFAULT,)
    sensors: Path | None = None  # file
    limits: Path | None = None  # file
    after: Path | None = None  # folder of a run
    families: tuple[str, ...] = ()  # by default all that can be followed
    trials: int = 1  # manoeuvres designed together
    minutes: float = MINUTES  # from the start to the last answer
    judgements: int | None = None  # manoeuvres to judge, in place of the minutes
    seed: int = 0
    subproblem: str | None = None
    boats: int = 1  # over which the goal is averaged: that of the file, and others that the prior holds possible
    without: tuple[str, ...] = ()  # instruments or channels that are lost
    robust: bool = False  # whether the goal is averaged over the loss of any instrument and of any manoeuvre

    def config(self) -> dict:
        """The files and settings that the result depends on."""
        return of_request("design", vars(self), self.files)

    @property
    def files(self) -> dict[str, Path]:
        """Name -> file of what is asked for, as far as it is files."""
        vehicle = Path(self.vehicle) if toml_files.is_path(self.vehicle) else None
        after = None if self.after is None else self.after / "posterior.nc"
        rivals = [Path(name.removeprefix(APART)) for name in self.wanted if name.startswith(APART)]
        rivals = [path for path in rivals if toml_files.is_path(str(path))]
        return {str(file): file for file in (vehicle, self.sensors, self.limits, after, *rivals) if file is not None}


@dataclass(frozen=True)
class Question:
    """A design made ready to be searched."""

    judge: Judge
    range: Range
    families: dict[str, Family]
    goal: goals.Goal
    asked: tuple[Asked, ...]  # by name
    words: dict[str, str]  # goal, sensors, limits and prior


def pose(request: Request) -> Question:
    """Read all inputs and pose the question.

    InputError for inputs that do not fit, that contradict each other, or that leave nothing to design.
    """
    vehicle = load_vehicle(request.vehicle)
    subproblem = vehicle.equations.subproblem(request.subproblem)
    run = None if request.after is None else run_before(request.after, vehicle)
    if run is not None:
        run.refuse_quantities(request.wanted)
    known = None if run is None else KnownBefore.by(run.posterior, vehicle)
    vehicle = vehicle if known is None else known.vehicle(vehicle)
    limits = usual_limits(vehicle) if request.limits is None else load_limits(request.limits)
    file = usual_sensors(vehicle, subproblem) if request.sensors is None else read_design(request.sensors)
    if known is not None and (file.prior is not None or file.free is not None):
        text = f"{request.sensors}: [prior] and [free] contradict --after, whose posterior is the prior; leave them out"
        raise InputError(text, "conflict", "--after")
    of_kinds = families(vehicle, limits, request.families, subproblem)
    random, draws = (np.random.default_rng(s) for s in np.random.SeedSequence(request.seed).spawn(2))
    manoeuvres = tried(of_kinds.values(), random)
    family = next(iter(of_kinds.values()))
    if run is not None and request.sensors is None:
        judge = replace(judge_of_next(run.setup(), run.posterior)[0], subproblem=subproblem)
    else:
        judge = file.judge(vehicle, family, manoeuvres[0], request.sensors, () if known is None else known.names)
        judge = judge if known is None else known.judge(judge)
    judge = without(judge, request.without, manoeuvres[0]) if request.without else judge
    judge = replace(judge, step_s=min(judge.accurate_step(one) for one in manoeuvres[:2]))
    sets = drawn(judge, N_DRAWS, draws) if known is None else known.sets(judge.vehicle, N_DRAWS, draws)
    if request.boats > 1:
        judge = replace(judge, draws=np.vstack([judge.vehicle.xi, sets[: request.boats - 1]]))
    flights = Range(judge.vehicle, limits, sets, subproblem, judge.step_s)
    if request.limits is not None:
        flights.refuse(family.straight())
    flights.allow(family.straight())
    if rivals := [name.removeprefix(APART) for name in request.wanted if name.startswith(APART)]:
        vehicle_of = load_vehicle(rivals[0])
        if len({tuple(m.column for m in one.actuators.members) for one in (vehicle, vehicle_of)}) > 1:
            text = f"--for {APART}{rivals[0]}: '{vehicle_of.name}' has other controls than '{vehicle.name}', and would "
            raise InputError(f"{text}not fly the same manoeuvre; give them the same [[actuators]]", "conflict", "--for")
        rival = file.judge(vehicle_of, family, manoeuvres[0], request.sensors)
        judge = replace(judge, rival=replace(rival, nuisance=_unknown(judge, vehicle_of, manoeuvres[0])))
    goal, asked, meaning = goal_of(request.wanted, judge, flights, of_kinds)
    refuse_uninformed(judge, manoeuvres, {one.name: one.gradient for one in asked})
    of_set = " and of any manoeuvre" if request.trials > 1 else ""
    usual = "the usual ones, as none are given" if run is None else f"those of {request.after}"
    words = {
        "goal": meaning
        + (f", on average over {request.boats} boats of the prior" if request.boats > 1 else "")
        + (f", on average over the loss of any instrument{of_set}" if request.robust else ""),
        "sensors": _sensors(judge) + ("" if request.sensors else f" ({usual})"),
        "limits": f"{_limits(limits, request, family)}; kept by {flights.n_wanted} of {len(sets)} boats of the prior "
        "at least",
        "prior": _prior(file, request, judge),
    }
    return Question(judge, flights, of_kinds, goal, asked, words)


def run_before(folder: Path, vehicle: Vehicle) -> FinishedRun:
    """The run of a study in TOML whose posterior is known before a trial.

    InputError for a folder that is no run, a run that has not finished or not converged, and one of another vehicle.
    """
    try:
        run = finished_run(folder)
        run.refuse_unconverged()
    except InputError as error:
        raise InputError(f"--after {error}", error.kind, error.key) from None
    flown = run.vehicle
    if flown.name != vehicle.name or flown.equations != vehicle.equations:
        text = f"--after {folder}: is a run of '{flown.name}', not of '{vehicle.name}'; design for that boat"
        raise InputError(text, "conflict", "--after")
    return run


def without(judge: Judge, lost: Sequence[str], manoeuvre: Manoeuvre) -> Judge:
    """A judge without some instruments, channels or columns, and what belongs to these.

    InputError for one that it does not have, and if none is left.
    """
    names = [{s.instrument, channel_name(s.quantity), s.column} - {None} for s in judge.sensors]
    for name in lost:
        check_known(name, set().union(*names), f"--without {name}: is not there", key="--without")
    left = tuple(s for s, known in zip(judge.sensors, names, strict=True) if known.isdisjoint(lost))
    if not left:
        raise InputError("--without leaves no sensor to design for; give others with --sensors", "missing", "--without")
    kept = {channel_name(sensor.quantity) for sensor in left}
    judge = replace(judge, sensors=left, noise={name: one for name, one in judge.noise.items() if name in kept})
    return replace(judge, nuisance=_unknown(judge, judge.vehicle, manoeuvre))


def _unknown(judge: Judge, vehicle: Vehicle, manoeuvre: Manoeuvre) -> dict[str, Prior]:
    """What a judge has to find out besides coefficients, as far as its sensors and a vehicle have a part in it."""
    channels = unread(judge.sensors, manoeuvre.duration).channels
    return present(dict(judge.nuisance), vehicle, manoeuvre, channels, channel_noises(channels, judge.noise))


def drawn(judge: Judge, n: int, rng: np.random.Generator) -> np.ndarray:
    """(n, n_terms) coefficient sets that the prior of a judge holds possible."""
    vehicle = judge.vehicle
    sets = np.tile(vehicle.xi, (n, 1))
    sets[:, judge.columns] = judge.prior.on(judge.columns, vehicle.xi, vehicle.equations).sample(rng, n)
    return sets


def goal_of(
    wanted: tuple[str, ...], judge: Judge, flights: Range, of_kinds: dict[str, Family]
) -> tuple[goals.Goal, tuple[Asked, ...], str]:
    """The goal of what is asked for, what is asked for by name, and the goal in words."""
    criteria = [word for word in wanted if word in OPTIMALITY or word.startswith(("known", APART))]
    if criteria and len(wanted) > 1:
        what = f"--for {' --for '.join(wanted)}: contradict each other"
        raise InputError(f"{what}; give one criterion, or names of coefficients and quantities", "conflict", "--for")
    if not criteria:
        asked = tuple(asked_by_name(name, judge, (DEFAULT, *OPTIMALITY)) for name in dict.fromkeys(wanted))
        return goals.Sharpest([one.gradient for one in asked]), asked, ", ".join(one.name for one in asked)
    (word,) = criteria
    if judge.rival is not None:
        return goals.distance, (), f"to tell {judge.vehicle.name} from {judge.rival.vehicle.name}"
    if word == "E":
        return goals.EOptimality(len(structural(judge, flights, of_kinds))), (), OPTIMALITY[word]
    if word in OPTIMALITY:
        return goals.d_optimality if word == "D" else goals.a_optimality, (), OPTIMALITY[word]
    try:
        percent = float(word.removeprefix("known:"))
    except ValueError:
        percent = 0.0
    if not 0.0 < percent <= 100.0:
        text = f"--for {word}: expected known: and per cent between 0 and 100, such as known:10"
        raise InputError(text, "value", "--for")
    return goals.Known(0.01 * percent), (), f"as many coefficients as possible known to {percent:g} %"


def _sensors(judge: Judge) -> str:
    parts = []
    for sensor in judge.sensors:
        sizes = {"sd": sensor.sd, "rounded to": sensor.resolution}
        noise = ", ".join(f"{word} {size:g}" for word, size in sizes.items() if size)
        parts.append(f"{measured(sensor.column, noise)} every {sensor.interval_s:g} s")
    return "; ".join(parts)


def _limits(limits: Limits, request: Request, family: Family) -> str:
    """The limits in words, of a control no wider than the vehicle has them."""
    values = limits.model_dump(exclude={"share_of_draws"}, exclude_none=True)
    for one in family.controls:
        kept = {one.column: 0.5 * (one.upper - one.lower) / one.unit, f"{one.column}ps": one.rate / one.unit}
        values |= {key: value for key, value in kept.items() if key in limits.of_controls}
    parts = [measured(key, value) for key, value in values.items()]
    return ", ".join(parts) + ("" if request.limits else " (the usual ones, as none are given)")


def _prior(file, request: Request, judge: Judge) -> str:
    n = len(judge.names)
    known = f"each to {100 * PRIOR_SD:g} % of its value" if file.prior is None else f"prior {file.prior.kind}"
    text = f"{n} coefficients, {known}"
    if request.after is not None:
        text = f"the posterior of {request.after} of {n} coefficients; the others are held"
    forces = [] if judge.disturbance is None else [f"forces on {' '.join(judge.disturbance.axes)}"]
    others = [*judge.nuisance, *forces]
    return text + (f"; unknown besides: {', '.join(others)}" if others else "")


def design(
    request: Request,
    folder: Path,
    *,
    resume: bool = False,
    force: bool = False,
    progress: Progress = SILENT,
    executor: Executor | None = None,
) -> dict:
    """Design manoeuvres into a folder, which is made; gives the content of ``design.json``.

    ``manoeuvre.csv`` (or ``manoeuvre_1.csv`` ..), ``design.json`` and ``design.html`` are written when a first family
    of manoeuvres has been searched briefly, and again at the end. With `resume` an interrupted search continues, bit
    for bit, and with more minutes a finished one goes on; with `force` what is in the folder is replaced. The executor
    is of the judgements, by default processes of this machine.

    InputError for unfit inputs, before a folder is made, and a folder in use; RunInterrupted for Ctrl-C.
    """
    began = time.perf_counter()
    if not 0.1 <= request.minutes <= 10_000.0:
        raise InputError(f"--minutes must be between 0.1 and 10000, found {request.minutes:g}", "value", "--minutes")
    question, asked = pose(request), request.config()
    opened = open_folder(folder, asked, copies(request.files, asked["files_sha256"]), resume=resume, force=force)
    with opened as config, interruptions(folder):
        for key in ("goal", "sensors", "limits", "prior"):
            progress.remark(f"{key}: {question.words[key]}")
        (folder / COSTS).mkdir(exist_ok=True)
        judged = (question.judge, question.range, question.families, question.goal)
        asked_of = (request.trials, request.seed, folder / COSTS, request.robust)
        plan = Plan(*judged, *asked_of, (executor or executors.local()).map)
        n_families, file = len(plan.families), folder / PACE
        if request.judgements is not None:
            budget = of_total(request.judgements, n_families)
        else:
            if not file.exists():  # the pace is measured once for all sessions of a folder
                progress.stage("pace")
                pace = {"seconds_a_judgement": plan.pace(), "seconds_before": time.perf_counter() - began}
                write_text(file, json.dumps(pace))
            pace = json.loads(file.read_text(encoding="utf-8"))
            before = pace.get("seconds_before", 0.0)  # which a folder of version 0.2 lacks
            left = 60.0 * request.minutes - before
            first = min(FIRST_S - before, FIRST_SHARE * left)
            budget = of_time(left, first, pace["seconds_a_judgement"], n_families)
        content = {}
        for stage, searches in plan.stages(budget, progress):
            progress.stage(f"page of {stage}")
            content = _write(folder, question, plan, searches, config)
            progress.remark(f"{stage} after {duration(time.perf_counter() - began)}: {content['answer']}")
    return content


def _write(folder: Path, question: Question, plan: Plan, searches: dict[str, Found], config: dict) -> dict:
    """Write the manoeuvres, and the page of what is read back."""
    kind = best(searches)
    manoeuvres = plan.cost(kind).manoeuvres(searches[kind].numbers)
    files = [f"manoeuvre_{k}.csv" if len(manoeuvres) > 1 else "manoeuvre.csv" for k in range(1, len(manoeuvres) + 1)]
    vehicle = question.judge.vehicle
    written = []
    for manoeuvre, file in zip(manoeuvres, files, strict=True):
        write_log(folder / file, {"time": manoeuvre.times} | manoeuvre.log)
        written.append(replace(load_manoeuvre(folder / file, vehicle), name=Path(file).stem))
    words = {f"{key}_in_words": question.words[key] for key in ("sensors", "limits", "prior")}
    code = {key: config[key] for key in CODE}
    inputs = {"design": config["design"], "files": files, "files_sha256": config["files_sha256"]} | words | code
    trial = DesignedTrial(plan, searches, kind, tuple(written), question.words["goal"], inputs, question.asked)
    return report.write(folder, trial)


def prescribe(
    run: FinishedRun,
    wanted: tuple[str, ...] = (),
    limits: Path | None = None,
    *,
    seed: int = 0,
    progress: Progress = SILENT,
) -> tuple[Prescription, Manoeuvre | None]:
    """What to do after a run for names that are `wanted`, and the manoeuvre; None if no control may move.

    `limits` is a file of ``bayesub new limits``. InputError for a run that has not converged, names that it does not
    know, and quantities that depend on more than coefficients.
    """
    run.refuse_unconverged()
    run.refuse_quantities(wanted)
    within = usual_limits(run.vehicle) if limits is None else load_limits(limits)
    found, flights = prescription(run.setup(), run.posterior, wanted, within, seed)
    try:
        kinds = families(run.vehicle, within, (), found.again.subproblem)
    except InputError as error:
        if limits is not None:
            raise
        progress.remark(f"no other manoeuvre is looked for: {error}")
        return found, None
    flights.allow(next(iter(kinds.values())).straight())
    return with_manoeuvre(found, kinds, flights, seed, progress)
