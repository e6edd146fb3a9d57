"""What each coefficient alone does to the track, in the manner of the thesis's Figures 60 to 67."""

import numpy as np

from bayesub.model.equations import EquationSet
from bayesub.plots import style
from bayesub.plots.coefficients import labels

_MARKERS = ("o", "s", "^", "D", "v")
_COLOURS = (style.POSTERIOR, style.SQP, style.LINEAR, style.WEAK, style.NULL)
PER_ROW = 42


def draw(path, contributions: dict, accuracies: dict[str, float], equations: EquationSet) -> None:
    """Cost of one changed coefficient at a time, filled markers for the first fraction and open ones for the second.

    Parameters
    ----------
    path
        One or several, as :func:`bayesub.plots.style.figure` takes them.
    contributions
        Title -> Contribution.
    accuracies
        Title -> cost that the simulator itself makes, drawn as a line.
    equations
        Whose coefficients they are, in their order.
    """
    present = {name for c in contributions.values() for name in c.names}
    names = [name for name in equations.names if name in present]
    n_rows = -(-len(names) // PER_ROW)
    length = -(-len(names) // n_rows)
    with style.figure(path, max(6.5, 0.27 * length + 1.2), 3.6 * n_rows + 0.6) as figure:
        panels = figure.subplots(n_rows, 1, sharey=True, squeeze=False)[:, 0]
        for row, panel in enumerate(panels):
            members = names[row * length : (row + 1) * length]
            place = {name: k for k, name in enumerate(members)}
            for n, (title, c) in enumerate(contributions.items()):
                at = np.array([place.get(name, -1) for name in c.names])
                offset = 0.22 * (n - (len(contributions) - 1) / 2)
                for fraction, costs, face in zip(c.fractions, c.costs, (_COLOURS[n], "none"), strict=True):
                    drawn = (at >= 0) & np.isfinite(costs)
                    panel.plot(
                        at[drawn] + offset, costs[drawn], _MARKERS[n], ms=4, color=_COLOURS[n], mfc=face,
                        label=f"{title}, at {100 * fraction:g} %",
                    )  # fmt: skip
                panel.axhline(accuracies[title], color=_COLOURS[n], lw=1.0, ls="--", label=f"{title}, simulator's own")
            panel.set_yscale("log")
            panel.set_xticks(range(len(members)), labels(members, equations), rotation=90, fontsize=8)
            panel.set_xlim(-0.7, len(members) - 0.3)
            panel.set_ylabel(r"cost (m$^2$ + deg$^2$)")
        handles, words = panels[0].get_legend_handles_labels()
        figure.legend(handles, words, loc="outside upper center", ncols=len(contributions), fontsize=8)
