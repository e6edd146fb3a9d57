"""Files that are written whole or not at all, and folders that one process at a time works in."""

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import filelock

from bayesub.io.errors import InputError

PARTIAL = ".partial"
LOCK = ".lock"


def reason(error: OSError) -> str:
    """Why the operating system refused, in its words."""
    return (error.strerror or str(error)).lower()


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """What the operating system refuses inside the block is an InputError that names `path`."""
    try:
        yield
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {reason(error)}", "file") from None


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path to write to, which becomes `path` when the block ends: at any moment there is the old file or the new."""
    partial = path.with_name(path.name + PARTIAL)
    try:
        yield partial
        with partial.open("rb") as file:
            os.fsync(file.fileno())
        partial.replace(path)
    except BaseException:
        partial.unlink(missing_ok=True)
        raise


def write_text(path: Path, text: str) -> None:
    """Replace a file by a text."""
    with replacing(path) as partial:
        partial.write_text(text, encoding="utf-8")


def write_csv(path: Path, table: Mapping | Sequence[Mapping], digits: int | None = 8) -> None:
    """Replace a file by a table, given as columns or as rows; its numbers have so many digits, with None all."""
    import pandas as pd  # slow to import

    with replacing(path) as partial, partial.open("wb") as file:
        pd.DataFrame(table).to_csv(file, index=False, float_format=digits and f"%.{digits}g")


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the folder; InputError if another process does. The lock goes with its process, however that ends."""
    lock = filelock.FileLock(folder / LOCK, timeout=0)
    with writing(folder):
        try:
            lock.acquire()
        except filelock.Timeout:  # an OSError too
            message = f"{folder}: another run is at work in it; wait for it, or choose another folder"
            raise InputError(message, "state") from None
    try:
        yield
    finally:
        lock.release()
