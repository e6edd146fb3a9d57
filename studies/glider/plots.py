"""What a glider knows of itself: mass against volume, how well each parameter is known, and predicted speeds."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from bayesub.report.plots import style

LABELS = {
    "CD0": "parasite drag",
    "lift_slope": "lift slope",
    "CD1": "induced drag",
    "compressibility_1e-5_per_bar": "compressibility",
    "mass_kg": "mass",
    "volume_cm3": "volume",
    "excess_g": "mass less displaced mass",
}
TITLES = ("Only their difference", "What is known", "An unseen descent")
COLOURS = (style.SQP, style.POSTERIOR)  # of the fits
BAND = (0.05, 0.95)


def draw(
    paths: Sequence[Path],
    fits: Mapping[str, dict],
    draws: Mapping[str, Mapping[str, np.ndarray]],
    speeds: Mapping[str, Mapping[str, np.ndarray]],
    peers: Mapping[str, Mapping[str, np.ndarray]],
) -> None:
    """Draw the three panels side by side.

    Parameters
    ----------
    paths : sequence of Path
        Where to write it.
    fits : mapping of str to dict
        Fit -> its numbers.
    draws : mapping of str to mapping
        Fit -> parameter -> (n_draws,) values.
    speeds : mapping of str to mapping
        Fit -> `times` (n,), `speed` (n,) of the profiler, `noisy` (n_draws, n) and `middle` (n,) of an unseen descent.
    peers : mapping of str to mapping
        Fit -> `times` (m,) and `speed` (m,) of the descent by gliderflight; empty if there are none.
    """
    with style.figure(paths, 9.0, 3.6) as figure:
        trade, known, flight = figure.subplots(1, 3, gridspec_kw={"width_ratios": (1.0, 1.1, 1.25)})
        _trade_off(trade, draws)
        _known(known, fits)
        _speeds(flight, speeds, peers)
        for panel, title in zip(figure.axes, TITLES, strict=True):
            panel.set_title(title, fontsize=9)
        handles, words = known.get_legend_handles_labels()
        words = ["fit of " + word for word in words]
        others = flight.get_legend_handles_labels()
        figure.legend(handles + others[0], words + others[1], loc="outside upper center", ncols=5, fontsize=8)


def _trade_off(axes: Axes, draws) -> None:
    for values, colour, marker in zip(draws.values(), COLOURS, "ox", strict=True):
        axes.plot(values["volume_cm3"] / 1e3, values["mass_kg"], marker, color=colour, ms=3, mew=0.8, alpha=0.6)
    axes.set(xlabel="volume (litres)", ylabel="mass (kg)")


def _known(axes: Axes, fits) -> None:
    places = np.arange(len(LABELS))[::-1]
    for k, ((fit, result), colour) in enumerate(zip(fits.items(), COLOURS, strict=True)):
        shares = [result["parameters"][name]["sd"] / result["parameters"][name]["prior_sd"] for name in LABELS]
        rows = places + 0.15 - 0.3 * k
        axes.hlines(rows, shares, 1.0, color=style.PRIOR, lw=2.0, zorder=1)
        axes.plot(shares, rows, "ox"[k], color=colour, ms=5, label=fit)
    axes.set_yticks(places, list(LABELS.values()))
    axes.set(xscale="log", xlabel="posterior sd over prior sd (line: the prior)")
    axes.grid(axis="y", visible=False)
    axes.axvline(1.0, color=style.TRUTH, lw=0.8)


def _speeds(axes: Axes, speeds, peers) -> None:
    for flight, colour, alpha in zip(speeds.values(), COLOURS, (0.25, 0.35), strict=True):
        low, high = np.quantile(flight["noisy"], BAND, axis=0)
        axes.fill_between(flight["times"], low, high, color=colour, alpha=alpha, lw=0)
        axes.plot(flight["times"], flight["middle"], color=colour, lw=1.4)
    for (fit, peer), dashes in zip(peers.items(), (":", "--"), strict=False):
        axes.plot(peer["times"], peer["speed"], dashes, color=style.LINEAR, lw=1.2, label=f"gliderflight, {fit}")
    axes.plot(flight["times"], flight["speed"], ".", color=style.TRUTH, ms=4, label="profiler")
    axes.set(xlabel="time (s)", ylabel="speed through the water (m/s)")
