"""Figures and report of a finished run, made again from what its folder keeps."""

from dataclasses import replace
from pathlib import Path

from bayesub.inference.sampling import CrossCheck, posterior_file
from bayesub.io.errors import InputError
from bayesub.study.after.finished_run import config_of_study, read_back, saved_estimates, saved_study
from bayesub.study.run import script
from bayesub.study.run.infer import POSTERIOR, conclude
from bayesub.study.run.prepare import prepare
from bayesub.study.run.result import StudyResult, load_result
from bayesub.study.run.run_folder import CROSS_CHECK, RunContext


def redraw(folder: str | Path, *, study: str | Path | None = None, pdf: bool = False) -> StudyResult:
    """Draw figures and report of a finished run again; the folder may have been copied from elsewhere.

    Parameters
    ----------
    folder : str or Path
        The run folder.
    study : str, Path or None
        The script to draw with, for a run of a script that keeps no copy of it.
    pdf : bool
        Draw every figure as PDF too.

    Returns
    -------
    StudyResult
        With the seconds of the run.

    Raises
    ------
    InputError
        For a folder that lacks something, which it names, and for a file that has changed since the run.
    """
    folder = Path(folder)
    config = config_of_study(folder, "bayesub {} writes its page again")
    if "script_sha256" in config:
        result = script.redraw(folder, config, study and Path(study), pdf=pdf)
    elif study is not None:
        raise InputError(f"{folder}: is the run of a study in TOML, which needs no --study", "conflict", "--study")
    else:
        result = _redraw(folder, config, pdf)
    saved = load_result(folder)
    return result if saved is None else replace(result, seconds=saved.seconds)


def _redraw(folder: Path, config: dict, pdf: bool) -> StudyResult:
    """The report of a study in TOML."""
    if not (folder / "numbers.json").exists():
        raise InputError(
            f"{folder}: the run has not finished, numbers.json is missing; continue it with --resume",
            "state",
            "numbers.json",
        )
    if not (folder / POSTERIOR).exists():
        raise InputError(
            f"{folder}: {POSTERIOR} is missing: without the draws neither figures nor report can be drawn again "
            "(numbers.json and the figures that are there are those of the run); run the study again to have them",
            "state",
            POSTERIOR,
        )
    study = saved_study(folder, config)
    posterior, estimates = posterior_file.load(folder / POSTERIOR), saved_estimates(folder)
    seconds = read_back(folder / "numbers.json", lambda numbers: numbers["seconds"])
    check = read_back(folder / CROSS_CHECK, CrossCheck.from_json) if (folder / CROSS_CHECK).exists() else None
    context = RunContext(folder, pdf, commit=config["commit"])
    return conclude(prepare(study), context, estimates, posterior, check, seconds=seconds)
