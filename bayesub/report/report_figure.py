"""A figure of a page before it is drawn."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path


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
