"""Studies that compare problems: Python files with a docstring (question, claim, cost) and three functions.

``compute(run)``
    does the work and returns the numbers, as JSON types; what ``draw`` needs is among them. Where what it needs is not
    there, such as data, it returns ``{"skipped": why}``, and the others are not called
``draw(run, numbers)``
    makes figures and tables of the numbers
``claims(numbers)``
    yields pairs: whether a claim holds, and the sentence that is said if it does not

`run` is a :class:`ScriptRun`. The numbers are on disk before anything is drawn or judged.
"""

import ast
import importlib.util
import json
import re
import signal
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import ModuleType

from bayesub.io import toml_files
from bayesub.io.atomic import replacing, write_text
from bayesub.io.errors import InputError
from bayesub.io.terminal import SILENT, Progress
from bayesub.study.provenance import environment, file_digest
from bayesub.study.result import CLAIM_FAILED, CLAIM_HOLDS, SKIPPED, StudyResult

COPY = "study.py"  # of the script, in its run folder
NUMBERS = "numbers.json"
FUNCTIONS = ("compute", "draw", "claims")


@dataclass(frozen=True)
class Script:
    """A study script.

    Attributes
    ----------
    path : Path
        The Python file.
    is_quick : bool
        Whether the small version is wanted.
    """

    path: Path
    is_quick: bool = False

    @property
    def name(self) -> str:
        """Of the study, which is that of the file."""
        return self.path.stem

    @property
    def question(self) -> str:
        """The first line of its docstring."""
        return question(self.path)

    def config(self) -> dict:
        """What the result depends on."""
        digest = file_digest(self.path)
        entries = {"name": self.name, "question": check(self.path), "script_sha256": digest}
        return entries | environment(quick=self.is_quick)

    def copies(self) -> dict[str, Path]:
        """What a run folder keeps of the script: place in the folder -> file."""
        return {COPY: self.path}


def question(path: Path) -> str:
    """The first line of a script's docstring; the script is read, not run.

    Raises
    ------
    InputError
        For a file that is not Python or has no docstring.
    """
    return _docstring(path, _parsed(path))


def check(path: Path) -> str:
    """As :func:`question`; InputError too for a file that lacks one of the functions of a study script."""
    tree = _parsed(path)
    names = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    names |= {name.asname or name.name for node in tree.body if isinstance(node, ast.ImportFrom) for name in node.names}
    if missing := [name for name in FUNCTIONS if name not in names]:
        verb = "is" if len(missing) == 1 else "are"
        raise InputError(
            f"{path}: a study script has the functions {', '.join(FUNCTIONS)}; {' and '.join(missing)} {verb} missing"
        )
    return _docstring(path, tree)


def _parsed(path: Path) -> ast.Module:
    try:
        return ast.parse(toml_files.read_text(path))
    except (SyntaxError, ValueError) as error:
        line = f"line {error.lineno}: " if isinstance(error, SyntaxError) else ""
        raise InputError(f"{path}: {line}is not valid Python: {getattr(error, 'msg', error)}") from None


def _docstring(path: Path, tree: ast.Module) -> str:
    docstring = ast.get_docstring(tree)
    if not docstring:
        raise InputError(f"{path}: a study script begins with a docstring that states its question")
    return docstring.splitlines()[0]


class ScriptRun:
    """A run folder, as a study script sees it.

    Attributes
    ----------
    name : str
        Of the study.
    folder : Path
        Where everything is written.
    quick : bool
        Whether the small version is wanted.
    progress : Progress
        To report to.
    formats : tuple of str
        Suffixes of figures.
    """

    def __init__(
        self,
        name: str,
        folder: Path,
        *,
        quick: bool,
        progress: Progress = SILENT,
        formats: tuple[str, ...] = (".png",),
    ):
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
        """A part of the work as JSON types: what `make` returns, or what an earlier session of the run has saved."""
        file = self.folder / f"{name}.json"
        if not file.exists():
            write_text(file, _json(make(), f"part {name}"))
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
        import numpy as np

        with replacing(self.folder / f"{name}.npz") as partial_file, partial_file.open("wb") as file:
            np.savez_compressed(file, **arrays)

    def load_arrays(self, name: str) -> dict:
        """The arrays that ``compute`` has saved: name -> array; InputError if the run left none."""
        import numpy as np

        file = self.folder / f"{name}.npz"
        if not file.exists():
            raise InputError(f"{file}: is missing, and figures that need it cannot be drawn; run the study again")
        with np.load(file) as arrays:
            return dict(arrays)

    def repeat(self, name: str, work: Callable[[int], dict], n: int) -> list[dict]:
        """What `work` returns for 0, 1, .., n - 1, each in a process of its own.

        ``<name>.jsonl`` has a line of JSON for each. It is read as far as it goes; a line that a kill left half
        written is done again.
        """
        file = self.folder / f"{name}.jsonl"
        text = file.read_text(encoding="utf-8") if file.exists() else ""
        lines = text[: text.rfind("\n") + 1].splitlines()[:n]
        write_text(file, "".join(line + "\n" for line in lines))
        for result in self.in_processes(work, range(len(lines), n)):
            lines.append(json.dumps(result))
            with file.open("a", encoding="utf-8") as stream:
                stream.write(lines[-1] + "\n")
            self.progress.update(len(lines), n, name)
        return [json.loads(line) for line in lines]

    def in_processes(self, work: Callable, items: Iterable) -> Iterator:
        """As :func:`in_processes`; in `work` :meth:`part` may be used."""
        return in_processes(work, items)


def in_processes(work: Callable, items: Iterable) -> Iterator:
    """What `work` returns for each item, in order.

    Each item has a process with one thread, and there are as many processes as cores. For parts that share nothing,
    such as trials that are repeated with other noise. With ``NUMBA_NUM_THREADS=1`` the items are done one after the
    other in this process.
    """
    import joblib
    import numba

    ignore_interrupt = partial(signal.signal, signal.SIGINT, signal.SIG_IGN)  # which this process answers for all
    with joblib.parallel_config("loky", inner_max_num_threads=1, initializer=ignore_interrupt):
        parallel = joblib.Parallel(n_jobs=numba.get_num_threads(), return_as="generator")
        yield from parallel(joblib.delayed(work)(item) for item in items)


def load(path: Path) -> ModuleType:
    """The script as a module."""
    spec = importlib.util.spec_from_file_location(f"study_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def run(script: Script, folder: Path, *, pdf: bool = False, progress: Progress = SILENT) -> StudyResult:
    """Run a script in an opened folder; ``numbers.json`` is written before anything is drawn or judged."""
    study = ScriptRun(script.name, folder, quick=script.is_quick, progress=progress, formats=_formats(pdf))
    module = load(script.path)
    text = _json(_shortened(module.compute(study)), "compute()")
    write_text(folder / NUMBERS, text)
    progress.stage("figures")
    return _conclude(module, study, json.loads(text), script.question)


def redraw(folder: Path, config: dict, path: Path | None, *, pdf: bool = False) -> StudyResult:
    """Draw a finished run again and judge it, from its ``numbers.json``.

    Parameters
    ----------
    folder : Path
        The run folder.
    config : dict
        Of the run.
    path : Path or None
        The script to draw with; None for the copy in the folder.
    pdf : bool
        Draw every figure as PDF too.
    """
    if path is None:
        path = folder / COPY
        if not path.exists():
            raise InputError(
                f"{folder}: {COPY} is missing, the run of a script by bayesub before 0.2; name the script: "
                f"--study studies/{config['name']}.py"
            )
        if file_digest(path) != config["script_sha256"]:
            raise InputError(f"{path}: has changed since the run; run the study again, or name a script with --study")
    numbers_file = folder / NUMBERS
    if not numbers_file.exists():
        raise InputError(f"{folder}: the run has not finished, {NUMBERS} is missing; continue it with --resume")
    try:
        numbers = json.loads(toml_files.read_text(numbers_file))
    except ValueError as error:
        raise InputError(f"{numbers_file}: is damaged ({error}); run the study again") from None
    study = ScriptRun(config["name"], folder, quick=config["quick_run"], formats=_formats(pdf))
    return _conclude(load(path), study, numbers, check(path))


def _formats(pdf: bool) -> tuple[str, ...]:
    return (".png", ".pdf") if pdf else (".png",)


def _conclude(module: ModuleType, study: ScriptRun, numbers: dict, question: str) -> StudyResult:
    """Draw, and then judge."""
    if "skipped" in numbers:
        return StudyResult(study.name, question, SKIPPED, str(study.folder), text=numbers["skipped"])
    module.draw(study, numbers)
    failed = next((sentence for holds, sentence in module.claims(numbers) if not holds), None)
    verdict = CLAIM_HOLDS if failed is None else CLAIM_FAILED
    return StudyResult(study.name, question, verdict, str(study.folder), text=failed or "")


def _shortened(content):
    """The same with nine significant digits: half the size, and more than any figure or claim needs."""
    if isinstance(content, dict):
        return {key: _shortened(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_shortened(value) for value in content]
    return float(f"{content:.9g}") if isinstance(content, float) else content


def _json(content, source: str) -> str:
    """JSON of what a script returns; TypeError names what is no JSON type."""
    try:
        return json.dumps(content)
    except (TypeError, ValueError) as error:
        raise TypeError(f"{source} must return JSON types: {error}") from None
