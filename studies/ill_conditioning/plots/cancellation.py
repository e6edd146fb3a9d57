"""Force errors of wrong coefficients over the manoeuvre, term by term, and their much smaller sum (Figure 69)."""

import numpy as np

from bayesub.model.equations import EquationSet
from bayesub.report.plots import style
from bayesub.report.plots.coefficients import labels

MAX_TERMS = 5  # terms in colour; the rest are grey
MAX_POINTS = 1500
MAX_PANELS = 3
_COLOURS = (style.POSTERIOR, style.SQP, style.LINEAR, style.NULL, style.WEAK)


def draw(path, times, cancellations: dict, equations: EquationSet) -> None:
    """A panel for each axis, of many those whose terms cancel most.

    Parameters
    ----------
    path
        One or several, as :func:`bayesub.report.plots.style.figure` takes them.
    times
        (n_samples,) of the samples, s.
    cancellations
        Axis -> Cancellation.
    equations
        Whose coefficients they are.
    """
    most = sorted(cancellations, key=lambda axis: -cancellations[axis].ratio)[:MAX_PANELS]
    axes = [cancellation for axis, cancellation in cancellations.items() if axis in most]
    stride = -(-len(times) // MAX_POINTS)
    with style.figure(path, 3.6 * len(axes) + 0.4, 2.5) as figure:
        panels = figure.subplots(1, len(axes), squeeze=False)
        for panel, c in zip(panels.flat, axes, strict=True):
            top = list(c.largest)[:MAX_TERMS]
            unit, factor = _unit(max(c.largest.values()), c.axis)
            rest = [k for k, name in enumerate(c.names) if name not in top]
            if rest:
                lines = panel.plot(times[::stride], factor * c.errors[::stride, rest], color=style.PRIOR, lw=0.8)
                lines[0].set_label(f"{len(rest)} more")
            for name, label, colour in zip(top, labels(top, equations), _COLOURS, strict=False):
                error = factor * c.errors[::stride, c.names.index(name)]
                panel.plot(times[::stride], error, color=colour, lw=1.0, label=label)
            panel.plot(times[::stride], factor * c.total[::stride], color=style.TRUTH, lw=1.4, label="sum")
            panel.set_title(f"{c.axis}: largest term {style.power(c.ratio)} times the largest sum", fontsize=9)
            panel.set_ylabel(f"error of {c.axis} ({unit})")
            panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8, handlelength=1.2)
        for panel in panels[-1]:
            panel.set_xlabel("time (s)")


def _unit(size, axis) -> tuple[str, float]:
    power = int(np.clip(np.floor(np.log10(size) / 3), 0, 2)) if size > 0 else 0
    return ("", "k", "M")[power] + ("N" if axis in "XYZ" else "N m"), 1000.0**-power
