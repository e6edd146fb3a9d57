"""Machine code that was compiled once, in the cache folder of the user.

A file is found by the digest of all that made it, so that whoever compiles the same has it already, in another clone or
environment too. It begins with a digest of the rest; one that is damaged, half written or not of this program is as
good as none. The folder keeps within a size: what was used longest ago goes first.
"""

import contextlib
import hashlib
import os
import tempfile
from pathlib import Path

import platformdirs

MAX_BYTES = 200_000_000  # of the folder; an equation set takes 0.1 MB, the loops of all sets 3 MB
_SUFFIX = ".compiled"


def folder() -> Path:
    """Where the files are: below NUMBA_CACHE_DIR, if that is set, or in the cache folder of the user."""
    return Path(os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir(), "bayesub", "compiled")


def digest(*parts: str | bytes) -> str:
    """The digest that identifies a file, of everything that makes it."""
    found = hashlib.sha256()
    for part in parts:
        content = part.encode() if isinstance(part, str) else part
        found.update(len(content).to_bytes(8, "little") + content)
    return found.hexdigest()


def load(key: str) -> bytes | None:
    """What was kept under a digest, if it is there, whole, and of this user or the superuser: it is code."""
    path = folder() / f"{key}{_SUFFIX}"
    try:
        if hasattr(os, "getuid") and not {path.stat().st_uid, path.parent.stat().st_uid} <= {0, os.getuid()}:
            return None
        checked, content = (data := path.read_bytes())[:32], data[32:]
    except OSError:
        return None
    if hashlib.sha256(content).digest() != checked:
        return None
    with contextlib.suppress(OSError):
        os.utime(path)
    return content


def save(key: str, content: bytes) -> None:
    """Keep something under a digest; where that cannot be done it is not."""
    with contextlib.suppress(OSError):
        folder().mkdir(parents=True, exist_ok=True)
        descriptor, partial = tempfile.mkstemp(dir=folder())
        try:
            with os.fdopen(descriptor, "wb") as file:
                file.write(hashlib.sha256(content).digest() + content)
            Path(partial).replace(folder() / f"{key}{_SUFFIX}")
        except BaseException:
            Path(partial).unlink(missing_ok=True)
            raise
        _shrink()


def _shrink() -> None:
    """Remove what was used longest ago, of more than MAX_BYTES."""
    files = []
    for path in folder().iterdir():
        with contextlib.suppress(OSError):
            files.append((path.stat().st_mtime, path.stat().st_size, path))
    excess = sum(size for _, size, _ in files) - MAX_BYTES
    for _, size, path in sorted(files):
        if excess <= 0:
            break
        with contextlib.suppress(OSError):
            path.unlink()
        excess -= size
