"""Tables of studies in Markdown."""

from collections.abc import Callable, Iterable


def table(header, lines) -> list[str]:
    """The lines of a table: `header` (n,) and each of `lines` (n,) texts."""
    return [row(line) for line in (header, ["---"] * len(header), *lines)]


def row(cells) -> str:
    """One line of a table."""
    return "| " + " | ".join(map(str, cells)) + " |"


def columns(results: Iterable, cells: dict[str, Callable]) -> list[str]:
    """The lines of a table with a row for each result; `cells` is header -> text of a result."""
    return table(tuple(cells), [[cell(result) for cell in cells.values()] for result in results])


def named(results: dict[str, dict]) -> list[dict]:
    """The results with their names among them, under ``name``."""
    return [{"name": name} | result for name, result in results.items()]
