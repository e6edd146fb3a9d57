"""Studies that compare problems: Python files with a docstring (question, claim, cost) and three functions.

``compute(run)``
    does the work and returns the numbers, as JSON types; what ``draw`` needs is among them. Where what it needs is not
    there, such as data, it returns ``{"skipped": why}``, and the others are not called
``draw(run, numbers)``
    makes figures and tables of the numbers; what needs arrays that ``compute`` has saved comes last
``claims(numbers)``
    yields pairs: whether a claim holds, and the sentence that is said if it does not

`run` is a :class:`ScriptRun`. The numbers are on disk before anything is drawn or judged. The page of the run,
``<name>.md``, takes ``FIGURES``, ``ANSWER`` and ``GLOSSARY`` from a script that has them
(:mod:`bayesub.study.run.script_page`).
"""

import ast
import importlib.util
import json
import operator
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import chdir, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType

from bayesub.campaign import beside, executors
from bayesub.campaign.campaign import Files, Lines, as_json, complete, write_arrays
from bayesub.campaign.executors import Executor, is_remote
from bayesub.findings.verdicts import CLAIM_FAILED, CLAIM_HOLDS, SKIPPED
from bayesub.io import toml_files
from bayesub.io.atomic import finite, write_text
from bayesub.io.errors import InputError
from bayesub.io.terminal import SILENT, Progress
from bayesub.study import sources
from bayesub.study.provenance import environment
from bayesub.study.run import script_page
from bayesub.study.run.result import AGAIN, NUMBERS, StudyResult
from bayesub.study.run.run_folder import RunContext

FUNCTIONS = ("compute", "draw", "claims")
_OF_RUNS = ("numbers", "outcome", "seconds")  # files of every run, which a script does not write itself


class MissingArrays(InputError):
    """Arrays that figures need are not in the run folder."""


@dataclass(frozen=True)
class Script:
    """A study script."""

    path: Path  # the Python file
    is_quick: bool = False  # whether the small version is wanted

    @property
    def name(self) -> str:
        """Of the study, which is that of the file."""
        return self.path.stem

    @property
    def question(self) -> str:
        """The first line of its docstring."""
        return question(self.path)

    def config(self) -> dict:
        """The files and settings that the result depends on."""
        entries = {
            "name": self.name,
            "question": question(self.path, functions=FUNCTIONS),
            "script": self.path.as_posix(),
        }
        digest, files, names = sources.of_script(self.path)
        rooms = sources.rooms({*names, __name__})
        return entries | {"script_sha256": digest, "files_sha256": files} | environment(rooms, quick=self.is_quick)

    def copies(self) -> dict[str, Path]:
        """The place and the digests of the script, which a run folder keeps."""
        return {}


def question(path: Path, *, functions: Sequence[str] = ()) -> str:
    """The first line of a script's docstring; the script is read, not run.

    InputError for a file that is not Python, has no docstring, or lacks one of the functions.
    """
    try:
        tree = ast.parse(toml_files.read_text(path))
    except (SyntaxError, ValueError) as error:
        line = f"line {error.lineno}: " if isinstance(error, SyntaxError) else ""
        raise InputError(f"{path}: {line}is not valid Python: {getattr(error, 'msg', error)}", "format") from None
    names = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    names |= {name.asname or name.name for node in tree.body if isinstance(node, ast.ImportFrom) for name in node.names}
    if missing := [name for name in functions if name not in names]:
        lacks = f"{' and '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing"
        text = f"{path}: a study script has the functions {', '.join(functions)}; {lacks}"
        raise InputError(text, "missing", ", ".join(missing))
    if not (docstring := ast.get_docstring(tree)):
        text = f"{path}: a study script begins with a docstring that states its question"
        raise InputError(text, "missing", "docstring")
    return docstring.splitlines()[0]


@dataclass
class ScriptRun:
    """A run folder, as a study script sees it, and what its methods do."""

    name: str  # of the study
    folder: Path
    quick: bool
    progress: Progress = SILENT
    formats: tuple[str, ...] = (".png",)  # suffixes of figures
    executor: Executor = field(default_factory=executors.local)  # does parts that are independent of each other
    tables: list[str] = field(default_factory=list)  # lines of Markdown, for the page
    taken: set[str] = field(default_factory=lambda: set(_OF_RUNS))  # names of files of this session

    def __getstate__(self):
        """In another process there is no display to report to, and there are no other processes."""
        return self.__dict__ | {"progress": SILENT, "executor": executors.Serial()}

    def figure(self, name: str) -> list[Path]:
        """The files to draw a figure to, one for each format."""
        return [self.folder / f"{name}{suffix}" for suffix in self.formats]

    def page(self, lines: Iterable[str]) -> None:
        """Tables of the study, Markdown, for its page, which is written when figures are drawn and claims judged."""
        self.tables += lines

    def part(self, name: str, make: Callable[[], dict]) -> dict:
        """A part of the work as JSON types: what `make` returns, or what an earlier session of the run has saved."""
        if is_remote():
            return json.loads(as_json(make(), f"part {name}"))
        store = Files({name: self._place(name)})
        if name not in store.results:
            store.add(name, make())
        return store.results[name]

    def parts(self, stage: str, makes: dict[str, Callable[[], dict]]) -> dict[str, dict]:
        """What each of `makes` returns, by name: a stage of the run, whose parts are independent of each other.

        Each is kept in a file named after stage and part. One that returns a pair, a dictionary and one of arrays, has
        the arrays kept for :meth:`load_arrays` under the same name; it must not write to the run folder itself, which
        may be on another machine.
        """
        store = Files({name: self._place(_file_of(f"{stage} {name}")) for name in makes})
        self.progress.stage(stage)
        return self._complete(stage, operator.call, makes, store, "parts")

    @contextmanager
    def work_folder(self) -> Iterator[Path]:
        """A folder from which a part that was stopped goes on: the run folder, or on a cluster a temporary one."""
        if is_remote():
            with TemporaryDirectory() as folder:
                yield Path(folder)
        else:
            yield self.folder

    def save_arrays(self, name: str, **arrays) -> None:
        """Keep arrays for ``draw``, compressed."""
        write_arrays(self.folder / f"{name}.npz", arrays)

    def load_arrays(self, name: str) -> dict:
        """The arrays that ``compute`` has saved: name -> array; InputError if the run left none.

        Those of a part have the name of stage and part, such as ``"flights dr 10"``.
        """
        import numpy as np

        file = self.folder / f"{name}.npz"
        file = file if file.exists() else file.with_stem(_file_of(name))
        if not file.exists():
            text = f"{file}: is missing, and figures that need it cannot be drawn; {AGAIN}"
            raise MissingArrays(text, "state", file.name)
        with np.load(file) as arrays:
            return dict(arrays)

    def repeat(self, name: str, work: Callable[[int], dict], n: int) -> list[dict]:
        """What `work` returns for 0, 1, .., n - 1, pieces that are independent of each other.

        ``<name>.jsonl`` has a line of JSON for each (:class:`bayesub.campaign.campaign.Lines`); those there are kept.
        """
        numbers = {str(k): k for k in range(n)}
        store = Lines(self._place(f"{name}.jsonl"), numbers)
        return list(self._complete(name, work, numbers, store, name).values())

    def in_processes(self, work: Callable, items: Iterable) -> list:
        """What `work` returns for each item, in order, from processes of this machine or from a cluster."""
        return self.executor.map(work, items)

    def _place(self, name: str) -> Path:
        """Where results of a name go; InputError for a name under which there are others."""
        if name in self.taken:
            text = f"'{name}': this run keeps something else under that name; choose one with other letters or digits"
            raise InputError(text, "conflict", name)
        self.taken.add(name)
        return self.folder / name

    def _complete(self, name, work, pieces, store, unit):
        failures = self.folder / f"{_file_of(name)}_failures.txt"
        return complete(self.executor, work, pieces, store, failures=failures, progress=self.progress, unit=unit)


def _file_of(name: str) -> str:
    return re.sub(r"\W+", "_", name)


def load(path: Path) -> ModuleType:
    """The script as a module; it can import those that lie beside it."""
    beside.importable(path.resolve().parent)
    spec = importlib.util.spec_from_file_location(f"study_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # where dataclasses look it up; other processes are not to
    with chdir(Path.cwd()):  # wherever the script goes
        spec.loader.exec_module(module)
    sys.modules.pop(spec.name, None)  # a script may load one of the same name
    return module


def run(script: Script, context: RunContext) -> StudyResult:
    """Run a script in an opened folder; ``numbers.json`` is written before anything is drawn or judged."""
    executor = context.executor or executors.local()
    study = ScriptRun(script.name, context.folder, script.is_quick, context.progress, context.formats, executor)
    module = load(script.path)
    with chdir(Path.cwd()):
        found = module.compute(study)
    plain = json.loads(as_json(found, "compute()"))
    text = json.dumps(finite(plain, 9))  # half the size, and more than any figure or claim needs
    write_text(context.folder / NUMBERS, text)
    context.progress.stage("figures")
    return _conclude(module, study, json.loads(text), script.question, script.config())


def redraw(folder: Path, config: dict, path: Path | None, *, pdf: bool = False) -> StudyResult:
    """Draw a finished run again and judge it, from its ``numbers.json``, by the script of the run or another."""
    if path is None:
        path = place_of(config)
        if not path.is_file():
            text = f"{folder}: there is no {path}, the script of the run; name the script with --study"
            raise InputError(text, "missing", "--study")
        digest, files, _ = sources.of_script(path)
        saved = {str(path): config["script_sha256"]} | config.get("files_sha256", {})
        for name, now in ({str(path): digest} | files).items():
            if saved.get(name) != now:
                text = f"{name}: has changed since the run; {AGAIN}, or name a script with --study"
                raise InputError(text, "state", "--study")
    numbers_file = folder / NUMBERS
    if not numbers_file.exists():
        text = f"{folder}: the run has not finished, {NUMBERS} is missing; continue it with --resume"
        raise InputError(text, "state", NUMBERS)
    try:
        numbers = json.loads(toml_files.read_text(numbers_file))
    except ValueError as error:
        raise InputError(f"{numbers_file}: is damaged ({error}); {AGAIN}", "format", NUMBERS) from None
    study = ScriptRun(config["name"], folder, quick=config["quick_run"], formats=RunContext(folder, pdf).formats)
    return _conclude(load(path), study, numbers, question(path, functions=FUNCTIONS), config)


def place_of(config: dict) -> Path:
    """Where the script of a run is or was."""
    return Path(config.get("script", f"studies/{config['name']}.py"))


def _conclude(module: ModuleType, study: ScriptRun, numbers: dict, question: str, config: dict) -> StudyResult:
    """Draw, judge, and write the page; MissingArrays if figures cannot be drawn, after the others and the page."""
    if isinstance(numbers, dict) and numbers.keys() == {"skipped"}:
        return StudyResult(study.name, question, SKIPPED, str(study.folder), text=str(numbers["skipped"]))
    missing = None
    try:
        module.draw(study, numbers)
    except MissingArrays as error:
        missing = error
    claims = list(module.claims(numbers))
    for holds, sentence in claims:
        if holds not in (True, False) or not isinstance(sentence, str):
            text = f"claims() must yield whether a claim holds and the sentence if not, found {holds!r}, {sentence!r}"
            raise InputError(text, "value", "claims")
    failed = tuple(sentence for holds, sentence in claims if not holds) if claims else ("no claim was judged",)
    script_page.write(study.folder, config, module, numbers, study.tables, failed)
    if missing is not None:
        raise missing
    text = f"{len(failed)} of {len(claims)}, listed above" if len(failed) > 1 else "".join(failed)
    listed = failed if len(failed) > 1 else ()
    verdict = CLAIM_FAILED if failed else CLAIM_HOLDS
    return StudyResult(study.name, question, verdict, str(study.folder), text=text, shortcomings=listed)
