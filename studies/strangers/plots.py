"""What intervals hold and how far predictions are off, by simulator."""

import numpy as np

from bayesub.report.plots import style
from strangers import tables


def draw(path, rows: dict[str, dict]) -> None:
    """Coverage with two standard errors at the left, errors of unseen runs boat by boat at the right."""
    names = list(rows)
    places = np.arange(len(names))[::-1]
    with style.figure(path, 9.0, 0.8 + 0.32 * len(names)) as figure:
        left, right = figure.subplots(1, 2, sharey=True)
        left.axvspan(*(100 * share for share in tables.WANTED), color="#DDDDDD", lw=0)
        for place, name in zip(places, names, strict=True):
            row = rows[name]
            colour = style.SQP if row["removed"] else style.POSTERIOR
            error = 200 * (row["coverage_error"] or 0.0)
            left.errorbar(100 * row["coverage"][tables.LEVEL], place, xerr=error, fmt="o", color=colour, ms=5)
            off = [value for value in row["paths_percent"] if value is not None]
            right.plot(off, np.full(len(off), place), "|", color=colour, ms=9)
            if row["path_percent"]["median"] is not None:
                right.plot(row["path_percent"]["median"], place, "o", color=colour, ms=5)
        right.axvline(tables.PATH_PERCENT, color=style.TRUTH, lw=0.6, ls=":")
        right.set_xscale("log")
        left.set(xlabel="90 % intervals that hold the truth (%)", xlim=(None, 101))
        right.set_xlabel("distance from the unseen track (% of the path)")
        left.set_yticks(places, names)
