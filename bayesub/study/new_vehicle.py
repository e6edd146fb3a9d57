"""New input files: a vehicle to fill in, with or without estimates from a hull geometry, and a hull geometry."""

import re
from pathlib import Path

import tomlkit

from bayesub.io import templates, toml_files
from bayesub.io.atomic import reason
from bayesub.io.errors import InputError
from bayesub.model.equations import AXES, EquationSet, load_equations
from bayesub.model.hulls import Hull

FORCES = {
    "X": "surge force",
    "Y": "sway force",
    "Z": "heave force",
    "K": "roll moment",
    "M": "pitch moment",
    "N": "yaw moment",
}


def vehicle(name: str, hull: Hull | None = None, equations: str = "booth") -> str:
    """The text of a vehicle file with every key; with a `hull`, its dimensions and what is estimated from it."""
    check_name(name)
    terms = load_equations(equations)
    text = templates.fill("bayesub.study", "new_vehicle.toml", name=name, equations=equations, **_body(hull))
    return text + _coefficients(terms, {} if hull is None else hull.estimates(terms))


def copied(name: str, source: str) -> str:
    """The text of the vehicle file `source` (built-in name or path) under another name."""
    check_name(name)
    path = toml_files.find(source, "vehicles")
    if "name" not in toml_files.read_toml_table(path):
        raise InputError(f"{source}: key 'name' is missing")
    document = tomlkit.parse(toml_files.read_text(path))
    document["name"] = name
    return document.as_string()


def geometry(name: str) -> str:
    """The text of a hull geometry file with every key."""
    check_name(name)
    return templates.fill("bayesub.study", "new_geometry.toml", name=name)


def write_new(path: Path, text: str) -> None:
    """Write `text` to a file that does not exist yet."""
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise InputError(f"{path}: exists already; choose another file with -o") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {reason(error)}") from None


def check_name(name: str) -> None:
    """InputError for a name that cannot be that of a file."""
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]*", name):
        raise InputError(f"a name is made of letters, digits, '_', '-' and '.', found '{name}'")


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


def _coefficients(equations: EquationSet, estimates) -> str:
    lines = []
    for axis in AXES:
        terms = [term for term in equations.terms if term.axis == axis]
        lines += ["", f"# {axis}, {FORCES[axis]} in {'N' if axis in 'XYZ' else 'N m'}"]
        for term in terms:
            estimate = estimates.get(term.name)
            value, note = "0", ""
            if estimate is not None:
                value = f"{{ value = {estimate.value:.4g}, sd = {estimate.sd:.2g} }}"
                note = f"; {estimate.source}"
            meaning = f"(rho/2) l^{term.length_power} {term.regressor.replace('*', ' ')}"
            lines.append(f"{term.name:<10} = {value:<{42 if estimates else 12}} # {meaning}{note}")
    return "\n".join(lines) + "\n"
