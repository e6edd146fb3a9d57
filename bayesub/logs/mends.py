"""What may be wrong with columns, each with the change that mends it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from bayesub.logs.series import Series

KNOT = 1852.0 / 3600.0
DEGREE = np.pi / 180.0
TURN = 2.0 * np.pi


@dataclass(frozen=True)
class Mend:
    """One thing that may be wrong.

    Attributes
    ----------
    kind : str
        As of a :class:`bayesub.logs.finding.Finding`.
    names : tuple of str
        Short names of the columns that are wrong.
    message : str
        What they hold.
    remedy : str
        What to change.
    change : callable
        Readings by short name -> the same mended.
    """

    kind: str
    names: tuple[str, ...]
    message: str
    remedy: str
    change: Callable[[dict[str, Series]], dict[str, Series]]


def mends(data: dict[str, Series], headers: dict[str, str]) -> Iterator[Mend]:
    """All mends of the columns of a log, the likelier of two that do the same first.

    Parameters
    ----------
    data : dict of str to Series
        Short name -> readings.
    headers : dict of str to str
        Short name -> header of the column in its file.
    """
    yield from _headings(data, headers)
    yield from _renamed(data, headers)
    yield from _units(data, headers)
    yield from _signs(data)


def _with(names: dict[str, Callable]) -> Callable:
    """The change that gives columns the series that functions of all of them make."""

    def change(data):
        rest = {name: one for name, one in data.items() if name not in names}
        return rest | {name: make(data) for name, make in names.items() if make is not None}

    return change


def _scaled(name: str, factor: float) -> Callable:
    return _with({name: lambda data: data[name].scaled(factor)})


def _moved(old: str, new: str) -> Callable:
    return _with({old: None, new: lambda data: data[old]})


def _swapped(one: str, other: str) -> Callable:
    return _with({one: lambda data: data[other], other: lambda data: data[one]})


def _renamed(data, headers) -> Iterator[Mend]:
    for suffix in ("", "_ground"):
        u, v = f"u{suffix}", f"v{suffix}"
        if u in data and v in data and "north" not in data and "east" not in data:
            for first, second in (("north", "east"), ("east", "north")):
                change = _with({u: None, v: None, first: lambda d, u=u: d[u], second: lambda d, v=v: d[v]})
                names = f"velocity_{first}_mps, velocity_{second}_mps"
                words = f"velocities to {first} and {second}, not along the boat"
                yield Mend("axes", (u, v), words, f"rename them {names}", change)
    if "north" in data and "east" in data and not {"u", "v", "u_ground", "v_ground"} & set(data):
        change = _with({"north": None, "east": None, "u_ground": _of("north"), "v_ground": _of("east")})
        words = "velocities along the boat, not to north and east"
        yield Mend("axes", ("north", "east"), words, "rename them u_ground_mps, v_ground_mps", change)
    pairs = [("u", "v"), ("u_ground", "v_ground"), ("north", "east"), ("x", "y"), ("p", "r"), ("q", "r"), ("p", "q")]
    for one, other in pairs:
        if one in data and other in data:
            words = f"{headers[one]} holds what {headers[other]} should"
            yield Mend("name", (one, other), words, "exchange the two names", _swapped(one, other))
    angle_of = {"p": "roll", "q": "pitch", "r": "yaw"}
    for one in "pqr":
        for other in "pqr":
            if one in data and other not in data:
                header = headers[one].replace(f"{one}_", f"{other}_", 1)
                yield Mend("name", (one,), f"the rate of {angle_of[other]}", f"rename it {header}", _moved(one, other))
            elif one in data and other in data and one != other:
                header = headers[other]
                change = _with({one: None, other: _of(one)})
                words = f"the rate of {angle_of[other]}, which {header} is not"
                yield Mend("name", (one,), words, f"rename it {header} and leave out the column of that name", change)


def _of(name: str) -> Callable:
    return lambda data: data[name]


def _units(data, headers) -> Iterator[Mend]:
    for names in (["phi"], ["theta"], ["psi"], ["heading"], ["cog"], list("pqr"), ["p"], ["q"], ["r"]):
        present = tuple(name for name in names if name in data)
        if len(present) < min(2, len(names)):
            continue
        in_degrees = "_deg" in headers[present[0]]
        old, new, factor = ("_deg", "_rad", 1.0 / DEGREE) if in_degrees else ("_rad", "_deg", DEGREE)
        words = "radians" if in_degrees else "degrees"
        better = ", ".join(headers[name].replace(old, new) for name in present)
        change = _with({name: lambda d, name=name, f=factor: d[name].scaled(f) for name in present})
        yield Mend("unit", present, f"in {words}", f"rename {_it(present)} {better}", change)
    groups = (["u", "v", "w"], ["u_ground", "v_ground", "w_ground"], ["north", "east", "down"], ["sog"], ["stw"])
    for group in groups:
        present = tuple(name for name in group if name in data)
        if not present:
            continue
        for words, unit, factor in (("knots", "kn", KNOT), ("km/h", "", 1.0 / 3.6), ("cm/s", "", 0.01)):
            better = ", ".join(headers[name].replace("_mps", f"_{unit}") for name in present)
            remedy = f"rename {_it(present)} {better}" if unit else f"multiply {_it(present)} by {factor:.4g}"
            change = _with({name: lambda d, name=name, f=factor: d[name].scaled(f) for name in present})
            yield Mend("unit", present, f"in {words}", remedy, change)
    for words, factor in (("ms", 1e-3), ("minutes", 60.0)):
        remedy = f"multiply it by {factor:g}"

        def change(data, factor=factor):
            return {name: Series(factor * one.times, one.values) for name, one in data.items()}

        yield Mend("unit", ("time",), f"in {words}", remedy, change)


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
            yield Mend("sign", (name,), words, "multiply it by -1", _scaled(name, -1.0))
    for group in (["y", "z"], ["v", "w"], ["v_ground", "w_ground"], ["q", "r"], ["theta", "psi"]):
        if all(name in data for name in group):
            signs = {name: lambda d, name=name: d[name].scaled(-1.0) for name in group}
            words = "of the other sign, as in axes with z up: z is down here and y to starboard"
            yield Mend("sign", tuple(group), words, "multiply them by -1", _with(signs))


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

            def angle(data, name=name, sign=sign, turns=turns):
                return Series(data[name].times, sign * data[name].values + turns * TURN)

            yield Mend(kind, (name,), words, remedy, _with({name: angle}))
