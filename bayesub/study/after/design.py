"""A design goes one way: its question is posed, searched family by family, and answered with manoeuvres and a page."""

import json
import time
from dataclasses import replace
from pathlib import Path

from bayesub.campaign import executors
from bayesub.campaign.executors import Executor
from bayesub.design.plan import Plan, best, of_time, of_total
from bayesub.design.search import Found
from bayesub.findings.designed_trial import DesignedTrial
from bayesub.io.atomic import replacing, write_text
from bayesub.io.terminal import SILENT, Progress, duration
from bayesub.logs.log_files import write_log
from bayesub.model.manoeuvres import load_manoeuvre
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
    """Design manoeuvres into a folder, which is made; gives the content of ``design.json``.

    ``manoeuvre.csv`` (or ``manoeuvre_1.csv`` ..), ``design.json`` and ``design.html`` are written when a first family
    of manoeuvres has been searched briefly, and again at the end. With `resume` an interrupted search continues, bit
    for bit, and with more minutes a finished one goes on; with `force` what is in the folder is replaced. The executor
    is of the judgements, by default processes of this machine.

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
        n_families, file = len(plan.families), folder / PACE
        if request.judgements is not None:
            budget = of_total(request.judgements, n_families)
        else:
            if not file.exists():  # the pace is measured once for all sessions of a folder
                progress.stage("pace")
                write_text(file, json.dumps({"seconds_a_judgement": plan.pace()}))
            pace = json.loads(file.read_text(encoding="utf-8"))["seconds_a_judgement"]
            budget = of_time(60.0 * request.minutes, FIRST_S, pace, n_families)
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
        with replacing(folder / file) as partial:
            write_log(partial, {"time": manoeuvre.times} | manoeuvre.log)
        written.append(replace(load_manoeuvre(folder / file, vehicle), name=Path(file).stem))
    words = {f"{key}_in_words": question.words[key] for key in ("sensors", "limits", "prior")}
    code = {key: config[key] for key in CODE}
    inputs = {"design": config["design"], "files": files, "files_sha256": config["files_sha256"]} | words | code
    trial = DesignedTrial(plan, searches, kind, tuple(written), question.words["goal"], inputs, question.asked)
    return report.write(folder, trial)
