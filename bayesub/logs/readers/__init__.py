"""Readers of what vehicles write: a module for each kind of log, whose library is imported when a file is read."""

import importlib
import math
import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import TypeVar

from bayesub.io import toml_files
from bayesub.io.errors import InputError, check_known
from bayesub.io.terminal import SILENT, Progress
from bayesub.logs.log_map import LogMap
from bayesub.logs.readers import stamps
from bayesub.logs.readers.signals import Signal, VehicleLog, join

__all__ = ["KINDS", "Kind", "Signal", "VehicleLog", "parts", "read"]

T = TypeVar("T")
MOST = 200_000  # rows that are held at a time


@dataclass(frozen=True)
class Kind:
    """A kind of log."""

    title: str  # what it is, in words
    module: str  # module of this package with the function ``read(path, log_map)``
    example: str  # a file name of this kind
    is_folder: bool = False  # whether it may be a folder
    # whether files that overlap in time are tables of one log, so that signals get the names of their files
    is_by_file: bool = False
    map_is_fixed: bool = False  # whether the built-in map serves for all logs of this kind


KINDS = {
    "ros": Kind("ROS bag", "ros", "run1.mcap", is_folder=True),
    "mavlink": Kind("log of MAVLink or ArduPilot", "mavlink", "00000042.BIN"),
    "ulog": Kind("ULog of PX4", "ulog", "09_00_00.ulg"),
    "nmea": Kind("NMEA 0183 log", "nmea", "gps.nmea"),
    "imc": Kind("LSTS log of IMC messages", "imc", "Data.lsf.gz"),
    "slocum": Kind("log of a Slocum glider", "slocum", "01600001.dbd"),
    "matlab": Kind("MATLAB file", "arrays", "trial.mat", is_by_file=True),
    "netcdf": Kind("NetCDF or HDF5 file", "arrays", "dive.nc", is_by_file=True),
    "csv": Kind("table in text", "table", "trial.txt", is_by_file=True),
    "parquet": Kind("Parquet file", "table", "trial.parquet", is_by_file=True),
    "kvlcc2": Kind("KVLCC2 trial of HSVA or MARIN", "kvlcc2", "HSVA_CPMC_KVLCC2_Z_20_10_P.dat", map_is_fixed=True),
}


def read(
    kind: str,
    paths: Sequence[Path],
    log_map: LogMap | None = None,
    *,
    is_listed: bool = False,
    progress: Progress = SILENT,
) -> VehicleLog:
    """Read a log of a kind (:data:`KINDS`), or the files of one that is in pieces.

    Large logs are read faster with a map, for the signals that it names; if one is missing everything is read. What is
    only to be listed may lack its times and have other faults, which become remarks. InputError for a file that is not
    of this kind or is not whole, and for a library that is not installed.
    """
    log_map, by_file = log_map or LogMap(), KINDS[kind].is_by_file
    if log_map.where and KINDS[kind].module != "table":
        raise InputError("where selects rows of tables only; leave it out", "conflict", "where")
    logs = [_read(kind, path, log_map, progress) for path in paths]
    parts = [path.stem for path in paths] + [re.split(r"[.\[]", name)[0] for log in logs for name in log.signals]
    for table in () if is_listed else log_map.time.tables:
        message = f"key 'time.tables.{table}': no table or variable is called '{table}'"
        check_known(table.partition(".")[0], parts, message, key=f"time.tables.{table}")
    for k, log in enumerate(logs):
        if log.fault is not None and not is_listed:
            raise log.fault
        logs[k] = replace(log, remarks=(*log.remarks, *([str(log.fault)] if log.fault else [])))
    log = join(logs, by_file)
    if all(section.optional or section.signal in log.signals for section in log_map.columns.values()):
        return log
    # What there is belongs to the message about what there is not.
    return join([_read(kind, path, log_map, progress, is_whole=True) for path in paths], by_file)


def parts(kind: str, paths: Sequence[Path], log_map: LogMap, progress: Progress = SILENT) -> Iterator[VehicleLog]:
    """The log that :func:`read` gives, part by part if it is a table of more than MOST rows in order of time."""
    if KINDS[kind].module == "table" and len(paths) == 1 and not log_map.time.tables:
        from bayesub.logs.readers import table

        _check_file(kind, paths[0])
        logs = table.parts(paths[0], log_map, progress, MOST)
        first = _guarded(kind, paths[0], lambda: next(logs))
        wanted = all(section.optional or section.signal in first.signals for section in log_map.columns.values())
        falls = any(signal.times[0] > signal.times[-1] for signal in first.signals.values() if len(signal.times))
        if first.fault is None and wanted and first.signals and not falls:
            for log in chain([first], iter(lambda: _guarded(kind, paths[0], lambda: next(logs, None)), None)):
                if log.fault is not None:
                    raise log.fault
                yield log
            return
    yield read(kind, paths, log_map, progress=progress)


def _check_file(kind: str, path: Path) -> None:
    """InputError for a folder that is no log, and for what cannot be opened or is empty."""
    if path.is_dir() and not KINDS[kind].is_folder:
        raise InputError(f"{path}: is a folder; name a file in it, such as {KINDS[kind].example}", "file")
    if not path.is_dir():
        most = None if path.suffix == ".gz" else math.inf  # bags are read message by message
        with toml_files.reading(path, most), path.open("rb") as file:
            if not file.read(1):
                raise InputError(f"{path}: is empty", "format")


def _guarded(kind: str, path: Path, reads: Callable[[], T]) -> T:
    """What a function reads from a file; InputError for whatever a library raises for one that it cannot make out."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of libraries, about fields that are not used
            return reads()
    except (InputError, MemoryError):
        raise
    except Exception as error:
        reason = str(error).strip().partition("\n")[0] or type(error).__name__
        fault = f"{path}: cannot be read as {KINDS[kind].title}: {reason}"
        raise InputError(f"{fault}; is it of this kind ({', '.join(KINDS)}), and whole?", "format") from None


def _read(kind: str, path: Path, log_map: LogMap, progress: Progress, is_whole: bool = False) -> VehicleLog:
    """The log in a file; all of it if nothing is found of what the map names."""
    reader = importlib.import_module(f"{__name__}.{KINDS[kind].module}")
    _check_file(kind, path)
    log_map = log_map.model_copy(update={"columns": {}}) if is_whole else log_map
    shown = [progress] if KINDS[kind].module == "table" else []
    log = _guarded(kind, path, lambda: reader.read(path, log_map, *shown))
    if not log.signals and log_map.columns and not is_whole:
        return _read(kind, path, log_map, progress, is_whole=True)
    if not log.signals:
        what = f"{path}: has no numbers with time stamps as {KINDS[kind].title}"
        text = "; ".join([what, f"is it of this kind ({', '.join(KINDS)})?", *log.remarks])
        raise log.fault or InputError(text, "format")
    period = log_map.time.clock(path.stem).wraps_every_s
    signals = {name: replace(s, times=stamps.unwrapped(s.times, period)) for name, s in log.signals.items()}
    return replace(log, signals=signals)
