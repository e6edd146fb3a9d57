"""Tables of studies in Markdown."""


def table(header, lines) -> list[str]:
    """The lines of a table: `header` (n,) and each of `lines` (n,) texts."""
    cells = [header, ["---"] * len(header), *lines]
    return ["| " + " | ".join(map(str, line)) + " |" for line in cells]


def beside(ours: float, theirs: float | None) -> str:
    """Our number, the thesis's and their ratio."""
    return f"{ours:.3g}" if theirs is None else f"{ours:.3g} / {theirs:.3g} = {ours / theirs:.2g}"
