"""One look for all figures: colours that colour-blind readers tell apart (Okabe & Ito 2008), sizes for a page."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

TRUTH = "#000000"
POSTERIOR = "#0072B2"
SQP = "#D55E00"
LINEAR = "#009E73"
PRIOR = "#C8C8C8"
READINGS = "#56B4E9"
WEAK = "#E69F00"
NULL = "#CC79A7"
VEHICLES = {"suboff": POSTERIOR, "auv690": SQP, "npsauv": LINEAR}

_COLOURS = 256  # of a PNG
NAMES = 10.0  # size of the names of coefficients; text that was set before in a size is set quickly
_COMPRESSION = 7  # level 9 takes five times as long and saves a tenth
_SETTINGS = {
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
}

_UNITS = {"mps": "m/s", "degps": "deg/s", "mps2": "m/s²", "degps2": "deg/s²", "kgm2": "kg m²", "n": "N"}
_PLAIN_UNITS = ("m", "deg", "s", "kg")


def with_unit(column: str) -> str:
    """The label of a column or parameter whose name ends with its unit: ``yaw0_deg`` is ``yaw0 (deg)``.

    The trial to which it belongs may follow in brackets, as in ``yaw0_deg[first]``.
    """
    name, bracket, trial = column.partition("[")
    words, trial = name.split("_"), f" {bracket}{trial}" if bracket else ""
    if len(words) > 1 and (words[-1] in _UNITS or words[-1] in _PLAIN_UNITS):
        return f"{' '.join(words[:-1])} ({_UNITS.get(words[-1], words[-1])}){trial}"
    return " ".join(words) + trial


def plain(text: str) -> str:
    """A text of a user's, none of which is a formula."""
    return text.replace("$", r"\$")


@contextmanager
def figure(
    path: Path | Sequence[Path], width: float, height: float, margins: Sequence[float] | None = None
) -> Iterator[Figure]:
    """A figure that is rendered when the block ends without an error, and saved in each format that is asked for.

    Parameters
    ----------
    path
        One file or several, whose suffixes say the formats.
    width, height
        Inches.
    margins
        Left, right, bottom and top of the axes, in inches, where the sizes of labels are known beforehand. By default
        they are measured, which takes as long as drawing.
    """
    with mpl.rc_context(_SETTINGS):
        drawing = Figure(figsize=(width, height), layout="constrained" if margins is None else None)
        if margins is not None:
            left, right, bottom, top = margins
            drawing.subplots_adjust(left / width, bottom / height, 1.0 - right / width, 1.0 - top / height)
        yield drawing
        save(drawing, path)


def save(drawing: Figure, path: Path | Sequence[Path]) -> None:
    """Save a figure in each format; axes are laid out once, and a PNG is drawn once and stored with a palette.

    ``Figure.savefig`` would draw a PNG twice, the first time for the layout alone.
    """
    for file in [path] if isinstance(path, str | Path) else path:
        if Path(file).suffix.lower() != ".png":
            drawing.savefig(file)
        else:
            canvas = FigureCanvasAgg(drawing)
            canvas.draw()
            quantised(Image.fromarray(np.asarray(canvas.buffer_rgba()))).save(file, compress_level=_COMPRESSION)
        drawing.set_layout_engine("none")  # the other formats keep the places


def quantised(picture: Image.Image) -> Image.Image:
    """A picture with a palette of 256 colours, a third of the size of one in full colour."""
    return picture.convert("RGB").quantize(_COLOURS, dither=Image.Dither.NONE)
