"""Studies that compare problems: Python files with a docstring (question, claim, cost) and one function

    run(folder, *, quick, progress)

which computes, draws into `folder`, asserts the claim and returns the numbers that are worth keeping.
"""

import ast
import hashlib
import importlib.util
import json
import signal
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path

import joblib
import numba

from bayesub.io import toml_files
from bayesub.io.atomic import write_text
from bayesub.io.errors import InputError
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


def run(path: Path, folder: Path, *, quick: bool, progress) -> str:
    """Run a script into an opened folder and write its ``numbers.json``; the claim that failed, or the empty string."""
    spec = importlib.util.spec_from_file_location(f"study_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    try:
        numbers = module.run(folder, quick=quick, progress=progress)
    except AssertionError as error:
        return str(error) or "a claim of the study does not hold"
    write_text(folder / "numbers.json", json.dumps(numbers, indent=1))
    return ""


def resumed(file: Path, make: Callable[[], dict]) -> dict:
    """The content of a finished part's JSON file, or what `make` returns, saved there."""
    if not file.exists():
        write_text(file, json.dumps(make()))
    return json.loads(file.read_text(encoding="utf-8"))


def in_processes(work: Callable, items: Iterable) -> Iterator:
    """What `work` returns for each item, in order: each in a process that has one thread, as many as there are cores.

    For parts that share nothing, such as trials that are repeated with other noise. With ``NUMBA_NUM_THREADS=1`` they
    are done one after the other in this process.
    """
    ignore_interrupt = partial(signal.signal, signal.SIGINT, signal.SIG_IGN)  # which this process answers for all
    with joblib.parallel_config("loky", inner_max_num_threads=1, initializer=ignore_interrupt):
        parallel = joblib.Parallel(n_jobs=numba.get_num_threads(), return_as="generator")
        yield from parallel(joblib.delayed(work)(item) for item in items)


def repeated(file: Path, work: Callable[[int], dict], n: int, progress) -> list[dict]:
    """What `work` returns for 0, 1, .., n - 1: read from the file as far as it goes, then done, each in a process.

    The file has a line of JSON for each; one that a kill left half written is done again.
    """
    text = file.read_text(encoding="utf-8") if file.exists() else ""
    done = text[: text.rfind("\n") + 1].splitlines()[:n]
    write_text(file, "".join(line + "\n" for line in done))
    for result in in_processes(work, range(len(done), n)):
        done.append(json.dumps(result))
        with file.open("a", encoding="utf-8") as stream:
            stream.write(done[-1] + "\n")
        progress.update(len(done) / n, f"{len(done)} of {n}")
    return [json.loads(line) for line in done]
