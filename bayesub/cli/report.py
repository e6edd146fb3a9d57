"""The command `report`."""

from pathlib import Path

import click

from bayesub.cli.arguments import PATH, pdf_option
from bayesub.cli.run import tell
from bayesub.io.terminal import FAILED


@click.command(epilog="Example: bayesub report runs/quickstart --pdf")
@click.argument("folder", type=PATH, metavar="DIR")
@pdf_option
@click.option(
    "--study",
    type=PATH,
    metavar="FILE",
    help="Script to draw with, for the run of a script that is not where it was, or has changed.",
)
def report(folder: Path, pdf: bool, study: Path | None) -> None:
    """Draw figures and report of the run in DIR again, from what its folder keeps; it may be a copy from elsewhere."""
    from bayesub.study.after.redraw import redraw

    result = redraw(folder, study=study, pdf=pdf)
    tell(result)
    if not result.good:
        raise click.exceptions.Exit(FAILED)
