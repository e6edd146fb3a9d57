"""Figures of the thesis's stopping rule: one search, and readings of the rule (thesis Figure 29)."""

import numpy as np
from matplotlib.ticker import LogLocator

from bayesub.report.plots import style


def draw_one_search(path, costs, n_coefficients) -> None:
    """Cost of every evaluation of one search: level stretches are gradients, spikes are line searches.

    Parameters
    ----------
    path : one file or several
    costs : (n_evaluations,) m^2 + deg^2, in order
    n_coefficients : evaluations of a gradient besides the one at its point
    """
    with style.figure(path, 7.0, 2.8) as figure:
        axis = figure.subplots()
        axis.semilogy(np.arange(1, len(costs) + 1), costs, color=style.SQP, lw=0.7)
        axis.semilogy(np.arange(1, len(costs) + 1), np.minimum.accumulate(costs), color=style.TRUTH, lw=1.0)
        axis.set(xlabel="evaluation of the cost", ylabel="cost (m$^2$ + deg$^2$)")
        axis.set_title(f"one search, {n_coefficients} coefficients; black: lowest so far", fontsize=9)


def draw_readings(path, readings, thesis) -> None:
    """Evaluations for each coefficient, and largest position error: a grey dot a search, a large one the median.

    Parameters
    ----------
    path : one file or several
    readings : name -> "efforts", "position_m" of each search and "n_coefficients"
    thesis : its mean evaluations for each coefficient and position error, mm
    """
    rows = np.arange(len(readings))[::-1]
    words = ("evaluations for each coefficient", "largest position error (mm)")
    with style.figure(path, 8.5, 0.3 * len(rows) + 0.9) as figure:
        for panel, number, word in zip(figure.subplots(1, 2, sharey=True), thesis, words, strict=True):
            for row, r in zip(rows, readings.values(), strict=True):
                per_search = np.array(r["efforts"]) / r["n_coefficients"], 1e3 * np.array(r["position_m"])
                values = per_search[words.index(word)]
                panel.semilogx(values, np.full(len(values), row), "o", ms=3, mew=0, color="#909090")
                panel.semilogx(np.median(values), row, "o", ms=6, color=style.SQP)
            panel.axvline(number, color=style.TRUTH, lw=1.0)
            panel.annotate("thesis", (number, 1.0), (3, 2), ("data", "axes fraction"), "offset points", fontsize=8)
            panel.lines[-1].set_zorder(0)
            panel.set_xlabel(word)
            panel.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            panel.xaxis.set_major_formatter("{x:g}")
            panel.xaxis.set_minor_formatter("")
            panel.set_yticks(rows, list(readings))
            panel.grid(axis="y", visible=False)
