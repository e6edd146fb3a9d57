"""Uniqueness, spectra and predictions of several equation sets side by side."""

import numpy as np

from bayesub.report.plots import style

COLOURS = {"booth": style.POSTERIOR, "remus": style.SQP, "abkowitz": style.NULL, "feldman": style.LINEAR}
LIGHT = ("#FFFFFF", "#F2F2F2", "#E3E3E3", "#D2D2D2", "#C0C0C0", "#AEAEAE")  # 0 to 5 null dimensions
WORDS = {"horizontal": "spiral", "zigzag_20_20": "zigzag", "vertical": "vertical", "coupled": "coupled"}
SHOWN = "horizontal"  # manoeuvre of the spectra


def draw(path, cases: dict, fits: dict) -> None:
    """Null dimensions by axis, spectra of the horizontal spiral, and errors on unseen manoeuvres.

    Parameters
    ----------
    path : one file or several
    cases, fits : of the numbers of the study
    """
    with style.figure(path, 11.0, 4.4) as figure:
        left, middle, right = figure.subplots(1, 3, width_ratios=(1.25, 1.0, 1.0))
        draw_null(left, list(cases.values()))
        draw_spectra(middle, [r for r in cases.values() if r["manoeuvre"] == SHOWN])
        draw_errors(right, list(fits.values()))


def draw_null(panel, cases: list[dict]) -> None:
    """A table of vehicles and manoeuvres: null dimensions of each axis that has any."""
    vehicles = {r["vehicle"]: r["equations"] for r in cases}
    manoeuvres = [m for m in WORDS if any(r["manoeuvre"] == m for r in cases)]
    present = {(r["vehicle"], r["manoeuvre"]) for r in cases}
    for i, j in np.argwhere([[(v, m) not in present for m in manoeuvres] for v in vehicles]):
        panel.text(j + 0.5, i + 0.5, "not in\nthe set", ha="center", va="center", fontsize=7, color="#777777")
    for r in cases:
        i, j = list(vehicles).index(r["vehicle"]), manoeuvres.index(r["manoeuvre"])
        by_axis = {axis: one["motion"] + one["terms"] for axis, one in r["axes"].items()}
        total = sum(by_axis.values())
        colour = LIGHT[min(total, len(LIGHT) - 1)]
        panel.fill([j, j + 1, j + 1, j], [i, i, i + 1, i + 1], facecolor=colour, edgecolor="white", lw=1.5)
        text = "  ".join(f"{axis}{n}" for axis, n in by_axis.items() if n) or "none"
        panel.text(j + 0.5, i + 0.5, text, ha="center", va="center", fontsize=8)
    panel.set(xlim=(0, len(manoeuvres)), ylim=(len(vehicles), 0), title="null directions of each axis")
    panel.title.set_fontsize(9)
    panel.set_xticks(np.arange(len(manoeuvres)) + 0.5, [WORDS[m] for m in manoeuvres])
    panel.set_yticks(np.arange(len(vehicles)) + 0.5, [f"{v}\n{name}" for v, name in vehicles.items()], fontsize=8)
    for label, name in zip(panel.get_yticklabels(), vehicles.values(), strict=True):
        label.set_color(COLOURS[name])
    panel.tick_params(length=0)
    panel.grid(visible=False)
    panel.spines[:].set_visible(False)


def draw_spectra(panel, cases: list[dict]) -> None:
    """Singular values of the horizontal spiral, the first vehicle of each set."""
    first = {r["equations"]: r for r in reversed(cases)}
    for k, (name, r) in enumerate(sorted(first.items(), key=lambda item: list(COLOURS).index(item[0]))):
        s, colour = r["spectra"]["track"], COLOURS[name]
        places = np.arange(1, len(s["singular_values"]) + 1)
        panel.semilogy(places, s["singular_values"], ".-", ms=4, lw=1.0, color=colour)
        text = f"{name}, {r['vehicle']}\n{s['n_params']} free, {s['n_null']} null"
        panel.text(
            0.99, 0.98 - 0.11 * k, text, transform=panel.transAxes, ha="right", va="top", color=colour, fontsize=8
        )
    panel.axhline(1.0, color=style.TRUTH, lw=0.8)
    panel.text(0.99, 1.3, "no better than the prior", ha="right", fontsize=8, transform=panel.get_yaxis_transform())
    panel.set(xlabel="direction, best known first", ylabel="singular value, prior sd over that of the data")
    panel.set_title("spectra of a track, horizontal spiral", fontsize=9)


def draw_errors(panel, fits: list[dict]) -> None:
    """Errors of the posterior mean on each unseen manoeuvre, beside those of the guess, and coverage."""
    for k, f in enumerate(fits):
        colour, p = COLOURS[f["equations"]], f["predictions"]
        panel.semilogx(p["guess_lengths"], np.full(len(p["guess_lengths"]), k - 0.15), "|", color="#888888", ms=7)
        fill = {} if f["check"]["fits"] else {"mfc": "none"}
        panel.semilogx(
            p["posterior_lengths"], np.full(len(p["posterior_lengths"]), k + 0.15), "o", color=colour, ms=4, **fill
        )
        panel.text(
            1.02,
            k,
            f"{100 * p['coverage']['0.9']:.0f} %",
            transform=panel.get_yaxis_transform(),
            va="center",
            fontsize=8,
        )
    panel.text(1.02, 1.0, "in 90 %\nbands", transform=panel.transAxes, va="bottom", fontsize=8)
    panel.set_title("predictions by fits of the spiral", fontsize=9)
    panel.set_yticks(range(len(fits)), [f"{f['vehicle']}\nby {f['equations']}" for f in fits], fontsize=8)
    for label, f in zip(panel.get_yticklabels(), fits, strict=True):
        label.set_color(COLOURS[f["equations"]])
    panel.set_ylim(len(fits) - 0.4, -0.6)
    panel.set_xlabel("error on unseen manoeuvres (ship lengths)")
    panel.plot([], [], "|", color="#888888", ms=7, label="guess")
    panel.plot([], [], "o", color=style.TRUTH, ms=4, label="posterior mean")
    panel.plot([], [], "o", color=style.TRUTH, ms=4, mfc="none", label="that the check rejects")
    panel.legend(
        fontsize=7, loc="upper center", bbox_to_anchor=(0.4, -0.14), ncols=3, columnspacing=0.8, handletextpad=0.2
    )
    panel.grid(axis="y", visible=False)
