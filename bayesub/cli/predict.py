"""The command `predict`."""

from pathlib import Path

import click

from bayesub.cli.arguments import (
    MANOEUVRE,
    PATH,
    draws_option,
    force_option,
    page_folder,
    pdf_option,
    plane,
    seed_option,
)
from bayesub.cli.arguments import subproblem as subproblem_option
from bayesub.io.terminal import FAILED, Bars, say


@click.command(epilog="Example: bayesub predict runs/quickstart zigzag_20_20 -o predicted")
@click.argument("run", type=PATH, metavar="RUN")
@click.argument("manoeuvre", metavar="MANOEUVRE|LOG", shell_complete=MANOEUVRE["shell_complete"])
@page_folder
@click.option(
    "--sensors",
    metavar="NAME",
    help="Instruments of the log: a preset, or a TOML file with [[sensors]]; if left out, those of the run.",
)
@subproblem_option
@click.option("--sample", type=click.FloatRange(0.0, min_open=True), metavar="S", help="Output interval, s.")
@click.option(
    "--current-north-mps",
    type=float,
    metavar="C",
    help="Known current to the north in which a manoeuvre is flown, m/s; still water if left out. That of a log is "
    "unknown, and its warm-up tells it.",
)
@click.option("--current-east-mps", type=float, metavar="C", help="The same to the east.")
@draws_option
@seed_option
@pdf_option
@force_option
def predict(
    run: Path,
    manoeuvre: str,
    output: Path,
    sensors: str | None,
    subproblem: str | None,
    sample: float | None,
    current_north_mps: float | None,
    current_east_mps: float | None,
    draws: int,
    seed: int,
    pdf: bool,
    force: bool,
) -> None:
    """Predict a manoeuvre that the run in the folder RUN has not seen, with bands of every state.

    It is a built-in name, TOML, or a control history in CSV. A log, a CSV with more columns than those of controls, is
    predicted with its readings held back, but for those of a warm-up, from which start and current are taken; the
    prediction is then judged by them, beside SQP and the prior.

    Exit status 1 if the posterior has not converged, or does not predict the log or complete the manoeuvre.
    """
    from bayesub.study.after.predict import PAGE, Request, predict_by_run

    options = {"sample_s": sample, "draws": draws, "seed": seed} | plane(subproblem)
    if (current_north_mps, current_east_mps) != (None, None):
        options["current_mps"] = (current_north_mps or 0.0, current_east_mps or 0.0)
    request = Request(run, manoeuvre, sensors, **options)
    with Bars() as bars:
        numbers = predict_by_run(request, output, force=force, pdf=pdf, progress=bars)
    if numbers["unread_columns"]:
        say(f"not read: {', '.join(numbers['unread_columns'])}; the run has no sensor of these, --sensors names others")
    for topic, sentence in numbers["sentences"].items():
        say(f"{topic}: {sentence}")
    say(f"page: {output / PAGE}")
    for shortcoming in numbers["shortcomings"]:
        say(f"NOT CONVERGED: {shortcoming}")
    predicts = numbers["motion"]["is_flown"] and all(log["predicts"] for log in numbers["predictions"])
    if not (numbers["converged"] and predicts):
        raise click.exceptions.Exit(FAILED)
