"""Files that are written whole or not at all, and folders that one process at a time works in."""

import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path, PurePosixPath
from typing import Any

import filelock

from bayesub.io.errors import InputError, printable

PARTIAL = ".partial"
LOCK = ".lock"
LEDGER = ".files"  # of a folder of ours: a line for each file that was written into it, relative to the folder


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
    """A path to write to, which becomes `path` when the block ends: at any moment there is the old file or the new.

    What stands there as a link is replaced, and not what it leads to. In a folder with a ledger the file is entered.
    """
    if path.exists() and not path.is_file():
        raise InputError(f"{path}: cannot be written: is no regular file", "file")
    partial = path.with_name(path.name + PARTIAL)
    partial.unlink(missing_ok=True)  # it may be a link
    try:
        _enter(path)
        yield partial
        with partial.open("rb") as file:
            os.fsync(file.fileno())
        partial.replace(path)
    except BaseException:
        partial.unlink(missing_ok=True)
        raise


def _enter(path: Path) -> None:
    """Add a file to the ledger of the nearest folder above it that has one."""
    place = path.absolute()
    folder = next((one for one in place.parents if (one / LEDGER).is_file() and not (one / LEDGER).is_symlink()), None)
    if folder is not None and (name := place.relative_to(folder).as_posix()) not in entered(folder):
        with (folder / LEDGER).open("a", encoding="utf-8") as ledger:
            ledger.write(f"{name}\n")


def entered(folder: Path) -> list[str]:
    """The files in the ledger of a folder, relative to it; those of a damaged or foreign one that lie in the folder."""
    try:
        names = (folder / LEDGER).read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError):
        return []
    return [name for name in names if name and not PurePosixPath(name).is_absolute() and ".." not in name.split("/")]


def remove(folder: Path, names: Iterable[str]) -> None:
    """Remove files of a folder, and folders in it that are empty then; of a link on the way only the link."""
    for name in names:
        place = folder
        for part in name.split("/"):
            place /= part
            if place.is_symlink() or place.is_file():
                place.unlink()
                break
        for above in [one for one in place.parents if folder in one.parents]:
            with suppress(OSError):
                above.rmdir()


def finite(content: Any, digits: int = 17) -> Any:
    """JSON types with so many significant digits, and None, which is null, for numbers that JSON has not."""
    if isinstance(content, dict):
        return {key: finite(value, digits) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [finite(value, digits) for value in content]
    if not isinstance(content, float):
        return content
    return float(f"{content:.{digits}g}") if math.isfinite(content) else None


def write_text(path: Path, text: str) -> None:
    """Replace a file by a text."""
    with replacing(path) as partial:
        partial.write_text(text, encoding="utf-8")


def write_csv(path: Path, table: Mapping | Sequence[Mapping], digits: int | None = 8) -> None:
    """Replace a file by a table, given as columns or as rows; its numbers have so many digits, with None all.

    A cell is one line: characters that would end it or mean something to a terminal are escaped.
    """
    import pandas as pd  # slow to import

    columns = pd.DataFrame(table)
    for name, texts in columns.select_dtypes(exclude="number").items():
        columns[name] = [printable(text) if isinstance(text, str) else text for text in texts]
    with replacing(path) as partial, partial.open("wb") as file:
        columns.to_csv(file, index=False, float_format=digits and f"%.{digits}g")


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the folder; InputError if another process does. The lock goes with its process, however that ends."""
    lock = filelock.FileLock(folder / LOCK, timeout=0)
    with writing(folder):
        try:
            lock.acquire()
            _enter(folder / LOCK)
        except filelock.Timeout:  # an OSError too
            message = f"{folder}: another run is at work in it; wait for it, or choose another folder"
            raise InputError(message, "state") from None
    try:
        yield
    finally:
        lock.release()
