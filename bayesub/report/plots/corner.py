"""Joint marginals: the strongest pairs as a strip, and corners of coefficients that trade off.

All panels of a corner share one pair of axes, in units of panels: a figure of 36 axes takes four times as long.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from scipy import ndimage, special

from bayesub.io.words import uncertain
from bayesub.report.plots import style
from bayesub.report.plots.coefficients import Found, found_handles, ratios, star
from bayesub.report.plots.style import Equations, Paths, Prior

if TYPE_CHECKING:  # they load a sampler
    from bayesub.inference.sampling import Posterior

PRIOR_PROBABILITIES = np.linspace(0.001, 0.999, 400)
PARAMETERS = 8  # of a corner
TRADING = 0.3  # correlation from which a coefficient is in a corner, and a pair in the strip
PAIRS = 10  # of the strip
DRAWS = 20_000
GAP = 0.06  # between panels, of which each is one unit with its gap
SIDE = 1.0 - GAP
_CORNERS = SIDE * np.array([(0, 0), (1, 0), (1, 1), (0, 1)])  # of a panel
SHARES = (0.5, 0.9)  # of the draws within each contour
_COLUMNS, _PANEL = 5, 1.78  # of the strip: panels in a row, and their size with what is between them, inches
_REACH = 2.4  # prior sds from the middle to the edge of a panel of the strip
_CLOUD = 4.2  # standard deviations from the middle of a cloud to the edge of its cells
_CELLS = 40  # of a cloud in each direction
_SMOOTHING = 1.0  # cells
_NEAR = 0.023  # of the edge of the prior, the sd of a pair beside which it is drawn on the first screen
_WIDE = 0.25  # prior sds of a posterior beside which the whole prior is shown
_BINS = 50  # of a marginal
_PALE = "#A9CDE4"
_EDGE: dict[str, Any] = style.PRIOR_LINE | {"lw": 0.9}  # what holds 90 % of the prior of any two
_RADIUS = np.sqrt(-2.0 * np.log(1.0 - SHARES[-1]))  # of the circle that holds this share of two standard normals
CIRCLE = _RADIUS * np.stack([np.cos(t := np.linspace(0.0, 2.0 * np.pi, 60)), np.sin(t)])


def strong_pairs(correlation: np.ndarray) -> Iterator[tuple[int, int]]:
    """Pairs of parameters with a correlation of TRADING and more, strongest first."""
    rows, columns = np.triu_indices(len(correlation), 1)
    sizes = np.abs(correlation[rows, columns])
    order = np.argsort(-sizes, kind="stable")[: np.count_nonzero(sizes >= TRADING)]
    return ((int(rows[k]), int(columns[k])) for k in order)


def trading(correlation: np.ndarray) -> np.ndarray:
    """Positions, in their order, of at most PARAMETERS that trade off with each other."""
    chosen: dict[int, None] = {}
    for pair in strong_pairs(correlation):
        if len(chosen | dict.fromkeys(pair)) <= PARAMETERS:
            chosen |= dict.fromkeys(pair)
    return np.sort(np.array(list(chosen), dtype=int))


def draw_pairs(
    path: Paths,
    posterior: Posterior,
    prior: Prior,
    reference: np.ndarray,
    equations: Equations,
    pairs: Sequence[tuple[int, int]],
    found: Sequence[Found] = (),
    word: str = "truth",
) -> None:
    """A strip of pairs of parameters, at positions among all; coefficients as ratios to `reference` (n_coefficients,).

    Both sides of a panel are as many prior standard deviations long. `found`: solutions to draw as points, their
    parameters in the order of the posterior; `word`: what the reference is.
    """
    n = len(reference)

    def ratio(values):
        values = np.asarray(values)
        return np.concatenate([ratios(values, reference, prior), values[..., n:]], axis=-1)

    everything = ratio(posterior.draws)
    draws = everything[:: -(-len(everything) // DRAWS)]
    steps = np.sort(ratio([prior.quantiles(special.ndtr(t)) for t in (-1.0, 0.0, 1.0)]), axis=0)
    unit = 0.5 * (steps[2] - steps[0])
    names = star(posterior.names, np.concatenate([reference, np.ones(len(posterior.names) - n)]), equations)
    columns, rows = min(_COLUMNS, len(pairs)), -(-len(pairs) // _COLUMNS)
    width = max(_PANEL * columns, 2.5 * _PANEL)
    margins = (0.55, 0.1, 0.45, 0.75) if np.max(pairs) < n else None  # other labels are to be measured
    with style.figure(path, width, (_PANEL + 0.08) * rows + 0.55, margins) as figure:
        space = {"wspace": 0.38, "hspace": 0.42} if margins else None
        panels = figure.subplots(rows, columns, squeeze=False, gridspec_kw=space)
        beyond = np.zeros(len(found), dtype=int)
        for panel, (i, j) in zip(panels.flat, pairs, strict=False):
            both = [i, j]
            centre, sd = draws[:, both].mean(axis=0), draws[:, both].std(axis=0)
            low, high = centre - 3.2 * sd, centre + 3.2 * sd
            if (sd / unit[both]).max() > _WIDE:
                low = np.minimum(low, steps[1, both] - _REACH * unit[both])
                high = np.maximum(high, steps[1, both] + _REACH * unit[both])
            half = unit[both] * (0.5 * (high - low) / unit[both]).max()
            low, high = 0.5 * (low + high) - half, 0.5 * (low + high) + half
            contours(panel, draws[:, both])
            panel.plot(*(ratio(side)[:, k] for k, side in zip(both, edge(prior, i, j), strict=True)), **_EDGE)
            for k, line in zip(both, (panel.axvline, panel.axhline), strict=True):
                if k < n:
                    line(1.0, color=style.TRUTH, lw=0.7)
            for k, one in enumerate(found):
                x, y = ((ratio(one.values)[:, both] - low) / (high - low)).T
                beyond[k] += _draw_points(panel, one, x, y, one.good[:, both].all(axis=1), transform=panel.transAxes)
            panel.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), box_aspect=1)
            panel.set_xlabel(names[i], labelpad=1, fontsize=style.NAMES)
            panel.set_ylabel(names[j], labelpad=1, fontsize=style.NAMES)
            panel.set_title(rf"$\rho$ = {_signed(_correlation(everything[:, both])[0, 1], '+')}", fontsize=9)
            panel.locator_params(nbins=3)
            panel.tick_params(labelsize=7.5, pad=2)
            panel.grid(visible=False)
        for panel in panels.flat[len(pairs) :]:
            panel.set_visible(False)
        shown = [replace(one, good=one.good[:, np.unique(pairs)]) for one in found]
        style.legend_above(figure, _handles(shown, beyond, word))


def draw_small(path: Paths, draws: np.ndarray, prior: np.ndarray, names: Sequence[str], word: str) -> None:
    """Draws (n, 2) of two coefficients as ratios, and what holds 90 % of their prior, for the first screen.

    `prior`: (60, 2) its edge (:func:`edge`); `word`: what ratios refer to.
    """
    with style.figure(path, *style.SMALL) as figure:
        axis = figure.subplots()
        if draws.std(axis=0).max() > _NEAR * np.ptp(prior, axis=0).min():
            axis.plot(*prior.T, **style.PRIOR_LINE)
        contours(axis, draws[:: -(-len(draws) // DRAWS)])
        axis.plot([1.0], [1.0], "+", ms=9, mew=1.2, color=style.TRUTH)
        axis.set_aspect("equal", adjustable="datalim")
        axis.set(xlabel=f"{names[0]} / {word}", ylabel=f"{names[1]} / {word}")


def draw(
    path: Paths,
    posterior: Posterior,
    prior: Prior,
    reference: np.ndarray,
    equations: Equations,
    *,
    chosen: np.ndarray,
    found: Sequence[Found] = (),
    word: str = "truth",
) -> None:
    """Joint marginals of coefficients as ratios to `reference` (n_coefficients,), by every so many draws.

    Below the diagonal a panel a pair, above it their correlations. `chosen`: (n,) positions; `found`: solutions to
    draw as points, of which the first coefficients are those of the reference; `word`: what the reference is.
    """
    n, names = len(chosen), star(np.array(posterior.names)[chosen], reference[chosen], equations)

    def ratio(values):
        return ratios(values, reference, prior)[..., chosen]

    found = [replace(one, good=one.good[:, chosen]) for one in found]
    draws = ratio(posterior.draws)
    correlation, draws = _correlation(draws), draws[:: -(-len(draws) // DRAWS)]
    low, high = np.quantile(draws, [0.001, 0.999], axis=0)
    width = np.where(high > low, high - low, 1.0)
    near = np.abs(1.0 - 0.5 * (low + high)) < 1.5 * width  # a reference that is far off does not stretch the axes
    low, high = np.where(near, np.minimum(low, 1.0), low), np.where(near, np.maximum(high, 1.0), high)
    low, high = low - 0.05 * width, high + 0.05 * width

    def place(values):  # in units of panels, of which each is one wide with its gap
        return (ratio(values) - low) / (high - low)

    quantiles = place([prior.quantiles(p) for p in PRIOR_PROBABILITIES])
    beyond = [np.any(np.abs(place(one.values) - 0.5) > 0.5, axis=1).sum() for one in found]
    handles = _handles(found, beyond, word)
    words = [handle.get_label() for handle in handles]
    size = n * float(np.clip(6.4 / n, 0.8, 1.25))
    wide = size + 0.95
    ncols = style.legend_columns(words, wide)
    top = 0.2 + 0.17 * -(-len(words) // ncols)
    with style.figure(path, wide, size + 0.6 + top, (0.85, 0.1, 0.6, top)) as figure:
        axis = figure.subplots(subplot_kw={"frame_on": False})
        axis.grid(visible=False)
        rows, columns = np.tril_indices(n, -1)
        titles = [uncertain(value, sd) for value, sd in zip(draws.mean(axis=0), draws.std(axis=0), strict=True)]
        draws = (draws - low) / (high - low)
        for row, column in zip(rows, columns, strict=True):
            contours(axis, np.stack([column + SIDE * draws[:, column], row + SIDE * (1.0 - draws[:, row])], axis=1))
        _draw_marginals(axis, draws, quantiles)
        edges = [[place(side) for side in edge(prior, *chosen[[i, j]])] for j, i in zip(rows, columns, strict=True)]
        x = np.stack([across[:, k] for (across, _), k in zip(edges, columns, strict=True)], axis=1)
        y = np.stack([up[:, k] for (_, up), k in zip(edges, rows, strict=True)], axis=1)
        inside = (np.abs(x - 0.5) < 0.5) & (np.abs(y - 0.5) < 0.5)
        x, y = (np.where(inside, at, np.nan) for at in (columns + SIDE * x, rows + SIDE * (1.0 - y)))
        axis.plot(x, y, **_EDGE)
        _draw_correlations(axis, correlation)
        at_one = (1.0 - low) / (high - low)  # of the reference, whose lines begin below the title of a marginal
        for k in np.flatnonzero((at_one >= 0.0) & (at_one <= 1.0)):
            axis.vlines(k + SIDE * at_one[k], k + 0.16, n - GAP, color=style.TRUTH, lw=0.7)
            axis.hlines(k + SIDE * (1.0 - at_one[k]), 0.0, max(k - GAP, 0.0), color=style.TRUTH, lw=0.7)
        for one in found:
            points, good = place(one.values), one.good
            at = np.stack([columns, rows])[:, None].repeat(len(points), axis=1)
            _draw_points(axis, one, points[:, columns], points[:, rows], good[:, columns] & good[:, rows], at)
        _frame(axis, low, high, names, titles)
        figure.legend(handles, words, loc="upper center", ncols=ncols, fontsize=8, borderaxespad=0.2)


def edge(prior: Any, i: int, j: int) -> list[np.ndarray]:
    """What holds 90 % of the prior of two parameters: (60, n_params), where i counts of the first, j of the second."""
    slopes = prior.chain(np.eye(len(prior.sd))[[i, j]], np.zeros(len(prior.sd)))
    rho = slopes[0] @ slopes[1] / np.prod(np.linalg.norm(slopes, axis=1))
    sides = CIRCLE[0], rho * CIRCLE[0] + np.sqrt(1.0 - rho**2) * CIRCLE[1]
    return [_quantiles(prior, tuple(side)) for side in sides]


@functools.lru_cache(maxsize=4)
def _quantiles(prior, standard: tuple[float, ...]) -> np.ndarray:
    """(n, n_params), those of so many standard normal values."""
    return np.array([prior.quantiles(special.ndtr(t)) for t in standard])


def _correlation(draws: np.ndarray) -> np.ndarray:
    """(n, n) of draws (n_draws, n), zero with what is constant."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.nan_to_num(np.atleast_2d(np.corrcoef(draws.T)))


def _signed(value: float, sign: str = "") -> str:
    return f"{value:{sign}.2f}".replace("-", "\u2212")


def contours(axis: Axes, points: np.ndarray) -> None:
    """Fill what holds 50 and 90 % of points (n, 2), by the library corner; nothing if one of the two is constant.

    Its cells are those of the cloud by its own standard deviations and correlation, so that a blade has a contour too.
    """
    centre, sd = points.mean(axis=0), points.std(axis=0)
    if not np.all(sd > 1e-12 * np.abs(centre)):
        return
    scaled = (points - centre) / sd
    rho = np.mean(scaled[:, 0] * scaled[:, 1])
    factor = np.array([[1.0, 0.0], [rho, max(np.sqrt(max(1.0 - rho**2, 0.0)), 1e-6)]])
    others, extent = set(axis.collections), axis.dataLim.frozen()
    options: dict[str, Any] = {"bins": _CELLS, "range": [(-_CLOUD, _CLOUD)] * 2, "smooth": _SMOOTHING, "levels": SHARES}
    options |= dict.fromkeys(("plot_datapoints", "plot_density"), False)
    options |= {"no_fill_contours": True, "contour_kwargs": {"linewidths": 0.9}}
    _hist2d()(*np.linalg.solve(factor, scaled.T), ax=axis, **options)
    (lines,) = (drawn for drawn in axis.collections if drawn not in others)
    lines.set_array(None)  # whose colours would be those of the lines
    lines.set(facecolor=[_PALE, style.POSTERIOR], edgecolor=style.POSTERIOR)
    axis.dataLim.set(extent)
    for path in lines.get_paths():
        path.vertices = centre + sd * (path.vertices @ factor.T)
        axis.update_datalim(path.vertices)
    axis.autoscale()


@functools.cache
def _hist2d() -> Any:
    """The contours of corner, without ArviZ, which corner imports for chains of ArviZ and which takes two seconds."""
    sys.modules.setdefault("arviz", None)  # type: ignore[arg-type]  # so that an import of it fails
    try:
        import corner  # here, since it imports pyplot
    finally:
        if sys.modules["arviz"] is None:
            del sys.modules["arviz"]
    return corner.hist2d


def _draw_marginals(axis, draws, quantiles) -> None:
    """Densities of draws (n_draws, n) and of the prior, by its quantiles at PRIOR_PROBABILITIES, in units of panels."""
    for k, (values, prior) in enumerate(zip(draws.T, quantiles.T, strict=True)):
        counts, edges = np.histogram(values, _BINS, (0.0, 1.0), density=True)
        heights = ndimage.gaussian_filter1d(counts, 1.2)
        middles = 0.5 * (edges[1:] + edges[:-1])
        ends = np.sort(prior)
        places, density = 0.5 * (ends[1:] + ends[:-1]), np.diff(PRIOR_PROBABILITIES) / np.diff(ends)
        inside = (places > 0.0) & (places < 1.0)
        scale, bottom = 0.8 * SIDE / max(heights.max(), density[inside].max(initial=0.0)), k + SIDE
        look = {"fc": _PALE, "ec": style.POSTERIOR, "lw": 1.0}
        axis.fill_between(k + SIDE * middles, bottom - scale * heights, bottom, where=heights > 0.0, **look)
        axis.plot(k + SIDE * places[inside], bottom - scale * density[inside], **style.PRIOR_LINE)


def _draw_correlations(axis, correlation) -> None:
    """Numbers above the diagonal, on their colours."""
    for row, column in zip(*np.triu_indices(len(correlation), 1), strict=True):
        rho = correlation[row, column]
        corners = _CORNERS + np.array([column, row])
        axis.add_collection(PolyCollection([corners], fc=style.CORRELATION(0.5 + 0.5 * rho), lw=0))
        look = {"ha": "center", "va": "center", "fontsize": 9.0, "color": style.on_colour(rho)}
        axis.text(column + 0.5 * SIDE, row + 0.5 * SIDE, _signed(rho), look)


def _draw_points(axis, one, x, y, good, at=None, **look) -> int:
    """Points in units of panels, hollow where they are not good, and arrows at the edge for those beyond; their number.

    `at` (2, ..): column and row of the panel of each, or None if the axis is the panel.
    """
    x, y, good = np.ravel(x), np.ravel(y), np.ravel(good)
    sides = np.stack([-x, x - 1.0, -y, y - 1.0])
    kinds = np.where(sides.max(axis=0) > 0.0, sides.argmax(axis=0), 4)
    across, up = np.clip(x, 0.04, 0.96), np.clip(y, 0.04, 0.96)
    if at is not None:
        column, row = at.reshape(2, -1)
        across, up = column + SIDE * across, row + SIDE * (1.0 - up)
    for kind, marker in enumerate(("<", ">", "v", "^", one.marker)):
        for some, face in ((good, one.colour), (~good, "none")):
            shown = (kinds == kind) & some & np.isfinite(x + y)
            if shown.any():
                edge = "white" if face != "none" else one.colour
                size = {"ms": 4.2, "mew": 0.5 if face != "none" else 0.9, "mec": edge, "mfc": face, "ls": ""}
                axis.plot(across[shown], up[shown], marker, **size, **look, zorder=4)
    return int(np.count_nonzero(kinds < 4))


def _frame(axis, lows, highs, names, titles) -> None:
    """Frames of the panels, ticks and names at the left and below, titles within the diagonal."""
    n, locator = len(names), MaxNLocator(3)
    rows, columns = np.tril_indices(n)
    corners = _CORNERS + np.stack([columns, rows], axis=1)[:, None]
    axis.add_collection(PolyCollection(list(corners), facecolors="none", edgecolors=style.TRUTH, linewidths=0.6))
    axis.set(xlim=(-0.005, n - GAP + 0.005), ylim=(n - GAP + 0.005, -0.005))  # contours have set them
    places, words = [], []
    for low, high in zip(lows, highs, strict=True):
        ticks = [t for t in locator.tick_values(low, high) if 0.12 < (t - low) / (high - low) < 0.88]
        texts = [f"{t:.5g}" for t in ticks]
        some = slice(None, None, 2 if len(ticks) > 2 and max(map(len, texts)) > 3 else 1)
        places.append(SIDE * (np.array(ticks[some]) - low) / (high - low))
        words.append(texts[some])
    axis.set_xticks(np.concatenate([k + p for k, p in enumerate(places)]), [*chain(*words)])
    heights = np.concatenate([np.empty(0), *(k + SIDE - p for k, p in enumerate(places) if k)])
    axis.set_yticks(heights, [*chain(*words[1:])])
    axis.tick_params(labelsize=7.5, pad=2)
    offset = {"textcoords": "offset points", "ha": "center", "fontsize": style.NAMES}
    for k, (name, title) in enumerate(zip(names, titles, strict=True)):
        axis.annotate(name, (k + 0.5 * SIDE, n - GAP), (0, -26), va="center", **offset)
        axis.annotate(title, (k + 0.5 * SIDE, k), (0, -2), va="top", **offset | {"fontsize": 7.5})
        if k:
            axis.annotate(name, (0, k + 0.5 * SIDE), (-46, 0), rotation=90, va="center", **offset)


def _handles(found, beyond, word: str) -> list:
    """Of a legend; `beyond`: how many points of each baseline are drawn at an edge."""
    return [
        Patch(color=style.POSTERIOR, label="posterior, 50 %"),
        Patch(color=_PALE, label="posterior, 90 %"),
        Line2D([], [], **style.PRIOR_LINE, label="prior, 90 %"),
        Line2D([], [], color=style.TRUTH, lw=0.9, label=word),
        *found_handles(found, beyond),
    ]
