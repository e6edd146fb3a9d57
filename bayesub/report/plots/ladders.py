"""Two ladders on a logarithmic axis: of coefficients if all others were known, and of directions from stiff to null."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from bayesub.inference.identifiability import Spectrum
from bayesub.io.words import cell
from bayesub.report.plots import style
from bayesub.report.plots.coefficients import Found, found_handles, labels
from bayesub.report.plots.style import Equations, Paths

AXES = {"X": "#BFD9EA", "Y": "#FBD9A5", "Z": "#C9E8DD", "K": "#EAD3E0", "M": "#F5C9AE", "N": "#D9D9F3"}  # of bars
OTHER = "#E3E3E3"  # of what is no coefficient
ROWS = 30  # of a ladder, at most
_LETTER = 0.013  # share of a direction that a letter of a name takes
SMALL = 0.02  # share below which entries are drawn as one
_ROW = 0.235  # inches
_SIGNS = str.maketrans(dict.fromkeys("$\\{}_'"))  # of a formula
_SPACE = "\u2007"  # as wide as a digit
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
        known = "posterior if all others were known"
        axis.plot(conditional[rows], y, "D", ms=6, mew=0, color=style.WEAK, label=known)
        axis.set_xscale("log")
        style.show_rows(axis, [names[k] for k in rows])
        axis.set_xlabel("standard deviation, in those of the prior")
        words = [f"{cell(gains[k], 2).ljust(6, _SPACE)}{_multiple(gains[k])}" for k in rows]
        style.write_beside(axis, y, words, "gain        $R^2$")
        style.legend_above(figure, axis.get_legend_handles_labels()[0])


def _multiple(gain: float) -> str:
    """Square of the multiple correlation with all others."""
    rest = gain**-2.0
    return f"{1.0 - rest:.2f}" if rest > 0.0095 else rf"$1-{style.power(rest).strip('$')}$"


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
        left.set_xscale("log")
        left.set_xlim(right=1.3 * _FURTHEST if found else 2.0)
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
    axis.set_xlim(0.0, 1.0)
    axis.set_xticks([0.0, 0.5, 1.0], ["0", "50 %", "100 %"])
    axis.set_xlabel("made of (share of the squared length, in prior sds)")
    axis.grid(visible=False)
