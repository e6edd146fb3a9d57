"""Self-contained pages in HTML: all extend ``page.html``, hold their figures, and ask nothing of the network.

A figure is a PNG, or the SVG of matplotlib with fewer digits, and with one set of glyphs and styles for all of a page.
"""

import base64
import re
import tempfile
import unicodedata
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import metadata
from itertools import count
from pathlib import Path
from typing import NamedTuple

import numpy as np
from markupsafe import Markup

from bayesub.io import templates
from bayesub.io.atomic import write_text
from bayesub.io.terminal import SILENT, Progress
from bayesub.report import copies

PLACE = '<nav aria-label="Contents"></nav>'
_HEADING = re.compile(r"<h2>(.*?)</h2>")
_GREEK = {"delta": "δ", "nu": "ν", "eta": "η"}

_LEFT_OUT = re.compile(r"<metadata>.*?</metadata>|<style.*?</style>|<!--.*?-->", re.DOTALL)
_GLYPH = re.compile(r'<path id="([^"]+)" d="([^"]*)" transform="scale\(0\.015625\)"/>')
_USE = re.compile(r'<use xlink:href="#([^"]+)"(?: transform="translate\((\S+) (\S+)\)")?')
_EMPTY = re.compile(r"<(g|defs)[^>]*(/>|></\1>)")
_NUMBER = re.compile(r"-?\d+\.\d+(?:e-?\d+)?")

_INCH = 96  # pixels of the page for an inch of a figure
_DPI = 150  # of a PNG
_DENSER = 5.0  # an SVG of matplotlib's over what is left of it here, at most


@dataclass(frozen=True)
class ReportFigure:
    """One figure of a page."""

    name: str  # of its files, without suffix
    caption: str  # what it shows, in sentences of which the first stands for the figure where it cannot be seen
    draw: Callable[[Path | list[Path]], None]  # draws it to one path or a list of paths
    title: str = ""  # what stands above it; empty where the page says it


def draw_all(
    figures: Sequence[ReportFigure], folder: Path, *, pdf: bool = False, progress: Progress = SILENT
) -> dict[str, tuple[str, bytes]]:
    """Draw figures into files of a folder, PDFs too if asked; name -> caption, and what a page shows, PNG or SVG."""
    pictures: dict[str, tuple[str, bytes]] = {}
    progress.stage("figures and page")
    with tempfile.TemporaryDirectory() as scratch:
        files = {f.name: [folder / f"{f.name}.png", Path(scratch) / f"{f.name}.svg"] for f in figures}
        with copies.beside():
            for n, figure in enumerate(figures):
                progress.update(n, len(figures), "figures", figure.name)
                figure.draw(files[figure.name] + ([folder / f"{figure.name}.pdf"] if pdf else []))
        for figure in figures:
            png, svg = files[figure.name]
            pictures[figure.name] = figure.caption, smaller(png.read_bytes(), svg.read_bytes())
    progress.update(len(figures), len(figures), "figures")
    return pictures


def fill(template: str, pictures: Mapping[str, tuple[str, bytes]], /, **values) -> str:
    """The page of a template of this folder, which extends ``page.html`` and has names that `values` stand for.

    `pictures` are those of :func:`draw_all`: name of a figure -> its caption and its PNG or SVG.
    """
    shared = Drawings()
    placed = {name: shared.place(*picture) for name, picture in pictures.items()}
    about = {"pictures": placed, "glyphs": shared.common, "version": metadata.version("bayesub")}
    return with_contents(templates.fill("bayesub.report", template, **about, **values))


@dataclass(frozen=True)
class Verdict:
    """A word in bold and a sentence, green or red."""

    good: bool
    word: str
    text: str


@dataclass(frozen=True)
class Table:
    """A table of a page."""

    title: str
    heads: Sequence[str]  # n of them
    rows: Sequence[Sequence[str]]  # of n texts each
    words: Sequence[str] = ()  # heads of the columns that are words, not numbers
    text: str = ""  # what stands above it


@dataclass(frozen=True)
class Sheet:
    """A page."""

    title: str
    question: str
    verdicts: Sequence[Verdict]
    facts: Mapping[str, str] = field(default_factory=dict)  # word -> sentence; empty ones are left out
    parts: Sequence[ReportFigure | Table] = ()  # in the order of the page
    commit: str = "unknown"  # of the sources
    seed: int = 0

    def write(self, file: Path, *, pdf: bool = False) -> None:
        """Write the page, and its figures beside it; of them PDFs too if asked."""
        pictures = draw_all([part for part in self.parts if isinstance(part, ReportFigure)], file.parent, pdf=pdf)
        write_text(file, fill("sheet.html", pictures, sheet=self))


def with_contents(page: str) -> str:
    """A page whose headings ``<h2>`` have names to link to, and are listed at :data:`PLACE`."""
    entries = {}

    def name_heading(match: re.Match) -> str:
        words = re.sub(r"[^a-z0-9]+", "-", Markup(match[1]).striptags().lower()).strip("-")
        name = next(one for k in count(1) if (one := words if k == 1 else f"{words}-{k}") not in entries)
        entries[name] = match[1]
        return f'<h2 id="{name}">{match[1]}</h2>'

    page = _HEADING.sub(name_heading, page)
    items = "".join(f'<li><a href="#{name}">{title}</a></li>' for name, title in entries.items())
    return page.replace(PLACE, f"{PLACE.removesuffix('</nav>')}<ol>{items}</ol></nav>", 1)


def product(regressor: str) -> Markup:
    """A regressor such as ``u*abs(r)*dr*dr`` in HTML, u |r| δ with a subscript, squared."""
    powers: dict[str, int] = {}
    for name, _, power in (factor.strip().partition("^") for factor in regressor.split("*")):
        powers[name] = powers.get(name, 0) + int(power or 1)
    raised = (Markup("{}<sup>{}</sup>" if n != 1 else "{}").format(_factor(f), n) for f, n in powers.items())
    return Markup(" ").join(raised)


def _factor(name: str) -> Markup:
    function, _, inner = name.rstrip(")").rpartition("(")
    letter, _, index = (f"δ_{inner[1]}" if len(inner) == 2 and inner[0] == "d" else inner).partition("_")
    stem = letter.removesuffix("dot")
    letter = unicodedata.normalize("NFC", _GREEK.get(stem, stem) + "\u0307" * (stem != letter))
    shown = Markup("<i>{}</i><sub>{}</sub>" if index else "<i>{}</i>").format(letter, index)
    return Markup({"abs": "|{}|", "": "{}"}.get(function, "sgn({})")).format(shown)


def symbol(label: str) -> Markup:
    r"""A label such as ``$N'_{v|\nu|}$`` in HTML, with its subscript."""
    text = re.sub(r"\\dot\{?(\w)\}?", "\\1\u0307", label.strip("$"))
    text = re.sub(r"\\([a-z]+)", lambda match: _GREEK.get(match[1], match[1]), text).replace("'", "\u2032")
    letter, _, subscript = unicodedata.normalize("NFC", text).partition("_")
    return Markup("<i>{}</i><sub>{}</sub>").format(letter, re.sub(r"[{}_ ]", "", subscript))


class Drawing(NamedTuple):
    """What stands in the element of an SVG: its view box, its width in pixels, and its content."""

    box: str
    width: int
    content: Markup


class Drawings:
    """The drawings of one page, and what they share."""

    def __init__(self) -> None:
        self._glyphs: dict[str, tuple[str, str]] = {}
        self._styles: dict[str, str] = {}
        self._n_drawings = 0

    def place(self, caption: str, image: bytes) -> dict:
        """A picture as the templates take it: a PNG as ``data``, or an SVG as ``drawing``."""
        if image.startswith(b"<"):
            return {"caption": caption, "data": "", "drawing": self.inline(image.decode("utf-8"))}
        width = round(int.from_bytes(image[16:20]) * _INCH / _DPI)
        return {"caption": caption, "data": base64.b64encode(image).decode("ascii"), "width": width, "drawing": None}

    def inline(self, svg: str) -> Drawing:
        """An SVG of matplotlib's."""
        head, body = svg[svg.index("<svg") :].split(">", 1)
        box = re.findall(r'viewBox="([^"]*)"', head)[0]
        body = _LEFT_OUT.sub("", body.rpartition("</svg>")[0])
        body = _GLYPH.sub(self._keep, body)
        body = _USE.sub(self._use, body)
        body = re.sub(r'style="([^"]*)"', self._style, body).replace("xlink:href", "href")
        body = re.sub(r'\bd="([^"]*)"', lambda match: f'd="{_path(match[1])}"', body)
        body = re.sub(r'translate\([^)]*\)|\b(?:x|y|width|height)="[^"]*"', lambda match: _round(match[0]), body)
        body = re.sub(r">\s+<", "><", self._own_names(body))
        while (shorter := _EMPTY.sub("", body)) != body:
            body = shorter
        return Drawing(_round(box), round(float(box.split()[2]) * _INCH / 72), Markup(body.strip()))

    @property
    def common(self) -> Markup:
        """What a page with drawings has once, before them."""
        named = ((name, _path(path)) for name, path in self._glyphs.values())
        glyphs = "".join(f'<path id="{name}" d="{path}" transform="scale(.015625)"/>' for name, path in named)
        rules = "".join(f".{name}{{{style}}}" for style, name in self._styles.items())
        content = f"<style>{rules}</style><defs>{glyphs}</defs>"
        return Markup(f'<svg class="glyphs" aria-hidden="true">{content}</svg>' if self._n_drawings else "")

    def _keep(self, match) -> str:
        self._glyphs.setdefault(match[1], (f"c{len(self._glyphs)}", match[2]))
        return ""

    def _use(self, match) -> str:
        """A glyph, or a marker of this drawing."""
        if match[1] not in self._glyphs:
            return match[0]
        moved = zip("xy", match.groups(default="0")[1:], strict=True)
        place = "".join(f' {axis}="{value}"' for axis, value in moved if value != "0")
        return f'<use xlink:href="#{self._glyphs[match[1]][0]}"{place}'

    def _style(self, match) -> str:
        style = re.sub(r"\s*([:;,])\s*", r"\1", match[1]).strip("; ")
        return f'class="{self._styles.setdefault(style, f"s{len(self._styles)}")}"'

    def _own_names(self, body: str) -> str:
        """Names of clips and markers that no other drawing has; those that nothing refers to are left out."""
        self._n_drawings += 1
        wanted = [name for name in dict.fromkeys(re.findall(r' id="([^"]*)"', body)) if f"#{name}" in body]
        own = {name: f"d{self._n_drawings}-{k}" for k, name in enumerate(wanted)}
        body = re.sub(r' id="([^"]*)"', lambda match: f' id="{own[match[1]]}"' if match[1] in own else "", body)
        return re.sub(r"#([\w-]+)", lambda match: f"#{own.get(match[1], match[1])}", body)


def smaller(png: bytes, svg: bytes) -> bytes:
    """That of two pictures which takes less of a page, glyphs and styles that drawings share not counted."""
    most = 4 * len(png) // 3
    if len(svg) > _DENSER * most or len(Drawings().inline(svg.decode("utf-8")).content) > most:
        return png
    return svg


def _round(text: str) -> str:
    """A text whose numbers have one digit after the point, a tenth of a point being a seven hundredth of an inch."""
    return _NUMBER.sub(lambda match: f"{round(float(match[0]), 1) + 0.0:g}", text)


def _path(text: str) -> str:
    """The commands of a path in few letters: in tenths of its unit from point to point, and one that repeats once."""
    parts, last = [], ""
    place, start = np.zeros(2, dtype=int), np.zeros(2, dtype=int)
    for command, values in re.findall(r"([MLQCz])([^A-Za-z]*)", text):
        points = np.rint(10.0 * np.array(values.split(), dtype=float)).astype(int).reshape(-1, 2)
        words = " ".join(f"{tenths / 10:g}" for tenths in (points - place).ravel().tolist())
        place = start if command == "z" else points[-1]
        start = place if command == "M" else start
        words = re.sub(r"(?<!\d)0\.", ".", words).replace(" -", "-")
        apart = ("" if words[:1] == "-" else " ") if command == last else command.lower()
        parts.append(apart + words)
        last = command
    return "".join(parts)
