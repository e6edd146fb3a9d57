"""Figures and report of a finished run, made again from what its folder keeps."""

import json
from dataclasses import replace
from pathlib import Path

from bayesub.io import toml_files
from bayesub.io.errors import InputError
from bayesub.study import script
from bayesub.study.provenance import COMPUTED, copy_name, file_digest
from bayesub.study.result import StudyResult, load_result
from bayesub.study.run_folder import CONFIG, CROSS_CHECK, saved_config
from bayesub.study.study_file import Study

OTHERS = {"design": "design with --resume", "prediction": "predict with --force", "comparison": "compare with --force"}


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
    config = saved_config(folder)
    if config is None:
        raise InputError(f"{folder}: is not a run folder, {CONFIG} is missing", "state", CONFIG)
    for key, remedy in OTHERS.items():
        if key in config:
            raise InputError(f"{folder}: is a {key}; bayesub {remedy} writes its page again", "state", key)
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
    if not (folder / "posterior.nc").exists():
        raise InputError(
            f"{folder}: posterior.nc is missing: without the draws neither figures nor report can be drawn again "
            "(numbers.json and the figures that are there are those of the run); run the study again to have them",
            "state",
            "posterior.nc",
        )
    study = saved_study(folder, config)
    from bayesub.inference import baselines
    from bayesub.inference.sampling import CrossCheck, posterior_file
    from bayesub.study.infer import ESTIMATES, conclude
    from bayesub.study.prepare import prepare

    posterior = posterior_file.load(folder / "posterior.nc")
    try:
        estimates = [baselines.Estimate.from_json(e) for e in json.loads((folder / ESTIMATES).read_text())]
        seconds = json.loads((folder / "numbers.json").read_text())["seconds"]
        check_file = folder / CROSS_CHECK
        check = CrossCheck.from_json(json.loads(check_file.read_text())) if check_file.exists() else None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{folder}: {ESTIMATES}, {CROSS_CHECK} or numbers.json is damaged ({error}); run the study again",
            "format",
            ESTIMATES,
        ) from None
    options = {"seconds": seconds, "pdf": pdf, "commit": config["commit"]}
    return conclude(prepare(study), folder, estimates, posterior, check, **options)


def saved_study(folder: Path, config: dict) -> Study:
    """The study of a run, whose files are the copies in its folder."""
    source = folder / CONFIG
    content = {key: value for key, value in config.items() if key not in COMPUTED}
    study = toml_files.validate(content, Study, str(source))
    digests, places = config.get("files_sha256", {}), {}
    for name in dict.fromkeys((*study.files, *digests)):
        digest = digests.get(name, "")
        places[name] = folder / copy_name(name, digest)
        if file_digest(places[name]) != digest:
            raise InputError(f"{folder}: {places[name]} has changed since the run; run the study again", "state")
    return study.located(source, places, quick=config["quick_run"])
