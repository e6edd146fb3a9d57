"""Coefficients as ratios, a row each: the picture of the thesis (Figures 33 to 59) lying on its side, and runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes

from bayesub.io.words import counted, with_unit
from bayesub.report.plots import style
from bayesub.report.plots.style import Equations, Paths, Prior

if TYPE_CHECKING:  # they load a sampler and searches
    from bayesub.inference.baselines import Estimate
    from bayesub.inference.sampling import Posterior

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)  # of intervals
PRIOR_EDGES = (0.05, 0.95)  # of the band of the prior
ROWS = 45  # that can be read below each other
VISIBLE = 0.015  # of the axis; of boxes that are narrower the median is drawn and not left white
PRIOR_PROBABILITIES = np.linspace(0.001, 0.999, 400)
RUNS = (style.POSTERIOR, style.SQP, style.LINEAR, style.NULL, style.WEAK, style.READINGS, style.TRUTH)  # their colours
_SPAN = 0.8  # of a row that its runs share
_LOWEST, _HIGHEST = -1.0, 3.0  # ratios of several runs that are shown


def labels(names: Iterable[str], equations: Equations) -> list[str]:
    """LaTeX labels of the coefficients of a set; other parameters by name and unit."""
    return [equations.label(name) if name in equations.index else with_unit(name) for name in names]


def borders(names: Iterable[str], equations: Equations) -> list[int]:
    """Positions at which the coefficients of another axis, or other parameters, begin."""
    axes = [equations.term(name).axis if name in equations.index else name[0] for name in names]
    return [k for k in range(1, len(axes)) if axes[k] != axes[k - 1]]


def ratios(values: Any, reference: np.ndarray, prior: Prior) -> np.ndarray:
    """Values (.., n or more) as ratios to a reference (n,); where that is zero, one plus the value in prior sds."""
    n = len(reference)
    values = np.asarray(values)[..., :n]
    absent = reference == 0.0
    return np.where(absent, 1.0 + values / prior.sd[:n], values / np.where(absent, 1.0, reference))


def prior_density(quantiles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places and density of a prior from its quantiles at PRIOR_PROBABILITIES."""
    quantiles = np.sort(quantiles)
    return 0.5 * (quantiles[1:] + quantiles[:-1]), np.diff(PRIOR_PROBABILITIES) / np.diff(quantiles)


def star(names: Sequence[str], reference: np.ndarray, equations: Equations) -> list[str]:
    """Labels of coefficients (n,), with a star where the reference (n,) is zero."""
    stars = ("*" if zero else "" for zero in reference == 0.0)
    return [label + star for label, star in zip(labels(names, equations), stars, strict=True)]


def draw(
    path: Paths,
    posterior: Posterior,
    prior: Prior,
    reference: np.ndarray,
    estimates: Sequence[Estimate],
    reference_word: str,
    equations: Equations,
    *,
    wide: Prior | None = None,
) -> None:
    """Prior band, posterior intervals and the solutions of the baselines.

    `posterior` and `prior`: of n_params parameters; `reference`: (n_coefficients,) values that count as one, of the
    first n_coefficients parameters of the posterior; `estimates`: their coefficients may stand in another order;
    `wide`: the prior with its scale unknown, whose band is an outline.
    """
    n = len(reference)
    n_panels = -(-n // ROWS)
    length = -(-n // n_panels)
    places = [[estimate.names.index(name) for name in posterior.names[:n]] for estimate in estimates]
    values = [
        ratios(estimate.solutions[:, place], reference, prior)
        for estimate, place in zip(estimates, places, strict=True)
    ]
    quantiles = posterior.quantiles(QUANTILES)
    low, high = limits(quantiles, prior, reference, values)
    with style.figure(path, 7.4 * n_panels, 0.235 * length + 1.25) as figure:
        panels = figure.subplots(1, n_panels, squeeze=False, sharex=True)[0]
        for panel, rows in zip(panels, np.array_split(np.arange(n), n_panels), strict=True):
            intervals(panel, rows, quantiles, prior, reference, lying=True)
            if wide is not None:
                ends = np.sort(ratios([wide.quantiles(p) for p in PRIOR_EDGES], reference, prior)[:, rows], axis=0)
                outline = {
                    "fc": "none",
                    "ec": style.TRUTH,
                    "lw": 0.5,
                    "ls": "--",
                    "label": "prior, scale unknown, 90 %",
                }
                panel.barh(rows, np.ptp(ends, axis=0), 0.8, ends[0], **outline)
            for estimate, some in zip(estimates, values, strict=True):
                _draw_estimate(panel, rows, estimate, some[:, rows], (low, high))
            names = posterior.names[rows[0] : rows[-1] + 1]
            symbols = star(names, reference[rows], equations)
            panel.set_yticks(rows, [f"{name}   {symbol}" for name, symbol in zip(names, symbols, strict=True)])
            relative = posterior.sd[rows] / np.abs(posterior.mean[rows])
            words = [f"{100 * value:.2g} %" if value < 1.0 else "> 100 %" for value in relative]
            style.write_beside(panel, rows, words, "posterior sd over mean")
            for k in borders(names, equations):
                panel.axhline(rows[0] + k - 0.5, color=style.TRUTH, lw=0.5, ls=":")
            note = "" if np.all(reference) else "; * zero there: 1 + value / prior sd"
            panel.set(xlim=(low, high), ylim=(rows[0] + length - 0.4, rows[0] - 0.6))
            panel.set_xlabel(f"ratio to {reference_word}{note}")
            panel.grid(axis="y", visible=False)
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=8.5)


def limits(
    quantiles: np.ndarray, prior: Prior, reference: np.ndarray, values: Iterable[np.ndarray]
) -> tuple[float, float]:
    """Limits of the ratios: all of the prior, the posterior and values, unless they are far off."""
    edges = [ratios(some, reference, prior) for some in ([prior.quantiles(p) for p in PRIOR_EDGES], quantiles)]
    everything = np.concatenate([np.ravel(some) for some in (*edges, *values)])
    everything = everything[np.isfinite(everything)]
    return max(everything.min() - 0.1, -1.5), min(everything.max() + 0.1, 4.0)


def _draw_estimate(panel, rows, estimate, values, limits) -> None:
    """The solutions (n_solutions, n_rows) of a baseline; triangles point to those beyond the limits."""
    search = estimate.method == "SQP"
    n, (low, high) = len(values), limits
    colour, marker, size = (style.SQP, "o", 3.4) if search else (style.LINEAR, "X", 5.0)
    word = f"SQP from {counted(n, 'start')}" if search else f"{estimate.method}, no noise"
    shifts = np.linspace(-0.25, 0.25, n) if n > 1 else np.array([0.3])
    y = rows + shifts[:, None]
    inside = (values >= low) & (values <= high)
    panel.plot(values[inside], y[inside], marker, ms=size, mew=0, color=colour, label=word, zorder=3)
    for beyond, edge, arrow in ((values < low, low, "<"), (values > high, high, ">")):
        if beyond.any():
            look = {"ms": 5, "mew": 0, "color": colour, "clip_on": False, "zorder": 3}
            panel.plot(np.full(beyond.sum(), edge), y[beyond], arrow, **look)


def intervals(
    axis: Axes, columns: np.ndarray, quantiles: np.ndarray, prior: Prior, reference: np.ndarray, *, lying: bool = False
) -> tuple[float, float]:
    """Draw prior band and posterior intervals; the lowest and highest ratio of them.

    `columns`: (n,) positions of the parameters, and where they are drawn; `quantiles`: (5, n_params) of the posterior,
    those of QUANTILES; `reference`: (n_coefficients,) values that count as one; `lying`: whether ratios go to the right
    and not upwards.
    """

    def ratio(values):
        return np.sort(ratios(values, reference, prior)[:, columns], axis=0)

    bottom, top = ratio([prior.quantiles(p) for p in PRIOR_EDGES])
    low, q1, median, q3, high = ratio(quantiles)
    bars, lines, mark = (axis.barh, axis.hlines, "|") if lying else (axis.bar, axis.vlines, "_")
    bars(columns, top - bottom, 0.8, bottom, color=style.PRIOR, alpha=0.55, label="prior, 90 %")
    (axis.axvline if lying else axis.axhline)(1.0, color=style.TRUTH, lw=0.8)
    lines(columns, low, high, color=style.POSTERIOR, lw=1.5, label="posterior, 90 %")
    lines(columns, q1, q3, color=style.POSTERIOR, lw=5.0, label="posterior, 50 %")
    ends = min(bottom.min(), low.min()), max(top.max(), high.max())
    wide = q3 - q1 > VISIBLE * (ends[1] - ends[0])
    for some, look in ((wide, {"color": "white"}), (~wide, {"color": style.POSTERIOR, "mew": 2.0})):
        places = median[some], np.asarray(columns)[some]
        axis.plot(*(places if lying else places[::-1]), mark, ms=7, **look)
    return ends


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
        handles, words = panels[0].get_legend_handles_labels()
        columns = style.legend_columns(words, figure.get_figwidth())
        figure.legend(handles, words, loc="outside upper center", ncols=columns, fontsize=8)


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
    left.set_yticks(range(len(rows)), [name for name, _ in rows])
    right.set_yticks([])
    left.set(xlim=limits, xlabel="ratio; grey: 90 % of the prior")
    right.set_xlim(0.0, max(1.1, 1.05 * max(one["contraction"] for _, runs in rows for one in runs.values())))
    right.axvline(1.0, color=style.TRUTH, lw=0.8, ls=":")
    right.set_xlabel("posterior / prior sd")
