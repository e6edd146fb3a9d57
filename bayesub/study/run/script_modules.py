"""The files beside a study script of which it consists: modules that it imports, and data in their folders."""

import ast
from collections.abc import Iterator
from pathlib import Path

from bayesub.io import toml_files

_DATA = (".csv", ".json", ".toml")


def files(script: Path) -> dict[str, Path]:
    """Name from the folder of the script -> file, of all modules that it imports directly or through others.

    Of a package all data count, and of its modules those that are imported. Files are read, not run.
    """
    root, found, waiting = script.parent, set(), [script]
    while waiting:
        file = waiting.pop()
        for other in _imported(file, root):
            if other not in found:
                found.add(other)
                waiting.append(other)
    found |= {data for module in found if module.parent != root for data in _data(module.parent)}
    return {file.relative_to(root).as_posix(): file for file in sorted(found)}


def _data(folder: Path) -> list[Path]:
    return [file for file in folder.iterdir() if file.suffix in _DATA]


def _imported(file: Path, root: Path) -> Iterator[Path]:
    """The modules below `root` that the imports of a file name, with the packages in which they are."""
    try:
        tree = ast.parse(toml_files.read_text(file))
    except (SyntaxError, ValueError):  # of which the import will complain
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            package = file.parent.relative_to(root).parts
            above = package[: len(package) - node.level + 1] if node.level else ()
            module = ".".join([*above, *filter(None, [node.module])])
            names = [module, *(f"{module}.{alias.name}".lstrip(".") for alias in node.names)]
        else:
            continue
        for name in names:
            parts = name.split(".")
            for k in range(1, len(parts) + 1):
                yield from _module(root.joinpath(*parts[:k]))


def _module(place: Path) -> list[Path]:
    """The file of a module or package; a package comes before a module of its name, as in an import."""
    return [file for file in (place / "__init__.py", place.with_name(f"{place.name}.py")) if file.is_file()][:1]
