"""The commands that prepare input: `new` with its templates, and `convert`, by which a vehicle's log becomes ours."""

import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bayesub.cli import arguments
from bayesub.cli.arguments import EQUATIONS, KIND, MANOEUVRE, PATH, VEHICLE, NamingGroup, refuse_several
from bayesub.io import templates, toml_files
from bayesub.io.errors import InputError
from bayesub.io.terminal import LONG_S, SILENT, Bars, aligned, say, say_rows

if TYPE_CHECKING:
    from bayesub.logs.readers.signals import VehicleLog

EPOCH, LATEST = 1e8, 1e11  # s; a clock between them counts from 1970


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
@click.option("--captive", type=PATH, metavar="TABLE", help="Update coefficients of --from by captive tests (CSV).")
def vehicle(name: str, output: Path | None, source: str | None, captive: Path | None, **own: Any) -> None:
    """Write a vehicle file with every coefficient of its equations.

    It has the usual keys, and unknown coefficients are zero. With a geometry, added masses and what follows from them
    are estimated, each with its uncertainty and source. With a table of captive tests the coefficients of --from become
    their posterior, for studies to begin with (page priors-and-noise).
    """
    from bayesub.model.equations.files import DEFAULT
    from bayesub.model.hulls import load_hull
    from bayesub.study.new import files

    for option, value in own.items():
        refuse_several({"--from": source, f"--{option}": value}, f"--{option}")
    path = output or Path(f"{name}.toml")
    if captive:
        if source is None:
            raise InputError("--captive needs --from VEHICLE, whose coefficients are the prior", "missing", "--from")
        text, words = files.captive_vehicle(name, source, captive, path)
        _write(path, text, 'a study of it with [prior] kind = "vehicle" begins with what the tests say')
        say_rows(words)
        return
    if source:
        text = files.copied_vehicle(name, source, path)
    else:
        hull = load_hull(own["geometry"]) if own["geometry"] else None
        text = files.vehicle(name, hull, own["equations"] or DEFAULT, path)
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
    refuse_several({"--manoeuvre": manoeuvre, "--data": data}, "--data")
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
    path = output or Path("limits.toml")
    text = templates.fill("bayesub.study.new", "new_limits.toml", file=path)
    _write(path, text, f"change it, then bayesub design VEHICLE --limits {path} -o DIR")


def _write(path: Path, text: str, advice: str) -> None:
    from bayesub.study.new.files import write_new

    write_new(path, text)
    say(f"{path}: {advice}")


@click.command(epilog="Example: bayesub convert ros run1.mcap -o log.csv --map map.toml")
@click.argument("kind", **KIND)
@click.argument("files", nargs=-1, required=True, type=PATH, metavar="FILE...")
@click.option("-o", "--output", type=PATH, metavar="LOG", help="Log to write (CSV).")
@click.option("--map", "map_file", type=PATH, metavar="MAP", help="Which signal becomes which column (TOML).")
@click.option("--list", "as_list", is_flag=True, help="List the signals with units, rates and ranges instead.")
def convert(kind: str, files: tuple[Path, ...], output: Path | None, map_file: Path | None, as_list: bool) -> None:
    """Convert what a vehicle wrote into a log, each reading at its own time.

    KIND is ros (bags of ROS 2 and 1), mavlink (ArduPilot .bin, .tlog), ulog (PX4), nmea (NMEA 0183), imc (LSTS .lsf),
    slocum (.dbd, .ebd), matlab (.mat), netcdf (HDF5 too), csv (any table in text), parquet or kvlcc2 (HSVA and MARIN).
    Several FILEs are pieces of one log.
    """
    from bayesub.logs import conversion, readers
    from bayesub.logs.log_map import LogMap, read_map

    if as_list:
        log_map, faults = LogMap(), []
        try:
            log_map = read_map(map_file, kind).model_copy(update={"columns": {}}) if map_file else log_map
        except InputError as error:  # the list helps to write a map that is right
            faults = [str(error)]
        with Bars(LONG_S) as bars:
            bars.stage(f"read {files[0].name}")
            log = readers.read(kind, files, log_map, is_listed=True, progress=bars)
        for line in (*signal_lines(log), *(f"  note: {fault}" for fault in faults)):
            say(line)
        return
    if output is None:
        raise InputError("convert needs -o LOG, or --list", "missing", "-o")
    if map_file is None and not readers.KINDS[kind].map_is_fixed:
        text = f"convert {kind} needs --map MAP: bayesub new map {kind} -o map.toml writes one to be changed"
        raise InputError(text, "missing", "--map")
    arguments.refuse_overwriting(output, *files, map_file)
    map_file = map_file or toml_files.built_in("maps")[kind]
    log_map = read_map(map_file, kind)
    with Bars(LONG_S) as bars:
        bars.stage(f"convert {files[0].name}")
        of_file = dict[str, None]()

        def logs():
            for log in readers.parts(kind, files, log_map, bars):
                of_file.update(dict.fromkeys(log.remarks))
                yield log

        shown = SILENT if readers.KINDS[kind].module == "table" else bars  # which show the reading
        last, extents = conversion.save(output, conversion.in_parts(logs(), log_map, map_file), shown)
    n_rows, begin, end = extents.pop("time_s")
    say(f"{output}: {n_rows} rows from {begin:g} to {end:g} s; {_zero(last.zero)}")
    say_rows(
        (name, f"{n} cells", f"{least:.6g} .. {most:.6g}", last.readings[name].section.signal)
        for name, (n, least, most) in extents.items()
    )
    for remark in (*of_file, *last.remarks):
        say(f"  note: {remark}")


def _zero(zero: float) -> str:
    """Time zero in words."""
    if not EPOCH <= zero < LATEST:
        return f"0 s is {zero:.6f} s of the file"
    moment = datetime.datetime.fromtimestamp(zero, datetime.UTC)
    return f"0 s is {moment:%Y-%m-%d %H:%M:%S}.{moment.microsecond // 1000:03d} UTC"


def signal_lines(log: "VehicleLog") -> list[str]:
    """A line for each signal: unit, number, rate, times and range; and remarks."""
    import numpy as np

    lines = [f"{log.path}: {len(log.signals)} signals"]
    rows: list[tuple[str, ...]] = [("signal", "unit", "readings", "a second", "from", "to s", "smallest", "largest")]
    zero = log.begin if log.begin > EPOCH else 0.0
    for name, signal in log.signals.items():
        finite = (some[np.isfinite(some)] for some in (signal.values, signal.times - zero))
        ends, span = ([f"{x:.6g}" for x in (some.min(), some.max())] if len(some) else ["-", "-"] for some in finite)
        rate = f"{1.0 / signal.interval:.3g}" if signal.interval > 0 else "-"
        rows.append((name, signal.unit or "-", str(np.isfinite(signal.values).sum()), rate, *span, *ends))
    lines += aligned(rows)
    lines += [f"  times count from {_zero(zero).removeprefix('0 s is ')}"] if zero else []
    return lines + [f"  note: {remark}" for remark in log.remarks]
