"""New equation files: a commented template, or a copy of another set."""

import re
from pathlib import Path

from bayesub.io import templates
from bayesub.io.errors import InputError
from bayesub.model.equations.files import SET_NAME
from bayesub.study import new_files


def template(name: str) -> str:
    """The text of an equation file that explains every key, with a short set as an example."""
    check_name(name)
    return templates.fill("bayesub.study", "new_equations.toml", name=name)


def copied(name: str, source: str, path: Path) -> str:
    """The text of an equation file `path`: the set `source` (built-in name or path) under another name."""
    check_name(name)
    return new_files.copied(name, source, "equations", path, "extends")


def check_name(name: str) -> None:
    """InputError for what cannot name an equation set."""
    if not re.fullmatch(SET_NAME, name):
        raise InputError(
            f"an equation set is named by letters, digits, '_' and '-', beginning with a letter, found '{name}'",
            "value",
            "name",
        )
