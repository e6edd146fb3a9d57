"""Intervals under different treatments of what is held to be known."""

import numpy as np

from bayesub.report.plots import style
from thesis.plots.labels import labels

_COLOURS = (style.LINEAR, style.SQP, style.POSTERIOR)


def draw(path, names, trial, treatments, level: float) -> None:
    """Above, intervals of one trial as ratios to the truth; below, how many of all trials hold the truth.

    Parameters
    ----------
    names : (n,) coefficients
    trial : treatment -> lower and upper (n,)
    treatments : treatment -> n_trials and coverage (n,)
    level : probability of the intervals
    """
    columns = np.arange(len(names))
    with style.figure(path, 0.62 * len(names) + 1.6, 5.6) as figure:
        above, below = figure.subplots(2, 1, sharex=True)
        shifts = np.linspace(-0.22, 0.22, len(treatments))
        for (treatment, r), shift, colour in zip(treatments.items(), shifts, _COLOURS, strict=True):
            limits = trial[treatment]
            above.vlines(columns + shift, limits["lower"], limits["upper"], color=colour, lw=4, label=treatment)
            below.plot(columns + shift, 100 * np.array(r["coverage"]), "o", ms=5, mew=0, color=colour)
        above.axhline(1.0, color=style.TRUTH, lw=0.8)
        below.axhline(100 * level, color=style.TRUTH, lw=0.8, ls="--")
        above.set(ylabel=f"ratio to the truth\n{level:.0%} intervals of the first trial".replace("%", " %"))
        n_trials = next(iter(treatments.values()))["n_trials"]
        below.set(ylim=(-4, 104), ylabel=f"of {n_trials} trials, intervals\nthat hold the truth (%)")
        below.set_xticks(columns, labels(names), rotation=60, ha="right", rotation_mode="anchor")
        for panel in (above, below):
            panel.grid(axis="x", visible=False)
        figure.legend(*above.get_legend_handles_labels(), loc="outside upper center", ncols=len(treatments))
