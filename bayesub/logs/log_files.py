"""Track, record and control-history CSV: one format, units in the column names.

In memory columns have the short names of the field and SI units:

- ``time``;
- ``delta_r delta_b delta_s`` and ``rpm``, the controls;
- ``x y z phi theta psi u v w p q r`` and ``udot .. rdot``, the motion, with ``u v w`` through the water;
- ``depth`` by pressure, ``heading`` by a compass, and ``u_ground v_ground w_ground``, body velocities over the ground;
- ``north east down``, the velocity over the ground in inertial axes, ``sog`` and ``cog``, its horizontal speed and
  course, and ``stw``, the horizontal speed through the water.

Latitude and longitude become ``x y``, and pressure becomes ``depth``. An empty cell is no reading (not a number).
"""

import gzip
import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack
from itertools import chain, pairwise
from pathlib import Path
from typing import Any

import numpy as np

from bayesub.io import toml_files
from bayesub.io.atomic import replacing, writing
from bayesub.io.errors import InputError, nearest
from bayesub.io.terminal import SILENT, Progress
from bayesub.io.units import DEGREE, KNOT

VELOCITIES = ("u", "v", "w", "p", "q", "r")
ACCELERATIONS = ("udot", "vdot", "wdot", "pdot", "qdot", "rdot")
ANGLES = ("phi", "theta", "psi")
STATES = ("x", "y", "z", *ANGLES, *VELOCITIES)
OUTPUTS = (*STATES, *ACCELERATIONS)
CONTROLS = ("delta_r", "delta_b", "delta_s")

WRITTEN = "%.12g"  # digits of a number in a file
COMMENTS = ("#", "%", "//")  # how lines begin that are none
CHUNK = 20_000  # rows that are searched at a time for what is wrong with a file

_LINEAR = {name: f"{name}_m" for name in "xyz"} | {name: f"{name}_mps" for name in "uvw"}
_LINEAR |= {name: f"{name}_mps2" for name in ACCELERATIONS[:3]}
_ANGULAR = {"delta_r": "rudder", "delta_b": "bow_plane", "delta_s": "stern_plane"}
_ANGULAR |= {"phi": "roll", "theta": "pitch", "psi": "yaw"}

# Short name -> column header as written (HEADERS), and header -> (short name, SI units in one unit of it) as read
# (COLUMNS).
HEADERS = {"time": "time_s", **{k: f"{v}_deg" for k, v in _ANGULAR.items()}, "rpm": "rpm", **_LINEAR}
HEADERS |= {name: f"{name}_degps" for name in "pqr"} | {name: f"{name}_degps2" for name in ACCELERATIONS[3:]}
HEADERS |= {"depth": "depth_m", "heading": "heading_deg"} | {f"{name}_ground": f"{name}_ground_mps" for name in "uvw"}
HEADERS |= {name: f"velocity_{name}_mps" for name in ("north", "east", "down")}
HEADERS |= {"sog": "speed_over_ground_mps", "cog": "course_over_ground_deg", "stw": "speed_through_water_mps"}
COLUMNS = {header: (name, DEGREE if "_deg" in header else 1.0) for name, header in HEADERS.items()}
COLUMNS |= {header.replace("_deg", "_rad"): (name, 1.0) for name, header in HEADERS.items() if "_deg" in header}
COLUMNS |= {f"{header[:-4]}_kn": (name, KNOT) for name, header in HEADERS.items() if header.endswith("_mps")}

# Pressure above that of the air, in place of a depth, and Pa in one unit of the column.
PRESSURES = {f"pressure_{unit}": ("depth", pa) for unit, pa in {"dbar": 1e4, "bar": 1e5, "kpa": 1e3, "pa": 1.0}.items()}
WEIGHT_DENSITY = 1025.0 * 9.81  # of sea water, N/m^3, where no vehicle says another
FIXES = ("latitude_deg", "longitude_deg")  # in place of x and y
LIMITS = (90.0, 360.0)
FARTHEST = 200e3  # m from the first fix

# From and to which readings of any boat can be, by short name in SI units: pitch is upright at most (and what rounding
# adds), the sea is 11 km deep, and what flies above it or turns thrice a second is no boat. Planes are upright at most
# too, in the unit of their column: whether that is the right one is seen by :mod:`bayesub.logs.consistency`.
_UPRIGHT, _DEEPEST, _FASTEST = 90.1, 12e3, 1080.0 * DEGREE
POSSIBLE = {"theta": (-_UPRIGHT * DEGREE, _UPRIGHT * DEGREE), "depth": (-100.0, _DEEPEST), "z": (-_DEEPEST, _DEEPEST)}
POSSIBLE |= dict.fromkeys("pqr", (-_FASTEST, _FASTEST))
LONGEST = 366 * 86400.0  # s from the first row to the last
VAST = 1e15  # sizes beyond are no readings of anything: 9.96921e36 and 1e38 stand for them

CONTROL_COLUMNS = tuple(HEADERS[name] for name in (*CONTROLS, "rpm"))


def si_factor(name: str) -> float:
    """SI units in one unit of a column: pi/180 for ``yaw_deg``, 1 for ``yaw_rad`` and ``x_m``.

    The name is a header, or the short one of a quantity for the column as it is written. Controls of equation sets and
    actuators have columns of their own, such as ``fin_1_deg`` and ``thruster_n``.
    """
    header = HEADERS.get(name, name)
    return COLUMNS[header][1] if header in COLUMNS else (DEGREE if header.endswith("_deg") else 1.0)


def positions(*names: str) -> list[int]:
    """Where states (or accelerations, which follow them) of these short names stand in :data:`OUTPUTS`."""
    return [OUTPUTS.index(name) for name in names]


def short_name(header: str) -> str:
    """The short name of what a column becomes, that of the column itself if it is of a vehicle's own."""
    return _columns(()).get(header, (header,))[0]


def read_log(
    path: Path, controls: Iterable[str] = (), *, ascending: bool = True, weight_density: float = WEIGHT_DENSITY
) -> dict[str, np.ndarray]:
    """Read a CSV file into short name -> (n,) array in SI units.

    Besides the columns of all logs it may have those of `controls`, whose short names are the columns themselves.

    Numbers are parsed directly, a million rows in seconds and in little more memory than they fill. Only a file in
    which that fails is read a second time as text, to find the line that is wrong. If `ascending`, times that do not
    ascend are an error. By the weight density of the water, N/m^3, pressure becomes depth.
    """
    return next(read_parts(path, controls, ascending=ascending, weight_density=weight_density))


def read_parts(
    path: Path,
    controls: Iterable[str] = (),
    *,
    ascending: bool = True,
    weight_density: float = WEIGHT_DENSITY,
    most: float = np.inf,
    progress: Progress = SILENT,
) -> Iterator[dict[str, np.ndarray]]:
    """The log of :func:`read_log` in parts of some `most` rows."""
    path = Path(path)
    columns, names, fix, first = _columns(controls), headers(path, controls), np.zeros(0), np.nan
    for cells, line in _numbers(path, names, most, progress):
        if not len(line):
            raise InputError(f"{path}: has a header but no rows", "data")
        log = {}
        for name in names:
            values, (least, largest) = cells.pop(name), possible(name, columns, weight_density)
            for row in np.flatnonzero((values < least) | (values > largest))[:1]:
                excess = f"{values[row]:g} is beyond {largest if values[row] > 0 else least:.4g}, which no boat is"
                remedy = "check the unit, or empty the cell"
                if stands_for_missing(values[row : row + 1])[0]:
                    remedy = "empty it if it stands for no reading (in a map missing = "
                    remedy += f"[{values[row]:.12g}] leaves out all such cells)"
                raise InputError(f"{path}: line {line[row]}, column '{name}': {excess}; {remedy}", "unit", name)
            log[columns[name][0]] = values * columns[name][1]
        if any(columns[name] == PRESSURES.get(name) for name in names):  # and not a control of the vehicle
            log["depth"] = log["depth"] / weight_density
        if any(name in FIXES for name in names):
            log["x"], log["y"], fix = _positions_of_fixes(path, names, log, line, fix)
        times = log["time"]
        if not np.isfinite(times).all():
            raise InputError(f"{path}: line {line[~np.isfinite(times)][0]}: time_s is empty", "data", "time_s")
        first = times[0] if np.isnan(first) else first
        if np.ptp([first, times.min(), times.max()]) > LONGEST:
            message = f"{path}: time_s spans {np.ptp([first, times.min(), times.max()]):.3g} s, more than a year; "
            raise InputError(message + "check the unit, or cut the log", "unit", "time_s")
        for k in np.flatnonzero(np.diff(times) <= 0)[:1] if ascending else ():
            found = f"found {times[k + 1]:.12g} after {times[k]:.12g}"
            raise InputError(f"{path}: line {line[k + 1]}: time_s must ascend, {found}", "data", "time_s")
        yield log


def stands_for_missing(values: np.ndarray) -> np.ndarray:
    """Which numbers (n,) programs write for a reading that is missing: nines, ends of integers, vast ones."""
    sizes = np.abs(values)
    nines = [10.0**k - 10.0**-m for k in range(2, 8) for m in range(4)]
    ends = [2.0**k - one for k in (7, 8, 15, 16, 31, 32) for one in (0.0, 1.0)]
    return (sizes > VAST) | np.isclose(sizes[:, None], nines + ends, rtol=1e-9).any(axis=1)


def headers(path: Path, controls: Iterable[str] = ()) -> list[str]:
    """The names of the columns of a file as they stand there, all of them known or among `controls`."""
    columns = _columns(controls)
    header = toml_files.read_line(path)
    if not header:
        raise InputError(f"{path}: is empty; expected a header line such as time_s,x_m,y_m", "format")
    for separator, word in ((";", "semicolons"), ("\t", "tabs")):
        if separator in header and "," not in header:
            remedy = "separate them by commas, with decimal points"
            raise InputError(f"{path}: columns are separated by {word}; {remedy}", "format")
    names = [name.strip().strip('"') for name in header.split(",")]
    if names[0].startswith(COMMENTS):
        raise InputError(f"{path}: line 1 is a comment; delete it, so that the names come first", "format", names[0])
    for k, name in enumerate(names, 1):
        if not name:
            message = f"{path}: line 1: column {k} has no name, as after a comma too many; name it or delete it"
            raise InputError(message, "format")
        if name not in columns:
            quantity = name.rpartition("_")[0].lower() or None
            same = [column for column in HEADERS.values() if column.rpartition("_")[0] == quantity]  # in another unit
            hint = "" if controls else "a control of a boat of your own needs that boat before the log"
            suggestion = f": did you mean '{same[0]}'?" if same else nearest(name, columns, hint)
            raise InputError(f"{path}: unknown column '{name}'{suggestion}", "unknown", name)
    if "time_s" not in names:
        raise InputError(f"{path}: column 'time_s' is missing", "missing", "time_s")
    shorts = [columns[name][0] for name in names]
    if len(set(shorts)) < len(shorts):
        repeated = next(name for name, short in zip(names, shorts, strict=True) if shorts.count(short) > 1)
        raise InputError(f"{path}: column '{repeated}' is given twice", "conflict", repeated)
    return names


def _columns(controls: Iterable[str]) -> dict[str, tuple[str, float]]:
    """:data:`COLUMNS` with all others that a file may have, those of a vehicle's own among them."""
    own = {name: (name, si_factor(name)) for name in controls if name not in COLUMNS}
    return COLUMNS | dict(zip(FIXES, (("x", 1.0), ("y", 1.0)), strict=True)) | PRESSURES | own


def possible(
    name: str, columns: dict[str, tuple[str, float]] = COLUMNS, weight_density: float = WEIGHT_DENSITY
) -> tuple[float, float]:
    """From and to which numbers of a column can be, in its unit; commands as what they order."""
    (short, factor), size = columns[name], toml_files.largest(name)
    if short == "depth" and name in PRESSURES:
        factor = PRESSURES[name][1] / weight_density
    if columns.get(name.replace("_command_", "_"), ("",))[0] in CONTROLS:
        return -_UPRIGHT, _UPRIGHT
    least, most = POSSIBLE.get(short, (-np.inf, np.inf))
    return max(-size, least / factor), min(size, most / factor)


def _numbers(
    path: Path, names: list[str], most: float, progress: Progress
) -> Iterator[tuple[dict[str, np.ndarray], np.ndarray]]:
    """Column -> the n cells of a file, blank rows left out, and the lines (n,) where they stand, part by part."""
    import pandas as pd

    options: dict[str, Any] = {"skiprows": 1, "names": names, "header": None, "index_col": False, "chunksize": CHUNK}
    options |= {"encoding": "utf-8-sig", "skip_blank_lines": False, "skipinitialspace": True}
    cells, is_short = {name: list[np.ndarray]() for name in ("", *names)}, False  # by columns, and the lines
    try:
        with toml_files.reading(path), warnings.catch_warnings(), ExitStack() as stack:
            warnings.simplefilter("error", pd.errors.ParserWarning)
            try:
                file = stack.enter_context(path.open("rb"))
                text = stack.enter_context(gzip.open(file)) if path.suffix == ".gz" else file
                with pd.read_csv(text, dtype=float, **options) as tables:
                    for table, following in pairwise(chain(tables, [None])):
                        progress.update(round(file.tell() / 1e6), round(path.stat().st_size / 1e6), "MB")
                        filled = table.notna().any(axis=1)
                        cells[""].append(table.index[filled].to_numpy() + 2)
                        for name in names:
                            cells[name].append(table[name][filled].to_numpy())
                        is_short |= bool(np.isnan(cells[names[-1]][-1]).any())
                        if following is not None and sum(map(len, cells[""])) < most:
                            continue
                        line, *columns = (np.concatenate(cells.pop(name)) for name in ("", *names))
                        cells = {name: [] for name in ("", *names)}
                        if any(np.isinf(values).any() for values in columns):
                            raise _not_a_number(path, options)
                        if following is None and is_short:
                            _refuse_short(path, len(names))
                        yield dict(zip(names, columns, strict=True)), line
            except (InputError, pd.errors.ParserError, UnicodeDecodeError):
                raise
            except ValueError:
                raise _not_a_number(path, options) from None
    except pd.errors.ParserWarning:
        message = f"{path}: line 2: has more cells than there are columns; write decimal points"
        raise InputError(message, "format") from None
    except pd.errors.ParserError as error:
        reason = str(error).strip().splitlines()[-1].rpartition("error: ")[2]
        raise InputError(f"{path}: {reason}; write decimal points, not commas", "format") from None


def _refuse_short(path: Path, n_columns: int) -> None:
    """InputError for a line of fewer cells than there are columns, some of which are under other names than theirs."""
    with (gzip.open if path.suffix == ".gz" else open)(path, "rt", encoding="utf-8-sig") as file:
        for k, line in enumerate(file, 1):
            if line.strip() and (n := line.count(",") + 1) < n_columns:
                message = f"{path}: line {k}: has {n} cells, expected {n_columns}; an empty cell needs its comma too"
                raise InputError(message, "format")


def _not_a_number(path: Path, options: dict[str, Any]) -> InputError:
    """The error that names the first cell that is neither empty nor a finite number."""
    import pandas as pd

    with pd.read_csv(path, dtype=str, **options) as tables:
        for table in tables:
            numbers = table.apply(pd.to_numeric, errors="coerce").to_numpy(dtype=float)
            wrong = np.argwhere(table.notna().to_numpy() & ~np.isfinite(numbers))
            if wrong.size:
                row, column = wrong[0]
                cell, name = table.iat[row, column], table.columns[column]
                where = f"{path}: line {table.index[row] + 2}, column '{name}'"
                if "\0" in cell:
                    message = f"{where}: holds bytes of zero, as a loss of power leaves them; delete these lines"
                    return InputError(message, "data", name)
                hint = "write a decimal point" if "," in cell else "empty such cells, as bayesub convert csv does"
                others = f", one of {len(wrong)} such cells" if len(wrong) > 1 else ""
                return InputError(f"{where}: '{cell}' is not a finite number{others}; {hint}", "data", name)
    return InputError(f"{path}: holds cells that are not finite numbers", "data")


def _positions_of_fixes(
    path: Path, names: list[str], log: dict[str, np.ndarray], line: np.ndarray, first: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x and y (n,) of fixes on the ellipsoid WGS 84, in the plane that touches it at the first fix, m; and this.

    The `log` has the fixes (n,) in place of x and y, as they stand in the lines `line` (n,) of the columns `names`.
    """
    for one, other in (FIXES, FIXES[::-1]):
        if one not in names:
            message = f"{path}: column '{other}' is given without '{one}'; add it or leave both out"
            raise InputError(message, "missing", one)
    fixes = np.stack([log["x"], log["y"]], axis=1)
    for name, values, limit in zip(FIXES, fixes.T, LIMITS, strict=True):
        for k in np.flatnonzero(np.abs(values) > limit)[:1]:
            message = f"{path}: line {line[k]}, column '{name}': {values[k]:g} is beyond {limit:g}"
            raise InputError(message, "value", name)
    whole = np.flatnonzero(np.isfinite(fixes).all(axis=1))
    if not len(first) + len(whole):
        raise InputError(f"{path}: no row has both {FIXES[0]} and {FIXES[1]}", "data", FIXES[0])
    import pymap3d  # here, since most logs have none

    first = first if len(first) else fixes[whole[0]]
    relative = np.full((len(fixes), 3), np.nan)
    for part in np.array_split(whole, 1 + len(whole) // CHUNK):
        relative[part] = np.stack(pymap3d.geodetic2ned(*fixes[part].T, 0.0, *first, 0.0), axis=-1)
    distance = np.linalg.norm(relative, axis=1)
    for k in np.flatnonzero(distance > FARTHEST)[:1]:
        fix, begin = (f"{values[0]:g}, {values[1]:g}" for values in (fixes[k], first))
        where = f"line {line[k]}: the fix {fix} is {distance[k] / 1e3:.0f} km from the first, {begin}"
        raise InputError(f"{path}: {where}; empty the cells of what is no fix", "data", FIXES[0])
    return relative[:, 0], relative[:, 1], first


def write_log(path: Path, log: dict[str, np.ndarray]) -> None:
    """Write short name -> (n,) array in SI units as CSV; values read back to twelve digits."""
    parts = (slice(k, k + CHUNK) for k in range(0, max(len(one) for one in log.values()), CHUNK))
    tables = ({HEADERS.get(name, name): log[name][part] / si_factor(name) for name in log} for part in parts)
    write_columns(path, tables)


def write_columns(path: Path, tables: Iterable[Mapping[str, np.ndarray]]) -> None:
    """Write tables of the same columns, name -> (n,) cells in its unit, one below the other as CSV."""
    order = {header: k for k, header in enumerate(HEADERS.values())}
    opened, names = gzip.open if path.suffix == ".gz" else open, list[str]()
    with writing(path), replacing(path) as partial, opened(partial, "wt", encoding="utf-8") as file:
        for table in tables:
            if not names:
                names = sorted(table, key=lambda name: order.get(name, len(order)))
                row = ",".join([WRITTEN] * len(names)) + "\n"
                file.write(",".join(names) + "\n")
            rows = np.stack([table[name] for name in names], axis=1)
            file.write("".join([row % tuple(line) for line in rows.tolist()]).replace("nan", ""))
