"""Several finished runs side by side, in a folder that explains itself."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bayesub.findings.comparison import ComparedRun, Comparison
from bayesub.findings.unseen import POSTERIOR
from bayesub.inference.checks.prediction import N_DRAWS
from bayesub.io import toml_files
from bayesub.io.errors import InputError
from bayesub.io.terminal import SILENT, Progress
from bayesub.report import comparison_page
from bayesub.study.after.answer import open_answer, write_answer
from bayesub.study.after.finished_run import FinishedRun, finished_run
from bayesub.study.after.predict import predicted_by
from bayesub.study.after.unseen_manoeuvre import Asked, asked
from bayesub.study.provenance import of_request, settings

PAGE = "comparison.html"
USUAL = "zigzag_20_20"  # manoeuvre, if the first run is of a log
_UNTOLD = ("begun", "question", "quick", "files_sha256", "name", "vehicle", "manoeuvre", "data", "commit")  # elsewhere
_DIGITS = 12  # of digests


@dataclass(frozen=True)
class Request:
    """What is asked of several runs.

    Attributes
    ----------
    runs : tuple of Path
        Their folders.
    manoeuvre : str or None
        That all shall predict; by default that of the first run, or :data:`USUAL`.
    draws : int
        Of each posterior, for predictions.
    seed : int
    """

    runs: tuple[Path, ...]
    manoeuvre: str | None = None
    draws: int = N_DRAWS
    seed: int = 0

    def config(self, manoeuvre: str, files: Mapping[str, Path]) -> dict:
        """What the result depends on."""
        return of_request("comparison", vars(self) | {"manoeuvre": manoeuvre}, files)


def compare(
    request: Request, folder: Path, *, force: bool = False, pdf: bool = False, progress: Progress = SILENT
) -> dict:
    """Set finished runs side by side in a folder.

    It gets ``comparison.html``, ``numbers.json``, ``coefficients.csv``, ``distances.csv`` and figures.

    Parameters
    ----------
    request : Request
    folder : Path
        It is made if it does not exist.
    force : bool
        Replace what is in the folder.
    pdf : bool
        Draw every figure as PDF too.
    progress : Progress

    Returns
    -------
    dict
        The content of ``numbers.json``.

    Raises
    ------
    InputError
        For folders that are no finished runs, too few or too many, and for a folder that is not free.
    """
    n, most = len(request.runs), comparison_page.MOST
    if n < 2:
        raise InputError("give the folders of two runs at least", "missing", "runs")
    if n > most:
        raise InputError(f"{n} runs are more than can be told apart in figures; give at most {most}", "limit", "runs")
    progress.stage("read the runs")
    runs = [finished_run(run) for run in request.runs]
    manoeuvre, files = _manoeuvre(request, runs[0])
    labels, source = _labels(request.runs), str(next(iter(files.values()), manoeuvre))
    questions = [_asked(run, source) for run in runs]
    refusals = [question for question in questions if isinstance(question, InputError)]
    if request.manoeuvre is not None and len(refusals) == len(runs):
        raise refusals[0]
    config = request.config(manoeuvre, dict(pair for run in runs for pair in run.files.items()) | files)
    with open_answer(folder, config, files, force=force):
        compared = []
        for label, run, question in zip(labels, runs, questions, strict=True):
            progress.stage(f"{label} on {Path(manoeuvre).stem}")
            compared.append(_compared(label, run, question, request))
        comparison = Comparison(tuple(compared), Path(manoeuvre).stem)
        progress.stage("figures and page")
        numbers = comparison.numbers | {"seed": request.seed}
        tables = {"coefficients.csv": comparison.coefficient_rows(), "distances.csv": comparison.distance_rows()}
        sheet = comparison_page.sheet(comparison, commit=config["commit"], seed=request.seed)
        write_answer(folder, PAGE, sheet, numbers, tables, pdf=pdf)
    return numbers


def _manoeuvre(request: Request, first: FinishedRun) -> tuple[str, dict[str, Path]]:
    """The manoeuvre that all predict, and name -> its file if it is none that is built in."""
    if request.manoeuvre is not None:
        name, place = request.manoeuvre, request.manoeuvre
    else:
        name = next((trial.manoeuvre for _, trial, _ in first.study.each_trial() if trial.manoeuvre), USUAL)
        place = first.study.path(name)
    return name, {name: Path(place)} if toml_files.is_path(name) else {}


def _labels(folders: Sequence[Path]) -> list[str]:
    """The names of folders, or as much of their paths as tells them apart."""
    for n in range(1, max(len(folder.parts) for folder in folders) + 1):
        labels = ["/".join(folder.parts[-n:]) for folder in folders]
        if len(set(labels)) == len(labels):
            return labels
    raise InputError(f"{folders[0]}: is given twice; a run is not compared with itself", "conflict", "runs")


def _asked(run: FinishedRun, manoeuvre: str) -> Asked | InputError:
    """The manoeuvre posed to a run, or why it does not fit."""
    try:
        return asked(run, manoeuvre)
    except InputError as error:
        return error


def _compared(label: str, run: FinishedRun, question: Asked | InputError, request: Request) -> ComparedRun:
    prediction, why_not = None, ""
    if isinstance(question, InputError):
        why_not = str(question)
    else:
        rng = np.random.default_rng(request.seed)
        prediction = predicted_by(run, question, rng, request.draws, by=(POSTERIOR,))
        if not prediction.motions[POSTERIOR].is_flown:
            why_not = "with most draws the boat does not complete it"
    trials = [trial.manoeuvre or trial.data for _, trial, _ in run.study.each_trial()]
    about = {
        "study": run.study.name,
        "vehicle": run.vehicle.name,
        "equations": run.vehicle.equations.name,
        "trials": ", ".join(Path(str(name)).name for name in trials),
        "bayesub": f"{run.config['versions'].get('bayesub', '')} {run.config['commit']}",
        "simulations": run.posterior.evaluations,
        "seconds": round(run.posterior.seconds, 1),
    }
    others = {key: value for key, value in settings(run.config).items() if key.partition(".")[0] not in _UNTOLD}
    others["sources_sha256"] = others["sources_sha256"][:_DIGITS]
    return ComparedRun(label, run.vehicle, run.posterior, about, others, prediction, why_not)
