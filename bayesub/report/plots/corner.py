"""Joint marginals of the posterior: of the coefficients that trade off, and of directions from stiff to null.

All panels share one pair of axes, in units of panels: a figure of 78 axes takes four times as long to make and to
render. The contours are those of the library corner.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from scipy import special

from bayesub.io.words import uncertain
from bayesub.report.plots import style
from bayesub.report.plots.coefficients import PRIOR_PROBABILITIES, labels, prior_density, ratios, star
from bayesub.report.plots.style import Equations, Paths, Prior

if TYPE_CHECKING:  # they load a sampler
    from bayesub.inference.identifiability import Spectrum
    from bayesub.inference.sampling import Posterior

PARAMETERS = 8  # of a corner
STRONG = 0.8  # correlation of a trade-off that is drawn before the null directions
DRAWS = 20_000
GAP = 0.06  # between panels, of which each is one unit with its gap
SIDE = 1.0 - GAP
SHARES = (0.5, 0.9)  # of the draws within each contour
REACH = 3.3  # prior standard deviations from the middle to the edge of a panel of directions
_EACH = 2  # directions of each kind
_CELLS = 30  # of a panel in each direction
_SMOOTHING = 1.0  # cells
_BINS = 25  # of a marginal
_LINE = 0.02  # of a panel: what is narrower is drawn as a thick line
_PALE = "#A9CDE4"
MARKS = {"orange dots": ("o", style.SQP), "green crosses": ("X", style.LINEAR), "yellow squares": ("s", style.WEAK)}
_CIRCLE: dict[str, Any] = style.PRIOR_LINE | {"lw": 0.9}  # the edge that holds 90 % of the prior of any two
_RADIUS = np.sqrt(-2.0 * np.log(1.0 - SHARES[-1]))  # of the circle that holds this share of two standard normals


def trade_off_parameters(posterior: Posterior, n: int, null: Iterable[Mapping[str, float]] = ()) -> np.ndarray:
    """Positions, in their order, of at most PARAMETERS of the first n parameters: those that trade off.

    First come the pairs with a correlation of STRONG and more, for which half of the places are kept, then in turn the
    largest entries of each null direction in prior standard deviations, then further pairs.
    """
    names = posterior.names[:n]
    rows, columns = np.triu_indices(n, 1)
    sizes = np.abs(posterior.correlation[rows, columns])
    pairs = [(rows[k], columns[k]) for k in np.argsort(-sizes)]
    chosen = _filled({}, pairs[: np.count_nonzero(sizes >= STRONG)], PARAMETERS // 2)
    entries = []
    for vector in null:
        size = {names.index(name): abs(x) for name, x in vector.items() if name in names}
        entries.append(sorted(size, key={k: -x / posterior.prior_sd[k] for k, x in size.items()}.__getitem__))
    by_rank = [[order[k] for order in entries if k < len(order)] for k in range(max(map(len, entries), default=0))]
    chosen = _filled(chosen, [(k,) for k in chain(*by_rank)], PARAMETERS)
    return np.sort(list(_filled(chosen, pairs, PARAMETERS)) or np.arange(n))


def _filled(chosen: dict, groups, most: int) -> dict:
    """The keys of `chosen` and those groups, in order, with which there are at most so many."""
    for group in groups:
        if len(chosen | dict.fromkeys(group)) <= most:
            chosen = chosen | dict.fromkeys(group)
    return chosen


def draw(
    path: Paths,
    posterior: Posterior,
    prior: Prior,
    reference: np.ndarray,
    equations: Equations,
    *,
    chosen: np.ndarray | None = None,
    sets: Mapping[str, np.ndarray] | None = None,
    null: Sequence[Mapping[str, float]] = (),
    word: str = "truth",
) -> None:
    """Joint marginals of coefficients as ratios to `reference` (n_coefficients,), by every so many draws.

    `reference`: (n_coefficients,) values that count as one; `chosen`: (n,) positions; by default those of
    :func:`trade_off_parameters`; `sets`: label -> (n_sets, n_coefficients) values to draw as points; `null`: null
    directions, each coefficient -> change: lines through the posterior mean; `word`: what the reference is.
    """
    chosen = trade_off_parameters(posterior, len(reference), null) if chosen is None else chosen
    n, names = len(chosen), np.array(posterior.names)[chosen]

    def ratio(values):
        return ratios(values, reference, prior)[..., chosen]

    draws = ratio(posterior.draws[:: -(-len(posterior.draws) // DRAWS)])
    points = {label: ratio(np.reshape(values, (-1, len(reference)))) for label, values in (sets or {}).items()}
    extent = np.vstack([np.quantile(draws, [0.001, 0.999], axis=0), *points.values(), np.ones((1, n))])
    low, high = np.nanmin(extent, axis=0), np.nanmax(extent, axis=0)
    panels = _Panels(low - 0.05 * (high - low), high + 0.05 * (high - low))
    quantiles = ratio([prior.quantiles(p) for p in PRIOR_PROBABILITIES])
    unit = np.where(reference == 0.0, prior.sd[: len(reference)], reference)
    with _figure(path, n) as axis:
        draw_joint(axis, panels.place(draws))
        _draw_marginals(axis, panels.place(draws), panels.place(quantiles))
        angles, length = np.linspace(0.0, 2.0 * np.pi, 60), len(reference)
        circle = [[prior.quantiles(special.ndtr(_RADIUS * t))[:length] for t in f(angles)] for f in (np.cos, np.sin)]
        axis.plot(*panels.pairs(*ratio(circle)), **_CIRCLE)
        for vector in null:
            change = np.array([vector.get(name, 0.0) for name in names]) / unit[chosen]
            _draw_line(axis, panels, draws.mean(axis=0), change)
        _draw_reference(axis, panels, np.ones(n))
        _draw_points(axis, panels, points)
        titles = [
            f"{name}\n{uncertain(value, sd)}"
            for name, value, sd in zip(names, draws.mean(axis=0), draws.std(axis=0), strict=True)
        ]
        _label(axis, panels, star(names, reference[chosen], equations), titles)
        _add_legend(axis, n, points, word, null=bool(null))


def draw_directions(
    path: Paths,
    posterior: Posterior,
    spectrum: Spectrum,
    equations: Equations,
    *,
    before: np.ndarray,
    reference: np.ndarray | None = None,
    sets: Mapping[str, np.ndarray] | None = None,
) -> None:
    """Joint marginals along directions of the spectrum, all on one scale: prior standard deviations.

    `posterior`: of the parameters of the spectrum, with the means and standard deviations of their prior; `before`:
    (2, n_params) mean and sd along each direction where the data say nothing of it; `reference`: (n_params,) the truth,
    if it is known; `sets`: label -> (n_sets, n_params) values to draw as points.
    """
    kinds = choose_directions(spectrum)
    chosen = [k for _, _, members in kinds for k in members]
    n, coordinates = len(chosen), spectrum.coordinates[chosen]

    def along(values):
        steps = (np.asarray(values) - posterior.prior_mean) / spectrum.prior_sd @ coordinates.T
        return (steps - before[0, chosen]) / before[1, chosen]

    draws = along(posterior.draws[:: -(-len(posterior.draws) // DRAWS)])
    points = {label: along(np.reshape(values, (-1, len(posterior.names)))) for label, values in (sets or {}).items()}
    panels = _Panels(np.full(n, -REACH), np.full(n, REACH))
    colours = [colour for _, colour, members in kinds for _ in members]
    words = [f"{kind} {k + 1}" for kind, _, members in kinds for k in members]
    with _figure(path, n) as axis:
        draw_joint(axis, panels.place(draws))
        quantiles = np.repeat(special.ndtri(PRIOR_PROBABILITIES)[:, None], n, axis=1)
        _draw_marginals(axis, panels.place(draws), panels.place(quantiles), colours)
        angles = np.linspace(0.0, 2.0 * np.pi, 100)
        circle = _RADIUS * np.stack([np.cos(angles), np.sin(angles)])[..., None].repeat(n, axis=2)
        axis.plot(*panels.pairs(*circle), **_CIRCLE)
        if reference is not None:
            _draw_reference(axis, panels, along(reference))
        _draw_points(axis, panels, points)
        titles = [f"{word}\nsd {style.power(sd)}" for word, sd in zip(words, draws.std(axis=0), strict=True)]
        names = []  # the two largest entries of each, one below the other
        for k in chosen:
            entries = list(spectrum.direction(k).items())[:2]
            symbols = zip(entries, labels([name for name, _ in entries], equations), strict=True)
            names.append("\n".join(f"{x:+.2f} {symbol}" for (_, x), symbol in symbols if abs(x) > 0.1))
        _label(axis, panels, names, titles, colours)
        _add_legend(axis, n, points, "" if reference is None else "truth", null=False)


def choose_directions(spectrum: Spectrum) -> list[tuple[str, str, list[int]]]:
    """Kind, colour and positions of directions: of each kind the first and the last."""
    n, n_null, n_stiff = len(spectrum.names), spectrum.n_null, spectrum.n_informed
    bounds = (
        ("stiff", style.POSTERIOR, 0, n_stiff),
        ("sloppy", style.WEAK, n_stiff, n - n_null),
        ("null", style.NULL, n - n_null, n),
    )
    some = [(kind, colour, np.linspace(a, b - 1, min(_EACH, b - a))) for kind, colour, a, b in bounds if b > a]
    return [(kind, colour, [int(k) for k in places]) for kind, colour, places in some]


class _Panels:
    """Limits (n,) of n panels, of which each is one unit wide with its gap."""

    def __init__(self, low: np.ndarray, high: np.ndarray) -> None:
        self.low, self.high = low, high

    def place(self, values: np.ndarray) -> np.ndarray:
        """Values (.., n) in units of their panels, of which they may be outside."""
        return (values - self.low) / (self.high - self.low)

    def pairs(self, across: np.ndarray, up: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """x and y (.., n_pairs) of values (.., n) across and up, in every panel below the diagonal; nan outside."""
        rows, columns = np.tril_indices(len(self.low), -1)
        x, y = self.place(across)[..., columns], self.place(up)[..., rows]
        outside = (x < 0.0) | (x > 1.0) | (y < 0.0) | (y > 1.0)
        x, y = columns + SIDE * x, rows + SIDE * (1.0 - y)
        return np.where(outside, np.nan, x), np.where(outside, np.nan, y)


@contextmanager
def _figure(path, n: int) -> Iterator[Axes]:
    """The one axis of a figure for n panels on each side, with their frames."""
    beside = 0.1 if n > 4 else 2.2  # where the legend stands
    size = 0.82 * n + 1.3
    with style.figure(path, size + beside, size, (0.85, 0.1 + beside, 0.85, 0.45)) as figure:
        axis = figure.subplots()
        axis.set(frame_on=False)
        axis.grid(visible=False)
        rows, columns = np.tril_indices(n)
        corners = np.array([(0, 0), (SIDE, 0), (SIDE, SIDE), (0, SIDE)]) + np.stack([columns, rows], 1)[:, None]
        axis.add_collection(PolyCollection(list(corners), facecolors="none", edgecolors=style.TRUTH, linewidths=0.6))
        yield axis
        axis.set(xlim=(-0.005, n - GAP + 0.005), ylim=(n - GAP + 0.005, -0.005))  # here, since contours have set them


def draw_joint(axis: Axes, draws: np.ndarray) -> None:
    """Draw the contours that hold 50 and 90 % of draws (n_draws, n), in units of panels, for each pair.

    The cells divide the draws and not the panel, so that a narrow cloud has a contour too.
    """
    hist2d = _hist2d()
    low, high = np.quantile(draws, [0.001, 0.999], axis=0)
    low, high = low - 0.05 * (high - low), high + 0.05 * (high - low)
    is_line = high - low < _LINE
    for row, column in zip(*np.tril_indices(draws.shape[1], -1), strict=True):
        hist2d(
            column + SIDE * draws[:, column],
            row + SIDE * (1.0 - draws[:, row]),
            ax=axis,
            bins=_CELLS,
            range=[
                (column + SIDE * low[column], column + SIDE * high[column]),
                (row + SIDE * (1.0 - high[row]), row + SIDE * (1.0 - low[row])),
            ],
            smooth=_SMOOTHING,
            levels=SHARES,
            plot_datapoints=False,
            plot_density=False,
            no_fill_contours=True,
            fill_contours=True,
            contourf_kwargs={"colors": ["none", _PALE, style.POSTERIOR]},
            contour_kwargs={"colors": style.POSTERIOR, "linewidths": 3.0 if is_line[row] or is_line[column] else 1.0},
        )


def _draw_marginals(axis, draws, quantiles, colours=None) -> None:
    """Histogram of draws (n_draws, n) and the prior, by quantiles at PRIOR_PROBABILITIES, in units of panels.

    With `colours` the histograms are filled, and each as high as its prior: their widths compare, not their heights.
    """
    for k, (values, prior) in enumerate(zip(draws.T, quantiles.T, strict=True)):
        low, high = np.quantile(values, [0.0005, 0.9995])
        edges = np.linspace(low, high, _BINS + 1) if colours else np.linspace(0, 1, _BINS)
        heights = np.histogram(values, edges, density=True)[0]
        places, density = prior_density(prior)
        inside = (places > 0.0) & (places < 1.0)
        scale = [1.0 / max(heights.max(), density.max(initial=0.0))] * 2
        if colours:
            scale = [1.0 / heights.max(), 1.0 / density.max()]
        heights, density = (SIDE / 1.1 * s * h for s, h in zip(scale, (heights, density), strict=True))
        bottom = k + SIDE
        look = {"color": style.POSTERIOR} if colours is None else {"fc": colours[k], "ec": colours[k], "fill": True}
        width = 3.0 if np.ptp(edges) < _LINE else 1.2
        axis.stairs(bottom - heights, k + SIDE * edges, baseline=bottom, lw=width, **look)
        axis.plot(k + SIDE * places[inside], bottom - density[inside], **style.PRIOR_LINE)


def _draw_line(axis, panels, through, change) -> None:
    """A null direction `change` (n,), in every panel of two of its entries, through a point (n,)."""
    rows, columns = np.tril_indices(len(change), -1)
    both = (change[rows] != 0.0) & (change[columns] != 0.0)
    for pair in np.stack([columns, rows], axis=1)[both]:
        ends = np.sort([(edge[pair] - through[pair]) / change[pair] for edge in (panels.low, panels.high)], axis=0)
        steps = np.array([ends[0].max(), ends[1].min()])[:, None]
        x, y = ((through[pair] + steps * change[pair] - panels.low[pair]) / (panels.high - panels.low)[pair]).T
        axis.plot(pair[0] + SIDE * x, pair[1] + SIDE * (1.0 - y), color=style.NULL, lw=1.8)


def _draw_reference(axis, panels, values) -> None:
    """Lines at values (n,)."""
    place = panels.place(values)
    seen = (place >= 0.0) & (place <= 1.0)
    rows, columns = np.tril_indices(len(place))
    upright, level = seen[columns], seen[rows] & (rows != columns)
    axis.vlines((columns + SIDE * place[columns])[upright], rows[upright], (rows + SIDE)[upright], "k", lw=0.7)
    axis.hlines((rows + SIDE * (1 - place[rows]))[level], columns[level], (columns + SIDE)[level], "k", lw=0.7)


def _draw_points(axis, panels, points) -> None:
    for values, (marker, colour) in zip(points.values(), MARKS.values(), strict=False):
        x, y = panels.pairs(values, values)
        axis.plot(x.ravel(), y.ravel(), marker, ms=3.8, mec="white", mew=0.4, color=colour)


def _label(axis, panels, names, titles, colours=None) -> None:
    """Ticks and names at the left and below, titles above the diagonal."""
    n, colours = len(names), colours or [style.TRUTH] * len(names)
    locator = MaxNLocator(3)
    limits = list(zip(panels.low, panels.high, strict=True))
    ticks = [[t for t in locator.tick_values(a, b) if 0.05 < (t - a) / (b - a) < 0.95] for a, b in limits]
    places = [SIDE * (np.array(t) - a) / (b - a) for t, (a, b) in zip(ticks, limits, strict=True)]
    words = [[f"{t:.6g}" for t in values] for values in ticks]
    axis.set_xticks(np.concatenate([k + p for k, p in enumerate(places)]), [*chain(*words)], rotation=45)
    heights = np.concatenate([np.empty(0), *(k + SIDE - p for k, p in enumerate(places) if k)])
    axis.set_yticks(heights, [*chain(*words[1:])], rotation=45)
    axis.tick_params(labelsize=8)
    size = style.NAMES - 2.0 * any("\n" in name for name in names)
    for k, (name, title, colour) in enumerate(zip(names, titles, colours, strict=True)):
        text = {"color": colour, "ha": "center", "va": "center", "fontsize": size}
        axis.text(k + 0.5 * SIDE, n + 0.58, name, text)
        axis.text(k + 0.5 * SIDE, k - 0.04, title, text | {"va": "bottom", "fontsize": 7.5}, linespacing=1.05)
        if k:
            axis.text(-0.66, k + 0.5 * SIDE, name, text, rotation=90)


def _add_legend(axis, n: int, points, word: str, *, null: bool) -> None:
    """In the empty triangle, or beside a small figure."""
    handles = [
        Patch(color=style.POSTERIOR, label="posterior, 50 %"),
        Patch(color=_PALE, label="posterior, 90 %"),
        Line2D([], [], **style.PRIOR_LINE, label="prior, 90 %"),
    ]
    if word:
        handles.append(Line2D([], [], color=style.TRUTH, lw=0.9, label=word))
    if null:
        handles.append(Line2D([], [], color=style.NULL, lw=1.8, label="null direction"))
    for label, (marker, colour) in zip(points, MARKS.values(), strict=False):
        handles.append(Line2D([], [], ls="", marker=marker, ms=6, color=colour, label=label))
    loc, corner = ("upper right", (1.0, 1.0)) if n > 4 else ("upper left", (1.02, 1.0))
    axis.legend(handles=handles, fontsize=9 if n > 4 else 8, loc=loc, bbox_to_anchor=corner)


@functools.cache
def _hist2d() -> Any:
    """The contours of corner, without ArviZ, which corner imports for chains of ArviZ and which takes two seconds."""
    absent = "arviz" not in sys.modules
    if absent:
        sys.modules["arviz"] = None  # type: ignore[assignment]  # so that an import of it fails
    try:
        import corner  # here, since it imports pyplot
    finally:
        if absent:
            del sys.modules["arviz"]
    return corner.hist2d
