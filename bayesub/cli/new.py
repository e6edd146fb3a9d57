"""The commands `new equations`, `new vehicle`, `new geometry`, `new map`, `new study` and `new limits`."""

from pathlib import Path

import click

from bayesub.cli.arguments import EQUATIONS, KIND, MANOEUVRE, PATH, VEHICLE, NamingGroup
from bayesub.io.errors import InputError
from bayesub.io.terminal import say


@click.group(cls=NamingGroup, epilog="Example: bayesub new vehicle myboat")
def new() -> None:
    """Write a commented template: equations, a vehicle of your own, its hull, a map of its logs, a study, or limits."""


@new.command(epilog="Example: bayesub new equations mine --from booth")
@click.argument("name")
@click.option("-o", "--output", type=PATH, metavar="FILE", help="File to write; NAME.toml if left out.")
@click.option("--from", "source", **EQUATIONS, help="Start from a copy of this set (built-in name or TOML).")
def equations(name: str, output: Path | None, source: str | None) -> None:
    """Write an equation file with every key and an example."""
    from bayesub.study.new import files

    path = output or Path(f"{name}.toml")
    text = files.equations(name, source, path)
    _write(path, text, f"bayesub check says what it has; then bayesub new vehicle NAME --equations {path}")


@new.command(epilog="Example: bayesub new vehicle myboat --geometry myboat_hull.toml")
@click.argument("name")
@click.option("-o", "--output", type=PATH, metavar="FILE", help="File to write; NAME.toml if left out.")
@click.option("--from", "source", **VEHICLE, help="Start from a copy of this vehicle (built-in name or TOML).")
@click.option("--geometry", type=PATH, metavar="HULL", help="Estimate added masses from this geometry file.")
@click.option("--equations", **EQUATIONS, help="Whose coefficients it has (built-in name or TOML); booth if left out.")
def vehicle(name: str, output: Path | None, source: str | None, geometry: Path | None, equations: str | None) -> None:
    """Write a vehicle file with every coefficient of its equations.

    It has every key, and what is unknown is zero. With a geometry, added masses and what follows from them are
    estimated, each with its uncertainty and source.
    """
    from bayesub.model.equations.files import DEFAULT
    from bayesub.model.hulls import load_hull
    from bayesub.study.new import files

    for option, value in (("--geometry", geometry), ("--equations", equations)):
        if source and value:
            raise InputError(f"--from and {option} exclude each other", "conflict", option)
    path = output or Path(f"{name}.toml")
    if source:
        text = files.copied_vehicle(name, source, path)
    else:
        text = files.vehicle(name, load_hull(geometry) if geometry else None, equations or DEFAULT, path)
    _write(path, text, "bayesub check says what it lacks")


@new.command(epilog="Example: bayesub new geometry myboat -o myboat_hull.toml")
@click.argument("name")
@click.option("-o", "--output", type=PATH, metavar="FILE", help="File to write; NAME_hull.toml if left out.")
def geometry(name: str, output: Path | None) -> None:
    """Write a hull geometry, for `bayesub new vehicle --geometry`."""
    from bayesub.study.new import files

    path = output or Path(f"{name}_hull.toml")
    _write(path, files.geometry(name), f"fill it in, then bayesub new vehicle {name} --geometry {path}")


@new.command("map", epilog="Example: bayesub new map ros --data run1.mcap -o map.toml")
@click.argument("kind", **KIND)
@click.option("-o", "--output", type=PATH, metavar="FILE", help="File to write; KIND_map.toml if left out.")
@click.option("--data", type=PATH, metavar="LOG", help="List the signals of this log in it.")
def map_(kind: str, output: Path | None, data: Path | None) -> None:
    """Write a map of a log, with an example, for `bayesub convert`."""
    from bayesub.study.new import files

    path = output or Path(f"{kind}_map.toml")
    _write(path, files.map_of(kind, path, data), f"change it, then bayesub convert {kind} FILE -o log.csv --map {path}")


@new.command(epilog="Example: bayesub new study mytrial --vehicle myboat.toml --data trial.csv")
@click.argument("name")
@click.option("-o", "--output", type=PATH, metavar="FILE", help="File to write; NAME.toml if left out.")
@click.option("--vehicle", **VEHICLE, help="Built-in name or TOML.")
@click.option("--manoeuvre", **MANOEUVRE, help="Simulate this one and measure it.")
@click.option("--data", type=PATH, metavar="LOG", help="Read this log (CSV) instead.")
def study(name: str, output: Path | None, vehicle: str | None, manoeuvre: str | None, data: Path | None) -> None:
    """Write a study, of a simulated track or of the columns of a log."""
    from bayesub.model.manoeuvres import load_manoeuvre
    from bayesub.model.vehicles import load_vehicle
    from bayesub.study.new.study import of_log, simulated

    missing = [] if vehicle else ["--vehicle"]
    missing += [] if manoeuvre or data else ["one of --manoeuvre and --data"]
    if vehicle is None or missing:
        raise InputError(f"a study needs {' and '.join(missing)}", "missing", "--data" if vehicle else "--vehicle")
    if manoeuvre is not None and data is not None:
        raise InputError("--manoeuvre and --data exclude each other", "conflict", "--data")
    path = output or Path(f"{name}.toml")
    boat = load_vehicle(vehicle)
    if data is not None:
        text = of_log(name, path, vehicle, data)
    elif manoeuvre is not None:
        load_manoeuvre(manoeuvre, boat)
        text = simulated(name, path, vehicle, manoeuvre)
    _write(path, text, f"look through it, then bayesub check {path} --card card.png")


@new.command(epilog="Example: bayesub new limits -o limits.toml")
@click.option("-o", "--output", type=PATH, metavar="FILE", help="File to write; limits.toml if left out.")
def limits(output: Path | None) -> None:
    """Write the limits of boat, crew and range, for `bayesub design`."""
    from bayesub.study.new import files

    path = output or Path("limits.toml")
    _write(path, files.limits(path), f"change it, then bayesub design VEHICLE --limits {path} -o DIR")


def _write(path: Path, text: str, advice: str) -> None:
    from bayesub.study.new.files import write_new

    write_new(path, text)
    say(f"{path}: {advice}")
