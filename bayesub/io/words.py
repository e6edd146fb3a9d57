"""Enumerations and numbers in sentences."""

from collections.abc import Sequence


def listed(names: Sequence[str], otherwise: str = "") -> str:
    """Names as an enumeration, ``Zuw, Zww and Muq``; the words `otherwise` if there are none."""
    *first, last = names or [otherwise]
    return f"{', '.join(first)} and {last}" if first else last


def counted(n: int, noun: str) -> str:
    """A number of things, ``1 start`` or ``5 starts``."""
    return f"{n} {noun}" if n == 1 else f"{n} {noun}s"
