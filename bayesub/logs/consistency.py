"""Which columns of a log disagree, and the change after which they agree."""

from collections.abc import Sequence

import numpy as np

from bayesub.io.units import DEGREE
from bayesub.logs import columns
from bayesub.logs.log_files import CONTROLS, HEADERS
from bayesub.logs.mends import Mend, mends
from bayesub.logs.relations import Data, Misfit, Relation, relations
from bayesub.logs.series import WINDOWS, Finding, Series, lengths, series, windows

MAX_FINDINGS = 6
AGREES = 0.05  # share of the changes that differs, up to which nothing is looked for
EXPLAINED = 0.3  # share that a mend may leave
BETTER = 3.0  # factor by which a mend shrinks it
TIE = 1.1  # of two mends that do about the same the first is taken: radians (57) rather than minutes (60)
SIDEWAYS = 0.2  # speed ahead over that to the side, below which the names are exchanged
_FLOOR = 1e-3

APART = {True: 20.0 * DEGREE, False: 5.0}  # of angles, rad, and of places, m, from which on a constant is not believed
BOTH_WAYS = 30.0 * DEGREE  # of heading, to either side, that no rudder at rest makes

SMALL = 0.8  # rad that no rudder exceeds, so that 0.8 "degrees" may be radians
LARGE = 1.6  # rad that no rudder reaches
TURNED = 60.0 * DEGREE  # of heading, beyond which a rudder of less than SMALL degrees is not believed
CLEAR = 0.5  # correlation, beyond which the sign of a control counts
STEADY = 0.7  # correlation of the control with the rate itself, beyond which a boat turns steadily
CHANGES = 2.5  # of a control at least, about equal ones
# Control -> the rate and the angles that it changes, the sign of the rate for a positive one (model manual, section 7),
# and words for both signs of the rate.
EFFECTS = {
    "delta_r": (("r", ("psi", "heading")), -1.0, ("port", "starboard")),
    "delta_s": (("q", ("theta",)), -1.0, ("nose down", "nose up")),
}
EFFECTS |= {"rudder_command_deg": EFFECTS["delta_r"], "stern_plane_command_deg": EFFECTS["delta_s"]}

Misfits = tuple[Misfit, ...]
_Memory = dict[tuple, tuple[Misfits, tuple[Series, ...]]]  # relation and columns -> misfits, computed once


def findings(log: dict[str, np.ndarray], headers: dict[str, str], controls: tuple[str, ...] = ()) -> list[Finding]:
    """All that disagrees in a log.

    By short name it has (n,) values in SI units in the order of the file, ``time`` among them, not a number where there
    is no reading; `headers` are those of the columns in its file. `controls` are besides those of all boats.
    """
    controls = (*CONTROLS, "rpm", *controls)
    headers = {name: HEADERS.get(name, name) for name in log} | headers
    if mixed := columns.check_mixed(log, headers):
        return mixed
    log, result = columns.check_stamps(log)
    result += columns.check_clock(log)
    data, of_marks = columns.check_marks(series(log), headers, controls)
    if runs := columns.check_runs(data, headers):
        return [*result, *of_marks, *runs]  # what they have in common says nothing
    data, of_angles = columns.check_angles(data, headers)
    data, of_stuck = columns.check_stuck(data, headers, controls)
    data, of_constants = _check_constants(data, headers, controls)
    data, of_kinematics = _check_kinematics(data, headers)
    headers = _all_headers(headers, data)
    result += [*of_marks, *of_angles, *of_stuck, *of_constants, *of_kinematics]
    if "u" in data and "v" in data:
        u, v = (float(np.median(np.abs(data[name].values))) for name in "uv")
        if u < SIDEWAYS * v:
            message = f"{headers['u']} holds what {headers['v']} should: ahead {u:.3g} m/s and to the side {v:.3g} in "
            message += "the median"
            names = headers["u"], headers["v"]
            result.append(Finding("name", names, message, "exchange the two names", misread=True))
    return result + _check_sizes_of_controls(data, headers, controls) + _check_signs_of_controls(data, headers)


def _all_headers(headers: dict[str, str], data: Data) -> dict[str, str]:
    """Headers of all columns, those that a mend has named among them."""
    return {name: headers.get(name, HEADERS.get(name, name)) for name in data} | headers


def _check_kinematics(data: Data, headers: dict[str, str]) -> tuple[Data, list[Finding]]:
    """The readings with columns that hold what their names say, and those that did not.

    Of all mends the one is taken that brings the relations together most, and the next is looked for in what it leaves.
    """
    memory: _Memory = {}
    result: list[Finding] = []
    for _ in range(MAX_FINDINGS):
        names = _all_headers(headers, data)
        if (best := _best_mend(data, names, memory)) is None:
            break
        mend, message = best
        header = tuple(names[name] for name in mend.names)
        result.append(Finding(mend.kind, header, message, mend.remedy, misread=True))
        data = mend.change(data)
    return data, result


def _misfits(data: Data, memory: _Memory) -> dict[str, tuple[Relation, Misfits]]:
    """Words of a relation -> relation and its misfits, of those that the columns allow."""
    result = {}
    for relation in relations(data):
        parts = tuple(data[name] for name in relation.columns(data))
        key = relation.words, tuple(id(part) for part in parts)
        if parts and key not in memory:  # the columns stay alive with it, and so do their identities
            memory[key] = relation.misfits(data), parts
        if parts and memory[key][0]:
            result[relation.words] = relation, memory[key][0]
    return result


def _best_mend(data: Data, headers: dict[str, str], memory: _Memory) -> tuple[Mend, str] | None:
    """The mend that brings the relations together most, and the words for it.

    Kinematics does not distinguish a mirrored track from a mirrored heading; the answer of the boat to her rudder does.
    """
    before, candidates = _misfits(data, memory), []
    for mend in mends(data, headers):
        changed = mend.change(data)
        mended = {name for name, one in changed.items() if one is not data.get(name)}
        gain, evidence = _gain(before, _misfits(changed, memory), mended)
        if gain > np.log(BETTER) * TIE and evidence is not None:
            candidates.append((gain, mend, evidence))
    if not candidates:
        return None
    most = max(gain for gain, *_ in candidates)
    equals = [one for one in candidates if one[0] * TIE >= most]
    results = ((one, one[1].change(data)) for one in equals)
    answered = (one for one, log in results if not _check_signs_of_controls(log, _all_headers(headers, log)))
    _, first, _ = next(answered, equals[0])
    # Of units of the same columns, such as km/h and ft/s, it is the one that fits.
    alike = [one for one in equals if one[1] is first or (one[1].names, one[1].kind) == (first.names, "unit")]
    _, mend, evidence = max(alike, key=lambda one: one[0])
    return mend, f"{mend.message}: {evidence}"


def _gain(
    before: dict[str, tuple[Relation, Misfits]], after: dict[str, tuple[Relation, Misfits]], mended: set[str]
) -> tuple[float, str | None]:
    """By how much the logarithms of the shares fall together, and the relation of mended columns that shows it best."""
    largest, evidence = 0.0, None
    gone = [(one.targets, misfits) for words, (one, misfits) in before.items() if words not in after]
    gain = 0.0 + sum(_log(min(misfit.share for misfit in misfits)) for _, misfits in gone)
    for words, (relation, misfits) in after.items():
        old = before[words][1] if words in before else ()
        k = min(range(len(misfits)), key=lambda k: min(one[k].share for one in (misfits, old) if k < len(one)))
        share, was = misfits[k].share, old[k].share if k < len(old) else 1.0
        part = _log(was) - _log(share)
        gain += part
        shows = mended & {*relation.targets, *relation.needed, *relation.optional}
        compared = (old or next((one for targets, one in gone if targets == relation.targets), ()))[k : k + 1]
        is_closer = all(one.rms > TIE * misfits[k].rms for one in compared)
        if part > largest and was > AGREES and share < EXPLAINED and shows and is_closer:
            factor, unit = (180.0 / np.pi, "deg/s") if relation.rotation else (1.0, "m/s")
            as_named = "".join(f", as named by {factor * misfit.rms:.2g}" for misfit in compared)
            evidence = f"{words} differ by {factor * misfits[k].rms:.2g} {unit} so{as_named} "
            evidence += f"(correlation {misfits[k].correlation:.4f})"
            largest = part
    return gain, evidence


def _log(share: float) -> float:
    return float(np.log(min(1.0, max(_FLOOR, share))))


def _check_constants(data: Data, headers: dict[str, str], controls: tuple[str, ...]) -> tuple[Data, list[Finding]]:
    """Columns that hold one value from first to last beside others by which they should change, and the others."""
    constant = {name for name, column in data.items() if not np.ptp(column.values)}
    reasons: dict[str, str] = {}
    for relation in relations(data):
        for name in constant & {*relation.targets, *relation.needed} - reasons.keys():
            others = {*relation.targets, *relation.needed} - constant
            if others and (apart := relation.apart(data)) > APART[relation.rotation]:
                size = f"{apart / DEGREE:.3g} deg" if relation.rotation else f"{apart:.3g} m"
                reasons[name] = f"{relation.words} go {size} apart"
    steering = {name for name in controls if name in data and name not in (*CONTROLS[1:], "rpm")}
    angle = next((data[name].unwrapped.values for name in ("psi", "heading") if name in data), np.zeros(1))
    rise, fall = (angle - np.minimum.accumulate(angle)).max(), (np.maximum.accumulate(angle) - angle).max()
    if steering == {"delta_r"} <= constant and min(rise, fall) > BOTH_WAYS:
        words = f"the boat turns by {rise / DEGREE:.3g} deg to starboard and by {fall / DEGREE:.3g} to port"
        reasons["delta_r"] = words
    found = [
        Finding("constant", (headers[name],), f"never changes, and {reason}", "leave the column out", misread=True)
        for name, reason in reasons.items()
    ]
    return {name: column for name, column in data.items() if name not in reasons}, found


def _check_sizes_of_controls(data: Data, headers: dict[str, str], names: tuple[str, ...]) -> list[Finding]:
    """Controls (short names) that are too small or too large to be in their unit."""
    turned = max((float(np.ptp(data[n].unwrapped.values)) for n in ("psi", "heading") if n in data), default=0.0)
    result = []
    for name in names:
        if name not in data or "_n" in headers[name][-3:] or name == "rpm":
            continue
        header, largest = headers[name], float(np.abs(data[name].values).max())
        if "_rad" in header and largest > LARGE:
            message = f"in degrees: it reaches {largest:.4g} rad"
            remedy = f"rename it {header.replace('_rad', '_deg')}"
        elif "_deg" in header and largest > LARGE:
            message = f"in another unit: it reaches {largest / DEGREE:.4g} deg"
            remedy = "convert it to degrees"
        elif "_deg" in header and name == "delta_r" and 0.0 < largest < SMALL * DEGREE and turned > TURNED:
            message = f"in radians: it stays within {largest / DEGREE:.3g} deg, and the boat turns by "
            message += f"{turned / DEGREE:.3g} deg"
            remedy = f"rename it {header.replace('_deg', '_rad')}"
        else:
            continue
        result.append(Finding("unit", (header,), message, remedy, misread=True))
    return result


def _check_signs_of_controls(data: Data, headers: dict[str, str]) -> list[Finding]:
    """Controls after which the boat turns the other way."""
    result = []
    for name, ((rate, angles), sign, words) in EFFECTS.items():
        if name not in data or not np.ptp(data[name].values):
            continue
        angle = next((data[name].unwrapped for name in angles if name in data), None)
        righted = angle if rate == "q" else None
        if rate in data:
            correlation = _correlation(data[name], data[rate], righted)
        elif angle is not None:
            slope = np.diff(angle.values) / np.diff(angle.times)
            correlation = _correlation(data[name], Series(0.5 * (angle.times[1:] + angle.times[:-1]), slope), righted)
        else:
            continue
        if correlation * sign < -CLEAR:
            way, right = words if correlation < 0.0 else words[::-1]
            message = f"positive turns the boat to {way}, and here it should to {right}"
            message = message.replace("to nose", "nose") + f" (correlation {abs(correlation):.2f} with what follows)"
            remedy = "multiply it by -1, or give its [[actuators]] sign = -1"
            result.append(Finding("sign", (headers[name],), message, remedy, misread=True))
    return result


def _correlation(control: Series, rate: Series, righted: Series | None = None) -> float:
    """Of a rate with the control in steady turns; otherwise of its change at the same rate (Nomoto et al. 1957).

    `righted`: the angle of a boat that rights itself, and does not turn steadily.
    """
    inside = (rate.times >= control.times[0]) & (rate.times <= control.times[-1])
    times, values = rate.times[inside], rate.values[inside]
    if len(times) < 2 * WINDOWS:
        return 0.0
    angle, tilt, best = control.at(times), 0.0 * times if righted is None else righted.at(times), 0.0
    for length in lengths(times, 2.0 * float(np.median(np.diff(times)))):
        first, last = windows(times, length, [rate.gaps])
        if len(first) < 2 * WINDOWS:
            break
        sums = [np.concatenate([[0.0], np.cumsum(column)]) for column in (angle, values, tilt)]
        angles, rates, tilts = ((total[last] - total[first]) / (last - first) for total in sums)
        steady = _partial_correlation(angles, rates, [np.ones(len(rates))])
        if abs(steady) > STEADY and righted is None:
            return steady
        steps = np.diff(angles)
        if np.sum(steps**2) ** 2 < CHANGES * np.sum(steps**4) or not steps.min() < 0.0 < steps.max():
            continue
        # The change between the means of two windows, by the control and the rate of the first.
        known = [np.ones(len(rates) - 1), rates[:-1], tilts[:-1]]
        best = max(best, _partial_correlation(angles[:-1], np.diff(rates), known), key=abs)
    return best


def _partial_correlation(one: np.ndarray, other: np.ndarray, known: Sequence[np.ndarray]) -> float:
    """Correlation of two columns (n,) after what is linear in known ones (n,) is taken out."""
    matrix = np.stack(known, axis=1)
    one, other = (column - matrix @ np.linalg.lstsq(matrix, column)[0] for column in (one, other))
    size = np.linalg.norm(one) * np.linalg.norm(other)
    return float(one @ other / size) if size > 0.0 else 0.0
