"""The small pictures of the first screen of a report: the track, the coefficients, the strongest trade-off."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy import special

from bayesub.report.plots import corner, prediction, style
from bayesub.report.plots.coefficients import QUANTILES, labels, ratios
from bayesub.report.plots.style import Equations, Paths, Prior

if TYPE_CHECKING:  # it loads a sampler
    from bayesub.inference.sampling import Posterior

BEST, LEAST = 8, 4  # coefficients, by how much narrower they became
_SIZE = 3.5, 2.75  # inches
_NEAR = 0.03  # of the prior, the sd of a pair beside which it is drawn


def draw_fan(path: Paths, tracks: Sequence[np.ndarray]) -> None:
    """Tracks (n_draws, n_times, 12) of the prior and of the posterior."""
    with style.figure(path, *_SIZE) as figure:
        prediction.draw_tracks(figure.subplots(), *tracks)


def chosen(contraction: np.ndarray) -> np.ndarray:
    """Places of the coefficients that narrowed most and least, best first, by posterior over prior sd (n,)."""
    order = np.argsort(contraction)
    return order if len(order) <= BEST + LEAST else np.r_[order[:BEST], order[-LEAST:]]


def draw_forest(
    path: Paths, posterior: Posterior, prior: Prior, reference: np.ndarray, equations: Equations, word: str
) -> None:
    """50 and 90 % of prior and posterior of some coefficients as ratios to `reference` (n_coefficients,)."""
    n = len(reference)
    rows = chosen(posterior.contraction[:n])
    before, after = [prior.quantiles(p) for p in QUANTILES], posterior.quantiles(QUANTILES)
    with style.figure(path, *_SIZE) as figure:
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


def draw_pair(path: Paths, draws: np.ndarray, prior: np.ndarray, names: Sequence[str], word: str) -> None:
    """Draws (n, 2) of two coefficients as ratios, and the ellipse that holds 90 % of their prior.

    `prior`: (2, 2) the 5 and 95 % quantiles of each; `word`: what ratios refer to.
    """
    with style.figure(path, *_SIZE) as figure:
        axis = figure.subplots()
        circle = corner.CIRCLE.T * np.ptp(prior, axis=1) / np.ptp(special.ndtri([0.05, 0.95]))
        if draws.std(axis=0).max() > _NEAR * np.ptp(prior, axis=1).min():
            axis.plot(*(prior.mean(axis=1) + circle).T, **style.PRIOR_LINE)
        corner.contours(axis, draws[:: -(-len(draws) // corner.DRAWS)])
        axis.plot([1.0], [1.0], "+", ms=9, mew=1.2, color=style.TRUTH)
        axis.set_aspect("equal", adjustable="datalim")
        axis.set(xlabel=f"{names[0]} / {word}", ylabel=f"{names[1]} / {word}")
