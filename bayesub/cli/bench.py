"""The command `bench`: what is measured, as tables for the terminal."""

import json
from collections.abc import Iterable
from typing import Any

import click
from rich.table import Table

from bayesub.io.terminal import console


@click.command(epilog="Example: bayesub bench --quick")
@click.option("--quick", is_flag=True, help="Shorter, without the cold start and compilation; less exact.")
@click.option("--json", "as_json", is_flag=True, help="The numbers as JSON: seconds and bytes.")
def bench(quick: bool, as_json: bool) -> None:
    """Measure the simulator on this machine: simulations, derivatives, densities, and what compiling costs."""
    from bayesub.study.before import bench

    console.quiet = as_json
    numbers = bench.run(quick=quick)
    if as_json:
        click.echo(json.dumps(numbers, indent=2))
        return
    for table in tables(numbers):
        console.print(table, soft_wrap=isinstance(table, str))


def tables(numbers: dict[str, Any]) -> list[Table | str]:
    """Tables and text of what :func:`bayesub.study.before.bench.run` returns."""
    n, alone = numbers["batch"], {r["threads"]: r["seconds"] for r in numbers["log_likelihoods"] if r["noise"] is None}
    shown: list[Table | str] = [
        _table(
            f"600 s spiral of suboff, steps of {numbers['step_s']:g} s, threads: {numbers['threads']}",
            ("batch", "time", "per simulation", "simulations/s", "memory"),
            [
                (
                    str(b["size"]),
                    f"{1e3 * b['seconds']:.3g} ms",
                    f"{1e6 * b['seconds'] / b['size']:.1f} us",
                    f"{b['size'] / b['seconds']:,.0f}",
                    f"{b['bytes'] / 1e6:.2f} MB",
                )
                for b in numbers["batches"]
            ],
        ),
        _table(
            "Number of coefficients, batch of 64",
            ("coefficients not zero", "per simulation"),
            [(str(row["coefficients"]), f"{1e6 * row['seconds']:.1f} us") for row in numbers["non_zero"]],
        ),
        _table(
            "Exact sensitivities",
            ("coefficients", "threads", "Jacobian", "simulations"),
            [
                (
                    str(row["coefficients"]),
                    str(row["threads"]),
                    f"{1e3 * row['seconds']:.2f} ms",
                    f"{row['seconds'] / alone[row['threads']] * n:.0f}",
                )
                for row in numbers["jacobians"]
            ],
        ),
        _table(
            f"Log likelihoods, batch of {n}",
            ("noise", "threads", "batch", "over the simulations alone"),
            [
                (
                    row["noise"] or "simulations alone",
                    str(row["threads"]),
                    f"{1e3 * row['seconds']:.2f} ms",
                    f"{row['seconds'] / alone[row['threads']]:.2f}",
                )
                for row in numbers["log_likelihoods"]
            ],
        ),
    ]
    if "cold_s" in numbers:
        shown.append(f"first simulation: {numbers['cold_s']:.1f} s with compilation, {numbers['warm_s']:.1f} s without")
    if "compilation" in numbers:
        seconds = [(name, f"{taken:.2f} s") for name, taken in numbers["compilation"].items()]
        shown.append(_table("Compilation, from an empty cache", ("what", "processor time"), seconds))
    return shown


def _table(title: str, header: Iterable[str], rows: Iterable[Iterable[str]]) -> Table:
    table = Table(*header, title=title)
    for row in rows:
        table.add_row(*row)
    return table
