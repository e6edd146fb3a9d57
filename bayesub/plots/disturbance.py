"""Inferred histories of unmodelled forces beside the forces of the hull."""

import numpy as np

from bayesub.model.disturbance import CURRENTS, unit
from bayesub.plots import style

BANDS = ((0.05, 0.95, 0.25), (0.25, 0.75, 0.45))  # quantiles, and how dark


def draw(path, forces) -> None:
    """A row for each disturbed axis: the inferred history on the left, the force of the hull on the right.

    Of a current the velocity of the boat in the water is on the right.

    Parameters
    ----------
    path
        One or several, as :func:`bayesub.plots.style.figure` takes them.
    forces
        :class:`bayesub.findings.disturbances.InferredForces` of one trial.
    """
    n_axes = len(forces.axes)
    margins = (0.85, 0.15, 0.5, 0.62)
    with style.figure(path, 9.0, 1.2 + 1.75 * n_axes, margins) as figure:
        rows = figure.subplots(
            n_axes, 2, squeeze=False, sharex=True, width_ratios=[1.7, 1.0], gridspec_kw={"wspace": 0.24, "hspace": 0.14}
        )
        figure.align_ylabels(rows[:, 0])
        figure.align_ylabels(rows[:, 1])
        for k, (axis, (left, right)) in enumerate(zip(forces.axes, rows, strict=True)):
            for panel in (left, right):
                _shade(panel, forces)
                panel.axhline(0.0, color=style.TRUTH, lw=0.5)
                panel.set_ylabel(f"{axis} ({unit(axis)})")
                panel.margins(x=0.01)
                panel.locator_params(axis="y", nbins=5)
            _draw_history(left, forces, k)
            left.locator_params(axis="x", nbins=10)
            right.locator_params(axis="x", nbins=5)
            right.plot(forces.fine_times, forces.hull[k], color=style.SQP, lw=1.0)
        currents = [axis in CURRENTS for axis in forces.axes]
        forced = not all(currents)
        left = " or ".join(["unmodelled force"] * forced + ["current"] * any(currents))
        right = " or ".join(["force of the hull"] * forced + ["velocity in the water"] * any(currents))
        rows[0, 0].set_title(left, fontsize=9)
        rows[0, 1].set_title(f"{right}, on its own scale", fontsize=9)
        for panel in rows[-1]:
            panel.set_xlabel("time (s)")
        handles, words = rows[0, 0].get_legend_handles_labels()
        figure.legend(handles, words, loc="upper center", ncols=5, fontsize=8)


def _shade(panel, forces):
    """Grey where the boat turns fast."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], forces.turning, [False]]).astype(int)))
    ends = np.append(forces.fine_times, forces.times[-1])
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        label = "turning faster than half of the time" if begin == edges[0] else None
        panel.axvspan(ends[begin], ends[end], color=style.PRIOR, alpha=0.4, lw=0, label=label)


def _draw_history(panel, forces, k):
    draws = forces.draws[:, k]
    for low, high, alpha in BANDS:
        lower, upper = np.quantile(draws, [low, high], axis=0)
        label = f"{100 * (high - low):.0f} %"
        panel.fill_between(forces.times, lower, upper, color=style.POSTERIOR, alpha=alpha, lw=0, label=label)
    panel.plot(forces.times, np.median(draws, axis=0), color=style.POSTERIOR, lw=1.2, label="median")
    if forces.truth is not None:
        panel.plot(forces.times, forces.truth[k], color=style.TRUTH, lw=0.8, label="truth")
