"""What captive runs bring: coefficients known by the hour, and spectra of the equations."""

import numpy as np

from bayesub.report.plots import style

_LINES = {
    "after a free trial": (style.POSTERIOR, "o", "best first, after a free trial"),
    "best first": (style.LINEAR, "^", "best first, tank alone"),
}


def draw_known(path, numbers, per_hour: float) -> None:
    """A panel a vehicle: coefficients known to 5 % against tank hours.

    Parameters
    ----------
    path
        One or several, as :func:`bayesub.report.plots.style.figure` takes them.
    numbers
        Vehicle -> numbers, as ``studies/captive.py`` has them.
    per_hour
        Runs an hour.
    """
    with style.figure(path, 3.2 * len(numbers) + 0.3, 3.6) as figure:
        panels = figure.subplots(1, len(numbers), squeeze=False)[0]
        for panel, (vehicle, r) in zip(panels, numbers.items(), strict=True):
            hours = np.arange(len(r["random"])) / per_hour
            panel.fill_between(hours, *r["random_range"], color=style.PRIOR, lw=0)
            panel.plot(hours, list(r["random"].values()), color="#7A7A7A", lw=1.2, label="at random, tank alone")
            for label, (colour, marker, words) in _LINES.items():
                counts = list(r["known"][label].values())
                hours = np.arange(len(counts)) / per_hour
                panel.plot(hours, counts, marker, ls="-", lw=1.0, ms=3.5, mew=0, color=colour, label=words)
            panel.axhline(r["n_coefficients"], color=style.TRUTH, lw=0.8, ls="--", label="all coefficients")
            panel.set_title(vehicle, fontsize=9)
            panel.set_xlabel("hours of the tank")
            panel.set_ylim(bottom=0)
        panels[0].set_ylabel("coefficients known to 5 %")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=4, fontsize=8)


def draw_spectra(path, spectra) -> None:
    """A panel a vehicle: singular values of the worst axis, by captive runs and by a free trial.

    Parameters
    ----------
    path
        One or several.
    spectra
        Vehicle -> "captive" and "free" -> singular values.
    """
    looks = {
        "captive": (style.LINEAR, "^", "captive runs"),
        "free": (style.SQP, "s", "free trial, motion known exactly"),
    }
    with style.figure(path, 3.2 * len(spectra) + 0.3, 3.4) as figure:
        panels = figure.subplots(1, len(spectra), squeeze=False, sharey=True)[0]
        for panel, (vehicle, one) in zip(panels, spectra.items(), strict=True):
            for key, (colour, marker, label) in looks.items():
                panel.semilogy(1 + np.arange(len(one[key])), one[key], marker, ms=4, mew=0, color=colour, label=label)
            panel.set_title(vehicle, fontsize=9)
            panel.set_xlabel("direction")
            panel.set_ylim(bottom=1e-13)
        panels[0].set_ylabel("singular value, worst axis")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2, fontsize=8)
