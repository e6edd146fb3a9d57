"""The command `bench`."""

import json

import click

from bayesub.io.terminal import console


@click.command(epilog="Example: bayesub bench --quick")
@click.option("--quick", is_flag=True, help="Shorter, without the cold start and compilation; less exact.")
@click.option("--json", "as_json", is_flag=True, help="The numbers as JSON: seconds and bytes.")
def bench(quick: bool, as_json: bool) -> None:
    """Measure the simulator on this machine: simulations, derivatives, densities, and what compiling costs."""
    from bayesub.cli import bench, bench_tables

    console.quiet = as_json
    numbers = bench.run(quick=quick)
    if as_json:
        click.echo(json.dumps(numbers, indent=2))
        return
    for table in bench_tables.tables(numbers):
        console.print(table, soft_wrap=isinstance(table, str))
