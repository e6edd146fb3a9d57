"""Columns that repeat one value while they should move."""

import numpy as np

from bayesub.logs.finding import Finding
from bayesub.logs.log_files import ACCELERATIONS  # which do jump
from bayesub.logs.relations import ANGLES
from bayesub.logs.series import Series

LEAST = 20  # readings in a row
CHANCE = 1e-6  # probability of so many repeats, beyond which they are looked at
JUMP = 8.0  # usual changes by which a column catches up when it is released, and
LARGEST = 2.0  # times as much as all changes but the
OUTLIERS = 4  # largest ones
ALIKE = 0.45  # share of second differences with the sign of the one before: 0.27 of noise, next to 1 of smooth motion


def findings(
    data: dict[str, Series], headers: dict[str, str], controls: tuple[str, ...] = ()
) -> tuple[dict[str, Series], list[Finding]]:
    """Columns that hold one value for long and then jump, or whose noise stops, and the readings without it.

    Parameters
    ----------
    data : dict of str to Series
        Short name -> readings.
    headers : dict of str to str
        Short name -> header.
    controls : tuple of str
        Short names of columns that may stand still.
    """
    data, result = dict(data), []
    for name, column in list(data.items()):
        if name in controls:
            continue
        values = column.unwrapped().values if name in ANGLES else column.values
        run = _longest(values)
        if run is None:
            continue
        first, last = run
        others = np.concatenate([np.diff(values[: first + 1]), np.diff(values[last:])])
        moving = np.abs(others[others != 0.0])
        if len(moving) < LEAST:
            continue
        release = abs(values[last + 1] - values[last]) if last + 1 < len(values) else 0.0
        usual = max(JUMP * np.median(moving), LARGEST * np.sort(moving)[-OUTLIERS])
        by_chance = (1.0 - len(moving) / len(others)) ** (last - first) * len(others) > CHANCE
        if release > usual and not by_chance and name not in ACCELERATIONS:
            evidence = f", and then jumps by {release / np.median(moving):.3g} times its usual change"
        elif first > 0 and _noise_stops(values, first, last):
            evidence = ", where its noise is not seen"
        else:
            continue
        begin, end = column.times[first], column.times[last]
        message = f"stands still for {last - first + 1} readings from {begin:.6g} to {end:.6g} s{evidence}"
        result.append(Finding("stuck", (headers[name],), message, "empty these cells"))
        rest = np.delete(np.arange(len(column.times)), slice(first + 1, last + 1))
        data[name] = Series(column.times[rest], column.values[rest])
    return data, result


def _longest(values) -> tuple[int, int] | None:
    """First and last position of the longest run of one value, if it is long and the column moves at all."""
    changes = np.flatnonzero(np.diff(values) != 0.0)
    starts, ends = np.concatenate([[0], changes + 1]), np.concatenate([changes, [len(values) - 1]])
    k = int(np.argmax(ends - starts))
    first, last = int(starts[k]), int(ends[k])
    return (first, last) if last - first + 1 >= LEAST and len(changes) >= LEAST else None


def _noise_stops(values, first, last) -> bool:
    """Whether a column is noisy on both sides of a run, so that it nowhere repeats itself so often by chance."""
    sides = [side for side in (values[: first + 1], values[last:]) if len(side) > 2 * LEAST]
    repeats = []
    for side in sides:
        bends = np.sign(np.diff(side, 2))
        if np.mean(bends[1:] == bends[:-1]) > ALIKE:
            return False
        same = np.convolve(np.diff(side) == 0.0, np.ones(2 * LEAST) / (2 * LEAST), mode="valid")
        repeats.append(float(same.max()))
    return bool(sides) and max(repeats) ** (last - first) * len(values) < CHANCE
