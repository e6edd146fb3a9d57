"""Possible faults of columns, each with the change that mends it."""

import itertools
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from bayesub.io.units import DEGREE, FOOT, KNOT, TURN
from bayesub.logs.series import Series

# Columns whose names may be exchanged.
PAIRS = (("u", "v"), ("u_ground", "v_ground"), ("north", "east"), ("x", "y"), ("p", "r"), ("q", "r"), ("p", "q"))
SPEEDS = (("knots", "kn", KNOT), ("km/h", "", 1.0 / 3.6), ("ft/s", "", FOOT), ("cm/s", "", 0.01))  # m/s, and ending
Change = Callable[[dict[str, Series]], dict[str, Series]]


@dataclass(frozen=True)
class Mend:
    """One thing that may be wrong."""

    kind: str  # that of a :class:`bayesub.logs.series.Finding`
    names: tuple[str, ...]  # short names of the columns that are wrong
    message: str  # what they hold
    remedy: str  # what to change
    change: Change  # readings by short name -> the same mended


def mends(data: dict[str, Series], headers: dict[str, str]) -> Iterator[Mend]:
    """All mends of the columns of a log, the likelier of two that do the same first.

    Readings and the headers of their columns in the file are by short name.
    """
    yield from _headings(data, headers)
    yield from _names(data, headers)
    yield from _units(data, headers)
    yield from _signs(data)


def _rename(sources: dict[str, str]) -> Change:
    """The change that gives columns (the keys) the readings of others, which go if they are given none."""

    def change(data):
        rest = {name: one for name, one in data.items() if name not in {*sources, *sources.values()}}
        return rest | {new: data[old] for new, old in sources.items()}

    return change


def _scale(names: Iterable[str], factor: float, offset: float = 0.0) -> Change:
    return lambda data: data | {n: Series(data[n].times, factor * data[n].values + offset) for n in names}


def _stretch(factor: float) -> Change:
    return lambda data: {name: Series(factor * one.times, one.values) for name, one in data.items()}


def _names(data: dict[str, Series], headers: dict[str, str]) -> Iterator[Mend]:
    for suffix in ("", "_ground"):
        u, v = f"u{suffix}", f"v{suffix}"
        if u in data and v in data and "north" not in data and "east" not in data:
            for first, second in (("north", "east"), ("east", "north")):
                names = f"velocity_{first}_mps, velocity_{second}_mps"
                words = f"velocities to {first} and {second}, not along the boat"
                yield Mend("axes", (u, v), words, f"rename them {names}", _rename({first: u, second: v}))
    if "north" in data and "east" in data and not {"u", "v", "u_ground", "v_ground"} & set(data):
        words = "velocities along the boat, not to north and east"
        change = _rename({"u_ground": "north", "v_ground": "east"})
        yield Mend("axes", ("north", "east"), words, "rename them u_ground_mps, v_ground_mps", change)
    for one, other in PAIRS:
        if one in data and other in data:
            words = f"{headers[one]} holds what {headers[other]} should"
            yield Mend("name", (one, other), words, "exchange the two names", _rename({one: other, other: one}))
    angle_of = {"p": "roll", "q": "pitch", "r": "yaw"}
    for one, other in itertools.permutations("pqr", 2):
        if one not in data:
            continue
        words, header = f"the rate of {angle_of[other]}", headers[one].replace(f"{one}_", f"{other}_", 1)
        remedy = f"rename it {header}"
        if other in data:
            words = f"{words}, which {headers[other]} is not"
            remedy = f"rename it {headers[other]} and leave out the column of that name"
        yield Mend("name", (one,), words, remedy, _rename({other: one}))


def _units(data, headers) -> Iterator[Mend]:
    for names in (["phi"], ["theta"], ["psi"], ["heading"], ["cog"], list("pqr"), ["p"], ["q"], ["r"]):
        present = tuple(name for name in names if name in data)
        if len(present) < min(2, len(names)):
            continue
        in_degrees = "_deg" in headers[present[0]]
        old, new, factor = ("_deg", "_rad", 1.0 / DEGREE) if in_degrees else ("_rad", "_deg", DEGREE)
        words = "radians" if in_degrees else "degrees"
        better = ", ".join(headers[name].replace(old, new) for name in present)
        yield Mend("unit", present, f"in {words}", f"rename {_it(present)} {better}", _scale(present, factor))
    for speeds in ("u v w", "u_ground v_ground w_ground", "north east down", "sog", "stw"):
        present = tuple(name for name in speeds.split() if name in data)
        if not present:
            continue
        for words, unit, factor in SPEEDS:
            better = ", ".join(headers[name].replace("_mps", f"_{unit}") for name in present)
            remedy = f"rename {_it(present)} {better}" if unit else f"multiply {_it(present)} by {factor:.4g}"
            yield Mend("unit", present, f"in {words}", remedy, _scale(present, factor))
    for group in (["x", "y"], ["z"], ["depth"]):
        if all(name in data for name in group):
            remedy = f"multiply {_it(group)} by {FOOT:.4g}"
            yield Mend("unit", tuple(group), "in feet", remedy, _scale(group, FOOT))
    for words, factor in (("ms", 1e-3), ("minutes", 60.0), ("hours", 3600.0)):
        yield Mend("unit", ("time",), f"in {words}", f"multiply it by {factor:g}", _stretch(factor))


def _it(names) -> str:
    return "it" if len(names) == 1 else "them"


def _signs(data) -> Iterator[Mend]:
    positive = {
        "x": "north", "y": "east", "z": "down", "depth": "down", "u": "ahead", "v": "to starboard", "w": "down",
        "u_ground": "ahead", "v_ground": "to starboard", "w_ground": "down", "north": "north", "east": "east",
        "phi": "with starboard down", "theta": "with the nose up", "psi": "clockwise from north",
        "heading": "clockwise from north", "cog": "clockwise from north", "p": "with starboard going down",
        "q": "with the nose going up", "r": "turning to starboard",
    }  # fmt: skip
    for name in ("r", "q", "p", "v", "v_ground", "w", "w_ground", "east", "y", "z", "depth", "theta", "phi"):
        if name in data and not (name == "depth" and np.median(data[name].values) > 0.0):
            words = f"of the other sign: positive is {positive[name]}"
            yield Mend("sign", (name,), words, "multiply it by -1", _scale([name], -1.0))
    for group in (["y", "z"], ["v", "w"], ["v_ground", "w_ground"], ["q", "r"], ["theta", "psi"]):
        if all(name in data for name in group):
            words = "of the other sign, as in axes with z up: z is down here and y to starboard"
            yield Mend("sign", tuple(group), words, "multiply them by -1", _scale(group, -1.0))


def _headings(data, headers) -> Iterator[Mend]:
    for name in ("psi", "heading", "cog"):
        if name not in data:
            continue
        header = headers[name]
        half, quarter = ("180", "90") if "_deg" in header else ("3.14159", "1.5708")
        for kind, sign, turns, words, remedy in (
            ("sign", -1.0, 0.0, "counted anticlockwise", "multiply it by -1"),
            ("origin", -1.0, 0.25, "counted anticlockwise from east", f"replace it by {quarter} - {header}"),
            ("origin", 1.0, 0.5, "off by half a turn", f"add {half} to it"),
            ("origin", 1.0, 0.25, "off by a quarter turn", f"add {quarter} to it"),
            ("origin", 1.0, -0.25, "off by a quarter turn", f"subtract {quarter} from it"),
        ):
            yield Mend(kind, (name,), words, remedy, _scale([name], sign, turns * TURN))
