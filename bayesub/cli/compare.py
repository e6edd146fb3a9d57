"""The command `compare`."""

from pathlib import Path

import click

from bayesub.cli.arguments import MANOEUVRE, PATH, draws_option, force_option, page_folder, pdf_option, seed_option
from bayesub.io.terminal import FAILED, Bars, say


@click.command(epilog="Example: bayesub compare runs/quickstart runs/longer -o compared")
@click.argument("runs", type=PATH, metavar="RUN RUN ..", nargs=-1, required=True)
@page_folder
@click.option(
    "--manoeuvre",
    metavar="MANOEUVRE",
    shell_complete=MANOEUVRE["shell_complete"],
    help="That all predict; if left out, that of the first run, or zigzag_20_20.",
)
@draws_option
@seed_option
@pdf_option
@force_option
def compare(
    runs: tuple[Path, ...], output: Path, manoeuvre: str | None, draws: int, seed: int, pdf: bool, force: bool
) -> None:
    """Set the posteriors of finished runs side by side: intervals, contractions, distances and predictions.

    The runs may be of other vehicles, manoeuvres, sensors, equation sets or versions of bayesub; coefficients are
    compared where their terms are the same.

    Exit status 1 if a posterior has not converged.
    """
    from bayesub.study.after.compare import PAGE, Request
    from bayesub.study.after.compare import compare as compare_runs

    with Bars() as bars:
        numbers = compare_runs(Request(runs, manoeuvre, draws, seed), output, force=force, pdf=pdf, progress=bars)
    for topic, sentence in numbers["sentences"].items():
        say(f"{topic}: {sentence}")
    say(f"page: {output / PAGE}")
    unconverged = [label for label, run in numbers["runs"].items() if not run["converged"]]
    if unconverged:
        say(f"NOT CONVERGED: {', '.join(unconverged)}")
        raise click.exceptions.Exit(FAILED)
