"""Pictures of what is unique: ranks, singular values with their gap, null vectors, and the signs behind them."""

import numpy as np

from bayesub.inference.identifiability.rank import ACCURACY
from bayesub.report.plots import style
from thesis.plots.labels import labels

FLOOR = 1e-17  # of the axis of singular values
UNIQUE, WEAK, NULL = "#CFE3F1", "#F7DDA8", "#E9C4D8"


def draw_ranks(path, rows, columns, cells) -> None:
    """A table of ranks, one colour a verdict.

    Parameters
    ----------
    path : one file or several
    rows : (n_rows,) labels
    columns : (n_columns,) labels
    cells : list of rows of (rank, columns, practical rank), or None where there is none
    """
    with style.figure(path, 1.4 + 0.95 * len(columns), 1.0 + 0.27 * len(rows)) as figure:
        axis = figure.subplots()
        for i, row in enumerate(cells):
            for j, cell in enumerate(row):
                if cell is None:
                    continue
                rank, n_columns, practical = cell
                colour = NULL if rank < n_columns else WEAK if practical < rank else UNIQUE
                axis.fill([j, j + 1, j + 1, j], [i, i, i + 1, i + 1], color=colour, lw=0)
                axis.text(j + 0.5, i + 0.5, f"{rank}/{n_columns}", ha="center", va="center", fontsize=8.5)
                if practical < rank:
                    axis.fill([j + 0.73, j + 1, j + 1, j + 0.73], [i, i, i + 1, i + 1], color=WEAK, lw=0)
                    axis.text(j + 0.865, i + 0.5, f"({practical})", ha="center", va="center", fontsize=8.5)
        groups = [k for k in range(1, len(rows)) if rows[k].split()[0] != rows[k - 1].split()[0]]
        axis.hlines(groups, 0, len(columns), color=style.TRUTH, lw=0.8)
        axis.set_xlim(0, len(columns))
        axis.set_ylim(len(rows), 0)
        axis.set_xticks(np.arange(len(columns)) + 0.5, columns)
        axis.set_yticks(np.arange(len(rows)) + 0.5, rows)
        axis.xaxis.tick_top()
        axis.tick_params(length=0)
        axis.grid(visible=False)
        axis.spines[:].set_visible(False)
        for colour, label in (
            (UNIQUE, "unique"),
            (NULL, "not unique: rank below columns"),
            (WEAK, "ill-conditioned: (rank in practice)"),
        ):
            axis.fill([], [], color=colour, label=label)
        axis.legend(loc="upper center", bbox_to_anchor=(0.45, 0.0), ncols=3, fontsize=8, columnspacing=1.0)


def draw_spectra(path, cases) -> None:
    """Singular values over the largest, axis by axis: a panel a manoeuvre, a colour a vehicle.

    Parameters
    ----------
    path : one file or several
    cases : manoeuvre -> vehicle -> axis -> :meth:`bayesub.inference.identifiability.AxisRank.summary`
    """
    with style.figure(path, 10.0, 4.4) as figure:
        widths = [len(next(iter(by_vehicle.values()))) for by_vehicle in cases.values()]
        panels = figure.subplots(1, len(cases), sharey=True, width_ratios=widths)
        for panel, (manoeuvre, by_vehicle) in zip(panels, cases.items(), strict=True):
            for k, (vehicle, ranks) in enumerate(by_vehicle.items()):
                for j, r in enumerate(ranks.values()):
                    _draw_axis(panel, j + 0.24 * (k - 1), r, style.VEHICLES[vehicle])
            everything = [r for ranks in by_vehicle.values() for r in ranks.values()]
            top = max(r["threshold"] / r["singular_values"][0] for r in everything)
            panel.axhspan(FLOOR, top, color=style.NULL, alpha=0.15, lw=0)
            panel.axhspan(top, ACCURACY, color=style.WEAK, alpha=0.12, lw=0)
            names = list(next(iter(by_vehicle.values())))
            panel.set_xticks(range(len(names)), names)
            panel.set_xlim(-0.5, len(names) - 0.5)
            panel.set_title(manoeuvre, fontsize=9)
            panel.set_xlabel("axis")
            panel.grid(axis="x", visible=False)
        panels[0].set_ylim(FLOOR, 3.0)
        panels[0].set_ylabel("singular value over the largest, unit columns")
        panels[-1].text(-0.4, top / 2, "round-off: not unique", fontsize=8, va="top")
        text = "above round-off, below any instrument: ill-conditioned"
        panels[-1].text(-0.4, ACCURACY / 2, text, fontsize=8, va="top")
        vehicles = next(iter(cases.values()))
        handles = [panels[0].plot([], [], "_", ms=9, mew=2.0, color=style.VEHICLES[v], label=v)[0] for v in vehicles]
        for marker, fill, label in (("s", "full", "seen by the equations only"), ("D", "none", "null")):
            handles += panels[0].plot([], [], marker, color=style.TRUTH, ms=5, fillstyle=fill, label=label)
        figure.legend(handles=handles, loc="outside lower center", ncols=5, fontsize=8)


def _draw_axis(panel, place, r, colour) -> None:
    """The singular values of one axis: clear, weak and null ones."""
    values = np.array(r["singular_values"])
    null, weak = values <= r["threshold"], np.zeros(len(values), dtype=bool)
    weak[r["practical_rank"] : r["rank"]] = True
    values = np.maximum(values / values[0], FLOOR)
    looks = {"_": {"ms": 9, "mew": 1.4}, "s": {"ms": 5}, "D": {"ms": 5, "mfc": "none"}}
    for members, (marker, look) in zip((~null & ~weak, weak, null), looks.items(), strict=True):
        panel.semilogy(np.full(members.sum(), place), values[members], marker, color=colour, **look)


def draw_null_vectors(path, vectors) -> None:
    """Null vectors, one row each, their largest entry one: a panel an axis.

    Parameters
    ----------
    path : one file or several
    vectors : axis -> (names of the columns, label of a row -> null vector as a dict coefficient -> change)
    """
    heights = [len(rows) + 1.6 for _, rows in vectors.values()]
    with style.figure(path, 9.5, 0.24 * sum(heights) + 1.2) as figure:
        panels = figure.subplots(len(vectors), 1, height_ratios=heights, squeeze=False)[:, 0]
        for panel, (names, rows) in zip(panels, vectors.values(), strict=True):
            table = np.array([[vector.get(name, 0.0) for name in names] for vector in rows.values()])
            image = panel.imshow(table, cmap="PuOr", vmin=-1, vmax=1, aspect="auto")
            for i, j in np.argwhere(np.abs(table) >= 0.005):
                colour = "white" if abs(table[i, j]) > 0.7 else style.TRUTH
                text = f"{table[i, j]:.2f}".replace("0.", ".").replace("-", "−")
                panel.text(j, i, text, ha="center", va="center", fontsize=6.5, color=colour)
            panel.set_xticks(range(len(names)), labels(names), rotation=45, ha="right", rotation_mode="anchor")
            panel.set_yticks(range(len(rows)), list(rows), fontsize=8)
            panel.tick_params(length=0)
            panel.grid(visible=False)
        bar = figure.colorbar(image, ax=panels, orientation="horizontal", fraction=0.03, pad=0.02, aspect=50)
        bar.set_label("change of the non-dimensional coefficient along the null vector, the largest being one")


def draw_signs(path, vehicles, arrays) -> None:
    """Figure 27 of the thesis in kind: the relative signs of two pairs of motions over time.

    Parameters
    ----------
    path : one file or several
    vehicles : names, a column of panels each
    arrays : vehicle -> ship lengths travelled (n_samples,), and "vehicle/pair" -> relative sign of the two motions,
        -1, 0 or 1 (n_samples,)
    """
    pairs = list(dict.fromkeys(key.partition("/")[2] for key in arrays if "/" in key))
    with style.figure(path, 9.5, 1.5 * len(pairs) + 0.9) as figure:
        panels = figure.subplots(len(pairs), len(vehicles), sharex=True, sharey=True, squeeze=False)
        for column, vehicle in zip(panels.T, vehicles, strict=True):
            column[0].set_title(vehicle, fontsize=9)
            for panel, first, pair in zip(column, panels[:, 0], pairs, strict=True):
                signs = arrays[f"{vehicle}/{pair}"]
                panel.plot(arrays[vehicle][signs != 0], signs[signs != 0], ".", ms=1.5, color=style.POSTERIOR)
                text = f"equal in {100 * np.mean(signs > 0):.2g} % of samples"
                panel.text(0.5, 0.5, text, transform=panel.transAxes, ha="center", va="center", fontsize=8)
                panel.set_ylim(-1.6, 1.6)
                panel.set_yticks([-1, 1], ["opposite", "equal"])
                first.set_ylabel(f"signs of {pair}")
            column[-1].set_xlabel("ship lengths travelled at trial speed")
