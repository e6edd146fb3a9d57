"""Slocum gliders (.dbd, .ebd, .sbd, .tbd and their compressed forms), by dbdreader."""

import re
import shutil
import tempfile
from pathlib import Path

from bayesub.io.errors import InputError
from bayesub.logs.log_map import LogMap
from bayesub.logs.readers.signals import Signal, VehicleLog, library

CACHES = (".", "cac", "cache", "../cac", "../cache")  # where cache files may be, seen from the folder of the log
MOST_LINES = 200  # of a header, and bytes of one


def read(path: Path, log_map: LogMap) -> VehicleLog:
    """Read all parameters that have values; a signal has the name of its parameter, such as ``m_pitch``.

    Most files need the cache file (.cac) of their list of parameters: it is looked for in the folder that the map
    names, in that of the log, and in ``cac`` and ``cache`` in it or beside it. Latitudes and longitudes become degrees.
    """
    dbdreader = library("dbdreader", path)
    with path.open("rb") as log:
        lines = [log.readline(MOST_LINES) for _ in range(MOST_LINES)]
    matches = [(k, re.match(rb"num_ascii_tags:\s*(\d{1,9})\s*$", line)) for k, line in enumerate(lines, 1)]
    counts = [(k, int(match[1])) for k, match in matches if match]
    is_plain = lines[0].startswith(b"dbd_label")  # others are compressed, or of another kind
    if is_plain and not any(k <= count <= MOST_LINES for k, count in counts[-1:]):  # dbdreader would look without end
        message = f"{path}: is not the log of a Slocum glider, or damaged: its header does not say its length"
        raise InputError(message, "format")
    folders = [Path(log_map.cache)] if log_map.cache else []
    folders += [path.parent / name for name in CACHES]
    with tempfile.TemporaryDirectory() as cache:  # dbdreader writes into it too
        for folder in folders:
            for file in folder.glob("*.[cC][aA][cC]") if folder.is_dir() else ():
                shutil.copyfile(file, Path(cache) / file.name.lower())
        try:
            segment = dbdreader.DBD(str(path), cacheDir=cache)
        except dbdreader.DbdError as error:
            if error.value != dbdreader.DBD_ERROR_CACHE_NOT_FOUND:
                raise InputError(f"{path}: is not the log of a Slocum glider: {error}", "format") from None
            message = f"{path}: needs the cache file {next(iter(error.data.missing_cache_files), '')}.cac of the "
            message += "glider; put it beside the log, or give its folder as cache in the map"
            raise InputError(message, "missing", "cache") from None
        names = [name for name in segment.parameterNames if name != segment.timeVariable]
        cells = segment.get(*names)
        units = dict(segment.parameterUnits)
        segment.close()
    signals = {}
    for name, (times, values) in zip(names, cells if len(names) > 1 else [cells], strict=True):
        if len(times):
            unit = units[name]
            signals[name] = Signal(times, values, "" if unit in ("nodim", "enum", "bool") else unit)
    return VehicleLog(path, signals)
