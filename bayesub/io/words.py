"""Enumerations in sentences."""

from collections.abc import Sequence


def listed(names: Sequence[str], otherwise: str = "") -> str:
    """Names as an enumeration, ``Zuw, Zww and Muq``; the words `otherwise` if there are none."""
    *first, last = names or [otherwise]
    return f"{', '.join(first)} and {last}" if first else last
