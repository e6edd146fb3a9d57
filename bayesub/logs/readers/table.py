"""Tables in text: any separator, names and units, decimal points or commas, times as numbers or dates."""

import io
import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from bayesub.io import units
from bayesub.io.errors import InputError, check_known
from bayesub.logs.log_map import LogMap
from bayesub.logs.readers import rows
from bayesub.logs.readers.signals import Signal, VehicleLog

SEPARATORS = "\t;|, "  # a space is any number of them
COMMENTS = ("#", "%", "//")
SAMPLE = 20  # lines at the end of a file that tell how cells are separated
TIMES = ("time_s", "time", "t", "timestamp", "time_ms", "time_us", "utc", "datetime", "date_time", "seconds", "zeit")
MISSING = {"nan", "-nan", "n/a", "na", "null", "none", "-", "--", "?", "inf", "-inf"}

DAY_S = 86400.0

Line = tuple[int, str]  # its number and text
_NUMBER = re.compile(r"[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?")


def read(path: Path, log_map: LogMap) -> VehicleLog:
    """Read a table with a row for each time; an empty cell is no reading."""
    import pandas as pd

    lines = _lines(path)
    separator, n_columns = _layout(path, [line for _, line in lines[-SAMPLE:]])
    names, unit_cells, first = _header(path, lines, separator, n_columns)
    body, remarks = _whole(path, lines[first:], separator, n_columns)
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
    cells = rows.of_one(path, cells, names, log_map.where)
    k = _time_column(path, names, log_map.time.signal)
    times = _times(path, cells[k], log_map.time.unit or unit_cells[k] or "s", names[k], lines[first][0])
    parsed = [_numbers(cells[column]) for column in cells]
    numbers = [values for _, values, _ in parsed]
    remarks += rows.told_apart(cells, names, numbers, times) + rows.times_of_header(names, numbers, times)
    signals = {}
    for column, name, unit, (filled, values, text) in zip(cells, names, unit_cells, parsed, strict=True):
        if text:
            remarks.append(f"'{name}' holds text such as '{text}' and is left out")
        elif name != names[k]:
            remarks += rows.of_text(name, cells[column], filled)
            signals[name] = Signal(times[filled], values[filled], unit)
    return VehicleLog(path, signals, tuple(remarks))


def _whole(path: Path, lines: list[Line], separator: str, n_columns: int) -> tuple[list[str], list[str]]:
    """The lines of numbers, all with the same number of cells, and a remark if the last one was not whole."""
    texts = [line for _, line in lines]
    if any('"' in line for line in texts[:SAMPLE]):
        return texts, []  # separators may be quoted
    for k, (number, line) in enumerate(lines):
        n_cells = len(line.split()) if separator == " " else line.count(separator) + 1
        if n_cells < n_columns and k == len(lines) - 1:
            return texts[:-1], ["the last line is not whole and left out"]
        if n_cells != n_columns:
            message = f"{path}: line {number}: has {n_cells} cells, expected {n_columns}; is the file whole?"
            raise InputError(message, "format")
    return texts, []


def _lines(path: Path) -> list[Line]:
    """Number and text of the lines that are neither empty nor comments."""
    content = path.read_bytes()
    if b"\0" in content[:4096]:
        raise InputError(f"{path}: is not text; bayesub convert --help lists the kinds of logs that are not", "format")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("cp1252", errors="replace")
    lines = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip(" \t;,")]
    table = [(k, line) for k, line in lines if not line.lstrip().startswith(COMMENTS)]
    if len(table) < 2:
        raise InputError(f"{path}: has no rows; expected a line of names and lines of numbers", "data")
    before = [(k, line.lstrip().lstrip("#%/ ")) for k, line in lines if k < table[0][0]]
    return before[-1:] + table  # names may stand in a comment


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
    """Names and units of the columns, and which of the lines is the first of numbers."""
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
    names = []
    for k, cell in enumerate(heads[-1] if heads else unit_row):
        name, unit = _name_and_unit(cell) if heads else ("", "")
        names.append(name or f"column_{k + 1}")
        unit_row[k] = unit_row[k] or unit
        if names[k] in names[:k]:
            raise InputError(f"{path}: column '{names[k]}' is given twice; rename one of them", "conflict", names[k])
    return names, unit_row, first


def _name_and_unit(cell: str) -> tuple[str, str]:
    """``Depth [m]``, ``Depth (m)``, ``Depth / m`` or ``depth_m`` taken apart; the last keeps its name."""
    match = re.match(r"^(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\)|\s/\s(\S+))\s*$", cell)
    if match:
        return match[1], next((part for part in match.groups()[1:] if part), "").strip()
    end = cell.rpartition("_")[2]
    return cell, units.of_column(cell) if len(end) > 1 or end == "m" else ""


def _time_column(path: Path, names: list[str], signal: str | None) -> int:
    if signal is not None:
        check_known(signal, names, f"{path}: has no column '{signal}', the signal of [time]", key="time.signal")
        return names.index(signal)
    lower = [name.lower() for name in names]
    likely = [lower.index(name) for name in TIMES if name in lower]
    likely += [k for k, name in enumerate(lower) if "time" in name]
    if not likely:
        message = f"{path}: which column is the time? give [time] signal in the map, one of {', '.join(names[:8])}"
        raise InputError(message, "missing", "time.signal")
    return likely[0]


def _times(path: Path, column: Any, unit: str, name: str, line: int) -> np.ndarray:
    """Time stamps (n,) in seconds: numbers, or dates, which become seconds since 1970."""
    import pandas as pd

    _, times, text = _numbers(column)
    if text and not np.isfinite(times).any():
        unit, column = "s", column.astype(str).str.strip().str.replace(",", ".", regex=False)
        if re.match(r"\d+:\d\d", text):  # of the day
            times = pd.to_timedelta(column, errors="coerce").dt.total_seconds().to_numpy()
            times = times + DAY_S * np.cumsum(np.diff(times, prepend=times[:1]) < -0.5 * DAY_S)
        else:
            dates = pd.to_datetime(column, errors="coerce", utc=True, format="ISO8601")
            times = (dates - pd.Timestamp(0, tz="UTC")).dt.total_seconds().to_numpy()
    for k in np.flatnonzero(~np.isfinite(times))[:1]:
        message = f"{path}: row {k + 1} from line {line}, column '{name}': '{column.iloc[k]}' is not a time; expected "
        raise InputError(message + "numbers, or dates such as 2026-05-01T10:00:00.5", "data", name)
    try:
        return times * units.factor(unit.partition(" since ")[0], "s")
    except InputError as error:
        message = f"{path}: column '{name}' of times: {error}; give [time] unit"
        raise InputError(message, error.kind, f"time.{error.key}") from None


def _numbers(column: Any) -> tuple[np.ndarray, np.ndarray, str]:
    """Which cells are filled (n,), their numbers (n,), and the first text that is none, if there is one."""
    import pandas as pd

    filled = column.notna().to_numpy()
    if column.dtype.kind in "biuf":
        return filled, column.to_numpy(dtype=float), ""
    texts = column.fillna("").astype(str).str.strip()
    values = pd.to_numeric(texts.str.replace(",", ".", regex=False), errors="coerce").to_numpy(dtype=float)
    wrong = filled & ~np.isfinite(values) & ~texts.str.lower().isin(MISSING).to_numpy()
    is_text = np.count_nonzero(wrong) > np.count_nonzero(np.isfinite(values))
    return filled & ~wrong, values, texts[wrong].iloc[0] if is_text else ""
