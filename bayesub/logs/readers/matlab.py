"""MATLAB files: up to v7.2 by SciPy, v7.3 (HDF5) by h5py."""

from pathlib import Path

import numpy as np

from bayesub.io import units
from bayesub.io.errors import InputError, nearest
from bayesub.logs.log_map import LogMap
from bayesub.logs.readers.signals import LONGEST_ARRAY, Signal, VehicleLog

TIMES = ("time", "t", "time_s", "timestamp", "timestamps", "tout", "utc")


def read(path: Path, log_map: LogMap) -> VehicleLog:
    """Read vectors and matrices, also inside of structures; each is as long as its time.

    The time of a variable is that of its own structure, or else of the one around it: the variable that [time] names,
    or one called ``time`` or ``t``. Columns of a matrix are signals of their own, ``pos[0]``.
    """
    import h5py

    signal = log_map.time.signal
    arrays = _read_hdf5(path) if h5py.is_hdf5(path) else _read_scipy(path)
    times = {}
    for name, values in arrays.items():
        last = name.rpartition(".")[2]
        is_named = signal in (name, last) if signal else last.lower() in TIMES
        if is_named and values.size > 1 and max(values.shape) == values.size:
            times[name] = values.ravel()
    if not times:
        remedy = f"time or t; give [time] signal in the map, one of {', '.join(list(arrays)[:8])}"
        remedy = f"'{signal}'{nearest(signal, arrays)}" if signal else remedy
        message = f"{path}: no vector holds the times: there is no {remedy}"
        raise InputError(message, "unknown" if signal else "missing", "time.signal")
    factor = units.factor(log_map.time.unit or "s", "s")
    signals, unread = {}, []
    for name, values in arrays.items():
        clock = _clock(name, values, times)
        if name in times:
            continue
        if clock is None:
            unread.append(name)
            continue
        columns = values.reshape(len(clock), -1) if values.shape[0] == len(clock) else values.T.reshape(len(clock), -1)
        for k, column in enumerate(columns.T):
            label = name if columns.shape[1] == 1 else f"{name}[{k}]"
            signals[label] = Signal(factor * clock, column, units.of_column(name))
    few = ", ".join(unread[:8]) + (" .." if len(unread) > 8 else "")
    return VehicleLog(path, signals, (f"left out, since no time is as long: {few}",) if unread else ())


def _read_scipy(path: Path) -> dict[str, np.ndarray]:
    from scipy import io

    arrays = {}

    def visit(name, value):
        if hasattr(value, "_fieldnames"):
            for field in value._fieldnames:
                visit(f"{name}.{field}", getattr(value, field))
        elif isinstance(value, np.ndarray) and value.dtype.kind in "biuf" and value.ndim in (1, 2):
            arrays[name] = value.astype(float)

    for name, value in io.loadmat(path, squeeze_me=True, struct_as_record=False).items():
        if not name.startswith("__"):
            visit(name, value)
    return arrays


def _read_hdf5(path: Path) -> dict[str, np.ndarray]:
    import h5py

    arrays = {}

    def visit(name, item):
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "biuf" and not name.startswith("#"):
            values = np.asarray(item, dtype=float).T  # MATLAB stores columns first
            values = values.reshape(values.shape[0], -1) if values.ndim == 2 else np.atleast_1d(values)
            arrays[name.replace("/", ".")] = values.ravel() if 1 in values.shape else values

    with h5py.File(path, "r") as file:
        file.visititems(visit)
    return arrays


def _clock(name: str, values: np.ndarray, times: dict[str, np.ndarray]) -> np.ndarray | None:
    """The times of a variable, from its own structure outwards; None if none is as long as one of its sides."""
    scope = name
    while True:
        scope = scope.rpartition(".")[0]
        for label, clock in times.items():
            fits = len(clock) in values.shape and max(values.size // len(clock), 1) <= LONGEST_ARRAY
            if label.rpartition(".")[0] == scope and fits:
                return clock
        if not scope:
            return None
