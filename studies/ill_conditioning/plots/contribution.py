"""What each coefficient alone does to the track, in the manner of the thesis's Figures 60 to 67."""

import numpy as np

from bayesub.model.equations import EquationSet
from bayesub.report.plots import style
from bayesub.report.plots.coefficients import labels


def draw(path, contributions: dict, accuracies: dict[str, float], equations: EquationSet) -> None:
    """Cost of one changed coefficient at a time: a column a contribution, the costliest first.

    Parameters
    ----------
    path
        One or several, as :func:`bayesub.report.plots.style.figure` takes them.
    contributions
        Title -> Contribution.
    accuracies
        Title -> cost that the simulator itself makes, drawn as a line.
    equations
        Whose coefficients they are.
    """
    longest = max(len(c.names) for c in contributions.values())
    with style.figure(path, max(6.5, 2.8 * len(contributions) + 0.2), 0.145 * longest + 1.1) as figure:
        panels = figure.subplots(1, len(contributions), sharex=True, squeeze=False)[0]
        for panel, (title, c) in zip(panels, contributions.items(), strict=True):
            costs = np.where(np.isfinite(c.costs), c.costs, np.nan)
            order = np.argsort(-np.nan_to_num(costs[0]), kind="stable")
            places = np.arange(len(order))
            panel.hlines(places, *costs[:2, order], color=style.PRIOR, lw=2.0)
            for fraction, values, face in zip(c.fractions, costs, (style.POSTERIOR, "white"), strict=True):
                look = {
                    "ms": 4,
                    "color": style.POSTERIOR,
                    "mfc": face,
                    "label": f"at {100 * fraction:g} % of its value",
                }
                panel.plot(values[order], places, "o", **look)
            panel.axvline(accuracies[title], color=style.SQP, lw=1.2, ls="--", label="the simulation's own error")
            panel.set_xscale("log")
            panel.set_yticks(places, labels([c.names[k] for k in order], equations), fontsize=8)
            panel.set(ylim=(longest - 0.3, -0.7), xlabel=r"cost (m$^2$ + deg$^2$)")
            panel.set_title(title, fontsize=9)
            panel.grid(axis="y", visible=False)
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=8)
