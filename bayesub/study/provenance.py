"""What a result depends on: the study, the files that it names, the sources of bayesub, and versions."""

import functools
import importlib.metadata
import os
import platform
import subprocess
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bayesub.study import sources

PACKAGES = ("bayesub", "numpy", "scipy", "numba", "emcee", "arviz")
CODE = ("sources_sha256", "sources", "commit", "versions", "begun")  # keys of config.toml: what code made a run, when
COMPUTED = (*CODE, "quick_run", "files_sha256")  # keys of config.toml that a study file does not have
INPUTS = "inputs"

_ANSWERS = {"design": "design", "prediction": "predict", "comparison": "compare"}  # request -> module of study.after


def environment(rooms: dict[str, str], *, quick: bool) -> dict:
    """What a result depends on besides its study: entries of ``config.toml``.

    The digests of the rooms that compute are those of :func:`bayesub.study.sources.rooms`.
    """
    begun = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    made = {"sources_sha256": sources.digest(rooms), "commit": commit(), "begun": begun}
    return {"quick_run": quick} | made | {"sources": rooms, "versions": _versions()}


def of_request(kind: str, options: Mapping[str, Any], files: Mapping[str, Path]) -> dict:
    """The content of ``config.toml`` of what is asked of a vehicle or of finished runs.

    Options stand under the key `kind`, but for those of None; files are those on which the answer depends, by name.
    """
    given = {key: _plain(value) for key, value in options.items() if value is not None}
    digests = {name: sources.file_digest(path) for name, path in files.items()}
    rooms = sources.rooms([f"bayesub.study.after.{_ANSWERS[kind]}"])
    return {kind: given, "files_sha256": digests} | environment(rooms, quick=False)


def _plain(value: Any) -> Any:
    """An option as TOML has it."""
    if isinstance(value, tuple):
        return [_plain(one) for one in value]
    return str(value) if isinstance(value, Path) else value


def origin(config: dict) -> dict[str, str]:
    """What made the run of a config, for people: title -> text; empty parts are left out."""
    packages = dict(config.get("versions", {}))
    made = {"": packages.pop("bayesub", ""), "commit": config.get("commit", "")}
    made |= {"digest of the sources": config.get("sources_sha256", "")[:12]}
    texts = {
        "bayesub": ", ".join(f"{title} {text}".strip() for title, text in made.items() if text not in ("", "unknown")),
        "with": ", ".join(f"{package} {version}" for package, version in packages.items()),
        "begun": config.get("begun", ""),
    }
    return {title: text for title, text in texts.items() if text}


@functools.cache
def _versions() -> dict[str, str]:
    packages = {package: importlib.metadata.version(package) for package in PACKAGES}
    return {"python": platform.python_version()} | packages


@functools.cache
def code() -> dict[str, str]:
    """What two processes must have in common so that their results have the same bits: name -> version."""
    return _versions() | {"sources of bayesub": sources.digest(sources.rooms([sources.EVERYTHING]))[:12]}


def copy_name(name: str, digest: str) -> str:
    """The place in a run folder of the copy of a file that a study names."""
    return f"{INPUTS}/{digest[:12]}-{Path(name).name}"


def copies(files: Mapping[str, Path], digests: Mapping[str, str]) -> dict[str, Path]:
    """Place in a run folder -> file that it keeps a copy of, of files and digests by their names."""
    return {copy_name(name, digests[name]): path for name, path in files.items()}


def code_change(saved: dict, config: dict) -> str:
    """Why the code that made a run is not the present one, by their configs; empty if it is."""
    return sources_change(saved, config) or versions_change(saved, config)


def sources_change(saved: dict, config: dict) -> str:
    """Which sources that compute are others than those that made a run; empty if all are the same."""
    if saved.get("sources_sha256") == config["sources_sha256"]:
        return ""
    if "sources" not in saved:
        return "the sources that made it were not recorded room by room"
    before, now = saved["sources"], config["sources"]
    rooms = ", ".join(sorted(room for room in before | now if before.get(room) != now.get(room)))
    return "the sources of bayesub have changed since" + (f" ({rooms})" if rooms else "")


def versions_change(saved: dict, config: dict) -> str:
    """The first version that is another than that by which a run was made; empty if all are the same."""
    return _first_difference(*(settings({"versions": content.get("versions", {})}) for content in (saved, config)))


def study_change(saved: dict, config: dict, ignored: Iterable[str] = ()) -> str:
    """The first difference between two configs, of a run folder and of the study now; empty if there is none.

    Keys that are ignored may differ, those of tables are given as ``table.key``.
    """
    if "script_sha256" in saved and saved["script_sha256"] != config.get("script_sha256"):
        return "the script has changed since"
    before, after = saved.get("files_sha256", {}), config.get("files_sha256", {})
    for name in sorted(before.keys() & after.keys()):
        if before[name] != after[name]:
            return f"{name} has changed since"
    ignored = {*ignored, *CODE, "quick", "script"}  # what [quick] changes stands in the other sections
    first, second = (
        {key: value for key, value in settings(c).items() if not {key, key.partition(".")[0]} & ignored}
        for c in (saved, config)
    )
    return _first_difference(first, second)


def settings(config: dict) -> dict:
    """The entries of a config in order, with the keys of tables written as ``table.key``."""
    entries: dict[str, Any] = {}
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
    return _git("describe", "--always", "--dirty", "--abbrev=12") or "unknown"


def commit_flaw(commit: str) -> str:
    """Why the sources of a run cannot be had again by its commit; empty if one can, or if that is unknown here."""
    if commit.endswith("-dirty"):
        return f"made of changes that were not committed ({commit})"
    if _git("rev-parse", "--is-shallow-repository") != "false":  # no checkout, or one without its history
        return ""
    if commit in ("", "unknown"):
        return "made of no commit that is known"
    return "" if _git("cat-file", "-t", f"{commit}^{{commit}}") else f"commit {commit} is not in the repository"


def _git(*arguments: str) -> str:
    """What git says of the source tree that is running; empty for an installed package, and if git fails."""
    root = Path(__file__).parents[2]
    if not (root / ".git").exists():
        return ""
    try:
        command = ["git", "-C", os.fspath(root), *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return ""
