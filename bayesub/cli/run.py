"""The command `run`: a study, or every study of a folder."""

import errno
import json
import shlex
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rich.table import Table

from bayesub.io.atomic import reason
from bayesub.io.errors import InputError, error_source
from bayesub.io.interrupts import interruptible
from bayesub.io.terminal import INTERRUPTED, Bars, complain, console, duration, say
from bayesub.sampling.nuts import require_nutpie
from bayesub.study import runs, script, study
from bayesub.study.run_folder import open_folder
from bayesub.study.runs import Outcome


@dataclass(frozen=True)
class Options:
    """Those of the command line."""

    quick: bool = False
    resume: bool = False
    force: bool = False
    check: bool = False

    def words(self) -> list[str]:
        """The options that continue what was begun with these."""
        return [key for key, on in (("--quick", self.quick), ("--cross-check", self.check)) if on]


def run_one(file: Path, output: Path | None, options: Options) -> Outcome:
    """Run a study into its folder, ``runs/NAME`` if none is given, and say what came of it."""
    loaded, config = runs.configuration(file, quick=options.quick)
    folder = output or Path("runs") / config["name"]
    again = ["bayesub", "run", str(file), "-o", str(folder), *options.words(), "--resume"]
    return _run(file, folder, loaded, config, options, again)


def prepared(path: Path, loaded: study.Study) -> study.Setup:
    """The study made ready; what is wrong with it names its file."""
    with error_source(str(path)):
        return study.prepare(loaded)


def _run(file: Path, folder: Path, loaded: study.Study | None, config: dict, options: Options, again: list) -> Outcome:
    if options.check:
        if loaded is None:
            raise InputError("--cross-check is for studies in TOML; a Python script says itself what it compares")
        require_nutpie()
    if loaded is not None:
        prepared(file, loaded)  # bad input shows before a folder is made
    began = time.perf_counter()
    with _held(folder, config, options, again), Bars() as bars:
        (folder / runs.OUTCOME).unlink(missing_ok=True)
        if loaded is None:
            failed_claim = script.run(file, folder, quick=options.quick, progress=bars)
            verdict, good = ("claim failed", False) if failed_claim else ("claim holds", True)
        else:
            failed_claim = ""
            good = study.run(loaded, folder, check=options.check, progress=bars)
            verdict = verdict_of(folder, good)
        seconds = time.perf_counter() - began
        outcome = Outcome(config["name"], config.get("question", ""), verdict, good, seconds, str(folder), failed_claim)
        outcome.save()
    report(outcome)
    return outcome


def verdict_of(folder: Path, good: bool) -> str:
    """The verdict on a run of a TOML study."""
    if good:
        return "converged"
    numbers = json.loads((folder / "numbers.json").read_text(encoding="utf-8"))
    return "not confirmed" if numbers["convergence"]["converged"] else "not converged"


def report(outcome: Outcome) -> None:
    """Say what a run has found; the verdict comes last."""
    folder = Path(outcome.folder)
    if outcome.verdict.startswith("claim"):
        say(f"figures and numbers: {folder}")
    else:
        numbers = json.loads((folder / "numbers.json").read_text(encoding="utf-8"))
        for shortcoming in numbers["convergence"]["shortcomings"]:
            say(f"not converged: {shortcoming}")
        for key, sentence in numbers["verdict"].items():
            say(f"{key.replace('_', ' ')}: {sentence}")
        say(f"report: {folder / 'report.html'}")
    say(outcome.verdict.upper() + (f": {outcome.text}" if outcome.text else ""))


@contextmanager
def _held(folder: Path, config: dict, options: Options, again: list[str]) -> Iterator[None]:
    """Work in a run folder; Ctrl-C ends it with the command that continues."""
    with open_folder(folder, config, resume=options.resume, force=options.force):
        try:
            with interruptible():
                yield
        except KeyboardInterrupt:
            complain(f"interrupted; what is done is saved, continue with: {shlex.join(again)}", INTERRUPTED)
        except OSError as error:
            if error.errno not in (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG):
                raise
            raise InputError(f"{folder}: {reason(error)}; what is done is saved, make room and use --resume") from None


def run_many(source: Path, output: Path, options: Options) -> list[Outcome]:
    """Run the studies of a folder, each into a folder of its own under `output`, and list them on a page there.

    A run that came to its end with the same configuration is left as it is, one that was interrupted is resumed, and
    one of another configuration is replaced if the options say so. After a study that fails the next one is run.
    """
    again = ["bayesub", "run", str(source), "-o", str(output), *options.words()]
    folders, outcomes = runs.folders(runs.studies_in(source), output), []
    for n, (file, folder) in enumerate(folders.items(), start=1):
        say(f"{n} of {len(folders)}: {file}")
        began = time.perf_counter()
        try:
            outcome = _run_or_skip(file, folder, options, again)
        except Exception as error:
            what = str(error) if isinstance(error, InputError) else f"{file}: {type(error).__name__}: {error}"
            text = str(InputError(what))
            outcome = Outcome(file.stem, "", runs.FAILED, False, time.perf_counter() - began, str(folder), text)
            say(f"FAILED: {text}")
        outcomes.append(outcome)
        if output.is_dir():
            runs.write_index(output, outcomes)
    _summarise(outcomes, output)
    return outcomes


def _run_or_skip(file: Path, folder: Path, options: Options, again: list[str]) -> Outcome:
    loaded, config = runs.configuration(file, quick=options.quick)
    check = options.check and loaded is not None
    if runs.is_done(folder, config) and (not check or (folder / study.CHECKED).exists()):
        outcome = runs.load(folder)
        say(f"done before: {outcome.verdict.upper()}")
        return outcome
    try:
        resume = runs.is_begun(folder, config)
    except InputError:
        if not options.force:
            raise
        resume = False
    options = Options(options.quick, resume, not resume and options.force, check)
    return _run(file, folder, loaded, config, options, again)


def _summarise(outcomes: list[Outcome], output: Path) -> None:
    table = Table("verdict", "study", "time", "folder", box=None, pad_edge=False)
    for outcome in outcomes:
        table.add_row(outcome.verdict.upper(), outcome.name, duration(outcome.seconds), outcome.folder)
    console.print(table)
    if (output / runs.INDEX).exists():
        say(f"index: {output / runs.INDEX}")
