"""Self-contained pages in HTML: all extend ``page.html``, hold their figures, and ask nothing of the network."""

import re
import unicodedata
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import metadata
from itertools import count
from pathlib import Path

from markupsafe import Markup

from bayesub.io import templates
from bayesub.io.atomic import write_text
from bayesub.report import drawings

PLACE = '<nav aria-label="Contents"></nav>'
_HEADING = re.compile(r"<h2>(.*?)</h2>")
_GREEK = {"delta": "δ", "nu": "ν", "eta": "η"}


@dataclass(frozen=True)
class ReportFigure:
    """One figure of a page.

    Attributes
    ----------
    name : str
        Of its files, without suffix.
    caption : str
        What it shows, in sentences of which the first stands for the figure where it cannot be seen.
    draw : callable
        Draws it to one path or a list of paths.
    title : str
        What stands above it; empty where the page says it.
    """

    name: str
    caption: str
    draw: Callable[[Path | list[Path]], None]
    title: str = ""


def drawn(figures: Iterable[ReportFigure], folder: Path, *, pdf: bool = False) -> dict[str, tuple[str, bytes]]:
    """Draw figures into files of a folder, PDFs too if asked; name -> caption, and what a page shows, PNG or SVG."""
    suffixes = (".png", ".pdf") if pdf else (".png",)
    return {figure.name: (figure.caption, drawings.drawn(figure, folder, suffixes)) for figure in figures}


def filled(template: str, pictures: Mapping[str, tuple[str, bytes]], /, **values) -> str:
    """The page of a template of this folder.

    Parameters
    ----------
    template : str
        Which extends ``page.html``.
    pictures : mapping
        Name of a figure -> its caption and its PNG or SVG, of :func:`drawn`.
    **values
        What the other names in the template stand for.
    """
    shared = drawings.Shared()
    placed = {name: shared.placed(*picture) for name, picture in pictures.items()}
    about = {"pictures": placed, "glyphs": shared.shared, "version": metadata.version("bayesub")}
    return templates.fill("bayesub.report", template, **about, **values)


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
        pictures = drawn((part for part in self.parts if isinstance(part, ReportFigure)), file.parent, pdf=pdf)
        write_text(file, filled("sheet.html", pictures, sheet=self))


def with_contents(page: str) -> str:
    """A page whose headings ``<h2>`` have names to link to, and are listed at :data:`PLACE`."""
    entries = {}

    def named(match: re.Match) -> str:
        words = re.sub(r"[^a-z0-9]+", "-", Markup(match[1]).striptags().lower()).strip("-")
        name = next(one for k in count(1) if (one := words if k == 1 else f"{words}-{k}") not in entries)
        entries[name] = match[1]
        return f'<h2 id="{name}">{match[1]}</h2>'

    page = _HEADING.sub(named, page)
    items = "".join(f'<li><a href="#{name}">{title}</a></li>' for name, title in entries.items())
    return page.replace(PLACE, f"{PLACE.removesuffix('</nav>')}<ol>{items}</ol></nav>", 1)


def symbol(label: str) -> Markup:
    r"""A label such as ``$N'_{v|\nu|}$`` in HTML, with its subscript."""
    text = re.sub(r"\\dot\{?(\w)\}?", "\\1\u0307", label.strip("$"))
    text = re.sub(r"\\([a-z]+)", lambda match: _GREEK.get(match[1], match[1]), text).replace("'", "\u2032")
    letter, _, subscript = unicodedata.normalize("NFC", text).partition("_")
    return Markup("<i>{}</i><sub>{}</sub>").format(letter, re.sub(r"[{}_ ]", "", subscript))
