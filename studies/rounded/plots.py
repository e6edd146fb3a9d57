"""Coverage, error and width of intervals by how the rounding of readings is treated, and when it matters."""

from itertools import groupby

import numpy as np

from bayesub.report.plots import style

WORDS = {"rounded": "rounding interval", "normal": "normal noise", "linear": "linear least squares"}
_COLOURS = {"rounded": style.POSTERIOR, "normal": style.SQP, "linear": style.LINEAR}
_LINES = (style.POSTERIOR, style.LINEAR, style.WEAK, style.NULL)
_DECADES, _SIZES = (0.1, 1, 10), (1, 2, 5, 10)


def draw_cases(path, cases) -> None:
    """Coverage, root mean square error and width of every coefficient, a group of columns a case.

    Parameters
    ----------
    cases : name -> fits -> a key of WORDS -> names, coverage_95, rms_in_sd and sd_over_truth (n,)
    """
    with style.figure(path, 9.0, 7.6) as figure:
        coverage, error, width = figure.subplots(3, 1, sharex=True)
        for n, case in enumerate(cases.values()):
            for offset, (fit, colour) in zip((-0.26, 0.0, 0.26), _COLOURS.items(), strict=True):
                r = case["fits"][fit]
                quantities = (100 * np.array(r["coverage_95"]), np.array(r["rms_in_sd"]), np.array(r["sd_over_truth"]))
                for panel, values in zip((coverage, error, width), quantities, strict=True):
                    x = n + offset + np.linspace(-0.09, 0.09, len(values))
                    panel.plot(x, values, ".", ms=2.5, color=colour, alpha=0.7, label=WORDS[fit] if n == 0 else None)
                    panel.plot(n + offset, np.median(values), "_", ms=11, mew=2, color=style.TRUTH)
        coverage.plot([], [], "_", ms=4, mew=1, color=style.TRUTH, label="median")
        coverage.axhline(95, color=style.TRUTH, lw=0.8)
        coverage.set(ylabel="95 % intervals that\nhold the truth (%)", ylim=(-3, 104))
        error.axhline(1, color=style.TRUTH, lw=0.8)
        error.set(ylabel="root mean square error\n(stated sd)", yscale="log")
        width.set(ylabel="stated sd over truth", yscale="log")
        words = {"random:0": "random", "horizontal": "spiral", "thesis_rounding": "thesis"}
        parts = [[words.get(part, part) for part in name.split(", ")] for name in cases]
        width.set_xticks(range(len(cases)), [rounding for *_, rounding in parts], fontsize=8)
        below = {"transform": width.get_xaxis_transform(), "clip_on": False}
        for depth, word in ((0.035, "rounded as"), (0.16, "manoeuvre"), (0.28, "boat")):
            width.text(-0.7, -depth, word, ha="right", va="top", fontsize=8, **below)
        for depth, k in ((0.16, 1), (0.28, 0)):  # what neighbours have in common is written once below them
            groups = [list(members) for _, members in groupby(range(len(parts)), key=lambda n: parts[n][: k + 1])]
            for group in groups:
                middle = 0.5 * (group[0] + group[-1])
                width.plot([group[0] - 0.4, group[-1] + 0.4], [-depth + 0.03] * 2, color=style.TRUTH, lw=0.6, **below)
                width.text(middle, -depth, parts[group[0]][k], ha="center", va="top", fontsize=8, **below)
        for panel in (coverage, error, width):
            panel.grid(axis="x", visible=False)
            panel.set_xlim(-0.6, len(cases) - 0.4)
        figure.legend(*coverage.get_legend_handles_labels(), loc="outside upper center", ncols=4, markerscale=4)


def draw_grid(path, grid) -> None:
    """Coverage, error and width against the step over the noise sd, one colour a sampling interval.

    Parameters
    ----------
    grid : list of ratio, interval_s, largest_width_ratio, and for "rounded" and "normal" mean_coverage_95 (mean,
        standard error) and joint
    """
    intervals = sorted({cell["interval_s"] for cell in grid})
    with style.figure(path, 9.0, 3.9) as figure:
        coverage, joint, width = figure.subplots(1, 3)
        for interval, colour in zip(intervals, _LINES, strict=False):
            cells = sorted((c for c in grid if c["interval_s"] == interval), key=lambda c: c["ratio"])
            ratios = [c["ratio"] for c in cells]
            for fit, line in (("rounded", "-"), ("normal", "--")):
                mean, error = 100 * np.array([c[fit]["mean_coverage_95"] for c in cells]).T
                label = f"every {interval:g} s, {WORDS[fit]}"
                coverage.errorbar(ratios, mean, error, fmt=line, marker="o", ms=3, lw=1.2, color=colour, label=label)
                joint.loglog(ratios, [c[fit]["joint"] for c in cells], line, marker="o", ms=3, lw=1.2, color=colour)
            width.loglog(ratios, [c["largest_width_ratio"] for c in cells], marker="o", ms=3, lw=1.2, color=colour)
        coverage.set(ylabel="95 % intervals that hold the truth (%)", xscale="log")
        coverage.axhline(95, color=style.TRUTH, lw=0.8)
        joint.set_ylabel("squared error over stated variance,\nall directions")
        joint.axhline(1, color=style.TRUTH, lw=0.8)
        width.set_ylabel("sd, normal noise over rounding\ninterval, widest direction")
        width.axhline(1, color=style.TRUTH, lw=0.8)
        for panel in (coverage, joint, width):
            panel.set_xlabel("rounding step over noise sd")
            panel.set_xticks(_DECADES, _DECADES)
        for panel in (joint, width):
            panel.set_yticks(_SIZES, _SIZES)
            panel.minorticks_off()
        figure.legend(*coverage.get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=7.5)
