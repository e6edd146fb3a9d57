"""Measure what a user would write, or a cluster: ``python tests/benchmarks/rivals --quick``."""

import json
import sys
from pathlib import Path

import click

from bayesub.campaign import beside
from bayesub.io.errors import InputError
from bayesub.io.terminal import console
from bayesub.study.run.run import executor_of

HERE = Path(__file__).parents[1]
sys.path[0] = str(HERE)


@click.command()
@click.option("--quick", is_flag=True, help="Shorter, without JAX; less exact.")
@click.option("--dask", default="", metavar="CLUSTER", help="Measure a cluster instead, as named for bayesub run.")
@click.option("--json", "as_json", is_flag=True, help="The numbers as JSON: seconds, metres and bytes.")
def main(quick: bool, dask: str, as_json: bool) -> None:
    """Measure the simulator against what a user would write, and against the arithmetic of this processor.

    With --dask measure what a cluster adds to each piece of a campaign.
    """
    beside.importable(HERE)  # of which workers know nothing
    from rivals import cluster, comparison
    from rivals.tables import tables

    console.quiet = as_json
    try:
        if dask:
            with executor_of(dask) as executor:
                numbers, shown = cluster.run(executor, quick=quick), cluster.tables
        else:
            numbers, shown = comparison.run(quick=quick), tables
    except InputError as error:
        raise click.ClickException(str(error)) from None
    if as_json:
        click.echo(json.dumps(numbers, indent=2))
        return
    for table in shown(numbers):
        console.print(table, soft_wrap=isinstance(table, str))


if __name__ == "__main__":
    main()
