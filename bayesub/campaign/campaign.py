"""Campaigns: named pieces of work, each done once and kept when it is done."""

from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

from bayesub.campaign.executors import Executor, Failure
from bayesub.campaign.store import Files, Lines
from bayesub.io.atomic import write_text
from bayesub.io.errors import InputError
from bayesub.io.terminal import SILENT, Progress

HOPELESS = 10  # failures of a campaign without a result, after which it ends
_SHOWN = 3  # failures in the message


def complete(
    executor: Executor,
    work: Callable[[Any], Any],
    pieces: Mapping[str, Any],
    store: Lines | Files,
    *,
    failures: Path,
    progress: Progress = SILENT,
    unit: str = "pieces",
) -> dict[str, Any]:
    """Do the pieces that a store does not have; each result is in it as soon as it comes.

    Pieces that fail do not stop the others, unless ten have failed and none has a result.

    Parameters
    ----------
    executor : Executor
        What does them.
    work : callable
        A function of one argument, which alone decides its result.
    pieces : mapping
        Name -> argument.
    store : Lines or Files
        Of the results, or what has ``results`` and ``add`` as these do.
    failures : Path
        File for the tracebacks of pieces that failed.
    progress : Progress
        To report to.
    unit : str
        What a piece is, in the plural.

    Returns
    -------
    dict
        Name -> result, in the order of the pieces.

    Raises
    ------
    InputError
        If pieces have failed, with their names and causes.
    """
    remaining = {name: argument for name, argument in pieces.items() if name not in store.results}
    failures.unlink(missing_ok=True)
    if store.results:
        progress.update(len(store.results), len(pieces), unit, ", ".join(_note(list(store.results)[-1])))
    failed: dict[str, Failure] = {}
    with closing(executor.results(work, remaining)) as stream:
        for name, result in stream:
            if isinstance(result, Failure):
                failed[name] = result
                write_text(failures, "\n".join(f"{n}: {f.cause}\n{f.details}" for n, f in failed.items()))
                if len(failed) >= HOPELESS and not store.results:
                    break
            else:
                store.add(name, result)
            note = [*_note(name), *([f"{len(failed)} failed"] if failed else [])]
            progress.update(len(store.results), len(pieces), unit, ", ".join(note))
    if failed:
        raise InputError(_message(failed, len(pieces), unit, failures), "state", next(iter(failed)))
    return {name: store.results[name] for name in pieces}


def _note(name: str) -> list[str]:
    return [] if name.isdigit() else [name]


def _message(failed: Mapping[str, Failure], n: int, unit: str, file: Path) -> str:
    causes = [f"{name} ({failure.cause})" for name, failure in list(failed.items())[:_SHOWN]]
    more = [f"{len(failed) - _SHOWN} more"] if len(failed) > _SHOWN else []
    return (
        f"{len(failed)} of {n} {unit} failed: {', '.join([*causes, *more])}; tracebacks are in {file}, "
        "what is done is saved, and --resume does these again"
    )
