"""NMEA 0183: what GPS receivers, compasses and depth sounders say, sentence by sentence, by pynmea2."""

import contextlib
import datetime
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from bayesub.io.errors import InputError
from bayesub.logs.log_map import LogMap
from bayesub.logs.readers.signals import Collection, VehicleLog, library
from bayesub.logs.readers.stamps import LATEST

HALF_DAY_S, DAY_S = 43200.0, 86400.0
UNEVEN, SLACK_S = 0.1, 2.0  # of the time and besides, by which the clock of a logger may differ
# A time that a logger wrote before a sentence: seconds, a date and time, or the tag block of NMEA 4.
_STAMPED = re.compile(r"^\s*(?:\\[^\\]*?c:(?P<tag>\d+)[^\\]*\\|(?P<stamp>[^$!\\]*?)[\s,;]*)(?P<sentence>[$!].*)$")
_UNITS = dict.fromkeys(("latitude", "longitude", "true_course", "true_track", "mag_track"), "deg")
_UNITS |= dict.fromkeys(("heading", "heading_true", "heading_magnetic"), "deg")
_UNITS |= dict.fromkeys(("spd_over_grnd", "spd_over_grnd_kts", "water_speed_knots"), "kn")
_UNITS |= dict.fromkeys(("spd_over_grnd_kmph", "water_speed_km"), "km/h")
_UNITS |= dict.fromkeys(("depth", "depth_meters", "altitude"), "m") | {"rate_of_turn": "deg/s", "speed": "rpm"}


def read(path: Path, log_map: LogMap) -> VehicleLog:  # noqa: ARG001
    """Read all sentences; a signal is named by talker, sentence and field, such as ``GPRMC.latitude``.

    Times are those that the logger wrote before each sentence if there are any, otherwise those inside of sentences
    (RMC, GGA, ..); sentences between two of these are spread over the time between them.
    """
    pynmea2 = library("pynmea2", path)
    sentences, remarks, n_wrong, n_lines = [], list[str](), 0, 0
    for line in path.read_text(encoding="ascii", errors="replace").splitlines():
        match = _STAMPED.match(line)
        if match is None:
            continue
        n_lines += 1
        try:
            message = pynmea2.parse(match["sentence"])
        except (pynmea2.ParseError, ValueError):  # a sum that does not fit, or a field that is no number
            n_wrong += not match["sentence"].startswith("!AI")  # of other ships, in letters of six bits
            continue
        sentences.append((_stamp(match), message))
    if n_lines and not sentences:
        raise InputError(f"{path}: all {n_lines} sentences are damaged: their sums do not fit", "data")
    if not sentences:
        message = f"{path}: has no sentences of NMEA 0183, which begin with $ or !; other text is of kind csv"
        raise InputError(message, "format")
    stamps, inner = [stamp for stamp, _ in sentences], _inner_times([message for _, message in sentences])
    both = np.array([pair for pair in zip(stamps, inner, strict=True) if None not in pair], dtype=float).reshape(-1, 2)
    uneven = np.ptp(both[:, 0] - both[:, 1]) - UNEVEN * np.ptp(both[:, 1]) if len(both) else 0.0
    if all(stamp is None for stamp in stamps) or uneven > SLACK_S:
        remarks += ["what stands before the sentences is no time, and theirs are taken"] if len(both) else []
        stamps = inner
    collection = Collection()
    for time, (_, message) in zip(_spread(stamps, path), sentences, strict=True):
        head = f"{getattr(message, 'talker', '')}{getattr(message, 'sentence_type', '')}" or message.identifier()
        for name, value in _fields(message):
            collection.add(f"{head}.{name}", time, value, _UNITS.get(name, ""))
    remarks += [f"{n_wrong} of {n_lines} sentences are damaged and left out"] if n_wrong else []
    return VehicleLog(path, collection.signals(), tuple(remarks))


def _stamp(match: re.Match) -> float | None:
    """The time that a logger wrote, s; None if it wrote none."""
    text = (match["tag"] or match["stamp"] or "").strip(" ,;[]")
    if not text:
        return None
    with contextlib.suppress(ValueError):
        return float(text) * (1e-3 if float(text) > LATEST else 1.0)  # in ms
    try:
        moment = datetime.datetime.fromisoformat(text)
    except ValueError:
        return None
    return (moment if moment.tzinfo else moment.replace(tzinfo=datetime.UTC)).timestamp()


def _inner_times(messages: list[Any]) -> list[float | None]:
    """The times inside of sentences, seconds since 1970 if any sentence has the date, otherwise since midnight."""
    days, before = [_midnight(message) for message in messages], None
    base = next((day for day in days if day is not None), 0.0)
    stamps: list[float | None] = []
    for message, day in zip(messages, days, strict=True):
        base = base if day is None else day
        clock = getattr(message, "timestamp", None) if "timestamp" in _names(message) else None
        if not isinstance(clock, datetime.time):
            stamps.append(None)
            continue
        seconds = clock.hour * 3600 + clock.minute * 60 + clock.second + clock.microsecond * 1e-6 + base
        if before is not None and seconds < before - HALF_DAY_S:  # past midnight
            base, seconds = base + DAY_S, seconds + DAY_S
        before = seconds
        stamps.append(seconds)
    return stamps


def _midnight(message: Any) -> float | None:
    """The beginning of the day that a sentence says, seconds since 1970; None if it says none."""
    with contextlib.suppress(AttributeError, ValueError, TypeError):
        if isinstance(message.datestamp, datetime.date):
            return datetime.datetime.combine(message.datestamp, datetime.time(), datetime.UTC).timestamp()
    return None


def _spread(stamps: list[float | None], path: Path) -> np.ndarray:
    """Times (n,) of all sentences: those between two stamps are spread over the time between them."""
    lines = np.array([k for k, stamp in enumerate(stamps) if stamp is not None])
    if not lines.size:
        message = f"{path}: no sentence has a time (RMC, GGA, GLL, ZDA), nor did the logger write one; "
        raise InputError(message + "log one of these too", "data")
    moments = np.array([stamps[k] for k in lines], dtype=float)
    new = np.append(True, np.diff(moments) != 0.0)  # sentences of one epoch share its time: the next are spread after
    marks, ends = lines[new], moments[new]
    if len(marks) > 1:  # what follows the last stamp is spread as what came before it
        marks = np.append(marks, 2 * marks[-1] - marks[-2])
        ends = np.append(ends, 2 * ends[-1] - ends[-2])
    times = np.interp(np.arange(len(stamps)), marks, ends)
    times[lines] = moments
    return times


def _names(message: Any) -> list[str]:
    return [field[1] for field in getattr(message, "fields", ())]


def _fields(message: Any) -> Iterator[tuple[str, float]]:
    """Names and values of the fields that are numbers; latitude and longitude in degrees, rates of turn by second."""
    names = [name for name in _names(message) if name not in ("timestamp", "datestamp")]
    if "lat" in names and "lon" in names:
        if message.lat and message.lon:
            yield "latitude", float(message.latitude)
            yield "longitude", float(message.longitude)
        names = [name for name in names if name not in ("lat", "lat_dir", "lon", "lon_dir")]
    for name in names:
        with contextlib.suppress(TypeError, ValueError):
            value = float(getattr(message, name))
            yield name, value / 60.0 if name == "rate_of_turn" else value
