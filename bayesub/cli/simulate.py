"""The commands of a simulated manoeuvre: `simulate`, and `rank` of its exact motion."""

import json
from pathlib import Path
from typing import Any

import click

from bayesub.cli.arguments import MANOEUVRE, PATH, VEHICLE, plane
from bayesub.cli.arguments import subproblem as subproblem_option
from bayesub.io.terminal import FAILED, complain, console, say


@click.command(epilog="Example: bayesub simulate suboff horizontal -o track.csv --plot track.png")
@click.argument("vehicle", **VEHICLE)
@click.argument("manoeuvre", **MANOEUVRE)
@click.option("-o", "--output", type=PATH, required=True, help="Track CSV to write.")
@click.option("--dt", type=float, metavar="S", help="Time step in seconds; if left out, a tenth of one good to 5 cm.")
@click.option(
    "--sample", type=float, metavar="S", help="Output interval in seconds; if left out, that of the controls."
)
@click.option(
    "--controls",
    type=click.Choice(["linear", "hold"]),
    default="linear",
    show_default=True,
    help="Controls within a step: interpolated, or held as in the thesis.",
)
@subproblem_option
@click.option(
    "--attitude",
    type=click.Choice(["euler", "quaternion"]),
    default="euler",
    show_default=True,
    help="Integrate Euler angles, or a quaternion that flies through 90 degrees of pitch.",
)
@click.option("--plot", type=PATH, help="Also draw the track into this PNG or PDF.")
@click.option("--sensors", metavar="NAME", help="Write what these instruments log instead: a preset, or a TOML file.")
@click.option(
    "--perturb", type=float, metavar="SD", help="Fly coefficients that are off by this, relative to the file."
)
@click.option("--disturbance", type=PATH, metavar="FILE", help="Fly with random forces that the equations leave out.")
@click.option(
    "--seed", type=click.IntRange(0), default=0, show_default=True, help="Of --sensors, --perturb and --disturbance."
)
def simulate(vehicle: str, manoeuvre: str, output: Path, subproblem: str | None, **options: Any) -> None:
    """Simulate a VEHICLE (built-in name or TOML) on a MANOEUVRE (built-in name, TOML or control-history CSV).

    With --sensors the output is the log of a trial, controls and readings with noise, which a study reads as its data.
    The file of --disturbance has a section [disturbance]: axes, sd (or sd_n and sd_nm, or share; of a
    current sd_mps), correlation_time_s.
    """
    from bayesub.study.before.simulate import simulate

    sentence, is_whole = simulate(vehicle, manoeuvre, output, **options, **plane(subproblem))
    say(f"{output}: {sentence}")
    if not is_whole:
        raise click.exceptions.Exit(FAILED)


@click.command(epilog="Example: bayesub rank suboff horizontal --json")
@click.argument("vehicle", **VEHICLE)
@click.argument("manoeuvre", **MANOEUVRE)
@subproblem_option
@click.option("--json", "as_json", is_flag=True, help="Ranks, singular values and null vectors as JSON.")
def rank(vehicle: str, manoeuvre: str, subproblem: str | None, as_json: bool) -> None:
    """Say which coefficients of a VEHICLE a MANOEUVRE leaves open, axis by axis, if every motion is known exactly.

    A direction at round-off is not unique: no instrument finds it. One above round-off but below a millionth of the
    largest is ill-conditioned: unique in the equations, out of reach in a trial.
    """
    from bayesub.study.before.simulate import rank

    ranked = rank(vehicle, manoeuvre, **plane(subproblem))
    if not ranked.ranks:
        complain(ranked.title, FAILED)
    if as_json:
        click.echo(json.dumps({axis: r.summary() for axis, r in ranked.ranks.items()}, indent=2))
        return
    from rich.table import Table

    table = Table("axis", "rank", "null", "weak", "condition", "round-off", "smallest", title=ranked.title)
    for axis, r in ranked.ranks.items():
        smallest = " ".join(f"{s:.0e}" for s in r.singular_values[max(0, r.rank - 2) :])
        counts = (f"{r.rank}/{r.columns}", str(r.null_dimension), str(r.rank - r.practical_rank))
        table.add_row(axis, *counts, f"{r.condition:.1e}", f"{r.threshold:.0e}", smallest)
    console.print(table)
    for line in ranked.lines:
        say(line)
