"""Coefficients that least squares finds in rounded data (thesis Figures 97 to 99), and what their intervals hold."""

import numpy as np

from bayesub.report.plots import style
from thesis.plots.labels import labels

_ROW = 30  # coefficients of a row, whose labels are read at the width of a page
_LIMIT = 2.0  # ratios beyond 1 +- this are drawn at the edge
_COLOURS = (style.POSTERIOR, style.SQP, style.LINEAR, style.NULL, style.WEAK)


def draw_ratios(path, names, truth, errors) -> None:
    """Ratio to the truth of every coefficient that is not zero, one dot a manoeuvre, forces above moments.

    Parameters
    ----------
    names : (n,) of the coefficients
    truth : (n,)
    errors : (n_manoeuvres, n) estimate less truth
    """
    names, truth = np.array(names), np.array(truth)
    rows = []
    for axes in ("XYZ", "KMN"):
        some = np.flatnonzero(np.array([name[0] in axes for name in names]) & (truth != 0))
        rows += np.array_split(some, -(-len(some) // _ROW))
    with style.figure(path, 8.0, 2.2 * len(rows) + 0.4) as figure:
        panels = figure.subplots(len(rows), 1)
        for panel, chosen in zip(panels, rows, strict=True):
            ratios = errors[:, chosen] / truth[chosen]
            columns = np.arange(len(chosen))
            spread = np.linspace(-0.3, 0.3, len(ratios))[:, None]
            inside = np.abs(ratios) <= _LIMIT
            x = np.broadcast_to(columns + spread, ratios.shape)
            panel.plot(x[inside], 1 + ratios[inside], ".", ms=2.0, color=style.POSTERIOR, label="one manoeuvre")
            x, beyond = x[~inside], 1 + _LIMIT * np.sign(ratios[~inside])
            panel.plot(x, beyond, "|", ms=6, color=style.SQP, label="beyond the scale", clip_on=False)
            means = np.clip(1 + ratios.mean(axis=0), 1 - _LIMIT, 1 + _LIMIT)
            panel.plot(columns, means, "_", ms=9, mew=2, color=style.TRUTH, label="mean")
            panel.axhline(1.0, color=style.TRUTH, lw=0.7)
            panel.set_xticks(columns, labels(names[chosen]), rotation=70, ha="right", rotation_mode="anchor")
            panel.set(ylabel="ratio to truth", xlim=(-0.8, max(map(len, rows)) - 0.2))
            panel.set_ylim(1 - _LIMIT, 1 + _LIMIT)
            panel.grid(axis="x", visible=False)
        panels[0].legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, fontsize=8, markerscale=1.5)


def draw_coverage(path, cases) -> None:
    """Coverage of classical 95 % intervals and bias, coefficients in order of each, one line a case.

    Parameters
    ----------
    cases : case -> fits -> "rounded" and "rounded load only" -> coverage (n,) and bias_over_spread (n,)
    """
    with style.figure(path, 9.0, 4.0) as figure:
        rows = figure.subplots(2, len(cases), sharex=True, sharey="row", squeeze=False)
        for (name, case), (coverage, bias) in zip(cases.items(), rows.T, strict=True):
            for fit, colour, line in (("rounded", style.SQP, "-"), ("rounded load only", style.POSTERIOR, "--")):
                result = case["fits"][fit]
                place = np.linspace(0, 100, len(result["coverage"]))
                word = "matrix rounded too" if fit == "rounded" else "matrix exact"
                coverage.plot(place, 100 * np.sort(result["coverage"]), line, color=colour, label=word)
                bias.plot(place, np.sort(np.abs(result["bias_over_spread"])), line, color=colour)
            coverage.axhline(95, color=style.TRUTH, lw=0.8)
            coverage.set_title(name, fontsize=9)
            coverage.set_ylim(-2, 105)
            bias.set_yscale("symlog", linthresh=0.1)
            bias.set_ylim(bottom=0)
        rows[0, 0].set_ylabel("95 % intervals that\nhold the truth (%)")
        rows[1, 0].set_ylabel("|mean error| over spread")
        figure.supxlabel("coefficients in order (%)", fontsize=9)
        figure.legend(*rows[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=2, fontsize=8)


def draw_tracks(path, cases) -> None:
    """Largest position error with which each identified set reproduces the manoeuvre it was identified from.

    Parameters
    ----------
    cases : case -> position_m (n_manoeuvres,), None where the simulation fails
    """
    with style.figure(path, 6.5, 3.8) as figure:
        panel = figure.subplots()
        for (name, case), colour in zip(cases.items(), _COLOURS, strict=False):
            errors = np.sort([p for p in case["position_m"] if p is not None])
            share = 100 * np.arange(1, len(errors) + 1) / len(case["position_m"])
            panel.semilogx(errors, share, drawstyle="steps-post", color=colour, label=name)
        panel.set(xlabel="largest position error on the manoeuvre itself (m)", ylabel="manoeuvres (%)", ylim=(0, 102))
        panel.legend(loc="upper left", fontsize=8)
