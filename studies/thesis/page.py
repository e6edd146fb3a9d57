"""The page of counterparts: every row of the thesis's tables, ours from a folder of studies, and their ratio."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from bayesub.io import toml_files
from bayesub.io.atomic import write_text, writing
from bayesub.io.errors import InputError
from bayesub.io.terminal import SILENT, duration
from bayesub.report.markdown import table
from bayesub.study.run import runs
from bayesub.study.run.run_folder import TimedProgress
from thesis import counterparts
from thesis.counterparts import NONE, NOT_KEPT, NOT_RUN, NUMBERS, Row, TableSection

PAGE = "README.md"
_COLUMNS = 3  # of the gallery
TITLE = "# Beside the thesis"
INTRODUCTION = """\
Every row of the thesis's tables that is legible, and what the studies of this folder find; ours are read from each
study's `numbers.json`. Three numbers in a row are submarines 1 to 3 there and suboff, auv690 and npsauv here. The
thesis's boats are classified and ours are others: ranks, rankings and orders of magnitude can agree, values need not.
Ratios are ours over the thesis's, of the means where the scan has fewer legible. Lengths marked * are on a boat as long
as suboff; where both stand in a cell, a criterion in metres makes neither the better one. A dash is a number that the
scan has lost. `median (5 % to 95 %)` is of fifty draws of what the thesis has one of, and the percentage says how many
of the fifty are below its number. An empty last cell is as the one above. `python studies/thesis figures` writes
the page."""


def write(folder: Path) -> Path | None:
    """Write ``README.md`` into a folder of runs and give its path; None if no study in it has counterparts.

    InputError if the folder has another README.
    """
    sections = counterparts.load().sections.values()
    if not any(_is_run(folder, section.study) for section in sections if section.study):
        return None
    file = folder / PAGE
    if file.exists() and not file.read_text(encoding="utf-8", errors="replace").startswith(TITLE):
        raise InputError(f"{file}: is not bayesub's and would be replaced; move it first", "file", PAGE)
    text = page(folder)
    with writing(file):
        write_text(file, text)
    return file


def page(folder: Path) -> str:
    """The text of the page, in Markdown."""
    content = counterparts.load()
    sections = content.sections
    rows = {name: counterparts.rows(folder, name, section) for name, section in sections.items()}
    once = [row for name, some in rows.items() if not sections[name].of for row in some]
    lines = [TITLE, "", INTRODUCTION, "", _count(once), "", "## All studies", "", *gallery(folder)]
    for name, section in sections.items():
        lines += ["", f"## {section.title}", "", *_links(folder, section), *_table(rows[name])]
    drawn = [f"[{text}]({file})" for text, file in content.figures.items() if (folder / file).exists()]
    if drawn:
        lines += ["", "## Figures without a table", "", f"Thesis {', '.join(drawn)}."]
    lines += ["", "## Without a row", "", *table(("thesis", "reason"), content.elsewhere.items())]
    compared = {study for s in sections.values() for study in (s.study, *(entry.study for entry in s.rows))}
    others = _others(folder, compared | {file.partition("/")[0] for file in content.figures.values()}, content.beyond)
    lines += ["", "## Beyond the thesis", "", *table(("study", "takes further", "question"), others)]
    lines += ["", "## How long the runs took", "", *_times(folder)]
    return "\n".join(lines) + "\n"


def _times(folder: Path) -> list[str]:
    """The time of each run whose seconds are in its folder, the longest first, four in a row, and their sum."""
    seconds = {file.parent.name: TimedProgress(file.parent, SILENT).before for file in folder.glob("*/config.toml")}
    known = sorted((item for item in seconds.items() if 0.0 < item[1] < np.inf), key=lambda item: -item[1])
    cells = [f"{name}: {duration(time)}" for name, time in known]
    cells += [""] * (-len(cells) % 4)
    words = f"{len(known)} of {len(seconds)} runs: {duration(sum(time for _, time in known))} together. "
    words += "Those that claim seconds ran alone on two cores, most others two at a time, each on one."
    return [words, "", *table([""] * 4, np.reshape(cells, (-1, 4)))]


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
    files = {text: file if "/" in file else f"{study}/{file}" for text, file in section.figures.items()}
    drawn = [f"[{text}]({file})" for text, file in files.items() if (folder / file).exists()]
    place = runs.entry(folder / study).page or study
    return [f"Study [{study}]({place})" + (f"; thesis {', '.join(drawn)}." if drawn else "."), ""]


def _table(rows: list[Row]) -> list[str]:
    lines, sentence = [], ""
    for row in rows:
        theirs, ratios = _values(row.thesis, "{:g}"), _values(row.ratios, "{:.2g}")
        if row.percentile is not None:
            ours, ratios = _spread(row.ours), f"thesis's at {row.percentile:.0f} %"
        else:
            ours = row.ours if isinstance(row.ours, str) else _values(row.ours)
        if row.scaled:
            ours, ratios = f"{ours}; * {_values(row.scaled)}", f"{ratios}; * {_values(row.scaled_ratios, '{:.2g}')}"
        lines.append((row.label, theirs, ours, ratios, "" if row.sentence == sentence else row.sentence))
        sentence = row.sentence
    return table(("row", "thesis", "ours", "ratio", ""), lines)


def _values(values: list, style: str = "") -> str:
    """Values in a row; a dash for what the scan does not give."""
    return ", ".join(
        v if isinstance(v, str) else "-" if np.isnan(v) else style.format(v) if style else _text(v) for v in values
    )


def _spread(values: list) -> str:
    low, middle, high = np.quantile(values, (0.05, 0.5, 0.95))
    return f"{_text(middle)} ({_text(low)} to {_text(high)})"


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
            yield f"[{study}]({runs.entry(folder / study).page or study})", beyond.get(study, ""), question
        else:
            yield study, beyond[study], NOT_RUN


def gallery(folder: Path) -> list[str]:
    """The gallery of a folder of runs as a table in Markdown; studies without a page are left out."""
    shown = [runs.entry(file.parent) for file in sorted(folder.glob("*/config.toml"))]
    return cards([study for study in shown if study.page])


def cards(studies: Iterable[runs.Entry]) -> list[str]:
    """A table in Markdown with a cell a study: picture, name, question."""
    cells = []
    for study in studies:
        picture = f'<img src="{study.picture}" width="270" alt="{study.name}"><br>' if study.picture else ""
        question = study.question.replace("<", "&lt;").replace("|", "\\|")
        cells.append(f"[{picture}**{study.name}**]({study.page})<br>{question}")
    rows = [cells[k : k + _COLUMNS] for k in range(0, len(cells), _COLUMNS)]
    table = [f"|{' |' * _COLUMNS}", f"|{' --- |' * _COLUMNS}"]
    return table + [f"| {' | '.join(row + [''] * (_COLUMNS - len(row)))} |" for row in rows]
