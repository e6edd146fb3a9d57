"""Tables of studies in Markdown."""

from collections.abc import Callable, Iterable


def table(header, lines) -> list[str]:
    """The lines of a table: `header` (n,) and each of `lines` (n,) texts."""
    cells = [header, ["---"] * len(header), *lines]
    return ["| " + " | ".join(map(str, line)) + " |" for line in cells]


def columns(items: Iterable[tuple], cells: dict[str, Callable]) -> list[str]:
    """The lines of a table with a row for each of `items`; `cells` is header -> what a cell says of ``*item``."""
    return table(tuple(cells), [[cell(*item) for cell in cells.values()] for item in items])


def beside(ours: float, theirs: float | None) -> str:
    """Our number, the thesis's and their ratio."""
    return f"{ours:.3g}" if theirs is None else f"{ours:.3g} / {theirs:.3g} = {ours / theirs:.2g}"
