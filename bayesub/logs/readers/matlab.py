"""MATLAB files: up to v7.2 by SciPy, v7.3 (HDF5) by h5py."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from bayesub.io import units
from bayesub.io.errors import InputError, nearest
from bayesub.logs.log_map import LogMap
from bayesub.logs.readers.signals import LONGEST_ARRAY, Signal, VehicleLog

TIMES = ("time", "t", "time_s", "timestamp", "timestamps", "tout", "utc")
HDF5 = b"\x89HDF"
V73_HEADER = 512  # bytes before the HDF5 file in one of MATLAB


def read(path: Path, log_map: LogMap) -> VehicleLog:
    """Read vectors and matrices, also inside of structures; each is as long as its time.

    The time of a variable is that of its own structure, or else of the one around it: the variable that [time] names,
    or one called ``time`` or ``t``. Columns of a matrix are signals of their own, ``pos[0]``.
    """
    arrays = dict(_hdf5(path) if _is_hdf5(path) else _scipy(path))
    times = {name: values.ravel() for name, values in arrays.items() if _is_time(name, values, log_map.time.signal)}
    if not times:
        signal = log_map.time.signal
        remedy = f"time or t; give [time] signal in the map, one of {', '.join(list(arrays)[:8])}"
        remedy = f"'{signal}'{nearest(signal, arrays)}" if signal else remedy
        raise InputError(
            f"{path}: no vector holds the times: there is no {remedy}",
            "unknown" if signal else "missing",
            "time.signal",
        )
    factor = units.factor(log_map.time.unit or "s", "s")
    signals, left_out = {}, []
    for name, values in arrays.items():
        clock = _clock(name, values, times)
        if name in times:
            continue
        if clock is None:
            left_out.append(name)
            continue
        columns = values.reshape(len(clock), -1) if values.shape[0] == len(clock) else values.T.reshape(len(clock), -1)
        for k, column in enumerate(columns.T):
            label = name if columns.shape[1] == 1 else f"{name}[{k}]"
            signals[label] = Signal(factor * clock, column, units.of_column(name))
    few = ", ".join(left_out[:8])
    remarks = (f"left out, since no time is as long: {few}{' ..' if len(left_out) > 8 else ''}",) if left_out else ()
    return VehicleLog(path, signals, remarks)


def _is_hdf5(path: Path) -> bool:
    with path.open("rb") as file:
        head = file.read(V73_HEADER + 4)
    return head.startswith(HDF5) or head[V73_HEADER:] == HDF5


def _scipy(path: Path) -> Iterator[tuple[str, np.ndarray]]:
    from scipy import io

    content = io.loadmat(path, squeeze_me=True, struct_as_record=False)
    for name, value in content.items():
        if not name.startswith("__"):
            yield from _inside(name, value)


def _inside(name: str, value) -> Iterator[tuple[str, np.ndarray]]:
    """The arrays of numbers in a variable, structures taken apart."""
    if hasattr(value, "_fieldnames"):
        for field in value._fieldnames:
            yield from _inside(f"{name}.{field}", getattr(value, field))
    elif isinstance(value, np.ndarray) and value.dtype.kind in "biuf" and value.ndim in (1, 2):
        yield name, value.astype(float)


def _hdf5(path: Path) -> Iterator[tuple[str, np.ndarray]]:
    import h5py

    def visit(name, item):
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "biuf" and not name.startswith("#"):
            values = np.asarray(item, dtype=float).T  # MATLAB stores columns first
            values = values.reshape(values.shape[0], -1) if values.ndim == 2 else np.atleast_1d(values)
            arrays.append((name.replace("/", "."), values.ravel() if 1 in values.shape else values))

    arrays: list[tuple[str, np.ndarray]] = []
    with h5py.File(path, "r") as file:
        file.visititems(visit)
    yield from arrays


def _is_time(name: str, values: np.ndarray, signal: str | None) -> bool:
    is_vector = values.size > 1 and max(values.shape) == values.size
    last = name.rpartition(".")[2]
    return is_vector and (signal in (name, last) if signal else last.lower() in TIMES)


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
