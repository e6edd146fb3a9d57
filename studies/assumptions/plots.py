"""What is known with assumptions kept and relaxed, and how often it is so."""

import numpy as np

from bayesub.report.plots import style

_LOOKS = {"kept": (style.SQP, "s", "kept while it is wrong"), "relaxed": (style.POSTERIOR, "o", "inferred")}


def draw(path, numbers) -> None:
    """A row an assumption: coefficients known to 10 % on the left, coverage of 90 % intervals on the right.

    `path` is one or several, and `numbers` are assumption -> "kept" and "relaxed" -> "known" and "coverage".
    """
    y = np.arange(len(numbers))[::-1]
    with style.figure(path, 8.2, 0.36 * len(numbers) + 1.2) as figure:
        left, right = figure.subplots(1, 2, sharey=True)
        for key, (colour, marker, label) in _LOOKS.items():
            known = [r[key]["known"] for r in numbers.values()]
            held = [100.0 * r[key]["coverage"] for r in numbers.values()]
            left.plot(known, y, marker, ms=6, mew=0, color=colour, label=label)
            right.plot(held, y, marker, ms=6, mew=0, color=colour)
        right.axvline(90.0, color=style.TRUTH, lw=0.8, ls="--")
        left.set_yticks(y, list(numbers))
        left.set_xlim(left=0)
        left.set_xlabel("coefficients known to 10 %")
        right.set_xlabel("in 90 % intervals (%)")
        for panel in (left, right):
            panel.grid(axis="y", visible=False)
        figure.legend(*left.get_legend_handles_labels(), loc="outside upper center", ncols=2, fontsize=8)
