"""What an autopilot masks: errors with and without feedback, and unstable boats on a straight course."""

import numpy as np

from autopilot.courses import QUANTITIES
from bayesub.report.plots import style

_LOOKS = {"SQP": (style.SQP, "o"), "random": (style.NULL, "s"), "posterior": (style.POSTERIOR, "^")}
_TITLES = {"path_m": "path (m)", "track_m": "place at a time (m)", "depth_m": "depth (m)"}
_LABELS = {"SQP": "identified by SQP", "random": "random within 10 %", "posterior": "draws of a posterior"}


def draw_masked(path, numbers) -> None:
    """A row a vehicle: errors without feedback against those under the autopilot, a mark a set.

    Parameters
    ----------
    path
        One or several, as :func:`bayesub.report.plots.style.figure` takes them.
    numbers
        Vehicle -> numbers, as ``studies/autopilot.py`` has them.
    """
    with style.figure(path, 9.0, 2.8 * len(numbers) + 0.7) as figure:
        rows = figure.subplots(len(numbers), len(_TITLES), squeeze=False)
        for row, (vehicle, r) in zip(rows, numbers.items(), strict=True):
            for panel, (quantity, title) in zip(row, _TITLES.items(), strict=True):
                k, ends = QUANTITIES.index(quantity), []
                for kind, (colour, marker) in _LOOKS.items():
                    x, y = (np.array(r["kinds"][kind]["errors"][how])[:, k] for how in ("without", "with"))
                    panel.loglog(x, y, marker, ms=3.5, mew=0, alpha=0.7, color=colour, label=_LABELS[kind])
                    ends += [*x, *y]
                limits = 0.7 * np.nanmin(ends), 1.4 * np.nanmax(ends)
                panel.plot(limits, limits, "--", lw=0.8, color=style.TRUTH, label="equal errors")
                panel.set(xlim=limits, ylim=limits, box_aspect=1)
                panel.set_title(f"{vehicle}: {title}", fontsize=9)
            row[0].set_ylabel("under the autopilot")
        for panel in rows[-1]:
            panel.set_xlabel("without feedback")
        figure.legend(*rows[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4, fontsize=8)


def draw_unstable(path, found) -> None:
    """A panel a vehicle: rms of heading and rudder against the largest root of sway and yaw.

    Parameters
    ----------
    path
        One or several.
    found
        Vehicle -> lists of :func:`autopilot.courses.unstable`.
    """
    lines = {
        "without": ("heading, without feedback", style.SQP, "s"),
        "with": ("heading, under the autopilot", style.POSTERIOR, "o"),
        "rudder": ("rudder of the autopilot", style.LINEAR, "^"),
    }
    with style.figure(path, 3.1 * len(found) + 0.3, 3.4) as figure:
        panels = figure.subplots(1, len(found), squeeze=False, sharey=True)[0]
        for panel, (vehicle, r) in zip(panels, found.items(), strict=True):
            for key, (label, colour, marker) in lines.items():
                panel.semilogy(r["root"], r[key], marker, ls="-", lw=1.0, ms=4, mew=0, color=colour, label=label)
            panel.axvline(0.0, color=style.TRUTH, lw=0.8)
            panel.annotate("unstable", (0.0, 0.02), (4, 0), ("data", "axes fraction"), "offset points", fontsize=8)
            panel.set_title(vehicle, fontsize=9)
            panel.set_xlabel("largest root, per ship length")
        panels[0].set_ylabel("rms (degrees)")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=8)
