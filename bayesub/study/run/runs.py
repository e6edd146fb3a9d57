"""Runs of studies in a folder: which studies there are, which are done, and the page that lists them."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from bayesub.io import templates, toml_files
from bayesub.io.atomic import write_text, writing
from bayesub.io.errors import InputError
from bayesub.io.terminal import duration
from bayesub.study.provenance import code_change, study_change
from bayesub.study.run import gallery
from bayesub.study.run.result import FAILED, NOT_FINISHED, StudyResult, load_result
from bayesub.study.run.run_folder import CONFIG, STOPPING, saved_config

INDEX = "index.html"


@dataclass(frozen=True)
class RunState:
    """The state of a run folder with respect to a study.

    Attributes
    ----------
    result : StudyResult or None
        Of the run in the folder, if it came to its end.
    is_begun : bool
        Whether there is a run at all.
    study_change : str
        How the study differs from that of the run, its stopping rule aside; empty if it does not.
    code_change : str
        How the code differs from that of the run; empty if it does not.
    is_done : bool
        Whether the run came to its end by this very study.
    is_other : bool
        Whether it is the full version where the small one is wanted, or the other way round.
    """

    result: StudyResult | None = None
    is_begun: bool = False
    study_change: str = ""
    code_change: str = ""
    is_done: bool = False
    is_other: bool = False

    @property
    def stale(self) -> str:
        """Why the run is stale; empty if it is not."""
        return self.code_change or self.study_change


def state(folder: Path, config: dict, *, force: bool = False) -> RunState:
    """The state of a run folder with respect to the study of this configuration.

    Raises
    ------
    InputError
        If the folder holds the full version and the small one is wanted, or the other way round, without `force`.
    """
    saved = saved_config(folder)
    if saved is None:
        return RunState()
    is_other = saved.get("quick_run") != config["quick_run"]
    if is_other and not force:
        kinds = {True: "the small version (--quick)", False: "the full version"}
        wanted, present = kinds[config["quick_run"]], kinds[bool(saved.get("quick_run"))]
        raise InputError(
            f"{folder}: holds {present}, not {wanted}; use --force to replace it, or another -o", "state", "--quick"
        )
    result, code = load_result(folder), code_change(saved, config)
    change = study_change(saved, config, ignored=STOPPING)
    is_done = result is not None and not code and not study_change(saved, config)
    return RunState(result, True, change, code, is_done, is_other)


def studies_in(folder: Path) -> list[Path]:
    """The studies of a folder in order of their names: Python scripts, and TOML files that name a vehicle.

    A file that cannot be read is among them, so that its error shows when its turn comes.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: is not a folder", "file")
    if not (studies := study_files(folder)):
        raise InputError(f"{folder}: holds no study, neither TOML that names a vehicle nor Python", "missing")
    return studies


def study_files(folder: Path) -> list[Path]:
    """As :func:`studies_in`; empty for a folder without studies."""
    paths = sorted(p for p in folder.glob("*") if p.suffix in (".toml", ".py") and not p.name.startswith((".", "_")))
    return [path for path in paths if path.suffix == ".py" or _may_be_study(path)]


def _may_be_study(path: Path) -> bool:
    """False for other input files; what cannot be read is left to be complained of when its turn comes."""
    try:
        return "vehicle" in toml_files.read_toml_table(path)
    except InputError:
        return True


def folders(paths: Iterable[Path], output: Path) -> dict[Path, Path]:
    """Study -> run folder, named after the file, with the suffix if two files have the same name without."""
    paths = list(paths)
    stems = [path.stem for path in paths]
    return {path: output / (path.stem if stems.count(path.stem) == 1 else path.name) for path in paths}


def write_index(output: Path, results: Iterable[StudyResult] = ()) -> Path:
    """Write ``index.html``, the page of the runs in `output` and of those `results` that failed; gives its path."""
    with writing(output):
        places = [file.parent for file in output.glob(f"*/{CONFIG}")]
        runs = {folder: load_result(folder) or _unfinished(folder) for folder in places}
        runs |= {Path(result.folder): result for result in results if result.verdict == FAILED}
        rows = [_row(folder, runs[folder]) for folder in sorted(runs)]
        write_text(output / INDEX, templates.fill("bayesub.study.run", INDEX, rows=rows, duration=duration))
    return output / INDEX


def _unfinished(folder: Path) -> StudyResult:
    return StudyResult(folder.name, _question(folder), NOT_FINISHED, str(folder))


def _row(folder: Path, result: StudyResult) -> dict:
    shown = gallery.entry(folder)
    page = f"{folder.name}/report.html" if result.report else shown.page or f"{folder.name}/"
    link = page if folder.is_dir() else ""
    return vars(result) | {"good": result.good, "place": folder.name, "link": link, "picture": shown.picture}


def _question(folder: Path) -> str:
    try:
        return str((saved_config(folder) or {}).get("question", ""))
    except InputError:
        return ""
