"""Free-running trials of the tanker model KVLCC2 for the workshop SIMMAN of 2008, as HSVA and MARIN wrote them (.dat).

The columns are by position. What they are was found from the numbers: the differences of the third column follow the
sixth to 3 parts in 100,000, so the velocities are those of the track in earth axes, not u and v of the ship; the
differences of the heading follow the column behind them.
"""

import re
from pathlib import Path

import numpy as np

from bayesub.io.errors import InputError
from bayesub.logs.log_map import LogMap
from bayesub.logs.readers.signals import Signal, VehicleLog

HSVA = {"x": "m", "y": "m", "psi": "deg", "dx_dt": "m/s", "dy_dt": "m/s", "r": "deg/s", "roll": "deg"}
HSVA |= {"rudder": "deg", "n": "1/s", "thrust": "N", "torque": "N m"}
MARIN = {"x": "m", "y": "m", "roll": "deg", "psi": "deg", "dx_dt": "m/s", "dy_dt": "m/s", "p": "deg/s", "r": "deg/s"}
MARIN |= {"rudder": "deg", "n": "rpm"}
_HEADS = {"HSVA": HSVA, "MARIN": MARIN}
_DIGITS = 3  # of a time stamp of MARIN
_JITTER_S = 5e-3


def read(path: Path, log_map: LogMap) -> VehicleLog:  # noqa: ARG001
    """Read a file of either towing tank; a map can name its signals (:data:`HSVA`, :data:`MARIN`)."""
    lines = path.read_text(encoding="latin-1").splitlines()
    head = re.search("|".join(_HEADS), lines[0] if lines else "")
    if head is None:
        message = f"{path}: line 1 does not name HSVA or MARIN, as the files of KVLCC2 do; for other tables: csv"
        raise InputError(message, "format")
    units = _HEADS[head.group()]
    rows = [(k, line.split()) for k, line in enumerate(lines, 1) if re.match(r"\s*[-+.\d]", line)]
    for k, cells in rows:
        if len(cells) != len(units) + 1:
            message = f"{path}: line {k}: has {len(cells)} numbers, expected {len(units) + 1}; is the file whole?"
            raise InputError(message, "format")
    try:
        table = np.array([cells for _, cells in rows], dtype=float)
    except ValueError as error:
        raise InputError(f"{path}: {error}; is the file whole?", "format") from None
    if len(table) < 2:
        raise InputError(f"{path}: has no rows of numbers", "data")
    times, remarks = table[:, 0], []
    if head.group() == "MARIN":  # stamps are rounded to three digits, so that seven and more of them agree
        count = np.arange(len(times))
        interval, begin = np.polyfit(count, times, 1)
        half = 0.5 * 10.0 ** (np.floor(np.log10(np.maximum(np.abs(times), 1e-3))) + 1 - _DIGITS)
        if (np.abs(begin + interval * count - times) > 1.1 * half + _JITTER_S).any():
            raise InputError(f"{path}: its time stamps are not even, and too coarse to be used as they are", "data")
        times = interval * count
        remarks = [f"times are rounded to three digits in the file; every {interval:.6g} s in their place"]
    signals = zip(units.items(), table.T[1:], strict=True)
    return VehicleLog(path, {name: Signal(times, values, unit) for (name, unit), values in signals}, tuple(remarks))
