"""Track, record and control-history CSV: one format, units in the column names (design section 5).

Inside, columns have the short names of the field and SI units: ``time``; ``delta_r delta_b delta_s`` and ``rpm``;
``x y z phi theta psi u v w p q r`` and ``udot .. rdot``; ``depth`` by pressure, ``heading`` by a compass and
``u_ground v_ground w_ground``, body velocities over the ground where ``u v w`` are through the water. Empty cells are
missing readings (not a number).
"""

import io
from pathlib import Path

import numpy as np

from bayesub import inputs
from bayesub.coefficients import ACCELERATIONS, VELOCITIES, nearest
from bayesub.errors import InputError

STATES = ("x", "y", "z", "phi", "theta", "psi", *VELOCITIES)
OUTPUTS = (*STATES, *ACCELERATIONS)
CONTROLS = ("delta_r", "delta_b", "delta_s")

WRITTEN = "%.12g"  # digits of a number in a file

_DEGREE = np.pi / 180.0
_LINEAR = {name: f"{name}_m" for name in "xyz"} | {name: f"{name}_mps" for name in "uvw"}
_LINEAR |= {name: f"{name}_mps2" for name in ACCELERATIONS[:3]}
_ANGULAR = {"delta_r": "rudder", "delta_b": "bow_plane", "delta_s": "stern_plane"}
_ANGULAR |= {"phi": "roll", "theta": "pitch", "psi": "yaw"}

# Short name -> column header as written (HEADERS), and header -> (short name, factor to SI) as read (COLUMNS).
HEADERS = {"time": "time_s", **{k: f"{v}_deg" for k, v in _ANGULAR.items()}, "rpm": "rpm", **_LINEAR}
HEADERS |= {name: f"{name}_degps" for name in "pqr"} | {name: f"{name}_degps2" for name in ACCELERATIONS[3:]}
HEADERS |= {"depth": "depth_m", "heading": "heading_deg"} | {f"{name}_ground": f"{name}_ground_mps" for name in "uvw"}
COLUMNS = {header: (name, _DEGREE if "_deg" in header else 1.0) for name, header in HEADERS.items()}
COLUMNS |= {header.replace("_deg", "_rad"): (name, 1.0) for name, header in HEADERS.items() if "_deg" in header}

CONTROL_COLUMNS = tuple(HEADERS[name] for name in (*CONTROLS, "rpm"))


def read_log(path: Path) -> dict[str, np.ndarray]:
    """Read a CSV file into short name -> (n,) array in SI units; InputError names file, column or line, and remedy."""
    import pandas as pd

    path = Path(path)
    text = inputs.read_text(path)
    header = text.partition("\n")[0].strip()
    if not header:
        raise InputError(f"{path}: is empty; expected a header line such as time_s,x_m,y_m")
    if ";" in header and "," not in header:
        raise InputError(f"{path}: columns are separated by semicolons; separate them by commas")
    names = [name.strip() for name in header.split(",")]
    for name in names:
        if name not in COLUMNS:
            raise InputError(f"{path}: unknown column '{name}'{nearest(name, COLUMNS)}")
    if "time_s" not in names:
        raise InputError(f"{path}: column 'time_s' is missing")
    shorts = [COLUMNS[name][0] for name in names]
    if len(set(shorts)) < len(shorts):
        repeated = next(name for name, short in zip(names, shorts, strict=True) if shorts.count(short) > 1)
        raise InputError(f"{path}: column '{repeated}' is given twice")
    try:
        options = {"skiprows": 1, "names": names, "header": None, "dtype": str, "index_col": False}
        table = pd.read_csv(io.StringIO(text), skip_blank_lines=False, **options)
    except (pd.errors.ParserError, pd.errors.ParserWarning) as error:
        raise InputError(f"{path}: {str(error).strip().splitlines()[-1]}") from None
    table = table.dropna(how="all")
    line = table.index.to_numpy() + 2
    if table.empty:
        raise InputError(f"{path}: has a header but no rows")
    log = {}
    for name in names:
        short, factor = COLUMNS[name]
        given = table[name].notna().to_numpy()
        values = pd.to_numeric(table[name], errors="coerce").to_numpy(dtype=float)
        wrong = np.flatnonzero(given & ~np.isfinite(values))
        if wrong.size:
            found = table[name].iloc[wrong[0]]
            raise InputError(f"{path}: line {line[wrong[0]]}, column '{name}': '{found}' is not a finite number")
        beyond = np.flatnonzero(np.abs(values) > inputs.largest(name))
        if beyond.size:
            told = f"{values[beyond[0]]:g} is beyond {inputs.largest(name):g}"
            raise InputError(f"{path}: line {line[beyond[0]]}, column '{name}': {told}; check the unit")
        log[short] = values * factor
    times = log["time"]
    if not np.isfinite(times).all():
        raise InputError(f"{path}: line {line[~np.isfinite(times)][0]}: time_s is empty")
    late = np.flatnonzero(np.diff(times) <= 0)
    if late.size:
        raise InputError(f"{path}: line {line[late[0] + 1]}: time_s must ascend, found {times[late[0] + 1]:g}")
    return log


def write_log(path: Path, log: dict[str, np.ndarray]) -> None:
    """Write short name -> (n,) array in SI units as CSV; values read back to twelve digits."""
    import pandas as pd

    table = pd.DataFrame({HEADERS[name]: log[name] / COLUMNS[HEADERS[name]][1] for name in HEADERS if name in log})
    try:
        table.to_csv(path, index=False, float_format=WRITTEN)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {(error.strerror or str(error)).lower()}") from None
