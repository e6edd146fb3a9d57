"""Errors of linear programming and linear least squares by coefficient (thesis Figures 89 to 96)."""

import numpy as np

from bayesub.report.plots import style
from thesis.cases import MANOEUVRES
from thesis.plots.floors import above_floor
from thesis.plots.labels import labels

_METHODS = {"LP": ("o", "linear programming"), "LLS": ("_", "linear least squares")}
_ROW = 32  # coefficients of a row, whose labels are read at the width of a page
_FLOOR = 1e-16


def draw_errors(path, cases) -> None:
    """Relative error without noise of every coefficient, a panel for every manoeuvre; arrows are exact.

    Parameters
    ----------
    path : one file or several
    cases : "vehicle manoeuvre" -> method -> "errors" -> coefficient -> relative error
    """
    rows = []
    for manoeuvre in MANOEUVRES:
        of = {name.split()[0]: case for name, case in cases.items() if name.split()[1] == manoeuvre}
        names = []
        for case in of.values():
            names += [n for n in case["LP"]["errors"] if n not in names]
        names.sort(key=lambda n: "XYZKMN".index(n[0]))
        n_rows = -(-len(names) // _ROW)
        width = -(-len(names) // n_rows) if names else 0
        parts = [names[k * width : (k + 1) * width] for k in range(n_rows)]
        rows += [(f"{manoeuvre}, {some[0][0]} to {some[-1][0]}", of, some) for some in parts]
    with style.figure(path, 8.0, 2.1 * len(rows) + 0.3) as figure:
        panels = np.atleast_1d(figure.subplots(len(rows), 1))
        for panel, (title, of, names) in zip(panels, rows, strict=True):
            for k, (vehicle, case) in enumerate(of.items()):
                for method, (marker, word) in _METHODS.items():
                    pairs = [
                        (names.index(n), e) for n, e in case[method]["errors"].items() if n in names and e is not None
                    ]
                    x, errors = np.array(pairs, dtype=float).T
                    x, look = x + 0.22 * (k - 1), {"color": style.VEHICLES[vehicle], "label": f"{vehicle}, {word}"}
                    errors = above_floor(panel, x, errors, _FLOOR, look["color"])
                    panel.semilogy(x, errors, marker, ms=4, mew=0.9, mfc="none", **look)
            panel.set_xticks(
                range(len(names)), labels(np.array(names)), rotation=70, ha="right", rotation_mode="anchor"
            )
            panel.set(xlim=(-0.7, len(names) - 0.3), ylim=(_FLOOR, None), ylabel="relative error")
            panel.set_title(title, fontsize=9)
            panel.grid(axis="x", visible=False)
        handles, words = panels[0].get_legend_handles_labels()
        figure.legend(handles, words, loc="outside upper center", ncols=3, fontsize=8)
