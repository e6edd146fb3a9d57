"""Runs of studies in a folder: what became of each, which are done, and the page that lists them."""

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from importlib import resources
from pathlib import Path

import jinja2

from bayesub.io import toml_files
from bayesub.io.atomic import write_text, writing
from bayesub.io.errors import InputError
from bayesub.io.terminal import duration
from bayesub.study import script, study
from bayesub.study.run_folder import STOPPING, first_difference

OUTCOME = "outcome.json"
INDEX = "index.html"
FAILED, NOT_FINISHED = "failed", "not finished"


@dataclass(frozen=True)
class Outcome:
    """What became of a run.

    Attributes
    ----------
    name, question : of the study
    verdict : "converged", "not converged", "not confirmed", "claim holds", "claim failed", "failed" or "not finished"
    good : whether the verdict is what one hopes for
    seconds : from the start, or from the last --resume, to the end
    folder : the run folder
    text : the claim that failed, or why the run did
    """

    name: str
    question: str
    verdict: str
    good: bool
    seconds: float
    folder: str
    text: str = ""

    def save(self) -> None:
        """Write ``outcome.json`` into the run folder: the last file of a run that came to its end."""
        write_text(Path(self.folder) / OUTCOME, json.dumps(asdict(self), indent=1))


def load(folder: Path) -> Outcome | None:
    """The outcome of the run in a folder; None if it has not come to its end."""
    file = folder / OUTCOME
    if not file.exists():
        return None
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        return Outcome(**content | {"folder": str(folder)})
    except (OSError, ValueError, TypeError):
        return None


def is_done(folder: Path, config: dict) -> bool:
    """Whether the folder holds a run of this configuration, stopping rule included, that came to its end."""
    return load(folder) is not None and not first_difference(_config(folder), config)


def is_begun(folder: Path, config: dict) -> bool:
    """Whether the folder holds a run that may be resumed to this configuration; InputError if it holds another one."""
    if not (folder / "config.toml").exists():
        return False
    difference = first_difference(_config(folder), config, but=STOPPING)
    if difference:
        raise InputError(f"{folder}: holds another run, whose {difference}; use --force to replace it, or another -o")
    return True


def _config(folder: Path) -> dict:
    return toml_files.read_toml_table(folder / "config.toml")


def studies_in(folder: Path) -> list[Path]:
    """The studies of a folder in order of their names: Python scripts, and TOML files that name a vehicle."""
    if not folder.is_dir():
        raise InputError(f"{folder}: is not a folder")
    paths = sorted(p for p in folder.iterdir() if p.suffix in (".toml", ".py") and not p.name.startswith((".", "_")))
    found = [path for path in paths if path.suffix == ".py" or _may_be_study(path)]
    if not found:
        raise InputError(f"{folder}: holds no study, neither TOML that names a vehicle nor Python")
    return found


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


def write_index(output: Path, outcomes: Iterable[Outcome] = ()) -> Path:
    """Write ``index.html``, the page of the runs in `output` and of those `outcomes` that failed; gives its path."""
    template = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True).from_string(
        (resources.files("bayesub.study") / INDEX).read_text(encoding="utf-8")
    )
    with writing(output):
        found = {file.parent: load(file.parent) or _unfinished(file.parent) for file in output.glob("*/config.toml")}
        found |= {Path(outcome.folder): outcome for outcome in outcomes if outcome.verdict == FAILED}
        rows = [_row(folder, found[folder]) for folder in sorted(found)]
        write_text(output / INDEX, template.render(rows=rows, duration=duration))
    return output / INDEX


def _unfinished(folder: Path) -> Outcome:
    return Outcome(folder.name, _question(folder), NOT_FINISHED, False, 0.0, str(folder))


def _row(folder: Path, outcome: Outcome) -> dict:
    page = "report.html" if (folder / "report.html").exists() else ""
    return vars(outcome) | {"place": folder.name, "link": f"{folder.name}/{page}" if folder.is_dir() else ""}


def _question(folder: Path) -> str:
    try:
        return str(_config(folder).get("question", ""))
    except InputError:
        return ""


def configuration(path: Path, *, quick: bool) -> tuple[study.Study | None, dict]:
    """The study of a TOML file, or None for a script, and what the result depends on."""
    if path.suffix == ".py":
        return None, script.config(path, quick=quick)
    loaded = study.load_study(path, quick=quick)
    return loaded, study.completed(loaded, quick=quick)
