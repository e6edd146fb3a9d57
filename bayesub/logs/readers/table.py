"""Tables, as Parquet or in text of any separator, names and units, decimal points or commas and times."""

import io
import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from bayesub.io import units
from bayesub.io.errors import InputError, check_known
from bayesub.logs.log_map import Clock, LogMap
from bayesub.logs.readers import rows, stamps
from bayesub.logs.readers.signals import Signal, VehicleLog, library

SEPARATORS = "\t;|, "  # a space is any number of them
COMMENTS = ("#", "%", "//")
SAMPLE = 20  # lines at the end of a file that tell how cells are separated
TIMES = ["time_s", "time", "t", "timestamp", "time_ms", "time_us", "utc", "datetime", "date_time", "seconds"]
TIMES += ["zeit", "uhrzeit", "heure", "hora", "tijd"]
DATES, WEEKS = ["date", "datum", "fecha", "utc_date"], ["week", "gps_week", "gpsweek", "gwk", "wn"]
PARTS = [["year", "yyyy"], ["month", "mon"], ["day"], ["hour", "hh"], ["minute", "min"], ["second", "sec", "ss"]]
NANOSECONDS = {"sec": "nanosec", "secs": "nsecs"}  # how names of two columns of one stamp end, in ROS
MOST_WRONG = 0.1  # of the rows, which may be broken or lack a time, and are left out
MISSING = {"nan", "-nan", "n/a", "na", "null", "none", "-", "--", "?", "inf", "-inf"}

Line = tuple[int, str]  # its number and text
_NUMBER = re.compile(r"[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?")


def read(path: Path, log_map: LogMap) -> VehicleLog:
    """Read a table with a row for each time; an empty cell is no reading."""
    with path.open("rb") as file:
        is_parquet = file.read(4) == b"PAR1"
    frame, heads, unit_cells, where, remarks, fault = (_read_parquet if is_parquet else _read_text)(path)
    names = []
    for k, head in enumerate(heads):
        name, unit = _name_and_unit(head)
        unit_cells[k] = unit_cells[k] or unit
        names.append(name if name and name not in names else head or f"column_{k + 1}")
        if names[k] in names[:k]:
            fault = InputError(f"{path}: column '{head}' is given twice; rename one of them", "conflict", head)
            names[k] = f"{head}_{k + 1}"
    frame = rows.of_one(path, frame, names, log_map.where)
    used: tuple[int, ...] = ()
    times, clock = np.full(len(frame), np.nan), log_map.time.clock(path.stem)
    try:
        used = _time_columns(frame, names, heads, clock)
        times, more = _times(frame[list(used)], [names[k] for k in used], unit_cells[used[0]], clock, where)
        remarks += more
    except InputError as error:
        fault, used = fault or error.within(str(path)), ()
    wanted = [section.signal.removeprefix(f"{path.stem}.") for section in log_map.columns.values()]
    parsed = [_numbers(frame[k]) for k in frame]
    if fault is None:
        numbers = [values for _, values, _ in parsed]
        remarks += rows.told_apart(frame, names, numbers, times) + rows.times_of_header(names, numbers, times)
    signals = {}
    for k, (name, (filled, values, text)) in enumerate(zip(names, parsed, strict=True)):
        remarks += rows.of_text(name, frame[k], filled) if k not in used and not text else []
        filled = filled & (np.isfinite(times) | (fault is not None))
        if k not in used and text:
            remarks.append(f"'{name}' holds text such as '{text}' and is left out")
        elif k not in used:
            label = next((signal for signal in wanted if _plain(signal) == heads[k]), name)  # as the file has it
            signals[label] = Signal(times[filled], values[filled], unit_cells[k])
    return VehicleLog(path, signals, tuple(remarks), fault)


# Cells of the columns 0, 1, .., their heads and units, a place in words, remarks, and what is wrong.
Table = tuple[Any, list[str], list[str], str, list[str], InputError | None]


def _read_parquet(path: Path) -> Table:
    import pandas as pd

    library("pyarrow", path)
    frame = pd.read_parquet(path)
    if frame.index.name is not None or frame.index.dtype.kind in "Mm":
        frame = frame.reset_index(names=frame.index.name or "time")
    heads = [str(name) for name in frame.columns]
    return frame.set_axis(range(len(heads)), axis=1), heads, [""] * len(heads), "row {}", [], None


def _read_text(path: Path) -> Table:
    import pandas as pd

    lines, remarks = _lines(path)
    separator, n_columns = _layout(path, [line for _, line in lines[-SAMPLE:]])
    heads, unit_cells, first = _header(path, lines, separator, n_columns)
    body, remark, fault = _whole(path, lines[first:], separator, n_columns)
    comma = "," if separator != "," and "," in lines[first][1] else "."
    separators = r"\s+" if separator == " " else separator
    options: dict[str, Any] = {"header": None, "names": range(n_columns), "keep_default_na": False, "na_values": [""]}
    options |= {"index_col": False, "skipinitialspace": True, "decimal": comma, "low_memory": False}
    try:
        cells = pd.read_csv(io.StringIO("\n".join(body)), sep=separators, **options)
    except pd.errors.ParserError as error:
        reason = str(error).strip().rpartition("error: ")[2]
        message = f"{path}: {reason}, counted from line {lines[first][0]}; is the file whole?"
        raise InputError(message, "format") from None
    return cells, heads, unit_cells, f"row {{}} from line {lines[first][0]}", remarks + remark, fault


def _whole(
    path: Path, lines: list[Line], separator: str, n_columns: int
) -> tuple[list[str], list[str], InputError | None]:
    """The lines with the right number of cells, a remark on others, and what is wrong if these are many."""
    texts = [line for _, line in lines]
    if any('"' in line for line in texts[:SAMPLE]):
        return texts, [], None  # separators may be quoted
    counts = [len(line.split()) if separator == " " else line.count(separator) + 1 for line in texts]
    whole = [line for line, count in zip(texts, counts, strict=True) if count == n_columns]
    remarks = ["the last line is not whole and left out"] if counts[-1] < n_columns else []
    wrong = [k for k, count in enumerate(counts[: len(counts) - len(remarks)]) if count != n_columns]
    if not wrong:
        return whole, remarks, None
    message = f"line {lines[wrong[0]][0]}: has {counts[wrong[0]]} cells, expected {n_columns}"
    if len(wrong) > MOST_WRONG * len(lines):
        return whole, remarks, InputError(f"{path}: {message}; is the file whole?", "format")
    return whole, [f"{message}; {len(wrong)} such lines are left out", *remarks], None


def _lines(path: Path) -> tuple[list[Line], list[str]]:
    """Number and text of the lines that are neither empty nor comments, and remarks."""
    content, remarks = path.read_bytes(), []
    begin, whole = content[:4096], content.rstrip(b"\0")
    wide = {begin[0::2].count(0): "utf-16-be", begin[1::2].count(0): "utf-16-le"}
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = content.decode("utf-16", errors="replace")
    elif max(wide) > 0.8 * len(begin) / 2 and min(wide) < 0.1 * len(begin):
        text = content.decode(wide[max(wide)], errors="replace")
    elif b"\0" in whole[:4096]:
        raise InputError(f"{path}: is not text; bayesub convert --help lists the kinds of logs that are not", "format")
    else:
        if whole != content:
            remarks = ["zeros at the end of the file, as a power cut leaves them, are left out"]
        try:
            text = whole.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = whole.decode("cp1252", errors="replace")
    lines = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip(" \t;,")]
    table = [(k, line) for k, line in lines if not line.lstrip().startswith(COMMENTS)]
    if len(table) < 2:
        raise InputError(f"{path}: has no rows; expected a line of names and lines of numbers", "data")
    before = [(k, _plain(line)) for k, line in lines if k < table[0][0]]
    return before[-1:] + table, remarks  # names may stand in a comment


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


def _numbers(column: Any) -> tuple[np.ndarray, np.ndarray, str]:
    """Which cells are filled (n,), their numbers (n,), and the first text that is none, if there is one."""
    filled, values = column.notna().to_numpy(), stamps.as_numbers(column)
    texts = column[filled & ~np.isfinite(values) & (column.dtype.kind not in "biuf")].astype(str).str.strip()
    texts = texts[~texts.str.lower().isin(MISSING)]
    is_text = len(texts) > np.count_nonzero(np.isfinite(values))
    return filled & ~column.index.isin(texts.index), values, texts.iloc[0] if is_text else ""
