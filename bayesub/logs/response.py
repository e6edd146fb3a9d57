"""Sign of a control against the rotation that follows it."""

import numpy as np

from bayesub.logs.finding import Finding
from bayesub.logs.series import WINDOWS, Series, lengths, windows

CLEAR = 0.5  # correlation, beyond which the sign counts
STEADY = 0.7  # correlation of the control with the rate itself, beyond which a boat turns steadily
CHANGES = 2.5  # of a control at least, about equal ones
# Control -> the rate and the angles that it changes, the sign of the rate for a positive one (model manual, section 7),
# and words for both signs of the rate.
EFFECTS = {
    "delta_r": (("r", ("psi", "heading")), -1.0, ("port", "starboard")),
    "delta_s": (("q", ("theta",)), -1.0, ("nose down", "nose up")),
}
EFFECTS |= {"rudder_command_deg": EFFECTS["delta_r"], "stern_plane_command_deg": EFFECTS["delta_s"]}


def findings(data: dict[str, Series], headers: dict[str, str]) -> list[Finding]:
    """Controls after which the boat turns the other way.

    Parameters
    ----------
    data : dict of str to Series
        Short name -> readings.
    headers : dict of str to str
        Short name -> header.
    """
    result = []
    for name, ((rate, angles), sign, words) in EFFECTS.items():
        if name not in data or not np.ptp(data[name].values):
            continue
        correlation = _correlation(data[name], _rate(data, rate, angles))
        if correlation * sign < -CLEAR:
            way, right = words if correlation < 0.0 else words[::-1]
            message = f"positive turns the boat to {way}, and here it should to {right}"
            message = message.replace("to nose", "nose") + f" (correlation {abs(correlation):.2f} with what follows)"
            remedy = "multiply it by -1, or give its [[actuators]] sign = -1"
            result.append(Finding("sign", (headers[name],), message, remedy, misread=True))
    return result


def _rate(data, rate, angles) -> Series | None:
    if rate in data:
        return data[rate]
    for name in angles:
        if name in data:
            angle = data[name].unwrapped()
            middle = 0.5 * (angle.times[1:] + angle.times[:-1])
            return Series(middle, np.diff(angle.values) / np.diff(angle.times))
    return None


def _correlation(control: Series, rate: Series | None) -> float:
    """Of a rate with the control in steady turns; otherwise of its change at the same rate (Nomoto et al. 1957)."""
    if rate is None:
        return 0.0
    inside = (rate.times >= control.times[0]) & (rate.times <= control.times[-1])
    times, values = rate.times[inside], rate.values[inside]
    if len(times) < 2 * WINDOWS:
        return 0.0
    angle, best = control.at(times), 0.0
    for length in lengths(times, 2.0 * float(np.median(np.diff(times)))):
        first, last = windows(times, length, [rate.gaps()])
        if len(first) < 2 * WINDOWS:
            break
        sums = [np.concatenate([[0.0], np.cumsum(column)]) for column in (angle, values)]
        angles, rates = ((total[last] - total[first]) / (last - first) for total in sums)
        steady = _partial(angles, rates, np.ones((len(rates), 1)))
        if abs(steady) > STEADY:
            return steady
        steps = np.diff(angles)
        if np.sum(steps**2) ** 2 < CHANGES * np.sum(steps**4) or not steps.min() < 0.0 < steps.max():
            continue
        # The change between the means of two windows, by the control and the rate of the first.
        known = np.stack([np.ones(len(rates) - 1), rates[:-1]], axis=1)
        best = max(best, _partial(angles[:-1], np.diff(rates), known), key=abs)
    return best


def _partial(one, other, known) -> float:
    """Correlation of two columns (n,) after what is linear in known ones (n, k) is taken out."""
    one, other = (column - known @ np.linalg.lstsq(known, column)[0] for column in (one, other))
    size = np.linalg.norm(one) * np.linalg.norm(other)
    return float(one @ other / size) if size > 0.0 else 0.0
