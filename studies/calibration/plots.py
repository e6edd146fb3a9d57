"""Ranks of the truth among posterior draws."""

import numpy as np

from bayesub.model.equations import EquationSet
from bayesub.report.plots import style
from bayesub.report.plots.coefficients import labels

COLUMNS = 6
REACH = 2.5  # half heights of the band that a panel shows


def draw_ecdf(path, quantities: dict, limits, equations: EquationSet) -> None:
    """ECDF minus uniform of each quantity, a panel each, within the band that chance leaves.

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
    reach = REACH * np.max(np.abs([lower - points, upper - points]))
    rows = -(-len(quantities) // COLUMNS)
    with style.figure(path, 1.45 * COLUMNS, 1.3 * rows + 0.7) as figure:
        panels = figure.subplots(rows, COLUMNS, sharex=True, sharey=True, squeeze=False).ravel()
        for panel, (name, values) in zip(panels, quantities.items(), strict=False):
            panel.fill_between(points, lower - points, upper - points, color=style.PRIOR, alpha=0.5, lw=0)
            inside = np.all((values >= lower) & (values <= upper))
            panel.plot(points, values - points, color=style.POSTERIOR if inside else style.SQP, lw=1.2)
            furthest = (values - points)[np.argmax(np.abs(values - points))]
            if abs(furthest) > reach:
                panel.text(0.5, 0.05, f"as far as {furthest:+.2f}", transform=panel.transAxes, ha="center", fontsize=8)
            panel.set_title(labels([name], equations)[0] if name in equations.index else name, fontsize=9)
        panels[0].set(xlim=(0, 1), ylim=(-reach, reach))
        panels[0].set_xticks([0.0, 0.5, 1.0], ["0", "0.5", "1"])
        for panel in panels[len(quantities) :]:
            panel.set_visible(False)
        for panel in panels[max(0, len(quantities) - COLUMNS) : len(quantities)]:
            panel.tick_params(labelbottom=True)  # nothing is below it
        caption = "Grey: the band that one study in a hundred leaves by chance. Blue stays inside, orange leaves it."
        figure.suptitle(caption, fontsize=9)
        figure.supxlabel("rank of the truth among posterior draws, as a fraction", fontsize=9)
        figure.supylabel("ECDF minus uniform", fontsize=9)
