"""One look for all figures: colours that colour-blind readers tell apart (Okabe & Ito 2008), sizes for a page."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from bayesub.io.atomic import replacing
from bayesub.report import copies

TRUTH = "#000000"
POSTERIOR = "#0072B2"
SQP = "#D55E00"
LINEAR = "#009E73"
PRIOR = "#C8C8C8"
READINGS = "#56B4E9"
WEAK = "#E69F00"
NULL = "#CC79A7"
VEHICLES = {"suboff": POSTERIOR, "auv690": SQP, "npsauv": LINEAR}
CYCLE = (POSTERIOR, LINEAR, SQP, NULL, WEAK)
PRIOR_LINE: dict[str, Any] = {"color": "#777777", "lw": 1.0, "ls": "--"}
CORRELATION = mpl.colormaps["RdBu_r"].resampled(61)  # few enough colours for the palette of a PNG, letters included
SMALL = 3.5, 2.75  # inches, of a picture of the first screen
NAMES = 10.0  # size of the names of coefficients

_COLOURS, _EXACT, _WHITE = 256, 100, 0xFFFFFF  # of a PNG, and those among them that keep their value
_PARSERS: dict[str, Any] = {}  # one for all PNGs: what one has set in a size the next need not parse
_COMPRESSION = 8  # level 9 takes twice as long and saves a twentieth
_SETTINGS: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "grid.color": "#E6E6E6",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "figure.dpi": 150,
    "savefig.dpi": 150,
    "svg.hashsalt": "bayesub",  # names within an SVG that are the same in every run
}

Paths = str | Path | Sequence[Path]  # where a figure is drawn: to one file, or to several of different formats


class Equations(Protocol):
    """What figures need of an equation set."""

    @property
    def index(self) -> Mapping[str, int]:
        """Name of a coefficient -> its place."""

    def label(self, name: str) -> str:
        """Its label in LaTeX."""

    def term(self, name: str) -> Any:
        """Its term, which has an axis."""


class Prior(Protocol):
    """What figures need of a prior of n_params parameters."""

    @property
    def sd(self) -> np.ndarray:
        """(n_params,)."""

    def quantiles(self, probability: Any) -> np.ndarray:
        """(n_params,)."""

    def chain(self, jacobian: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Derivatives (n, n_params) by standard normal coordinates, of those by parameters."""


def legend_column(labels: Sequence[str]) -> float:
    """Width of a column of a legend of size 8, inches."""
    return 0.55 + 0.065 * max(map(len, labels))


def legend_columns(labels: Sequence[str], width: float) -> int:
    """How many columns of a legend fit a figure of that width, inches: four at most."""
    parts = ((n, np.array_split(labels, n)) for n in range(min(4, len(labels)), 1, -1))
    return next((n for n, some in parts if sum(legend_column(part.tolist()) for part in some) < width), 1)


def legend_above(figure: Figure, handles: Sequence[Any]) -> None:
    """The legend of a figure, above all, in as many columns as there is room for."""
    words = [handle.get_label() for handle in handles]
    columns = legend_columns(words, figure.get_figwidth())
    figure.legend(handles, words, loc="outside upper center", ncols=columns, fontsize=8)


def plain(text: str) -> str:
    """A text of a user's, none of which is a formula."""
    return text.replace("$", r"\$")


def power(value: float) -> str:
    """A number in one or two digits; a small or large one with a power of ten, for a figure."""
    if value == 0.0 or 0.01 <= abs(value) < 1000.0:
        return f"{value:.2g}" if abs(value) < 99.5 else f"{value:.0f}"
    mantissa, exponent = f"{value:.0e}".split("e")
    return rf"${mantissa}\times10^{{{int(exponent)}}}$"


def on_colour(correlation: float) -> str:
    """The colour of a text on that of a correlation."""
    return "white" if abs(correlation) > 0.72 else TRUTH


def show_whole(axis: Axes, values: np.ndarray) -> None:
    """Vertical limits that show all finite values; a line far off is cut."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    margin = 0.06 * (high - low) or 1.0
    axis.set_ylim(low - margin, high + margin)


def shade_warm_up(axis: Axes, warm_up: float) -> None:
    """Grey ground from zero to `warm_up`, s, if there is one."""
    if warm_up:
        axis.axvspan(0.0, warm_up, color=PRIOR, alpha=0.4, lw=0)


def write_beside(axis: Axes, rows: Sequence[int] | np.ndarray, words: Sequence[str], title: str) -> None:
    """A word at the right of each row, and above them what they are."""
    right = axis.secondary_yaxis("right")
    right.set_yticks(rows, words, fontsize=8)
    right.tick_params(length=0)
    right.spines[:].set_visible(False)
    axis.annotate(title, (1.0, 1.0), (3.5, 1), "axes fraction", "offset points", fontsize=8, va="bottom")


def show_rows(axis: Axes, names: Sequence[str], n: int = 0, **look: Any) -> None:
    """A row a name from above, with room for `n` if there are to be more; `look` is that of the names."""
    axis.set_yticks(range(len(names)), names, **look)
    axis.set_ylim(max(n, len(names)) - 0.4, -0.6)
    axis.grid(axis="y", visible=False)


def look_from_above(axis: Axes, start: np.ndarray) -> None:
    """Axes of a track from above, with a dot where it starts, east and north in m."""
    axis.plot(*start, "o", color=TRUTH, ms=4)
    axis.set_aspect("equal", adjustable="datalim")
    axis.set(xlabel="east (m)", ylabel="north (m)")


@contextmanager
def figure(path: Paths, width: float, height: float, margins: Sequence[float] | None = None) -> Iterator[Figure]:
    """A figure that is rendered when the block ends without an error, and saved to each path in the format of its name.

    Sizes are in inches. `margins`: left, right, bottom and top of the axes, where the sizes of labels are known
    beforehand; by default they are measured, which takes as long as drawing.
    """
    with mpl.rc_context(_SETTINGS):
        drawing = Figure(figsize=(width, height), layout="constrained" if margins is None else None)
        if margins is not None:
            left, right, bottom, top = margins
            drawing.subplots_adjust(left / width, bottom / height, 1.0 - right / width, 1.0 - top / height)
        yield drawing
        copies.do(partial(save, drawing, path))


def save(drawing: Figure, path: Paths) -> None:
    """Save a figure in each format; axes are laid out once, and a PNG is drawn once and stored with a palette.

    ``Figure.savefig`` would draw a PNG twice, the first time for the layout alone.
    """
    for file in [path] if isinstance(path, str | Path) else path:
        kind = Path(file).suffix.lower().removeprefix(".") or "png"
        with replacing(Path(file)) as partial:
            if kind != "png":
                drawing.savefig(partial, format=kind, metadata={"Date": None} if kind == "svg" else None)
            else:
                canvas = FigureCanvasAgg(drawing)
                renderer = canvas.get_renderer()
                renderer.mathtext_parser = _PARSERS.setdefault("agg", renderer.mathtext_parser)
                canvas.draw()
                picture = quantise(Image.fromarray(np.asarray(canvas.buffer_rgba())))
                picture.save(partial, format="png", compress_level=_COMPRESSION)
        drawing.set_layout_engine(None)  # the other formats keep the places, and are not laid out again


def quantise(picture: Image.Image) -> Image.Image:
    """A picture with a palette of 256 colours, a third of the size of one in full colour.

    The colours of areas keep their value, the largest first, which edges of letters are not. The others are divided by
    how much they differ and not by how common they are, so that the gradient of a colour bar has no steps.
    """
    code = _code(np.asarray(picture.convert("RGB")))
    area = (code[:, 1:-1] == code[:, :-2]) & (code[:, 1:-1] == code[:, 2:]) & (code[:, 1:-1] != _WHITE)
    sizes = {_WHITE: code.size} | dict(zip(*np.unique(code[:, 1:-1][area], return_counts=True), strict=True))
    counts = picture.convert("RGB").getcolors(code.size) or []
    colours = np.array([colour for _, colour in counts], dtype=np.uint8)
    colours = colours[np.argsort([-sizes.get(one, 0) for one in _code(colours)], kind="stable")]
    palette, places = colours[:_COLOURS], np.arange(len(colours))
    if len(colours) > _COLOURS:
        others = Image.fromarray(colours[None, _EXACT:]).quantize(_COLOURS - _EXACT, dither=Image.Dither.NONE)
        palette = np.vstack([colours[:_EXACT], np.reshape(others.getpalette() or [], (-1, 3)).astype(np.uint8)])
        places[_EXACT:] = _EXACT + np.asarray(others)[0]
    table = np.empty(1 << 24, dtype=np.uint8)  # place in the palette of each colour there is
    table[_code(colours)] = places
    result = Image.fromarray(table[code])
    result.putpalette(palette.tobytes())
    return result


def _code(colours: np.ndarray) -> np.ndarray:
    """One number for each colour (.., 3)."""
    red, green, blue = np.moveaxis(colours.astype(np.uint32), -1, 0)
    return (red << 16) | (green << 8) | blue
