"""Stamps of a log: rows out of order, repeated and rounded stamps, jumps of the clock."""

import numpy as np

from bayesub.logs.finding import Finding
from bayesub.logs.series import series

UNSORTED = 3  # steps back beyond which rows are out of order rather than a clock set back
ROUNDED = 0.05  # share of rows that repeat a stamp, beyond which stamps have too few digits
JUMP = 10.0  # median intervals, beyond which a step of the clock is compared with the motion
STILL = 0.2  # share of the expected motion below which the boat stood still over the step
ALIKE = 0.25  # share of their sum by which speeds before and after may differ
_MOVED = 20.0  # median changes between readings that the expected motion must exceed
_SLOW = 0.5  # share of the median speed of the log below which nobody knows what was due: a glider at the surface


def stamps(log: dict[str, np.ndarray]) -> tuple[dict[str, np.ndarray], list[Finding]]:
    """The log with times that ascend, and what is wrong with its stamps.

    Parameters
    ----------
    log : dict of str to ndarray of shape (n,)
        Short name -> values, ``time`` among them, in the order of the file.
    """
    log, result = dict(log), []
    times = np.array(log["time"], dtype=float)
    back = np.flatnonzero(np.diff(times) < 0.0)
    forward = np.diff(times)[np.diff(times) > 0.0]
    interval = float(np.median(forward)) if len(forward) else 1.0
    if len(back) > UNSORTED:
        result.append(
            Finding("order", ("time_s",), f"{len(back)} rows are earlier than the row before", "sort the rows by it")
        )
        order = np.argsort(times, kind="stable")
        log, times = {name: values[order] for name, values in log.items()}, times[order]
    else:
        for k in back:
            step = times[k] - times[k + 1] + interval
            message = f"goes back from {times[k]:.6g} to {times[k + 1]:.6g} s"
            result.append(
                Finding("clock", ("time_s",), message, f"add {step:.4g} to the rows after it if they follow on")
            )
            times[k + 1 :] += step
    same = np.flatnonzero(np.diff(times) == 0.0)
    if len(same):
        result.append(_repeated(times, same))
        firsts = np.flatnonzero(np.concatenate([[True], np.diff(times) > 0.0]))
        if len(same) > ROUNDED * len(times):
            times = np.interp(np.arange(len(times)), firsts, times[firsts])
        firsts = np.flatnonzero(np.concatenate([[True], np.diff(times) > 0.0]))
        log, times = {name: values[firsts] for name, values in log.items()}, times[firsts]
    log["time"] = times
    return log, result


def _repeated(times, same) -> Finding:
    message = f"{len(same)} of {len(times)} rows repeat the stamp of the row before, first at {times[same[0]]:.6g} s"
    if len(same) <= ROUNDED * len(times):
        return Finding("stamp", ("time_s",), message, "delete one row of each two, or join their cells")
    step = (times[-1] - times[0]) / (len(times) - 1)
    return Finding(
        "stamp", ("time_s",), f"{message}: it has too few digits", f"space the rows evenly, every {step:.4g} s"
    )


def jumps(log: dict[str, np.ndarray]) -> list[Finding]:
    """Steps of the clock over which the boat did not move as it did before and after; times must ascend."""
    data, result = series(log), []
    steps = np.diff(log["time"])
    if not len(steps):
        return result
    for k in np.flatnonzero(steps > JUMP * np.median(steps)):
        before, after = log["time"][k], log["time"][k + 1]
        for names in (("x", "y"), ("depth",), ("z",)):
            columns = [data[name] for name in names if name in data]
            if len(columns) < len(names):
                continue
            moved, expected, typical, usual = _over(columns, before, after)
            if expected > max(_MOVED * typical, _SLOW * usual) and moved < STILL * expected:
                words = f"jumps from {before:.6g} to {after:.6g} s, in which {' and '.join(names)} change by "
                words += f"{moved:.3g} m where {expected:.3g} m are due"
                remedy = f"subtract {after - before - np.median(steps):.4g} from the rows after it"
                result.append(Finding("clock", ("time_s",), words, remedy))
            break
    return result


def _over(columns, before, after, n: int = 8):
    """Motion over a step of the clock, as read and as due by speeds beside it; the usual one of a reading and of it."""
    moved, expected, typical, usual = [], [], [], []
    for column in columns:
        first = np.searchsorted(column.times, before, side="right")
        sides = slice(max(0, first - n), first), slice(first, first + n)
        speeds = [_speed(column.times[side], column.values[side]) for side in sides]
        if first in (0, len(column.times)) or not abs(speeds[1] - speeds[0]) < ALIKE * abs(sum(speeds)):
            speeds = [0.0, 0.0]  # it turned in between, and nobody knows what was due
        moved.append(column.values[first] - column.values[first - 1])
        expected.append(np.mean(speeds) * (after - before))
        typical.append(np.median(np.abs(np.diff(column.values))))
        usual.append(typical[-1] * (after - before) / np.median(np.diff(column.times)))
    return tuple(float(np.linalg.norm(part)) for part in (moved, expected, typical, usual))


def _speed(times, values) -> float:
    return float(np.polyfit(times - times[0], values, 1)[0]) if len(times) > 2 else float("nan")
