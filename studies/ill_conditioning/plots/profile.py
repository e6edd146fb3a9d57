"""Profile likelihoods beside their Gaussian approximation."""

import numpy as np

from bayesub.model.equations import EquationSet
from bayesub.report.plots import style
from bayesub.report.plots.coefficients import labels
from ill_conditioning.profile import LEVEL_95

BETTER = 1000.0
_COLOURS = (style.POSTERIOR, style.LINEAR, style.SQP, style.NULL)
_LEAST = 1e-2  # per cent, of a change that is drawn


def draw(path, profiles: dict, equations: EquationSet) -> None:
    """A line a profile, by title, on axes of powers of ten, with the 95 % level of these and of better sensors.

    Smaller noise on every reading multiplies -2 log likelihood by the square of the factor and moves no optimum,
    provided that the best fit is perfect: the level is that much lower.
    """
    with style.figure(path, 7.5, 3.8) as figure:
        panel = figure.subplots()
        for (title, p), colour in zip(profiles.items(), _COLOURS, strict=False):
            change = 100.0 * (p.grid / p.value - 1.0)
            up, down = change > _LEAST, change < -_LEAST
            panel.plot(change[up], _positive(p.laplace[up]), color=style.PRIOR, lw=4.0, zorder=1)
            panel.plot(change[up], _positive(p.cost[up]), "o-", color=colour, ms=3, lw=1.3,
                       label=f"{labels([p.name], equations)[0]}, {title}")  # fmt: skip
            panel.plot(-change[down], _positive(p.cost[down]), "--", color=colour, lw=1.0)
        for level, word in ((LEVEL_95, "95 % level"), (LEVEL_95 / BETTER**2, f"with sensors {BETTER:g} times better")):
            panel.axhline(level, color=style.TRUTH, lw=0.8, ls=":")
            panel.text(1.01, level, word, transform=panel.get_yaxis_transform(), va="center", fontsize=8)
        panel.plot([], [], "--", color=style.TRUTH, lw=1.0, label="changes downwards")
        panel.plot([], [], color=style.PRIOR, lw=4.0, label="Gaussian approximation")
        panel.set(xscale="log", yscale="log", xlabel="change of the coefficient (%)")
        panel.set_ylabel("rise of $-2\\log$ likelihood")
        figure.legend(*panel.get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=8)


def _positive(values) -> np.ndarray:
    return np.where(values > 0.0, values, np.nan)
