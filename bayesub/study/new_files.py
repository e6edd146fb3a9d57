"""What all commands that write new files share: names, copies under another name, and that nothing is overwritten."""

import os
import re
from pathlib import Path

import tomlkit

from bayesub.io import toml_files
from bayesub.io.atomic import reason
from bayesub.io.errors import InputError


def check_name(name: str) -> None:
    """InputError for a name that cannot be that of a file."""
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]*", name):
        raise InputError(f"a name is made of letters, digits, '_', '-' and '.', found '{name}'", "value", "name")


def write_new(path: Path, text: str) -> None:
    """Write `text` to a file that does not exist yet."""
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise InputError(f"{path}: exists already; choose another file with -o", "file", "-o") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {reason(error)}", "file", "-o") from None


def copied(name: str, source: str, kind: str, path: Path, equations_key: str) -> str:
    """The text of a built-in or own file under another name, to be written to `path`.

    Parameters
    ----------
    name : str
        The new name.
    source : str
        Built-in name or path.
    kind : str
        "vehicles" or "equations".
    path : Path
        From whose folder a path under `equations_key` is to be seen.
    equations_key : str
        The key that may name an equation file.
    """
    file = toml_files.find(source, kind)
    if "name" not in toml_files.read_toml_table(file):
        raise InputError(f"{source}: key 'name' is missing", "missing", "name")
    document = tomlkit.parse(toml_files.read_text(file))
    document["name"] = name
    equations = document.get(equations_key)
    if isinstance(equations, str) and toml_files.is_path(equations):
        document[equations_key] = seen_from(path, file.parent / equations)
    return document.as_string()


def seen_from(path: Path, name: str | Path) -> str:
    """A vehicle, manoeuvre or equation set as the file `path` names it: a built-in name as it is."""
    return relative(path, name) if toml_files.is_path(str(name)) else str(name)


def relative(path: Path, file: str | Path) -> str:
    """The path of a file as seen from the folder of the file `path`."""
    return Path(os.path.relpath(file, path.parent)).as_posix()
