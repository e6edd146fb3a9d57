"""Run folders: what a result depends on, and the folder that is made, held, resumed or refused because of it."""

import importlib.metadata
import os
import platform
import shutil
import subprocess
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import tomli_w

from bayesub.io import toml_files
from bayesub.io.atomic import LOCK, PARTIAL, locked, write_text, writing
from bayesub.io.errors import InputError

STOPPING = tuple(f"sampler.{key}" for key in ("max_steps", "rhat", "ess", "taus"))  # may change before a run is resumed
PACKAGES = ("bayesub", "numpy", "scipy", "numba", "emcee", "arviz")


def environment(*, quick: bool) -> dict:
    """What a result depends on besides its study."""
    versions = {package: importlib.metadata.version(package) for package in PACKAGES}
    return {"quick_run": quick, "commit": _commit(), "versions": {"python": platform.python_version()} | versions}


@contextmanager
def open_folder(folder: Path, config: dict, *, resume: bool, force: bool) -> Iterator[None]:
    """Make the run folder, hold it for this process, and write ``config.toml`` into it before any work starts.

    An existing run is refused; `force` deletes it; `resume` continues it if its config is the same but for the stopping
    rule, and otherwise names the first difference.
    """
    file = folder / "config.toml"
    if resume:
        if not file.exists():
            raise InputError(f"{folder}: holds no run to resume; leave out --resume")
        difference = first_difference(toml_files.read_toml_table(file), config, but=STOPPING)
        if difference:
            raise InputError(f"{folder}: cannot be resumed: {difference}; use --force to start afresh")
    elif file.exists() and not force:
        raise InputError(f"{folder}: already holds a run; use --resume to continue it or --force to replace it")
    with writing(folder):
        if folder.exists() and not file.exists() and _content(folder):
            raise InputError(f"{folder}: already holds other files; choose another -o")
        folder.mkdir(parents=True, exist_ok=True)
    with locked(folder):
        with writing(folder):
            for path in _content(folder) if force else ():
                shutil.rmtree(path) if path.is_dir() else path.unlink()
            write_text(file, tomli_w.dumps(config))
        yield


def _content(folder: Path) -> list[Path]:
    """What is in a folder besides the traces of a run that was stopped before it began."""
    return [path for path in folder.iterdir() if path.name != LOCK and not path.name.endswith(PARTIAL)]


def first_difference(saved: dict, config: dict, but: tuple[str, ...] = ()) -> str:
    """The first entry in which two configs differ, as text, besides the commit and those `but`; empty if none does."""
    before, now = (_flat(c, but) for c in (saved, tomllib.loads(tomli_w.dumps(config))))
    for key in [key for key in before | now if before.get(key) != now.get(key)]:
        return f"{key} was {before.get(key)!r} and is now {now.get(key)!r}"
    return ""


def _flat(config: dict, but: tuple[str, ...]) -> dict:
    """The entries of a config, with the keys of tables written as table.key."""
    flat = {}
    for key, value in config.items():
        if key not in ("commit", "quick"):
            flat |= {f"{key}.{k}": v for k, v in value.items()} if isinstance(value, dict) else {key: value}
    return {key: value for key, value in sorted(flat.items()) if key not in but}


def _commit() -> str:
    """The commit of the source tree that is running, or "unknown" for an installed package."""
    here = Path(__file__).parent
    if not (here.parent / ".git").exists():
        return "unknown"
    command = ["git", "-C", os.fspath(here), "describe", "--always", "--dirty", "--abbrev=12"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return "unknown"
