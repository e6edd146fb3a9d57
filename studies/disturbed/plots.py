"""What intervals hold of boats that are pushed, by likelihood and disturbance."""

import numpy as np

from bayesub.report.plots import style

BINS = 10  # of ranks
COLOURS = {
    "noise only": style.SQP,
    "slow noise": style.WEAK,
    "filter error": style.LINEAR,
    "histories": style.POSTERIOR,
    "inferred": style.NULL,
}
MARKERS = {"noise only": "s", "slow noise": "D", "filter error": "^", "histories": "o", "inferred": "v"}
TITLES = {"log": "position, heading, Doppler log, gyro", "track": "track of half a metre (scaled), heading"}
_LEVEL = "90 %"


def draw(path, numbers: dict) -> None:
    """Coverage and widths by disturbance for each set of sensors, and the ranks of the first.

    Parameters
    ----------
    path : one file or several
    numbers : of the study
    """
    with style.figure(path, 10.0, 6.4) as figure:
        panels = figure.subplots(2, 3, width_ratios=(1.0, 1.0, 0.9), squeeze=False)
        for column, name in enumerate(TITLES):
            draw_coverage(panels[0, column], numbers[name]["shares"])
            draw_widths(panels[1, column], numbers[name]["shares"])
            panels[0, column].set_title(TITLES[name], fontsize=9)
        draw_wrong(panels[0, 2], numbers)
        draw_ranks(panels[1, 2], numbers["log"]["ranks"])
        panels[0, 0].set_ylabel("share of 90 % intervals\nthat hold the truth")
        panels[1, 0].set_ylabel("median posterior sd\nover that of the prior")
        handles = [
            panels[0, 0].plot([], [], MARKERS[name], color=colour, ms=5, label=name)[0]
            for name, colour in COLOURS.items()
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=5, fontsize=9)


def draw_coverage(panel, shares: dict) -> None:
    """Coverage of 90 % intervals with two standard errors, by disturbance."""
    panel.axhspan(0.87, 0.93, color="#DDDDDD", lw=0)
    for k, name in enumerate(COLOURS):
        places = [(i, r[name]["coverage"][_LEVEL]) for i, r in enumerate(shares.values()) if name in r]
        x = [i + 0.09 * (k - 2) for i, _ in places]
        panel.errorbar(
            x,
            [c["mean"] for _, c in places],
            2.0 * np.array([c["error"] or 0.0 for _, c in places]),
            fmt=MARKERS[name],
            color=COLOURS[name],
            ms=4.5,
            lw=1.0,
        )
    panel.set(ylim=(0.0, 1.03), xlabel="disturbance (share of the hull's force)")
    _name_shares(panel, shares)


def draw_widths(panel, shares: dict) -> None:
    """Median posterior sd over that of the prior."""
    for k, name in enumerate(COLOURS):
        places = [(i + 0.09 * (k - 2), r[name]["sd"]) for i, r in enumerate(shares.values()) if name in r]
        panel.plot(*np.reshape(places, (-1, 2)).T, MARKERS[name], color=COLOURS[name], ms=4.5)
    panel.set(ylim=(0.0, 1.03), xlabel="disturbance (share of the hull's force)")
    _name_shares(panel, shares)


def _name_shares(panel, shares) -> None:
    panel.set_xticks(range(len(shares)), [f"{100 * float(share):g} %" for share in shares])
    panel.grid(axis="x", visible=False)


def draw_wrong(panel, numbers: dict) -> None:
    """Coverage where the forces are of another kind than the fit believes."""
    panel.axhspan(0.87, 0.93, color="#DDDDDD", lw=0)
    wrong = {name: group for name, group in numbers.items() if name not in TITLES}
    for k, name in enumerate(COLOURS):
        for i, group in enumerate(wrong.values()):
            (results,) = group["shares"].values()
            if name in results:
                coverage = results[name]["coverage"][_LEVEL]
                error = 2.0 * (coverage["error"] or 0.0)
                panel.errorbar(
                    i + 0.12 * (k - 2), coverage["mean"], error, fmt=MARKERS[name], color=COLOURS[name], ms=4.5, lw=1.0
                )
    panel.set(ylim=(0.0, 1.03), xlim=(-0.5, len(wrong) - 0.5))
    panel.set_xticks(range(len(wrong)), [name.replace(" ", "\n", 1) for name in wrong], fontsize=8)
    panel.set_title("forces of another kind, and strangers", fontsize=9)
    panel.grid(axis="x", visible=False)


def draw_ranks(panel, ranks: dict) -> None:
    """Histograms of the ranks of the truth, all coefficients and disturbances together."""
    edges = np.linspace(0.0, 1.0, BINS + 1)
    for name, result in ranks.items():
        shares = np.array(result["histogram"]) / np.sum(result["histogram"]) * BINS
        panel.stairs(shares, edges, color=COLOURS[name], lw=1.4)
    panel.axhline(1.0, color=style.TRUTH, lw=0.8)
    panel.set(xlabel="rank of the truth in the posterior", ylabel="density, uniform if right", ylim=(0, None))
    panel.set_title("ranks, sensors as on the left", fontsize=9)
