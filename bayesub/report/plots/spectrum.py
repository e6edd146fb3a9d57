"""The spectrum of the whitened Jacobian: stiff, sloppy and null directions."""

import numpy as np
from matplotlib.axes import Axes

from bayesub.inference.identifiability import Spectrum
from bayesub.report.plots import style
from bayesub.report.plots.style import Paths


def draw(path: Paths, spectrum: Spectrum) -> None:
    """Singular values, descending; the last ``n_null`` of a spectrum are null by the equations of motion."""
    with style.figure(path, 6.5, 3.8, (0.7, 0.1, 0.5, 0.1)) as figure:
        axis = figure.subplots()
        draw_values(axis, spectrum)
        axis.annotate(
            "data as sharp as the prior", (0.995, 1.0), (0, 3), ("axes fraction", "data"), "offset points", fontsize=8,
            ha="right",
        )  # fmt: skip
        axis.set_xlabel("direction, from the stiffest to the sloppiest")
        axis.set_ylabel("singular value (prior sd / data sd)")
        axis.set_xticks(np.arange(1, len(spectrum.names) + 1)[:: max(1, len(spectrum.names) // 20)])
        axis.legend(loc="upper right", fontsize=8)


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
