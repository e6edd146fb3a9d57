"""Quantities that follow from the coefficients, the spiral curve, and roots of small motions: prior and posterior."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from bayesub.findings.derived import Derived, in_words, numbers
from bayesub.report.plots import style

BAND = [0.05, 0.5, 0.95]
_BEYOND = 0.35  # of the prior's interval, shown on either side of it
_NARROW = 0.015  # of the prior's interval: 50 % of the posterior that are a dot
_FOUND = 0.95  # share of the boats that have a steady turn at a rate, where a band is drawn
_PLANES = {"horizontal": "sway and yaw", "vertical": "heave and pitch"}


def draw(path: style.Paths, boats: Derived, word: str) -> None:
    """Intervals above, a row a quantity, each from 5 to 95 % of the prior; below them the spiral curve and roots.

    `word`: what the reference is.
    """
    rows = [row for row in numbers(boats)["quantities"] if row["width_ratio"] is not None]
    spiral, roots = boats.spiral, boats.roots
    panels = ([] if spiral is None else ["spiral"]) + list(roots)
    heights = [0.26 * len(rows) + 0.5] * bool(rows) + [2.7] * bool(panels)
    with style.figure(path, 8.6, sum(heights) + 0.45) as figure:
        parts = figure.subfigures(len(heights), 1, squeeze=False, height_ratios=heights)[:, 0]
        panel: Any = None  # whose legend is that of the figure
        if rows:
            panel = parts[0].subplots()
            _intervals(panel, rows, word)
        if panels:
            for axis, name in zip(parts[-1].subplots(1, len(panels), squeeze=False)[0], panels, strict=True):
                if name == "spiral" and spiral is not None:
                    _spiral(axis, *spiral)
                else:
                    _roots(axis, roots[name], f"roots of {_PLANES[name]}")
                panel = panel or axis
        figure.legend(*panel.get_legend_handles_labels(), loc="outside upper center", ncols=4, fontsize=8.5)


def _intervals(panel, rows, word) -> None:
    """Each row on a scale of its own, on which the prior's 90 % go from zero to one."""
    for y, row in enumerate(rows):
        low, width = row["prior"]["q5"], row["prior"]["q95"] - row["prior"]["q5"]
        q5, q25, median, q75, q95 = ((row["posterior"][q] - low) / width for q in ("q5", "q25", "median", "q75", "q95"))
        named = {} if y else {"bar": "prior, 90 %", "line": "posterior, 90 %", "core": "posterior, 50 %", "tick": word}
        panel.barh(y, 1.0, 0.8, color=style.PRIOR, alpha=0.55, label=named.get("bar"))
        if row["reference"] is not None:
            place = (row["reference"] - low) / width
            panel.plot(place, y, "|", color=style.TRUTH, ms=12, mew=1.0, label=named.get("tick"), zorder=2)
        panel.hlines(y, q5, q95, color=style.POSTERIOR, lw=1.5, label=named.get("line"), zorder=3)
        panel.hlines(y, q25, q75, color=style.POSTERIOR, lw=5.0, label=named.get("core"), zorder=3)
        narrow, shown = q75 - q25 < _NARROW, np.clip(median, -_BEYOND, 1.0 + _BEYOND)
        if shown != median:
            panel.plot(shown, y, "<" if median < 0.0 else ">", ms=6, mew=0, color=style.POSTERIOR, clip_on=False)
        else:
            look = {"ms": 5, "mew": 0, "color": style.POSTERIOR} if narrow else {"ms": 7, "color": "white"}
            panel.plot(median, y, "o" if narrow else "|", zorder=4, **look)
    panel.set(xlim=(-_BEYOND, 1.0 + _BEYOND), xticks=[0.0, 1.0], xticklabels=["5 % of the prior", "95 % of the prior"])
    style.show_rows(panel, [row["label"] for row in rows])
    ends = [[" to ".join(in_words(row[of]["q5"], row[of]["q95"])) for of in ("posterior", "prior")] for row in rows]
    words = [f"{after}  (before {before})" for after, before in ends]
    style.write_beside(panel, range(len(rows)), words, "90 % of the posterior")


def _spiral(panel, rates, curves) -> None:
    """The rudder that holds each rate of turn."""
    rates = np.degrees(rates)
    for name, colour, alpha in (("prior", style.PRIOR, 0.55), ("posterior", style.POSTERIOR, 0.6)):
        curve = np.degrees(curves[name])
        whole = np.isfinite(curve).mean(axis=0) > _FOUND
        if not whole.any():
            continue
        low, _, high = np.nanquantile(curve[:, whole], BAND, axis=0)
        edge = 1.5 if name == "posterior" else 0.0  # a narrow band is seen
        panel.fill_betweenx(rates[whole], low, high, color=colour, alpha=alpha, lw=edge, label=f"{name}, 90 %")
    panel.plot(np.degrees(curves["reference"][0]), rates, "--", color=style.TRUTH, lw=0.9)
    panel.set(xlabel="rudder (deg)", ylabel="rate of turn (deg/s)")
    panel.set_title("spiral curve", fontsize=9)


def _roots(panel, roots, title) -> None:
    """Roots in the complex plane, of a pair the one above the axis; on two lines if all are real."""
    real = all(np.all(np.nan_to_num(found.imag) == 0.0) for found in roots.values())
    for line, (name, colour) in enumerate({"prior": "#8C8C8C", "posterior": style.POSTERIOR}.items()):
        found = roots[name][np.isfinite(roots[name])]
        found = found[found.imag >= 0.0]
        y = np.full(len(found), -float(line)) if real else found.imag
        panel.plot(found.real, y, "|" if real else ".", ms=9 if real else 3.5, mew=0.6 if real else 0, color=colour)
    truth = roots["reference"]
    panel.plot(truth.real, np.full(truth.shape, -0.5) if real else np.abs(truth.imag), "+", color=style.TRUTH, ms=9)
    panel.axvline(0.0, color=style.TRUTH, lw=0.7, ls=":")
    panel.set_xlabel("real part (1/s)")
    panel.set_title(title, fontsize=9)
    if real:
        panel.set(yticks=[0.0, -1.0], yticklabels=["prior", "posterior"], ylim=(-1.7, 0.7))
        panel.grid(axis="y", visible=False)
    else:
        panel.set_ylabel("imaginary part (1/s)")


def draw_ways(path: style.Paths, prescription: Mapping[str, Mapping[str, Any]]) -> None:
    """What each way to go on leaves of the sd of what is asked for; of its numbers in ``numbers.json``."""
    ways = list(reversed(next(iter(prescription.values()))["after"]))
    with style.figure(path, 7.2, 1.1 + 0.34 * len(ways)) as figure:
        every = figure.subplots(1, len(prescription), sharey=True, squeeze=False)[0]
        for axis, (name, one) in zip(every, prescription.items(), strict=True):
            left = [100.0 * one["after"][way] / one["sd"] for way in ways]
            axis.barh(ways, left, color=style.POSTERIOR, height=0.55)
            for row, percent in enumerate(left):
                inside = percent > 50.0
                axis.annotate(
                    f"{percent:.0f}", (percent, row), (-3 if inside else 3, 0), textcoords="offset points",
                    ha="right" if inside else "left", va="center", fontsize=8, color="white" if inside else "black",
                )  # fmt: skip
            unit = f" {one['unit']}" if one["unit"] else ""
            axis.set_title(f"{name}\nsd {one['sd']:.2g}{unit}", fontsize=9)
            axis.set(xlim=(0.0, 100.0), xticks=[0, 50, 100])
            axis.tick_params(axis="y", length=0)
        figure.supxlabel("per cent of the sd of now that would be left", fontsize=9)
