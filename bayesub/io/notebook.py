"""Objects that show themselves in a notebook, and the registry of how they look."""

import tempfile
from dataclasses import dataclass
from functools import cache, singledispatch
from importlib import metadata
from pathlib import Path

from bayesub.io.atomic import writing

_GROUP = "bayesub.displays"  # entry points: modules that register how classes look


@dataclass(frozen=True)
class Picture:
    """A picture (PNG) that Jupyter shows."""

    png: bytes

    def _repr_png_(self) -> bytes:
        return self.png

    def save(self, path: str | Path) -> None:
        """Write it to a PNG file; InputError if that cannot be written."""
        with writing(Path(path)):
            Path(path).write_bytes(self.png)

    def __repr__(self) -> str:
        return f"Picture of {len(self.png)} bytes; save(path) writes a PNG file"


@singledispatch
def draw(shown: object, path: Path) -> None:  # noqa: ARG001
    """Draw an object to a file."""
    raise TypeError(f"nothing draws a {type(shown).__name__}")


@singledispatch
def html(shown: object) -> str:
    """An object in HTML."""
    raise TypeError(f"nothing shows a {type(shown).__name__}")


class Displayed:
    """What Jupyter shows as a table, and what draws itself, as :func:`html` and :func:`draw` have it."""

    def _repr_html_(self) -> str:
        _load_displays()
        return html(self)

    def plot(self) -> Picture:
        """Draw it: a picture that Jupyter shows, and whose method `save` writes it to a PNG file."""
        _load_displays()
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "picture.png"
            draw(self, path)
            return Picture(path.read_bytes())


@cache
def _load_displays() -> None:
    """Import what registers with the two functions, when something is first shown: it loads Matplotlib."""
    for one in metadata.entry_points(group=_GROUP):
        one.load()
