"""Ranks of the truth among posterior draws."""

import numpy as np

from bayesub.model.equations import EquationSet
from bayesub.report.plots import style
from bayesub.report.plots.coefficients import labels

COLUMNS = 6
BINS = 20


def _grid(path, quantities, equations, title, caption, draw):
    """A panel for each quantity."""
    rows = -(-len(quantities) // COLUMNS)
    with style.figure(path, 1.8 * COLUMNS, 1.45 * rows + 0.6) as figure:
        panels = figure.subplots(rows, COLUMNS, sharex=True, sharey=True, squeeze=False).ravel()
        for panel, (name, values) in zip(panels, quantities.items(), strict=False):
            draw(panel, values)
            panel.set_title(labels([name], equations)[0] if name in equations.index else name, fontsize=8)
        for panel in panels[len(quantities) :]:
            panel.set_visible(False)
        for panel in panels[max(0, len(quantities) - COLUMNS) : len(quantities)]:
            panel.tick_params(labelbottom=True)  # nothing is below it
        figure.suptitle(caption, fontsize=9)
        figure.supxlabel("rank of the truth among posterior draws, as a fraction", fontsize=9)
        figure.supylabel(title, fontsize=9)


def draw_ecdf(path, quantities: dict, limits, equations: EquationSet) -> None:
    """ECDF minus uniform, within the band that chance leaves.

    Parameters
    ----------
    path
        One or several, as :func:`bayesub.report.plots.style.figure` takes them.
    quantities
        Name -> ECDF (n_draws,).
    limits
        Lower and upper (n_draws,) of the band.
    equations
        Whose coefficients are among the quantities.
    """
    lower, upper = limits
    points = np.arange(1, len(lower) + 1) / (len(lower) + 1)

    def panel(axis, values):
        axis.fill_between(points, lower - points, upper - points, color=style.PRIOR, alpha=0.5, lw=0)
        inside = np.all((values >= lower) & (values <= upper))
        axis.plot(points, values - points, color=style.POSTERIOR if inside else style.SQP, lw=1.2)

    caption = "Grey: the band that one study in a hundred leaves by chance. Blue stays inside, orange leaves it."
    _grid(path, quantities, equations, "ECDF minus uniform", caption, panel)


def draw_histograms(path, quantities: dict, n_draws: int, expected, equations: EquationSet) -> None:
    """Histograms of ranks.

    Parameters
    ----------
    path
        One or several, as :func:`bayesub.report.plots.style.figure` takes them.
    quantities
        Name -> ranks (n_trials,).
    n_draws
        Of each posterior: ranks go from 0 to n_draws.
    expected
        Lowest and highest count of uniform ranks in a bin.
    equations
        Whose coefficients are among the quantities.
    """

    def panel(axis, ranks):
        axis.axhspan(*expected, color=style.PRIOR, alpha=0.5, lw=0)
        axis.hist(np.asarray(ranks) / (n_draws + 1), np.linspace(0, 1, BINS + 1), color=style.POSTERIOR)

    _grid(path, quantities, equations, "trials in a bin", "Grey: what 99 % of bins hold if ranks are uniform.", panel)
