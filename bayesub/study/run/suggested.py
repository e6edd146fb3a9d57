"""The study file with what its residuals ask for, which a run leaves in its folder."""

import os
from collections.abc import Iterator, MutableMapping
from pathlib import Path
from typing import Any

import tomlkit

from bayesub.io import toml_files
from bayesub.io.atomic import write_text
from bayesub.study.run.result import SUGGESTED
from bayesub.study.schema.study_file import Study


def suggest(study: Study, lines: str, folder: Path) -> Path:
    """Write the file of a study with lines added; a key that is there already gives way. Its path is the answer.

    `lines`: TOML, sections with keys; `folder`: of the run. Files that the study names are named as seen from there.
    """
    document = tomlkit.parse(toml_files.read_text(Path(study.source)))
    for table, key, name in _files(document, study):
        file, colon, function = name.partition(".py:")
        place = study.path(f"{file}.py" if colon else name)
        table[key] = Path(os.path.relpath(place, folder)).as_posix() + f":{function}" * bool(colon)
    for section, added in tomlkit.parse(lines).items():
        if section in document:
            document[section].update(added)
        else:
            document[section] = added
    write_text(folder / SUGGESTED, tomlkit.dumps(document).rstrip() + "\n")
    return folder / SUGGESTED


def _files(table: MutableMapping[str, Any], study: Study) -> Iterator[tuple[MutableMapping[str, Any], str, str]]:
    """Each place in a table that names a file of the study: the table that it is in, its key, and the name."""
    for key, value in table.items():
        if isinstance(value, str) and value.partition(":")[0] in study.files:
            yield table, key, value
        for one in value if isinstance(value, list) else [value]:
            if isinstance(one, MutableMapping):
                yield from _files(one, study)
