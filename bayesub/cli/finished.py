"""The commands that take up finished runs: `report`, `next`, `update`, `export`, `predict` and `compare`."""

import json
from pathlib import Path
from typing import Any

import click

from bayesub.cli import arguments
from bayesub.cli.arguments import MANOEUVRE, PATH, RUN, plane
from bayesub.cli.run import end, interrupted, tell
from bayesub.io.terminal import Bars, console, say, say_rows

SIMULATORS = ("mss", "mss-json", "pvs", "gazebo", "stonefish", "holoocean")
FORMATS = ("vehicle", "csv", "netcdf", "parquet", "latex", "markdown", *SIMULATORS)


@click.command(epilog="Example: bayesub report runs/quickstart --pdf")
@click.argument("folder", **RUN, metavar="DIR")
@arguments.pdf_option
@click.option("--run-code", is_flag=True, help="Run Python code that the run folder keeps or names, if you trust it.")
@click.option(
    "--study", type=PATH, metavar="FILE", help="Script to draw with, if that of the run is elsewhere or has changed."
)
@arguments.verbose_option
def report(folder: Path, pdf: bool, study: Path | None, run_code: bool, verbose: bool) -> None:
    """Draw figures and report of the run in DIR again, from what its folder keeps; it may be a copy from elsewhere.

    No code runs that lies in the folder or that it names, unless --run-code is given: the run of a script needs it, or
    --study.
    """
    from bayesub.study.after.finished_run import redraw

    with Bars() as bars:
        result = redraw(folder, study=study, run_code=run_code, pdf=pdf, progress=bars)
    tell(result, verbose=verbose)
    end(result.verdict)


@click.command(epilog="Example: bayesub export runs/quickstart -o known.toml")
@click.argument("run", **RUN, metavar="RUN")
@click.option("-o", "--output", type=PATH, required=True, metavar="FILE", help="File to write or to replace.")
@click.option("--as", "wanted", type=click.Choice(FORMATS), help="Format; if left out, by the suffix of FILE.")
@click.option("--fleet", type=click.IntRange(0), default=0, metavar="N", help="N draws, a file each, for a simulator.")
@arguments.seed_option
def export(run: Path, output: Path, wanted: str | None, fleet: int, seed: int) -> None:
    """Write the posterior of the run in the folder RUN for others.

    .toml is a vehicle file with standard deviations and correlations, which [prior] kind = "vehicle" of another study
    takes as its prior. .csv, .nc (ArviZ) and .parquet are draws, .tex and .md a table. .m and .json are coefficients as
    Fossen's MSS names them, .py what his PythonVehicleSimulator takes, .sdf a model of Gazebo, .xml one of Stonefish.

    The exit status is that of the verdict on the run.
    """
    from bayesub.study.after import export as exports

    finished = exports.export(run, output, wanted, fleet=fleet, seed=seed)
    name = exports.format_of(output, wanted)
    drawn = f", {fleet} draws with their numbers behind the name" if fleet else ""
    source = f"of {finished.vehicle.name} by the study '{finished.study.name}'"
    say(f"{output}: {exports.FORMATS[name].meaning}{drawn}, {source}")
    if (others := exports.untold(finished)) and name in SIMULATORS:
        say(f"of what was inferred it has not: {', '.join(others)}")
    if name == "vehicle":  # which is a normal distribution
        from bayesub.study.after.knowledge import normality_of

        say_rows([(normality_of(finished).sentence,)], indent="")
    if finished.doubt:
        say(finished.doubt)
    end(finished.verdict)


@click.command(epilog="Example: bayesub predict runs/quickstart zigzag_20_20 -o predicted")
@click.argument("run", **RUN, metavar="RUN")
@click.argument("manoeuvre", metavar="MANOEUVRE|LOG", shell_complete=MANOEUVRE["shell_complete"])
@arguments.page_folder
@click.option(
    "--sensors", metavar="NAME", help="Instruments of the log: a preset, or a TOML file with [[sensors]]; or the run's."
)
@arguments.subproblem
@click.option("--sample", "sample_s", type=click.FloatRange(0, min_open=True), metavar="S", help="Output interval, s.")
@click.option(
    "--current-north-mps",
    type=float,
    metavar="C",
    help="Known current to the north in which a manoeuvre is flown, m/s; still water if left out. That of a log is "
    "unknown, and its warm-up tells it.",
)
@click.option("--current-east-mps", type=float, metavar="C", help="The same to the east.")
@click.option("--autopilot", type=PATH, metavar="FILE", help="Steers every draw by its own motion.")
@arguments.of_predictions
def predict(
    run: Path, manoeuvre: str, output: Path, subproblem: str | None, pdf: bool, force: bool, **asked: Any
) -> None:
    """Predict a manoeuvre that the run in the folder RUN has not seen, with bands of every state.

    It is a built-in name, TOML, or a control history in CSV. A log, a CSV with more columns than those of controls, is
    predicted with its readings held back, but for those of a warm-up, from which start and current are taken; the
    prediction is then judged by them, beside SQP and the prior.

    Under an --autopilot (manual page 'autopilot') headings, depths or waypoints are followed, each draw steered by its
    own motion; of the manoeuvre remain duration, start and propeller.

    The exit status is that of the verdict on the run, or that of a log which is not predicted or a manoeuvre which the
    boat does not complete.
    """
    from bayesub.findings.verdicts import STATUS, in_words
    from bayesub.study.after.predict import PAGE, Request, predict_by_run

    current = tuple(asked.pop(f"current_{side}_mps") for side in ("north", "east"))
    if current != (None, None):
        asked["current_mps"] = tuple(component or 0.0 for component in current)
    request = Request(run, manoeuvre, **asked, **plane(subproblem))
    with Bars() as bars:
        numbers = predict_by_run(request, output, force=force, pdf=pdf, progress=bars)
    if numbers["unread_columns"]:
        say(f"not read: {', '.join(numbers['unread_columns'])}; the run has no sensor of these, --sensors names others")
    _tell(numbers, output / PAGE)
    for verdict in dict.fromkeys((numbers["verdict"], numbers["outcome"])):
        if STATUS[verdict]:
            of_run = f" ({run})" if verdict == numbers["verdict"] else ""
            say(in_words(verdict, numbers["shortcomings"] if of_run else ()) + of_run)
    end(numbers["outcome"])


@click.command(epilog="Example: bayesub update runs/trial second_dive.csv -o runs/two_trials")
@click.argument("run", **RUN, metavar="RUN")
@click.argument("log", type=PATH, metavar="LOG")
@click.option("-o", "--output", type=PATH, required=True, metavar="DIR", help="Folder of the new run.")
@click.option("--resume", is_flag=True, help="Continue an interrupted update, bit for bit.")
@arguments.force_option
@arguments.pdf_option
@arguments.verbose_option
def update(run: Path, log: Path, output: Path, resume: bool, force: bool, pdf: bool, verbose: bool) -> None:
    """Fit one more LOG of the boat of the run in the folder RUN, together with the trials of that run.

    The log is read like the last trial of the run: the same sensors, what is unknown of each trial, and columns that
    are not used. Nothing of the former posterior is approximated, and baselines are not searched. DIR is a run like any
    other, which the next log updates again.

    The exit status is that of the verdict on the new run.
    """
    from bayesub.study.after.update import updated
    from bayesub.study.run.run import RunInterrupted
    from bayesub.study.run.run import run as run_study

    arguments.refuse_several({"--resume": resume, "--force": force}, "--force")
    study = updated(run, log)
    try:
        with Bars() as bars:
            result = run_study(study, output, resume=resume, force=force, pdf=pdf, progress=bars)
    except RunInterrupted:
        interrupted(["bayesub", "update", str(run), str(log), "-o", str(output), "--resume"])
    tell(result, verbose=verbose)
    end(result.verdict)


@click.command("next", epilog="Example: bayesub next runs/quickstart --for Yuv --for Nuv -o next.csv")
@click.argument("run", **RUN, metavar="RUN")
@click.option("--for", "wanted", multiple=True, metavar="NAME", help="Coefficient or quantity to know; repeatable.")
@click.option("--limits", type=PATH, metavar="FILE", help="Of boat, crew and range (bayesub new limits).")
@click.option("-o", "--output", type=PATH, metavar="FILE", help="Write the manoeuvre as a control history in CSV.")
@click.option("--json", "as_json", is_flag=True, help="Values and expected sds as JSON.")
@arguments.seed_option
def next_(
    run: Path, wanted: tuple[str, ...], limits: Path | None, output: Path | None, as_json: bool, seed: int
) -> None:
    """Say what to measure or fly next, after the run in the folder RUN, to know better what is named.

    Of each way the expected sd is given, in per cent of the one that the run left: the last trial again, with one more
    instrument, a manoeuvre that is there by name, another, which a short search finds, and a value from a towing tank.
    """
    from bayesub.logs.log_files import write_log
    from bayesub.study.after.design import prescribe
    from bayesub.study.after.finished_run import finished_run

    if output is not None:
        arguments.refuse_overwriting(output, limits)
    console.quiet, finished = as_json, finished_run(run)
    with Bars() as bars:
        found, manoeuvre = prescribe(finished, wanted, limits, seed=seed, progress=bars)
    if as_json:
        click.echo(json.dumps(found.to_json(), indent=2))
    rows = [("", *(f"{one.name} ({one.unit})" if one.unit else one.name for one in found.asked))]
    rows += [("now", *(f"{one.value:.3g} ± {sd:.1g}" for one, sd in zip(found.asked, found.before, strict=True)))]
    rows += [(way, *(f"{100 * ratio:.0f} %" for ratio in sds / found.before)) for way, sds in found.after.items()]
    say_rows(rows)
    say("in per cent: what is left of the sd of now")
    if finished.doubt:
        say(finished.doubt)
    if output is not None and manoeuvre is not None:
        write_log(output, {"time": manoeuvre.times} | manoeuvre.log)
    end(finished.verdict)


@click.command(epilog="Example: bayesub compare runs/quickstart runs/longer -o compared")
@click.argument("runs", **RUN, metavar="RUN RUN ..", nargs=-1, required=True)
@arguments.page_folder
@click.option("--manoeuvre", **MANOEUVRE, help="That all predict; if left out, of the first run, or zigzag_20_20.")
@arguments.of_predictions
def compare(runs: tuple[Path, ...], output: Path, **options: Any) -> None:
    """Set the posteriors of finished runs side by side: intervals, contractions, distances and predictions.

    The runs may be of other vehicles, manoeuvres, sensors, equation sets or versions of bayesub; coefficients are
    compared where their terms are the same.

    The exit status is that of the gravest verdict on a run.
    """
    from bayesub.findings.verdicts import STATUS, worst
    from bayesub.study.after.compare import PAGE
    from bayesub.study.after.compare import compare as compare_runs

    with Bars() as bars:
        numbers = compare_runs(runs, output, **options, progress=bars)
    _tell(numbers, output / PAGE)
    for label, run in numbers["runs"].items():
        if STATUS[run["verdict"]]:
            say(f"{run['verdict'].upper()}: {label}")
    end(worst(run["verdict"] for run in numbers["runs"].values()))


def _tell(numbers: dict[str, Any], page: Path) -> None:
    """Say what a page says."""
    say_rows(numbers["sentences"].items(), indent="")
    say(f"page: {page}")
