"""Campaigns: named pieces of work, each done once, and kept as soon as it is done, from where a campaign goes on."""

import json
from collections.abc import Callable, Iterable, Mapping
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from bayesub.campaign.executors import Executor, Failure
from bayesub.io.atomic import replacing, write_text
from bayesub.io.errors import InputError
from bayesub.io.terminal import SILENT, Progress

if TYPE_CHECKING:
    import numpy as np

HOPELESS = 10  # failures of a campaign without a result, after which it ends
_SHOWN = 3  # failures in the message


class Store(Protocol):
    """Where results are kept, by name."""

    results: dict[str, Any]

    def add(self, name: str, result: Any) -> None:
        """Keep a result."""


def complete(
    executor: Executor,
    work: Callable[[Any], Any],
    pieces: Mapping[str, Any],
    store: Store,
    *,
    failures: Path,
    progress: Progress = SILENT,
    unit: str = "pieces",
) -> dict[str, Any]:
    """Do the pieces that a store does not have; each result is in it as soon as it comes.

    Pieces that fail do not stop the others, unless ten have failed and none has a result.

    `work`: a function of one argument, which alone decides its result; `pieces`: name -> argument; `failures`: file for
    the tracebacks of pieces that failed; `unit`: what a piece is, in the plural.

    Gives name -> result, in the order of the pieces; InputError if some have failed, with their names and causes.
    """

    def report(name: str) -> None:
        notes = [*([] if name.isdigit() else [name]), *([f"{len(failed)} failed"] if failed else [])]
        progress.update(len(store.results), len(pieces), unit, ", ".join(notes))

    failed: dict[str, Failure] = {}
    failures.unlink(missing_ok=True)
    if store.results:
        report(list(store.results)[-1])
    remaining = {name: argument for name, argument in pieces.items() if name not in store.results}
    with closing(executor.results(work, remaining)) as stream:
        for name, result in stream:
            if isinstance(result, Failure):
                failed[name] = result
                write_text(failures, "\n".join(f"{n}: {f.cause}\n{f.details}" for n, f in failed.items()))
                if len(failed) >= HOPELESS and not store.results:
                    break
            else:
                store.add(name, result)
            report(name)
    if failed:
        causes = [f"{name} ({failure.cause})" for name, failure in list(failed.items())[:_SHOWN]]
        causes += [f"{len(failed) - _SHOWN} more"] if len(failed) > _SHOWN else []
        what = f"{len(failed)} of {len(pieces)} {unit} failed: {', '.join(causes)}; tracebacks are in {failures}"
        raise InputError(f"{what}, what is done is saved, and --resume does these again", "state", next(iter(failed)))
    return {name: store.results[name] for name in pieces}


class Lines:
    """Results in one file ``.jsonl``, a line of JSON for each: ``{"piece": name, "result": result}``.

    Lines come in the order of arrival and are put into that of the pieces, whose names are given, in the end. A line
    that a kill left half written is left out. ``results`` has what is in the file, by name.
    """

    def __init__(self, file: Path, names: Iterable[str]):
        self.file, self.names = file, dict.fromkeys(names)
        self.results: dict[str, Any] = {}
        text = file.read_text(encoding="utf-8") if file.exists() else ""
        for line in (_parsed(file, line) for line in text[: text.rfind("\n") + 1].splitlines()):
            if isinstance(line, dict) and line.keys() == {"piece", "result"} and line["piece"] in self.names:
                self.results.setdefault(line["piece"], line["result"])
        self._write()

    def add(self, name: str, result: Any) -> None:
        """Keep a result."""
        line = _line(name, result)
        with self.file.open("a", encoding="utf-8") as stream:
            stream.write(line)
        self.results[name] = json.loads(line)["result"]
        if len(self.results) == len(self.names):
            self._write()

    def _write(self) -> None:
        """Write the results in the order of the pieces."""
        present = [name for name in self.names if name in self.results]
        write_text(self.file, "".join(_line(name, self.results[name]) for name in present))


class Files:
    """Results in files of their own, JSON; a result that is a pair has arrays too, in a file ``.npz``.

    Files are given by name, without suffix; ``results`` has what is in those that are there, without the arrays.
    """

    def __init__(self, files: Mapping[str, Path]):
        self.files = files
        places = {name: Path(f"{file}.json") for name, file in files.items()}
        self.results = {n: _parsed(p, p.read_text(encoding="utf-8")) for n, p in places.items() if p.exists()}

    def add(self, name: str, result: Any) -> None:
        """Keep a result; the arrays are written first, so that they are there if the JSON is."""
        file = self.files[name]
        if isinstance(result, tuple):
            result, arrays = result
            write_arrays(Path(f"{file}.npz"), arrays)
        text = as_json(result, f"part {file.name}")
        write_text(Path(f"{file}.json"), text)
        self.results[name] = json.loads(text)


def write_arrays(file: Path, arrays: "Mapping[str, np.ndarray]") -> None:
    """Replace a file by arrays, compressed."""
    import numpy as np

    with replacing(file) as partial, partial.open("wb") as stream:
        np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]  # names are no options


def as_json(content: Any, source: str) -> str:
    """JSON of what a script returns, numbers of NumPy among it; TypeError names what is no JSON type."""
    try:
        return json.dumps(content, default=lambda one: one.tolist())
    except (TypeError, ValueError, AttributeError) as error:
        raise TypeError(f"{source} must return JSON types: {error}") from None


def _parsed(file: Path, text: str) -> Any:
    """What JSON of a file says; InputError for a damaged one."""
    try:
        return json.loads(text)
    except ValueError as error:
        what = f"{file}: is damaged ({error}); remove it, and --resume does again what it held"
        raise InputError(what, "format", file.name) from None


def _line(name: str, result: Any) -> str:
    return as_json({"piece": name, "result": result}, f"piece {name}") + "\n"
