"""From the signals of a vehicle's log to the columns of ours, by a map."""

import re
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain, pairwise
from pathlib import Path

import numpy as np

from bayesub.io import units
from bayesub.io.errors import InputError, nearest
from bayesub.io.terminal import SILENT, Progress
from bayesub.io.units import TURN
from bayesub.logs import log_files
from bayesub.logs.columns import marks
from bayesub.logs.log_map import ColumnSection, LogMap, TimeSection
from bayesub.logs.readers.rows import BACKWARDS_S
from bayesub.logs.readers.signals import Signal, VehicleLog
from bayesub.logs.series import HEADINGS

# Seconds after which clocks wrap: a minute, hour, half a day, day and week, counts of 16 and 32 bits in ms and us.
WRAPS = (60.0, 3600.0, 43200.0, 86400.0, 604800.0, 65.536, 4294967.296, 4294.967296)
OUT_OF_ORDER = 0.2  # share of the rows that are earlier than the row before, beyond which they have no order
LATEST_S = 5.0  # before the end of a part; what is stamped earlier has come
TICK_S = 1e-6  # resolution of the times that are written
HOLD_S = 1e-3  # an order that is held changes within this time
REPEAT_S = 0.5  # and is written this often at least, so that it does not take over the pauses of others


@dataclass(frozen=True)
class Column:
    """A column before it is written."""

    times: np.ndarray  # (n,) ascending, s of the file's clock
    values: np.ndarray  # (n,) in the unit of the column
    section: ColumnSection  # how it was made


@dataclass(frozen=True)
class Conversion:
    """A converted log, or a part of it."""

    zero: float  # time of the file's clock that became 0 s
    times: np.ndarray  # (n,) s from zero, of the rows
    readings: dict[str, Column]  # column -> its readings, each at its own time; of a part also some before and after it
    remarks: tuple[str, ...]  # what was left out, column by column; the last part has those of all

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """Column -> (n,) cells in its unit; not a number where there is none."""
        return {name: self.cells(name) for name in self.readings}

    def cells(self, name: str, rows: slice = slice(None)) -> np.ndarray:
        """Those of a column in its unit, of some rows."""
        column, at = self.readings[name], np.round(self.times[rows] / TICK_S)
        if not len(at):
            return at
        ends = self.zero + at[[0, -1]] * TICK_S + np.array([-0.5, 0.5]) * TICK_S
        first, last = np.searchsorted(column.times, ends)
        near = slice(max(first - 1, 0), last + 1)
        instants = np.append(-np.inf, np.round((column.times[near] - self.zero) / TICK_S))
        place = np.searchsorted(instants, at, "right") - 1
        known = column.section.held | (instants[place] == at)
        return np.where(known, np.append(np.nan, column.values[near])[place], np.nan)

    def save(self, path: Path, progress: Progress = SILENT) -> None:
        """Write the log as CSV (:func:`bayesub.logs.log_files.write_columns`)."""
        save(path, [self], progress)


def save(
    path: Path, parts: Iterable[Conversion], progress: Progress = SILENT
) -> tuple[Conversion, dict[str, tuple[int, float, float]]]:
    """Write a log as CSV part by part; the last part, and column -> number of cells, smallest and largest."""
    extents: dict[str, tuple[int, float, float]] = {}
    last = list[Conversion]()

    def tables():
        for part in parts:
            last[:] = [part]
            for k in range(0, len(part.times), log_files.CHUNK):
                rows, table = slice(k, k + log_files.CHUNK), {}
                for name in ("time_s", *part.readings):
                    cells = part.times[rows] if name == "time_s" else part.cells(name, rows)
                    n, least, most = extents.get(name, (0, np.inf, -np.inf))
                    n += int(np.isfinite(cells).sum())
                    extents[name] = n, np.fmin.reduce(cells, initial=least), np.fmax.reduce(cells, initial=most)
                    header = log_files.HEADERS.get(log_files.COLUMNS.get(name, (name,))[0], name)
                    table[header] = cells * (log_files.si_factor(name) / log_files.si_factor(header))
                progress.update(k / 1e6, len(part.times) / 1e6, "million rows")
                yield table

    log_files.write_columns(path, tables())
    return last[0], extents


def convert(log: VehicleLog, log_map: LogMap, source: Path) -> Conversion:
    """Make the columns that a map asks for, each reading at its own time.

    Messages name its file, `source`. An InputError is raised for a signal that the log does not have, units that do not
    fit, a clock that was set, and columns without a time in common.
    """
    return next(in_parts([log], log_map, source))


def in_parts(logs: Iterable[VehicleLog], log_map: LogMap, source: Path) -> Iterator[Conversion]:
    """The columns of a log that comes in parts, as :func:`convert` makes them, also in parts.

    A part ends before what a later part may still change: readings out of order, mean values, the end of a pause.
    """
    streams, zero, done = dict[str, _Stream](), np.nan, -np.inf
    for log, following in pairwise(chain(logs, [None])):
        assert log is not None
        streams = streams or _streams(log, log_map, source)
        for stream in streams.values():
            stream.add(log, np.inf if following is None else log.end - LATEST_S)
        if np.isnan(zero):
            first = np.fmin.reduce([stream.first for stream in streams.values()])
            zero = first if log_map.time.zero == "first" else log_map.time.zero
        for stream in streams.values():
            stream.trim(zero, log_map.time)
            if following is None:
                stream.check(zero, source, log.path)
        if following is None:
            _check_times(streams, zero, log.path)
        upto = np.round((min(stream.limit for stream in streams.values()) - HOLD_S - zero) / TICK_S)
        rows = _rows([stream.column for stream in streams.values()], zero, done, upto)
        remarks = (f"{name}: {remark}" for name, stream in streams.items() for remark in stream.remarks())
        readings = {name: stream.column for name, stream in streams.items()}
        yield Conversion(zero, rows * TICK_S, readings, () if following else tuple(remarks))
        done = rows[-1] if len(rows) else done
        for stream in streams.values():
            stream.forget(zero + upto * TICK_S)


def _check_times(streams: dict[str, "_Stream"], zero: float, path: Path) -> None:
    """InputError for columns that span more than a year, or have no time in common."""
    last = max(streams, key=lambda name: streams[name].end)
    span = streams[last].end - min(stream.begin for stream in streams.values())
    if span > log_files.LONGEST:
        message = f"{path}: '{streams[last].section.signal}' ends {span:.3g} s after the first reading, more than "
        message += "a year; give [time] unit, or cut off a damaged stamp by start_s and end_s"
        raise InputError(message, "data", "time")
    # An order that is held lasts to the end.
    ends = {name: np.inf if stream.section.held else stream.end for name, stream in streams.items()}
    late, early = max(streams, key=lambda name: streams[name].begin), min(ends, key=lambda name: ends[name])
    if streams[late].begin > ends[early]:
        message = f"{path}: '{late}' and '{early}' have no time in common: '{early}' ends "
        message += f"{ends[early] - zero:.6g} s and '{late}' begins {streams[late].begin - zero:.6g} s after "
        message += f"{zero:.12g}; are their clocks different? "
        raise InputError(message + "delay_s of a column shifts it, [time.tables.NAME] names another", "conflict", late)


def _streams(log: VehicleLog, log_map: LogMap, source: Path) -> dict[str, "_Stream"]:
    """Column -> what makes it, of those whose signals the log has."""
    streams = {}
    for name, section in log_map.columns.items():
        if section.signal in log.signals:
            streams[name] = _Stream(name, section, f"{source}: key 'columns.{name}': ")
        elif not section.optional:
            why = next((f": {remark}" for remark in log.remarks if remark.startswith(f"'{section.signal}'")), "")
            suggestion = why or _likely(name, section.signal, log.signals)
            message = f"{source}: key 'columns.{name}.signal': {log.path} has no signal '{section.signal}'{suggestion}"
            raise InputError(message, "unknown", f"columns.{name}.signal")
    if not streams:
        message = f"{source}: {log.path} has none of the signals of this map; it has {_few(log.signals)}"
        raise InputError(message, "unknown", "columns")
    return streams


def _likely(column: str, signal: str, signals: Iterable[str]) -> str:
    """The signal that a name may mean, in words: one whose field is the same, or has the word of the column."""
    ends = {name: re.split(r"[./]", name)[-1].lower() for name in (signal, *signals)}
    same = [name for name in signals if ends[name] == ends[signal]]
    if len(parts := [name for name in signals if name.endswith(f".{signal}")]) > 1:
        return f": is it '{parts[0]}' or '{parts[1]}'? Pieces of one log must not overlap in time; cut one if they are"
    same = same or [name for name in signals if column.partition("_")[0] in ends[name]]
    return nearest(signal, same or signals) or (f": did you mean '{same[0]}'?" if same else f"; it has {_few(signals)}")


def _few(signals: Iterable[str]) -> str:
    names = sorted(signals)
    return ", ".join(names[:6]) + (f" and {len(names) - 6} more (bayesub convert --list)" if len(names) > 6 else "")


class _Stream:
    """A column that is made of one part of a log after the other."""

    def __init__(self, name: str, section: ColumnSection, where: str):
        self.name, self.section, self.where, none = name, section, where, np.zeros(0)
        self.turn = TURN / log_files.si_factor(name) if log_files.short_name(name) in HEADINGS else 0.0
        self.counts, self.n, self.n_kept = Counter[str](), 0, 0  # remark -> how often, of how many readings
        self.rest, self.made = (none, none), (none, none)  # readings of later, and those in the unit of the column
        self.previous, self.last, self.angle = none, -np.inf, none  # stamp in the file, time and angle before these
        self.anchor, self.limit = np.nan, -np.inf  # first time, from which intervals count; up to which all are made
        self.sizes = np.zeros(2)  # readings of which means are made, and means
        self.first, self.begin, self.end = np.nan, np.inf, -np.inf  # time of the first, and of those in start .. end
        self.column = Column(none, none, section)  # readings that are not yet written, and the last that is

    def add(self, log: VehicleLog, until: float) -> None:
        """Make the readings of a part up to a time (s); those after it wait for the next."""
        section, signal = self.section, log.signals.get(self.section.signal, Signal(self.rest[0][:0], self.rest[1][:0]))
        times, values = signal.times - section.delay_s if section.delay_s else signal.times, signal.values
        usable = np.isfinite(times) & np.isfinite(values)
        self.n += len(values)
        self.counts["{n} of {of} values of '{signal}' are not numbers and left out"] += int((~usable).sum())
        if section.valid is not None or section.missing:
            least, most = section.valid or (-np.inf, np.inf)
            inside = (values >= least) & (values <= most)
            for mark in section.missing:
                inside &= ~np.isclose(values, mark, rtol=1e-6, atol=0.0)
            outside = int((usable & ~inside).sum())
            self.counts["{n} of {of} values of '{signal}' are not valid and left out"] += outside
            usable &= inside
        if not usable.all():
            times, values = times[usable], values[usable]
        self.n_kept += len(values)
        is_control = self.name in log_files.CONTROL_COLUMNS or log_files.short_name(self.name) not in log_files.HEADERS
        for mark, often in marks(values, 360.0 if self.turn else 0.0, usual=is_control).items():
            remark = f"{mark:.12g} stands for no reading in {{n}} of {{kept}} values of '{{signal}}'? "
            remark += f"missing = [{mark:.12g}] under [columns.{self.name}] leaves them out"
            self.counts[remark] += often
        times, values = self._in_order(times, values, until, log)
        if section.interval_s is None:
            self.limit = until - section.delay_s
            ready = times <= self.limit
        else:
            self.anchor = times[0] if np.isnan(self.anchor) and len(times) else self.anchor
            n = np.floor((until - section.delay_s - self.anchor) / section.interval_s)
            self.limit = np.fmin(until - section.delay_s, self.anchor + (n - 1e-6) * section.interval_s)
            ready = times < self.limit
        self.rest, times, values = (times[~ready], values[~ready]), times[ready], values[ready]
        new = np.diff(times, prepend=self.last) >= TICK_S
        self.last = np.append(self.last, times)[-1]
        self.counts["{n} stamps of '{signal}' are repeated; the first reading counts"] += int((~new).sum())
        if not new.any():
            return
        times, values = (times, values) if new.all() else (times[new], values[new])
        values = _in_unit(self.name, section, signal.unit, values, self.where)
        if section.interval_s is not None:
            times, values = self._thinned(times, values, section.interval_s)
        self.first = np.fmin(self.first, times[0])
        self.made = np.append(self.made[0], times), np.append(self.made[1], values)

    def _in_order(
        self, times: np.ndarray, values: np.ndarray, until: float, log: VehicleLog
    ) -> tuple[np.ndarray, np.ndarray]:
        """Readings (n,) of before and of a part by ascending times."""
        steps = np.diff(np.append(self.previous, times))
        if np.isnan(self.first) and until == np.inf and len(steps) > 1 and (steps <= 0.0).all() and steps.any():
            self.counts["the stamps of '{signal}' fall from row to row; the rows are turned round"] = 1
            times, values, steps = times[::-1], values[::-1], -steps[::-1]
        for k in np.flatnonzero(steps < -BACKWARDS_S)[:1]:
            after = times[k + len(times) - len(steps)]
            message = f"{log.path}: the time stamps of '{self.section.signal}' go back from {after - steps[k]:.12g} to "
            apart = next((remark for remark in log.remarks if "apart; where" in remark), "")
            raise InputError(f"{message}{after:.12g} s: {apart or _why_back(steps)}", "data", self.section.signal)
        self.previous = times[-1:] if len(times) else self.previous
        if len(self.rest[0]):
            times, values = np.append(self.rest[0], times), np.append(self.rest[1], values)
        self.counts["{n} stamps of '{signal}' were out of order and are sorted"] += int((steps < 0).sum())
        if (np.diff(times) < 0).any():
            order = np.argsort(times, kind="stable")
            times, values = times[order], values[order]
        return times, values

    def _thinned(self, times: np.ndarray, values: np.ndarray, interval: float) -> tuple[np.ndarray, np.ndarray]:
        """The first of the readings (n,) in each interval (s), or their means."""
        _, first = np.unique(np.floor((times - self.anchor) / interval + 1e-6), return_index=True)
        if not self.section.average:
            return times[first], values[first]
        size = np.diff(first, append=len(times))
        if self.turn:
            values = np.unwrap(np.append(self.angle, values), period=self.turn)[len(self.angle) :]
            self.angle = values[-1:]
        self.sizes += np.sum(size), len(size)
        values = np.add.reduceat(values, first) / size
        times = times[0] + np.add.reduceat(times - times[0], first) / size
        return times, np.mod(values, TURN / log_files.si_factor(self.name)) if self.section.wrap else values

    def trim(self, zero: float, time: TimeSection) -> None:
        """Keep what is made between start and end of the map; an order that is held begins with the last one before."""
        times, values = self.made
        start = -np.inf if time.start_s is None else zero + time.start_s
        end = np.inf if time.end_s is None else zero + time.end_s
        first, last = np.searchsorted(times, start, "left"), np.searchsorted(times, end, "right")
        if self.section.held and first > 0:
            first -= 1
            times = np.maximum(times, start)
        times, values = times[first:last], values[first:last]
        if len(times):
            self.begin, self.end = min(self.begin, times[0]), times[-1]
        column, self.made = self.column, (times[:0], values[:0])
        self.column = Column(np.append(column.times, times), np.append(column.values, values), self.section)

    def check(self, zero: float, source: Path, path: Path) -> None:
        """InputError if there were no readings at all, or none that the map keeps."""
        if np.isnan(self.first):
            message = f"{self.where}'{self.section.signal}' of {path} has no readings: its values are not numbers or "
            raise InputError(message + "not valid", "data", f"columns.{self.name}")
        if self.end == -np.inf:
            message = f"{source}: section 'time': no reading of '{self.name}' from {path} lies between start_s and "
            message += f"end_s; it has {self.first - zero:.6g} to {self.last - zero:.6g} s after the zero {zero:.12g}"
            raise InputError(message, "data", "time")

    def forget(self, time: float) -> None:
        """Leave out readings before the last one up to a time (s), which are written."""
        first, column = max(np.searchsorted(self.column.times, time, "right") - 1, 0), self.column
        self.column = Column(column.times[first:], column.values[first:], self.section)

    def remarks(self) -> Iterator[str]:
        """What was left out, in words."""
        for remark, n in self.counts.items():
            if n:
                yield remark.format(n=n, of=self.n, kept=self.n_kept, signal=self.section.signal)
        if self.sizes[1]:
            size = self.sizes[0] / self.sizes[1]
            share = f"independent noise is {size**-0.5:.2g} times that of one"
            yield f"a cell is the mean of {size:.3g} readings, whose {share}"


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


def _rows(columns: list[Column], zero: float, after: float, upto: float) -> np.ndarray:
    """The times (n,) of all columns in ascending order after one and up to another, in ticks from zero.

    Orders that are held have some of their own.
    """
    rows, befores = np.zeros(0), []
    for column in columns:
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
    return rows[(rows > after) & (rows <= upto)]
