"""What stands behind "converged": traces and ranks of the ensembles; and two samplers of one posterior side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bayesub.inference.checks.convergence import rank_histograms, rank_spread
from bayesub.report.plots import style
from bayesub.report.plots.coefficients import RUNS, labels
from bayesub.report.plots.style import Equations, Paths

if TYPE_CHECKING:  # it loads a sampler
    from bayesub.inference.sampling import CrossCheck, Posterior

BINS = 20
SHOWN = 3  # parameters
MEANS = 75  # of each ensemble at most
DEVIATION = 2.5758  # standard deviations that hold 99 % of a normal
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
    histograms = rank_histograms(posterior.thinned().chain, BINS)
    return float(np.mean(np.abs(histograms - 1.0) > half_widths(posterior)))


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
        curve = np.exp(-0.5 * fine**2) / np.sqrt(2.0 * np.pi)
        for panel, (key, word) in zip(panels, _KINDS, strict=True):
            values = np.clip(getattr(check, key), _ERRORS[0], _ERRORS[-1])
            panel.hist(values, _ERRORS, density=True, color=style.POSTERIOR)
            panel.plot(fine, curve, color=style.TRUTH, lw=1.0)
            for edge in (-check.threshold, check.threshold):
                panel.axvline(edge, color=style.SQP, lw=1.0, ls="--")
            largest = np.abs(getattr(check, key)).max(initial=0.0)
            panel.set_title(f"{len(values)} {word}, largest {largest:.1f}", fontsize=8.5)
            panel.set_yticks([])
        panels[1].set_xlabel("emcee - NUTS (Monte Carlo standard errors)")
