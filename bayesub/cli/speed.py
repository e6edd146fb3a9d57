"""The command `bench`."""

import json

import click

from bayesub.io.terminal import console


@click.command(epilog="Example: bayesub bench --quick")
@click.option("--quick", is_flag=True, help="Shorter, without the cold start; less exact.")
@click.option("--json", "as_json", is_flag=True, help="The numbers as JSON: seconds, metres and bytes.")
def bench(quick: bool, as_json: bool) -> None:
    """Measure the simulator: against what a user would write, and against the arithmetic of this processor."""
    from bayesub.cli import bench as measurement
    from bayesub.cli.bench_tables import tables

    numbers = measurement.run(quick=quick)
    if as_json:
        click.echo(json.dumps(numbers, indent=2))
        return
    for table in tables(numbers):
        console.print(table, soft_wrap=isinstance(table, str))
