"""New input files: equations, a vehicle with or without estimates from a hull geometry, that geometry, maps.

Names are checked, a copy of a file has another name, and nothing is overwritten.
"""

import math
import os
import re
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import tomlkit

from bayesub.io import templates, toml_files
from bayesub.io.atomic import reason, write_text
from bayesub.io.errors import InputError
from bayesub.io.words import listed
from bayesub.model.equations import AXES, EquationSet, load_equations
from bayesub.model.equations.files import DEFAULT, SET_NAME
from bayesub.model.hulls import Hull

if TYPE_CHECKING:
    from bayesub.design.knowledge import Knowledge

N_STATIONS = 21  # along the hull of a geometry
UNTOUCHED = 0.9  # posterior sd over prior sd from which a coefficient is known by the prior alone


def check_name(name: str) -> None:
    """InputError for a name that cannot be that of a file."""
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]*", name):
        raise InputError(f"a name is made of letters, digits, '_', '-' and '.', found '{name}'", "value", "name")


def write_new(path: Path, text: str) -> None:
    """Write `text` to a file that does not exist yet."""
    if os.path.lexists(path):
        raise InputError(f"{path}: exists already; choose another file with -o", "file", "-o")
    try:
        write_text(path, text)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {reason(error)}", "file", "-o") from None


def seen_from(path: Path, name: str | Path) -> str:
    """A vehicle, manoeuvre or equation set as the file `path` names it: a built-in name as it is."""
    return relative(path, name) if toml_files.is_path(str(name)) else str(name)


def relative(path: Path, file: str | Path) -> str:
    """The path of a file as seen from the folder of the file `path`."""
    return Path(os.path.relpath(file, path.parent)).as_posix()


def _copied(name: str, source: str, kind: str, path: Path, equations_key: str) -> str:
    """The text of a file of a kind under another name; a path under `equations_key` is seen from `path`."""
    file = toml_files.find(source, kind)
    if "name" not in toml_files.read_toml_table(file):
        raise InputError(f"{source}: key 'name' is missing", "missing", "name")
    document = tomlkit.parse(toml_files.read_text(file))
    document["name"] = name
    equations = document.get(equations_key)
    if isinstance(equations, str) and toml_files.is_path(equations):
        document[equations_key] = seen_from(path, file.parent / equations)
    return document.as_string()


def equations(name: str, source: str | None = None, path: Path = Path()) -> str:
    """The text of an equation file `path` that explains every key, with a short set as an example.

    Of a `source` (built-in name or path) it is that set under another name.
    """
    if not re.fullmatch(SET_NAME, name):
        text = f"an equation set is named by letters, digits, '_' and '-', beginning with a letter, found '{name}'"
        raise InputError(text, "value", "name")
    if source is not None:
        return _copied(name, source, "equations", path, "extends")
    return templates.fill("bayesub.study.new", "new_equations.toml", name=name)


def vehicle(name: str, hull: Hull | None = None, equations: str = DEFAULT, path: Path = Path()) -> str:
    """The text of a vehicle file `path` with every key, with dimensions and estimates from a hull if there is one.

    The equations are a built-in name or a path.
    """
    check_name(name)
    terms = load_equations(equations)
    values = _body(hull) | _words(terms) | {"equations": seen_from(path, equations)}
    values["stations"] = _stations(hull) if terms.has_crossflow else {}
    values["estimates"] = {} if hull is None else hull.estimates(terms)
    return templates.fill("bayesub.study.new", "new_vehicle.toml", name=name, is_example=hull is None, **values)


def copied_vehicle(name: str, source: str, path: Path = Path()) -> str:
    """The text of a vehicle file `path`: the vehicle `source` (built-in name or path) under another name."""
    check_name(name)
    return _copied(name, source, "vehicles", path, "equations")


def captive_vehicle(name: str, source: str, table: Path, path: Path) -> tuple[str, list[tuple[str, ...]]]:
    """The text of a vehicle file `path`, and a line of words for each axis.

    It is `source` (built-in name or path) under another name, with what a table of captive tests says (CSV).
    """
    from bayesub.design.captive import SD, known_by
    from bayesub.model.vehicles import load_vehicle

    boat = load_vehicle(source)
    known, before, words = known_by(boat, table)
    document, origin = tomlkit.parse(copied_vehicle(name, source, path)), f"captive tests of {table.name}"
    contraction = dict(zip(known.names, (known.sd / before).tolist(), strict=True))
    head = f"# Coefficients by {origin}. Their prior had the sds of '{source}', else {SD:g} of the values there.\n"
    return head + with_knowledge(document, origin, known, contraction), words


def with_knowledge(document: tomlkit.TOMLDocument, origin: str, known: "Knowledge", ratios: dict[str, float]) -> str:
    """The text of a vehicle file with what is known of its coefficients, from where, and posterior over prior sds.

    ``[prior] kind = "vehicle"`` of a study reads it back.
    """
    table, reference = document["coefficients"], document.get("reference", "")
    document["reference"] = f"{reference.rstrip('. ')}; {origin}" if reference else origin
    for name, mean, sd in zip(known.names, known.mean.tolist(), known.sd.tolist(), strict=True):
        ratio = ratios.get(name, math.nan)
        remark = "by the prior alone: {:.2g} of its sd" if ratio >= UNTOUCHED else "{:.2g} of the prior's sd"
        table[name] = tomlkit.inline_table()
        table[name].update({"value": mean, "sd": sd})
        table[name].comment("no part in the trial; by its correlations" if math.isnan(ratio) else remark.format(ratio))
    document.pop("correlations", None)
    text = document.as_string().rstrip() + "\n"
    if len(known.names) > 1:
        rows = "".join(f"    [{', '.join(map(repr, row))}],\n" for row in known.correlation.tolist())
        names = ", ".join(f'"{name}"' for name in known.names)
        text += f"\n[correlations]\ncoefficients = [{names}]\nmatrix = [\n{rows}]\n"
    return text


def geometry(name: str) -> str:
    """The text of a hull geometry file with every key."""
    check_name(name)
    return templates.fill("bayesub.study.new", "new_geometry.toml", name=name)


def map_of(kind: str, path: Path, data: Path | None = None) -> str:
    """The text of a map file `path` for `bayesub convert`: the example of a kind of log, with the signals of a log."""
    text = toml_files.read_text(toml_files.built_in("maps")[kind])
    signals = []
    if data is not None:
        from bayesub.logs import readers

        signals = [(name, signal.unit) for name, signal in readers.read(kind, [data], is_listed=True).signals.items()]
    values = {"kind": kind, "path": path, "source": data, "signals": signals, "example": text.rstrip()}
    return templates.fill("bayesub.study.new", "new_map.toml", **values)


def _body(hull: Hull | None) -> dict[str, str]:
    """What the template leaves open of the section [body]; a boat to be changed if nothing is known."""
    if hull is None:
        values = {"length": 5.0, "density": 1025.0, "mass": 1000.0, "centre": 0.0}
        inertia = dict.fromkeys(("Ixx", "Iyy", "Izz"), 0.0) | {"Ixx": 50.0, "Iyy": 1500.0, "Izz": 1500.0}
        note = "CHANGE: an example"
    else:
        density, mass, arm = hull.file.water_density_kgm3, hull.mass_kg, hull.origin - hull.centre
        moments = density * hull.displaced_inertia + [0.0, mass * arm**2, mass * arm**2]
        values = {"length": hull.file.hull.length_m, "density": density, "mass": mass, "centre": arm}
        inertia = dict(zip(("Ixx", "Iyy", "Izz"), moments, strict=True))
        note = "of the displaced water, as if the boat were of one density"
    return {key: f"{value:.6g}" for key, value in (values | inertia).items()} | {"note": note}


def _words(equations: EquationSet) -> dict:
    """What the template says of the terms of a set."""
    terms = equations.terms
    speed = "V" if equations.speed == "instantaneous" else "U"  # on which coefficients are non-dimensional
    ahead = [term for term in terms if term.axis == "X" and term.symbols <= {"u", "V", "U", "du", "uc", "duc"}]
    drag = [term.name for term in ahead if term.unit is None and (term.length_power, term.speed_power) == (2, 0)]
    examples = (term.name for term in terms if term.axis == "Y" and "v" in term.symbols)
    is_scaled = any(term.speed_power for term in terms)
    return {
        "terms": {axis: [equations.term(name) for name in equations.names_of_axis(axis)] for axis in AXES},
        "width": max(10, *map(len, equations.names)),
        "speed": speed,
        "is_scaled": is_scaled,
        "is_dimensional": any(term.unit for term in terms),
        "symbols": frozenset().union(*(term.symbols for term in terms)) | ({speed} if is_scaled else set()),
        "functions": {factor.function for term in terms for factor in term.parsed.factors},
        "controls": _controls(equations),
        "commented": lambda text: textwrap.fill(text, 118, initial_indent="# ", subsequent_indent="# "),
        "example": next(examples, equations.names[0]),
        "drag": f"-{drag[0]}" if len(drag) == len(ahead) == 1 else "d",
        "own_thrust": any(term.symbols & {"du", "uc", "duc"} for term in ahead),
    }


def _controls(equations: EquationSet) -> list[str]:
    """The controls in words, those of one unit together: ``dr ds rudder and stern plane in rad``."""
    texts = []
    for suffix, unit in (("_deg", "rad"), ("_n", "N"), ("_mps", "m/s"), ("rpm", "revolutions per minute")):
        controls = [control for control in equations.controls if control.column.endswith(suffix)]
        names = [control.column.removesuffix(suffix).replace("_", " ") or "propeller" for control in controls]
        if controls:
            texts.append(f"{' '.join(control.symbol for control in controls)} {listed(names)} in {unit}")
    return texts


def _stations(hull: Hull | None) -> dict[str, list[float]]:
    """The section [hull]: of a hull geometry, or of an example."""
    if hull is None:
        x, height, breadth = np.array([[-2.5, -1.5, 2.0, 2.5], [0.0, 0.5, 0.5, 0.0], [0.0, 0.5, 0.5, 0.0]])
    else:
        length = hull.file.hull.length_m
        aft = 0.5 * length * (1.0 + np.cos(np.linspace(0.0, np.pi, N_STATIONS)))  # denser at the ends; tail first
        x = hull.origin - aft
        breadth, height = (2.0 * half for half in hull.file.hull.half_widths(aft))
    return {
        key: [round(float(value), 5) for value in values]
        for key, values in (("x_m", x), ("height_m", height), ("breadth_m", breadth))
    }
