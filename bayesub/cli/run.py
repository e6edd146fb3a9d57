"""The command `run`: a study, or every study of a folder."""

import json
import shlex
from dataclasses import dataclass, replace
from pathlib import Path

import click

from bayesub.cli.arguments import PATH, dask_option, executor_of, pdf_option
from bayesub.io.errors import InputError, one_line
from bayesub.io.terminal import FAILED, INTERRUPTED, Bars, complain, console, duration, say


@dataclass(frozen=True)
class Options:
    """Options of the command line.

    Attributes
    ----------
    quick : bool
        The small version.
    resume, force, keep_stale, cross_check, leave_out, pdf : bool
        As in :func:`bayesub.run`.
    dask : str
        What does independent parts (:func:`bayesub.campaign.connection.connect`); empty for this machine.
    """

    quick: bool = False
    resume: bool = False
    force: bool = False
    keep_stale: bool = False
    cross_check: bool = False
    leave_out: bool = False
    pdf: bool = False
    dask: str = ""

    def words(self) -> list[str]:
        """The options with which a run is continued that was begun with these."""
        options = {
            "--quick": self.quick,
            "--cross-check": self.cross_check,
            "--leave-out": self.leave_out,
            "--pdf": self.pdf,
            "--keep-stale": self.keep_stale,
        }
        words = [word for word, is_given in options.items() if is_given]
        return [*words, "--dask", self.dask] if self.dask else words


@click.command(epilog="Example: bayesub run studies/quickstart.toml -o runs/quickstart")
@click.argument("source", type=PATH, metavar="STUDY|FOLDER")
@click.option("-o", "--output", type=PATH, metavar="DIR", help="Run folder, runs/NAME if left out; of many runs, runs.")
@click.option("--quick", is_flag=True, help="The small version of the study's [quick] table.")
@click.option("--resume", is_flag=True, help="Continue an interrupted run, bit for bit; of many runs this is the rule.")
@click.option("--force", is_flag=True, help="Replace an existing run; of many, also the full version by the small one.")
@click.option(
    "--keep-stale",
    is_flag=True,
    help="Of many runs, leave those that are done, though bayesub or the study has changed since; with --resume, "
    "continue a run that other sources or versions began.",
)
@click.option("--cross-check", is_flag=True, help="Sample with NUTS too and compare; works with --resume.")
@click.option(
    "--leave-out",
    is_flag=True,
    help="Fit all trials but one, for each of several trials, and predict it; works with --resume, trial by trial.",
)
@pdf_option
@dask_option
@click.option("--json", "as_json", is_flag=True, help="Only the results, as JSON.")
def run(source: Path, output: Path | None, as_json: bool, **given: bool | str) -> None:
    """Run a STUDY: TOML (simulate, fit, sample, report) or Python script (compute, draw, judge its claims).

    Given a FOLDER, run every study in it, each into a folder of its own under DIR. Those that are done and not stale
    are skipped, those that were interrupted are continued, and one that fails does not stop the others. A run is stale
    if the sources of bayesub, the versions of its libraries, the study or a file that it names have changed since; it
    is run again. DIR/index.html lists the runs.

    Exit status 1 if a posterior has not converged, a cross-check does not agree, a log that was not fitted is not
    predicted, or a claim does not hold.
    """
    options = Options(**given)
    if options.force and (options.resume or options.keep_stale):
        raise InputError("--force excludes --resume and --keep-stale", "conflict", "--force")
    console.quiet = as_json
    with executor_of(options.dask) as executor:
        if source.is_dir():
            results = run_folder(source, output or Path("runs"), options, executor)
        else:
            results = [run_file(source, output, options, executor)]
    if as_json:
        click.echo(json.dumps([result.to_json() for result in results], indent=2))
    if not all(result.good for result in results):
        raise click.exceptions.Exit(FAILED)


def run_file(file: Path, output: Path | None, options: Options, executor=None):
    """Run a study into its folder, ``runs/NAME`` if none is given, and say what came of it."""
    from bayesub.study.run.run import read

    study = read(file, quick=options.quick)
    folder = output or Path("runs") / study.name
    again = ["bayesub", "run", str(file), "-o", str(folder), *options.words(), "--resume"]
    return _run(study, folder, options, again, executor)


def _run(study, folder: Path, options: Options, again: list[str], executor):
    """Run a study with a bar for each stage; Ctrl-C ends it with the command that continues."""
    from bayesub.study.run.run import RunInterrupted
    from bayesub.study.run.run import run as run_study

    flags = {"resume": options.resume, "force": options.force, "keep_stale": options.keep_stale, "pdf": options.pdf}
    try:
        with Bars() as bars:
            tasks = {"cross_check": options.cross_check, "leave_out": options.leave_out}
            result = run_study(study, folder, **flags, **tasks, progress=bars, executor=executor)
    except RunInterrupted:
        complain(f"interrupted; what is done is saved, continue with: {shlex.join(again)}", INTERRUPTED)
    tell(result)
    return result


def tell(result) -> None:
    """Say what came of a run; what was predicted and the verdict come last."""
    for shortcoming in result.shortcomings:
        say(f"not converged: {shortcoming}")
    sentences = dict(result.sentences)
    prediction = sentences.pop("prediction", "")
    for topic, sentence in sentences.items():
        gap = "\n" if "\n" in sentence else " "  # lines to paste begin a line
        say(f"{topic.replace('_', ' ')}:{gap}{sentence}")
    say(f"report: {result.report}" if result.report else f"figures and numbers: {result.folder}")
    if prediction:
        say(f"prediction: {prediction}")
    say(result.verdict.upper() + (f": {result.text}" if result.text else ""))


def run_folder(source: Path, output: Path, options: Options, executor=None) -> list:
    """Run the studies of a folder, each into a folder of its own under `output`, and list them on a page there."""
    from bayesub.study.run import runs

    again = ["bayesub", "run", str(source), "-o", str(output), *options.words()]
    folders, results = runs.folders(runs.studies_in(source), output), []
    for n, (file, folder) in enumerate(folders.items(), start=1):
        say(f"{n} of {len(folders)}: {file}")
        results.append(_run_or_skip(file, folder, options, again, executor))
        if output.is_dir():
            runs.write_index(output, results)
    _summarise(results, output)
    return results


def _run_or_skip(file: Path, folder: Path, options: Options, again: list[str], executor):
    """The result of a study of a folder; one that fails says why and does not stop the others."""
    from bayesub.study.run.result import FAILED, StudyResult

    try:
        return _run_unless_done(file, folder, options, again, executor)
    except InputError as error:
        text = str(error)
    except Exception as error:
        text = one_line(f"{file}: {type(error).__name__}: {error}")
    say(f"FAILED: {text}")
    return StudyResult(file.stem, "", FAILED, str(folder), text=text)


def _run_unless_done(file: Path, folder: Path, options: Options, again: list[str], executor):
    from bayesub.study.run import runs
    from bayesub.study.run.leave_out import is_done
    from bayesub.study.run.run import read
    from bayesub.study.run.run_folder import CROSS_CHECK
    from bayesub.study.schema.study_file import Study

    study = read(file, quick=options.quick)
    cross_check = options.cross_check and isinstance(study, Study)
    state = runs.state(folder, study.config(), force=options.force)
    is_checked = not cross_check or (folder / CROSS_CHECK).exists()
    names = [name for name, *_ in study.each_trial()] if isinstance(study, Study) else []
    leave_out = options.leave_out and len(names) > 1
    is_checked = is_checked and (not leave_out or is_done(names, folder))
    if state.is_done and is_checked:
        say(f"done before: {state.result.verdict.upper()}")
        return state.result
    if state.stale and options.keep_stale and state.result:
        say(f"left as it is, though stale ({state.stale}): {state.result.verdict.upper()}")
        return state.result
    force = state.is_other or (bool(state.stale) and not options.keep_stale)
    if state.stale and not state.is_other and force:
        say(f"stale, run again: {state.stale}")
    resume = state.is_begun and not force
    options = replace(options, resume=resume, force=force, cross_check=cross_check, leave_out=leave_out)
    return _run(study, folder, options, again, executor)


def _summarise(results: list, output: Path) -> None:
    from rich.table import Table

    from bayesub.study.run import runs

    table = Table("verdict", "study", "time", "folder", box=None, pad_edge=False)
    for result in results:
        table.add_row(result.verdict.upper(), result.name, duration(result.seconds), result.folder)
    console.print(table)
    if (output / runs.INDEX).exists():
        say(f"index: {output / runs.INDEX}")
