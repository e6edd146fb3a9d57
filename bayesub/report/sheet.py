"""One self-contained page of verdicts, facts, figures and tables, for what is asked of finished runs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path

from bayesub.io import templates
from bayesub.io.atomic import write_text
from bayesub.report import drawings
from bayesub.report.report_figure import ReportFigure


@dataclass(frozen=True)
class Verdict:
    """A word in bold and a sentence, green or red."""

    good: bool
    word: str
    text: str


@dataclass(frozen=True)
class Table:
    """A table of a page.

    Attributes
    ----------
    title : str
    heads : sequence of str
        n of them.
    rows : sequence
        Of n texts each.
    words : sequence of str
        Heads of the columns that are words, not numbers.
    text : str
        What stands above it.
    """

    title: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    words: Sequence[str] = ()
    text: str = ""


@dataclass(frozen=True)
class Sheet:
    """A page.

    Attributes
    ----------
    title, question : str
    verdicts : sequence of Verdict
    facts : mapping of str to str
        Word -> sentence; empty ones are left out.
    parts : sequence of ReportFigure or Table
        In the order of the page.
    commit : str
        Of the sources.
    seed : int
    """

    title: str
    question: str
    verdicts: Sequence[Verdict]
    facts: Mapping[str, str] = field(default_factory=dict)
    parts: Sequence[ReportFigure | Table] = ()
    commit: str = "unknown"
    seed: int = 0

    def write(self, file: Path, *, pdf: bool = False) -> None:
        """Write the page, and its figures beside it; of them PDFs too if asked."""
        suffixes = (".png", ".pdf") if pdf else (".png",)
        pictures, shared = {}, drawings.Sheet()
        for figure in self.parts:
            if isinstance(figure, ReportFigure):
                image = drawings.drawn(figure, file.parent, suffixes)
                pictures[figure.name] = shared.placed(figure.caption, image)
        values = {"sheet": self, "pictures": pictures, "glyphs": shared.shared, "version": metadata.version("bayesub")}
        write_text(file, templates.fill("bayesub.report", "sheet.html", **values))
