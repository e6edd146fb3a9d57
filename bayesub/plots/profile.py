"""Profile likelihoods beside their Gaussian approximation."""

import numpy as np

from bayesub.identifiability.profile import LEVEL_95
from bayesub.plots import style
from bayesub.plots.coefficients import labels

TOP = 8.0
SHARPER = 1000.0


def draw(path, profiles: dict) -> None:
    """A column a profile, by title: with the sensors of the problem, and below with sensors a thousand times better.

    The coefficient runs as a ratio to where it is best. Smaller noise on every reading multiplies -2 log likelihood by
    the square of the factor and moves no optimum, provided that the best fit is perfect.
    """
    with style.figure(path, 2.6 * len(profiles) + 0.4, 4.9) as figure:
        panels = figure.subplots(2, len(profiles), sharey=True, sharex="col", squeeze=False)
        for column, (title, p) in zip(panels.T, profiles.items(), strict=True):
            order = np.argsort(p.grid)
            ratio = (p.grid / p.value)[order]
            for panel, factor in zip(column, (1.0, SHARPER**2), strict=True):
                panel.axhline(LEVEL_95, color=style.WEAK, lw=1.2, ls="--", label="95 % level")
                panel.plot(ratio, factor * p.laplace[order], color=style.PRIOR, lw=3.0, label="Gaussian approximation")
                panel.plot(ratio, factor * p.cost[order], "o-", ms=3, lw=1.2, color=style.POSTERIOR, label="profile")
            column[0].set_title(f"{labels([p.name])[0]}, {title}\nrises to {np.nanmax(p.cost):.1e}", fontsize=9)
            column[1].set_xlabel("ratio to the best fit")
            column[1].tick_params(axis="x", labelsize=8)
            column[1].locator_params(axis="x", nbins=4)
        panels[0, 0].set_ylim(-0.3, TOP)
        panels[0, 0].set_ylabel("rise of $-2\\log$ likelihood")
        panels[1, 0].set_ylabel(f"the same, sensors\n{SHARPER:g} times better")
        handles, words = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, words, loc="outside lower center", ncols=3, fontsize=8)
