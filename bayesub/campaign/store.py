"""Where the results of a campaign are kept, as they come, and from where a campaign goes on."""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bayesub.io.atomic import replacing, write_text

if TYPE_CHECKING:
    import numpy as np

_NAME, _RESULT = "piece", "result"


class Lines:
    """Results in one file, a line of JSON for each: ``{"piece": name, "result": result}``.

    Lines come in the order of arrival and are put into that of the pieces in the end. A line that a kill left half
    written is left out.

    Parameters
    ----------
    file : Path
        With the suffix ``.jsonl``; what is in it is in ``results``, by name.
    names : iterable of str
        Of all pieces, in order.
    """

    def __init__(self, file: Path, names: Iterable[str]):
        self.file, self.names = file, list(names)
        text = file.read_text(encoding="utf-8") if file.exists() else ""
        wanted, self.results = set(self.names), {}
        for line in map(json.loads, text[: text.rfind("\n") + 1].splitlines()):
            if isinstance(line, dict) and line.keys() == {_NAME, _RESULT} and line[_NAME] in wanted:
                self.results.setdefault(line[_NAME], line[_RESULT])
        self._write()

    def add(self, name: str, result: Any) -> None:
        """Keep a result."""
        line = _line(name, result)
        with self.file.open("a", encoding="utf-8") as stream:
            stream.write(line)
        self.results[name] = json.loads(line)[_RESULT]
        if len(self.results) == len(self.names):
            self._write()

    def _write(self):
        """Write the results in the order of the pieces."""
        present = [name for name in self.names if name in self.results]
        write_text(self.file, "".join(_line(name, self.results[name]) for name in present))


class Files:
    """Results in files of their own, JSON; a result that is a pair has arrays too, in a file ``.npz``.

    Parameters
    ----------
    files : mapping
        Name -> file without suffix; ``results`` has what is in those that are there, by name, without the arrays.
    """

    def __init__(self, files: Mapping[str, Path]):
        self.files = files
        places = {name: _with(file, ".json") for name, file in files.items()}
        self.results = {n: json.loads(p.read_text(encoding="utf-8")) for n, p in places.items() if p.exists()}

    def add(self, name: str, result: Any) -> None:
        """Keep a result; the arrays are written first, so that they are there if the JSON is."""
        if isinstance(result, tuple):
            result, arrays = result
            write_arrays(_with(self.files[name], ".npz"), arrays)
        text = as_json(result, f"part {self.files[name].name}")
        write_text(_with(self.files[name], ".json"), text)
        self.results[name] = json.loads(text)


def write_arrays(file: Path, arrays: "Mapping[str, np.ndarray]") -> None:
    """Replace a file by arrays, compressed."""
    import numpy as np

    with replacing(file) as partial, partial.open("wb") as stream:
        np.savez_compressed(stream, **arrays)


def as_json(content: Any, source: str) -> str:
    """JSON of what a script returns; TypeError names what is no JSON type."""
    try:
        return json.dumps(content)
    except (TypeError, ValueError) as error:
        raise TypeError(f"{source} must return JSON types: {error}") from None


def _line(name: str, result: Any) -> str:
    return as_json({_NAME: name, _RESULT: result}, f"piece {name}") + "\n"


def _with(file: Path, suffix: str) -> Path:
    return file.with_name(file.name + suffix)
