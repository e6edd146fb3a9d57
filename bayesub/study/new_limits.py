"""New limits files for `bayesub design`."""

from pathlib import Path

from bayesub.io import templates


def template(path: Path) -> str:
    """The text of a limits file `path`, with every key."""
    return templates.fill("bayesub.study", "new_limits.toml", file=path)
