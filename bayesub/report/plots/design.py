"""A designed trial: orders and track, margins to the limits, expected standard deviations, what more would bring."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np

from bayesub.io.words import with_unit
from bayesub.logs import log_files
from bayesub.logs.log_files import positions
from bayesub.report.plots import style
from bayesub.report.plots.style import Paths

X, Y, Z = positions("x", "y", "z")
BEYOND = 50.0  # per cent of a limit beyond it, where the axis ends
_ROW = 0.145  # inches of a coefficient
_LIMIT: dict[str, Any] = {"color": style.SQP, "lw": 1.0, "ls": "--"}


def draw_manoeuvre(
    path: Paths,
    times: np.ndarray,
    orders: Mapping[str, np.ndarray],
    flights: tuple[np.ndarray, np.ndarray],
    band: tuple[float, float] | None = None,
) -> None:
    """The track from above and the depth of all flights, and the orders.

    `times`: (n,) of the orders, s; `orders`: column of a log -> (n,) what is ordered, in its unit; `flights`: times
    (n_times,) and states (n_flights, n_times, 12), those of the vehicle itself first; not a number where a flight
    ended; `band`: depths between which the boat must stay, m.
    """
    at, states = flights
    columns = list(orders)
    dives = np.nanmax(np.ptp(states[0][:, Z])) > 1e-6
    rows: list = [["track", column] for column in columns]
    if dives and len(columns) == 1:
        rows = [["track", columns[0]], ["depth", columns[0]]]
    elif dives:
        above = -(-len(columns) // 2)
        rows = [["track" if k < above else "depth", column] for k, column in enumerate(columns)]
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
            for depth in band or ():
                axis.axhline(depth, **_LIMIT)
            axis.invert_yaxis()
            axis.set(xlabel="time (s)", ylabel="depth (m)")
        for column, colour in zip(columns, cycle(style.CYCLE), strict=False):
            axes[column].plot(times, orders[column], color=colour, lw=1.1)
            name, _, unit = with_unit(column).rpartition(" ")
            axes[column].set_ylabel(f"{name}\n{unit}" if name else unit)
            axes[column].set_xlim(0.0, times[-1])
            axes[column].tick_params(labelbottom=column == columns[-1])
        axes[columns[-1]].set_xlabel("time (s)")


def draw_sds(
    path: Paths,
    labels: Sequence[str],
    before: np.ndarray,
    standard: np.ndarray | None,
    after: np.ndarray,
    shares: Sequence[float],
) -> None:
    """Expected sd of each coefficient over its size, per cent, best known first, in two columns.

    `labels`: of the n coefficients; `before` and `standard` and `after`: (n,) relative sds before the trial, after the
    standard manoeuvre if it is flown, and after the trial; `shares`: of a value, where lines are drawn.
    """
    order, n_rows = np.argsort(after, kind="stable"), -(-len(labels) // 2)
    per_cent: list[Any] = [None if sds is None else 100.0 * np.asarray(sds)[order] for sds in (before, standard, after)]
    finite = np.concatenate([sds for sds in per_cent if sds is not None])
    low, high = finite.min(), finite.max()
    with style.figure(path, 9.0, max(2.6, 1.0 + _ROW * n_rows)) as figure:
        panels = figure.subplots(1, 2 if len(labels) > 1 else 1, sharex=True, squeeze=False)[0]
        for k, panel in enumerate(panels):
            part = slice(k * n_rows, (k + 1) * n_rows)
            prior, flown, sds = [None if values is None else values[part] for values in per_cent]
            places = np.arange(len(sds))  # type: ignore[arg-type]  # the sds after the trial are there
            panel.hlines(places, sds, prior, color=style.PRIOR, lw=2.0)
            panel.plot(prior, places, "|", color="#808080", ms=6, mew=1.4, label="before the trial")
            if flown is not None:
                look = {"color": style.WEAK, "ms": 3.6, "mfc": "none"}
                panel.plot(flown, places, "o", **look, label="after the standard manoeuvre")
            panel.plot(sds, places, "o", color=style.POSTERIOR, ms=3.8, label="after this trial")
            for share in shares:
                panel.axvline(100.0 * share, color=style.TRUTH, lw=0.6, ls=":")
            panel.set_xscale("log")
            panel.set_xlim(0.7 * low, 1.5 * high)
            ticks = [t for t in (0.01, 0.1, 1.0, 5.0, 10.0, 25.0, 100.0) if 0.7 * low <= t <= 1.5 * high]
            panel.set_xticks(ticks, [f"{t:g}" for t in ticks])
            panel.minorticks_off()
            panel.set_yticks(places, [labels[j] for j in order[part]], fontsize=7.5)
            panel.set_ylim(n_rows - 0.4, -0.6)
            panel.grid(axis="y", visible=False)
            panel.set_xlabel("expected sd (% of the value)")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=8)


def draw_margins(path: Paths, margins: Sequence[Sequence]) -> None:
    """How far each flight stays from each limit, in per cent of it: the margins of each manoeuvre."""
    rows = [(k, margin) for k, of_one in enumerate(margins) for margin in of_one]
    with style.figure(path, 9.0, 1.0 + 0.3 * len(rows)) as figure:
        axis = figure.subplots()
        lowest = min(-110.0, *(100.0 * m.excess[0] - 10.0 for _, m in rows)) if rows else -110.0
        lowest = max(lowest, -160.0)
        for place, (_, margin) in enumerate(rows):
            excess = np.clip(100.0 * margin.excess, lowest + 3.0, BEYOND - 3.0)
            axis.plot(excess[1:], np.full(len(excess) - 1, place), "|", color="#808080", ms=9, mew=0.8)
            axis.plot(excess[0], place, "o", color=style.POSTERIOR, ms=6)
        axis.axvline(0.0, **_LIMIT)
        axis.axvspan(0.0, BEYOND, color=style.SQP, alpha=0.12, lw=0)
        axis.set_xlim(lowest, BEYOND)
        names = [f"{with_unit(margin.key)}: {margin.limit:.4g}" for _, margin in rows]
        if len(margins) > 1:
            names = [f"{k + 1}: {name}" for (k, _), name in zip(rows, names, strict=True)]
        axis.set_yticks(range(len(rows)), names)
        axis.set_ylim(len(rows) - 0.4, -0.6)
        axis.grid(axis="y", visible=False)
        axis.set_xlabel("beyond the limit (% of it; negative: within)")


def draw_search(path: Paths, best: Mapping[str, np.ndarray], per_generation: Mapping[str, int], cost: str) -> None:
    """The least cost of each family (n_generations,) by the manoeuvres judged so far; `cost` says what it is."""
    with style.figure(path, 9.0, 2.9) as figure:
        axis = figure.subplots()
        for (kind, costs), colour in zip(best.items(), cycle(style.CYCLE), strict=False):
            judged = per_generation[kind] * np.arange(1, len(costs) + 1)
            flown = costs < 1e3  # what no boat flies has no place on the axis
            axis.plot(judged[flown], costs[flown], color=colour, label=kind)
        axis.set(xlabel="manoeuvres judged", ylabel=cost)
        axis.set_xscale("log")
        axis.legend(fontsize=8)


def draw_worth(
    path: Paths,
    minutes: Mapping[float, float],
    again: Mapping[float, float],
    sensors: Mapping[str, float],
    now: float,
    label: str,
) -> None:
    """What more time and each sensor bring.

    `minutes` and `again`: length of the trial, min -> the measure; of the trial, and if it is flown a second time;
    `sensors`: what is changed -> the measure with it; `now`: the measure of the design; `label`: what is measured.
    """
    with style.figure(path, 9.0, max(2.8, 1.0 + 0.24 * len(sensors))) as figure:
        left, right = figure.subplots(1, 2, width_ratios=[1.0, 1.1])
        left.plot(list(minutes), list(minutes.values()), "o-", color=style.POSTERIOR, ms=4, label="as designed")
        left.plot(list(again), list(again.values()), "--", color=style.POSTERIOR, label="the same again")
        left.set(xlabel="length of the trial (min)", ylabel=label)
        left.set_ylim(bottom=0.0)
        left.legend(loc="lower right", fontsize=8)
        places = np.arange(len(sensors))
        colours = [style.PRIOR if name.startswith("without") else style.READINGS for name in sensors]
        right.barh(places, list(sensors.values()), color=colours, height=0.65)
        right.axvline(now, color=style.TRUTH, lw=1.0)
        right.set_yticks(places, [style.plain(name) for name in sensors], fontsize=8)
        right.set_ylim(len(sensors) - 0.4, -0.6)
        right.grid(axis="y", visible=False)
        right.set_xlabel(label)


def in_units(log: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Column -> history in its unit, of short names -> histories in SI units."""
    headers = {name: log_files.HEADERS.get(name, name) for name in log}
    return {headers[name]: values / log_files.si_factor(headers[name]) for name, values in log.items()}


def draw_ways(path: Paths, prescription: Mapping[str, Mapping[str, Any]]) -> None:
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
