"""What columns of a log show by themselves.

Rows of several boats, stamps, jumps of the clock, values that stand for no reading or stand still, angles that wrap.
"""

import itertools

import numpy as np

from bayesub.io.units import DEGREE, TURN
from bayesub.logs.log_files import ACCELERATIONS, FIXES, PRESSURES, si_factor, stands_for_missing
from bayesub.logs.series import ANGLES, GAP, HEADINGS, MOST, Finding, Series, series

UNSORTED = 3  # steps back beyond which rows are out of order rather than a clock set back
ROUNDED = 0.05  # share of rows that repeat a stamp, beyond which stamps have too few digits
JUMP = 10.0  # median intervals, beyond which a step of the clock is compared with the motion
STILL = 0.2  # share of the expected motion below which the boat stood still over the step
BURSTS = 12  # first steps that are compared; if most are late, stamps are those of receipt
ALIKE = 0.25  # share of their sum by which speeds before and after may differ
_MOVED = 20.0  # median changes between readings that the expected motion must exceed
IN_BURSTS = 3.0  # median changes that the expected motion between bursts exceeds
_SEEN = 1e-3  # m, below which a motion is round-off
_SLOW = 0.5  # share of the median speed of the log below which the distance due is unknown: a glider at the surface

APART = 3.0  # times the largest changes otherwise, from which on a reading is no reading
OFTEN = 3  # cells of a value that is not a usual one, from which on it may stand for no reading; in a row, if others
RARELY = 0.1  # share of the readings repeat the one before
PLACES = ("x", "y", "z", "depth", "theta", *HEADINGS)  # which go on from where they are
ROWS = 16  # in which boats are distinguished by
GROUPS = 6  # places at most, with a
BETWEEN = 0.1  # share of all between two of them at least, and less inside of each
MOSTLY = 0.6  # share of jumps or pieces that count, beyond which all do

_QUANTITIES = (("x y", "place"), ("depth", "depth"), ("z", "depth"), ("psi", "heading"), ("heading", "heading"))

LEAST = 20  # readings of one value in a row
CHANCE = 1e-6  # probability of so many repeats, beyond which they are looked at
RELEASE = 8.0  # usual changes by which a column catches up when it is released, and
LARGEST = 2.0  # times as much as all changes but the
OUTLIERS = 4  # largest ones
SMOOTH = 0.45  # share of second differences with the sign of the one before: 0.27 of noise, next to 1 of smooth motion

FAR = 30.0 * DEGREE  # from both neighbours, of a reading between two sides of a wrap
_WRAPS = 0.02  # relative width of the steps that count as wraps
_STEPS = 10.0  # median steps of an angle that a wrap exceeds
# Factor by which an angle is too large -> words, and the factor that mends it.
_UNITS = {DEGREE: "radians", 1.0 / DEGREE: "degrees", 400.0 / 360.0: "gon", 6400.0 / 360.0: "mils"}


def check_stamps(log: dict[str, np.ndarray]) -> tuple[dict[str, np.ndarray], list[Finding]]:
    """The log, short name -> (n,) values in the order of the file, with ascending times; what is wrong with stamps."""
    log, result = dict(log), []
    times = np.array(log["time"], dtype=float)
    back = np.flatnonzero(np.diff(times) < 0.0)
    forward = np.diff(times)[np.diff(times) > 0.0]
    interval = float(np.median(forward)) if len(forward) else 1.0
    if len(back) > UNSORTED:
        message = f"{len(back)} rows are earlier than the row before"
        result.append(Finding("order", ("time_s",), message, "sort the rows by it"))
        order = np.argsort(times, kind="stable")
        log, times = {name: values[order] for name, values in log.items()}, times[order]
    else:
        for k in back:
            step = times[k] - times[k + 1] + interval
            message = f"goes back from {times[k]:.6g} to {times[k + 1]:.6g} s"
            remedy = f"add {step:.4g} to the rows after it if they follow on, or cut the log there if a run begins"
            result.append(Finding("clock", ("time_s",), message, remedy))
            times[k + 1 :] += step
    same = np.flatnonzero(np.diff(times) == 0.0)
    if len(same):
        message = f"{len(same)} of {len(times)} rows repeat the stamp of the row before, first at "
        message += f"{times[same[0]]:.6g} s"
        remedy = "delete one row of each two, or join their cells"
        firsts = np.flatnonzero(np.diff(times, prepend=-np.inf) > 0.0)
        if len(same) > ROUNDED * len(times):
            message += ": it has too few digits"
            remedy = f"space the rows evenly, every {(times[-1] - times[0]) / (len(times) - 1):.4g} s"
            times = np.interp(np.arange(len(times)), firsts, times[firsts])
            firsts = np.flatnonzero(np.diff(times, prepend=-np.inf) > 0.0)
        result.append(Finding("stamp", ("time_s",), message, remedy))
        log, times = {name: values[firsts] for name, values in log.items()}, times[firsts]
    log["time"] = times
    return log, result


def check_clock(log: dict[str, np.ndarray]) -> list[Finding]:
    """Steps of the clock over which the boat did not move as it did before and after; times must ascend."""
    data, steps, late, n_bursts = series(log), np.diff(log["time"]), dict[int, tuple[str, str]](), 0
    for k in np.flatnonzero(steps > JUMP * np.median(steps))[:BURSTS] if len(steps) else ():
        before, after = log["time"][k], log["time"][k + 1]
        for names in (("x", "y"), ("depth",), ("z",)):
            columns = [data[name] for name in names if name in data]
            if len(columns) < len(names):
                continue
            moved, expected, typical, usual = _motion_over(columns, before, after)
            n_bursts += IN_BURSTS * typical < expected > max(2.0 * moved, _SEEN)
            if expected > max(_MOVED * typical, _SLOW * usual, _SEEN) and moved < STILL * expected:
                words = f"jumps from {before:.6g} to {after:.6g} s, in which {' and '.join(names)} change by "
                words += f"{moved:.3g} m where {expected:.3g} m are due"
                late[k] = words, f"subtract {after - before - np.median(steps):.4g} from the rows after it"
    if n_bursts > BURSTS // 2:
        message = "rows come in bursts, between which the boat moves as little as within them: times of receipt"
        remedy = "take the stamps of the header of each message ([time] signal in a map), or space the rows evenly"
        return [Finding("clock", ("time_s",), message, remedy)]
    return [Finding("clock", ("time_s",), *late[k]) for k in late]


def check_runs(data: dict[str, Series], headers: dict[str, str]) -> list[Finding]:
    """Where two of place, depth and heading are elsewhere from one reading to the next, as where runs were joined."""
    jumps: list[tuple[float, float, str, list[str]]] = []
    result: dict[float, Finding] = {}
    for names, what in ((one.split(), what) for one, what in _QUANTITIES):
        parts = [data[name].unwrapped if name in ANGLES else data[name] for name in names if name in data]
        if len(parts) < len(names) or len({len(part.times) for part in parts}) > 1:
            continue
        times, moved = parts[0].times, np.linalg.norm([np.diff(part.values) for part in parts], axis=0)
        speeds = moved / np.diff(times)
        usual = max(RELEASE * np.median(speeds), APART * np.sort(speeds)[-OUTLIERS])
        far = (speeds > usual) & (np.diff(times) < GAP * parts[0].interval)
        jumps += [(times[k], times[k + 1], what, [headers[name] for name in names]) for k in np.flatnonzero(far)]
    for (begin, end, what, names), (other_begin, other_end, other, others) in itertools.combinations(jumps, 2):
        if what != other and begin < other_end and other_begin < end:
            message = f"jump together at {end:.6g} s, as where another run begins"
            remedy = "cut the log there, or keep one run by start_s and end_s under [time] of a map"
            result.setdefault(end, Finding("run", (*names, *others), message, remedy))
    return list(result.values())


def _motion_over(columns: list[Series], before: float, after: float, n: int = 8) -> tuple[float, ...]:
    """Motion over a step of the clock, as read and as due by speeds beside it; the usual one of a reading and of it."""
    moved, expected, typical, usual = [], [], [], []
    for column in columns:
        first = np.searchsorted(column.times, before, side="right")
        speeds = []
        for side in (slice(max(0, first - n), first), slice(first, first + n)):
            times = column.times[side]
            slope = np.polyfit(times - times[0], column.values[side], 1)[0] if len(times) > 2 else np.nan
            speeds.append(float(slope))
        if first in (0, len(column.times)):
            return 0.0, 0.0, 0.0, 0.0  # it has no readings there
        if not abs(speeds[1] - speeds[0]) < ALIKE * abs(sum(speeds)):
            speeds = [0.0, 0.0]  # it turned in between, and the distance due is unknown
        moved.append(column.values[first] - column.values[first - 1])
        expected.append(np.mean(speeds) * (after - before))
        typical.append(np.median(np.abs(np.diff(column.values))))
        usual.append(typical[-1] * (after - before) / np.median(np.diff(column.times)))
    return tuple(float(np.linalg.norm(part)) for part in (moved, expected, typical, usual))


def marks(values: np.ndarray, turn: float = 0.0, *, usual: bool = False) -> dict[float, int]:
    """Numbers that stand for no reading, and in how many cells, among finite values (n,) in the unit of the file.

    They repeat exactly, and the column jumps to and from most of them by more than it ever changes otherwise, modulo
    `turn`. One cell is enough of those that programs write; `usual`: only these are looked for, as in controls.
    """

    def folded(steps):
        return np.abs(np.remainder(steps + 0.5 * turn, turn) - 0.5 * turn if turn else steps)

    if len(values) < 2 * OUTLIERS:
        return {}
    if len(values) > 50 * MOST:  # a part after the other
        halves = {mark for half in np.array_split(values, 2) for mark in marks(half, turn, usual=usual)}
        return {mark: int(np.count_nonzero(values == mark)) for mark in sorted(halves)}
    steps = np.diff(values)
    moves = np.flatnonzero(steps)
    numbers, which = np.unique(values[np.append(moves, len(values) - 1)], return_inverse=True)
    sizes = np.pad([np.abs(steps[moves]), folded(steps[moves])], ((0, 0), (1, 1)), constant_values=np.inf)
    jumps = np.where(np.abs(numbers[which]) > turn, *np.minimum(sizes[:, 1:], sizes[:, :-1]))

    def far(least):
        return numbers[np.bincount(which, jumps > least) > MOSTLY * np.bincount(which)]

    found, cells = np.unique(values[np.isin(values, far(APART * np.median(folded(steps))))], return_counts=True)
    known, runs = stands_for_missing(found), np.bincount(which)[np.isin(numbers, found)]
    others_repeat = len(steps) - len(moves) - (cells - runs) > RARELY * len(values)
    likely = known | ((cells >= OFTEN) & ((runs > 1) | ~others_repeat) & (not usual))
    rest = values[~np.isin(values, found[likely])]
    others = np.sort(folded(np.diff(rest)))
    least = others[others > 0.0][-OUTLIERS:][0] if np.count_nonzero(others) >= 2 * OUTLIERS else 0.0
    if not least:  # it hardly moves
        likely, least = likely & known, max(np.ptp(rest), np.median(np.abs(rest))) if len(rest) else np.inf
    likely &= np.isin(found, far(APART * least))
    return {float(value): int(n) for value, n in zip(found[likely], cells[likely], strict=True)}


def check_marks(
    data: dict[str, Series], headers: dict[str, str], controls: tuple[str, ...] = ()
) -> tuple[dict[str, Series], list[Finding]]:
    """Numbers that stand for no reading, and the readings without them; arguments as of :func:`check_stuck`."""
    data, result = dict(data), []
    for name, column in data.items():
        header = headers.get(name, "")
        if header in (*PRESSURES, *FIXES):  # of another quantity, such as depth
            continue
        cells = np.round(column.values / si_factor(header), 9)
        found = marks(cells, TURN / si_factor(header) if name in HEADINGS else 0.0, usual=name in controls)
        for value, n in found.items():
            message = f"{value:.10g} stands for no reading in {n} of {len(cells)} cells: it jumps there and back"
            remedy = f"empty these cells (in a map missing = [{value:.10g}] under [columns.{header}])"
            result.append(Finding("mark", (header,), message, remedy))
        data[name] = column.without(np.flatnonzero(np.isin(cells, list(found)))) if found else column
    return data, result


def check_mixed(log: dict[str, np.ndarray], headers: dict[str, str]) -> list[Finding]:
    """Columns in which rows of several boats or instruments alternate; times need not ascend."""
    found = []
    for name in (name for name in PLACES if name in log):
        values = log[name][np.isfinite(log[name])]
        values = values[: len(values) // ROWS * ROWS].reshape(-1, ROWS)
        values = values[:: 1 + len(values) // MOST]
        pieces = np.unwrap(values, axis=1) if name in ANGLES else values
        order, extent = np.argsort(pieces, axis=1), np.ptp(pieces, axis=1)
        gaps = np.diff(np.take_along_axis(pieces, order, axis=1), axis=1)
        between = gaps > BETWEEN * extent[:, None]
        group = np.pad(np.cumsum(between, axis=1), ((0, 0), (1, 0)))
        changes = np.diff(np.take_along_axis(group, np.argsort(order, axis=1), axis=1), axis=1)
        several = (between.sum(axis=1) < GROUPS) & (np.sum(gaps, axis=1, where=~between) < BETWEEN * extent)
        several &= np.count_nonzero(changes, axis=1) > ROWS // 4
        several &= extent > np.min(np.diff(np.unique(values)), initial=np.inf) / BETWEEN  # which is not rounding
        if len(pieces) > 1 and several.mean() > MOSTLY:
            found.append(headers[name])
    remedy = "keep those of one, in a map by where = { NAME = .. } with the column that tells them apart"
    message = "rows of several boats or instruments alternate"
    return [Finding("mixed", tuple(found), message, remedy, misread=True)] if found else []


def check_angles(data: dict[str, Series], headers: dict[str, str]) -> tuple[dict[str, Series], list[Finding]]:
    """Readings with angles in radians and without those between two sides of a wrap, and what was wrong.

    `data` and `headers` are by short name; readings are in SI units by their headers.
    """
    data, result = dict(data), []
    for name in HEADINGS:
        for examine in (_check_unit, _check_wraps) if name in data else ():
            data[name], findings = examine(data[name], headers[name])
            result += findings
    return data, result


def _check_unit(angle: Series, header: str) -> tuple[Series, list[Finding]]:
    """An angle whose jumps are turns of another unit than that of its header."""
    steps = np.abs(np.diff(angle.values))
    typical = np.median(steps)
    for factor, words in _UNITS.items():
        wraps = np.abs(steps / (factor * TURN) - 1.0) < _WRAPS
        if not wraps.any() or factor * TURN < _STEPS * typical or np.ptp(angle.values) > 1.1 * factor * TURN:
            continue
        if np.count_nonzero(steps > 0.5 * factor * TURN) > np.count_nonzero(wraps):
            continue
        unit = 1.0 if "_rad" in header else 1.0 / DEGREE
        first = angle.times[np.flatnonzero(wraps)[0]]
        message = f"in {words}: it jumps by {factor * TURN * unit:.5g} at {first:.6g} s"
        other = {"radians": "_rad", "degrees": "_deg"}.get(words)
        better = header.replace("_deg", other).replace("_rad", other) if other else header
        remedy = f"rename it {better}" if better != header else f"multiply it by {1.0 / factor:.6g}"
        return Series(angle.times, angle.values / factor), [Finding("unit", (header,), message, remedy, misread=True)]
    return angle, []


def _check_wraps(angle: Series, header: str) -> tuple[Series, list[Finding]]:
    """Single readings between two sides of a wrap, which averaging or interpolating makes."""
    values = angle.values
    if len(values) < 3:
        return angle, []
    wrap = np.abs(np.abs(values[2:] - values[:-2]) / TURN - 1.0) < 0.1
    near = np.abs(np.angle(np.exp(1j * (values[2:] - values[:-2])))) < 0.5 * FAR
    off = [np.abs(np.angle(np.exp(1j * (values[1:-1] - values[side])))) > FAR for side in (slice(2, None), slice(-2))]
    between = 1 + np.flatnonzero(wrap & near & off[0] & off[1])
    if not len(between):
        return angle, []
    k = between[0]
    before, at, after = (1.0 if "_rad" in header else 1.0 / DEGREE) * values[k - 1 : k + 2]
    message = f"averaged across its wrap, {at:.4g} at {angle.times[k]:.6g} s between {before:.4g} and {after:.4g} "
    message += f"({len(between)} readings)"
    return angle.without(between), [Finding("wrap", (header,), message, "empty these cells")]


def check_stuck(
    data: dict[str, Series], headers: dict[str, str], controls: tuple[str, ...] = ()
) -> tuple[dict[str, Series], list[Finding]]:
    """Columns that hold one value for long and then jump, or whose noise stops, and the readings without it.

    `data` and `headers` are by short name; columns among the `controls` may stand still.
    """
    data, result = dict(data), []
    for name in [name for name in data if name not in controls]:
        column = data[name]
        values = column.unwrapped.values if name in ANGLES else column.values
        # The longest run of one value.
        changes = np.flatnonzero(np.diff(values) != 0.0)
        starts, ends = np.concatenate([[0], changes + 1]), np.concatenate([changes, [len(values) - 1]])
        k = int(np.argmax(ends - starts))
        first, last = int(starts[k]), int(ends[k])
        if last - first + 1 < LEAST or len(changes) < LEAST:
            continue
        others = np.concatenate([np.diff(values[: first + 1]), np.diff(values[last:])])
        moving = np.abs(others[others != 0.0])
        if len(moving) < LEAST:
            continue
        release = abs(values[last + 1] - values[last]) if last + 1 < len(values) else 0.0
        usual = max(RELEASE * np.median(moving), LARGEST * np.sort(moving)[-OUTLIERS])
        by_chance = (1.0 - len(moving) / len(others)) ** (last - first) * len(others) > CHANCE
        if release > usual and not by_chance and name not in ACCELERATIONS:  # which do jump
            evidence = f", and then jumps by {release / np.median(moving):.3g} times its usual change"
        elif first > 0 and _noise_stops(values, first, last):
            evidence = ", where its noise is not seen"
        else:
            continue
        begin, end = column.times[first], column.times[last]
        message = f"stands still for {last - first + 1} readings from {begin:.6g} to {end:.6g} s{evidence}"
        result.append(Finding("stuck", (headers[name],), message, "empty these cells"))
        data[name] = column.without(slice(first + 1, last + 1))
    return data, result


def _noise_stops(values: np.ndarray, first: int, last: int) -> bool:
    """Whether a column is noisy on both sides of a run, so that it nowhere repeats itself so often by chance."""
    sides = [side for side in (values[: first + 1], values[last:]) if len(side) > 2 * LEAST]
    repeats = []
    for side in sides:
        bends = np.sign(np.diff(side, 2))
        if np.mean(bends[1:] == bends[:-1]) > SMOOTH:
            return False
        same = np.convolve(np.diff(side) == 0.0, np.ones(2 * LEAST) / (2 * LEAST), mode="valid")
        repeats.append(float(same.max()))
    return bool(sides) and max(repeats) ** (last - first) * len(values) < CHANCE
