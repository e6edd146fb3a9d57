"""From the signals of a vehicle's log to the columns of ours, by a map."""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from bayesub.io import units
from bayesub.io.errors import InputError, nearest
from bayesub.io.terminal import SILENT, Progress
from bayesub.io.units import TURN
from bayesub.logs import log_files
from bayesub.logs.columns import marks
from bayesub.logs.log_map import ColumnSection, LogMap
from bayesub.logs.readers.signals import Signal, VehicleLog
from bayesub.logs.series import HEADINGS

BACKWARDS_S = 1.0  # a clock that goes back by more was set; by less, messages overtook one another
# Seconds after which clocks wrap: a minute, hour, half a day, day and week, counts of 16 and 32 bits in ms and us.
WRAPS = (60.0, 3600.0, 43200.0, 86400.0, 604800.0, 65.536, 4294967.296, 4294.967296)
OUT_OF_ORDER = 0.2  # share of the rows that are earlier than the row before, beyond which they have no order
TICK_S = 1e-6  # resolution of the times that are written
HOLD_S = 1e-3  # an order that is held changes within this time
REPEAT_S = 0.5  # and is written this often at least, so that it does not take over the pauses of others


@dataclass(frozen=True)
class Column:
    """A column before it is written."""

    times: np.ndarray  # (n,) ascending, s of the file's clock
    values: np.ndarray  # (n,) in the unit of the column
    section: ColumnSection  # how it was made
    remarks: tuple[str, ...]  # what was left out


@dataclass(frozen=True)
class Conversion:
    """A converted log."""

    zero: float  # time of the file's clock that became 0 s
    times: np.ndarray  # (n,) s from zero, of the rows
    readings: dict[str, Column]  # column -> its readings, each at its own time
    remarks: tuple[str, ...]  # what was left out, column by column

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """Column -> (n,) cells in its unit; not a number where there is none."""
        return {name: self.cells(name) for name in self.readings}

    def cells(self, name: str, rows: slice = slice(None), factor: float = 1.0) -> np.ndarray:
        """Those of a column in its unit, times a factor; by parts of the rows a long log is not held twice."""
        column, at = self.readings[name], np.round(self.times[rows] / TICK_S)
        ends = self.zero + at[[0, -1]] * TICK_S + np.array([-0.5, 0.5]) * TICK_S
        first, last = np.searchsorted(column.times, ends)
        near = slice(max(first - 1, 0), last + 1)
        instants = np.round((column.times[near] - self.zero) / TICK_S)
        place = np.searchsorted(instants, at, "right") - 1
        known = place >= 0 if column.section.held else (place >= 0) & (instants[place] == at)
        return factor * np.where(known, column.values[near][place], np.nan)

    def save(self, path: Path, progress: Progress = SILENT) -> None:
        """Write the log as CSV (:func:`bayesub.logs.log_files.write_columns`)."""
        cells: dict[str, Callable[[slice], np.ndarray]] = {"time_s": self.times.__getitem__}
        for name in self.readings:
            header = log_files.HEADERS.get(log_files.COLUMNS.get(name, (name,))[0], name)
            factor = log_files.si_factor(name) / log_files.si_factor(header)
            cells[header] = partial(self.cells, name, factor=factor)
        log_files.write_columns(path, cells, len(self.times), progress)


def convert(log: VehicleLog, log_map: LogMap, source: Path) -> Conversion:
    """Make the columns that a map asks for, each reading at its own time.

    Messages name its file, `source`. An InputError is raised for a signal that the log does not have, units that do not
    fit, a clock that was set, and columns without a time in common.
    """
    columns, apart = {}, next((remark for remark in log.remarks if "apart; where" in remark), "")
    for name, section in log_map.columns.items():
        where, key = f"{source}: key 'columns.{name}", f"columns.{name}.signal"
        if section.signal in log.signals:
            columns[name] = _column(name, section, log.signals[section.signal], f"{where}': ", log.path, apart)
        elif not section.optional:
            why = next((f": {remark}" for remark in log.remarks if remark.startswith(f"'{section.signal}'")), "")
            suggestion = why or _likely(name, section.signal, log.signals)
            message = f"{where}.signal': {log.path} has no signal '{section.signal}'{suggestion}"
            raise InputError(message, "unknown", key)
    if not columns:
        message = f"{source}: {log.path} has none of the signals of this map; it has {_few(log.signals)}"
        raise InputError(message, "unknown", "columns")
    first = min(column.times[0] for column in columns.values())
    zero = first if log_map.time.zero == "first" else log_map.time.zero
    columns = {name: _trim(name, column, zero, log_map, source, log.path) for name, column in columns.items()}
    last = max(columns, key=lambda name: columns[name].times[-1])
    span = columns[last].times[-1] - min(column.times[0] for column in columns.values())
    if span > log_files.LONGEST:
        message = f"{log.path}: '{columns[last].section.signal}' ends {span:.3g} s after the first reading, more than "
        message += "a year; give [time] unit, or cut off a damaged stamp by start_s and end_s"
        raise InputError(message, "data", "time")
    # An order that is held lasts to the end.
    ends = {name: np.inf if column.section.held else column.times[-1] for name, column in columns.items()}
    late, early = max(columns, key=lambda name: columns[name].times[0]), min(ends, key=lambda name: ends[name])
    if columns[late].times[0] > ends[early]:
        message = f"{log.path}: '{late}' and '{early}' have no time in common: '{early}' ends "
        message += f"{ends[early] - zero:.6g} s and '{late}' begins {columns[late].times[0] - zero:.6g} s after "
        message += f"{zero:.12g}; are their clocks different? "
        raise InputError(message + "delay_s of a column shifts it, [time.tables.NAME] names another", "conflict", late)
    remarks = tuple(f"{name}: {remark}" for name, column in columns.items() for remark in column.remarks)
    return Conversion(zero, _rows(columns, zero), columns, remarks)


def _likely(column: str, signal: str, signals: Iterable[str]) -> str:
    """The signal that a name may mean, in words: one whose field is the same, or has the word of the column."""
    ends = {name: re.split(r"[./]", name)[-1].lower() for name in (signal, *signals)}
    same = [name for name in signals if ends[name] == ends[signal]]
    if len(parts := [name for name in signals if name.endswith(f".{signal}")]) > 1:
        return f": is it '{parts[0]}' or '{parts[1]}'? Pieces of one log must not overlap in time; cut one if they are"
    same = same or [name for name in signals if column.partition("_")[0] in ends[name]]
    suggestion = nearest(signal, same or signals)
    return suggestion or (f": did you mean '{same[0]}'?" if same else f"; it has {_few(signals)}")


def _few(signals: Iterable[str]) -> str:
    names = sorted(signals)
    return ", ".join(names[:6]) + (f" and {len(names) - 6} more (bayesub convert --list)" if len(names) > 6 else "")


def _column(name: str, section: ColumnSection, signal: Signal, where: str, path: Path, apart: str) -> Column:
    """The readings of a column by ascending times, in its unit; `apart` says what tells boats apart, if anything."""
    remarks = []
    times, values = signal.times - section.delay_s if section.delay_s else signal.times, signal.values
    usable = np.isfinite(times) & np.isfinite(values)
    if n := np.count_nonzero(~usable):
        remarks.append(f"{n} of {len(values)} values of '{section.signal}' are not numbers and left out")
    if section.valid is not None or section.missing:
        least, most = section.valid or (-np.inf, np.inf)
        inside = (values >= least) & (values <= most)
        for mark in section.missing:
            inside &= ~np.isclose(values, mark, rtol=1e-6, atol=0.0)
        if n := np.count_nonzero(usable & ~inside):
            remarks.append(f"{n} of {len(values)} values of '{section.signal}' are not valid and left out")
        usable &= inside
    if not usable.all():
        times, values = times[usable], values[usable]
    if not len(times):
        message = f"{where}'{section.signal}' of {path} has no readings: its values are not numbers or not valid"
        raise InputError(message, "data", f"columns.{name}")
    short = log_files.short_name(name)
    is_control = name in log_files.CONTROL_COLUMNS or short not in log_files.HEADERS
    for mark, often in marks(values, 360.0 if short in HEADINGS else 0.0, usual=is_control).items():
        remark = f"{mark:.12g} stands for no reading in {often} of {len(values)} values of '{section.signal}'?"
        remarks.append(f"{remark} missing = [{mark:.12g}] under [columns.{name}] leaves them out")
    steps = np.diff(times)
    if len(steps) > 1 and (steps <= 0.0).all() and steps.any():
        remarks.append(f"the stamps of '{section.signal}' fall from row to row; the rows are turned round")
        times, values, steps = times[::-1], values[::-1], -steps[::-1]
    for k in np.flatnonzero(steps < -BACKWARDS_S)[:1]:
        message = f"{path}: the time stamps of '{section.signal}' go back from {times[k]:.12g} to {times[k + 1]:.12g} "
        message += f"s: {apart or _why_back(steps)}"
        raise InputError(message, "data", section.signal)
    if n := np.count_nonzero(steps < 0):
        remarks.append(f"{n} stamps of '{section.signal}' were out of order and are sorted")
        order = np.argsort(times, kind="stable")
        times, values = times[order], values[order]
    new = np.diff(times, prepend=-np.inf) >= TICK_S
    if n := np.count_nonzero(~new):
        remarks.append(f"{n} stamps of '{section.signal}' are repeated; the first reading counts")
        times, values = times[new], values[new]
    values = _in_unit(name, section, signal.unit, values, where)
    if section.interval_s is not None:
        _, first = np.unique(np.floor((times - times[0]) / section.interval_s + 1e-6), return_index=True)
        if section.average:
            turn, size = TURN / log_files.si_factor(name), np.diff(first, append=len(times))
            values = np.unwrap(values, period=turn) if short in HEADINGS else values
            values = np.add.reduceat(values, first) / size
            times = times[0] + np.add.reduceat(times - times[0], first) / size
            values = np.mod(values, turn) if section.wrap else values
            share = f"independent noise is {np.mean(size) ** -0.5:.2g} times that of one"
            remarks.append(f"a cell is the mean of {np.mean(size):.3g} readings, whose {share}")
        else:
            times, values = times[first], values[first]
    return Column(times, values, section, tuple(remarks))


def _why_back(steps: np.ndarray) -> str:
    """Why a clock with these steps (n,) goes back, in words: it wraps if it always goes back as far, or by WRAPS."""
    back = np.flatnonzero(steps < -BACKWARDS_S)
    if len(back) > OUT_OF_ORDER * len(steps):
        return f"{len(back)} of {len(steps) + 1} rows are earlier than the row before; sort them by time"
    jumps = np.median(steps[steps > 0]) - steps[back] if (steps > 0).any() else -steps[back]
    period = next((wrap for wrap in WRAPS if np.allclose(jumps, wrap, rtol=0.02)), float(np.median(jumps)))
    if period in WRAPS or (len(back) > 1 and np.allclose(jumps, period, rtol=0.02)):
        line = f"wraps_every_s = {float(f'{period:.3g}') if period not in WRAPS else period:.12g}"
        return f"its clock seems to begin again every {period:.6g} s; write {line} under [time] of the map"
    words = "its clock was set, or another run begins; cut the file there, take a signal with another clock, or keep "
    return words + "one run by where (--list names a column for it)"


def _in_unit(name: str, section: ColumnSection, unit: str, values: np.ndarray, where: str) -> np.ndarray:
    """Values of a signal (n,) in the unit of the column."""
    target = units.of_column(name)
    if section.points is not None:
        inputs, outputs = np.array(section.points).T
        for value in values[(values < inputs[0]) | (values > inputs[-1])][:1]:
            message = f"{where}points reach from {inputs[0]:g} to {inputs[-1]:g}, and '{section.signal}' goes to "
            message += f"{value:g}; add a point, or say with valid what is no reading"
            raise InputError(message, "conflict", f"columns.{name}.points")
        values = np.interp(values, inputs, outputs)
    elif section.zero or section.factor:
        values = (values - section.zero) * (section.factor or 1.0)
    has_rule = section.points is not None or section.factor is not None
    unit = section.unit or ("" if has_rule else unit)
    if target and not has_rule and not section.unit and not units.known(unit):
        says = f"says '{unit}', which is not known, for" if unit else "does not say"
        message = f"{where}the file {says} the unit of '{section.signal}'; give unit = \"{target}\" or another, "
        raise InputError(message + "or factor", "unit" if unit else "missing", f"columns.{name}.unit")
    if unit and target:
        try:
            factor = units.factor(unit, target, section.water_density_kgm3)
            values = values if factor == 1.0 else values * factor
        except InputError as error:
            raise InputError(f"{where}{error}", error.kind, f"columns.{name}.{error.key}") from None
    if section.sign < 0 or section.offset:
        values = section.sign * values + section.offset
    return np.mod(values, TURN / log_files.si_factor(name)) if section.wrap else values


def _trim(name: str, column: Column, zero: float, log_map: LogMap, source: Path, path: Path) -> Column:
    """The column between start and end of the map; an order that is held begins with the last one before."""
    time, times = log_map.time, column.times
    start = -np.inf if time.start_s is None else zero + time.start_s
    end = np.inf if time.end_s is None else zero + time.end_s
    first, last = np.searchsorted(times, start, "left"), np.searchsorted(times, end, "right")
    if column.section.held and 0 < first <= len(times) and (first == len(times) or times[first] > start):
        first -= 1
        times = np.maximum(times, start)
    if first >= last:
        message = f"{source}: section 'time': no reading of '{name}' from {path} lies between start_s and end_s; it "
        message += f"has {times[0] - zero:.6g} to {times[-1] - zero:.6g} s after the zero {zero:.12g}"
        raise InputError(message, "data", "time")
    return replace(column, times=times[first:last], values=column.values[first:last])


def _rows(columns: dict[str, Column], zero: float) -> np.ndarray:
    """The times (n,) of all columns in ascending order, s from zero; orders that are held have some of their own."""
    rows, befores = np.zeros(0), []
    for column in columns.values():
        instants = np.round((column.times - zero) / TICK_S)
        rows = rows if np.array_equal(rows, instants) else np.union1d(rows, instants)
        if column.section.held:  # the last moment of the order before
            changes = np.flatnonzero(np.diff(column.values)) + 1
            gaps = instants[changes] - instants[changes - 1]
            befores.append(instants[changes] - np.minimum(np.round(HOLD_S / TICK_S), np.ceil(gaps / 2)))
    if befores:
        rows, repeat = np.union1d(rows, np.concatenate(befores)), round(REPEAT_S / TICK_S)
        pauses = np.flatnonzero(np.diff(rows) > repeat)
        rows = np.unique(np.concatenate([rows, *(np.arange(rows[k], rows[k + 1], repeat) for k in pauses)]))
    return rows * TICK_S
