"""Profile likelihoods beside their Gaussian approximation."""

import numpy as np

from bayesub.inference.identifiability.profile import LEVEL_95
from bayesub.model.equations import EquationSet
from bayesub.report.plots import style
from bayesub.report.plots.coefficients import labels

TOP = 8.0
SHARPER = 1000.0


def draw(path, profiles: dict, equations: EquationSet) -> None:
    """A column a profile, by title: with the sensors of the problem, and below with sensors a thousand times better.

    Smaller noise on every reading multiplies -2 log likelihood by the square of the factor and moves no optimum,
    provided that the best fit is perfect.
    """
    with style.figure(path, 2.6 * len(profiles) + 0.4, 5.4) as figure:
        panels = figure.subplots(2, len(profiles), sharey=True, squeeze=False)
        for column, (title, p) in zip(panels.T, profiles.items(), strict=True):
            column[0].set_title(
                f"{labels([p.name], equations)[0]}, {title}\nrises to {style.power(np.nanmax(p.cost))}", fontsize=9
            )
            for panel, sharper in zip(column, (1.0, SHARPER), strict=True):
                _draw_profile(panel, p, sharper)
        panels[0, 0].set_ylim(-0.3, TOP)
        panels[0, 0].set_ylabel("rise of $-2\\log$ likelihood")
        panels[1, 0].set_ylabel(f"the same, sensors\n{SHARPER:g} times better")
        handles, words = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, words, loc="outside lower center", ncols=3, fontsize=8)


def _draw_profile(panel, p, sharper):
    """One profile against the change of its coefficient, as far as it stays on the page."""
    order = np.argsort(p.grid / p.value)
    change, cost, laplace = 100.0 * (p.grid / p.value - 1.0)[order], p.cost[order], p.laplace[order]
    reach = max(np.abs(change[np.isfinite(cost)]))
    steepest = sharper * np.sqrt(np.nanmax(cost))
    if steepest > np.sqrt(TOP):
        reach *= min(1.0, 1.5 * np.sqrt(TOP) / steepest)
    fine = np.linspace(-reach, reach, 400)
    # The root of a profile is nearly straight on either side of the best.
    for values, style_of in (
        (laplace, {"color": style.PRIOR, "lw": 3.5}),
        (cost, {"color": style.POSTERIOR, "lw": 1.3}),
    ):
        root = np.interp(fine, change, np.sqrt(np.maximum(values, 0.0)))
        word = "profile" if values is cost else "Gaussian approximation"
        panel.plot(fine, (sharper * root) ** 2, label=word, **style_of)
    drawn = np.abs(change) <= reach
    panel.plot(change[drawn], sharper**2 * cost[drawn], "o", ms=3, color=style.POSTERIOR)
    panel.axhline(LEVEL_95, color=style.WEAK, lw=1.2, ls="--", label="95 % level")
    panel.set_xlabel("change (%)")
    panel.tick_params(axis="x", labelsize=8)
    panel.locator_params(axis="x", nbins=5)
