"""Pictures of a posterior and of an estimate by themselves, without the boat: a row a parameter."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from matplotlib.axes import Axes

from bayesub.plots import style

ROWS = 60  # that can be read below each other
_LEFT, _RIGHT, _BOTTOM, _TOP, _ROW = 1.6, 0.1, 0.5, 0.35, 0.22  # inches


def draw_posterior(path, posterior) -> None:
    """90 and 50 % intervals of the parameters, in standard deviations of the prior from its mean."""
    quantiles = (posterior.quantiles([0.05, 0.25, 0.5, 0.75, 0.95]) - posterior.prior_mean) / posterior.prior_sd
    with _rows(path, posterior.names) as axis:
        n = len(axis.get_yticks())
        axis.axvspan(-1.645, 1.645, color="0.92", zorder=0, label="prior, 90 %")
        for low, high, width in ((0, 4, 1.5), (1, 3, 4.5)):
            axis.hlines(range(n), quantiles[low, :n], quantiles[high, :n], color=style.POSTERIOR, lw=width)
        axis.plot(quantiles[2, :n], range(n), "o", ms=4, mfc="white", color=style.POSTERIOR, label="posterior")
        axis.set_xlabel("standard deviations of the prior, from its mean")


def draw_estimate(path, estimate) -> None:
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
