"""The result of readers: signals by name, each with its own time stamps."""

import importlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from bayesub.io import units
from bayesub.io.errors import InputError


@dataclass(frozen=True)
class Signal:
    """Readings of one quantity."""

    times: np.ndarray  # (n,) s of the file's clock, in the order of the file
    values: np.ndarray  # (n,) in `unit`; not a number where there is none
    unit: str = ""  # as :mod:`bayesub.io.units` spells it or otherwise; empty if the file does not say

    @property
    def interval(self) -> float:
        """Median time between readings, s; not a number for fewer than two."""
        return float(np.median(np.diff(self.times))) if len(self.times) > 1 else np.nan


@dataclass(frozen=True)
class VehicleLog:
    """The log of a vehicle as it was written."""

    path: Path
    signals: dict[str, Signal]  # by name
    remarks: tuple[str, ...] = ()  # what could not be read, and what was supposed of the file
    fault: InputError | None = None  # why its signals can be listed, but not used

    @property
    def begin(self) -> float:
        """First time in the file of all signals, s; zero without readings."""
        return min((signal.times[0] for signal in self.signals.values() if len(signal.times)), default=0.0)

    @property
    def end(self) -> float:
        """Last time in the file of all signals, s; zero without readings."""
        return max((signal.times[-1] for signal in self.signals.values() if len(signal.times)), default=0.0)


LONGEST_ARRAY = 40  # elements; longer arrays are pictures, sonar pings and covariances


@dataclass
class Collection:
    """Signals that grow reading by reading."""

    _cells: dict[str, tuple[list[float], list[float], str]] = field(default_factory=dict)

    def add(self, name: str, time: float, value: object, unit: str = "") -> None:
        """Append a number at a time (s), or the elements of a list or array as ``name[0]``; anything else is left out.

        The unit of the first reading counts.
        """
        if isinstance(value, bool | int | float | np.number | np.bool_):
            times, values, _ = self._cells.setdefault(name, ([], [], unit))
            times.append(time)
            values.append(float(value))
        elif isinstance(value, list | tuple | np.ndarray) and len(value) <= LONGEST_ARRAY:
            for k, element in enumerate(value):
                self.add(f"{name}[{k}]", time, element, unit)

    def signals(self) -> dict[str, Signal]:
        """All signals as arrays."""
        cells = self._cells.items()
        return {name: Signal(np.array(t, dtype=float), np.array(x, dtype=float), unit) for name, (t, x, unit) in cells}


def join(logs: Sequence[VehicleLog], is_by_file: bool = False) -> VehicleLog:
    """The logs of several files, such as the segments of a mission, one after the other.

    With `is_by_file`, files that overlap in time are one log, of signals ``FILE.NAME``, or ``FOLDER/FILE.NAME``.
    """
    if len(logs) == 1:
        return logs[0]
    logs = sorted(logs, key=lambda log: log.begin)
    if is_by_file and not all(after.begin >= before.end for before, after in pairwise(logs)):
        counts = Counter(log.path.stem for log in logs)
        names = [p.stem if counts[p.stem] == 1 else f"{p.parent.name}/{p.stem}" for p in (log.path for log in logs)]
        named = zip(names, logs, strict=True)
        logs = [replace(log, signals={f"{file}.{n}": s for n, s in log.signals.items()}) for file, log in named]
    parts: dict[str, list[Signal]] = {}
    for log in logs:
        for name, signal in log.signals.items():
            group = parts.setdefault(name, [])
            group.append(_in_unit_of(group[0], signal, f"{log.path}: signal '{name}'") if group else signal)
    signals = {}
    for name, group in parts.items():
        times, values = (np.concatenate([getattr(part, cells) for part in group]) for cells in ("times", "values"))
        signals[name] = Signal(times, values, group[0].unit)
    return VehicleLog(logs[0].path, signals, tuple(f"{log.path}: {remark}" for log in logs for remark in log.remarks))


def _in_unit_of(first: Signal, other: Signal, where: str) -> Signal:
    """A piece of a signal, from another file, in the unit of the first."""
    if first.unit == other.unit or "" in (first.unit, other.unit):
        return other
    try:
        return replace(other, values=other.values * units.factor(other.unit, first.unit))
    except InputError:
        message = f"{where} is in '{other.unit}', and in '{first.unit}' in the file before; convert each by its own map"
        raise InputError(message, "unit", "unit") from None


def euler_angles(x: Any, y: Any, z: Any, w: Any) -> tuple[Any, Any, Any]:
    """Roll, pitch and yaw of quaternions, rad."""
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x**2 + y**2))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    return roll, pitch, np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y**2 + z**2))


def library(name: str, path: Path, package: str = "") -> ModuleType:
    """A module of an optional library, or package; InputError with the command of pip if that is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        is_missing = isinstance(error, ModuleNotFoundError) and (error.name or "").startswith(name.partition(".")[0])
        package = package or name.partition(".")[0]
        message = f"{path}: reading this kind of log needs the library {package}{'' if is_missing else f' ({error})'}: "
        message += f"pip install 'bayesub[logs]', or pip install {package}"
        raise InputError(message, "install", package) from None
