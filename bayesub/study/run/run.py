"""A study goes one way: it is read, prepared once, run, and gives a result."""

import errno
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from bayesub.findings.verdicts import FAILED
from bayesub.io.arguments import checked
from bayesub.io.atomic import reason, write_text, writing
from bayesub.io.errors import InputError, error_source, one_line
from bayesub.io.interrupts import interruptible
from bayesub.io.terminal import SILENT, Progress, say
from bayesub.study.provenance import code, code_change, commit, study_change
from bayesub.study.run.result import RESULT, StudyResult, load_result
from bayesub.study.run.run_folder import (
    CROSS_CHECK,
    STOPPING,
    TRACEBACK,
    RunContext,
    TimedProgress,
    open_folder,
    saved_config,
)
from bayesub.study.schema.study_file import Study, load_study

if TYPE_CHECKING:
    from bayesub.campaign.executors import Executor
    from bayesub.study.run.script import Script

_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG)


class RunInterrupted(KeyboardInterrupt):
    """Ctrl-C during a run; what is done is saved, and the run can be resumed."""


def read(path: str | Path, *, quick: bool = False) -> "Study | Script":
    """The study of a file, TOML or Python; with `quick` the small version."""
    path = Path(path)
    if path.suffix != ".py":
        return load_study(path, quick=quick)
    from bayesub.study.run.script import Script

    return Script(path, quick)


@contextmanager
def executor_of(dask: str) -> "Iterator[Executor | None]":
    """What does independent parts on the cluster that ``--dask`` names; None without a name, for this machine."""
    if not dask:
        yield None
        return
    from bayesub.campaign.cluster import connect

    with connect(dask, code, say) as executor:
        yield executor


@checked
def run(
    study: "Study | Script | str | Path",
    folder: str | Path,
    *,
    resume: bool = False,
    force: bool = False,
    keep_stale: bool = False,
    cross_check: bool = False,
    leave_out: bool = False,
    pdf: bool = False,
    progress: Progress = SILENT,
    executor: "Executor | None" = None,
) -> StudyResult:
    """Run a study into a folder that explains itself.

    InputError for a study that does not fit, before a folder is made, and for a folder that is not free; RunInterrupted
    (a KeyboardInterrupt) for Ctrl-C during the run.

    Parameters
    ----------
    study : as :func:`bayesub.load_study` gives it, or the path of a study in TOML or Python
    folder : the run folder; it is made if it does not exist
    resume : continue an interrupted run, bit for bit
    force : replace an existing run, which is otherwise refused
    keep_stale : resume although the sources of bayesub or the versions of its libraries are others than those by which
        the run was begun
    cross_check : sample with NUTS too and compare; of a study in TOML
    leave_out : fit all trials but one, for each of them, and predict it; of a study in TOML with several trials
    pdf : draw every figure as PDF too
    progress : object with the methods ``stage`` and ``update`` (:class:`bayesub.io.terminal.Progress`)
    executor : what does independent parts; left out, processes of this machine
    """
    folder = Path(folder)
    if isinstance(study, str | Path):
        study = read(study)
    work = _work(study, cross_check, leave_out)  # bad input shows before a folder is made
    source = Path(study.source) if isinstance(study, Study) else study.path
    options = {"resume": resume, "force": force, "keep_stale": keep_stale}
    with open_folder(folder, study.config(), study.copies(), read=[source], **options), interruptions(folder):
        for file in (RESULT, TRACEBACK):
            (folder / file).unlink(missing_ok=True)
        clock = TimedProgress(folder, progress)
        result = work(RunContext(folder, pdf, clock, executor, commit()))
        clock.save()
        result = replace(result, seconds=clock.seconds)
        result.save()
    return result


def _work(study: "Study | Script", cross_check: bool, leave_out: bool) -> Callable[[RunContext], StudyResult]:
    """The work of a study, a function of its context."""
    if not isinstance(study, Study):
        for is_given, option, what in (
            (cross_check, "--cross-check", "compares"),
            (leave_out, "--leave-out", "predicts"),
        ):
            if is_given:
                text = f"{option} is for studies in TOML; a Python script says itself what it {what}"
                raise InputError(text, "conflict", option)
        from bayesub.study.run import script

        return partial(script.run, study)
    from bayesub.study.run.infer import infer, refuse_unreachable
    from bayesub.study.run.prepare import prepare

    if cross_check:
        from bayesub.inference.sampling.nuts import require_nutpie

        require_nutpie()
    refuse_unreachable(study)
    setup = prepare(study, run_code=True)
    if leave_out:
        from bayesub.study.run import leave_out as others

        with error_source(study.source):
            others.check(setup)
    return partial(infer, setup, cross_check=cross_check, leave_out=leave_out)


def run_unless_done(
    file: Path,
    folder: Path,
    options: Mapping[str, bool],
    progress: Progress = SILENT,
    executor: "Executor | None" = None,
) -> tuple[StudyResult, str]:
    """The result of one of many studies, and what to say of it if it was not run now, or failed.

    A run that is done is kept, a stale one done again, an interrupted one continued. Options: :func:`run`'s, ``quick``.
    """
    try:
        return _run_unless_done(file, folder, options, progress, executor)
    except InputError as error:
        text = str(error)
    except Exception as error:
        text = one_line(f"{file}: {type(error).__name__}: {error}; see {folder / TRACEBACK}")
        with writing(folder):
            folder.mkdir(parents=True, exist_ok=True)
            write_text(folder / TRACEBACK, traceback.format_exc())
    return StudyResult(file.stem, "", FAILED, str(folder), text=text), f"FAILED: {text}"


def _run_unless_done(
    file: Path, folder: Path, options: Mapping[str, bool], progress: Progress, executor: "Executor | None"
) -> tuple[StudyResult, str]:
    study = read(file, quick=options["quick"])
    names = [name for name, *_ in study.each_trial()] if isinstance(study, Study) else []
    cross_check, leave_out = options["cross_check"] and bool(names), options["leave_out"] and len(names) > 1
    saved, config = saved_config(folder), study.config()
    force = False
    if saved is not None:
        is_other = saved.get("quick_run") != config["quick_run"]
        if is_other and not options["force"]:
            kinds = {True: "the small version (--quick)", False: "the full version"}
            wanted, present = kinds[config["quick_run"]], kinds[bool(saved.get("quick_run"))]
            text = f"{folder}: holds {present}, not {wanted}; use --force to replace it, or another -o"
            raise InputError(text, "state", "--quick")
        result, change = load_result(folder), code_change(saved, config)
        if result and not change and not study_change(saved, config):
            from bayesub.study.run.leave_out import is_done

            if (not cross_check or (folder / CROSS_CHECK).exists()) and (not leave_out or is_done(names, folder)):
                return result, f"done before: {result.verdict.upper()}"
        stale = change or study_change(saved, config, ignored=STOPPING)
        if result and stale and options["keep_stale"]:
            return result, f"left as it is, though stale ({stale}): {result.verdict.upper()}"
        force = is_other or (bool(stale) and not options["keep_stale"])
        if stale and not is_other and force:
            progress.remark(f"stale, run again: {stale}")
    tasks = {"cross_check": cross_check, "leave_out": leave_out}
    kept = {key: options[key] for key in ("keep_stale", "pdf")}
    resume = saved is not None and not force
    result = run(study, folder, resume=resume, force=force, **kept, **tasks, progress=progress, executor=executor)
    return result, ""


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
        text = f"{folder}: {reason(error)}; what is done is saved, make room and use --resume"
        raise InputError(text, "file") from None
