"""The folder that answers a request: what was asked, numbers, tables, and a page with figures."""

import json
from collections.abc import Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from bayesub.io.atomic import write_csv, write_text, writing
from bayesub.report.page import Sheet
from bayesub.study.provenance import copies
from bayesub.study.run.run_folder import open_folder

NUMBERS = "numbers.json"


def open_answer(
    folder: Path, config: dict, files: Mapping[str, Path], *, resume: bool = False, force: bool = False
) -> AbstractContextManager[dict]:
    """Make the folder and hold it, as :func:`bayesub.study.run.run_folder.open_folder` does for a run.

    Parameters
    ----------
    folder : Path
    config : dict
        Of :func:`bayesub.study.provenance.of_request`.
    files : mapping of str to Path
        Name -> file of which a copy is kept; the digests of all are in `config`.
    resume, force : bool
    """
    return open_folder(folder, config, copies(files, config["files_sha256"]), resume=resume, force=force)


def write_answer(folder: Path, page: str, sheet: Sheet, numbers: dict, tables: Mapping[str, Any], *, pdf: bool) -> None:
    """Write tables (name of the file -> what :func:`bayesub.io.atomic.write_csv` takes), numbers, figures and page."""
    with writing(folder):
        for name, table in tables.items():
            write_csv(folder / name, table)
        write_text(folder / NUMBERS, json.dumps(numbers, indent=1))
        sheet.write(folder / page, pdf=pdf)
