"""Tables, as Parquet or in text of any separator, names and units, decimal points or commas and times."""

import codecs
import io
import itertools
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from bayesub.io import units
from bayesub.io.errors import InputError, check_known
from bayesub.io.terminal import SILENT, Progress
from bayesub.logs.log_map import Clock, LogMap
from bayesub.logs.readers import rows, stamps
from bayesub.logs.readers.signals import Signal, VehicleLog, library

SEPARATORS = "\t;|, "  # a space is any number of them
COMMENTS = ("#", "%", "//")
SAMPLE = 20  # lines at the end of the first block that tell how cells are separated
TIMES = ["time_s", "time", "t", "timestamp", "time_ms", "time_us", "utc", "datetime", "date_time", "seconds"]
TIMES += ["zeit", "uhrzeit", "heure", "hora", "tijd"]
DATES, WEEKS = ["date", "datum", "fecha", "utc_date"], ["week", "gps_week", "gpsweek", "gwk", "wn"]
PARTS = [["year", "yyyy"], ["month", "mon"], ["day"], ["hour", "hh"], ["minute", "min"], ["second", "sec", "ss"]]
NANOSECONDS = {"sec": "nanosec", "secs": "nsecs"}  # how names of two columns of one stamp end, in ROS
MOST_WRONG = 0.1  # of the rows, which may be broken or lack a time, and are left out
BLOCK, ROWS = 1 << 22, 65536  # characters and rows that are read at a time

Line = tuple[int, str]  # its number and text
_NUMBER = re.compile(r"[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?")


def _of_windows(fault: Any) -> tuple[str, int]:
    """What bytes that are no UTF-8 are instead, and where they end."""
    return fault.object[fault.start : fault.end].decode("cp1252", errors="replace"), fault.end


codecs.register_error("windows", _of_windows)


def read(path: Path, log_map: LogMap, progress: Progress = SILENT) -> VehicleLog:
    """Read a table with a row for each time, block by block; an empty cell is no reading.

    Only the numbers of columns that the map names are kept, or of all if it names none.
    """
    import pandas as pd

    with path.open("rb") as file:
        is_parquet = file.read(4) == b"PAR1"
    table: _Parquet | _Text = (_Parquet if is_parquet else _Text)(path, progress)
    names, heads, fault, untimed = list[str](), table.heads, None, None
    for k, head in enumerate(heads):
        name, unit = _name_and_unit(head)
        table.units[k] = table.units[k] or unit
        names.append(name if name and name not in names else head or f"column_{k + 1}")
        if names[k] in names[:k]:
            fault = InputError(f"{path}: column '{head}' is given twice; rename one of them", "conflict", head)
            names[k] = f"{head}_{k + 1}"
    wanted = [section.signal.removeprefix(f"{path.stem}.") for section in log_map.columns.values()]
    # A signal is called as the map has it, which may be as the file has it.
    labels = [next((one for one in wanted if _plain(one) == h), n) for h, n in zip(heads, names, strict=True)]
    cells = [rows.Cells(not wanted or label in wanted) for label in labels]
    frames, clock = rows.of_one(path, table.blocks(), names, log_map.where), log_map.time.clock(path.stem)
    used, first, stamped = tuple[int, ...](), next(frames), list[Any]()
    try:
        used = _time_columns(first, names, heads, clock)
    except InputError as error:
        untimed = error.within(str(path))
    for frame in itertools.chain([first], frames):
        stamped.append(frame[list(used)].copy())  # or else it would keep the others
        for k in set(frame) - set(used):
            cells[k].add(frame[k])
    stamp, stamped, remarks = pd.concat(stamped, ignore_index=True), [], [*table.remarks]
    times = np.full(len(stamp), np.nan)
    try:
        if used:
            times, more = _times(stamp, [names[k] for k in used], table.units[used[0]], clock, table.where)
            remarks += more
    except InputError as error:
        untimed = error.within(str(path))
        for k in used:
            cells[k].add(stamp[k])
        used = ()
    fault = fault or table.fault or untimed
    if fault is None:
        begin = rows.first_compared(times)
        is_first = begin + rows.LOOK <= len(first) or len(first) == len(times)
        frames = iter([first]) if is_first else rows.of_one(path, table.blocks(), names, log_map.where)
        some = rows.some(frames, begin)
        readings = [stamps.as_numbers(some[k]) for k in some]
        remarks += rows.told_apart(some, names, readings, times[begin : begin + rows.LOOK])
        remarks += rows.times_of_header(names, readings, times)
    timed = np.isfinite(times) | (fault is not None)
    kept = slice(None) if timed.all() else timed
    signals, times = {}, times[kept]
    for k, (label, column) in enumerate(zip(labels, cells, strict=True)):
        remarks += column.remarks(names[k])
        if column.values and not column.is_text:
            values = np.frombuffer(column.values)[kept]
            filled = ~np.isposinf(values)
            if filled.all():
                signals[label] = Signal(times, values, table.units[k])
            else:
                signals[label] = Signal(times[filled], values[filled], table.units[k])
    return VehicleLog(path, signals, tuple(remarks), fault)


class _Parquet:
    """A Parquet file and its cells, block by block."""

    where, remarks, fault = "row {}", (), None

    def __init__(self, path: Path, progress: Progress):
        self.file, self.progress = (
            library("pyarrow.parquet", path).ParquetFile(path, pre_buffer=False, buffer_size=ROWS),
            progress,
        )
        self.heads = [str(name) for name in self._frame(self.file.schema_arrow.empty_table(), 0)]
        self.units = [""] * len(self.heads)

    def _frame(self, part: Any, begin: int) -> Any:
        """Rows from `begin` on as a table of pandas, with the index as a column if it has a name or holds moments."""
        import pandas as pd

        frame = part.to_pandas()
        for index in (self.file.schema_arrow.pandas_metadata or {}).get("index_columns", ()):
            if isinstance(index, dict):  # a range, of all rows
                whole = pd.RangeIndex(index["start"], index["stop"], index["step"], name=index["name"])
                frame.index = whole[begin : begin + len(frame)]
        if frame.index.name is not None or frame.index.dtype.kind in "Mm":
            frame = frame.reset_index(names=frame.index.name or "time")
        return frame

    def blocks(self) -> Iterator[Any]:
        """Tables of pandas with columns 0, 1, .."""
        begin, n = 0, self.file.metadata.num_rows
        for batch in self.file.iter_batches(ROWS):
            yield self._frame(batch, begin).set_axis(range(len(self.heads)), axis=1)
            begin += len(batch)
            self.progress.update(begin / 1e6, n / 1e6, "million rows")


class _Text:
    """A table in text, of which the first block of lines shows the form, and its cells, block by block."""

    def __init__(self, path: Path, progress: Progress):
        self.path, self.progress, self.remarks = path, progress, list[str]()
        self.fault: InputError | None = None
        with path.open("rb") as file:
            begin = file.read(4096)
        wide = {begin[0::2].count(0): "utf-16-be", begin[1::2].count(0): "utf-16-le"}
        self.encoding = "utf-16" if begin.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig"
        if self.encoding == "utf-8-sig" and max(wide) > 0.8 * len(begin) / 2 and min(wide) < 0.1 * len(begin):
            self.encoding = wide[max(wide)]
        elif self.encoding == "utf-8-sig" and b"\0" in begin.rstrip(b"\0"):
            message = f"{path}: is not text; bayesub convert --help lists the kinds of logs that are not"
            raise InputError(message, "format")
        lines = next(self._lines(), [])
        table = [(k, line) for k, line in lines if not line.lstrip().startswith(COMMENTS)]
        if len(table) < 2:
            raise InputError(f"{path}: has no rows; expected a line of names and lines of numbers", "data")
        before = [(k, _plain(line)) for k, line in lines if k < table[0][0]]
        table = before[-1:] + table  # names may stand in a comment
        self.separator, self.n = _layout(path, [line for _, line in table[-SAMPLE:]])
        self.heads, self.units, first = _header(path, table, self.separator, self.n)
        self.first, row = table[first]
        self.where = f"row {{}} from line {self.first}"
        self.decimal = "," if self.separator != "," and "," in row else "."
        self.is_quoted = any('"' in line for _, line in table[first : first + SAMPLE])  # as separators may be

    def _lines(self) -> Iterator[list[Line]]:
        """Number and text of the lines that are not empty."""
        n, size, last = 0, self.path.stat().st_size, ""
        with self.path.open("rb") as content, io.TextIOWrapper(content, self.encoding, errors="windows") as file:
            while texts := file.readlines(BLOCK):
                block = [(k, text.rstrip("\n\0")) for k, text in enumerate(texts, n + 1) if text.strip(" \t;,\n\0")]
                if block:
                    yield block
                n, last = n + len(texts), texts[-1]
                self.progress.update(round(content.tell() / 1e6), round(size / 1e6), "MB")
        zeros = "zeros at the end of the file, as a power cut leaves them, are left out"
        self.remarks = [zeros] if last.endswith("\0") else []

    def blocks(self) -> Iterator[Any]:
        """Tables of pandas with columns 0, 1, ..; after the last it is known what is wrong with lines."""
        n_lines, n_wrong, last, message = 0, 0, self.n, ""
        for block in self._lines():
            lines = [(k, line) for k, line in block if k >= self.first and not line.lstrip().startswith(COMMENTS)]
            if self.is_quoted:
                counts = [self.n] * len(lines)
            elif self.separator == " ":
                counts = [len(line.split()) for _, line in lines]
            else:
                counts = [line.count(self.separator) + 1 for _, line in lines]
            whole = [line for (_, line), count in zip(lines, counts, strict=True) if count == self.n]
            if len(whole) < len(lines) and not message:
                k, count = next((k, n) for (k, _), n in zip(lines, counts, strict=True) if n != self.n)
                message = f"line {k}: has {count} cells, expected {self.n}"
            n_lines, n_wrong, last = n_lines + len(lines), n_wrong + len(lines) - len(whole), [last, *counts][-1]
            if whole:
                yield self._cells(whole, lines[0][0])
        if n_wrong - (last < self.n) > MOST_WRONG * n_lines:
            self.fault = InputError(f"{self.path}: {message}; is the file whole?", "format")
        elif n_wrong > (last < self.n):
            self.remarks.append(f"{message}; {n_wrong - (last < self.n)} such lines are left out")
        self.remarks += ["the last line is not whole and left out"] if last < self.n else []

    def _cells(self, lines: list[str], number: int) -> Any:
        """The cells of lines, the first of which has that number in the file."""
        import pandas as pd

        separators = r"\s+" if self.separator == " " else self.separator
        options: dict[str, Any] = {"header": None, "names": range(self.n), "keep_default_na": False, "na_values": [""]}
        options |= {"index_col": False, "skipinitialspace": True, "decimal": self.decimal, "low_memory": False}
        try:
            return pd.read_csv(io.StringIO("\n".join(lines)), sep=separators, **options)
        except pd.errors.ParserError as error:
            reason = str(error).strip().rpartition("error: ")[2]
            message = f"{self.path}: {reason}, counted from line {number}; is the file whole?"
            raise InputError(message, "format") from None


def _plain(text: str) -> str:
    """A line or name without the marks of comments before it."""
    return text.lstrip().lstrip("#%/ ")


def _cells(line: str, separator: str) -> list[str]:
    parts = line.split() if separator == " " else line.split(separator)
    return [part.strip().strip('"') for part in parts]


def _layout(path: Path, lines: list[str]) -> tuple[str, int]:
    """The separator that leaves the most numbers in the last lines, the first of equals, and the number of columns."""
    layouts = {}
    for separator in SEPARATORS:
        rows = [_cells(line, separator) for line in lines]
        ((n_columns, _),) = Counter(len(row) for row in rows).most_common(1)
        numbers = sum(_is_number(cell, separator) for row in rows if len(row) == n_columns for cell in row)
        layouts[separator] = numbers if n_columns > 1 else 0, n_columns
    best = max(layouts, key=lambda separator: layouts[separator][0])
    if not layouts[best][0]:
        message = f"{path}: no columns of numbers, separated by tabs, semicolons, commas or spaces, were made out"
        raise InputError(message, "format")
    return best, layouts[best][1]


def _is_number(cell: str, separator: str) -> bool:
    return _NUMBER.fullmatch(cell) is not None and not (separator == "," and "," in cell)


def _header(path: Path, lines: list[Line], separator: str, n_columns: int) -> tuple[list[str], list[str], int]:
    """Heads and units of the columns, and which of the lines is the first of numbers."""
    rows = [_cells(line, separator) for _, line in lines[:200]]
    whole = [k for k, row in enumerate(rows) if len(row) == n_columns]
    first = next((k for k in whole if any(_is_number(cell, separator) for cell in rows[k])), None)
    if first is None:
        raise InputError(f"{path}: no row of {n_columns} columns with numbers is among its first lines", "format")
    heads = [rows[k] for k in whole if k < first]
    unit_row = [""] * n_columns
    if len(heads) > 1:
        filled = [cell for cell in heads[-1] if cell]
        if filled and all(cell[0] in "[(" or cell == "-" or units.known(cell) for cell in filled):
            unit_row = [cell.strip("[]() ") for cell in heads.pop()]
    return heads[-1] if heads else [""] * n_columns, unit_row, first


def _name_and_unit(cell: str) -> tuple[str, str]:
    """``Depth [m]``, ``Depth (m)``, ``Depth / m`` or ``depth_m`` taken apart; the last keeps its name."""
    match = re.match(r"^(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\)|\s/\s(\S+))\s*$", cell)
    if match:
        return match[1], next((part for part in match.groups()[1:] if part), "").strip()
    end = cell.rpartition("_")[2]
    return cell, units.of_column(cell) if len(end) > 1 or end == "m" else ""


def _time_columns(frame: Any, names: list[str], heads: list[str], clock: Clock) -> tuple[int, ...]:
    """Where the column of times stands, with that of the dates behind it; or those of hours, minutes, .. (PARTS)."""
    places = {head: k for k, head in enumerate(heads)} | {name: k for k, name in enumerate(names)}
    lower = {re.sub(r"\W+", "_", name.lower()): k for name, k in places.items()}

    def given(signal: str, key: str) -> int:
        message = f"has no column '{signal}', the {key} of [time]"
        check_known(_plain(signal), places, message, key=f"time.{key}")
        return places[_plain(signal)]

    parts = [[lower[name] for name in part if name in lower][:1] for part in PARTS]
    ends = [(name.removesuffix(end) + rest, k) for end, rest in NANOSECONDS.items() for name, k in lower.items()]
    split = {k: lower[name] for name, k in ends if name in lower and lower[name] != k}
    likely = [name for name in [*TIMES, *stamps.OF_WEEK] if name in lower] + [name for name in lower if "time" in name]
    if clock.signal is not None:
        time = given(clock.signal, "signal")
    elif likely or split:
        time = lower[likely[0]] if likely else next(iter(split))
    elif all(parts[-3:]):
        return tuple(k for part in parts for k in part)
    elif found := [lower[name] for name in DATES if name in lower]:
        time = found[0]
    else:
        ascends = [name for k, name in enumerate(names) if (np.diff(stamps.as_numbers(frame[k])) > 0).all()]
        some = f'such as signal = "{ascends[0]}", which ascends' if ascends else f"one of {', '.join(names[:8])}"
        message = f"which column is the time? give [time] signal in the map, {some}"
        raise InputError(message, "missing", "time.signal")
    if time in split:
        return time, split[time]
    if clock.date is not None:
        return time, given(clock.date, "date")
    dates = WEEKS if re.sub(r"\W+", "_", names[time].lower()) in stamps.OF_WEEK else DATES
    return time, *[lower[name] for name in dates if name in lower and lower[name] != time][:1]


def _times(parts: Any, names: list[str], unit: str, clock: Clock, where: str) -> tuple[np.ndarray, list[str]]:
    """Time stamps (n,) of the columns that hold them in seconds, not a number where there is none, and remarks."""
    stamp, *dates = (parts[k].rename(name) for k, name in zip(parts, names, strict=True))
    stamp, dates = (_moments(parts), []) if len(dates) > 1 else (stamp, dates)
    if names[-1].lower().endswith(tuple(NANOSECONDS.values())):
        stamp, dates = stamp + 1e-9 * dates[0], []
    times, remark = stamps.seconds(stamp, clock, unit, names[0], *dates)
    remarks, wrong = [remark] if remark else [], np.flatnonzero(~np.isfinite(times))
    if len(wrong):
        text = "an empty cell" if stamp.isna().iloc[wrong[0]] else f"'{stamp.iloc[wrong[0]]}'"
        message = f"{where.format(wrong[0] + 1)}, column '{names[0]}': {text} is not a time"
        if len(wrong) > MOST_WRONG * len(times):
            remedy = "expected numbers, or dates such as 2026-05-01T10:00:00.5; format under [time] says others"
            raise InputError(f"{message}; {remedy}", "data", names[0])
        remarks.append(f"{message}; {len(wrong)} such rows are left out")
    return times, remarks


def _moments(parts: Any) -> Any:
    """Times of the day of columns (PARTS), or dates if all six are there."""
    import pandas as pd

    *days, hour, minute, second = (parts[k] for k in parts)
    clock = pd.to_timedelta(3600 * hour + 60 * minute + second, unit="s")
    if len(days) < 3:
        return clock
    year, month, day = days
    return pd.to_datetime({"year": year.where(year > 99, year + 2000), "month": month, "day": day}) + clock
