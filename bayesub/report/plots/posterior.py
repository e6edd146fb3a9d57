"""Correlations of a posterior, its nuisance parameters, and intervals of all parameters by themselves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.image import AxesImage

from bayesub.report.plots import style
from bayesub.report.plots.coefficients import QUANTILES, borders, labels
from bayesub.report.plots.style import Equations, Paths

if TYPE_CHECKING:  # they load a sampler and searches
    from bayesub.inference.baselines import Estimate
    from bayesub.inference.sampling import Posterior

STRONG = 0.3  # correlation of what is drawn
NUMBERS = 0.5  # correlation from which its number is written
FEW = 6  # parameters that are all drawn
ROWS = 60  # that can be read below each other
MOST = 30  # parameters of one map
_CELL, _BLOCK = 0.29, 3.3  # inches, of a map: a cell, and one of several maps with its names
_LEFT, _RIGHT, _BOTTOM, _TOP, _ROW = 1.6, 0.1, 0.5, 0.35, 0.22  # inches, of a figure of rows


def strong_block(names: Sequence[str], correlation: np.ndarray) -> tuple[list[str], np.ndarray]:
    """The parameters with a correlation of STRONG and more, and their matrix (n, n); all of a few."""
    beside = np.abs(correlation - np.diag(np.diag(correlation)))
    members = np.flatnonzero(beside.max(axis=0) >= STRONG)
    if len(names) <= FEW or len(members) < 2:
        members = np.arange(len(names))
    return [names[k] for k in members.tolist()], correlation[np.ix_(members, members)]


def clustered(names: Sequence[str], correlation: np.ndarray, equations: Equations) -> list[np.ndarray]:
    """Positions of the parameters of each axis, and of others, those that are correlated beside each other."""
    from scipy.cluster import hierarchy

    groups = np.split(np.arange(len(names)), borders(names, equations))
    for k, group in enumerate(groups):
        if len(group) > 2:
            apart = 1.0 - np.minimum(np.abs(correlation[np.ix_(group, group)]), 1.0)[np.triu_indices(len(group), 1)]
            groups[k] = group[hierarchy.leaves_list(hierarchy.linkage(apart, "average", optimal_ordering=True))]
    return groups


def draw_correlation(path: Paths, names: Sequence[str], correlation: np.ndarray, equations: Equations) -> None:
    """Heat map of the correlations (n, n) of parameters that have strong ones; `equations` are the coefficients'.

    Of many parameters the whole has axes for names, and a block an axis beside it.
    """
    names, correlation = strong_block(names, correlation)
    groups = clustered(names, correlation, equations)
    whole, blocks = np.concatenate(groups), [group for group in groups if len(group) > 1]
    shown = [whole, *blocks] if len(names) > MOST else [whole]
    rows = 2 if len(shown) > 1 else 1
    columns = -(-len(shown) // rows)
    size = _BLOCK if rows > 1 else max(3.6, _CELL * len(names) + 0.9)
    with style.figure(path, size * columns + 1.2, size * rows) as figure:
        panels = figure.subplots(rows, columns, squeeze=False).ravel()
        for panel, members in zip(panels, shown, strict=False):
            some = [names[k] for k in members]
            image = _draw_map(panel, some, correlation[np.ix_(members, members)], equations)
        for panel in panels[len(shown) :]:
            panel.set_visible(False)
        figure.colorbar(image, ax=[*panels], shrink=0.6, pad=0.02, label="posterior correlation")


def _draw_map(axis, names, correlation, equations) -> AxesImage:
    """One map, with numbers where a correlation is large; of many parameters with axes in place of names."""
    n, ends = len(names), [0, *borders(names, equations), len(names)]
    axis.grid(visible=False)
    axis.spines[:].set_visible(False)
    for k in ends[1:-1]:
        axis.axhline(k - 0.5, color=style.TRUTH, lw=0.6)
        axis.axvline(k - 0.5, color=style.TRUTH, lw=0.6)
    places, words = np.arange(n), labels(names, equations)
    if n > MOST:
        places = np.array([0.5 * (a + b - 1) for a, b in pairwise(ends)])
        words = [equations.term(names[k]).axis if names[k] in equations.index else "" for k in ends[:-1]]
    axis.set_xticks(places, words, rotation=90, fontsize=style.NAMES)
    axis.set_yticks(places, words, fontsize=style.NAMES)
    for row, column in np.argwhere((np.abs(correlation) >= NUMBERS) & ~np.eye(n, dtype=bool) & (n <= MOST)):
        rho = correlation[row, column]
        look = {"ha": "center", "va": "center", "fontsize": 6.5, "color": style.on_colour(rho)}
        axis.text(column, row, f"{rho:.2f}".replace("0.", ".").replace("-", "\u2212"), look)
    others = np.where(np.eye(n, dtype=bool), np.nan, correlation)
    return axis.imshow(others, cmap=style.CORRELATION, vmin=-1, vmax=1)


def draw_intervals(path: Paths, posterior: Posterior) -> None:
    """90 and 50 % intervals of the parameters, in standard deviations of the prior from its mean."""
    quantiles = (posterior.quantiles(QUANTILES) - posterior.prior_mean) / posterior.prior_sd
    with _rows(path, posterior.names) as axis:
        n = len(axis.get_yticks())
        axis.axvspan(-1.645, 1.645, color="0.92", zorder=0, label="prior, 90 %")
        for low, high, width in ((0, 4, 1.5), (1, 3, 4.5)):
            axis.hlines(range(n), quantiles[low, :n], quantiles[high, :n], color=style.POSTERIOR, lw=width)
        axis.plot(quantiles[2, :n], range(n), "o", ms=4, mfc="white", color=style.POSTERIOR, label="posterior")
        axis.set_xlabel("standard deviations of the prior, from its mean")


def draw_estimate(path: Paths, estimate: Estimate) -> None:
    """The solutions from all starts over the best one, with its sds if it has any, of what is not zero there."""
    kept = np.flatnonzero(np.isfinite(estimate.values) & (estimate.values != 0.0))
    ratios = estimate.solutions[:, kept] / estimate.values[kept]
    with _rows(path, [estimate.names[k] for k in kept]) as axis:
        n = len(axis.get_yticks())
        axis.axvline(1.0, color="0.7", lw=0.8)
        for solution in ratios[:0:-1]:
            axis.plot(solution[:n], range(n), "o", ms=4, mfc="none", color=style.SQP)
        if estimate.covariance is not None:
            sds = np.sqrt(np.diag(estimate.covariance))[kept] / np.abs(estimate.values[kept])
            axis.hlines(range(n), 1.0 - sds[:n], 1.0 + sds[:n], color=style.SQP, lw=1.0)
        axis.plot(ratios[0, :n], range(n), "o", ms=4.5, color=style.SQP, label=f"best of {len(ratios)}")
        axis.set_xlabel("solution over the best one")


@contextmanager
def _rows(path, names) -> Iterator[Axes]:
    """The axes of a figure with a row for each of the first names, with a legend above if something has a label."""
    names = names[:ROWS]
    height = _BOTTOM + _TOP + _ROW * max(len(names), 2)
    with style.figure(path, 6.5, height, (_LEFT, _RIGHT, _BOTTOM, _TOP)) as figure:
        axis = figure.subplots()
        axis.set_yticks(range(len(names)), [style.plain(name) for name in names])
        axis.set_ylim(len(names) - 0.4, -0.6)
        yield axis
        if axis.get_legend_handles_labels()[0]:
            axis.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, fontsize=8, borderaxespad=0.1)
