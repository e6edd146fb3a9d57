"""The coefficients of several posteriors side by side: intervals, and what each trial has told."""

from collections.abc import Mapping, Sequence

import numpy as np

from bayesub.plots import style
from bayesub.plots.coefficients import ROWS, VISIBLE

COLOURS = (style.POSTERIOR, style.SQP, style.LINEAR, style.NULL, style.WEAK, style.READINGS, style.TRUTH)
_SPAN = 0.8  # of a row that its runs share
_LOWEST, _HIGHEST = -1.0, 3.0  # ratios that are shown


def draw(path, rows: Sequence[tuple[str, Mapping[str, dict]]], labels: Sequence[str]) -> None:
    """A row for each coefficient: 50 and 90 % of each posterior, as ratios, and beside it posterior over prior sd.

    Parameters
    ----------
    path
        One or several, as :func:`bayesub.plots.style.figure` takes them.
    rows
        Name of a coefficient, and label of a run -> its numbers: ``ratios`` (the five quantiles), ``prior_ratios`` (5
        and 95 %) and ``contraction``.
    labels
        Of the runs.
    """
    n_panels = -(-len(rows) // ROWS)
    length = -(-len(rows) // n_panels)
    height = 0.14 + 0.1 * len(labels)
    with style.figure(path, 8.4 * n_panels, height * length + 1.3) as figure:
        panels = figure.subplots(1, 2 * n_panels, squeeze=False, width_ratios=[2.2, 1.0] * n_panels)[0]
        for k in range(n_panels):
            some = rows[k * length : (k + 1) * length]
            _draw_panel(*panels[2 * k : 2 * k + 2], some, labels, length)
        handles, words = panels[0].get_legend_handles_labels()
        columns = style.legend_columns(words, figure.get_figwidth())
        figure.legend(handles, words, loc="outside upper center", ncols=columns, fontsize=8)


def _draw_panel(intervals, contractions, rows, labels, length) -> None:
    step = _SPAN / len(labels)
    ends = [value for _, runs in rows for one in runs.values() for value in (*one["ratios"], *one["prior_ratios"])]
    limits = max(min(ends) - 0.1, _LOWEST), min(max(ends) + 0.1, _HIGHEST)
    intervals.axvline(1.0, color=style.TRUTH, lw=0.8, zorder=1)
    for place, label in enumerate(labels):
        colour = COLOURS[place]
        shift = (place + 0.5) * step - 0.5 * _SPAN
        present = [(y + shift, runs[label]) for y, (_, runs) in enumerate(rows) if label in runs]
        if not present:
            continue
        y = np.array([at for at, _ in present])
        low, q1, median, q3, high = np.array([one["ratios"] for _, one in present]).T
        bottom, top = np.array([one["prior_ratios"] for _, one in present]).T
        intervals.hlines(y, bottom, top, color=style.PRIOR, lw=3.2, alpha=0.6, zorder=1)
        intervals.hlines(y, low, high, color=colour, lw=1.2, label=label)
        intervals.hlines(y, q1, q3, color=colour, lw=3.2)
        wide = q3 - q1 > VISIBLE * (limits[1] - limits[0])
        intervals.plot(median[wide], y[wide], "|", color="white", ms=4)
        intervals.plot(median[~wide], y[~wide], "o", color=colour, ms=3.2, mew=0)
        contractions.plot([one["contraction"] for _, one in present], y, "o", ms=3.2, mew=0, color=colour)
    names = [name for name, _ in rows]
    for axis in (intervals, contractions):
        axis.set_ylim(length - 0.5, -0.5)
        axis.grid(axis="y", visible=False)
        for y in range(len(rows) - 1):
            axis.axhline(y + 0.5, color="#E6E6E6", lw=0.6)
    intervals.set_yticks(range(len(rows)), names)
    contractions.set_yticks([])
    intervals.set_xlim(limits)
    intervals.set_xlabel("ratio; grey: 90 % of the prior")
    contractions.set_xlim(0.0, max(1.1, 1.05 * max(one["contraction"] for _, runs in rows for one in runs.values())))
    contractions.axvline(1.0, color=style.TRUTH, lw=0.8, ls=":")
    contractions.set_xlabel("posterior / prior sd")
