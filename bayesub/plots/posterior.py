"""Correlations of the posterior, and its marginals of nuisance parameters."""

import numpy as np

from bayesub.io.words import with_unit
from bayesub.model.equations import EquationSet
from bayesub.plots import style
from bayesub.plots.coefficients import PRIOR_PROBABILITIES, borders, labels, prior_density

STRONG = 0.3  # correlation of what is drawn
FEW = 6  # parameters that are all drawn
_PRIOR_LINE = "#777777"


def strong_block(names, correlation) -> tuple[list[str], np.ndarray]:
    """The parameters with a correlation of STRONG and more, and their matrix (n, n); all of a few."""
    beside = np.abs(correlation - np.diag(np.diag(correlation)))
    members = np.flatnonzero(beside.max(axis=0) >= STRONG)
    if len(names) <= FEW or len(members) < 2:
        members = np.arange(len(names))
    return [names[k] for k in members], correlation[np.ix_(members, members)]


def draw_correlation(path, posterior, equations: EquationSet) -> None:
    """Heat map of the posterior correlations of parameters that have strong ones; `equations` are the coefficients'."""
    names, correlation = strong_block(posterior.names, posterior.correlation)
    n = len(names)
    size = max(4.5, 0.27 * n + 1.6)
    margins = (0.75, 0.7, 0.75, 0.1) if all(name in equations.index for name in names) else None
    with style.figure(path, size + 0.8, size, margins) as figure:
        axis = figure.subplots()
        image = axis.imshow(correlation, cmap="RdBu_r", vmin=-1, vmax=1)
        words = labels(names, equations)
        axis.set_xticks(range(n), words, rotation=90, fontsize=style.NAMES)
        axis.set_yticks(range(n), words, fontsize=style.NAMES)
        axis.grid(visible=False)
        axis.spines[:].set_visible(False)
        for k in borders(names, equations):
            axis.axhline(k - 0.5, color=style.TRUTH, lw=0.6)
            axis.axvline(k - 0.5, color=style.TRUTH, lw=0.6)
        figure.colorbar(image, ax=axis, shrink=0.8, fraction=0.04, pad=0.03, label="posterior correlation")


def draw_nuisance(path, posterior, prior, reference, n_coefficients: int) -> None:
    """A panel each for the parameters after the coefficients: posterior, prior and reference (n_params,)."""
    nuisances = range(n_coefficients, len(posterior.names))
    n_columns = min(4, len(nuisances))
    n_rows = -(-len(nuisances) // n_columns)
    quantiles = np.array([prior.quantiles(p) for p in PRIOR_PROBABILITIES])
    with style.figure(path, 2.6 * n_columns + 0.2, 1.9 * n_rows + 0.5) as figure:
        panels = figure.subplots(n_rows, n_columns, squeeze=False).ravel()
        for panel, k in zip(panels, nuisances, strict=False):
            panel.hist(posterior.draws[:, k], 60, density=True, color=style.POSTERIOR, label="posterior")
            limits, (places, density) = panel.get_xlim(), prior_density(quantiles[:, k])
            panel.plot(places, density, color=_PRIOR_LINE, lw=1.0, ls="--", label="prior")
            panel.set_xlim(limits)
            panel.set_ylim(0, max(panel.get_ylim()[1], 1.1 * density.max()))
            panel.axvline(reference[k], color=style.SQP, lw=1.0, label="reference")
            panel.set_xlabel(with_unit(posterior.names[k]))
            panel.set_yticks([])
            panel.ticklabel_format(axis="x", useOffset=False, scilimits=(-3, 4), useMathText=True)
            panel.locator_params(axis="x", nbins=4)
        for panel in panels[len(nuisances) :]:
            panel.set_visible(False)
        handles, names = panels[0].get_legend_handles_labels()
        figure.legend(handles, names, loc="outside upper center", ncols=3, fontsize=8)
