"""The study file with what its residuals ask for, which a run leaves in its folder."""

import os
import re
from pathlib import Path

import tomlkit

from bayesub.io import toml_files
from bayesub.io.atomic import write_text
from bayesub.study.run.result import SUGGESTED
from bayesub.study.schema.study_file import Study


def suggest(study: Study, lines: str, folder: Path) -> Path:
    """Write the file of a study with lines added; a key that is there already gives way. Its path is the answer.

    `lines`: TOML, sections with keys; `folder`: of the run. Files that the study names are named as seen from there.
    """
    text = toml_files.read_text(Path(study.source))
    for name in study.files:
        place = Path(os.path.relpath(study.path(name), folder)).as_posix()
        text = re.sub(rf"""(["']){re.escape(name)}(:\w+)?\1""", rf"\g<1>{place}\g<2>\g<1>", text)
    document = tomlkit.parse(text)
    for section, added in tomlkit.parse(lines).items():
        document.setdefault(section, added).update(added)
    write_text(folder / SUGGESTED, document.as_string().rstrip() + "\n")
    return folder / SUGGESTED
