"""Tables, as Parquet or in text of any separator, names and units, decimal points or commas and times."""

import csv
import io
import re
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cache
from itertools import chain, pairwise
from pathlib import Path
from typing import Any

import numpy as np

from bayesub.io import units
from bayesub.io.errors import InputError, check_known
from bayesub.io.terminal import SILENT, Progress
from bayesub.logs.log_map import Clock, LogMap
from bayesub.logs.readers import rows, stamps
from bayesub.logs.readers.signals import Signal, VehicleLog, library
from bayesub.logs.readers.stamps import as_numbers, seconds

SEPARATORS = "\t;|, "  # a space is any number of them
COMMENTS = ("#", "%", "//")
UNITLESS, NAMES = ("-", "TS", "RN"), ("timestamp", "lat", "lon")  # in a row of units, and of names though units too
SAMPLE = 20  # lines at the end of the first block that tell how cells are separated
TIMES = ["time_s", "time", "timestamp", "time_ms", "time_us", "utc", "datetime", "date_time", "seconds"]
TIMES += ["zeit", "uhrzeit", "temps", "heure", "tiempo", "hora", "tempo", "tijd", "tid"]
DATES, WEEKS = ["date", "datum", "fecha", "utc_date"], ["week", "gps_week", "gpsweek", "gwk", "wn"]
PARTS = [["year", "yyyy"], ["month", "mon"], ["day"], ["hour", "hh"], ["minute", "min"], ["second", "sec", "ss"]]
PARTS += [["millisecond", "milliseconds", "millis", "msec", "ms"]]
NANOSECONDS = {"sec": "nanosec", "secs": "nsecs"}  # how names of two columns of one stamp end, in ROS
MOST_WRONG = 0.1  # of the rows, which may be broken or lack a time, and are left out
BLOCK, ROWS = 1 << 22, 65536  # characters and rows that are read at a time
PACKED = {b"PK\3\4": "is a workbook or an archive; save it as CSV", b"\x1f\x8b": "is compressed; unpack it"}

# Bytes that are no UTF-8, as Python escapes them -> what they are in Windows.
WINDOWS = {0xDC00 + byte: bytes([byte]).decode("cp1252", errors="replace") for byte in range(128, 256)}
WINDOWS |= {0x2212: "-"}  # the minus of spreadsheets
Line = tuple[int, str]  # its number and text
_NUMBER = re.compile(r"[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?")
_MEASURE = re.compile(rf"{_NUMBER.pattern} ?(?![NSEW]$)(?P<unit>[^\d\s].*)")  # letters alone are sides of the world
_PLACE = re.compile(r"(?i:lat|lon|lng)(?i:g|g?itud(?:es?|ine)?)?(?![a-z])")  # and no latest, lateral or longitudinal
_PART = r"(\d+(?:[.,]\d+)?)"  # of an angle: side of the world or sign, degrees, minutes and seconds or none, side
_ANGLE = re.compile(rf"""(?:([NSEW]) ?|(-))?{_PART}(?:[°:d -]+{_PART})?['′:m -]*(?:{_PART}["″s]*)?°? ?([NSEW])?""")
# What groups digits -> numbers in which it does: 1,234 and 1,234,567.8, or 1.234 and 1.234.567,8.
_GROUPED = {m: re.compile(rf"[-+]?[1-9]\d{{0,2}}(\{m}\d{{3}})+(\{d}\d+)?") for m, d in (",.", ".,")}


def read(path: Path, log_map: LogMap, progress: Progress = SILENT) -> VehicleLog:
    """Read a table with a row for each time, block by block; an empty cell is no reading.

    Only numbers of columns that the map names are kept, or of all if it names none.
    """
    return next(parts(path, log_map, progress))


def parts(path: Path, log_map: LogMap, progress: Progress = SILENT, most: float = np.inf) -> Iterator[VehicleLog]:
    """The log of a table in parts of about `most` rows; what the first shows of its times counts for all.

    The last part has the remarks on all, and possibly a fault.
    """
    import pandas as pd

    with path.open("rb") as file:
        is_parquet = file.read(4) == b"PAR1"
    heads, unit_cells, where, blocks, of_file, faults = (_parquet if is_parquet else _text)(path, progress)
    names: list[str] = []
    for k, head in enumerate(heads):
        name, unit = _name_and_unit(head)
        unit_cells[k] = unit_cells[k] or unit
        names.append(name if name and name not in names else head or f"column_{k + 1}")
        if names[k] in names[:k]:
            faults.append(InputError(f"{path}: column '{head}' is given twice; rename one of them", "conflict", head))
            names[k] = f"{head}_{k + 1}"
    wanted = [section.signal.removeprefix(f"{path.stem}.") for section in log_map.columns.values()]
    # As the map has it, which may be as the file has it.
    labels = [next((one for one in wanted if _plain(one) == h), n) for h, n in zip(heads, names, strict=True)]
    cells = [rows.Cells(not wanted or label in wanted) for label in labels]
    used, clock, stamped, begin, remarks = tuple[int, ...](), log_map.time.clock(path.stem), list[Any](), 0, list[str]()

    def frames():
        return rows.of_one(path, blocks(), names, log_map.where)

    try:
        used = _time_columns(frames(), names, heads, clock)
    except InputError as error:
        faults.append(error.within(str(path)))
    stamp = _Stamps([names[k] for k in used], unit_cells[used[0]] if used else "", clock, where)
    for frame, following in pairwise(chain(frames(), [None])):
        assert frame is not None
        stamped.append(frame[list(used)].copy())  # which does not hold the other columns
        for k in set(frame) - set(used):
            cells[k].add(frame[k])
        if following is not None and sum(map(len, stamped)) < most:
            continue
        some, stamped, noted = pd.concat(stamped, ignore_index=True), [], dict.fromkeys(of_file)
        times = np.full(len(some), np.nan)
        try:
            if used:
                times = stamp.times(some, is_last=following is None)
        except InputError as error:
            faults.append(error.within(str(path)))
            for k in used:
                cells[k].add(some[k])
        fault = faults[0] if faults else None
        if fault is None and (not begin or (np.diff(times) < -rows.BACKWARDS_S).any()):
            remarks += [one for one in rows.compared(frames(), names, times, begin, wanted) if one not in remarks]
        timed = np.isfinite(times) | (fault is not None)
        kept = slice(None) if timed.all() else timed
        signals, begin, times = {}, begin + len(times), times[kept]
        for k, column in enumerate(cells):
            if column.values and not column.is_text:
                values = np.concatenate(column.values)[kept]
                filled = ~np.isposinf(values)
                cut = slice(None) if filled.all() else filled  # columns without empty cells share their times
                signals[labels[k]] = Signal(times[cut], values[cut], unit_cells[k])
            column.values = []
        of_columns = [one for k, column in enumerate(cells) if following is None for one in column.remarks(names[k])]
        yield VehicleLog(path, signals, (*noted, *stamp.remarks, *remarks, *of_columns), fault)


# Heads and units by column, a place in words, the cells in tables of pandas, and remarks and faults, known at the end.
Table = tuple[list[str], list[str], str, Callable[[], Iterator[Any]], list[str], list[InputError]]


def _parquet(path: Path, progress: Progress) -> Table:
    file = library("pyarrow.parquet", path).ParquetFile(path, pre_buffer=False, buffer_size=ROWS)
    if not file.metadata.num_rows:
        raise InputError(f"{path}: has no rows", "data")
    # The index of pandas has no name, and is the time if it holds moments.
    flat = [f for f in file.schema_arrow if not f.type.num_fields]
    fields = [("time" if str(f.type).startswith(("time", "duration")) else "", f.name) for f in flat]
    remarks = [f"'{f.name}' holds {f.type} and is left out" for f in file.schema_arrow if f.type.num_fields]
    heads = [time if time and name.startswith("__index_level_") else name for time, name in fields]

    def blocks():
        n = 0
        for batch in file.iter_batches(ROWS, columns=[f.name for f in flat]):
            yield batch.to_pandas(ignore_metadata=True).set_axis(range(len(heads)), axis=1)
            n += len(batch)
            progress.update(n / 1e6, file.metadata.num_rows / 1e6, "million rows")

    return heads, [""] * len(heads), "row {}", blocks, remarks, []


def _text(path: Path, progress: Progress) -> Table:
    import pandas as pd

    remarks, faults = list[str](), list[InputError]()
    lines = next(_lines(path, remarks, SILENT), [])
    table = [(k, line) for k, line in lines if not line.lstrip().startswith(COMMENTS)]
    if len(table) < 2:
        raise InputError(f"{path}: has no rows; expected a line of names and lines of numbers", "data")
    comments = [(k, _plain(line)) for k, line in lines if k < table[0][0]]
    table = comments[-2:] + table  # of which the last may be names and units
    top_words = [line for _, line in table[:SAMPLE] if not re.search(r"\d", line)]
    separator, n_columns = _layout(path, [line for _, line in table[-SAMPLE:]], top_words)
    heads, unit_cells, first = _header(path, table, separator, n_columns)
    begin = table[first][0]
    above = [(k, _cells(line, separator)) for k, line in lines if k < begin and not line.lstrip().startswith(COMMENTS)]
    if early := [k for k, row in above if sum(_is_number(cell, separator) for cell in row) > 1]:
        message = f"numbers in lines {early[0]} to {early[-1]} stand above the head of the {n_columns} columns"
        remarks.append(f"{message} that are read, and are left out; cut the file below them if they are readings")
    top = [_cells(line, separator) for _, line in table[first:][:200]]
    measured = {k: unit for row in top[::-1] for k, cell in enumerate(row[:n_columns]) if (unit := _unit(cell))}
    unit_cells = [measured.get(k, unit) for k, unit in enumerate(unit_cells)]
    decimal, group = _marks(top, separator)
    options: dict[str, Any] = {"header": None, "names": range(n_columns), "keep_default_na": False, "na_values": [""]}
    options |= {"index_col": False, "skipinitialspace": True, "low_memory": False}
    options |= {"sep": r"\s+" if separator == " " else separator, "decimal": "." if separator == "," else decimal}

    def count(line):
        n = len(line.split()) if separator == " " else line.count(separator) + 1
        return len(_cells(line, separator)) if '"' in line and n != n_columns else n

    def blocks():
        n, last, wrong = 0, 0, list[tuple[int, int]]()
        for block in _lines(path, remarks, progress):
            body = [(k, line) for k, line in block if k >= begin and not line.lstrip().startswith(COMMENTS)]
            counts = [count(line) for _, line in body]
            whole = [line for (_, line), size in zip(body, counts, strict=True) if size == n_columns]
            if len(whole) < len(body):
                wrong += [(k, size) for (k, _), size in zip(body, counts, strict=True) if size != n_columns]
            try:
                if whole:
                    frame = pd.read_csv(io.StringIO("\n".join(whole)), **options)
                    for k in [k for k in measured if frame[k].dtype.kind not in "biuf"]:
                        frame[k] = frame[k].str.replace(rf"(?<=[\d.,]) ?{re.escape(measured[k])}$", "", regex=True)
                    for k in [k for k, head in enumerate(heads) if _PLACE.match(head)]:
                        if k + 1 < n_columns and frame[k + 1].isin(list("NSEWnsew")).all():
                            frame[k] = frame[k].astype(str) + frame[k + 1].str.upper()
                        if frame[k].dtype.kind not in "biuf":  # 33.9 S, 151.2 E
                            frame[k] = frame[k].map(_degrees, na_action="ignore")
                    for k in [k for k in frame if group and frame[k].dtype.kind not in "biuf"]:
                        texts = frame[k].astype(str)
                        is_grouped = texts.str.fullmatch(_GROUPED[group])
                        is_grouped &= not (~is_grouped & texts.str.contains(rf"\d\{group}\d")).any()  # 5,12 is none
                        frame.loc[is_grouped, k] = texts[is_grouped].str.replace(group, "", regex=False)
                    yield frame
            except pd.errors.ParserError as error:
                reason = str(error).strip().rpartition("error: ")[2]
                message = f"{path}: {reason}, counted from line {body[0][0]}; is the file whole?"
                raise InputError(message, "format") from None
            n, last = n + len(body), body[-1][0] if body else last
        is_cut = (last, True) in [(k, size < n_columns) for k, size in wrong[-1:]]
        wrong = wrong[:-1] if is_cut else wrong
        message = "".join(f"line {k}: has {size} cells, expected {n_columns}" for k, size in wrong[:1])
        if len(wrong) > MOST_WRONG * n:
            faults.append(InputError(f"{path}: {message}; is the file whole?", "format"))
        elif wrong:
            remarks.append(f"{message}; {len(wrong)} such lines are left out")
        remarks.extend(["the last line is not whole and left out"] if is_cut else [])

    return heads, unit_cells, f"row {{}} from line {begin}", blocks, remarks, faults


def _lines(path: Path, remarks: list[str], progress: Progress) -> Iterator[list[Line]]:
    """Number and text of the lines that are not empty, block by block, and a remark if the last ends in zeros."""
    with path.open("rb") as content:
        begin, encoding, wrong = content.read(4096), "utf-16", "replace"
    wide = {begin[0::2].count(0): "utf-16-be", begin[1::2].count(0): "utf-16-le"}
    if not begin.startswith((b"\xff\xfe", b"\xfe\xff")):
        is_wide = max(wide) > 0.8 * len(begin) / 2 and min(wide) < 0.1 * len(begin)
        encoding, wrong = (wide[max(wide)], wrong) if is_wide else ("utf-8-sig", "surrogateescape")
    packed = [words for mark, words in PACKED.items() if begin.startswith(mark)]
    if packed or (encoding == "utf-8-sig" and b"\0" in begin.rstrip(b"\0")):
        other = "is not text; bayesub convert --help lists the kinds of logs that are not"
        raise InputError(f"{path}: {(*packed, other)[0]}", "format")
    n, last, size = 0, "", path.stat().st_size
    with path.open("rb") as content, io.TextIOWrapper(content, encoding, wrong) as file:
        while texts := file.readlines(BLOCK):
            lines = [(k, text.strip("\n\0")) for k, text in enumerate(texts, n + 1) if text.strip(" \t;,\n\0")]
            yield [(k, line if line.isascii() else line.translate(WINDOWS)) for k, line in lines]
            n, last = n + len(texts), texts[-1]
            progress.update(round(content.tell() / 1e6), round(size / 1e6), "MB")
    if last.endswith("\0"):
        remarks.append("zeros at the end of the file, as a power cut leaves them, are left out")


def _plain(text: str) -> str:
    """A line or name without the marks of comments before it."""
    return text.lstrip().lstrip("#%/ ")


def _cells(line: str, separator: str) -> list[str]:
    rows = csv.reader([line.strip(" ")], delimiter=separator, skipinitialspace=True)
    return [cell.strip() for cell in next(rows, [])]


def _layout(path: Path, lines: list[str], heads: list[str]) -> tuple[str, int]:
    """The separator that leaves the most numbers in the last lines, the first of equals, and the number of columns.

    One that leaves as many cells in the last line of words is before others, as dates have spaces.
    """
    layouts = {}
    for separator in SEPARATORS:
        rows = [_cells(line, separator) for line in lines]
        ((n_columns, _),) = Counter(len(row) for row in rows).most_common(1)
        numbers = sum(_is_number(cell, separator) for row in rows if len(row) == n_columns for cell in row)
        is_head = any(len(_cells(line, separator)) == n_columns for line in heads[-1:])
        layouts[separator] = (is_head and numbers > 0, numbers) if n_columns > 1 else (False, 0), n_columns
    best = max(layouts, key=lambda separator: layouts[separator][0])
    if not layouts[best][0][1]:
        message = f"{path}: no columns of numbers, separated by tabs, semicolons, commas or spaces, were made out"
        raise InputError(message, "format")
    return best, layouts[best][1]


def _is_number(cell: str, separator: str) -> bool:
    number = _NUMBER.fullmatch(re.sub(stamps.THOUSANDS, "", cell))
    angle = re.search("^[NSEW]|[NSEW]$", cell) and _ANGLE.fullmatch(cell)
    return bool(number or angle or _unit(cell)) and not (separator == "," and "," in cell)


def _degrees(cell: Any) -> Any:
    """A text such as 54°10,5'N or S 33 20.0 as that of its degrees; others as they are."""
    if not isinstance(cell, str) or not (found := _ANGLE.fullmatch(cell.strip())) or not any(found.group(1, 4, 6)):
        return cell
    first, sign, *parts, last = found.groups()
    degrees = sum(float((part or "0").replace(",", ".")) / 60.0**k for k, part in enumerate(parts))
    return f"{-degrees if sign or {first, last} & {'S', 'W'} else degrees:.9f}"


def _unit(cell: str) -> str:
    """The unit behind the number of a cell; empty if there is none that is known."""
    found = _MEASURE.fullmatch(cell)
    return found["unit"] if found and (found["unit"] == "%" or units.known(found["unit"])) else ""


def _marks(rows: list[list[str]], separator: str) -> tuple[str, str]:
    """The decimal mark of rows of cells, and what groups the digits of thousands; empty if it would be seen as both."""
    grouped = [column for column in zip(*rows, strict=False) if any(map(_GROUPED[","].fullmatch, column))]
    numbers = [c for row in rows for c in row if _NUMBER.fullmatch(c) or any(g.fullmatch(c) for g in _GROUPED.values())]
    comma, point = (any(m in c and not _GROUPED[m].fullmatch(c) for c in numbers) for m in ",.")
    if comma or (not point and grouped and separator != "," and not any(c.isdigit() for col in grouped for c in col)):
        return ",", "" if point or not comma else "."
    return ".", ","


def _header(path: Path, lines: list[Line], separator: str, n_columns: int) -> tuple[list[str], list[str], int]:
    """Heads and units of the columns, and which of the lines is the first of numbers."""
    rows = [_cells(line, separator) for _, line in lines[:200]]
    rows = [row[:n_columns] if row[n_columns:] == [""] else row for row in rows]  # a separator too many at the end
    whole = [k for k, row in enumerate(rows) if len(row) == n_columns]
    kinds = {k: [_is_number(cell, separator) for cell in rows[k]] for k in whole}
    first = next((k for k in whole if any(kinds[k])), None)
    if first is None:
        message = f"{path}: no row of {n_columns} columns with numbers, as its last, is among its first lines"
        raise InputError(f"{message}; cut the file where the columns change", "format")
    sizes = (n_columns, n_columns - (not rows[first][-1]))  # or one that only the rows of numbers have
    head = next((k for k in whole if k > first and all(rows[k]) and not any(kinds[k])), len(rows))
    below = next((k for k in whole if k > head and any(kinds[k])), first)
    first = below if kinds[below] not in [kinds[k] for k in whole if first <= k < head] else first  # than those above
    heads = [[*row, ""][:n_columns] for row in rows[:first] if len(row) in sizes]
    unit_row = [""] * n_columns
    for row in heads[:0:-1]:
        filled = [cell for cell in row if cell]
        of_units = (c[0] in "[(" or c in UNITLESS or (units.known(c) and c.lower() not in NAMES) for c in filled)
        if is_units := 2 * sum(of_units) >= len(filled):
            unit_row = ["" if cell in UNITLESS else cell.strip("[]() ") for cell in row]
        elif all(row) or not any(map(all, heads)):
            break
        heads.pop()  # of units, or of what was done with each, as loggers of Campbell say
        if is_units:
            break
    return heads[-1] if heads else [""] * n_columns, unit_row, first


def _name_and_unit(cell: str) -> tuple[str, str]:
    """``Depth [m]``, ``Depth (m)``, ``Depth / m`` or ``depth_m`` taken apart; the last keeps its name."""
    if match := re.match(r"^(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\)|\s/\s(\S+))\s*$", cell):
        return match[1], next((part for part in match.groups()[1:] if part), "").strip()
    end = cell.rpartition("_")[2]
    return cell, units.of_column(cell) if len(end) > 1 or end == "m" else ""


def _time_columns(frames: Iterator[Any], names: list[str], heads: list[str], clock: Clock) -> tuple[int, ...]:
    """Where the column of times stands, with that of the dates behind it; or those of hours, minutes, .. (PARTS)."""
    places = {head: k for k, head in enumerate(heads)} | {name: k for k, name in enumerate(names)}
    lower, top = {re.sub(r"\W+", "_", name.lower()): k for name, k in places.items()}, cache(lambda: next(frames))

    def given(signal: str, key: str) -> int:
        check_known(_plain(signal), places, f"has no column '{signal}', the {key} of [time]", key=f"time.{key}")
        return places[_plain(signal)]

    parts = [[lower[name] for name in part if name in lower][:1] for part in PARTS]
    ends = [(name.removesuffix(end) + rest, k) for end, rest in NANOSECONDS.items() for name, k in lower.items()]
    split = {k: lower[name] for name, k in ends if name in lower and lower[name] != k}
    likely = [name for name in [*TIMES, *stamps.OF_WEEK] if name in lower]
    likely += [name for name in lower if re.search("(^|_)time|time(_|$)|stamp|clock", name)]
    if "t" in lower and not (likely or clock.signal):
        likely = ["t"] * stamps.may_be_clock(as_numbers(top()[lower["t"]]))
    if clock.signal is not None:
        time = given(clock.signal, "signal")
    elif likely or split:
        time = lower[likely[0]] if likely else next(iter(split))
    elif all(parts[3:6]):
        return tuple(k for part in parts for k in part)
    elif found := [lower[name] for name in DATES if name in lower]:
        time = found[0]
    else:
        frame = top()
        if typed := [k for k in frame if frame[k].dtype.kind == "M"]:
            return (typed[0],)
        ascends = [name for k, name in enumerate(names) if (np.diff(as_numbers(frame[k])) > 0).all()]
        some = f'such as signal = "{ascends[0]}", which ascends' if ascends else f"one of {', '.join(names[:8])}"
        raise InputError(f"which column is the time? give [time] signal in the map, {some}", "missing", "time.signal")
    if time in split:
        return time, split[time]
    if clock.date is not None:
        return time, given(clock.date, "date")
    dates = WEEKS if re.sub(r"\W+", "_", names[time].lower()) in stamps.OF_WEEK else DATES
    return time, *[lower[name] for name in dates if name in lower and lower[name] != time][:1]


class _Stamps:
    """The times of the rows of a table, part by part."""

    def __init__(self, names: list[str], unit: str, clock: Clock, where: str):
        self.names, self.unit, self.clock, self.where = names, unit, clock, where
        self.remarks, self.wrong, self.n, self.n_wrong = list[str](), "", 0, 0  # rows so far, and those without a time
        self.last: tuple[Any, float] | None = None  # cells of the last row that has a time, and this

    def times(self, parts: Any, *, is_last: bool) -> np.ndarray:
        """Time stamps (n,) of the columns that hold them in seconds, not a number where there is none."""
        import pandas as pd

        n = len(parts)
        parts = parts if self.last is None else pd.concat([self.last[0], parts], ignore_index=True)
        stamp, *dates = (parts[k].rename(name) for k, name in zip(parts, self.names, strict=True))
        if len(dates) > 1:  # times of the day in columns (PARTS), or dates if all six are there
            numbers = [pd.Series(as_numbers(parts[k])) for k in parts]
            rest = 1e-3 * numbers.pop() if self.names[-1].lower() in PARTS[-1] else 0.0
            *days, hour, minute, second = numbers
            stamp, dates = pd.to_timedelta(3600 * hour + 60 * minute + second + rest, unit="s"), []
            if len(days) == 3:
                year, month, day = days
                dated = {"year": year.where(year > 99, year + 2000), "month": month, "day": day}
                stamp = pd.to_datetime(dated, errors="coerce") + stamp
        if self.names[-1].lower().endswith(tuple(NANOSECONDS.values())):
            stamp, dates = pd.Series(as_numbers(stamp) + 1e-9 * as_numbers(dates[0])), []
        dates = [one.ffill() for one in dates]  # which may stand in the first row of a day only
        times, remark, self.clock = seconds(stamp, self.clock, self.unit, self.names[0], *dates)
        self.remarks += [remark] if remark else []
        if self.last is not None:
            times = times + (self.last[1] - times[0])  # by the periods of a clock that began again before
        for k in np.flatnonzero(np.isfinite(times))[-1:] if not is_last else ():
            self.last = parts.ffill().iloc[[k]], times[k]
        times, stamp = times[len(times) - n :], stamp[len(times) - n :]
        wrong = np.flatnonzero(~np.isfinite(times))
        if len(wrong) and not self.wrong:
            text = "an empty cell" if stamp.isna().iloc[wrong[0]] else f"'{stamp.iloc[wrong[0]]}'"
            where = self.where.format(self.n + wrong[0] + 1)
            self.wrong = f"{where}, column '{self.names[0]}': {text} is not a time"
        self.n, self.n_wrong = self.n + n, self.n_wrong + len(wrong)
        if is_last and self.n_wrong > MOST_WRONG * self.n:
            remedy = "expected numbers, or dates such as 2026-05-01T10:00:00.5; format under [time] says others"
            raise InputError(f"{self.wrong}; {remedy}", "data", self.names[0])
        self.remarks += [f"{self.wrong}; {self.n_wrong} such rows are left out"] if is_last and self.wrong else []
        return times
