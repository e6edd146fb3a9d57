"""How wrong coefficients may be for how little any manoeuvre moves."""

import numpy as np

from bayesub.plots import style

_COLOURS = (style.READINGS, style.POSTERIOR, style.TRUTH, style.NULL, style.WEAK, style.SQP)
_MARKERS = ("o", "o", "o", "D", "s", "s")
_FLOOR_M = 1e-13


def draw(path, numbers) -> None:
    """A panel a vehicle: error of half the coefficients against the largest error of any unseen track, a dot a set.

    numbers : vehicle -> kind of sets -> outcome, as ``studies/wrong_coefficients.py`` returns it
    """
    with style.figure(path, 3.3 * len(numbers) + 0.4, 4.0) as figure:
        panels = figure.subplots(1, len(numbers), sharey=True, squeeze=False)[0]
        for panel, (vehicle, result) in zip(panels, numbers.items(), strict=True):
            for (kind, r), colour, marker in zip(result.items(), _COLOURS, _MARKERS, strict=False):
                off = np.maximum(r["unseen_m"], _FLOOR_M)
                errors = r["coefficient_largest" if kind.startswith("null") else "coefficient_median"]
                panel.loglog(100 * np.array(errors), off, marker, ms=4, mew=0, color=colour, label=kind)
            panel.axhline(next(iter(result.values()))["noise_m"], color=style.TRUTH, lw=0.8, ls="--")
            panel.set(title=vehicle, xlabel="error of half the coefficients (%)\nnull directions: largest error")
        panels[0].set_ylabel("largest error of any unseen track (m)\ndashed: noise of the tracks")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=8)
