"""Time stamps of all sorts as seconds: counts since any zero, dates in the order of any country, times of the day."""

import re
from collections.abc import Iterator
from typing import Any

import numpy as np

from bayesub.io.errors import InputError, check_known
from bayesub.logs.log_map import TIMES, Clock, seconds_in

HOUR_S, DAY_S, WEEK_S = 3600.0, 86400.0, 604800.0
GPS_ZERO = 315964800.0 - 18.0  # s since 1970, less the leap seconds since 2017
ZONES = ("utc", "gmt", "gps", "local", "unix", "epoch")  # what heads say in brackets beside units
SPAN = (946684800.0, 2208988800.0)  # 2000 and 2040: what counts to between them is a date
STEP = (5e-4, HOUR_S)  # s from row to row of a log
MILLISECONDS = ("itow", "gms", "gps_ms")  # names of times of the week, and those in seconds
OF_WEEK = (*MILLISECONDS, "tow", "sow", "gps_tow", "gps_sow", "time_of_week", "seconds_of_week")
BLOCK, LONG = 100_000, 1_000_000  # texts that are parsed at a time; numbers that show what they count
LATEST = 1e11  # s since 1970, the year 5138
THOUSANDS = r",(?=\d{3}(?:,\d{3})*\.)|\.(?=\d{3}(?:\.\d{3})*,)"  # of 1,234.5 and 1.234,5
THOUSANDS += r"|(?<=\d)[\s'’](?=\d{3}(?:[\s'’]\d{3})*(?:[.,]\d*)?$)"  # of 1 234,5 and 1'234.5
OVERTAKEN = 0.95  # of the period of a clock; a message that comes too late after it began again is ahead by more

# What numbers count, by unit or format -> seconds in one, and their zero in seconds since 1970.
COUNTS = {unit: (factor, 0.0) for unit, factor in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9))}
FORMATS = {"excel": (DAY_S, -25569 * DAY_S), "mjd": (DAY_S, -40587 * DAY_S), "julian": (DAY_S, -2440587.5 * DAY_S)}
FORMATS |= {"matlab": (DAY_S, -719529 * DAY_S), "labview": (1.0, -2082844800.0), "gps": (1.0, GPS_ZERO)}
FORMATS |= {"filetime": (1e-7, -11644473600.0), "ticks": (1e-7, -62135596800.0)}
# Orders of dates whose separators became strokes, and of those without.
DATES = "%d/%m/%Y %m/%d/%Y %d/%m/%y %m/%d/%y %y/%m/%d %Y/%m/%d %d/%b/%Y %b/%d/%Y %d/%b/%y %d/%B/%Y %B/%d/%Y %d%b%Y "
DATES += "%Y%m%d %d%m%Y %m%d%Y %d%m%y %m%d%y %y%m%d %Y/%j %G/W%V/%u"
_WEEKDAY = r"(?i)^(?:mon|tue|wed|thu|fri|sat|sun)[a-z]*\W+"
_CLOCK = r"^(?P<date>.*?)[T+,_\s]*(?<!\d)(?P<h>\d{1,4})[:h](?P<m>\d\d)(?:[:m](?P<s>\d\d))?(?P<part>[.,:]\d+)?s?"
_CLOCK += r"\s*(?P<half>[AaPp])?(?:\.?[Mm]\.?)?\s*(?:Z|UTC|GMT)?(?P<zone>[+-]\d\d:?\d\d)?$"
_NUMBERS = r"^\[?(\d{4})\D(\d\d)\D(\d\d)\D+(\d\d)\D(\d\d)\D(\d\d)([^\]]*)\]?$"  # 2026_11_30_10_00_00
_OF_DATE = r"^(?:\w+,? )?(\w{3,9}) +(\d\d?) (\d\d?:\d\d:\d\d\S*)(?: (?:UTC|GMT))? (\d{4})$"  # Nov 30 12:00:00 2026
_DIGITS = r"^(?P<date>\d{8}|\d{6})?[T_ ]?(?P<h>\d\d)(?P<m>\d\d)(?P<s>\d\d)(?P<part>[.,]\d+)?(?P<half>$)"  # 124239.5


def seconds(column: Any, clock: Clock, unit: str, name: str, dates: Any = None) -> tuple[np.ndarray, str, Clock]:
    """Times (n,) in seconds of a column of pandas, and a remark if its numbers showed what they count.

    The map has a clock and the file a unit, which may be empty; `dates` is the column of dates or GPS weeks that times
    of the day or week are added to. Dates become seconds since 1970, and stamps that are no times not a number. The
    clock that is returned reads more rows of the column in the same way.
    InputError for what can be read in several ways, with the line of the map that decides.
    """
    import pandas as pd

    form, unit, remark, shown = clock.format or "", clock.unit or unit or _unit_of(name), "", dict[str, Any]()
    if form and "%" not in form:
        message = f"key 'time.format': '{form}' is neither a pattern such as %d/%m/%Y nor one of {', '.join(FORMATS)}"
        check_known(form, FORMATS, message, key="time.format")
    if column.dtype.kind in "Mm":
        zero = pd.Timestamp(0, tz=column.dt.tz) if column.dtype.kind == "M" else pd.Timedelta(0)
        times = (column - zero).dt.total_seconds().to_numpy()
        times = unwrapped(times, DAY_S if np.nanmax(times, initial=0.0) <= DAY_S else None)
        return unwrapped(times, clock.wraps_every_s), "", clock
    numbers, unit = as_numbers(column), "" if unit.lower() in ZONES else unit
    if "%" in form or not np.isfinite(numbers).any() or (not unit + form and _are_digits(numbers)):
        if column.dtype.kind in "iuf":
            column = pd.Series([f"{int(x):06d}{f'{x % 1:.6f}'[1:]}" if np.isfinite(x) else "" for x in numbers])
        times, is_part, order = _written(column.astype(str).str.strip(), form, name, dates is not None)
        shown["format"] = "%H%M%S" if is_part and not form and np.isfinite(numbers).any() else order
    else:
        is_of_week = dates is not None and re.sub(r"\W+", "_", name.lower()) in OF_WEEK
        times, remark, shown = _counted(numbers, form, unit, name, is_of_week)
        is_part = is_of_week or (remark != "" and np.nanmax(times) <= DAY_S)
    if dates is not None and (is_part or clock.date):
        counts = as_numbers(dates)
        top = np.nanmax(counts, initial=0.0)
        if 0.0 < top < 1e4:
            times = times + GPS_ZERO + WEEK_S * counts
        elif 3e4 < top < 6e4 and "%" not in form:
            times = times + FORMATS["excel"][1] + DAY_S * counts
        else:
            texts = dates.astype(str).str.replace(r"\.0$", "", regex=True)
            days, order = _days(texts, "" if "%M" in form else form, str(dates.name))
            times, shown = times + days, shown | ({"format": order} if "format" in shown and not form else {})
        shown["date"] = str(dates.name)
    return unwrapped(times, clock.wraps_every_s), remark, clock.model_copy(update=shown)


def unwrapped(times: np.ndarray, period: float | None) -> np.ndarray:
    """Times (n,) of a clock that begins again after a period (s); messages from before that may come after it."""
    if period is None:
        return times
    steps = np.diff(times, prepend=times[:1]) / period
    return times + period * np.cumsum((steps < -0.5).astype(int) - (steps > OVERTAKEN))


def _unit_of(name: str) -> str:
    """The unit but for days at the end of the name of a column of times, ``time_boot_ms`` or TimeUS; or none."""
    words = [word.lower() for word in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", name)]
    known = len(words) > 1 and (words[-1] in COUNTS or words[-1].removesuffix("s") in TIMES.keys() - {"d", "day"})
    return words[-1] if known else ""


def _blocks(texts: Any) -> Iterator[Any]:
    """Texts (n,) part by part, since what is taken apart fills many times their memory."""
    return (texts[k : k + BLOCK] for k in range(0, max(len(texts), 1), BLOCK))


def as_numbers(column: Any) -> np.ndarray:
    """Numbers (n,) of a column of pandas, with decimal points or commas, and of truths; others are not a number."""
    import pandas as pd

    if column.dtype.kind not in "biuf":
        texts = (part.astype(str).str.strip().replace({"True": "1", "False": "0"}) for part in _blocks(column))
        plain = (part.str.replace(THOUSANDS, "", regex=True).str.replace(",", ".", regex=False) for part in texts)
        column = pd.concat([pd.to_numeric(part, errors="coerce") for part in plain])
    numbers = column.to_numpy(dtype=float, na_value=np.nan)
    return np.where(np.isfinite(numbers), numbers, np.nan)


def may_be_clock(numbers: np.ndarray) -> bool:
    """Whether numbers (n,) rise or fall nearly always, as times do, and temperatures in a column called T do not."""
    falls = np.diff(numbers[np.isfinite(numbers)]) < 0.0
    return not 0.1 < falls.mean() < 0.9 if len(falls) else True


def _step(numbers: np.ndarray) -> float:
    """The median step from row to row, of the first if there are many, without repeated ones; not a number if none."""
    steps = np.abs(np.diff(numbers[:LONG][np.isfinite(numbers[:LONG])]))
    return float(np.median(steps[steps > 0])) if (steps > 0).any() else np.nan


def _are_digits(numbers: np.ndarray) -> bool:
    """Whether numbers are hours, minutes and seconds without separators: 124239, none from 60 to 99 among them."""
    numbers, step = numbers[np.isfinite(numbers)], _step(numbers)
    has_carry = step <= 20.0 and (np.abs(np.diff(numbers) - 40.0 - step) <= step).any()  # from 59 to 100
    is_clock = (numbers < 240000).all() and has_carry
    is_moment = ((numbers > 1.9e13) & (numbers < 2.1e13)).all()
    return bool((is_clock or is_moment) and ((numbers % 100 < 60) & (numbers % 1e4 < 6e3)).all())


def _counted(
    numbers: np.ndarray, form: str, unit: str, name: str, is_of_week: bool
) -> tuple[np.ndarray, str, dict[str, Any]]:
    """Times (n,) that are counted in a unit or as a format of the map, or as the numbers show, with a remark if so.

    The keys of a clock by which they are read in the same way are last.
    """
    some = numbers[:: 1 + len(numbers) // LONG]
    low, high = np.nanquantile(some, [0.01, 0.99], method="nearest")  # a few may be damaged, or come in bursts
    step, mean = _step(numbers), (high - low) / (0.98 * max(len(numbers) - 1, 1))

    def fits(size: float, zero: float, begin: float = SPAN[0]) -> bool:
        is_step = np.isnan(step) or (STEP[0] <= size * mean and size * step <= STEP[1])
        return is_step and begin <= zero + size * low and zero + size * high <= SPAN[1]

    places = COUNTS | {key: place for key, place in FORMATS.items() if key != "gps"}
    found = next((key for key, place in places.items() if fits(*place)), "")
    line = f'{"unit" if found in COUNTS else "format"} = "{found}"'
    (size, zero), remark, shown = FORMATS.get(form, (1.0, 0.0)), "", {"unit": None if form else "s"}
    if unit:
        shown = {}
        unit, *since = re.split(r"\s+since\s+", unit, flags=re.IGNORECASE)
        try:
            size = seconds_in(unit)
        except InputError as error:
            message = f"column '{name}' of times: {error}; give [time] unit"
            raise InputError(message, error.kind, f"time.{error.key}") from None
        zero = zero if form or not since else _start(since[0], unit, name)
    elif is_of_week:
        size = 1e-3 if high > WEEK_S or name.lower() in MILLISECONDS else 1.0
        shown = {"unit": "s" if size == 1.0 else "ms"}
    elif not form and high <= 1.0 and STEP[0] / DAY_S <= step < STEP[0]:
        size, remark, shown = DAY_S, f"'{name}' is read as the part of a day that has passed", {"unit": "d"}
    elif not form and not fits(1.0, 0.0, -np.inf):
        if found:
            (size, zero), shown = places[found], {"unit" if found in COUNTS else "format": found}
            begin = np.datetime64(int(zero + size * np.nanmin(numbers)), "s").item()
            remark = f"'{name}' is read with {line} and begins on {begin} UTC; [time] of the map can say otherwise"
        else:
            known = ("d", "h", "min", *reversed(COUNTS))
            likely = [key for key in known if STEP[0] <= seconds_in(key) * step <= STEP[1]]
            lines = " or ".join(f'unit = "{key}"' for key in likely or ["s"])
            message = f"column '{name}' of times goes from {low:.12g} to {high:.12g} by {step:.6g}; "
            raise InputError(f"{message}if these are no seconds, write {lines} under [time]", "missing", "time.unit")
    times = zero + size * numbers
    if abs(zero + size * high) > LATEST:
        message = f"column '{name}' of times: {high:.12g} {unit or 's'} is after the year 5000; "
        remedy = f"write {line} under [time] of the map" if found else "give [time] unit or format"
        raise InputError(message + remedy, "unit", "time.unit")
    return np.where(np.abs(times) <= LATEST, times, np.nan), remark, shown  # which single ones may be, as fill values


def _start(text: str, unit: str, name: str) -> float:
    """Seconds since 1970 of the date from which on times are counted; 1970 if it is none."""
    found = re.match(r"(\d\d?)\W(\d\d?)\W\d{4}", text)
    if found and found[1] != found[2] and max(int(found[1]), int(found[2])) <= 12:
        message = f"column '{name}' of times: '{text}' is a date in several orders; write unit = \"{unit} since "
        raise InputError(f'{message}YYYY-MM-DD" under [time] of the map', "missing", "time.unit")
    return float(np.nan_to_num(_parsed([text], "mixed"))[0])


def _parsed(texts: Any, pattern: str) -> np.ndarray:
    """Seconds since 1970 (n,) of texts by a pattern; not a number for those that do not follow it."""
    import pandas as pd

    plain = (pd.Series(part, dtype=str).str.replace(",", ".", regex=False) for part in _blocks(texts))
    moments = [pd.to_datetime(part, format=pattern, errors="coerce", utc=True) for part in plain]
    return (pd.concat(moments) - pd.Timestamp("1970-01-01", tz="UTC")).dt.total_seconds().to_numpy()


def _parts(texts: Any, pattern: str) -> Any:
    """Date and half of the day of times of the day as texts, and h, m, s and part as numbers, in a table of pandas."""
    import pandas as pd

    tables = []
    for block in _blocks(texts):
        parts = block.str.extract(pattern)
        digits = parts["part"].str[1:]
        if parts["part"].str.startswith(":").any():  # a count, 12:00:00:5 to 12:00:00:995
            digits = digits.str.zfill(int(digits.str.len().max()))
        parts["part"] = "0." + digits
        tables.append(parts.assign(**{key: as_numbers(parts[key]) for key in ("h", "m", "s", "part")}))
    return pd.concat(tables, ignore_index=True)


def _written(texts: Any, form: str, name: str, has_dates: bool) -> tuple[np.ndarray, bool, str]:
    """Times (n,) of texts by a pattern of the map, or as they are; whether of the day; the pattern of dates."""
    import pandas as pd

    if "%M" in form and form != "%M:%S":
        plain = re.sub("[.,]%f", "", form).replace(",", ".")
        times, fractions = _parsed(texts, plain), _parsed(texts, plain.replace("%S", "%S.%f"))
        times, is_part = np.where(np.isnan(times), fractions, times), not re.search("%[djbByGV]", form)
        return unwrapped(np.mod(times, DAY_S), None if has_dates else DAY_S) if is_part else times, is_part, form
    for pattern in () if form else ("", _NUMBERS):
        changed = (part.str.replace(pattern, r"\1-\2-\3T\4:\5:\6\7", regex=True) for part in _blocks(texts))
        times = _parsed(pd.concat(list(changed)) if pattern else texts, "ISO8601")
        if np.isfinite(times).mean() > 0.5:
            return times, False, ""
    texts = pd.concat([part.str.replace(_OF_DATE, r"\2 \1 \4 \3", regex=True) for part in _blocks(texts)])
    parts = _parts(texts, _CLOCK)
    parts = _parts(texts, _DIGITS) if parts["h"].isna().all() else parts
    if parts["h"].isna().all():
        days, order = _days(texts, form, name)
        return days, False, order
    h, m, s = (parts[key].to_numpy() for key in "hms")
    codes, dates = pd.factorize(parts["date"].fillna("").str.strip())
    rest = pd.Series(dates, dtype=str)
    days, rest = as_numbers(rest.str.extract(r"^(\d+) days?$")[0]), rest.str.replace(r"^\d+ days?$", "", regex=True)
    is_part = (rest == "").all()
    if np.isnan(s).all() and is_part and not has_dates:  # hours and minutes, or as a spreadsheet shows minutes
        if form != "%M:%S" and parts["part"].isna().all() and np.nanmax(h) <= 23:
            message = f"'{texts.iloc[0]}' of '{name}' is minutes and seconds, or hours and minutes; write format = "
            raise InputError(message + '"%M:%S" or format = "%H:%M" under [time] of the map', "missing", "time.format")
        h, m, s = np.zeros_like(h), h, m
    half = parts["half"].str.upper()
    h = np.where(half.isin(["A", "P"]), h % 12 + 12 * (half == "P"), h)
    times = DAY_S * np.nan_to_num(days)[codes] + 3600 * h + 60 * m + np.nan_to_num(s) + np.nan_to_num(parts["part"])
    if not is_part:
        zone = as_numbers(parts["zone"].str.replace(":", "")) if "zone" in parts else np.zeros(len(times))
        times -= np.nan_to_num(3600 * np.trunc(zone / 100) + 60 * np.fmod(zone, 100))
        days, order = _days(rest, form, name)
        return times + days[codes], False, order
    period = DAY_S if (h > 0).any() or np.nanmax(m) > 59 else HOUR_S
    return times if has_dates else unwrapped(times, period), True, form


def _days(texts: Any, form: str, name: str) -> tuple[np.ndarray, str]:
    """Seconds since 1970 (n,) at midnight of dates, and their pattern; InputError if their order cannot be seen."""
    import pandas as pd

    codes, uniques = pd.factorize(texts)
    plain = pd.Series(uniques, dtype=str).str.strip().str.replace(_WEEKDAY, "", regex=True)
    is_dotted = plain.str.contains(".", regex=False).all()  # month first is not written with points
    plain = plain.str.replace(r"\W+", "/", regex=True).str.replace(r"^(\d{5}|\d{7})$", r"0\1", regex=True)
    found = {}
    for pattern in [re.sub("[^%a-zA-Z]+", "/", form)] if form else DATES.split():
        times = _parsed(plain, pattern)
        times = np.where((times >= SPAN[0]) & (times <= SPAN[1]), times, np.nan)
        if np.isfinite(times).any() and not (is_dotted and pattern.startswith("%m")):
            found[pattern] = times
    # The order by which most are dates, and by which they span the shortest time.
    ranks = {key: (np.isnan(times).sum(), np.ptp(times[np.isfinite(times)])) for key, times in found.items()}
    best = [key for key, rank in ranks.items() if rank == min(ranks.values())]
    if not best:
        return np.full(len(texts), np.nan), form
    if not all(np.array_equal(found[key], found[best[0]], equal_nan=True) for key in best):
        lines = " or ".join(f'format = "{key}"' for key in best)
        message = f"'{texts.iloc[0]}' of '{name}' is a date in several orders; write {lines} under [time] of the map"
        raise InputError(message, "missing", "time.format")
    return np.append(found[best[0]], np.nan)[codes], best[0]
