"""Coefficients as ratios, a row each: the picture of the thesis (Figures 33 to 59) lying on its side, and runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from bayesub.io.words import with_unit
from bayesub.report.plots import style
from bayesub.report.plots.style import Equations, Paths, Prior

if TYPE_CHECKING:  # it loads a sampler
    from bayesub.inference.sampling import Posterior

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)  # of intervals
PRIOR_EDGES = (0.05, 0.95)  # of the band of the prior
ROWS = 45  # that can be read below each other
VISIBLE = 0.015  # of the axis; of boxes that are narrower the median is drawn and not left white
RUNS = (style.POSTERIOR, style.SQP, style.LINEAR, style.NULL, style.WEAK, style.READINGS, style.TRUTH)  # their colours
BEST, LEAST = 8, 4  # coefficients of the first screen, by how much narrower they became
_SPAN = 0.8  # of a row that its runs share
_LOWEST, _HIGHEST = -1.0, 3.0  # ratios of several runs that are shown


@dataclass(frozen=True)
class Found:
    """Solutions of a baseline as they are drawn."""

    label: str  # with how many of them fit
    values: np.ndarray  # (n_solutions, n_params) in the order of the posterior
    fits: np.ndarray  # (n_solutions,) whether it fits the readings
    good: np.ndarray  # (n_solutions, n_params) whether the solution fits and is at no bound of the search there
    marker: str = "o"
    colour: str = style.SQP


def found_handles(found: Sequence[Found], beyond: Iterable[Any] = ()) -> list[Line2D]:
    """Of a legend: the marks of baselines, and what hollow ones and arrows are; `beyond`: number of arrows of each."""
    marks = [(one.marker, one.colour, one.label, bool(one.good.any())) for one in found]
    if any(not one.good.all() for one in found):
        marks.append(("o", style.SQP, "hollow: no fit, or at a bound", False))
    if arrows := sum(beyond):
        marks.append((">", style.SQP, f"arrow: beyond the axes ({arrows})", False))
    return [
        Line2D([], [], ls="", marker=marker, ms=5, mec=colour, mfc=colour if is_full else "none", label=label)
        for marker, colour, label, is_full in marks
    ]


def labels(names: Iterable[str], equations: Equations) -> list[str]:
    """LaTeX labels of the coefficients of a set; other parameters by name and unit."""
    return [equations.label(name) if name in equations.index else with_unit(name) for name in names]


def borders(names: Iterable[str], equations: Equations) -> list[int]:
    """Positions at which the coefficients of another axis, or other parameters, begin."""
    axes = [equations.term(name).axis if name in equations.index else "" for name in names]
    return [k for k in range(1, len(axes)) if axes[k] != axes[k - 1]]


def ratios(values: Any, reference: np.ndarray, prior: Prior) -> np.ndarray:
    """Values (.., n or more) as ratios to a reference (n,); where that is zero, one plus the value in prior sds."""
    n = len(reference)
    values = np.asarray(values)[..., :n]
    absent = reference == 0.0
    return np.where(absent, 1.0 + values / prior.sd[:n], values / np.where(absent, 1.0, reference))


def star(names: Sequence[str], reference: np.ndarray, equations: Equations) -> list[str]:
    """Labels of coefficients (n,), with a star where the reference (n,) is zero."""
    stars = ("*" if zero else "" for zero in reference == 0.0)
    return [label + star for label, star in zip(labels(names, equations), stars, strict=True)]


def draw(
    path: Paths,
    posterior: Posterior,
    prior: Prior,
    reference: np.ndarray,
    found: Sequence[Found],
    reference_word: str,
    equations: Equations,
    *,
    wide: Prior | None = None,
) -> None:
    """Prior band, posterior intervals and the solutions of the baselines, best known coefficients first.

    `posterior` and `prior`: of n_params parameters; `reference`: (n_coefficients,) values that count as one, of the
    first n_coefficients parameters of the posterior; `found`: solutions to draw as points; `wide`: the prior with its
    scale unknown, whose band is an outline.
    """
    n = len(reference)
    relative = posterior.sd[:n] / np.abs(posterior.mean[:n])
    order = np.argsort(relative, kind="stable")
    n_panels = -(-n // ROWS)
    length = -(-n // n_panels)
    values = [ratios(one.values, reference, prior) for one in found]
    quantiles = posterior.quantiles(QUANTILES)
    # The axis shows all of the prior, the posterior and the solutions, unless they are far off.
    edges = [ratios(some, reference, prior) for some in ([prior.quantiles(p) for p in PRIOR_EDGES], quantiles)]
    everything = np.concatenate([np.ravel(some) for some in (*edges, *values)])
    everything = everything[np.isfinite(everything)]
    low, high = max(everything.min() - 0.1, -1.5), min(everything.max() + 0.1, 4.0)
    with style.figure(path, (7.4 if n_panels == 1 else 5.0) * n_panels, 0.235 * length + 1.25) as figure:
        panels = figure.subplots(1, n_panels, squeeze=False, sharex=True)[0]
        beyond = [np.count_nonzero((some < low) | (some > high)) for some in values]
        for panel, rows in zip(panels, np.array_split(order, n_panels), strict=True):
            places = np.arange(len(rows))
            intervals(panel, rows, quantiles, prior, reference)
            if wide is not None:
                ends = np.sort(ratios([wide.quantiles(p) for p in PRIOR_EDGES], reference, prior)[:, rows], axis=0)
                look = {"fc": "none", "ec": style.TRUTH, "lw": 0.5, "ls": "--", "label": "prior, scale unknown, 90 %"}
                panel.barh(places, np.ptp(ends, axis=0), 0.8, ends[0], **look)
            for one, some in zip(found, values, strict=True):
                _draw_found(panel, one, some[:, rows], one.good[:, rows], (low, high))
            names = [posterior.names[k] for k in rows]
            symbols = star(names, reference[rows], equations)
            style.show_rows(panel, [f"{name}   {symbol}" for name, symbol in zip(names, symbols, strict=True)], length)
            words = [f"{100 * value:.2g} %" if value < 1.0 else "> 100 %" for value in relative[rows]]
            style.write_beside(panel, places, words, "sd / mean")
            note = "" if np.all(reference) else "; * zero there: 1 + value / prior sd"
            panel.set(xlim=(low, high), xlabel=f"ratio to {reference_word}{note}")
        style.legend_above(figure, [*panels[0].get_legend_handles_labels()[0], *found_handles(found, beyond)])


def _draw_found(panel, one, values, good, limits) -> None:
    """The solutions (n_solutions, n_rows) of a baseline, hollow where not good; triangles point beyond the limits."""
    low, high = limits
    shifts = np.linspace(-0.25, 0.25, len(values)) if len(values) > 1 else np.array([0.3])
    y = np.arange(values.shape[1]) + shifts[:, None]
    for some, marker in ((values < low, "<"), (values > high, ">"), ((values >= low) & (values <= high), one.marker)):
        for shown, look in ((some & good, {"mfc": one.colour, "mew": 0}), (some & ~good, {"mfc": "none", "mew": 0.7})):
            look |= {"mec": one.colour, "ms": 4.0, "ls": "", "clip_on": False, "zorder": 3}
            if shown.any():
                panel.plot(np.clip(values, low, high)[shown], y[shown], marker, **look)


def intervals(axis: Axes, rows: np.ndarray, quantiles: np.ndarray, prior: Prior, reference: np.ndarray) -> None:
    """Draw prior band and posterior intervals, a row for each of the parameters at positions `rows` (n,).

    `quantiles` (5, n_params): of the posterior, those of QUANTILES; `reference` (n_coefficients,): that count as 1.
    """

    def ratio(values):
        return np.sort(ratios(values, reference, prior)[:, rows], axis=0)

    y = np.arange(len(rows))
    bottom, top = ratio([prior.quantiles(p) for p in PRIOR_EDGES])
    low, q1, median, q3, high = ratio(quantiles)
    axis.barh(y, top - bottom, 0.8, bottom, color=style.PRIOR, alpha=0.55, label="prior, 90 %")
    axis.axvline(1.0, color=style.TRUTH, lw=0.8)
    axis.hlines(y, low, high, color=style.POSTERIOR, lw=1.5, label="posterior, 90 %")
    axis.hlines(y, q1, q3, color=style.POSTERIOR, lw=5.0, label="posterior, 50 %")
    wide = q3 - q1 > VISIBLE * (max(top.max(), high.max()) - min(bottom.min(), low.min()))
    for some, look in ((wide, {"color": "white"}), (~wide, {"color": style.POSTERIOR, "mew": 2.0})):
        axis.plot(median[some], y[some], "|", ms=7, **look)


def draw_small(
    path: Paths, posterior: Posterior, prior: Prior, reference: np.ndarray, equations: Equations, word: str
) -> None:
    """50 and 90 % of prior and posterior, ratios to `reference` (n_coefficients,), of what narrowed most and least."""
    n = len(reference)
    order = np.argsort(posterior.contraction[:n])
    rows = order if n <= BEST + LEAST else np.r_[order[:BEST], order[-LEAST:]]
    before, after = [prior.quantiles(p) for p in QUANTILES], posterior.quantiles(QUANTILES)
    with style.figure(path, *style.SMALL) as figure:
        axis = figure.subplots()
        y = np.arange(len(rows)) + (np.arange(len(rows)) >= BEST) * 0.6 * (len(rows) < n)
        axis.axvline(1.0, color=style.TRUTH, lw=0.8)
        for quantiles, colour, thick in ((before, style.PRIOR, 6.0), (after, style.POSTERIOR, 2.2)):
            low, *_, high = np.sort(ratios(quantiles, reference, prior)[:, rows], axis=0)
            axis.hlines(y, low, high, color=colour, lw=thick)
            if colour == style.POSTERIOR:
                axis.plot(0.5 * (low + high), y, "o", ms=2.5, color=colour)
        axis.set_yticks(y, labels([posterior.names[k] for k in rows], equations), fontsize=8.5)
        axis.set(ylim=(y[-1] + 0.7, -0.7), xlabel=f"ratio to {word}")
        axis.grid(axis="y", visible=False)


def draw_runs(path: Paths, rows: Sequence[tuple[str, Mapping[str, dict]]], runs: Sequence[str]) -> None:
    """A row for each coefficient: 50 and 90 % of each posterior, as ratios, and beside it posterior over prior sd.

    `rows`: name of a coefficient, and label of a run -> its numbers: ``ratios`` (the five quantiles), ``prior_ratios``
    (5 and 95 %) and ``contraction``; `runs`: their labels.
    """
    n_panels = -(-len(rows) // ROWS)
    length = -(-len(rows) // n_panels)
    with style.figure(path, 8.4 * n_panels, (0.14 + 0.1 * len(runs)) * length + 1.3) as figure:
        panels = figure.subplots(1, 2 * n_panels, squeeze=False, width_ratios=[2.2, 1.0] * n_panels)[0]
        for k in range(n_panels):
            _draw_runs(panels[2 * k], panels[2 * k + 1], rows[k * length : (k + 1) * length], runs, length)
        style.legend_above(figure, panels[0].get_legend_handles_labels()[0])


def _draw_runs(left, right, rows, labels, length) -> None:
    """Intervals on the left and contractions on the right, of some of the rows."""
    step = _SPAN / len(labels)
    ends = [value for _, runs in rows for one in runs.values() for value in (*one["ratios"], *one["prior_ratios"])]
    limits = max(min(ends) - 0.1, _LOWEST), min(max(ends) + 0.1, _HIGHEST)
    left.axvline(1.0, color=style.TRUTH, lw=0.8, zorder=1)
    for place, (label, colour) in enumerate(zip(labels, RUNS, strict=False)):
        shift = (place + 0.5) * step - 0.5 * _SPAN
        present = [(y + shift, runs[label]) for y, (_, runs) in enumerate(rows) if label in runs]
        if not present:
            continue
        y = np.array([at for at, _ in present])
        low, q1, median, q3, high = np.array([one["ratios"] for _, one in present]).T
        bottom, top = np.array([one["prior_ratios"] for _, one in present]).T
        left.hlines(y, bottom, top, color=style.PRIOR, lw=3.2, alpha=0.6, zorder=1)
        left.hlines(y, low, high, color=colour, lw=1.2, label=label)
        left.hlines(y, q1, q3, color=colour, lw=3.2)
        wide = q3 - q1 > VISIBLE * (limits[1] - limits[0])
        left.plot(median[wide], y[wide], "|", color="white", ms=4)
        left.plot(median[~wide], y[~wide], "o", color=colour, ms=3.2, mew=0)
        right.plot([one["contraction"] for _, one in present], y, "o", ms=3.2, mew=0, color=colour)
    for axis in (left, right):
        axis.set_ylim(length - 0.5, -0.5)
        axis.grid(axis="y", visible=False)
        for k in range(len(rows) - 1):
            axis.axhline(k + 0.5, color="#E6E6E6", lw=0.6)
    names, most = [name for name, _ in rows], max(one["contraction"] for _, runs in rows for one in runs.values())
    left.set(xlim=limits, xlabel="ratio; grey: 90 % of the prior", yticks=range(len(rows)), yticklabels=names)
    right.set(xlim=(0.0, max(1.1, 1.05 * most)), xlabel="posterior / prior sd", yticks=[])
    right.axvline(1.0, color=style.TRUTH, lw=0.8, ls=":")
