"""Studies that compare problems: Python files with a docstring (question, claim, cost) and three functions.

``compute(run)``
    does the work and returns the numbers, as JSON types; what ``draw`` needs is among them
``draw(run, numbers)``
    makes figures and tables of the numbers
``claims(numbers)``
    yields pairs: whether a claim holds, and the sentence that is said if it does not

`run` is a :class:`ScriptRun`. The numbers are on disk before anything is drawn or judged.
"""

import ast
import hashlib
import importlib.util
import json
import re
import signal
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from types import ModuleType

import joblib
import numba
import numpy as np

from bayesub.io import toml_files
from bayesub.io.atomic import write_text
from bayesub.io.errors import InputError
from bayesub.io.terminal import SILENT, Progress
from bayesub.study.run_folder import environment


def question(path: Path) -> str:
    """The first line of a script's docstring; the script is read, not run."""
    try:
        docstring = ast.get_docstring(ast.parse(toml_files.read_text(path)))
    except SyntaxError as error:
        raise InputError(f"{path}: line {error.lineno}: is not valid Python: {error.msg}") from None
    if not docstring:
        raise InputError(f"{path}: a study script begins with a docstring that states its question")
    return docstring.splitlines()[0]


def config(path: Path, *, quick: bool) -> dict:
    """What the result of a script depends on."""
    digest = hashlib.sha256(toml_files.read_text(path).encode()).hexdigest()
    return {"name": path.stem, "question": question(path), "script_sha256": digest} | environment(quick=quick)


class ScriptRun:
    """A run folder, as a study script sees it.

    Attributes
    ----------
    name : of the study
    folder : where everything is written
    quick : whether the small version is wanted
    progress : object to report to (:class:`bayesub.io.terminal.Progress`)
    formats : suffixes of figures
    """

    def __init__(self, name: str, folder: Path, *, quick: bool, progress: Progress = SILENT, formats=(".png",)):
        self.name, self.folder, self.quick, self.progress, self.formats = name, folder, quick, progress, formats

    def __getstate__(self):
        """In another process there is nobody to report to."""
        return self.__dict__ | {"progress": SILENT}

    def figure(self, name: str) -> list[Path]:
        """The files to draw a figure to, one for each format."""
        return [self.folder / f"{name}{suffix}" for suffix in self.formats]

    def page(self, lines: Iterable[str]) -> None:
        """Write the tables of the study, Markdown."""
        write_text(self.folder / f"{self.name}.md", "\n".join(lines) + "\n")

    def part(self, name: str, make: Callable[[], dict]) -> dict:
        """What `make` returns, as JSON types; a part that an earlier run finished is read back."""
        file = self.folder / f"{name}.json"
        if not file.exists():
            write_text(file, json.dumps(make()))
        return json.loads(file.read_text(encoding="utf-8"))

    def parts(self, stage: str, makes: dict[str, Callable[[], dict]]) -> dict[str, dict]:
        """What each of `makes` returns, by name, one after the other: a stage of the run, each a :meth:`part`."""
        self.progress.stage(stage)
        results = {}
        for name, make in makes.items():
            results[name] = self.part(re.sub(r"\W+", "_", f"{stage} {name}"), make)
            self.progress.update(len(results), len(makes), "parts", name)
        return results

    def save_arrays(self, name: str, **arrays) -> None:
        """Keep arrays for ``draw``, compressed."""
        np.savez_compressed(self.folder / f"{name}.npz", **arrays)

    def load_arrays(self, name: str) -> dict[str, np.ndarray]:
        """The arrays that ``compute`` has saved; InputError if the run left none."""
        file = self.folder / f"{name}.npz"
        if not file.exists():
            raise InputError(f"{file}: is missing, and figures that need it cannot be drawn; run the study again")
        with np.load(file) as arrays:
            return dict(arrays)

    def repeat(self, name: str, work: Callable[[int], dict], n: int) -> list[dict]:
        """What `work` returns for 0, 1, .., n - 1: read from a file as far as it goes, then done, each in a process.

        The file has a line of JSON for each; one that a kill left half written is done again.
        """
        file = self.folder / f"{name}.jsonl"
        text = file.read_text(encoding="utf-8") if file.exists() else ""
        lines = text[: text.rfind("\n") + 1].splitlines()[:n]
        write_text(file, "".join(line + "\n" for line in lines))
        for result in in_processes(work, range(len(lines), n)):
            lines.append(json.dumps(result))
            with file.open("a", encoding="utf-8") as stream:
                stream.write(lines[-1] + "\n")
            self.progress.update(len(lines), n, name)
        return [json.loads(line) for line in lines]

    def in_processes(self, work: Callable, items: Iterable) -> Iterator:
        """What `work` returns for each item, in order (:func:`in_processes`); in it :meth:`part` may be used."""
        return in_processes(work, items)


def load(path: Path) -> ModuleType:
    """The script as a module."""
    spec = importlib.util.spec_from_file_location(f"study_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def run(path: Path, folder: Path, *, quick: bool, progress: Progress = SILENT, formats=(".png",)) -> str:
    """Run a script in an opened folder; the claim that failed, or the empty string.

    ``numbers.json`` is written before anything is drawn or judged.
    """
    study = ScriptRun(path.stem, folder, quick=quick, progress=progress, formats=formats)
    module = load(path)
    text = json.dumps(module.compute(study), indent=1)
    write_text(folder / "numbers.json", text)
    progress.stage("figures")
    return _conclude(module, study, json.loads(text))


def redraw(path: Path, folder: Path, *, quick: bool, formats=(".png",)) -> str:
    """Draw a finished run again and judge it, from its ``numbers.json``; the claim that failed, or the empty string."""
    study = ScriptRun(path.stem, folder, quick=quick, formats=formats)
    numbers = json.loads((folder / "numbers.json").read_text(encoding="utf-8"))
    return _conclude(load(path), study, numbers)


def _conclude(module: ModuleType, study: ScriptRun, numbers: dict) -> str:
    """Draw, and then judge."""
    module.draw(study, numbers)
    return next((sentence for holds, sentence in module.claims(numbers) if not holds), "")


def in_processes(work: Callable, items: Iterable) -> Iterator:
    """What `work` returns for each item, in order: each in a process that has one thread, as many as there are cores.

    For parts that share nothing, such as trials that are repeated with other noise. With ``NUMBA_NUM_THREADS=1`` they
    are done one after the other in this process.
    """
    ignore_interrupt = partial(signal.signal, signal.SIGINT, signal.SIG_IGN)  # which this process answers for all
    with joblib.parallel_config("loky", inner_max_num_threads=1, initializer=ignore_interrupt):
        parallel = joblib.Parallel(n_jobs=numba.get_num_threads(), return_as="generator")
        yield from parallel(joblib.delayed(work)(item) for item in items)
