"""The command `export`."""

from pathlib import Path

import click

from bayesub.cli.arguments import PATH
from bayesub.io.terminal import FAILED, Bars, say

FORMATS = ("vehicle", "csv", "netcdf", "parquet", "latex", "markdown", "mss", "mss-json", "pvs")


@click.command(epilog="Example: bayesub export runs/quickstart -o known.toml")
@click.argument("run", type=PATH, metavar="RUN")
@click.option(
    "-o", "--output", type=PATH, required=True, metavar="FILE", help="File to write; one that is there is replaced."
)
@click.option("--as", "wanted", type=click.Choice(FORMATS), help="Format; if left out, by the suffix of FILE.")
def export(run: Path, output: Path, wanted: str | None) -> None:
    """Write the posterior of the run in the folder RUN for others.

    .toml is a vehicle file with standard deviations and correlations, which [prior] kind = "vehicle" of another study
    takes as its prior. .csv, .nc (ArviZ) and .parquet are draws, .tex and .md a table. .m and .json are coefficients as
    Fossen's MSS names them, .py what his PythonVehicleSimulator takes.

    Exit status 1 if the posterior has not converged.
    """
    from bayesub.study.after import export as exports
    from bayesub.study.after import passed_on

    with Bars() as bars:
        bars.stage("read the run and write")
        finished = exports.export(run, output, wanted)
    kind = exports.FORMATS[exports.format_of(output, wanted)]
    say(f"{output}: {kind.meaning}, of {finished.vehicle.name} by the study '{finished.study.name}'")
    say(passed_on.normality_of(finished).sentence)
    for shortcoming in finished.posterior.shortcomings:
        say(f"NOT CONVERGED: {shortcoming}")
    if not finished.posterior.converged:
        raise click.exceptions.Exit(FAILED)
