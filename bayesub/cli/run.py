"""The command `run`: a study, or every study of a folder."""

import json
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bayesub.cli.arguments import PATH, dask_option, pdf_option, verbose_option
from bayesub.cli.outcome import end, tell
from bayesub.io.errors import InputError
from bayesub.io.terminal import INTERRUPTED, Bars, complain, console, duration, say, say_rows

if TYPE_CHECKING:
    from bayesub.study.run.result import StudyResult


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
@verbose_option
@click.option("--json", "as_json", is_flag=True, help="Only the results, as JSON.")
def run(source: Path, output: Path | None, as_json: bool, dask: str, verbose: bool, **options: bool) -> None:
    """Run a STUDY: TOML (simulate, fit, sample, report) or Python script (compute, draw, judge its claims).

    Given a FOLDER, run every study in it, each into a folder of its own under DIR. Those that are done and not stale
    are skipped, those that were interrupted are continued, and one that fails does not stop the others. A run is stale
    if the sources of bayesub, the versions of its libraries, the study or a file that it names have changed since; it
    is run again. DIR/index.html lists the runs.

    The last line is the verdict, which has an exit status of its own (bayesub manual commands): 0 only if the posterior
    has converged and fits, agrees with its cross-check, its prior and the logs that it predicts, or if the claims hold.
    Of a FOLDER it is the gravest.
    """
    from bayesub.findings.verdicts import worst
    from bayesub.study.run.run import RunInterrupted, executor_of

    if options["force"] and (options["resume"] or options["keep_stale"]):
        raise InputError("--force excludes --resume and --keep-stale", "conflict", "--force")
    console.quiet = as_json
    try:
        with executor_of(dask) as executor:
            if source.is_dir():
                results = _run_folder(source, output or Path("runs"), options, executor, verbose)
            else:
                results = [_run_file(source, output, options, executor, verbose)]
    except RunInterrupted as error:
        kept = ("quick", "cross_check", "leave_out", "pdf", "keep_stale")
        words = [f"--{key.replace('_', '-')}" for key in kept if options[key]] + (["--dask", dask] if dask else [])
        folder = str((output or Path("runs")) if source.is_dir() else error)
        again = ["bayesub", "run", str(source), "-o", folder, *words, *([] if source.is_dir() else ["--resume"])]
        complain(f"interrupted; what is done is saved, continue with: {shlex.join(again)}", INTERRUPTED)
    if as_json:
        found = [result.to_json() | {"glance": result.numbers.get("glance")} for result in results]
        click.echo(json.dumps(found, indent=2))
    end(worst(result.verdict for result in results))


def _run_file(file: Path, output: Path | None, options: dict[str, bool], executor, verbose: bool) -> "StudyResult":
    """Run a study into its folder, ``runs/NAME`` if none is given, and say what came of it."""
    from bayesub.study.run.run import read, run

    study = read(file, quick=options["quick"])
    with Bars() as bars:
        given = {key: value for key, value in options.items() if key != "quick"}
        result = run(study, output or Path("runs") / study.name, **given, progress=bars, executor=executor)
    tell(result, verbose=verbose)
    return result


def _run_folder(source: Path, output: Path, options: dict[str, bool], executor, verbose: bool) -> list["StudyResult"]:
    """Run the studies of a folder, each into a folder of its own under `output`, and list them on a page there."""
    from bayesub.study.run import runs
    from bayesub.study.run.run import run_unless_done

    folders, results = runs.folders(runs.studies_in(source), output), []
    for n, (file, folder) in enumerate(folders.items(), start=1):
        say(f"{n} of {len(folders)}: {file}")
        with Bars() as bars:
            result, sentence = run_unless_done(file, folder, options, bars, executor)
        say(sentence) if sentence else tell(result, verbose=verbose)
        results.append(result)
        if output.is_dir():
            runs.write_index(output, results)
    say_rows(
        [("verdict", "study", "time", "folder")]
        + [(result.verdict.upper(), result.name, duration(result.seconds), result.folder) for result in results],
        indent="",
    )
    if (output / runs.INDEX).exists():
        say(f"index: {output / runs.INDEX}")
    return results
