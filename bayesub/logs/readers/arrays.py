"""Files of named arrays: MATLAB of all versions, HDF5 and NetCDF, by h5py and SciPy; objects of MATLAB by mat-io."""

import re
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from bayesub.io import units
from bayesub.io.errors import InputError, nearest
from bayesub.logs.log_map import LogMap
from bayesub.logs.readers import stamps
from bayesub.logs.readers.signals import LONGEST_ARRAY, Signal, VehicleLog, library

TIMES = ("time", "t", "time_s", "timestamp", "timestamps", "tout", "utc")

Arrays = dict[str, tuple[np.ndarray, str]]  # name -> values, and their unit; empty if the file does not say


def read(path: Path, log_map: LogMap) -> VehicleLog:
    """Read vectors and matrices, also inside of structures, groups and tables; each is as long as its time.

    The time of a variable is one called ``NAME_time``, or else that of its own structure, or of the one around it: the
    variable that [time] names, or one called ``time`` or ``t``. Columns of a matrix are signals of their own,
    ``pos[0]``, and one may be the time of the others.
    """
    import pandas as pd

    arrays = _arrays(path)
    vectors = dict(chain.from_iterable(_columns(name, *array) for name, array in arrays.items()))
    times: dict[str, tuple[np.ndarray, str]] = {}  # label -> s, and the part of the file that they are for, or all
    remarks, faults = [], []
    for part in (*log_map.time.tables, ""):
        clock = log_map.time.clock(part or path.stem)
        signal = _label(clock.signal or "")
        found = [label for label in vectors if signal in (label, label.rpartition(".")[2])]
        found = [label for label in found if label.startswith(part)] or found
        if not signal:
            found = [] if part else [label for label in vectors if _is_time(label, vectors)]
            found.sort(key=lambda label: label.rpartition(".")[2].lower() == "t")  # may be a temperature
        elif not found and part != path.stem:
            message = f"{path}: there is no '{clock.signal}', the signal of [time]{nearest(signal, vectors)}"
            faults.append(InputError(message, "unknown", "time.signal"))
        for label in found:
            try:
                seconds, remark, _ = stamps.seconds(pd.Series(vectors[label][0]), clock, vectors[label][1], label)
            except InputError as error:
                faults.append(error.within(str(path)))
            else:
                times[label] = seconds, part
                remarks += [remark] if remark else []
    objects = [name for name, (values, _) in arrays.items() if values.dtype.kind == "O" and not values.ndim]
    for name, new in [(name, re.sub(r"\W+", "_", name)) for name in objects[:1]]:
        message = f"'{name}' is a timeseries, which only MATLAB reads; there write {new}_time = {name}.Time; "
        message += f"{new} = {name}.Data; save('{new}.mat', '{new}', '{new}_time')"
        message += f", and so with {', '.join(objects[1:])}" if objects[1:] else ""
        remarks += [message] if times else []
        faults += [] if times else [InputError(f"{path}: {message}", "format", name)]
    if not times and not faults:
        likely = [label for label, (x, _) in vectors.items() if x.dtype.kind in "iuf" and (np.diff(x) > 0).all()]
        some = f'such as signal = "{likely[0]}", which ascends' if likely else f"one of {', '.join(list(vectors)[:8])}"
        message = f"{path}: no vector holds the times: there is no time or t; give [time] signal in the map, {some}"
        faults.append(InputError(message, "missing", "time.signal"))
    is_named = log_map.time.signal is not None
    fault = faults[0] if faults and (is_named or not times) else None
    remarks += [str(other) for other in faults if fault is None]
    wanted = {_label(section.signal): section.signal for section in log_map.columns.values()}
    signals: dict[str, Signal] = {}
    unread: dict[str, None] = {}
    for label, (values, unit) in vectors.items():
        name, clock_of = re.sub(r"\[\d+\]$", "", label), _clock(label, len(values), times, is_named)
        if label in times or values.dtype.kind not in "biuf":
            continue
        if clock_of is None and fault is None:
            unread[name] = None
            continue
        seconds = np.full(len(values), np.nan) if clock_of is None else times[clock_of][0]
        unit = re.sub("(?i)^degrees?_(north|east|true|t)$", "deg", unit) or units.of_column(name)  # as NetCDF spells it
        signals[wanted.get(label, label)] = Signal(seconds, values.astype(float), unit)
    few = ", ".join(list(unread)[:8]) + (" .." if len(unread) > 8 else "")
    remarks += [f"left out, since no time is as long: {few}"] if unread else []
    return VehicleLog(path, signals, tuple(remarks), fault)


def _label(signal: str) -> str:
    """A signal as it is listed: ``imu[:,0]``, and MATLAB's own ``imu(:,1)``, are ``imu[0]``."""
    signal = re.sub(r"\(:, ?(\d+)\)$", lambda match: f"[{int(match[1]) - 1}]", signal)
    return re.sub(r"\[:, ?(\d+)\]$", r"[\1]", signal)


def _is_time(label: str, vectors: Arrays) -> bool:
    name, values = label.rpartition(".")[2].lower(), vectors[label][0]
    is_named = name in TIMES or label.removesuffix("_time") in vectors.keys() - {label}
    is_other = name == "t" and values.dtype.kind in "iuf" and not stamps.may_be_clock(values)
    return (is_named and not is_other) or values.dtype.kind in "Mm"


def _columns(name: str, values: np.ndarray, unit: str) -> list[tuple[str, tuple[np.ndarray, str]]]:
    """Label, values (n,) and unit of a vector, or of each column of a matrix; the longer side is the time."""
    longest = max(values.shape, default=0)
    if longest < 2 or values.size // longest > LONGEST_ARRAY:
        return []
    if longest == values.size:
        return [(name, (values.ravel(), unit))]
    columns = np.moveaxis(values, values.shape.index(longest), 0).reshape(longest, -1).T
    return [(f"{name}[{k}]", (column, unit)) for k, column in enumerate(columns)]


def _clock(label: str, length: int, times: dict[str, tuple[np.ndarray, str]], is_for_all: bool) -> str | None:
    """The time of a variable, from its own part of the file outwards; None if none is as long."""
    scopes = [label]
    while scopes[-1]:
        scopes.append(_around(scopes[-1]))
    of_all = [time for time, (_, part) in times.items() if not part]
    candidates = [time for time, (_, part) in times.items() if part and part in scopes] + [f"{label}_time"]
    candidates += [time for scope in scopes[1:] for time in of_all if _around(time) == scope]
    candidates += of_all if is_for_all else []
    return next((time for time in candidates if time in times and len(times[time][0]) == length), None)


def _around(label: str) -> str:
    """The matrix, structure or group that a signal is in; empty for one that is in none."""
    return re.sub(r"(\[\d+\]|(^|\.)[^.\[\]]*)$", "", label)


def _arrays(path: Path) -> Arrays:
    """All arrays of numbers and dates in a file."""
    import h5py

    arrays: Arrays = {}
    with path.open("rb") as file:
        begin = file.read(4)
    if h5py.is_hdf5(path):
        with h5py.File(path, "r") as file:
            if "#subsystem#" not in file:
                _visit_hdf5("", file, arrays)
                return arrays
    elif begin.startswith(b"CDF"):
        from scipy import io

        with io.netcdf_file(path, mmap=False, maskandscale=True) as file:
            for name, variable in file.variables.items():
                if variable.data.dtype.kind in "iuf" and variable.shape:
                    values = np.array(np.ma.filled(variable[:].astype(float), np.nan))
                    arrays[name] = values, _decoded(getattr(variable, "units", ""))
        return arrays
    else:
        from scipy import io

        content = io.loadmat(path)
        if "__function_workspace__" not in content:
            for name, value in content.items():
                _visit(name, value, arrays)
            return arrays
    for name, value in library("matio", path, "mat-io").load_from_mat(str(path)).items():
        _visit(name, value, arrays)
    return arrays


def _visit(name: str, value: Any, arrays: Arrays) -> None:
    """Add a variable of MATLAB and those inside of it."""
    import pandas as pd

    if isinstance(value, pd.DataFrame):
        for column in value:
            arrays[f"{name}.{column}"] = value[column].to_numpy(), ""
        if value.index.dtype.kind in "Mm":
            arrays[f"{name}.time"] = value.index.to_numpy(), ""
    elif getattr(value, "classname", "") == "timeseries":
        arrays[name] = np.array(value, dtype=object), ""
    elif not isinstance(value, np.ndarray):
        return
    elif value.dtype.names:
        for field in value.dtype.names:
            cells = [element[field] for element in value.ravel()]
            numbers = [x for x in cells if isinstance(x, np.ndarray) and x.size <= 1 and x.dtype.kind in "biuf"]
            if 1 < len(cells) == len(numbers):
                arrays[f"{name}.{field}"] = np.array([x.item() if x.size else np.nan for x in cells]), ""
                continue
            for k, cell in enumerate(cells):
                _visit(f"{name}[{k}].{field}" if len(cells) > 1 else f"{name}.{field}", cell, arrays)
    elif value.dtype.kind == "O":
        for k, cell in enumerate(value.ravel()):
            _visit(f"{name}[{k}]" if value.size > 1 else name, cell, arrays)
    elif value.dtype.kind in "biufMmU" and not name.startswith("__"):  # texts may be times
        arrays[name] = np.squeeze(value), ""


def _visit_hdf5(name: str, item: Any, arrays: Arrays) -> None:
    """Add a group, dataset or reference of HDF5 and what is inside of it."""
    import h5py

    kind = item.attrs.get("MATLAB_class", b"")
    if isinstance(item, h5py.Group):
        for key in item:
            if not key.startswith("#") and (inner := item.get(key)) is not None:  # and the link leads to something
                _visit_hdf5(f"{name}.{key}" if name else key, inner, arrays)
    elif item.shape is None:
        return
    elif item.dtype.names:
        table = item[()]
        for field in item.dtype.names:
            if table[field].dtype.kind in "biuf":
                arrays[f"{name}.{field}"] = table[field], ""
    elif h5py.check_string_dtype(item.dtype) is not None and item.size:
        arrays[name] = np.squeeze(np.array(item.asstr(errors="replace")[()], dtype=str)), ""
    elif h5py.check_ref_dtype(item.dtype) is not None and item.size:
        cells = [item.file[reference] for reference in item[()].ravel()]
        if all(isinstance(cell, h5py.Dataset) and cell.size == 1 and cell.dtype.kind in "biuf" for cell in cells):
            arrays[name] = np.array([cell[()].item() for cell in cells], dtype=float), ""
            return
        parent, _, field = name.rpartition(".")
        for k, cell in enumerate(cells):
            _visit_hdf5(f"{name}[{k}]" if kind == b"cell" or not parent else f"{parent}[{k}].{field}", cell, arrays)
    elif item.dtype.kind in "biuf" and kind != b"char" and "MATLAB_empty" not in item.attrs:
        is_unsigned = np.ravel(item.attrs.get("_Unsigned", ""))[0] in (b"true", "true")  # as NetCDF 3 had to say
        values = np.array(item, dtype=float)
        given = [np.ravel(item.attrs.get(key, ())) for key in ("_FillValue", "missing_value")]
        marks = np.concatenate([np.zeros(0), *(one for one in given if one.dtype.kind in "biuf")])
        if is_unsigned and item.dtype.kind == "i":
            values, marks = (numbers % 2.0 ** (8 * item.dtype.itemsize) for numbers in (values, marks))
        values[np.isin(values, marks)] = np.nan
        scales = (("scale_factor", 1.0), ("add_offset", 0.0))
        factor, offset = (float(np.ravel(item.attrs.get(*key))[0]) for key in scales)
        unit = _decoded(item.attrs.get("units", ""))
        arrays[name] = np.squeeze(factor * (values.T if kind else values) + offset), unit


def _decoded(unit: Any) -> str:
    """A unit as a text; a byte that is no UTF-8 is the sign of degrees."""
    return unit.decode("utf-8", "replace").replace("\ufffd", "°") if isinstance(unit, bytes) else str(unit)
