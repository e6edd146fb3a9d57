"""The command `bench`."""

import json

import click

from bayesub.cli.arguments import executor_of
from bayesub.io.terminal import console


@click.command(epilog="Example: bayesub bench --quick")
@click.option("--quick", is_flag=True, help="Shorter, without JAX and the cold start; less exact.")
@click.option("--dask", default="", metavar="CLUSTER", help="Measure a cluster instead, as named for bayesub run.")
@click.option("--json", "as_json", is_flag=True, help="The numbers as JSON: seconds, metres and bytes.")
def bench(quick: bool, dask: str, as_json: bool) -> None:
    """Measure the simulator: against what a user would write, and against the arithmetic of this processor.

    With --dask measure what a cluster adds to each piece of a campaign.
    """
    console.quiet = as_json
    numbers, tables = _of_cluster(dask, quick) if dask else _of_simulator(quick)
    if as_json:
        click.echo(json.dumps(numbers, indent=2))
        return
    for table in tables(numbers):
        console.print(table, soft_wrap=isinstance(table, str))


def _of_simulator(quick: bool):
    from bayesub.cli import bench, bench_tables

    return bench.run(quick=quick), bench_tables.tables


def _of_cluster(dask: str, quick: bool):
    from bayesub.cli import bench_cluster

    with executor_of(dask) as executor:
        return bench_cluster.run(executor, quick=quick), bench_cluster.tables
