"""The page of a designed trial, with its numbers and figures."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from bayesub.findings.designed_trial import SHARES, DesignedTrial, measure_label, numbers, search_sentences
from bayesub.findings.run_numbers import null_changes, percent
from bayesub.io.atomic import write_text, writing
from bayesub.io.words import with_unit
from bayesub.report.page import ReportFigure, draw_all, fill
from bayesub.report.plots import design as plots
from bayesub.report.plots.coefficients import labels


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
            searched=search_sentences(design),
        )
        write_text(folder / "design.json", json.dumps(content, indent=1))
        write_text(folder / "design.html", page)
    return content


def figures(design: DesignedTrial) -> Iterator[ReportFigure]:
    """The figures of a :class:`bayesub.findings.designed_trial.DesignedTrial`, in the order of the page."""
    n = len(design.manoeuvres)
    for k, manoeuvre in enumerate(design.manoeuvres, start=1):
        yield _manoeuvre(design, manoeuvre, "" if n == 1 else f"_{k}", "" if n == 1 else f" {k}")
    if any(design.margins):
        yield ReportFigure(
            "margins",
            "How far the boat stays from each limit, as a share of the limit. Blue: the boat of the vehicle file. "
            f"Grey: {len(design.plan.range.sets) - 1} boats that the prior holds possible; those at the right edge are "
            "as far out or further.",
            lambda path: plots.draw_margins(path, design.margins),
            title="Margins to the limits",
        )
    names = design.after.names
    standard = None if design.after_standard is None else design.after_standard.relative_sd
    yield ReportFigure(
        "sds",
        "Expected standard deviation of each coefficient over its size, best known first, before the trial (grey), "
        "after this trial (blue) and after the standard manoeuvre (open circles). Dotted: 5, 10 and 25 %.",
        lambda path: plots.draw_sds(
            path, labels(names, design.judge.vehicle.equations), design.before.relative_sd, standard,
            design.after.relative_sd, SHARES,
        ),
        title="What each coefficient will be known to",
    )  # fmt: skip
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
        lambda path: plots.draw_search(
            path,
            {kind: found.best for kind, found in design.searches.items()},
            {kind: found.n_judgements // max(1, len(found.best)) for kind, found in design.searches.items()},
            cost,
        ),
        title="What was searched",
    )


def _draw_worth(path, design) -> None:
    minutes = {minute: design.measure(information) for minute, information in design.minutes.items()}
    end = max(minutes)
    again = {end + m: design.measure(design.after + information) for m, information in design.minutes.items()}
    sensors = {name: design.measure(information) for name, information in design.sensors.items()}
    plots.draw_worth(path, minutes, again, sensors, design.measure(design.after), measure_label(design))


def _manoeuvre(design, manoeuvre, suffix, number) -> ReportFigure:
    def draw(path):
        times, states, whole = design.plan.range.flown(manoeuvre)
        states = np.where(whole[:, None, None], states, np.nan)
        orders = plots.in_units(manoeuvre.log)
        moved = [c.column for c in design.plan.family(design.kind).controls]
        change, depth = design.plan.range.limits.depth_change_m, design.judge.vehicle.depth_m
        band = None if change is None else (depth - change, depth + change)
        plots.draw_manoeuvre(path, manoeuvre.times, {c: orders[c] for c in moved}, (times, states), band)

    dives = design.judge.vehicle.equations.subproblem(design.judge.subproblem) != "horizontal"
    return ReportFigure(
        f"orders{suffix}",
        f"Right, the orders of manoeuvre{suffix}.csv. Left, where the boat goes (blue), and "
        f"{len(design.plan.range.sets) - 1} boats that the prior holds possible (grey)."
        + (" Dashed: the depth band." if dives else ""),
        draw,
        title=f"Manoeuvre{number}",
    )
