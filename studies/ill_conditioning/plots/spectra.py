"""The spectra of several problems side by side."""

import numpy as np
from matplotlib.axes import Axes

from bayesub.inference.identifiability import Spectrum
from bayesub.report.plots import style

_HEADROOM = 1e6  # room for a legend above the stiffest


def draw_cases(path, spectra: dict, n_columns: int) -> None:
    """Singular values of many problems, a panel each, in rows of `n_columns`; spectra are by title."""
    n_rows = -(-len(spectra) // n_columns)
    with style.figure(path, 3.4 * n_columns, 2.7 * n_rows) as figure:
        panels = figure.subplots(n_rows, n_columns, sharey=True, squeeze=False)
        for panel, (title, spectrum) in zip(panels.flat, spectra.items(), strict=True):
            draw_values(panel, spectrum)
            panel.set_title(title, fontsize=9)
            panel.legend(loc="upper right", fontsize=7.5, handletextpad=0.2, borderaxespad=0.1)
        stiffest = max(spectrum.singular_values[0] for spectrum in spectra.values())
        panels[0, 0].set_ylim(top=_HEADROOM * stiffest)
        for row in panels:
            row[0].set_ylabel("singular value\n(prior sd / data sd)")
        for panel in panels[-1]:
            panel.set_xlabel("direction")


def draw_values(axis: Axes, spectrum: Spectrum) -> None:
    """Draw singular values by their number: stiff, sloppy and null ones, and the gap before the null ones."""
    s, n_null = spectrum.singular_values, spectrum.n_null
    number = np.arange(1, len(s) + 1)
    null = number > len(s) - n_null
    stiff = (s > 1.0) & ~null
    groups = (
        (stiff, style.POSTERIOR, "o", f"{stiff.sum()} known better than by the prior"),
        (~stiff & ~null, style.WEAK, "s", f"{(~stiff & ~null).sum()} left to the prior"),
        (null, style.NULL, "D", f"{null.sum()} null: no data of this kind see them"),
    )
    for members, colour, marker, label in groups:
        if members.any():
            axis.semilogy(number[members], s[members], marker, color=colour, label=label, ms=6 if len(s) < 30 else 4)
    axis.axhline(1.0, color=style.TRUTH, lw=0.8)
    if n_null and n_null < len(s) and 0.0 < s[null].max() < s[~null].min():
        upper, lower = s[~null].min(), s[null].max()
        axis.axhspan(lower, upper, color=style.NULL, alpha=0.15, lw=0)
        power = int(np.floor(np.log10(upper / lower)))
        text = rf"gap of ${upper / lower / 10**power:.0f}\times10^{{{power}}}$"
        axis.annotate(text, (1.0, np.sqrt(upper * lower)), va="center", fontsize=9)
