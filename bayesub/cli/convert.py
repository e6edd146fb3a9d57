"""The command `convert`: the log of a vehicle becomes one of ours."""

import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bayesub.cli.arguments import KIND, PATH
from bayesub.io import toml_files
from bayesub.io.errors import InputError
from bayesub.io.terminal import LONG_S, Bars, aligned, say

if TYPE_CHECKING:
    from bayesub.logs.conversion import Conversion
    from bayesub.logs.readers.signals import VehicleLog

EPOCH, LATEST = 1e8, 1e11  # s; a clock between them counts from 1970


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
    from bayesub.logs import readers
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
    if output.resolve() in {file.resolve() for file in files}:
        raise InputError(f"{output}: is the file that is read; choose another with -o", "conflict", "-o")
    from bayesub.logs import conversion

    map_file = map_file or toml_files.built_in("maps")[kind]
    log_map = read_map(map_file, kind)
    with Bars(LONG_S) as bars:
        bars.stage(f"read {files[0].name}")
        log = readers.read(kind, files, log_map, progress=bars)
        bars.stage("make the columns")
        result = conversion.convert(log, log_map, map_file)
        bars.stage(f"write {output.name}")
        result.save(output, bars)
    say(f"{output}: {len(result.times)} rows from {result.times[0]:g} to {result.times[-1]:g} s; {_zero(result.zero)}")
    for line in column_lines(result):
        say(line)
    for remark in (*log.remarks, *result.remarks):
        say(f"  note: {remark}")


def _zero(zero: float) -> str:
    """Time zero in words."""
    if not EPOCH <= zero < LATEST:
        return f"0 s is {zero:.6f} s of the file"
    moment = datetime.datetime.fromtimestamp(zero, datetime.UTC)
    return f"0 s is {moment:%Y-%m-%d %H:%M:%S}.{moment.microsecond // 1000:03d} UTC"


def column_lines(conversion: "Conversion") -> list[str]:
    """A line for each column: cells, range, signal."""
    import numpy as np

    rows = []
    for name, cells in conversion.columns.items():
        filled = cells[np.isfinite(cells)]
        extent = f"{filled.min():.6g} .. {filled.max():.6g}"
        rows.append((name, f"{len(filled)} cells", extent, conversion.sources[name]))
    return aligned(rows)


def signal_lines(log: "VehicleLog") -> list[str]:
    """A line for each signal: unit, number, rate, times and range; and remarks."""
    import numpy as np

    lines = [f"{log.path}: {len(log.signals)} signals"]
    rows: list[tuple[str, ...]] = [("signal", "unit", "readings", "a second", "from", "to s", "smallest", "largest")]
    zero = log.begin if log.begin > EPOCH else 0.0
    for name, signal in log.signals.items():
        values = signal.values[np.isfinite(signal.values)]
        ends = [f"{values.min():.6g}", f"{values.max():.6g}"] if len(values) else ["-", "-"]
        times = signal.times[np.isfinite(signal.times)]
        span = [f"{t - zero:.6g}" for t in (times.min(), times.max())] if len(times) else ["-", "-"]
        rate = f"{1.0 / signal.interval:.3g}" if signal.interval > 0 else "-"
        rows.append((name, signal.unit or "-", str(len(values)), rate, *span, *ends))
    lines += aligned(rows)
    lines += [f"  times count from {_zero(zero).removeprefix('0 s is ')}"] if zero else []
    return lines + [f"  note: {remark}" for remark in log.remarks]
