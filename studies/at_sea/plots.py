"""Errors of wrong sets under disturbances."""

import numpy as np

from bayesub.report.plots import style

_LEAST = 1e-6  # m, at which what is smaller is drawn


def draw(path, numbers) -> None:
    """A panel a vehicle: the largest error of any unseen track by kind of sets, a mark a disturbance (medians of sets).

    `path` is one or several, and `numbers` are vehicle -> kind of sets -> disturbance -> errors (m),
    and the noise of the tracks (m).
    """
    with style.figure(path, 3.3 * len(numbers) + 0.4, 4.3) as figure:
        panels = figure.subplots(1, len(numbers), sharey=True, squeeze=False)[0]
        for panel, (vehicle, (result, noise)) in zip(panels, numbers.items(), strict=True):
            for k, name in enumerate(next(iter(result.values()))):
                colour, marker = (style.TRUTH, "o") if k == 0 else (style.CYCLE[k - 1], "^sDvP"[k - 1])
                middle = [max(np.median(r[name]), _LEAST) for r in result.values()]
                places = np.arange(len(result)) + 0.1 * (k - 2.5)
                panel.semilogy(places, middle, marker, ms=5, mew=0, color=colour, label=name)
            panel.axhline(noise, color=style.TRUTH, lw=0.8, ls="--")
            panel.annotate(
                "noise of a track",
                (0.98, noise),
                (0, 3),
                ("axes fraction", "data"),
                "offset points",
                fontsize=8,
                ha="right",
            )
            panel.set_xticks(range(len(result)), list(result), rotation=40, ha="right", fontsize=8)
            panel.set_title(vehicle, fontsize=9)
        panels[0].set_ylabel("largest error of any unseen track (m)")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=8)
