"""Trade-offs: what is known if all others were, directions from stiff to null, and correlations of a posterior."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.image import AxesImage
from matplotlib.patches import Patch

from bayesub.inference.identifiability import Spectrum
from bayesub.io.words import cell
from bayesub.report.plots import style
from bayesub.report.plots.coefficients import Found, borders, found_handles, labels
from bayesub.report.plots.style import Equations, Paths

AXES = {"X": "#BFD9EA", "Y": "#FBD9A5", "Z": "#C9E8DD", "K": "#EAD3E0", "M": "#F5C9AE", "N": "#D9D9F3"}  # of bars
OTHER = "#E3E3E3"  # of what is no coefficient
ROWS = 30  # of a ladder, at most
_LETTER = 0.013  # share of a direction that a letter of a name takes
SMALL = 0.02  # share below which entries are drawn as one
_ROW = 0.235  # inches
_SIGNS = str.maketrans(dict.fromkeys("$\\{}_'"))  # of a formula
_SPACE = "\u2007"  # as wide as a digit
STRONG = 0.3  # correlation of what is drawn
NUMBERS = 0.5  # correlation from which its number is written
FEW = 6  # parameters that are all drawn
MOST = 30  # parameters of one map
_CELL, _BLOCK = 0.29, 3.3  # inches, of a map: a cell, and one of several maps with its names
_FURTHEST = 10.0  # prior sds, beyond which solutions are at the edge


def draw_known(path: Paths, names: Sequence[str], posterior: np.ndarray, conditional: np.ndarray) -> None:
    """A row for each of the ROWS coefficients that gain most: its posterior sd, and that if all others were known.

    `names`: (n,) labels; `posterior` and `conditional`: (n,) standard deviations, in those of the prior.
    """
    gains = np.maximum(posterior / conditional, 1.0)
    rows = np.argsort(-gains, kind="stable")[:ROWS]
    y = np.arange(len(rows))
    with style.figure(path, 7.4, _ROW * len(rows) + 1.1, (0.95, 1.4, 0.5, 0.5)) as figure:
        axis = figure.subplots()
        axis.hlines(y, conditional[rows], posterior[rows], color=style.WEAK, lw=2.0)
        axis.plot(np.ones(len(rows)), y, "|", ms=9, mew=2.5, color="#9A9A9A", label="prior")
        axis.plot(posterior[rows], y, "o", ms=6, mew=0, color=style.POSTERIOR, label="posterior")
        axis.plot(conditional[rows], y, "D", ms=6, mew=0, color=style.WEAK, label="posterior if all others were known")
        axis.set(xscale="log", xlabel="standard deviation, in those of the prior")
        style.show_rows(axis, [names[k] for k in rows])
        rests = gains[rows] ** -2.0  # one less the square of the multiple correlation
        squares = [f"{1.0 - x:.2f}" if x > 0.0095 else rf"$1-{style.power(x).strip('$')}$" for x in rests]
        words = [f"{cell(gains[k], 2).ljust(6, _SPACE)}{square}" for k, square in zip(rows, squares, strict=True)]
        style.write_beside(axis, y, words, "gain        $R^2$")
        style.legend_above(figure, axis.get_legend_handles_labels()[0])


def draw_directions(
    path: Paths,
    spectrum: Spectrum,
    equations: Equations | None = None,
    *,
    sds: np.ndarray | None = None,
    found: Sequence[Found] = (),
) -> None:
    """A row for each direction, from stiff to null: posterior sd along it, solutions, and what it is made of.

    `equations`: of the coefficients, for their labels and axes; `sds`: (n_params,) posterior sds along the directions,
    in those of the prior, by default those of a linear problem; `found`: distances of solutions along each direction
    from the posterior mean (n_solutions, n_params), in prior sds. Of many directions the middle ones are left out.
    """
    n = len(spectrum.names)
    signal = np.where(np.arange(n) < n - spectrum.n_null, 1.0, 0.0)
    sds = (1.0 + (signal * spectrum.singular_values) ** 2) ** -0.5 if sds is None else sds
    chosen = np.arange(n) if n <= ROWS else np.r_[: ROWS // 2, n - ROWS // 2 : n]
    y, last = np.arange(len(chosen)), n - spectrum.n_null
    kinds = np.where(chosen >= last, 2, np.where(spectrum.singular_values[chosen] > 1.0, 0, 1))
    with style.figure(path, 9.2, _ROW * len(chosen) + 1.4, (0.55, 0.25, 0.5, 0.75)) as figure:
        left, right = figure.subplots(1, 2, sharey=True, width_ratios=[1.0, 1.25], gridspec_kw={"wspace": 0.04})
        groups = (
            (style.POSTERIOR, "o", f"{spectrum.n_informed} stiff: the data know more than the prior"),
            (style.WEAK, "s", f"{last - spectrum.n_informed} sloppy: the prior knows more"),
            (style.NULL, "D", f"{spectrum.n_null} null: the motion stays the same"),
        )
        for kind, (colour, marker, label) in enumerate(groups):
            if np.any(kinds == kind):
                left.plot(sds[chosen][kinds == kind], y[kinds == kind], marker, ms=6, mew=0, color=colour, label=label)
        beyond = [_draw_distances(left, one, chosen) for one in found]
        left.axvline(1.0, color=style.TRUTH, lw=0.8)
        left.set(xscale="log", xlim=(None, 1.3 * _FURTHEST if found else 2.0))
        style.show_rows(left, [f"{k + 1}" for k in chosen])
        left.set_xlabel(f"posterior sd{', distance of solutions' * bool(found)}, in prior sds")
        left.set_ylabel("direction" if n <= ROWS else f"direction; {n - len(chosen)} between are left out")
        axes = ["other"] * n
        if equations:
            axes = [equations.term(name).axis if name in equations.index else "other" for name in spectrum.names]
        names = labels(spectrum.names, equations) if equations else [style.plain(name) for name in spectrum.names]
        names = [name.partition(" (")[0] for name in names]  # without units
        _draw_composition(right, spectrum.directions[chosen], names, axes)
        style.legend_above(figure, [*left.get_legend_handles_labels()[0], *found_handles(found, beyond)])
        colours = [Patch(color=AXES.get(axis, OTHER), label=axis) for axis in dict.fromkeys([*axes, "other"])]
        look = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "ncols": 8, "fontsize": 8, "borderaxespad": 0.2}
        right.legend(handles=colours, handlelength=1.0, columnspacing=1.2, **look)


def _draw_distances(axis: Axes, one: Found, chosen: np.ndarray) -> int:
    """Solutions along the chosen directions, hollow if they do not fit, arrows at the edge; the number of arrows."""
    distances = np.abs(one.values[:, chosen])
    y = np.arange(len(chosen)) + np.linspace(-0.2, 0.2, len(distances))[:, None] * (len(distances) > 1)
    good = one.good[:, chosen]
    beyond = distances > _FURTHEST
    for some, marker in ((beyond, ">"), (~beyond, one.marker)):
        for shown, face in ((some & good, one.colour), (some & ~good, "none")):
            look: dict[str, Any] = {"ms": 3.4, "mec": one.colour, "mfc": face, "mew": 0.6, "ls": "", "zorder": 3}
            axis.plot(np.minimum(distances, _FURTHEST)[shown], y[shown], marker, **look)
    return int(np.count_nonzero(beyond))


def _draw_composition(axis: Axes, directions: np.ndarray, names: Sequence[str], axes: Sequence[str]) -> None:
    """Shares of the parameters in directions (n, n_params), the largest first, with their signs and names."""
    for row, direction in enumerate(directions):
        shares = direction**2 / np.sum(direction**2)
        order = np.argsort(-shares, kind="stable")[: max(1, np.count_nonzero(shares > SMALL))]
        begins = np.concatenate([[0.0], np.cumsum(shares[order])])
        colours = [*(AXES.get(axes[j], OTHER) for j in order), OTHER]
        bars = list(zip(begins, [*shares[order], 1.0 - begins[-1]], strict=True))
        axis.broken_barh(bars, (row - 0.41, 0.82), facecolors=colours, ec="white", lw=0.6)
        for j, begin in zip(order, begins, strict=False):
            if shares[j] > _LETTER * (len(names[j].replace("delta", "").translate(_SIGNS)) + 3):
                sign = "+" if direction[j] > 0.0 else "\u2212"
                look = {"ha": "center", "va": "center", "fontsize": 7.5, "color": style.TRUTH}
                axis.text(begin + 0.5 * shares[j], row, f"{sign} {names[j]}", look)
    axis.set(xlim=(0.0, 1.0), xticks=[0.0, 0.5, 1.0], xticklabels=["0", "50 %", "100 %"])
    axis.set_xlabel("made of (share of the squared length, in prior sds)")
    axis.grid(visible=False)


def strong_block(names: Sequence[str], correlation: np.ndarray) -> tuple[list[str], np.ndarray]:
    """The parameters with a correlation of STRONG and more, and their matrix (n, n); all of a few."""
    members = np.flatnonzero(np.abs(correlation - np.diag(np.diag(correlation))).max(axis=0) >= STRONG)
    if len(names) <= FEW or len(members) < 2:
        members = np.arange(len(names))
    return [names[k] for k in members.tolist()], correlation[np.ix_(members, members)]


def clustered(names: Sequence[str], correlation: np.ndarray, equations: Equations) -> list[np.ndarray]:
    """Positions of the parameters of each axis, and of others, those that are correlated beside each other."""
    from scipy.cluster import hierarchy

    groups = np.split(np.arange(len(names)), borders(names, equations))
    for k, group in enumerate(groups):
        if len(group) > 2:
            apart = 1.0 - np.minimum(np.abs(correlation[np.ix_(group, group)]), 1.0)[np.triu_indices(len(group), 1)]
            groups[k] = group[hierarchy.leaves_list(hierarchy.linkage(apart, "average", optimal_ordering=True))]
    return groups


def draw_correlation(path: Paths, names: Sequence[str], correlation: np.ndarray, equations: Equations) -> None:
    """Heat map of the correlations (n, n) of parameters that have strong ones; `equations` are the coefficients'.

    Of many parameters the whole has axes for names, and a block an axis beside it.
    """
    names, correlation = strong_block(names, correlation)
    groups = clustered(names, correlation, equations)
    whole, blocks = np.concatenate(groups), [group for group in groups if len(group) > 1]
    shown = [whole, *blocks] if len(names) > MOST else [whole]
    rows = 2 if len(shown) > 1 else 1
    columns = -(-len(shown) // rows)
    size = _BLOCK if rows > 1 else max(3.6, _CELL * len(names) + 0.9)
    with style.figure(path, size * columns + 1.2, size * rows) as figure:
        panels = figure.subplots(rows, columns, squeeze=False).ravel()
        for panel, members in zip(panels, shown, strict=False):
            image = _draw_map(panel, [names[k] for k in members], correlation[np.ix_(members, members)], equations)
        for panel in panels[len(shown) :]:
            panel.set_visible(False)
        figure.colorbar(image, ax=[*panels], shrink=0.6, pad=0.02, label="posterior correlation")


def _draw_map(axis, names, correlation, equations) -> AxesImage:
    """One map, with numbers where a correlation is large; of many parameters with axes in place of names."""
    n, ends = len(names), [0, *borders(names, equations), len(names)]
    axis.grid(visible=False)
    axis.spines[:].set_visible(False)
    for k in ends[1:-1]:
        axis.axhline(k - 0.5, color=style.TRUTH, lw=0.6)
        axis.axvline(k - 0.5, color=style.TRUTH, lw=0.6)
    places, words = np.arange(n), labels(names, equations)
    if n > MOST:
        places = np.array([0.5 * (a + b - 1) for a, b in pairwise(ends)])
        words = [equations.term(names[k]).axis if names[k] in equations.index else "" for k in ends[:-1]]
    axis.set_xticks(places, words, rotation=90, fontsize=style.NAMES)
    axis.set_yticks(places, words, fontsize=style.NAMES)
    for row, column in np.argwhere((np.abs(correlation) >= NUMBERS) & ~np.eye(n, dtype=bool) & (n <= MOST)):
        rho = correlation[row, column]
        look = {"ha": "center", "va": "center", "fontsize": 6.5, "color": style.on_colour(rho)}
        axis.text(column, row, f"{rho:.2f}".replace("0.", ".").replace("-", "\u2212"), look)
    others = np.where(np.eye(n, dtype=bool), np.nan, correlation)
    return axis.imshow(others, cmap=style.CORRELATION, vmin=-1, vmax=1)
