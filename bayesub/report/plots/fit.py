"""The residuals of every channel beside what its noise model makes of them."""

from collections.abc import Mapping

import numpy as np
from scipy import special

from bayesub.inference.checks.fit import Criticism
from bayesub.report.plots import style
from bayesub.report.plots.style import Paths

LIMIT = 5.0  # of the axis of residuals, in standard deviations, unless a tenth of them is beyond
BINS = 20
_INSIDE = 0.99  # of a histogram's bars and a channel's correlations lie between the dashed lines, each by itself


def draw(
    path: Paths, criticism: Criticism, residuals: Mapping[str, np.ndarray], times: Mapping[str, np.ndarray]
) -> None:
    """A row for each channel: residuals against time, their correlations, and a histogram of their probabilities.

    `residuals`: channel -> quantile residuals (n_draws, n_readings); the first draw is drawn against time, the
    histogram is of all; `times`: channel -> times (n_readings,) of its residuals, s.
    """
    names = list(residuals)
    with style.figure(path, 9.0, 0.9 + 1.15 * len(names), (0.75, 0.15, 0.5, 0.3)) as figure:
        rows = figure.subplots(
            len(names), 3, squeeze=False, width_ratios=[2.4, 1.0, 1.0], sharex="col", gridspec_kw={"wspace": 0.25}
        )
        figure.align_ylabels(rows[:, 0])
        for row, name in zip(rows, names, strict=True):
            check = criticism.checks[name]
            colour = style.SQP if check.failed else style.POSTERIOR
            _draw_against_time(row[0], times[name], residuals[name][0], colour)
            row[0].set_ylabel(f"{name} \u2717" if check.failed else name, color=colour)
            _draw_correlations(row[1], check, colour)
            _draw_histogram(row[2], residuals[name], colour)
        titles = ("quantile residuals; grey: three sd", "correlation at a lag", "probability below a reading")
        for axis, title in zip(rows[0], titles, strict=True):
            axis.set_title(title, fontsize=9)
        n_lags = max((len(criticism.checks[name].correlations) for name in names), default=0)
        rows[-1, 1].set_xticks([lag for lag in (1, 5, 10, 15, 20) if lag <= max(n_lags, 1)])  # shared by all rows
        rows[-1, 2].set_xticks([0, 0.5, 1])
        for axis, label in zip(rows[-1], ("time (s)", "lag (readings)", "0 to 1, flat if it fits"), strict=True):
            axis.set_xlabel(label)


def _draw_against_time(axis, times, residuals, colour):
    axis.axhspan(-3, 3, color=style.PRIOR, alpha=0.4, lw=0)
    limit = max(LIMIT, 1.2 * np.quantile(np.abs(residuals), 0.9))
    beyond = np.abs(residuals) > limit
    axis.plot(times[~beyond], residuals[~beyond], ".", ms=2.0, color=colour)
    axis.plot(times[beyond], limit * np.sign(residuals[beyond]), "d", ms=3.5, color=colour)
    axis.set_ylim(-1.15 * limit, 1.15 * limit)
    if limit == LIMIT:
        axis.set_yticks([-3, 0, 3])


def _draw_correlations(axis, check, colour):
    lags = np.arange(1, len(check.correlations) + 1)
    if len(lags):
        band = special.ndtri(0.5 + 0.5 * _INSIDE) / np.sqrt(check.n_readings)
        for edge in (-band, band):
            axis.axhline(edge, color=style.TRUTH, lw=0.8, ls="--")
        axis.vlines(lags, 0.0, check.correlations, color=colour, lw=3.0)
        axis.axhline(0.0, color=style.TRUTH, lw=0.5)
        size = max(0.3, 1.1 * np.abs(check.correlations).max())
        axis.set_ylim(-min(size, 1.05), min(size, 1.05))


def _draw_histogram(axis, residuals, colour):
    n = residuals.shape[1]
    spread = special.ndtri(0.5 + 0.5 * _INSIDE) * np.sqrt(n / BINS * (1.0 - 1.0 / BINS)) * BINS / n
    heights, edges = np.histogram(special.ndtr(residuals), BINS, (0.0, 1.0), density=True)
    axis.stairs(heights, edges, fill=True, color=colour)
    for edge in (max(0.0, 1.0 - spread), 1.0 + spread):
        axis.axhline(edge, color=style.TRUTH, lw=0.8, ls="--")
    axis.set_ylim(0.0, max(2.0, 1.05 * heights.max()))
