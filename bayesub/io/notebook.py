"""Objects that show themselves in a notebook; how a class looks is registered by its name."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

from bayesub.io.atomic import replacing, writing

_GROUP = "bayesub.displays"  # entry points: modules with a table DISPLAYS, name of a class -> Display


@dataclass(frozen=True)
class Picture:
    """A picture (PNG) that Jupyter shows."""

    png: bytes

    def _repr_png_(self) -> bytes:
        return self.png

    def save(self, path: str | Path) -> None:
        """Write it to a PNG file; InputError if that cannot be written."""
        with writing(Path(path)), replacing(Path(path)) as partial:
            partial.write_bytes(self.png)

    def __repr__(self) -> str:
        return f"Picture of {len(self.png)} bytes; save(path) writes a PNG file"


class Display(NamedTuple):
    """How the objects of a class look: in HTML, and drawn to a file."""

    html: Callable[[Any], str]
    draw: Callable[[Any, Path], None]


class Displayed:
    """What Jupyter shows as a table, and what draws itself, as the :class:`Display` of its class has it."""

    def _repr_html_(self) -> str:
        return _display(type(self)).html(self)

    def plot(self) -> Picture:
        """Draw it: a picture that Jupyter shows, and whose method `save` writes it to a PNG file."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "picture.png"
            _display(self.__class__).draw(self, path)
            return Picture(path.read_bytes())


@cache
def _displays() -> dict[str, Display]:
    """Name of a class -> its display; the modules are imported here, and load Matplotlib."""
    return {name: one for entry in metadata.entry_points(group=_GROUP) for name, one in entry.load().DISPLAYS.items()}


def _display(shown: type) -> Display:
    """That of a class or the first of its bases that has one."""
    displays = _displays()
    for base in shown.__mro__:
        if base.__name__ in displays:
            return displays[base.__name__]
    raise TypeError(f"nothing shows a {shown.__name__}")
