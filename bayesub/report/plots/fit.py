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
    last = max(float(times[name][-1]) for name in names)
    with style.figure(path, 9.0, 0.9 + 1.15 * len(names), (0.75, 0.15, 0.5, 0.3)) as figure:
        rows = figure.subplots(
            len(names), 3, squeeze=False, width_ratios=[2.4, 1.0, 1.0], gridspec_kw={"wspace": 0.25, "hspace": 0.3}
        )
        figure.align_ylabels(rows[:, 0])
        for row, name in zip(rows, names, strict=True):
            check = criticism.checks[name]
            colour = style.SQP if check.failed else style.POSTERIOR
            _draw_against_time(row[0], times[name], residuals[name][0], colour)
            row[0].set_ylabel(f"{name} \u2717" if check.failed else name)
            row[0].set_xlim(-0.04 * last, 1.04 * last)
            row[2].set_xticks([0, 0.5, 1])
            for axis in row[::2]:
                axis.tick_params(labelbottom=row[0] is rows[-1, 0])
            _draw_correlations(row[1], check, colour)
            _draw_histogram(row[2], residuals[name], colour)
        titles = ("quantile residuals; grey: three sd", "correlation at a lag", "probability below a reading")
        for axis, title in zip(rows[0], titles, strict=True):
            axis.set_title(title, fontsize=9)
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
        size = min(max(0.3, 1.2 * band, 1.1 * np.abs(check.correlations).max()), 1.05)
        axis.set(xlim=(0.2, len(lags) + 0.8), ylim=(-size, size))
        axis.set_xticks([lag for lag in ((1, 5, 10, 15, 20) if len(lags) > 7 else lags) if lag <= len(lags)])


def _draw_histogram(axis, residuals, colour):
    n = residuals.shape[1]
    bins = BINS if n > 5 * BINS else BINS // 4  # of a few readings, whose bars are those of single ones
    spread = special.ndtri(0.5 + 0.5 * _INSIDE) * np.sqrt(n / bins * (1.0 - 1.0 / bins)) * bins / n
    heights, edges = np.histogram(special.ndtr(residuals), bins, (0.0, 1.0), density=True)
    axis.stairs(heights, edges, fill=True, color=colour)
    for edge in (max(0.0, 1.0 - spread), 1.0 + spread):
        axis.axhline(edge, color=style.TRUTH, lw=0.8, ls="--")
    axis.set_ylim(0.0, max(2.0, 1.1 * (1.0 + spread), 1.05 * heights.max()))
