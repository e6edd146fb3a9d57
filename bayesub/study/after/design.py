"""A design goes one way: its question is posed, searched family by family, and answered with manoeuvres and a page."""

import json
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from bayesub.campaign import executors
from bayesub.campaign.executors import Executor
from bayesub.design.plan import Budget, Plan, best
from bayesub.design.search import Found
from bayesub.findings.designed_trial import DesignedTrial
from bayesub.io.atomic import replacing, write_text
from bayesub.io.terminal import SILENT, Progress, duration
from bayesub.logs.log_files import write_log
from bayesub.model.manoeuvres import Manoeuvre, load_manoeuvre
from bayesub.report import design as report
from bayesub.study.after.design_question import Question, Request, pose
from bayesub.study.provenance import CODE, copies
from bayesub.study.run.run import interruptions
from bayesub.study.run.run_folder import open_folder

FIRST_S = 25.0  # of searches before the first answer
COSTS, PACE = "costs", "pace.json"


def design(
    request: Request,
    folder: Path,
    *,
    resume: bool = False,
    force: bool = False,
    progress: Progress = SILENT,
    executor: Executor | None = None,
) -> dict:
    """Design manoeuvres into a folder.

    ``manoeuvre.csv`` (or ``manoeuvre_1.csv`` ..), ``design.json`` and ``design.html`` are written when a first family
    of manoeuvres has been searched briefly, and again at the end.

    Parameters
    ----------
    folder : Path
        It is made if it does not exist.
    resume : bool
        Continue an interrupted search, bit for bit; with more minutes, go on from the end of one.
    force : bool
        Replace what is in the folder.
    executor : Executor, optional
        Of the judgements, by default processes of this machine.

    Returns
    -------
    dict
        The content of ``design.json``.

    Raises
    ------
    InputError
        For inputs that do not fit, before a folder is made, and for a folder that is not free.
    RunInterrupted
        For Ctrl-C during the search; a KeyboardInterrupt.
    """
    began = time.perf_counter()
    question, asked = pose(request), request.config()
    for key in ("goal", "sensors", "limits", "prior"):
        progress.remark(f"{key}: {question.words[key]}")
    opened = open_folder(folder, asked, copies(request.files, asked["files_sha256"]), resume=resume, force=force)
    with opened as config, interruptions(folder):
        (folder / COSTS).mkdir(exist_ok=True)
        judged = (question.judge, question.range, question.families, question.goal)
        plan = Plan(*judged, request.trials, request.seed, folder / COSTS, (executor or executors.local()).map)
        budget = _budget(plan, request, folder, progress)
        content = {}
        for stage, searches in _stages(plan, budget, progress):
            progress.stage(f"page of {stage}")
            content = _write(folder, question, plan, searches, config)
            progress.remark(f"{stage} after {duration(time.perf_counter() - began)}: {content['answer']}")
    return content


def _stages(plan: Plan, budget: Budget, progress: Progress) -> Iterator[tuple[str, dict[str, Found]]]:
    """The searches so far: when a first family has found something, and at the end."""
    searches = {}
    for answers in plan.brief(budget.brief, progress):
        if not searches:
            yield "first answer", answers
        searches = answers
    yield "answer", plan.thorough(searches, budget.rest, progress) if budget.rest else searches


def _budget(plan: Plan, request: Request, folder: Path, progress: Progress) -> Budget:
    """How many manoeuvres are judged; of a time by the pace, which is measured once for all sessions of a folder."""
    if request.judgements is not None:
        return Budget.of_total(request.judgements, len(plan.families))
    file = folder / PACE
    if not file.exists():
        progress.stage("pace")
        write_text(file, json.dumps({"seconds_a_judgement": plan.pace()}))
    pace = json.loads(file.read_text(encoding="utf-8"))["seconds_a_judgement"]
    return Budget.of_time(60.0 * request.minutes, FIRST_S, pace, len(plan.families))


def _write(folder: Path, question: Question, plan: Plan, searches: dict[str, Found], config: dict) -> dict:
    """Write the manoeuvres, and the page of what is read back."""
    kind = best(searches)
    manoeuvres = plan.cost(kind).manoeuvres(searches[kind].numbers)
    files = [f"manoeuvre_{k}.csv" if len(manoeuvres) > 1 else "manoeuvre.csv" for k in range(1, len(manoeuvres) + 1)]
    vehicle = question.judge.vehicle
    written = tuple(_saved(one, folder / file, vehicle) for one, file in zip(manoeuvres, files, strict=True))
    words = {f"{key}_in_words": question.words[key] for key in ("sensors", "limits", "prior")}
    code = {key: config[key] for key in CODE}
    inputs = {"design": config["design"], "files": files, "files_sha256": config["files_sha256"]} | words | code
    trial = DesignedTrial(plan, searches, kind, written, question.words["goal"], inputs, question.asked)
    return report.write(folder, trial)


def _saved(manoeuvre: Manoeuvre, file: Path, vehicle) -> Manoeuvre:
    """Write a control history; the manoeuvre that is read back."""
    with replacing(file) as partial:
        write_log(partial, {"time": manoeuvre.times} | manoeuvre.log)
    return replace(load_manoeuvre(file, vehicle), name=file.stem)
