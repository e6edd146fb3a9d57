"""Regressors against each other: their correlations, and scatter plots such as the thesis's Figure 68."""

import re

import numpy as np

from bayesub.model.equations import EquationSet
from bayesub.report.plots import style
from bayesub.report.plots.coefficients import labels
from bayesub.report.plots.trade_offs import strong_block

MAX_COLUMNS = 3
MAX_POINTS = 1500


def draw_correlation(path, collinearities, equations: EquationSet) -> None:
    """Heat maps of the cosines of the regressors, their correlations about zero, a panel an axis of the linear form.

    Regressors carry the labels of their coefficients; `collinearities` is axis -> Collinearity, of these
    equations.
    """
    axes = [(c.axis, *strong_block(c.names, c.correlation)) for c in collinearities.values()]
    n_columns = min(MAX_COLUMNS, len(axes))
    n_rows = -(-len(axes) // n_columns)
    size = 0.155 * max(len(names) for _, names, _ in axes) + 1.1
    with style.figure(path, size * n_columns + 0.7, size * n_rows + 0.2) as figure:
        panels = figure.subplots(n_rows, n_columns, squeeze=False)
        for panel in panels.flat[len(axes) :]:
            panel.axis("off")
        for panel, (title, names, correlation) in zip(panels.flat, axes, strict=False):
            image = panel.imshow(correlation, cmap="PuOr", vmin=-1, vmax=1)
            place = range(len(names))
            panel.set_xticks(place, labels(names, equations), rotation=90, fontsize=7)
            panel.set_yticks(place, labels(names, equations), fontsize=7)
            panel.tick_params(length=0)
            panel.grid(visible=False)
            panel.spines[:].set_visible(False)
            panel.set_title(title, fontsize=9)
        figure.colorbar(image, ax=panels, shrink=0.9, label="cosine of two regressors")


def draw_scatter(path, systems: dict, pairs, equations: EquationSet) -> None:
    """Regressors against each other over the manoeuvre, each scaled to its largest size.

    Parameters
    ----------
    path
        One or several, as :func:`bayesub.report.plots.style.figure` takes them.
    systems
        Title -> one axis of the linear form, a column of panels each.
    pairs
        (coefficient across, coefficient up), a row of panels each.
    equations
        Whose coefficients they are.
    """
    with style.figure(path, 2.9 * len(systems) + 0.3, 2.6 * len(pairs)) as figure:
        panels = figure.subplots(len(pairs), len(systems), squeeze=False, sharex="row", sharey="row")
        for column, (title, system) in zip(panels.T, systems.items(), strict=True):
            stride = -(-len(system.matrix) // MAX_POINTS)
            for panel, (across, up) in zip(column, pairs, strict=True):
                x, y = (system.matrix[::stride, system.names.index(name)] for name in (across, up))
                panel.plot(x / np.abs(x).max(), y / np.abs(y).max(), ".", ms=2, color=style.POSTERIOR)
                cosine = x @ y / np.sqrt((x @ x) * (y @ y))
                panel.set_title(f"{title}: correlation {cosine:+.4f}", fontsize=9)
                panel.set_xlabel(f"{_regressor(across, equations)} over its largest")
        for panel, (_, up) in zip(panels[:, 0], pairs, strict=True):
            panel.set_ylabel(f"{_regressor(up, equations)} over its largest")


def _regressor(name, equations) -> str:
    """The regressor in mathematical type, from the subscript of the label of its coefficient if that has one."""
    subscript = re.search(r"_\{(.*)\}\$", equations.label(name))
    if not subscript:
        return style.plain(equations.term(name).regressor)
    return "$" + re.sub(r"([uvwpqr])\1", r"\1^2", subscript[1]) + "$"
