"""The page of a designed trial: numbers, track and orders, margins, expected sds, and what more would bring."""

import json
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np

from bayesub.findings.designed_trial import SHARES, DesignedTrial, measure_label, numbers
from bayesub.findings.run_numbers import null_changes, percent
from bayesub.io.atomic import write_text, writing
from bayesub.io.words import with_unit
from bayesub.logs import log_files
from bayesub.report.page import ReportFigure, draw_all, fill
from bayesub.report.plots import style
from bayesub.report.plots.coefficients import labels

X, Y, Z = log_files.positions("x", "y", "z")
BEYOND = 50.0  # per cent of a limit beyond it, where the axis ends
_ROW = 0.145  # inches of a coefficient
_LIMIT: dict[str, Any] = {"color": style.SQP, "lw": 1.0, "ls": "--"}


def write(folder: Path, design: DesignedTrial) -> dict:
    """Write ``design.json``, the figures and ``design.html`` into a folder; gives the numbers."""
    content = numbers(design)
    with writing(folder):
        pictures = list(figures(design))
        page = fill(
            "design.html",
            draw_all(pictures, folder),
            titles={figure.name: figure.title for figure in pictures},
            numbers=content,
            out_of_reach=null_changes(design.structural, {c["name"]: c["value"] for c in content["coefficients"]}),
            percent=percent,
            with_unit=with_unit,
        )
        write_text(folder / "design.json", json.dumps(content, indent=1))
        write_text(folder / "design.html", page)
    return content


def figures(design: DesignedTrial) -> Iterator[ReportFigure]:
    """The figures of a :class:`bayesub.findings.designed_trial.DesignedTrial`, in the order of the page."""
    n = len(design.manoeuvres)
    dives = design.judge.vehicle.equations.subproblem(design.judge.subproblem) != "horizontal"
    for k, manoeuvre in enumerate(design.manoeuvres, start=1):
        suffix = "" if n == 1 else f"_{k}"
        yield ReportFigure(
            f"orders{suffix}",
            f"Right, the orders of manoeuvre{suffix}.csv. Left, where the boat goes (blue), and "
            f"{len(design.plan.range.sets) - 1} boats that the prior holds possible (grey)."
            + (" Dashed: the depth band." if dives else ""),
            partial(_draw_manoeuvre, design=design, manoeuvre=manoeuvre),
            title=f"Manoeuvre{suffix.replace('_', ' ')}",
        )
    if any(design.margins):
        yield ReportFigure(
            "margins",
            "How far the boat stays from each limit, as a share of the limit. Blue: the boat of the vehicle file. "
            f"Grey: {len(design.plan.range.sets) - 1} boats that the prior holds possible; those at the right edge are "
            "as far out or further.",
            lambda path: _draw_margins(path, design.margins),
            title="Margins to the limits",
        )
    yield ReportFigure(
        "sds",
        "Expected standard deviation of each coefficient over its size, best known first, before the trial (grey), "
        "after this trial (blue) and after the standard manoeuvre (open circles). Dotted: 5, 10 and 25 %.",
        lambda path: _draw_sds(path, design),
        title="What each coefficient will be known to",
    )
    yield ReportFigure(
        "worth",
        "Left, what is known if the trial ends earlier, and (dashed) if the same is flown again. Right, what is known "
        "without each channel, and with instruments that the boat may not have; the line is the trial as designed.",
        lambda path: _draw_worth(path, design),
        title="What more time and other sensors would bring",
    )
    is_count = hasattr(design.plan.goal, "share")
    cost = f"minus a smooth count of\n{measure_label(design)}" if is_count else "cost of the best"
    cost = "mean log of sd over that before" if design.asked else cost
    yield ReportFigure(
        "search",
        "The best of each family by the number of manoeuvres that were judged so far; the lower the better.",
        lambda path: _draw_search(path, design, cost),
        title="What was searched",
    )


def _draw_manoeuvre(path: style.Paths, design: DesignedTrial, manoeuvre: Any) -> None:
    """The track from above and the depth of all flights that come to their end, and the orders."""
    at, states, whole = design.plan.range.flown(manoeuvre)
    states = np.where(whole[:, None, None], states, np.nan)  # those of the vehicle itself first
    columns = [control.column for control in design.plan.family(design.kind).controls]
    headers = {log_files.HEADERS.get(name, name): name for name in manoeuvre.log}
    change, depth = design.plan.range.limits.depth_change_m, design.judge.vehicle.depth_m
    dives = np.nanmax(np.ptp(states[0][:, Z])) > 1e-6
    beside = 2 * columns if dives and len(columns) == 1 else columns
    above = -(-len(beside) // 2) if dives else len(beside)
    rows: list = [["track" if k < above else "depth", column] for k, column in enumerate(beside)]
    with style.figure(path, 9.0, max(4.4, 1.4 * len(rows))) as figure:
        axes = figure.subplot_mosaic(rows, width_ratios=[1.0, 1.25])
        axis = axes["track"]
        axis.plot(states[1:, :, Y].T, states[1:, :, X].T, color=style.PRIOR, lw=0.6)
        axis.plot(states[0, :, Y], states[0, :, X], color=style.POSTERIOR, lw=1.3)
        style.look_from_above(axis, states[0, 0, [Y, X]])
        axis.set_title("track from above, from the dot; grey: boats of the prior", fontsize=9)
        if dives:
            axis = axes["depth"]
            axis.plot(at, states[1:, :, Z].T, color=style.PRIOR, lw=0.6)
            axis.plot(at, states[0, :, Z], color=style.POSTERIOR, lw=1.3)
            for edge in () if change is None else (depth - change, depth + change):
                axis.axhline(edge, **_LIMIT)
            axis.invert_yaxis()
            axis.set(xlabel="time (s)", ylabel="depth (m)")
        for column, colour in zip(columns, cycle(style.CYCLE), strict=False):
            orders = manoeuvre.log[headers[column]] / log_files.si_factor(column)
            axes[column].plot(manoeuvre.times, orders, color=colour, lw=1.1)
            name, _, unit = with_unit(column).rpartition(" ")
            axes[column].set(ylabel=f"{name}\n{unit}" if name else unit, xlim=(0.0, manoeuvre.times[-1]))
            axes[column].tick_params(labelbottom=column == columns[-1])
        axes[columns[-1]].set_xlabel("time (s)")


def _draw_sds(path: style.Paths, design: DesignedTrial) -> None:
    """Expected sd of each coefficient over its size, per cent, best known first, in two columns."""
    standard, after = design.after_standard, design.after.relative_sd
    known = [design.before.relative_sd, after, *([] if standard is None else [standard.relative_sd])]
    order, n_rows = np.argsort(after, kind="stable"), -(-len(after) // 2)
    per_cent = 100.0 * np.where(np.isfinite(known), known, np.nan)[:, order]  # what is zero has none
    names = labels([design.after.names[k] for k in order], design.judge.vehicle.equations)
    low, high = 0.7 * np.nanmin(per_cent), 1.5 * np.nanmax(per_cent)
    with style.figure(path, 9.0, max(2.6, 1.0 + _ROW * n_rows)) as figure:
        panels = figure.subplots(1, 2 if len(names) > 1 else 1, sharex=True, squeeze=False)[0]
        for k, panel in enumerate(panels):
            part = slice(k * n_rows, (k + 1) * n_rows)
            prior, sds, *flown = per_cent[:, part]
            places = np.arange(len(sds))
            panel.hlines(places, sds, prior, color=style.PRIOR, lw=2.0)
            panel.plot(prior, places, "|", color="#808080", ms=6, mew=1.4, label="before the trial")
            for one in flown:
                panel.plot(one, places, "o", color=style.WEAK, ms=3.6, mfc="none", label="after the standard manoeuvre")
            panel.plot(sds, places, "o", color=style.POSTERIOR, ms=3.8, label="after this trial")
            for share in SHARES:
                panel.axvline(100.0 * share, color=style.TRUTH, lw=0.6, ls=":")
            ticks = [t for t in (0.01, 0.1, 1.0, 5.0, 10.0, 25.0, 100.0) if low <= t <= high]
            panel.set(xscale="log", xlim=(low, high), xticks=ticks, xticklabels=[f"{t:g}" for t in ticks])
            panel.minorticks_off()
            style.show_rows(panel, names[part], n_rows, fontsize=7.5)
            panel.set_xlabel("expected sd (% of the value)")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=8)


def _draw_margins(path: style.Paths, margins: Sequence[Sequence]) -> None:
    """How far each flight stays from each limit, in per cent of it: the margins of each manoeuvre."""
    rows = [(k, margin) for k, of_one in enumerate(margins) for margin in of_one]
    with style.figure(path, 9.0, 1.0 + 0.3 * len(rows)) as figure:
        axis = figure.subplots()
        lowest = max(min([-110.0, *(100.0 * m.excess[0] - 10.0 for _, m in rows)]), -160.0)
        for place, (_, margin) in enumerate(rows):
            excess = np.clip(100.0 * margin.excess, lowest + 3.0, BEYOND - 3.0)
            axis.plot(excess[1:], np.full(len(excess) - 1, place), "|", color="#808080", ms=9, mew=0.8)
            axis.plot(excess[0], place, "o", color=style.POSTERIOR, ms=6)
        axis.axvline(0.0, **_LIMIT)
        axis.axvspan(0.0, BEYOND, color=style.SQP, alpha=0.12, lw=0)
        axis.set(xlim=(lowest, BEYOND), xlabel="beyond the limit (% of it; negative: within)")
        several = len(margins) > 1
        style.show_rows(axis, [f"{f'{k + 1}: ' * several}{with_unit(m.key)}: {m.limit:.4g}" for k, m in rows])


def _draw_search(path: style.Paths, design: DesignedTrial, cost: str) -> None:
    """The least cost of each family by the manoeuvres judged so far; `cost` says what it is."""
    with style.figure(path, 9.0, 2.9) as figure:
        axis = figure.subplots()
        for (kind, found), colour in zip(design.searches.items(), cycle(style.CYCLE), strict=False):
            judged = found.n_judgements // max(1, len(found.best)) * np.arange(1, len(found.best) + 1)
            flown = found.best < 1e3  # what no boat flies has no place on the axis
            axis.plot(judged[flown], found.best[flown], color=colour, label=kind)
        axis.set(xlabel="manoeuvres judged", ylabel=cost, xscale="log")
        axis.legend(fontsize=8)


def _draw_worth(path: style.Paths, design: DesignedTrial) -> None:
    """What more time and each sensor bring."""
    minutes, label = np.array(list(design.minutes)), measure_label(design)
    once = [design.measure(information) for information in design.minutes.values()]
    again = [design.measure(design.after + information) for information in design.minutes.values()]
    sensors = [design.measure(information) for information in design.sensors.values()]
    with style.figure(path, 9.0, max(2.8, 1.0 + 0.24 * len(sensors))) as figure:
        left, right = figure.subplots(1, 2, width_ratios=[1.0, 1.1])
        left.plot(minutes, once, "o-", color=style.POSTERIOR, ms=4, label="as designed")
        left.plot(minutes.max() + minutes, again, "--", color=style.POSTERIOR, label="the same again")
        left.set(xlabel="length of the trial (min)", ylabel=label, ylim=(0.0, None))
        left.legend(loc="lower right", fontsize=8)
        colours = [style.PRIOR if name.startswith("without") else style.READINGS for name in design.sensors]
        right.barh(range(len(sensors)), sensors, color=colours, height=0.65)
        right.axvline(design.measure(design.after), color=style.TRUTH, lw=1.0)
        style.show_rows(right, [style.plain(name) for name in design.sensors], fontsize=8)
        right.set_xlabel(label)
