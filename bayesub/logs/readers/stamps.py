"""Time stamps of all sorts as seconds: counts since any zero, dates in the order of any country, times of the day."""

import re
from typing import Any

import numpy as np

from bayesub.io import units
from bayesub.io.errors import InputError, check_known
from bayesub.logs.log_map import Clock

HOUR_S, DAY_S, WEEK_S = 3600.0, 86400.0, 604800.0
GPS_ZERO = 315964800.0 - 18.0  # s since 1970, less the leap seconds since 2017
SPAN = (946684800.0, 2208988800.0)  # 2000 and 2040: what counts to between them is a date
STEP = (5e-4, HOUR_S)  # s from row to row of a log
LATEST = 1e11  # s since 1970, the year 5138

# What numbers count, by unit or format -> seconds in one, and their zero in seconds since 1970.
COUNTS = {unit: (factor, 0.0) for unit, factor in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9))}
FORMATS = {"excel": (DAY_S, -25569 * DAY_S), "mjd": (DAY_S, -40587 * DAY_S), "julian": (DAY_S, -2440587.5 * DAY_S)}
FORMATS |= {"matlab": (DAY_S, -719529 * DAY_S), "labview": (1.0, -2082844800.0), "gps": (1.0, GPS_ZERO)}
FORMATS |= {"filetime": (1e-7, -11644473600.0), "ticks": (1e-7, -62135596800.0)}
# Orders of dates, with any separators or none.
DATES = ("%d/%m/%Y", "%m/%d/%Y", "%d/%m/%y", "%m/%d/%y", "%y/%m/%d", "%Y/%m/%d", "%d/%b/%Y", "%b/%d/%Y", "%d/%b/%y")
DATES += ("%d/%B/%Y", "%B/%d/%Y", "%d%b%Y", "%Y%m%d", "%d%m%Y", "%m%d%Y", "%d%m%y", "%m%d%y", "%y%m%d")
_FRACTION = r"(?P<fraction>[.,]\d+)?"
_CLOCK = r"(?P<date>.*?)[T,_\s]*\b(?P<h>\d{1,4}):(?P<m>\d\d)(?::(?P<s>\d\d))?" + _FRACTION
_CLOCK = rf"^{_CLOCK}\s*(?P<half>[AaPp])?(?:\.?[Mm]\.?)?\s*(?:Z|UTC|GMT)?$"
_DIGITS = rf"^(?P<date>\d{{8}}|\d{{6}})?[T_]?(?P<h>\d\d)(?P<m>\d\d)(?P<s>\d\d){_FRACTION}$"  # 20260501_124239.5


def seconds(column: Any, clock: Clock, unit: str, name: str, dates: Any = None) -> tuple[np.ndarray, str]:
    """Times (n,) in seconds of a column of stamps, and a remark if numbers showed what they count.

    Dates become seconds since 1970. A stamp that is no time becomes not a number.

    Parameters
    ----------
    column, dates : Series of pandas
        Stamps as numbers or text, and the dates or GPS weeks that stamps of the day or of the week lack.
    clock : Clock
        What the map says.
    unit : str
        What the file says; may be empty.
    name : str
        Of the column, for messages.

    Raises
    ------
    InputError
        For an unknown unit, and for stamps that can be read in several ways, with the line of the map that decides.
    """
    import pandas as pd

    form, remark = clock.format or "", ""
    if form and "%" not in form:
        message = f"key 'time.format': '{form}' is neither a pattern such as %d/%m/%Y nor one of {', '.join(FORMATS)}"
        check_known(form, FORMATS, message, key="time.format")
    if column.dtype.kind == "M":
        times = (column - pd.Timestamp(0, tz=column.dt.tz)).dt.total_seconds().to_numpy()
        return unwrapped(times, clock.wraps_every_s), ""
    if column.dtype.kind == "m":
        return unwrapped(column.dt.total_seconds().to_numpy(), clock.wraps_every_s or DAY_S), ""
    numbers = as_numbers(column)
    unit = clock.unit or unit
    if "%" in form or not np.isfinite(numbers).any() or (not unit + form and _are_digits(numbers)):
        if column.dtype.kind in "iuf":
            column = pd.Series([f"{int(x):06d}{f'{x % 1:.6f}'[1:]}" if np.isfinite(x) else "" for x in numbers])
        times = _written(column.astype(str).str.strip(), form, name, dates is not None)
    else:
        is_week = dates is not None and 0.0 < np.nanmax(as_numbers(dates), initial=0.0) < 1e4
        times, remark = _counted(numbers, form, unit, name, is_week)
    if dates is not None:
        times = times + _zeros(dates, "" if "%H" in form else form)
    return unwrapped(times, clock.wraps_every_s), remark


def unwrapped(times: np.ndarray, period: float | None) -> np.ndarray:
    """Times (n,) of a clock that begins again after a period (s)."""
    if period is None or len(times) < 2:
        return times
    steps = np.diff(times, prepend=times[:1])
    return times + period * np.cumsum(steps < -0.5 * period)


def lack_dates(column: Any) -> bool:
    """Whether the stamps of a column of pandas are times of the day: 12:42:39, 124239 or 0.53."""
    numbers, texts = as_numbers(column), column.dropna().astype(str).str.strip()
    if np.isfinite(numbers).any():
        return _are_digits(numbers) or (np.nanmax(numbers) <= 1.0 and _step(numbers) < STEP[0])
    return bool(texts[:1].str.match(r"\d{1,2}:\d\d").any())


def as_numbers(column: Any) -> np.ndarray:
    """Numbers (n,) of a column of pandas, with decimal points or commas; not a number for other text."""
    import pandas as pd

    if column.dtype.kind in "biuf":
        return column.to_numpy(dtype=float)
    texts = column.fillna("").astype(str).str.strip().str.replace(",", ".", regex=False)
    return pd.to_numeric(texts, errors="coerce").to_numpy(dtype=float)


def _step(numbers: np.ndarray) -> float:
    """The median step from row to row, of those that are none left out; not a number without one."""
    steps = np.abs(np.diff(numbers[np.isfinite(numbers)]))
    return float(np.median(steps[steps > 0])) if (steps > 0).any() else np.nan


def _are_digits(numbers: np.ndarray) -> bool:
    """Whether numbers are hours, minutes and seconds without separators: 124239, none from 60 to 99 among them."""
    numbers = numbers[np.isfinite(numbers)]
    low, high = numbers.min(), numbers.max()
    is_clock = high < 240000 and high - low >= 100.0 and _step(numbers) <= 20.0  # some seconds are from 60 to 99
    return bool((is_clock or (low > 1.9e13 and high < 2.1e13)) and ((numbers % 100 < 60) & (numbers % 1e4 < 6e3)).all())


def _counted(numbers: np.ndarray, form: str, unit: str, name: str, is_week: bool) -> tuple[np.ndarray, str]:
    """Times (n,) that are counted in a unit or as a format of the map, or as the numbers show, with a remark if so."""
    import pandas as pd

    low, high, step = np.nanmin(numbers), np.nanmax(numbers), _step(numbers)

    def fits(size: float, zero: float, begin: float = SPAN[0]) -> bool:
        is_step = np.isnan(step) or STEP[0] <= size * step <= STEP[1]
        return is_step and begin <= zero + size * low and zero + size * high <= SPAN[1]

    places = COUNTS | {key: place for key, place in FORMATS.items() if key != "gps"}
    found = next((key for key, place in places.items() if fits(*place)), None)
    line = "" if found is None else f'{"unit" if found in COUNTS else "format"} = "{found}"'
    (size, zero), remark = FORMATS.get(form, (1.0, 0.0)), ""
    if unit:
        unit, _, since = unit.partition(" since ")
        try:
            size = units.factor(unit, "s")
        except InputError as error:
            message = f"column '{name}' of times: {error}; give [time] unit"
            raise InputError(message, error.kind, f"time.{error.key}") from None
        begin = pd.to_datetime(since or "1970", errors="coerce", utc=True)
        zero = zero if form or pd.isna(begin) else begin.timestamp()
    elif is_week:
        size = 1.0 if high <= WEEK_S else 1e-3
    elif not form and not fits(1.0, 0.0, -np.inf):
        if found is not None:
            size, zero = places[found]
            begin = np.datetime64(int(zero + size * low), "s").item()
            remark = f"'{name}' is read with {line} and begins on {begin} UTC; [time] of the map can say otherwise"
        elif high <= 1.0 and fits(DAY_S, 0.0, 0.0):
            size, remark = DAY_S, f"'{name}' is read as the part of a day that has passed"
        else:
            likely = [key for key, (factor, _) in COUNTS.items() if STEP[0] <= factor * step <= STEP[1] or key == "s"]
            lines = " or ".join(f'unit = "{key}"' for key in reversed(likely))
            message = f"column '{name}' of times goes from {low:.12g} to {high:.12g} by {step:.6g}; "
            raise InputError(f"{message}if these are no seconds, write {lines} under [time]", "missing", "time.unit")
    times = zero + size * numbers
    if np.nanmax(np.abs(times)) > LATEST:
        message = f"column '{name}' of times: {high:.12g} {unit or 's'} is after the year 5000; "
        remedy = f"write {line} under [time] of the map" if line else "give [time] unit or format"
        raise InputError(message + remedy, "unit", "time.unit")
    return times, remark


def _written(texts: Any, form: str, name: str, has_dates: bool) -> np.ndarray:
    """Times (n,) of texts by a pattern of the map, or as they are: dates, times of the day, or both."""
    import pandas as pd

    fraction = texts.str.extract(r"(?:(?<=:\d\d)|(?<=\d{6}))[.,](\d+)(?=\D*$)")[0]
    if "%M" in form and form != "%M:%S":
        plain = texts.str.replace(r"(?:(?<=:\d\d)|(?<=\d{6}))[.,]\d+(?=\D*$)", "", regex=True)
        moments = pd.to_datetime(plain, format=re.sub(r"[.,]?%f", "", form), errors="coerce", utc=True)
        times = (moments - pd.Timestamp(0, tz="UTC")).dt.total_seconds().to_numpy()
        times = times + ("0." + fraction.fillna("0")).astype(float).to_numpy()
        return times if re.search("%[djbBy]", form) else unwrapped(np.mod(times, DAY_S), DAY_S)
    if not form:
        moments = pd.to_datetime(texts.str.replace(",", "."), errors="coerce", utc=True, format="ISO8601")
        if moments.notna().mean() > 0.5:
            return (moments - pd.Timestamp(0, tz="UTC")).dt.total_seconds().to_numpy()
    parts = texts.str.extract(_CLOCK)
    if parts["h"].isna().all():
        parts = texts.str.extract(_DIGITS)
    if parts["h"].isna().all():
        return _days(texts, form, name)
    h, m, s = (pd.to_numeric(parts[key]).to_numpy(dtype=float) for key in "hms")
    rest = parts["date"].fillna("").str.strip()
    is_day = has_dates or (rest != "").any()
    if np.isnan(s).all() and not is_day:  # hours and minutes, or minutes and seconds as a spreadsheet shows them
        is_short = form == "%M:%S" or (not form and (parts["fraction"].notna().any() or np.nanmax(h) > 23))
        if not is_short and not form:
            message = f"'{texts.iloc[0]}' of '{name}' is minutes and seconds, or hours and minutes; write format = "
            raise InputError(message + '"%M:%S" or format = "%H:%M" under [time] of the map', "missing", "time.format")
        h, m, s = (np.zeros_like(h), h, m) if is_short else (h, m, np.zeros_like(h))
    if "half" in parts:
        half = parts["half"].str.upper()
        h = np.where(half.isna(), h, h % 12 + 12 * (half == "P"))
    part = ("0" + parts["fraction"].fillna(".0").str.replace(",", ".")).astype(float).to_numpy()
    times = 3600 * h + 60 * m + np.nan_to_num(s) + part
    if (rest != "").any():
        return times + _days(rest, form, name)
    return times if is_day else unwrapped(times, DAY_S if (h > 0).any() or np.nanmax(m) > 59 else HOUR_S)


def _zeros(dates: Any, form: str) -> np.ndarray:
    """Seconds since 1970 (n,) at the begin of days, or of GPS weeks."""
    numbers = as_numbers(dates)
    top = np.nanmax(numbers, initial=0.0)
    if 0.0 < top < 1e4:
        return GPS_ZERO + WEEK_S * numbers
    if 3e4 < top < 6e4 and not form:
        return FORMATS["excel"][1] + DAY_S * numbers
    return _days(dates.astype(str).str.replace(r"\.0$", "", regex=True), form, str(dates.name))


def _days(texts: Any, form: str, name: str) -> np.ndarray:
    """Seconds since 1970 (n,) at midnight of dates; InputError if their order cannot be seen."""
    import pandas as pd

    codes, uniques = pd.factorize(texts)
    plain = pd.Series(uniques, dtype=str).str.strip()
    plain = plain.str.replace(r"^(?:mon|tue|wed|thu|fri|sat|sun)[a-z]*\W+", "", case=False, regex=True)
    is_dotted, plain = plain.str.contains(".", regex=False).all(), plain.str.replace(r"\W+", "/", regex=True)
    if plain.str.fullmatch(r"\d{5}|\d{7}").any():
        plain = plain.where(~plain.str.fullmatch(r"\d{5}|\d{7}"), "0" + plain)
    forms = [re.sub("[^%a-zA-Z]+", "/", form)] if form else DATES
    found = {}
    for pattern in forms:
        days = pd.to_datetime(plain, format=pattern, errors="coerce", utc=True)
        times = (days - pd.Timestamp(0, tz="UTC")).dt.total_seconds().to_numpy()
        times = np.where((times >= SPAN[0]) & (times <= SPAN[1]), times, np.nan)
        if np.isfinite(times).mean() > 0.5 and not (is_dotted and pattern.startswith("%m")):
            found[pattern] = times
    most = max((np.isfinite(times).sum() for times in found.values()), default=0)
    found = {key: times for key, times in found.items() if np.isfinite(times).sum() == most}
    spans = {key: np.nanmax(times) - np.nanmin(times) for key, times in found.items()}
    found = {key: times for key, times in found.items() if spans[key] == min(spans.values())}
    if not found:
        return np.full(len(texts), np.nan)
    first, *others = found.values()
    if any((first != other).any() for other in others):
        lines = " or ".join(f'format = "{key}"' for key in found)
        message = f"'{texts.iloc[0]}' of '{name}' is a date in several orders; write {lines} under [time] of the map"
        raise InputError(message, "missing", "time.format")
    return np.append(first, np.nan)[codes]
