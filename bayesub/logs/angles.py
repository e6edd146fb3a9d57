"""Angles by themselves: where they wrap, readings between both sides of a wrap, and controls of impossible size."""

import numpy as np

from bayesub.logs.finding import Finding
from bayesub.logs.series import Series

DEGREE = np.pi / 180.0
TURN = 2.0 * np.pi
HEADINGS = ("psi", "heading", "cog")
SMALL = 0.8  # rad that no rudder exceeds, so that 0.8 "degrees" may be radians
LARGE = 1.6  # rad that no rudder reaches
TURNED = np.radians(60.0)  # of heading, beyond which a rudder of less than SMALL degrees is not believed
FAR = np.radians(30.0)  # from both neighbours
_WRAPS = 0.02  # relative width of the steps that count as wraps
_STEPS = 10.0  # median steps of an angle that a wrap exceeds
# Factor by which an angle is too large -> words, and the factor that mends it.
_UNITS = {DEGREE: "radians", 1.0 / DEGREE: "degrees", 400.0 / 360.0: "gon", 6400.0 / 360.0: "mils"}


def findings(data: dict[str, Series], headers: dict[str, str]) -> tuple[dict[str, Series], list[Finding]]:
    """The readings with angles in radians and without those between two sides of a wrap, and what was wrong.

    Parameters
    ----------
    data : dict of str to Series
        Short name -> readings, SI units by their headers.
    headers : dict of str to str
        Short name -> header.
    """
    data, result = dict(data), []
    for name in HEADINGS:
        if name not in data:
            continue
        for examine in (_unit, _averaged):
            mended, finding = examine(data[name], headers[name])
            if finding is not None:
                data[name] = mended
                result.append(finding)
    return data, result


def _unit(angle, header):
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
        better = header.replace("_deg", other).replace("_rad", other) if other else ""
        remedy = f"rename it {better}" if other and better != header else f"multiply it by {1.0 / factor:.6g}"
        return Series(angle.times, angle.values / factor), Finding("unit", (header,), message, remedy, misread=True)
    return angle, None


def _averaged(angle, header):
    """Single readings between two sides of a wrap, which averaging or interpolating makes."""
    values = angle.values
    if len(values) < 3:
        return angle, None
    wrap = np.abs(np.abs(values[2:] - values[:-2]) / TURN - 1.0) < 0.1
    near = np.abs(np.angle(np.exp(1j * (values[2:] - values[:-2])))) < 0.5 * FAR
    off = [np.abs(np.angle(np.exp(1j * (values[1:-1] - values[side])))) > FAR for side in (slice(2, None), slice(-2))]
    between = 1 + np.flatnonzero(wrap & near & off[0] & off[1])
    if not len(between):
        return angle, None
    unit = 1.0 if "_rad" in header else 1.0 / DEGREE
    k = between[0]
    around = f"{unit * values[k]:.4g} at {angle.times[k]:.6g} s between {unit * values[k - 1]:.4g} and "
    message = f"averaged across its wrap, {around}{unit * values[k + 1]:.4g} ({len(between)} readings)"
    rest = np.delete(np.arange(len(values)), between)
    return Series(angle.times[rest], values[rest]), Finding("wrap", (header,), message, "empty these cells")


def controls(data: dict[str, Series], headers: dict[str, str], names: tuple[str, ...]) -> list[Finding]:
    """Controls `names` (short) that are too small or too large to be in their unit."""
    headings = [data[name].unwrapped().values for name in HEADINGS[:2] if name in data]
    turned = max((float(np.ptp(values)) for values in headings), default=0.0)
    result = []
    for name in names:
        if name not in data or "_n" in headers[name][-3:] or name == "rpm":
            continue
        header, largest = headers[name], float(np.abs(data[name].values).max())
        if "_rad" in header and largest > LARGE:
            message, better = f"in degrees: it reaches {largest:.4g} rad", header.replace("_rad", "_deg")
        elif "_deg" in header and largest > LARGE:
            message = f"in another unit: it reaches {largest / DEGREE:.4g} deg"
            result.append(Finding("unit", (header,), message, "convert it to degrees", misread=True))
            continue
        elif "_deg" in header and name == "delta_r" and 0.0 < largest < SMALL * DEGREE and turned > TURNED:
            message = f"in radians: it stays within {largest / DEGREE:.3g} deg, and the boat turns by "
            message += f"{turned / DEGREE:.3g} deg"
            better = header.replace("_deg", "_rad")
        else:
            continue
        result.append(Finding("unit", (header,), message, f"rename it {better}", misread=True))
    return result
