"""Several finished runs side by side, in a folder that explains itself."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bayesub.findings.comparison import ComparedRun, Comparison
from bayesub.findings.unseen import POSTERIOR
from bayesub.inference.checks.prediction import N_DRAWS
from bayesub.io import toml_files
from bayesub.io.errors import InputError
from bayesub.io.terminal import SILENT, Progress
from bayesub.report import comparison_page
from bayesub.study.after.finished_run import FinishedRun, finished_run
from bayesub.study.after.predict import PosedTrial, Request, open_answer, pose, predicted_by, write_answer
from bayesub.study.provenance import copies, of_request, settings

PAGE = "comparison.html"
USUAL = "zigzag_20_20"  # manoeuvre, if the first run is of a log
# Shown elsewhere:
_UNTOLD = ("begun", "question", "quick", "files_sha256", "name", "vehicle", "manoeuvre", "data", "commit", "sources")
_DIGITS = 12  # of digests


def compare(
    folders: Sequence[Path],
    output: Path,
    *,
    manoeuvre: str | None = None,
    draws: int = N_DRAWS,
    seed: int = 0,
    force: bool = False,
    pdf: bool = False,
    progress: Progress = SILENT,
) -> dict[str, Any]:
    """Set finished runs side by side in a folder, which is made; gives the content of ``numbers.json``.

    The folder gets ``comparison.html``, ``numbers.json``, ``coefficients.csv``, ``distances.csv`` and figures (as PDF
    too with `pdf`). With `force` what is there is replaced.

    `manoeuvre`: that all shall predict, by default that of the first run, or :data:`USUAL`; `draws`: of each posterior,
    for predictions. InputError for no finished runs, too few or too many, and an output that is not free.
    """
    n, most = len(folders), comparison_page.MOST
    if n < 2:
        raise InputError("give the folders of two runs at least", "missing", "runs")
    if n > most:
        raise InputError(f"{n} runs are too many to distinguish in figures; give at most {most}", "limit", "runs")
    progress.stage("read the runs")
    runs = [finished_run(run) for run in folders]
    flown = (trial.manoeuvre for _, trial, _ in runs[0].study.each_trial() if trial.manoeuvre)
    name = next(flown, USUAL) if manoeuvre is None else manoeuvre
    place = runs[0].study.path(name) if manoeuvre is None else name
    files = {name: Path(place)} if toml_files.is_path(name) else {}
    labels, source = _labels(folders), str(next(iter(files.values()), name))
    posed: list[PosedTrial | InputError] = []  # or why it does not fit
    for run in runs:
        try:
            posed.append(pose(run, Request(run.folder, source)))
        except InputError as error:
            posed.append(error)
    refusals = [one for one in posed if isinstance(one, InputError)]
    if manoeuvre is not None and len(refusals) == len(runs):
        raise refusals[0]
    asked = {"runs": tuple(folders), "manoeuvre": name, "draws": draws, "seed": seed}
    config = of_request("comparison", asked, dict(pair for run in runs for pair in run.files.items()) | files)
    with open_answer(output, PAGE, config, copies(files, config["files_sha256"]), force=force):
        compared = []
        for label, run, trial in zip(labels, runs, posed, strict=True):
            progress.stage(f"{label} on {Path(name).stem}")
            compared.append(_compared(label, run, trial, draws, seed))
        comparison = Comparison(tuple(compared), Path(name).stem)
        progress.stage("figures and page")
        numbers = comparison.numbers | {"seed": seed}
        tables = {"coefficients.csv": comparison.coefficient_rows(), "distances.csv": comparison.distance_rows()}
        sheet = comparison_page.sheet(comparison, commit=config["commit"], seed=seed)
        write_answer(output, PAGE, sheet, numbers, tables, pdf=pdf)
    return numbers


def _labels(folders: Sequence[Path]) -> list[str]:
    """The names of folders, or as much of their paths as tells them apart."""
    places = [folder.resolve().parts for folder in folders]
    for n in range(1, max(map(len, places)) + 1):
        labels = ["/".join(place[-n:]) for place in places]
        if len(set(labels)) == len(labels):
            return labels
    raise InputError(f"{folders[0]}: is given twice; a run is not compared with itself", "conflict", "runs")


def _compared(label: str, run: FinishedRun, posed: PosedTrial | InputError, draws: int, seed: int) -> ComparedRun:
    prediction, why_not = None, ""
    if isinstance(posed, InputError):
        why_not = str(posed)
    else:
        prediction = predicted_by(run, posed, np.random.default_rng(seed), draws, by=(POSTERIOR,))
        if not prediction.motions[POSTERIOR].is_flown:
            why_not = "with most draws the boat does not complete it"
    trials = [trial.manoeuvre or trial.data for _, trial, _ in run.study.each_trial()]
    about = {
        "study": run.study.name,
        "verdict": run.verdict,
        "vehicle": run.vehicle.name,
        "equations": run.vehicle.equations.name,
        "trials": ", ".join(Path(str(name)).name for name in trials),
        "bayesub": f"{run.config['versions'].get('bayesub', '')} {run.config['commit']}",
        "simulations": run.posterior.evaluations,
        "seconds": round(run.posterior.seconds, 1),
    }
    others = {key: value for key, value in settings(run.config).items() if key.partition(".")[0] not in _UNTOLD}
    others["sources_sha256"] = others["sources_sha256"][:_DIGITS]
    sds = {row["name"]: row["conditional_sd"] for row in run.rows if "conditional_sd" in row}
    return ComparedRun(label, run.vehicle, run.posterior, about, others, prediction, why_not, sds)
