"""Errors of places and of coefficients, by method and boat."""

from bayesub.report.plots import style

MARKERS = {"suboff": "o", "auv690": "s", "npsauv": "^"}


def methods(numbers: dict, paths: style.Paths) -> None:
    """A row a method: largest errors of the place, and how far coefficients are off, for each boat."""
    names = list(next(iter(numbers.values()))["methods"])[::-1]
    with style.figure(paths, 8.6, 2.9) as figure:
        left, right = figure.subplots(1, 2, sharey=True)
        for vehicle, result in numbers.items():
            look = {"color": style.VEHICLES[vehicle], "ls": "", "ms": 6, "mew": 0, "label": vehicle}
            by = result["methods"]
            left.semilogx([by[n]["place"] for n in names], range(len(names)), MARKERS[vehicle], **look)
            with_sets = [k for k, n in enumerate(names) if "nonlinear" in by[n]]
            off = [100.0 * by[names[k]]["nonlinear"] for k in with_sets]
            right.plot(off, with_sets, MARKERS[vehicle], **look)
        left.set_yticks(range(len(names)), names)
        left.set(xlabel="largest error of the place (% of the path)", ylim=(-0.5, len(names) - 0.5))
        right.set(xlabel="coefficients that are not linear are off by (%)", xlim=(0, None))
        right.annotate("has none", (0.02, names.index("network flown")), xycoords=("axes fraction", "data"), fontsize=8)
        figure.legend(*left.get_legend_handles_labels(), loc="outside upper left", ncols=3, fontsize=8)
