"""The spectra of several problems side by side, and the stiffest, sloppiest and null directions of one."""

import numpy as np
from matplotlib.axes import Axes

from bayesub.inference.identifiability import Spectrum
from bayesub.model.equations import EquationSet
from bayesub.report.plots import style
from bayesub.report.plots.coefficients import labels

BARS = 8  # entries of a direction that are drawn
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


def draw_directions(path, spectrum, equations: EquationSet, n_each: int = 3) -> None:
    """The stiffest directions, the sloppiest that are not null, and the null ones, by their largest entries."""
    last = len(spectrum.names) - spectrum.n_null
    rows = [
        ("stiff", style.POSTERIOR, range(n_each)),
        ("sloppy", style.WEAK, range(last - 1, last - 1 - n_each, -1)),
        ("null", style.NULL, range(last, min(last + n_each, len(spectrum.names)))),
    ]
    rows = [row for row in rows if len(row[2])]
    with style.figure(path, 9.0, 2.2 * len(rows) + 0.4) as figure:
        panels = figure.subplots(len(rows), n_each, sharex=True, squeeze=False)
        for row, (word, colour, members) in zip(panels, rows, strict=True):
            for panel in row[len(members) :]:
                panel.axis("off")
            for panel, i in zip(row, members, strict=False):
                entries = {name: x for name, x in list(spectrum.direction(i).items())[:BARS] if x != 0.0}
                place = np.arange(len(entries))
                panel.barh(place, list(entries.values()), color=colour)
                panel.axvline(0.0, color=style.TRUTH, lw=0.6)
                panel.set_yticks(place, labels(entries, equations), fontsize=8)
                panel.invert_yaxis()
                panel.grid(axis="y", visible=False)
                known = f"data sd = {style.power(1.0 / spectrum.singular_values[i])} prior sd"
                panel.set_title(f"{word}: " + ("no data" if word == "null" else known), fontsize=8.5)
                panel.tick_params(labelbottom=True)
        panels[0, 0].set_xlim(-1.05, 1.05)
        figure.supxlabel(f"prior standard deviations along the unit direction ({BARS} largest entries)", fontsize=9)


def draw_values(axis: Axes, spectrum: Spectrum) -> None:
    """Draw singular values by their number: sharp, sloppy and null ones, and the gap before the null ones."""
    s, n_null = spectrum.singular_values, spectrum.n_null
    number = np.arange(1, len(s) + 1)
    null = number > len(s) - n_null
    sharp = (s > 1.0) & ~null
    groups = (
        (sharp, style.POSTERIOR, "o", f"{sharp.sum()} sharpened by the data"),
        (~sharp & ~null, style.WEAK, "s", f"{(~sharp & ~null).sum()} left to the prior"),
        (null, style.NULL, "D", f"{null.sum()} null: no data of this kind can tell"),
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
