"""The studies of a folder at a glance: a picture, the question, and where the page is."""

import re
from dataclasses import dataclass
from pathlib import Path

from bayesub.io.errors import InputError
from bayesub.study.run.run_folder import CONFIG, saved_config

COLUMNS = 3
_PICTURE = re.compile(r"!\[[^\]]*\]\(([^)]+\.png)\)")
_ORDERS = "orders.png"  # what was done, not what was found


@dataclass(frozen=True)
class Entry:
    """A study of a folder of runs.

    Attributes
    ----------
    name : str
        Of its folder.
    question : str
        Of the study.
    page : str
        Its page in Markdown, from the folder of runs; empty if there is none.
    picture : str
        The first picture of the page that shows what was found; empty if there is none.
    """

    name: str
    question: str
    page: str
    picture: str


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


def lines(folder: Path) -> list[str]:
    """The gallery of a folder of runs as a table in Markdown; studies without a page are left out."""
    shown = [entry(file.parent) for file in sorted(folder.glob(f"*/{CONFIG}"))]
    cells = [_cell(study) for study in shown if study.page]
    rows = [cells[k : k + COLUMNS] for k in range(0, len(cells), COLUMNS)]
    table = [f"|{' |' * COLUMNS}", f"|{' --- |' * COLUMNS}"]
    return table + [f"| {' | '.join(row + [''] * (COLUMNS - len(row)))} |" for row in rows]


def _cell(study: Entry) -> str:
    picture = f'<img src="{study.picture}" width="270" alt="{study.name}"><br>' if study.picture else ""
    question = study.question.replace("<", "&lt;").replace("|", "\\|")
    return f"[{picture}**{study.name}**]({study.page})<br>{question}"
