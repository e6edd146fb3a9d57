"""How wrong coefficients may be for how little any manoeuvre moves."""

import numpy as np

from bayesub.report.plots import style

_LOOKS = ((style.READINGS, "o"), (style.POSTERIOR, "^"), (style.TRUTH, "D"), (style.WEAK, "s"), (style.SQP, "v"))


def draw(path, numbers) -> None:
    """A panel a vehicle: error of the median coefficient against the largest error of any unseen track, a dot a set.

    Moves along null directions, which miss nothing, stand in the title.

    Parameters
    ----------
    path
        One or several, as :func:`bayesub.report.plots.style.figure` takes them.
    numbers
        Vehicle -> kind of sets -> outcome, as ``studies/wrong_coefficients.py`` returns it.
    """
    with style.figure(path, 3.3 * len(numbers) + 0.4, 3.9) as figure:
        panels = figure.subplots(1, len(numbers), sharey=True, sharex=True, squeeze=False)[0]
        for panel, (vehicle, result) in zip(panels, numbers.items(), strict=True):
            kinds = {kind: r for kind, r in result.items() if not kind.startswith("null")}
            for (kind, r), (colour, marker) in zip(kinds.items(), _LOOKS, strict=False):
                errors = 100 * np.array(r["coefficient_median"])
                panel.loglog(errors, r["unseen_m"], marker, ms=4, mew=0, color=colour, label=kind)
            noise = next(iter(result.values()))["noise_m"]
            panel.axhline(noise, color=style.TRUTH, lw=0.8, ls="--")
            panel.annotate(
                "noise of the tracks", (0.02, noise), (0, 3), ("axes fraction", "data"), "offset points", fontsize=8
            )
            title = vehicle
            if null := result.get("null directions"):
                wrong, off = max(null["coefficient_largest"]), max(null["unseen_m"])
                title += f"\nnull directions: {wrong:.0%} wrong, {style.power(off)} m off"
            panel.set_title(title, fontsize=9)
            panel.set_xlabel("error of the median coefficient (%)")
        panels[0].set_ylabel("largest error of any unseen track (m)")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=5, fontsize=8)
