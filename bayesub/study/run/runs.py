"""Runs of studies in a folder: which studies there are, which are done, and the pages that list them."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from bayesub.findings.verdicts import FAILED, NOT_FINISHED
from bayesub.io import templates, toml_files
from bayesub.io.atomic import write_text, writing
from bayesub.io.errors import InputError
from bayesub.io.terminal import duration
from bayesub.study import provenance
from bayesub.study.run.result import StudyResult, load_result
from bayesub.study.run.run_folder import CONFIG, saved_config

INDEX, EQUAL = "index.html", "equal.toml"
_PICTURE = re.compile(r"!\[[^\]]*\]\(([^)]+\.png)\)")
_FUNCTION = re.compile(r"^(def|from) .*\b(compute|draw|claims)\b", re.MULTILINE)  # of a script
_ORDERS = "orders.png"  # what was done, not what was found


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
    return [path for path in paths if _may_be_study(path)]


def _may_be_study(path: Path) -> bool:
    """False for other input files and modules; what cannot be read is left to be complained of when its turn comes."""
    try:
        if path.suffix == ".py":
            return bool(_FUNCTION.search(toml_files.read_text(path)))
        return "vehicle" in toml_files.read_toml_table(path)
    except InputError:
        return True


def folders(paths: Iterable[Path], output: Path) -> dict[Path, Path]:
    """Study -> run folder, named after the file, with the suffix if two files have the same name without."""
    paths = list(paths)
    stems = [path.stem for path in paths]
    return {path: output / (path.stem if stems.count(path.stem) == 1 else path.name) for path in paths}


def flaws(folder: Path, study: Path | None) -> dict[str, str]:
    """Why the run of a folder is not what its study, if it is there, gives now; empty for a current run.

    Of ``sources``, ``versions``, ``commit`` and ``study``, what has changed -> how; what is unknown is left out.
    """
    from bayesub.study.run.run import read

    try:
        saved = saved_config(folder) or {}
        if study is None:
            return {"study": "its study is not there"}
        saved |= {"sources_sha256": counts_as(saved.get("sources_sha256", ""), folder.name, folder.parent / EQUAL)}
        config = read(study, quick=bool(saved.get("quick_run"))).config()
    except InputError as error:
        return {"study": str(error)}
    # A run of before the record of rooms has other digests of scripts; that it is stale is certain.
    is_comparable = "sources" in saved or "script_sha256" not in saved
    found = {
        "sources": provenance.sources_change(saved, config),
        "versions": provenance.versions_change(saved, config),
        "commit": provenance.commit_flaw(saved.get("commit", "")),
        "study": provenance.study_change(saved, config) if is_comparable else "",
    }
    return {what: text for what, text in found.items() if text}


def counts_as(made: str, name: str, file: Path) -> str:
    """As which the digest of a run's sources counts after changes, of a file, that left its numbers as they were."""
    for change in toml_files.read_toml_table(file).get("change", ()) if file.exists() else ():
        before, after = change.get("studies", {}).get(name, (made, made))
        made = after if made == before else made
    return made


def write_index(output: Path, results: Iterable[StudyResult] = ()) -> Path:
    """Write ``index.html``, the page of the runs in `output` and of those `results` that failed; gives its path."""
    with writing(output):
        shown = {file.parent: entry(file.parent) for file in output.glob(f"*/{CONFIG}")}
        runs = {
            folder: load_result(folder) or StudyResult(folder.name, study.question, NOT_FINISHED, str(folder))
            for folder, study in shown.items()
        }
        runs |= {Path(result.folder): result for result in results if result.verdict == FAILED}
        rows = []
        for folder, result in sorted(runs.items()):
            study = shown.get(folder) or entry(folder)
            page = f"{folder.name}/report.html" if result.report else study.page or f"{folder.name}/"
            row = {"place": folder.name, "link": page if folder.is_dir() else "", "picture": study.picture}
            rows.append(vars(result) | {"good": result.good} | row)
        write_text(output / INDEX, templates.fill("bayesub.study.run", INDEX, rows=rows, duration=duration))
    return output / INDEX


@dataclass(frozen=True)
class Entry:
    """A study of a folder of runs."""

    name: str  # of its folder
    question: str  # of the study
    page: str  # its page in Markdown, from the folder of runs; empty if there is none
    picture: str  # the first picture of the page that shows what was found; empty if there is none


def entry(run: Path) -> Entry:
    """The study of a run folder."""
    try:
        config = saved_config(run) or {}
    except InputError:
        config = {}
    files = [run / f"{config.get('name', run.name)}.md", run / "report.md"]
    page = next((file for file in files if file.is_file()), None)
    pictures = _PICTURE.findall(page.read_text(encoding="utf-8")) if page else []
    picture = next((picture for picture in pictures if picture != _ORDERS and (run / picture).is_file()), "")
    place = {"page": f"{run.name}/{page.name}" if page else "", "picture": f"{run.name}/{picture}" if picture else ""}
    return Entry(run.name, str(config.get("question", "")), **place)
