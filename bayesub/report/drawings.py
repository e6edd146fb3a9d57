"""Figures as SVG within a page: matplotlib's with fewer digits, and with one set of glyphs and styles for all."""

import base64
import re
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from markupsafe import Markup

_LEFT_OUT = re.compile(r"<metadata>.*?</metadata>|<style.*?</style>|<!--.*?-->", re.DOTALL)
_GLYPH = re.compile(r'<path id="([^"]+)" d="([^"]*)" transform="scale\(0\.015625\)"/>')
_USE = re.compile(r'<use xlink:href="#([^"]+)"(?: transform="translate\((\S+) (\S+)\)")?')
_EMPTY = re.compile(r"<(g|defs)[^>]*(/>|></\1>)")
_NUMBER = re.compile(r"-?\d+\.\d+(?:e-?\d+)?")

_PIXELS = 150 / 72  # of a point, those of a PNG
_DENSER = 5.0  # an SVG of matplotlib's over what is left of it here, at most


class Drawing(NamedTuple):
    """What stands in the element of an SVG: its view box, its width in pixels, and its content."""

    box: str
    width: int
    content: Markup


class Shared:
    """The drawings of one page, and what they share."""

    def __init__(self):
        self._glyphs, self._styles, self._n_drawings = {}, {}, 0

    def placed(self, caption: str, image: bytes) -> dict:
        """A picture as the templates take it: a PNG as ``data``, or an SVG as ``drawing``."""
        if image.startswith(b"<"):
            return {"caption": caption, "data": "", "drawing": self.inlined(image.decode("utf-8"))}
        return {"caption": caption, "data": base64.b64encode(image).decode("ascii"), "drawing": None}

    def inlined(self, svg: str) -> Drawing:
        """An SVG of matplotlib's."""
        head, body = svg[svg.index("<svg") :].split(">", 1)
        box = re.search(r'viewBox="([^"]*)"', head)[1]
        body = _LEFT_OUT.sub("", body.rpartition("</svg>")[0])
        body = _GLYPH.sub(self._keep, body)
        body = _USE.sub(self._use, body)
        body = re.sub(r'style="([^"]*)"', self._style, body).replace("xlink:href", "href")
        body = re.sub(r'\bd="([^"]*)"', lambda match: f'd="{_path(match[1])}"', body)
        body = re.sub(r'translate\([^)]*\)|\b(?:x|y|width|height)="[^"]*"', lambda match: _rounded(match[0]), body)
        body = self._own_names(body)
        body = re.sub(r">\s+<", "><", body)
        while (shorter := _EMPTY.sub("", body)) != body:
            body = shorter
        return Drawing(_rounded(box), round(float(box.split()[2]) * _PIXELS), Markup(body.strip()))

    @property
    def shared(self) -> Markup:
        """What a page with drawings has once, before them."""
        glyphs = "".join(
            f'<path id="{name}" d="{_path(path)}" transform="scale(.015625)"/>' for name, path in self._glyphs.values()
        )
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


def drawn(figure, folder: Path, suffixes: Sequence[str] = (".png",)) -> bytes:
    """Draw a figure into files of a folder, one of which is a PNG; gives what a page shows of it, PNG or SVG."""
    with tempfile.TemporaryDirectory() as scratch:
        svg = Path(scratch) / f"{figure.name}.svg"
        figure.draw([*(folder / f"{figure.name}{suffix}" for suffix in suffixes), svg])
        return smaller((folder / f"{figure.name}.png").read_bytes(), svg.read_bytes())


def smaller(png: bytes, svg: bytes) -> bytes:
    """That of two pictures which takes less of a page, glyphs and styles that drawings share not counted."""
    most = 4 * len(png) // 3
    if len(svg) > _DENSER * most or len(Shared().inlined(svg.decode("utf-8")).content) > most:
        return png
    return svg


def _rounded(text: str) -> str:
    """A text whose numbers have one digit after the point, a tenth of a point being a seven hundredth of an inch."""
    return _NUMBER.sub(lambda match: f"{round(float(match[0]), 1) + 0.0:g}", text)


def _path(text: str) -> str:
    """The commands of a path in few letters; a command that repeats stands once."""
    parts, last = [], ""
    for command, values in re.findall(r"([A-Za-z])([^A-Za-z]*)", _rounded(text)):
        values = " ".join(values.split())
        parts.append(f" {values}" if command == last and command in "LQC" else command + values)
        last = command
    return "".join(parts).replace(" -", "-")
