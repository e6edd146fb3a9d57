"""Posteriors of several cases beside each other, and point estimates within them.

A case is named ``vehicle manoeuvre``, with more words after that if its posterior has not converged.
"""

from itertools import pairwise

import numpy as np
from matplotlib.ticker import NullFormatter

from bayesub.model.coefficients import NAMES
from bayesub.report.plots import style
from thesis.plots.labels import labels

_ROWS = 34  # coefficients below each other
_BINS = 14  # of singular values, for medians
_LINE = 0.055  # of the height of a panel, between labels


def identified(sets, reference) -> np.ndarray:
    """Coefficient sets (n, n_coefficients) with what was held at the reference in all of them made not a number."""
    return np.where(np.all(sets == reference, axis=0), np.nan, sets)


def draw_contraction(path, cases: dict[str, dict[str, float]]) -> None:
    """Posterior sd over prior sd: a row a coefficient, the best known first, a column a case.

    Parameters
    ----------
    path
        One or several, as :func:`bayesub.report.plots.style.figure` takes them.
    cases
        Case -> coefficient -> contraction.
    """
    free = {name for values in cases.values() for name in values}
    table = {name: [values.get(name, np.nan) for values in cases.values()] for name in NAMES if name in free}
    names = sorted(table, key=lambda name: np.nanmedian(table[name]))
    parts = np.array_split(names, -(-len(names) // _ROWS))
    with style.figure(path, len(parts) * (0.29 * len(cases) + 1.15) + 0.1, 0.15 * len(parts[0]) + 1.3) as figure:
        panels = figure.subplots(1, len(parts), squeeze=False)[0]
        for panel, some in zip(panels, parts, strict=True):
            values = np.array([table[name] for name in some])
            panel.imshow(values, cmap="Blues_r", vmin=0.0, vmax=1.0, aspect="auto")
            for (row, column), value in np.ndenumerate(values):
                if np.isfinite(value):
                    text = f"{value:.2f}".removeprefix("0") if value < 0.995 else "1"
                    look = {
                        "color": "white" if value < 0.5 else "black",
                        "fontsize": 5.5,
                        "ha": "center",
                        "va": "center",
                    }
                    panel.text(column, row, text, **look)
            named = [f"{name}  {symbol}" for name, symbol in zip(some, labels(some), strict=True)]
            panel.set_yticks(range(len(some)), named, fontsize=7)
            panel.set_xticks(
                range(len(cases)), [case.replace(" ", "\n", 1) for case in cases], rotation=90, fontsize=6.5
            )
            panel.xaxis.tick_top()
            panel.set_ylim(len(parts[0]) - 0.5, -0.5)
            panel.tick_params(length=0)
            panel.grid(visible=False)
            panel.spines[:].set_visible(False)


def draw_scatter(path, cases, groups) -> None:
    """Scatter along each direction of the Fisher information against its singular value, all cases in one panel.

    Parameters
    ----------
    cases : case -> (singular values (n_params,), null directions (n_params,) true or false,
        group -> standard deviation along each direction (n_params,) in prior sd)
    groups : group -> (label, marker, colour)
    """
    values, null = (np.concatenate([case[k] for case in cases.values()]) for k in (0, 1))
    scatter = {group: np.concatenate([case[2][group] for case in cases.values()]) for group in groups}
    reach = values[~null].min() / 2.0, 2.0 * values.max()
    edges = np.geomspace(*reach, _BINS + 1)
    middles = np.sqrt(edges[1:] * edges[:-1])
    with style.figure(path, 8.0, 4.4) as figure:
        left, panel = figure.subplots(1, 2, sharey=True, width_ratios=(0.16, 1.0))
        ends = {}
        for k, (group, (text, marker, colour)) in enumerate(groups.items()):
            look = {"ms": 3, "mec": colour, "mfc": "none", "mew": 0.5, "alpha": 0.5}
            left.semilogy(k + 0.3 * np.linspace(-1, 1, np.count_nonzero(null)), scatter[group][null], marker, **look)
            panel.loglog(values[~null], scatter[group][~null], marker, **look)
            some = [scatter[group][~null & (values >= a) & (values < b)] for a, b in pairwise(edges)]
            middle = np.array([np.median(one) if len(one) else np.nan for one in some])
            known = np.isfinite(middle)
            panel.loglog(middles[known], middle[known], color=colour, lw=2.4)
            ends[text] = middle[known][-1], colour
        axis = np.geomspace(*reach, 200)
        line = 1.0 / np.sqrt(1.0 + axis**2)
        panel.loglog(axis, line, color=style.TRUTH, lw=1.0, ls="--")
        ends["data and prior, linear"] = line[-1], style.TRUTH
        panel.axvline(1.0, color=style.TRUTH, lw=0.6, ls=":")
        above = {"transform": panel.get_xaxis_transform(), "va": "bottom", "fontsize": 8}
        panel.text(0.6, 1.0, "not seen by the data", ha="right", **above)
        panel.text(1.7, 1.0, "seen", **above)
        panel.set(xlim=reach, xlabel="singular value of the direction, 1 / prior sd")
        left.set_xticks([])
        left.grid(axis="x", visible=False)
        left.set(xlim=(-0.6, len(groups) - 0.4), xlabel="null\ndirections")
        left.set_ylabel("standard deviation along the direction, prior sd")
        low, high = np.log(panel.get_ylim())
        lowest = -np.inf
        for text, (value, colour) in sorted(ends.items(), key=lambda item: item[1][0]):
            lowest = max((np.log(value) - low) / (high - low), lowest + _LINE)
            look = {"transform": panel.transAxes, "va": "center", "fontsize": 9, "color": colour}
            panel.text(1.015, lowest, text, **look)


def draw_distances(path, cases, groups, measures) -> None:
    """How far out each coefficient set lies, over the 95 % limit of posterior draws: a panel a measure.

    Parameters
    ----------
    cases : case -> group -> measure -> (n_sets,)
    groups : group -> (label, marker, filled or not)
    measures : measure -> label
    """
    with style.figure(path, 9.5, 0.42 * len(cases) + 1.7) as figure:
        panels = figure.subplots(1, len(measures), sharey=True, squeeze=False)[0]
        for panel, (measure, label) in zip(panels, measures.items(), strict=True):
            for row, (case, places) in enumerate(cases.items()):
                colour = style.VEHICLES[case.split()[0]]
                for (group, (_, marker, filled)), shift in zip(groups.items(), (-0.18, 0.18, 0.0), strict=False):
                    values = np.asarray(places[group][measure])
                    y = row + shift + np.linspace(-0.1, 0.1, len(values)) * (len(values) > 1)
                    look = {"ms": 3.5, "mec": colour, "mew": 0.8, "mfc": colour if filled else "none"}
                    panel.semilogx(values, y, marker, **look)
            panel.axvline(1.0, color=style.TRUTH, lw=0.9)
            low, high = panel.get_xlim()
            panel.set(xlabel=label, xlim=(min(low, 0.09), max(high, 11.0)))
            panel.xaxis.set_minor_formatter(NullFormatter())
        panels[0].set_yticks(range(len(cases)), list(cases), fontsize=8)
        panels[0].invert_yaxis()
        for text, marker, filled in groups.values():
            fill = style.TRUTH if filled else "none"
            panels[0].plot([], [], marker, ms=4, mec=style.TRUTH, mfc=fill, label=text)
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=8)
