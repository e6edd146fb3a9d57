"""Tables of uniqueness: Tables 6 to 9 of the thesis beside ours, and the evidence.

`ranks` is manoeuvre -> vehicle -> axis -> :meth:`bayesub.inference.identifiability.AxisRank.summary`.
"""

from collections.abc import Iterator

from bayesub.model.coefficients import ADDED_MASSES, AXES, NAMES
from bayesub.report.markdown import columns, table
from thesis.cases import VEHICLES, held, published
from thesis.mechanisms import PAIRS

_SAMPLES = {1: "only samples with equal signs of", -1: "only samples with opposite signs of"}


def rank_rows(ranks: dict) -> list[tuple[str, str]]:
    """Manoeuvre and axis of every row of Tables 6 to 8."""
    return [(manoeuvre, axis) for manoeuvre, row in ranks.items() for axis in row[VEHICLES[0]]]


def rank_cells(ranks: dict) -> list[list[tuple[int, int, int]]]:
    """(rank, columns, practical rank) in every row, of the thesis's three boats and of ours."""
    tables, cells = published()["rank"], []
    for manoeuvre, axis in rank_rows(ranks):
        *theirs, n_columns = tables[manoeuvre][axis]
        ours = [ranks[manoeuvre][vehicle][axis] for vehicle in VEHICLES]
        ours = [(r["rank"], r["columns"], r["practical_rank"]) for r in ours]
        cells.append([(rank, n_columns, rank) for rank in theirs] + ours)
    return cells


def null_vectors_by_axis(ranks: dict) -> dict[str, tuple[list[str], dict[str, dict[str, float]]]]:
    """Axis -> coefficients that have a part, and label of each null vector -> coefficient -> change."""
    vectors = {}
    for axis in AXES:
        lines = {
            f"{vehicle} {manoeuvre}, {pivot} held": vector
            for manoeuvre, row in ranks.items()
            for vehicle, by_axis in row.items()
            if axis in by_axis
            for pivot, vector in zip(by_axis[axis]["pivots"], by_axis[axis]["null_vectors"], strict=True)
        }
        if lines:
            vectors[axis] = [name for name in NAMES if any(name in vector for vector in lines.values())], lines
    return vectors


def page(numbers: dict) -> Iterator[str]:
    """Everything in Markdown."""
    yield "Rank/columns (thesis Tables 6 to 8); in brackets the rank in practice, where that is less.\n"
    lines = [
        (*row, *(f"{rank}/{n}" + (f" ({practical})" if practical < rank else "") for rank, n, practical in cells))
        for row, cells in zip(rank_rows(numbers["ranks"]), rank_cells(numbers["ranks"]), strict=True)
    ]
    yield from table(("manoeuvre", "axis", "thesis 1", "thesis 2", "thesis 3", *VEHICLES), lines)
    yield "\nAdded masses that, once known, make the rest of their axis unique (thesis Tables 6, 7, 9), best first; in"
    yield "brackets smallest over largest singular value of the rest.\n"
    header = ("manoeuvre", "vehicle", "axis", "thesis", "one added mass, or two", "fails")
    yield from table(header, [_held_row(case, choices) for case, choices in numbers["held"].items()])
    yield "\nWhat decides: the rank with one thing changed about the vehicle or the samples (buoyancy over weight); the"
    yield "smallest singular value above round-off and the smallest, over the largest.\n"
    yield from columns(
        numbers["mechanisms"],
        {key: lambda m, key=key: m[key] for key in ("vehicle", "manoeuvre", "axis")}
        | {
            "changed": lambda m: ", ".join(_change(*item) for item in m["changes"].items()) or "nothing",
            "rank": lambda m: f"{m['rank']}/{m['columns']}",
            "singular values": lambda m: ", ".join(f"{x:.0e}" for x in m["smallest_relative"]),
        },
    )
    yield "\nLargest change of position, in m, for a change of 50 % along a null vector, and for the same changes with"
    yield "random signs; round-off is a machine epsilon of the largest coordinate, a step.\n"
    lengths = {"null vector": "moved_m", "round-off": "round_off_m", "random signs, median": "random_median_m"}
    yield from columns(
        numbers["null_directions"],
        {key: lambda m, key=key: m[key] for key in ("manoeuvre", "vehicle", "axis")}
        | {title: lambda m, key=key: f"{m[key]:.1g}" for title, key in lengths.items()},
    )
    yield "\nNull directions of the track's Jacobian about random coefficient sets: structural ones are null on every"
    yield "manoeuvre, practical ones below a millionth of the largest; alone is the count of each manoeuvre.\n"
    keys = {"vehicle": "vehicle", "set": "seed", "parameters": "n_params"}
    keys |= {key: key for key in ("structural", "practical")}
    yield from columns(
        numbers["track_level"],
        {title: lambda c, key=key: c[key] for title, key in keys.items()}
        | {
            "alone": lambda c: ", ".join(f"{name} {n}" for name, n in c["alone"].items()),
            "gap": lambda c: f"{c['gap']:.0e}",
            "angle to the linear form's": lambda c: f"{c['angle_rad']:.0e} rad" if c["angle_rad"] else "",
        },
    )


def _held_row(case, choices) -> tuple:
    vehicle, manoeuvre, axis = case.split()
    massive = {names: x for names, x in choices.items() if set(names.split()) <= set(ADDED_MASSES)}
    good = ", ".join(f"{names.replace(' ', ' + ')} ({x:.0e})" for names, x in massive.items() if x)
    bad = ", ".join(names.replace(" ", " + ") for names, x in massive.items() if not x)
    theirs = " and ".join(name for name in held(manoeuvre) if name[0] == axis)
    return manoeuvre, vehicle, axis, theirs, good, bad


def _change(name, value) -> str:
    return f"{_SAMPLES[value]} {name}" if name in PAIRS else f"{name} = {value:g}"
