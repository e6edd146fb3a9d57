"""Correlations and joint marginals of the posterior."""

import warnings
from itertools import chain

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.ticker import MaxNLocator

from bayesub.model.equations import EquationSet
from bayesub.plots import style
from bayesub.plots.coefficients import borders, labels, ratios, starred

PRIOR_PROBABILITIES = np.linspace(0.001, 0.999, 400)
CORNER_PARAMETERS = 12
CORNER_DRAWS = 20_000
GAP = 0.06  # between panels of the corner, of which each is one unit with its gap
SIDE = 1.0 - GAP
SHARES = (0.5, 0.9)  # of the draws within each contour of the corner
_CELLS = 30  # of a panel in each direction
_SMOOTHING = 1.0  # cells
_BINS = 25  # of a marginal
_PRIOR_LINE = "#777777"
_PALE = "#A9CDE4"


def draw_correlation(path, posterior, equations: EquationSet) -> None:
    """Heat map of the posterior correlation matrix; `equations` are those of its coefficients."""
    n = len(posterior.names)
    size = max(4.5, 0.27 * n + 1.6)
    margins = (0.75, 0.7, 0.75, 0.1) if all(name in equations.index for name in posterior.names) else None
    with style.figure(path, size + 0.8, size, margins) as figure:
        axis = figure.subplots()
        image = axis.imshow(posterior.correlation, cmap="RdBu_r", vmin=-1, vmax=1)
        words = labels(posterior.names, equations)
        axis.set_xticks(range(n), words, rotation=90, fontsize=style.NAMES)
        axis.set_yticks(range(n), words, fontsize=style.NAMES)
        axis.grid(visible=False)
        axis.spines[:].set_visible(False)
        for k in borders(posterior.names, equations):
            axis.axhline(k - 0.5, color=style.TRUTH, lw=0.6)
            axis.axvline(k - 0.5, color=style.TRUTH, lw=0.6)
        figure.colorbar(image, ax=axis, shrink=0.8, fraction=0.04, pad=0.03, label="posterior correlation")


def corner_parameters(posterior, n: int) -> np.ndarray:
    """Positions of at most twelve of the first n parameters: the best and the worst known, in their order."""
    order = np.argsort(posterior.contraction[:n])
    half = CORNER_PARAMETERS // 2
    return np.arange(n) if n <= CORNER_PARAMETERS else np.sort(np.concatenate([order[:half], order[-half:]]))


def draw_corner(path, posterior, prior, reference, equations: EquationSet, *, chosen=None, sets=()) -> None:
    """Joint marginals of coefficients as ratios to `reference` (n_coefficients,), by every so many draws.

    All panels share one pair of axes, in units of panels: a figure of 78 axes takes four times as long to make and to
    render. The contours are those of the library corner.

    Parameters
    ----------
    path
        One or several, as :func:`bayesub.plots.style.figure` takes them.
    posterior
        With n_params parameters.
    prior
        Of the same parameters.
    reference
        (n_coefficients,) values that count as one.
    equations
        Whose coefficients they are.
    chosen
        (n,) positions; by default the best and the worst known, whose labels have different colours.
    sets
        (n_sets, n_coefficients) values to draw as points.
    """
    extremes = chosen is None
    chosen = corner_parameters(posterior, len(reference)) if extremes else chosen
    n, names = len(chosen), np.array(posterior.names)[chosen]
    thinned = posterior.draws[:: -(-len(posterior.draws) // CORNER_DRAWS)]
    draws = ratios(thinned, reference, prior)[:, chosen]
    points = ratios(np.reshape(sets, (-1, len(reference))), reference, prior)[:, chosen]
    quantiles = ratios([prior.quantiles(p) for p in PRIOR_PROBABILITIES], reference, prior)[:, chosen]
    extent = np.vstack([np.quantile(draws, [0.001, 0.999], axis=0), points, np.ones((1, n))])
    margin = 0.05 * np.ptp(extent, axis=0)
    low, high = extent.min(axis=0) - margin, extent.max(axis=0) + margin

    def placed(values):
        """Values (.., n) in units of their panels, of which they may be outside."""
        return (values - low) / (high - low)

    draws, points, truth = placed(draws), placed(points), placed(np.ones(n))
    size = 0.82 * n + 1.05
    with style.figure(path, size, size, (0.95, 0.1, 0.95, 0.1)) as figure:
        axis = figure.subplots()
        draw_joint(axis, draws)
        axis.set(xlim=(0, n - GAP), ylim=(n - GAP, 0), frame_on=False)
        axis.grid(visible=False)
        _draw_marginals(axis, draws, placed(quantiles))
        rows, columns = np.tril_indices(n)
        corners = np.array([(0, 0), (SIDE, 0), (SIDE, SIDE), (0, SIDE)]) + np.stack([columns, rows], 1)[:, None]
        axis.add_collection(PolyCollection(corners, facecolors="none", edgecolors=style.TRUTH, linewidths=0.8))
        colour = style.SQP if extremes else style.TRUTH
        axis.vlines(columns + SIDE * truth[columns], rows, rows + SIDE, color=colour, lw=1.2)
        rows, columns = np.tril_indices(n, -1)
        axis.hlines(rows + SIDE * (1.0 - truth[rows]), columns, columns + SIDE, color=colour, lw=1.2)
        x, y = columns + SIDE * points[:, columns], rows + SIDE * (1.0 - points[:, rows])
        axis.plot(x.ravel(), y.ravel(), "o", ms=2.5, mew=0, color=style.SQP)
        best = np.argsort(posterior.contraction[: len(reference)])[: CORNER_PARAMETERS // 2]
        known = [style.POSTERIOR if position in best else style.WEAK for position in chosen]
        colours = known if extremes else [style.TRUTH] * n
        _label(axis, starred(names, reference[chosen], equations), colours, (low, high))


def draw_joint(axis, draws) -> None:
    """Draw the contours that hold 50 and 90 % of draws (n_draws, n), in units of panels, for each pair."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)  # ArviZ announces its successor once a day
        import corner  # here, since it imports ArviZ and pyplot

    for row, column in zip(*np.tril_indices(draws.shape[1], -1), strict=True):
        corner.hist2d(
            column + SIDE * draws[:, column],
            row + SIDE * (1.0 - draws[:, row]),
            ax=axis,
            bins=_CELLS,
            range=[(column, column + SIDE), (row, row + SIDE)],
            smooth=_SMOOTHING,
            levels=SHARES,
            plot_datapoints=False,
            plot_density=False,
            no_fill_contours=True,
            fill_contours=True,
            contourf_kwargs={"colors": ["none", _PALE, style.POSTERIOR]},
            contour_kwargs={"colors": style.POSTERIOR, "linewidths": 1.0},
        )


def _draw_marginals(axis, draws, quantiles) -> None:
    """Histogram of each coefficient's draws (n_draws, n) and its prior, by quantiles at PRIOR_PROBABILITIES."""
    edges = np.linspace(0.0, 1.0, _BINS + 1)
    for k, (values, prior) in enumerate(zip(draws.T, quantiles.T, strict=True)):
        heights = np.histogram(values, edges, density=True)[0]
        places, density = _prior_density(prior)
        inside = (places > 0.0) & (places < 1.0)
        scale = SIDE / (1.1 * max(heights.max(), density.max(initial=0.0)))
        bottom = k + SIDE
        axis.stairs(bottom - scale * heights, k + SIDE * edges, baseline=bottom, color=style.POSTERIOR, lw=1.0)
        axis.plot(k + SIDE * places[inside], bottom - scale * density[inside], color=_PRIOR_LINE, lw=1.0, ls="--")


def _label(axis, names, colours, limits) -> None:
    """Ticks and names at the left and below; `limits` are (n,) least and largest values of the panels."""
    n = len(names)
    locator = MaxNLocator(3)
    ticks = [
        [t for t in locator.tick_values(a, b) if 0.05 < (t - a) / (b - a) < 0.95] for a, b in zip(*limits, strict=True)
    ]
    places = [SIDE * (np.array(t) - a) / (b - a) for t, a, b in zip(ticks, *limits, strict=True)]
    words = [[f"{t:.6g}" for t in values] for values in ticks]
    axis.set_xticks(np.concatenate([k + p for k, p in enumerate(places)]), [*chain(*words)], rotation=45)
    heights = np.concatenate([np.empty(0), *(k + SIDE - p for k, p in enumerate(places) if k)])
    axis.set_yticks(heights, [*chain(*words[1:])], rotation=45)
    axis.tick_params(labelsize=8)
    for k, (name, colour) in enumerate(zip(names, colours, strict=True)):
        text = {"color": colour, "fontsize": style.NAMES, "ha": "center", "va": "center"}
        axis.text(k + 0.5 * SIDE, n + 0.64, name, text)
        if k:
            axis.text(-0.72, k + 0.5 * SIDE, name, text, rotation=90)


def _prior_density(quantiles) -> tuple[np.ndarray, np.ndarray]:
    """Places and density of a prior from its quantiles at PRIOR_PROBABILITIES."""
    quantiles = np.sort(quantiles)
    return 0.5 * (quantiles[1:] + quantiles[:-1]), np.diff(PRIOR_PROBABILITIES) / np.diff(quantiles)


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
            limits, (places, density) = panel.get_xlim(), _prior_density(quantiles[:, k])
            panel.plot(places, density, color=_PRIOR_LINE, lw=1.0, ls="--", label="prior")
            panel.set_xlim(limits)
            panel.set_ylim(0, max(panel.get_ylim()[1], 1.1 * density.max()))
            panel.axvline(reference[k], color=style.SQP, lw=1.0, label="reference")
            panel.set_xlabel(style.with_unit(posterior.names[k]))
            panel.set_yticks([])
            panel.ticklabel_format(axis="x", useOffset=False, scilimits=(-3, 4), useMathText=True)
            panel.locator_params(axis="x", nbins=4)
        for panel in panels[len(nuisances) :]:
            panel.set_visible(False)
        handles, names = panels[0].get_legend_handles_labels()
        figure.legend(handles, names, loc="outside upper center", ncols=3, fontsize=8)
