"""The command `rank`."""

import json

import click

from bayesub.cli.arguments import MANOEUVRE, VEHICLE, plane
from bayesub.cli.arguments import subproblem as subproblem_option
from bayesub.io.terminal import FAILED, complain, console, say


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
    from rich.table import Table

    from bayesub.findings.zeros import rank_lines
    from bayesub.inference import identifiability
    from bayesub.model.linear_form import linear_systems
    from bayesub.model.manoeuvres import load_manoeuvre
    from bayesub.model.simulate import simulate
    from bayesub.model.vehicles import load_vehicle

    boat = load_vehicle(vehicle)
    history = load_manoeuvre(manoeuvre, boat)
    trajectory = simulate(boat, history, **plane(subproblem))
    if trajectory.status[0] != "ok":
        complain(f"{boat.name} does not complete {history.name}: {trajectory.status[0]}", FAILED)
    ranks = identifiability.rank(linear_systems(trajectory), prefer=boat.equations.added_masses)
    if as_json:
        click.echo(json.dumps({axis: r.summary() for axis, r in ranks.items()}, indent=2))
        return
    kind = trajectory.simulator.subproblem or "six degrees of freedom"
    title = f"{boat.name} on {history.name} ({kind}): columns scaled to unit length"
    table = Table("axis", "rank", "null", "weak", "condition", "round-off", "smallest", title=title)
    for axis, r in ranks.items():
        smallest = " ".join(f"{s:.0e}" for s in r.singular_values[max(0, r.rank - 2) :])
        counts = (f"{r.rank}/{r.columns}", str(r.null_dimension), str(r.rank - r.practical_rank))
        table.add_row(axis, *counts, f"{r.condition:.1e}", f"{r.threshold:.0e}", smallest)
    console.print(table)
    for axis, r in ranks.items():
        for verdict, vectors in (("not unique", r.null_vectors), ("ill-conditioned", r.weak_vectors)):
            for vector in vectors:
                changes = ", ".join(f"{name} {change:+.3g}" for name, change in vector.items())
                say(f"{axis} {verdict}: {changes}")
    for line in rank_lines(trajectory):
        say(line)
