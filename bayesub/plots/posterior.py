"""Correlations and joint marginals of the posterior."""

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from bayesub.model.coefficients import INDEX
from bayesub.plots import style
from bayesub.plots.coefficients import labels, ratios, starred

PRIOR_PROBABILITIES = np.linspace(0.001, 0.999, 400)
CORNER_PARAMETERS = 12
CORNER_DRAWS = 20_000


def draw_correlation(path, posterior) -> None:
    """Heat map of the posterior correlation matrix."""
    n = len(posterior.names)
    size = max(4.5, 0.27 * n + 1.6)
    with style.figure(path, size + 0.8, size) as figure:
        axis = figure.subplots()
        image = axis.imshow(posterior.correlation, cmap="RdBu_r", vmin=-1, vmax=1)
        axis.set_xticks(range(n), labels(posterior.names), rotation=90, fontsize=8)
        axis.set_yticks(range(n), labels(posterior.names), fontsize=8)
        axis.grid(visible=False)
        axis.spines[:].set_visible(False)
        for k in range(1, n):
            if posterior.names[k][0] != posterior.names[k - 1][0]:
                axis.axhline(k - 0.5, color=style.TRUTH, lw=0.6)
                axis.axvline(k - 0.5, color=style.TRUTH, lw=0.6)
        figure.colorbar(image, ax=axis, shrink=0.8, label="posterior correlation")


def corner_parameters(posterior, n: int) -> np.ndarray:
    """Positions of at most twelve of the first n parameters: the best and the worst known, in their order."""
    order = np.argsort(posterior.contraction[:n])
    half = CORNER_PARAMETERS // 2
    return np.arange(n) if n <= CORNER_PARAMETERS else np.sort(np.concatenate([order[:half], order[-half:]]))


def draw_corner(path, posterior, prior, reference, rng: np.random.Generator, *, chosen=None, sets=()) -> None:
    """Joint marginals of coefficients as ratios to `reference` (n_coefficients,).

    Parameters
    ----------
    chosen : (n,) positions; by default the best and the worst known, told apart by the colours of their labels
    sets : (n_sets, n_coefficients) values to draw as points
    """
    import corner  # here, since it imports all of ArviZ

    extremes = chosen is None
    chosen = corner_parameters(posterior, len(reference)) if extremes else chosen
    draws = ratios(posterior.draws, reference, prior)[:, chosen]
    draws = draws[rng.choice(len(draws), min(CORNER_DRAWS, len(draws)), replace=False)]
    low, high = np.quantile(draws, [0.001, 0.999], axis=0)
    points = ratios(np.reshape(sets, (-1, len(reference))), reference, prior)[:, chosen]
    low, high = np.vstack([low, points]).min(axis=0), np.vstack([high, points]).max(axis=0)
    margin = 0.05 * (high - low)
    n = len(chosen)
    prior_quantiles = ratios([prior.quantiles(p) for p in PRIOR_PROBABILITIES], reference, prior)
    with mpl.rc_context({"font.size": 8.0}):
        size = 0.95 * n + 1.2
        figure = Figure(figsize=(size, size), dpi=130)
        corner.corner(
            draws,
            bins=25,
            range=list(zip(np.minimum(low, 1.0) - margin, np.maximum(high, 1.0) + margin, strict=True)),
            labels=starred(np.array(posterior.names)[chosen], reference[chosen]),
            truths=np.ones(n),
            truth_color=style.SQP if extremes else style.TRUTH,
            color=style.POSTERIOR,
            fig=figure,
            plot_datapoints=False,
            fill_contours=True,
            levels=(0.5, 0.9),
            smooth=1.0,
            max_n_ticks=3,
            hist_kwargs={"density": True},
        )
        axes = np.array(figure.axes).reshape(n, n)
        best = set(np.argsort(posterior.contraction[: len(reference)])[: CORNER_PARAMETERS // 2].tolist())
        for j, k in enumerate(chosen):
            known = style.POSTERIOR if k in best else style.WEAK
            for label in (axes[j, 0].yaxis.label, axes[-1, j].xaxis.label):
                label.set(color=known if extremes else style.TRUTH, fontsize=11)
            axes[j, 0].yaxis.set_label_coords(-0.55, 0.5)
            axes[-1, j].xaxis.set_label_coords(0.5, -0.55)
            _draw_prior(axes[j, j], prior_quantiles[:, k])
            for i in range(j):
                axes[j, i].plot(points[:, i], points[:, j], "o", ms=2.5, mew=0, color=style.SQP)
        figure.subplots_adjust(left=1.13 / size, bottom=1.13 / size, right=0.99, top=0.99)
        figure.savefig(path)


def _draw_prior(axis, quantiles, label=None):
    """The prior over a histogram of the posterior, from its quantiles at PRIOR_PROBABILITIES."""
    quantiles, limits = np.sort(quantiles), axis.get_xlim()
    density = np.diff(PRIOR_PROBABILITIES) / np.diff(quantiles)
    axis.plot(0.5 * (quantiles[1:] + quantiles[:-1]), density, color="#777777", lw=1.0, ls="--", label=label)
    axis.set_xlim(limits)
    axis.set_ylim(0, max(axis.get_ylim()[1], 1.1 * density.max()))


def draw_nuisance(path, posterior, prior, reference) -> None:
    """A panel each for the parameters after the coefficients: posterior, prior and reference (n_params,)."""
    shown = [k for k, name in enumerate(posterior.names) if name not in INDEX]
    n_columns = min(4, len(shown))
    n_rows = -(-len(shown) // n_columns)
    quantiles = np.array([prior.quantiles(p) for p in PRIOR_PROBABILITIES])
    with style.figure(path, 2.6 * n_columns + 0.2, 1.9 * n_rows + 0.5) as figure:
        panels = figure.subplots(n_rows, n_columns, squeeze=False).ravel()
        for panel, k in zip(panels, shown, strict=False):
            panel.hist(posterior.draws[:, k], 60, density=True, color=style.POSTERIOR, label="posterior")
            _draw_prior(panel, quantiles[:, k], "prior")
            panel.axvline(reference[k], color=style.SQP, lw=1.0, label="reference")
            panel.set_xlabel(style.with_unit(posterior.names[k]))
            panel.set_yticks([])
            panel.ticklabel_format(axis="x", useOffset=False, scilimits=(-3, 4), useMathText=True)
            panel.locator_params(axis="x", nbins=4)
        for panel in panels[len(shown) :]:
            panel.set_visible(False)
        handles, names = panels[0].get_legend_handles_labels()
        figure.legend(handles, names, loc="outside upper center", ncols=3, fontsize=8)
