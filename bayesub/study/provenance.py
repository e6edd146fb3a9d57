"""What a result depends on: the study, the files that it names, the sources of bayesub, and versions."""

import functools
import hashlib
import importlib.metadata
import os
import platform
import subprocess
from collections.abc import Iterable
from pathlib import Path

from bayesub.io import toml_files

PACKAGES = ("bayesub", "numpy", "scipy", "numba", "emcee", "arviz")
CODE = ("sources_sha256", "commit", "versions")  # keys of config.toml that say which code made a run
COMPUTED = (*CODE, "quick_run", "files_sha256")  # keys of config.toml that a study file does not have
INPUTS = "inputs"

_SOURCES = (".py", ".toml", ".html", ".json")
_NO_INFLUENCE = ("cli", "manual")  # folders of the package from which no number or figure comes


def environment(*, quick: bool) -> dict:
    """What a result depends on besides its study: entries of ``config.toml``."""
    return {"quick_run": quick, "sources_sha256": sources_digest(), "commit": commit(), "versions": _versions()}


def _versions() -> dict[str, str]:
    packages = {package: importlib.metadata.version(package) for package in PACKAGES}
    return {"python": platform.python_version()} | packages


@functools.cache
def code() -> dict[str, str]:
    """What two processes must have in common so that their results have the same bits: name -> version."""
    return _versions() | {"sources of bayesub": sources_digest()[:12]}


@functools.cache
def sources_digest() -> str:
    """The SHA-256 of all sources of the package from which a number or a figure can come, with their names.

    Ends of lines do not count, so that a clone on Windows has the digest of one on Linux.
    """
    root = Path(__file__).parent.parent
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*"), key=lambda path: path.relative_to(root).as_posix()):
        name = path.relative_to(root)
        if path.suffix in _SOURCES and name.parts[0] not in _NO_INFLUENCE:
            content = path.read_bytes().replace(b"\r\n", b"\n")
            digest.update(f"{name.as_posix()} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def file_digest(path: Path) -> str:
    """The SHA-256 of a file; InputError if it cannot be read."""
    with toml_files.reading(path), path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def copy_name(name: str, digest: str) -> str:
    """The place in a run folder of the copy of a file that a study names."""
    return f"{INPUTS}/{digest[:12]}-{Path(name).name}"


def code_change(saved: dict, config: dict) -> str:
    """Why the code that made a run is not the present one, by their configs; empty if it is."""
    if "sources_sha256" not in saved:
        return "it was made by a version of bayesub before 0.2, which kept no digest of its sources"
    if saved["sources_sha256"] != config["sources_sha256"]:
        return "the sources of bayesub have changed since"
    return _first_difference(_flat({"versions": saved["versions"]}), _flat({"versions": config["versions"]}))


def study_change(saved: dict, config: dict, ignored: Iterable[str] = ()) -> str:
    """The first difference between the studies of two configs; empty if there is none.

    Parameters
    ----------
    saved, config : dict
        Of a run folder, and of the study now.
    ignored : iterable of str
        Keys that may differ, those of tables as ``table.key``.
    """
    if "script_sha256" in saved and saved["script_sha256"] != config.get("script_sha256"):
        return "the script has changed since"
    before, after = saved.get("files_sha256", {}), config.get("files_sha256", {})
    for name in before.keys() & after.keys():
        if before[name] != after[name]:
            return f"{name} has changed since"
    ignored = {*ignored, *CODE, "quick"}  # what [quick] changes stands in the other sections
    first, second = (
        {key: value for key, value in _flat(c).items() if not {key, key.partition(".")[0]} & ignored}
        for c in (saved, config)
    )
    return _first_difference(first, second)


def _flat(config: dict) -> dict:
    """The entries of a config in order, with the keys of tables written as table.key."""
    entries = {}
    for key, value in config.items():
        entries |= {f"{key}.{k}": v for k, v in value.items()} if isinstance(value, dict) else {key: value}
    return dict(sorted(entries.items()))


def _first_difference(before: dict, after: dict) -> str:
    for key in sorted(before | after):
        if before.get(key) != after.get(key):
            return f"{key} was {before.get(key)!r} and is now {after.get(key)!r}"
    return ""


@functools.cache
def commit() -> str:
    """The commit of the source tree that is running, or "unknown" for an installed package."""
    folder = Path(__file__).parent
    if not (folder.parent.parent / ".git").exists():
        return "unknown"
    command = ["git", "-C", os.fspath(folder), "describe", "--always", "--dirty", "--abbrev=12"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return "unknown"
