"""New input files: a vehicle, with or without estimates from a hull geometry, a hull geometry, and a study."""

import os
import re
from pathlib import Path

import numpy as np

from bayesub import inputs, logs
from bayesub.coefficients import AXES, TERMS
from bayesub.errors import InputError
from bayesub.hulls import Hull

_NORMAL_MEDIAN = 0.6745  # of the absolute value of a standard normal

FORCES = {
    "X": "surge force",
    "Y": "sway force",
    "Z": "heave force",
    "K": "roll moment",
    "M": "pitch moment",
    "N": "yaw moment",
}


def vehicle(name: str, hull: Hull | None = None) -> str:
    """The text of a vehicle file with every key; with a `hull`, its dimensions and what is estimated from it."""
    _check(name)
    text = (inputs.DATA / "templates" / "vehicle.toml").read_text(encoding="utf-8")
    return text.format(name=name, **_body(hull)) + _coefficients({} if hull is None else hull.estimates)


def copied(name: str, source: str) -> str:
    """The text of the vehicle file `source` (built-in name or path) under another name."""
    _check(name)
    text = inputs.read_text(inputs.find(source, "vehicles"))
    text, found = re.subn(r"(?m)^name\s*=.*$", f'name = "{name}"', text, count=1)
    if not found:
        raise InputError(f"{source}: has no key 'name' at the start of a line")
    return text


def geometry(name: str) -> str:
    """The text of a hull geometry file with every key."""
    _check(name)
    return (inputs.DATA / "templates" / "geometry.toml").read_text(encoding="utf-8").format(name=name)


def study(name: str, path: Path, vehicle: str, manoeuvre: str) -> str:
    """The text of a study file `path` that simulates a vehicle on a manoeuvre and measures its track."""
    return _study(
        name,
        path,
        vehicle,
        what=f"the manoeuvre {manoeuvre}",
        source=f'manoeuvre = "{manoeuvre}"',
        sensors=_SIMULATED,
        free={"horizontal": "horizontal", "vertical": "vertical"}.get(manoeuvre, "all"),
        centre='centre = "perturbed"          # a guess: the truth times (1 + perturbation_sd * normal); or "vehicle"\n'
        "perturbation_sd = 0.15",
        nuisance="# [nuisance]                  # what else is unknown\n# current_north_mps = { mean = 0.0, sd = 0.3 }",
        sqp_starts=5,
    )


def study_of_log(name: str, path: Path, vehicle: str, data: Path) -> str:
    """The text of a study file `path` on a log, with a sensor for each of its columns.

    The noise of each is guessed from its scatter: the median second difference of successive readings, over the root
    of six, for those that a smooth signal and independent noise have.
    """
    log = logs.read_log(data)
    columns = [column for column in logs.HEADERS.values() if column in _measured(log)]
    if not columns:
        raise InputError(f"{data}: has no column with readings")
    moves = {key: np.ptp(np.nan_to_num(log[key])) > 0.0 for key in logs.CONTROLS if key in log}
    planes = moves.get("delta_b", False) or moves.get("delta_s", False)
    free = "vertical" if planes and not moves.get("delta_r", False) else "all" if planes else "horizontal"
    plane = f'subproblem = "{free}"' + " " * (17 - len(free)) + "# the plane that the boat kept to, by its controls"
    return _study(
        name,
        path,
        vehicle,
        what=f"the log {data.name}",
        source=f'data = "{Path(os.path.relpath(data, path.parent)).as_posix()}"' + (f"\n{plane}" * (free != "all")),
        sensors="".join(_SENSOR.format(column=column, sd=f"{_scatter(column, log):.2g}") for column in columns),
        free=free,
        centre='centre = "vehicle"',
        nuisance=_IN_CURRENT if {"x_m", "y_m", "u_ground_mps", "v_ground_mps"} & set(columns) else _NUISANCE,
        sqp_starts=0,
    )


_SENSOR = """
[[sensors]]
kind = "sensor"
column = "{column}"
sd = {sd:<24} # CHANGE: guessed from its scatter; the data sheet knows
"""
_NUISANCE = """# [nuisance]                  # what else is unknown
# bias_yaw_deg = { mean = 0.0, sd = 2.0 }"""
_IN_CURRENT = """[nuisance]                    # what else is unknown; the start needs no entry
current_north_mps = { mean = 0.0, sd = 0.3 }
current_east_mps = { mean = 0.0, sd = 0.3 }"""
_SIMULATED = """
[[sensors]]                   # "track", "pressure", "compass", "ins", "dvl", "adcp", "sensor", or a preset
kind = "track"
position_sd_m = 0.5
attitude_sd_deg = 0.1
interval_s = 1.0
"""


def _study(name, path, vehicle, **parts) -> str:
    _check(name)
    text = (inputs.DATA / "templates" / "study.toml").read_text(encoding="utf-8")
    if vehicle not in inputs.built_in("vehicles"):
        vehicle = Path(os.path.relpath(vehicle)).as_posix()
    return text.format(name=name, file=path, vehicle=vehicle, **parts)


def _measured(log) -> set[str]:
    """Headers of the columns of a log that hold readings."""
    known = set(log) - {"time", "rpm", *logs.CONTROLS}
    return {logs.HEADERS[key] for key in known if np.isfinite(log[key]).sum() >= 3}


def _scatter(column, log) -> float:
    """Standard deviation, in the unit of the column, of what is not smooth in it; at least half its smallest step."""
    key, factor = logs.COLUMNS[column]
    readings = log[key][np.isfinite(log[key])]
    if key in ("psi", "heading"):
        readings = np.unwrap(readings)
    steps = np.abs(np.diff(readings))
    if not steps.any():
        raise InputError(f"column '{column}' never changes; give its sd yourself or leave it out")
    scatter = np.median(np.abs(np.diff(readings, 2))) / (_NORMAL_MEDIAN * np.sqrt(6.0))
    return float(max(scatter, 0.5 * steps[steps > 0.0].min())) / factor


def write_new(path: Path, text: str) -> None:
    """Write `text` to a file that does not exist yet."""
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise InputError(f"{path}: exists already; choose another file with -o") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {(error.strerror or str(error)).lower()}") from None


def _check(name: str) -> None:
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


def _coefficients(estimates) -> str:
    lines = []
    for axis in AXES:
        terms = [term for term in TERMS if term.axis == axis]
        lines += ["", f"# {axis}, {FORCES[axis]} in {'N' if axis in 'XYZ' else 'N m'}"]
        for term in terms:
            estimate = estimates.get(term.name)
            value, note = "0", ""
            if estimate is not None:
                value = f"{{ value = {estimate.value:.4g}, sd = {estimate.sd:.2g} }}"
                note = f"; {estimate.source}"
            meaning = f"(rho/2) l^{term.power} {term.regressor.replace('*', ' ')}"
            lines.append(f"{term.name:<10} = {value:<{42 if estimates else 12}} # {meaning}{note}")
    return "\n".join(lines) + "\n"
