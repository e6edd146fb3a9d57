"""A study goes one way: it is read, prepared once, run, and gives a result."""

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

from bayesub.campaign.executors import Executor
from bayesub.io.atomic import reason
from bayesub.io.errors import InputError, error_source
from bayesub.io.interrupts import interruptible
from bayesub.io.terminal import SILENT, Progress
from bayesub.study.provenance import commit
from bayesub.study.run import script
from bayesub.study.run.result import RESULT, StudyResult
from bayesub.study.run.run_folder import RunContext, TimedProgress, open_folder
from bayesub.study.run.script import Script
from bayesub.study.schema.study_file import Study, load_study

_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG)


class RunInterrupted(KeyboardInterrupt):
    """Ctrl-C during a run; what is done is saved, and the run can be resumed."""


def read(path: str | Path, *, quick: bool = False) -> Study | Script:
    """The study of a file, TOML or Python; with `quick` the small version."""
    path = Path(path)
    return Script(path, quick) if path.suffix == ".py" else load_study(path, quick=quick)


def run(
    study: Study | Script | str | Path,
    folder: str | Path,
    *,
    resume: bool = False,
    force: bool = False,
    keep_stale: bool = False,
    cross_check: bool = False,
    leave_out: bool = False,
    pdf: bool = False,
    progress: Progress = SILENT,
    executor: Executor | None = None,
) -> StudyResult:
    """Run a study into a folder that explains itself.

    Parameters
    ----------
    study : Study or path
        As :func:`bayesub.load_study` gives it, or the path of a study in TOML or Python.
    folder : str or Path
        The run folder; it is made if it does not exist.
    resume : bool
        Continue an interrupted run, bit for bit.
    force : bool
        Replace an existing run, which is otherwise refused.
    keep_stale : bool
        Resume although the sources of bayesub or the versions of its libraries are others than those by which the run
        was begun.
    cross_check : bool
        Sample with NUTS too and compare; of a study in TOML.
    leave_out : bool
        Fit all trials but one, for each of them, and predict it; of a study in TOML with several trials.
    pdf : bool
        Draw every figure as PDF too.
    progress : Progress
        Object with the methods ``stage`` and ``update`` (:class:`bayesub.io.terminal.Progress`).
    executor : Executor
        What does independent parts; left out, processes of this machine.

    Returns
    -------
    StudyResult
        Verdict, sentences, seconds of work, and the folder.

    Raises
    ------
    InputError
        For a study that does not fit, before a folder is made, and for a folder that is not free.
    RunInterrupted
        For Ctrl-C during the run; a KeyboardInterrupt.
    """
    folder = Path(folder)
    if isinstance(study, str | Path):
        study = read(study)
    work = _work(study, cross_check, leave_out)  # bad input shows before a folder is made
    options = {"resume": resume, "force": force, "keep_stale": keep_stale}
    with open_folder(folder, study.config(), study.copies(), **options), interruptions(folder):
        (folder / RESULT).unlink(missing_ok=True)
        clock = TimedProgress(folder, progress)
        result = work(RunContext(folder, pdf, clock, executor, commit()))
        clock.save()
        result = replace(result, seconds=clock.seconds)
        result.save()
    return result


def _work(study: Study | Script, cross_check: bool, leave_out: bool):
    """The work of a study, a function of its context."""
    if isinstance(study, Script):
        if cross_check:
            raise InputError(
                "--cross-check is for studies in TOML; a Python script says itself what it compares",
                "conflict",
                "--cross-check",
            )
        if leave_out:
            raise InputError(
                "--leave-out is for studies in TOML; a Python script says itself what it predicts",
                "conflict",
                "--leave-out",
            )
        return partial(script.run, study)
    from bayesub.inference.sampling.nuts import require_nutpie
    from bayesub.study.run import leave_out as others
    from bayesub.study.run.infer import infer
    from bayesub.study.run.prepare import prepare

    if cross_check:
        require_nutpie()
    setup = prepare(study)
    if leave_out:
        with error_source(study.source):
            others.check(setup)
    return partial(infer, setup, cross_check=cross_check, leave_out=leave_out)


@contextmanager
def interruptions(folder: Path) -> Iterator[None]:
    """Ctrl-C is RunInterrupted, and a full disk an InputError."""
    try:
        with interruptible():
            yield
    except KeyboardInterrupt:
        raise RunInterrupted(str(folder)) from None
    except OSError as error:
        if error.errno not in _NO_ROOM:
            raise
        raise InputError(
            f"{folder}: {reason(error)}; what is done is saved, make room and use --resume", "file"
        ) from None
