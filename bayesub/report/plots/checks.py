"""What stands behind "converged and fits": traces and ranks of ensembles, two samplers side by side, and residuals."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from scipy import special

from bayesub.inference.checks.convergence import rank_histograms, rank_spread
from bayesub.inference.checks.fit import Criticism
from bayesub.report.plots import style
from bayesub.report.plots.coefficients import RUNS, labels
from bayesub.report.plots.style import Equations, Paths

if TYPE_CHECKING:  # it loads a sampler
    from bayesub.inference.sampling import CrossCheck, Posterior

BINS = 20
SHOWN = 3  # parameters
MEANS = 75  # of each ensemble at most
DEVIATION = 2.5758  # standard deviations that hold 99 % of a normal
LIMIT = 5.0  # of the axis of residuals, in standard deviations, unless a tenth of them is beyond
_INSIDE = 0.99  # of a histogram's bars and a channel's correlations lie between the dashed lines, each by itself
_LINES = ("-", "--", "-.", ":")
_ERRORS = np.linspace(-5.0, 5.0, 41)  # bins of differences
_KINDS = (("mean_z", "means"), ("sd_z", "sds"), ("correlation_z", "correlations"))


def half_widths(posterior: Posterior) -> np.ndarray:
    """(n_params,) by which a bar of ranks is off 1 in one of a hundred cases, by the bulk effective sample size.

    That of the tails would not do: where an ensemble is elsewhere it is small, and the band would hide it.
    """
    return DEVIATION * rank_spread(posterior.bulk_ess, len(posterior.chain), BINS)


def worst(posterior: Posterior) -> np.ndarray:
    """(SHOWN,) positions of the parameters that mix worst, the largest R-hat first."""
    return np.argsort(-posterior.rhat, kind="stable")[:SHOWN]


def outside(posterior: Posterior) -> float:
    """Share of all bars, of every parameter and ensemble, that are beyond their half-width."""
    return float(np.mean(np.abs(rank_histograms(posterior.thinned().chain, BINS) - 1.0) > half_widths(posterior)))


def draw_ranks(path: Paths, posterior: Posterior, equations: Equations) -> None:
    """A row for each of the parameters that mix worst: means of the walkers by step, and ranks, a line an ensemble."""
    members, kept, widths = worst(posterior), posterior.thinned(), half_widths(posterior)
    chain = kept.chain[..., members]
    histograms = rank_histograms(chain, BINS)
    together = -(-chain.shape[1] // MEANS)  # steps of which one mean is drawn
    n = chain.shape[1] // together
    means = chain[:, : n * together].reshape(len(chain), n, -1, len(members)).mean(axis=2)
    steps = kept.thin * together * (np.arange(n) + 0.5)
    styles = [{"color": RUNS[k % 6], "ls": _LINES[k % 4], "lw": 1.0} for k in range(len(chain))]
    edges, names = np.linspace(0.0, 1.0, BINS + 1), labels([posterior.names[k] for k in members], equations)
    with style.figure(path, 8.0, 0.8 + 1.1 * len(members)) as figure:
        rows = figure.subplots(len(members), 2, squeeze=False, sharex="col", width_ratios=[1.5, 1.0])
        for k, ((left, right), name) in enumerate(zip(rows, names, strict=True)):
            for e, line in enumerate(styles):
                left.plot(steps, means[e, :, k], label=f"ensemble {e + 1}", **line)
                right.stairs(histograms[e, :, k], edges, baseline=None, **line)
            width = widths[members[k]]
            right.axhspan(1.0 - width, 1.0 + width, color=style.PRIOR, alpha=0.5, lw=0, zorder=0.5)
            reach = 1.15 * max(width, np.abs(histograms[..., k] - 1.0).max())
            right.set_ylim(1.0 - reach, 1.0 + reach)
            left.set_ylabel(name, fontsize=style.NAMES)
            left.ticklabel_format(axis="y", useOffset=False, scilimits=(-3, 4), useMathText=True)
        rows[0, 0].set_title("mean of the walkers of each ensemble", fontsize=9)
        rows[0, 1].set_title("ranks among all; grey: 99 % by chance", fontsize=9)
        rows[-1, 0].set_xlabel("step after warm-up")
        rows[-1, 1].set_xlabel("rank over number of draws")
        handles, words = rows[0, 0].get_legend_handles_labels()
        figure.legend(handles, words, loc="outside lower center", ncols=min(len(words), 6), fontsize=8)


def draw_cross_check(path: Paths, check: CrossCheck) -> None:
    """Differences of all means, sds and correlations in Monte Carlo standard errors, beside the normal curve.

    Equal posteriors make differences that are normal; the dashed lines hold all of them in 99 of 100 comparisons.
    """
    with style.figure(path, 6.6, 2.3) as figure:
        panels = figure.subplots(1, len(_KINDS), sharex=True)
        fine = np.linspace(_ERRORS[0], _ERRORS[-1], 200)
        for panel, (key, word) in zip(panels, _KINDS, strict=True):
            values = np.clip(getattr(check, key), _ERRORS[0], _ERRORS[-1])
            panel.hist(values, _ERRORS, density=True, color=style.POSTERIOR)
            panel.plot(fine, np.exp(-0.5 * fine**2) / np.sqrt(2.0 * np.pi), color=style.TRUTH, lw=1.0)
            for edge in (-check.threshold, check.threshold):
                panel.axvline(edge, color=style.SQP, lw=1.0, ls="--")
            largest = np.abs(getattr(check, key)).max(initial=0.0)
            panel.set_title(f"{len(values)} {word}, largest {largest:.1f}", fontsize=8.5)
            panel.set_yticks([])
        panels[1].set_xlabel("emcee - NUTS (Monte Carlo standard errors)")


def draw_criticism(
    path: Paths, criticism: Criticism, residuals: Mapping[str, np.ndarray], times: Mapping[str, np.ndarray]
) -> None:
    """A row for each channel: residuals against time, their correlations, and a histogram of their probabilities.

    `residuals`: channel -> quantile residuals (n_draws, n_readings); the first draw is drawn against time, the
    histogram is of all; `times`: channel -> times (n_readings,) of its residuals, s.
    """
    names = list(residuals)
    last = max(float(times[name][-1]) for name in names)
    with style.figure(path, 9.0, 0.9 + 1.15 * len(names), (0.75, 0.15, 0.5, 0.3)) as figure:
        spaces = {"wspace": 0.25, "hspace": 0.3}
        rows = figure.subplots(len(names), 3, squeeze=False, width_ratios=[2.4, 1.0, 1.0], gridspec_kw=spaces)
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
