"""Map files: which signal of a vehicle's log becomes which column of ours, and how."""

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

import pydantic

from bayesub.io import units
from bayesub.io.errors import InputError, check_known
from bayesub.io.toml_files import Positive, Section, WaterDensity, read_toml
from bayesub.logs import log_files

# How columns of a vehicle's own actuators end, in units and as the vehicle counts them.
OWN = ("_deg", "_rpm", "_n", "_nm", "_cm3", "_m", "_mps", "_kgm3", "_counts", "_percent", "_us")


# Units of times, in files and maps, besides s, ms, us and ns -> s; plurals are of these.
TIMES = {"sec": 1.0, "second": 1.0, "msec": 1e-3, "usec": 1e-6, "min": 60.0, "minute": 60.0}
TIMES |= {"h": 3600.0, "hr": 3600.0, "hour": 3600.0, "d": 86400.0, "day": 86400.0}


def seconds_in(unit: str) -> float:
    """Seconds in a unit of time of any spelling; InputError for one that is not known."""
    size = TIMES.get(unit.strip().lower().removesuffix("s"))
    if size is None and not units.known(unit):
        raise InputError(f"unknown unit '{unit}' of time; known are s, ms, us, ns, min, h and d", "unit", "unit")
    return size or units.factor(unit, "s")


Unit = Annotated[str, pydantic.AfterValidator(lambda unit: units.find(unit) and unit)]  # find refuses unknown ones
TimeUnit = Annotated[str, pydantic.AfterValidator(lambda unit: seconds_in(unit) and unit)]


class Clock(Section):
    """Where the time stamps of a file or of a part of it stand, and how they are read."""

    signal: str | None = None  # the signal that holds the time stamps; of tables and of files of arrays only
    date: str | None = None  # the column of dates or of GPS weeks, if the stamps are of the day or of the week only
    # what the stamps are: a pattern of dates such as ``%d/%m/%Y``, or a count (:mod:`bayesub.logs.readers.stamps`)
    format: str | None = None
    unit: TimeUnit | None = None  # their unit; by default what the file says, what the numbers show, or seconds
    wraps_every_s: Positive | None = None  # after how many seconds the clock begins again at its smallest time


class TimeSection(Clock):
    """The clock of the converted log."""

    # table, variable or structure with another clock than the rest -> where its stamps stand
    tables: dict[str, Clock] = pydantic.Field(default_factory=dict)
    # what becomes 0 s: a time of the file's clock (s), or the first reading of the columns
    zero: float | Literal["first"] = "first"
    start_s: float | None = None  # what is kept, seconds from zero
    end_s: float | None = None

    def clock(self, table: str) -> Clock:
        """The clock of a table, or that of all where it says nothing."""
        own = self.tables.get(table)
        return self if own is None else self.model_copy(update=own.model_dump(exclude_unset=True))

    def _check(self):
        if self.start_s is not None and self.end_s is not None and not self.start_s < self.end_s:
            raise ValueError(f"start_s ({self.start_s:g}) must be before end_s ({self.end_s:g})")


class ColumnSection(Section):
    """How a column is made: sign * (factor * (value - zero), in the unit of the column) + offset."""

    signal: str  # name of the signal
    # unit of the signal, or of factor times the signal; by default that of the file without a factor, and that of the
    # column with one
    unit: Unit | None = None
    zero: float = 0.0  # value of the signal that means zero, such as the counts of a fin amidships
    factor: float | None = None  # units for each count or per cent
    # in place of zero and factor: value of the signal, value of the column; straight between them
    points: tuple[tuple[float, float], ...] | None = None
    sign: Literal[1, -1] = 1  # -1 if the file has the positive direction the other way round
    offset: float = 0.0  # added at the end, in the unit of the column
    held: bool = False  # the value holds until the next, as an order does; otherwise a straight line joins them
    delay_s: float = 0.0  # how late the time stamps are
    interval_s: Positive | None = None  # at most one reading in this time
    average: bool = False  # that reading is the mean of all in this time, at the mean of their times
    valid: tuple[float, float] | None = None  # values of the signal outside of these are no readings
    missing: tuple[float, ...] = ()  # values of the signal that stand for no reading
    wrap: bool = False  # angles are brought to 0 .. 360 degrees
    water_density_kgm3: WaterDensity | None = None  # makes a depth of a pressure
    optional: bool = False  # the file may lack the signal

    def _check(self):
        if self.points is not None:
            if self.factor is not None or self.zero != 0.0:
                raise ValueError("points take the place of zero and factor; leave these out")
            values = [value for value, _ in self.points]
            if len(values) < 2 or any(b <= a for a, b in pairwise(values)):
                raise ValueError("points needs two pairs or more, the values of the signal ascending")
        if self.average and (self.interval_s is None or self.held):
            raise ValueError("average needs interval_s, and is not for an order that is held")
        if self.factor == 0.0:
            raise ValueError("factor must not be zero")
        if self.valid is not None and not self.valid[0] < self.valid[1]:
            raise ValueError("valid is [smallest, largest]")


class LogMap(Section):
    """A map file."""

    kind: str | None = None  # kind of log that the map is for
    cache: str | None = None  # of ``slocum``: the folder of the cache files (.cac)
    # of ``ros``: files (.msg) of messages that the bag does not define, or folders of them
    definitions: tuple[str, ...] = ()
    # of tables: column -> what it holds in the rows that are read, such as the name of one of several vehicles
    where: dict[str, str | float] = pydantic.Field(default_factory=dict)
    time: TimeSection = TimeSection()
    columns: dict[str, ColumnSection] = pydantic.Field(default_factory=dict)  # column of our log -> how it is made


def read_map(path: Path, kind: str | None = None) -> LogMap:
    """Read a map file, if it is for logs of this kind; paths in it count from its folder.

    InputError with file, key and remedy.
    """
    log_map = read_toml(path, LogMap)
    if None not in (kind, log_map.kind) and log_map.kind != kind:
        raise InputError(f"{path}: key 'kind': this map is for '{log_map.kind}', not for '{kind}'", "conflict", "kind")
    if not log_map.columns:
        example = f"bayesub new map {kind or log_map.kind or 'KIND'} writes an example"
        raise InputError(f"{path}: has no section [columns.NAME]; {example}", "missing", "columns")
    known = [name for name in (*log_files.COLUMNS, *log_files.PRESSURES, *log_files.FIXES) if name != "time_s"]
    names: dict[str, str] = {}  # quantity -> column
    for column, section in log_map.columns.items():
        where, key = f"{path}: key 'columns.{column}'", f"columns.{column}"
        if column == "time_s":
            message = f"{where}: times come with each signal; the section [time] says what is zero"
            raise InputError(message, "unknown", key)
        if not column.endswith(OWN):
            hint = "the page 'files' of the manual lists them, and those of a vehicle's own actuators end with one of "
            check_known(column, known, f"{where}: unknown column", hint=hint + ", ".join(OWN), key=key)
        if section.wrap and not column.endswith(("_deg", "_rad")):
            raise InputError(f"{where}: wrap is for angles; leave it out", "conflict", f"{key}.wrap")
        other = names.setdefault(log_files.short_name(column), column)
        if other != column:
            raise InputError(f"{where}: is the same quantity as '{other}'; leave one of them out", "conflict", key)
    folder = path.parent
    cache = None if log_map.cache is None else str(folder / log_map.cache)
    definitions = tuple(str(folder / name) for name in log_map.definitions)
    return log_map.model_copy(update={"cache": cache, "definitions": definitions})
