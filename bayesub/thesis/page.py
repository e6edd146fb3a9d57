"""The page of counterparts: every row of the thesis's tables, ours from a folder of studies, and their ratio."""

from pathlib import Path

from bayesub.io import toml_files
from bayesub.io.atomic import write_text, writing
from bayesub.io.errors import InputError
from bayesub.report.markdown import table
from bayesub.study import gallery
from bayesub.thesis import counterparts
from bayesub.thesis.counterparts import NONE, NOT_KEPT, NOT_RUN, NUMBERS, Row, TableSection

PAGE = "README.md"
TITLE = "# Beside the thesis"
INTRODUCTION = """\
Every row of the thesis's tables that is legible, and what the studies of this folder find; ours are read from each
study's `numbers.json`. Three numbers in a row are submarines 1 to 3 there and suboff, auv690 and npsauv here. The
thesis's boats are classified and ours are others: ranks, rankings and orders of magnitude can agree, values need not.
Ratios are ours over the thesis's, of the means where the scan has fewer legible. Lengths marked * are on a boat as long
as suboff. An empty last cell is as the one above. `bayesub report` of this folder writes the page."""


def write(folder: Path) -> Path | None:
    """Write ``README.md`` into a folder of runs and give its path; None if no study in it has counterparts.

    InputError if the folder has another README.
    """
    sections, _, _ = counterparts.load()
    if not any(_is_run(folder, section.study) for section in sections.values() if section.study):
        return None
    file = folder / PAGE
    if file.exists() and not file.read_text(encoding="utf-8", errors="replace").startswith(TITLE):
        raise InputError(f"{file}: is not bayesub's and would be replaced; move it first")
    text = page(folder)
    with writing(file):
        write_text(file, text)
    return file


def page(folder: Path) -> str:
    """The text of the page, in Markdown."""
    sections, elsewhere, beyond = counterparts.load()
    rows = {name: counterparts.rows(folder, name, section) for name, section in sections.items()}
    lines = [TITLE, "", INTRODUCTION, "", _count([row for some in rows.values() for row in some])]
    lines += ["", "## All studies", "", *gallery.lines(folder)]
    for name, section in sections.items():
        lines += ["", f"## {section.title}", "", *_links(folder, section), *_table(rows[name])]
    lines += ["", "## Without a row", "", *table(("thesis", "reason"), elsewhere.items())]
    others = _others(folder, {section.study for section in sections.values()}, beyond)
    lines += ["", "## Beyond the thesis", "", *table(("study", "takes further", "question"), others)]
    return "\n".join(lines) + "\n"


def _is_run(folder: Path, study: str) -> bool:
    return (folder / study / NUMBERS).is_file()


def _count(rows: list[Row]) -> str:
    states = {state: sum(row.ours == state for row in rows) for state in (NOT_RUN, NOT_KEPT, NONE)}
    words = [f"{n} {'without a counterpart' if state == NONE else state}" for state, n in states.items() if n]
    return f"{len(rows)} rows: " + ", ".join([f"{len(rows) - sum(states.values())} beside ours", *words]) + "."


def _links(folder: Path, section: TableSection) -> list[str]:
    study = section.study
    if not study:
        return []
    if not _is_run(folder, study):
        return [f"Study {study}: {NOT_RUN}.", ""]
    files = {text: f"{study}/{file}" for text, file in section.figures.items()}
    drawn = [f"[{text}]({file})" for text, file in files.items() if (folder / file).exists()]
    place = gallery.entry(folder / study).page or study
    return [f"Study [{study}]({place})" + (f"; thesis {', '.join(drawn)}." if drawn else "."), ""]


def _table(rows: list[Row]) -> list[str]:
    lines, sentence = [], ""
    for row in rows:
        ours = row.ours if isinstance(row.ours, str) else ", ".join(map(_text, row.ours))
        theirs = ", ".join(v if isinstance(v, str) else f"{v:g}" for v in row.thesis)
        ratios = ", ".join(f"{ratio:.2g}" for ratio in row.ratios)
        lines.append((row.label, theirs, ours, ratios, "" if row.sentence == sentence else row.sentence))
        sentence = row.sentence
    return table(("row", "thesis", "ours", "ratio", ""), lines)


def _text(value) -> str:
    """A number in three digits, or in more where that saves an exponent."""
    if isinstance(value, str):
        return value
    return f"{value:.0f}" if 1e3 <= abs(value) < 1e5 else f"{value:.3g}"


def _others(folder: Path, compared: set[str], beyond: dict[str, str]):
    """Studies without a row: those that are foreseen, and whatever else was run."""
    run = {file.parent.name for file in folder.glob("*/config.toml") if _is_run(folder, file.parent.name)}
    for study in [*beyond, *sorted(run - compared - set(beyond))]:
        if study in run:
            question = toml_files.read_toml_table(folder / study / "config.toml").get("question", "")
            yield f"[{study}]({study})", beyond.get(study, ""), question
        else:
            yield study, beyond[study], NOT_RUN
