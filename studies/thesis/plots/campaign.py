"""Figures of the deterministic baselines: costs, coefficients, accuracies (thesis Figures 30 to 59 and 89 to 96).

A case is a dictionary of JSON types as :func:`thesis.optimisers.compare` gives it.
"""

import numpy as np

from bayesub.report.plots import style
from thesis.plots.floors import above_floor
from thesis.plots.labels import labels

_ROW = 30  # coefficients a row, whose labels are read at the width of a page
_FLOOR = 1e-16  # of an error that is drawn


def draw_costs(path, case) -> None:
    """Histograms of initial and converged cost, largest position error and evaluations of the SQP searches."""
    search = case["sqp"]
    costs = [("initial", search["initial_costs"], style.PRIOR), ("converged", search["costs"], style.SQP)]
    panels = (
        ("cost (m$^2$ + deg$^2$)", costs),
        ("largest position error (mm)", [("", 1e3 * np.array(search["position_m"]), style.SQP)]),
        ("evaluations", [("", search["efforts"], style.SQP)]),
    )
    with style.figure(path, 9.0, 2.8) as figure:
        for axis, (label, groups) in zip(figure.subplots(1, 3), panels, strict=True):
            values = np.concatenate([np.asarray(v) for _, v, _ in groups])
            log = label.startswith("cost")
            low, high = (values.min() / 1.3, values.max() * 1.3) if log else (0.0, 1.1 * values.max())
            edges = np.geomspace(low, high, 31) if log else np.linspace(low, high, 31)
            for name, data, colour in groups:
                axis.hist(data, edges, color=colour, label=name)
            axis.set(xscale="log" if log else "linear", xlabel=label)
            axis.grid(axis="x", visible=False)
        figure.axes[0].set_ylabel("searches")
        figure.axes[0].legend(fontsize=8)


def draw_coefficients(path, names, ratios, starts, bounds, *, label="SQP, converged") -> None:
    """Ratio to the truth of every coefficient, one dot a search, with the starts; up to thirty coefficients a row.

    Parameters
    ----------
    path : one file or several
    names : (n_params,) coefficients
    ratios : (n_starts, n_params) where searches end
    starts : (n_starts, n_params) where they began
    bounds : (low, high) ratios, or empty where they differ by coefficient
    label : of the ends
    """
    draw_sets(path, names, (("start", starts, "o", "#909090"), (label, ratios, "o", style.SQP)), bounds)


def draw_sets(path, names, groups, bounds=()) -> None:
    """Ratios to the truth of groups of coefficient sets, side by side; up to thirty coefficients a row.

    Parameters
    ----------
    path : one file or several
    names : (n_params,) coefficients
    groups : (label, ratios (n, n_params), marker, colour)
    bounds : as :func:`draw_coefficients`
    """
    n_rows = int(np.ceil(len(names) / _ROW))
    width = int(np.ceil(len(names) / n_rows))
    shifts = np.linspace(-0.2, 0.2, len(groups))
    with style.figure(path, max(6.0, 0.22 * width + 1.4), 2.9 * n_rows + 0.3) as figure:
        panels = np.atleast_1d(figure.subplots(n_rows, 1))
        for row, panel in enumerate(panels):
            chosen = np.arange(row * width, min((row + 1) * width, len(names)))
            columns = np.arange(len(chosen))
            for (text, values, marker, colour), shift in zip(groups, shifts, strict=True):
                jitter = shift + np.linspace(-0.12, 0.12, len(values))[:, None] * (len(values) > 1)
                x, size = (columns + jitter).ravel(), 3.0 if len(values) > 1 else 4.5
                panel.plot(x, values[:, chosen].ravel(), marker, ms=size, mew=0, color=colour, label=text)
            panel.axhline(1.0, color=style.TRUTH, lw=0.7)
            for limit in bounds:
                panel.axhline(limit, color=style.TRUTH, lw=0.7, ls="--", label="bound" if limit == bounds[0] else None)
            panel.set_xticks(columns, labels(np.array(names)[chosen]), rotation=70, ha="right", rotation_mode="anchor")
            panel.set(xlim=(-0.8, width - 0.2), ylabel="ratio to truth")
            panel.grid(axis="x", visible=False)
        panels[0].legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, fontsize=8, markerscale=1.5)


def draw_accuracy(path, cases) -> None:
    """Relative errors without noise of every coefficient of every case, by method."""
    methods = (("LP", style.WEAK, "linear programming"), ("LLS", style.LINEAR, "linear least squares"))
    methods += (("trust_region", style.POSTERIOR, "trust region on the track"), ("SQP", style.SQP, "SQP on the track"))
    with style.figure(path, 9.0, 3.6) as figure:
        axis = figure.subplots()
        for n, case in enumerate(cases.values()):
            for k, (method, colour, text) in enumerate(methods):
                errors = np.array(case["errors"][method], dtype=float)  # none: not a number
                x = n + 0.2 * (k - 1.5) + np.linspace(-0.06, 0.06, len(errors))
                errors = above_floor(axis, x, errors, _FLOOR, colour)
                axis.semilogy(x, errors, "o", ms=2.2, mew=0, color=colour, label=text if n == 0 else None)
        axis.axhline(0.1, color=style.TRUTH, lw=0.7, ls="--", label="starts")
        axis.set_xticks(range(len(cases)), [case.replace(" ", "\n") for case in cases])
        axis.set(ylabel="relative error of a coefficient", ylim=(_FLOOR, None))
        axis.grid(axis="x", visible=False)
        axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=5, fontsize=8, markerscale=2)


def draw_noise(path, cases) -> None:
    """Noise at which each coefficient is known to 10 % only, which is what the searches start from."""
    with style.figure(path, 9.0, 3.8) as figure:
        panels = figure.subplots(1, 2)
        lines = dict(zip(dict.fromkeys(case.split()[1] for case in cases), ("-", ":", "--"), strict=False))
        for name, case in cases.items():
            vehicle, manoeuvre = name.split()
            for panel, key, factor in zip(panels, ("track_m", "velocity_mps"), (1e3, 1e3), strict=True):
                levels = factor * np.sort(list(case["lost_at"][key].values()))
                share = 100 * np.arange(1, len(levels) + 1) / len(levels)
                look = {"ls": lines[manoeuvre], "color": style.VEHICLES[vehicle], "drawstyle": "steps-post"}
                panel.semilogx(levels, share, label=name, **look)
        marks = (("track noise (mm and 0.001 deg)", 1.0), ("velocity noise (mm/s)", 10.0))
        for panel, (text, mark) in zip(panels, marks, strict=True):
            panel.axvline(mark, color=style.TRUTH, lw=0.8)
            panel.set(xlabel=text, ylabel="coefficients lost (%)", ylim=(0, 102))
        panels[0].set_title("trust region on 10 Hz tracks; line: 1 mm", fontsize=9)
        panels[1].set_title("linear least squares, 10 Hz; line: 1 cm/s", fontsize=9)
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=5, fontsize=8)
