"""Reading an equation set from its file, with one clear line for what cannot be."""

from __future__ import annotations

import functools
import keyword
import re
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import pydantic

from bayesub.io import toml_files
from bayesub.io.errors import InputError, error_source
from bayesub.io.toml_files import Section
from bayesub.io.words import LABEL, UNIT
from bayesub.kernels import workspace
from bayesub.logs.log_files import ACCELERATIONS, COLUMNS, CONTROL_COLUMNS, STATES, VELOCITIES
from bayesub.model.equations.equation_set import AXES, Control, EquationSet, Term
from bayesub.model.equations.regressors import SYMBOLS, Factor, Regressor, parse

DEFAULT = "booth"
SET_NAME = "[A-Za-z][A-Za-z0-9_-]*"  # what a set may be called
UNITS = ("deg", "n", "mps", "rpm")  # of controls: an angle, a force in newton, a speed, revolutions a minute
MAX_TERMS = 200  # of an axis
_N_SAMPLES = 2 * MAX_TERMS  # random motions on which terms are compared
_MAX_POWER = 50  # of length and speed, beyond those of any product that can be written
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,59}")
# What coefficients and controls cannot be called: symbols, other parameters of a motion, and words of the kernels.
_RESERVED = {*VELOCITIES, *SYMBOLS, *workspace.BODY, *(f"{state}0" for state in STATES), *AXES, *keyword.kwlist}
_RESERVED |= {"rho", "abs", "sgn", "sqrt", "inverse", "work", "i", "control", "row", "slopes", "LANES", "COEFFICIENTS"}
_RESERVED |= {"x", "y", "z", "height", "breadth", "crossflow"}
_RESERVED_BEGIN = re.compile(r"(?:[XYZKMN]|nu|V|[yz]|inverse|crossflow|external)_")  # of names in the kernels

# Powers of kg, m and s of the words in the unit of a coefficient; angles are numbers.
_BASE = {"kg": (1, 0, 0), "m": (0, 1, 0), "s": (0, 0, 1), "N": (1, 1, -2), "rpm": (0, 0, -1)}
_BASE |= dict.fromkeys(("rad", "1"), (0, 0, 0))
_UNIT = re.compile(rf"({'|'.join(_BASE)})(?:\^(-?\d{{1,2}}))?")


class TermSection(Section):
    """A term: its coefficient is non-dimensional by powers of length and speed, or has a unit."""

    regressor: str
    length_power: int | None = pydantic.Field(default=None, ge=-_MAX_POWER, le=_MAX_POWER)
    speed_power: int = pydantic.Field(default=0, ge=-_MAX_POWER, le=_MAX_POWER)
    unit: str | None = pydantic.Field(default=None, min_length=1)
    label: str = pydantic.Field(min_length=1)
    meaning: str = pydantic.Field(min_length=1)

    @pydantic.field_validator("label", "unit")
    @classmethod
    def _formula(cls, text: str | None, info: pydantic.ValidationInfo) -> str | None:
        if text is not None and not {"label": LABEL, "unit": UNIT}[str(info.field_name)].fullmatch(text):
            wanted = {"label": "a formula of LaTeX, such as X'_{u|u|}", "unit": "a unit, such as kg m^-1"}
            raise ValueError(f"must be {wanted[str(info.field_name)]}, found {text!r}")
        return text

    @pydantic.model_validator(mode="after")
    def _one_scale(self):
        if (self.length_power is None) == (self.unit is None):
            raise ValueError("give either length_power (a non-dimensional coefficient) or unit (a dimensional one)")
        if self.unit is not None and self.speed_power:
            raise ValueError("speed_power belongs to a non-dimensional coefficient; this one has a unit")
        return self


Terms = Annotated[dict[str, TermSection], pydantic.Field(default_factory=dict)]


class AxesSection(Section):
    """The terms of each axis."""

    X: Terms
    Y: Terms
    Z: Terms
    K: Terms
    M: Terms
    N: Terms


class EquationFile(Section):
    """The content of an equation file."""

    name: str = pydantic.Field(pattern=f"^{SET_NAME}$", max_length=60)
    title: str
    description: str = ""
    reference: str = ""
    extends: str | None = None
    degrees_of_freedom: Literal[3, 6] = 6
    rigid_body_terms: Literal["separate", "in_coefficients"] = "separate"
    speed: Literal["trial", "instantaneous"] = "trial"
    stations: int = pydantic.Field(default=16, ge=2, le=32)
    controls: dict[str, str] = pydantic.Field(default_factory=dict)
    terms: AxesSection

    @pydantic.field_validator("controls")
    @classmethod
    def _known_units(cls, controls: dict[str, str]) -> dict[str, str]:
        for symbol, column in controls.items():
            if not _NAME.fullmatch(symbol) or symbol in _RESERVED or _RESERVED_BEGIN.match(symbol):
                raise ValueError(f"'{symbol}' cannot name a control; choose another symbol, such as dr")
            unit = "rpm" if column == "rpm" else column.rpartition("_")[2]
            if not _NAME.fullmatch(column) or unit not in UNITS or column == unit != "rpm":
                what = f"{symbol}: '{column}' is no column of a log"
                raise ValueError(f"{what}: end it with _deg, _n or _mps, or write rpm")
            if column in COLUMNS and column not in CONTROL_COLUMNS:
                raise ValueError(f"{symbol}: '{column}' is that of the motion of the boat; choose another")
        if len(set(controls.values())) < len(controls):
            raise ValueError("two controls have the same column")
        return controls


def load_equations(name: str | Path, located: Callable[[str], str] = str) -> EquationSet:
    """Load a built-in equation set by name or an equation file by path, which is where `located` says.

    InputError, with file, key and remedy, for a term that is given twice or depends linearly on others, an unknown
    symbol, and a coefficient whose powers make no force.
    """
    *extensions, base = _extended(str(name), located).values()
    equations = _load(*base, None)
    for path, text in reversed(extensions):
        equations = _load(path, text, equations)
    return equations


def equation_files(name: str | Path, located: Callable[[str], str] = str) -> list[str]:
    """The paths of the files that a set is read from, those that it extends included; none for a built-in set.

    Parameters are those of :func:`load_equations`.
    """
    return [file for file in _extended(str(name), located) if toml_files.is_path(file)]


def _extended(name: str, located: Callable[[str], str]) -> dict[str, tuple[Path, str]]:
    """Name -> file and text, of a set and of those that it extends, one after the other."""
    files: dict[str, tuple[Path, str]] = {}
    while True:
        path = toml_files.find(located(name), "equations")
        files[name] = path, toml_files.read_text(path)
        file = _read(*files[name])
        if file.extends is None:
            return files
        name = beside(name, file.extends)
        with error_source(f"{path}: extends"):
            chain = [path for path, _ in files.values()]
            base = toml_files.find(located(name), "equations")
            if base.resolve() in {path.resolve() for path in chain}:
                text = f"a set cannot extend itself ({' extends '.join(p.name for p in (*chain, base))})"
                raise InputError(text, "model", "extends")


@functools.lru_cache(maxsize=64)
def _read(path: Path, _text: str) -> EquationFile:
    """The content of a file; its text is asked for so that a changed file is read again."""
    return toml_files.read_toml(path, EquationFile)


@functools.lru_cache(maxsize=64)
def _load(path: Path, text: str, base: EquationSet | None) -> EquationSet:
    """The set of a file that extends `base`."""
    file = _read(path, text)
    try:
        equations = _built(file, base)
        _check_motions(equations)
        _check_scales(equations)
        _check_independence(equations)
    except ValueError as error:
        raise InputError(f"{path}: {error}", "model", str(error).partition(":")[0]) from None
    return equations


def beside(path: str | Path, name: str) -> str:
    """A built-in name as it is, the path of a file as seen from the folder of another file."""
    return (Path(path).parent / name).as_posix() if toml_files.is_path(name) else name


def _built(file: EquationFile, base: EquationSet | None) -> EquationSet:
    controls = {control.symbol: control for control in base.controls} if base else {}
    of_base = f"'{base.name}'" if base else ""
    for symbol, column in file.controls.items():
        if controls.get(symbol, Control(symbol, column)).column != column:
            raise ValueError(f"controls.{symbol}: is '{controls[symbol].column}' in {of_base}")
        if any(other.column == column and other.symbol != symbol for other in controls.values()):
            raise ValueError(f"controls.{symbol}: '{column}' has another symbol in {of_base}")
        controls[symbol] = Control(symbol, column)
    inherited = {term.name: term for term in base.terms} if base else {}
    values = {key: getattr(file, key) for key in ("degrees_of_freedom", "rigid_body_terms", "speed", "stations")}
    if base:
        values |= {key: getattr(base, key) for key in values if key not in file.model_fields_set}
        if values["speed"] != base.speed and any(term.speed_power for term in base.terms):
            raise ValueError(f"speed: is '{base.speed}' in '{base.name}', whose terms have powers of it")
    terms = []
    for axis in AXES:
        terms += [term for term in inherited.values() if term.axis == axis]
        for name, section in getattr(file.terms, axis).items():
            if not _NAME.fullmatch(name) or name in _RESERVED | controls.keys():
                raise ValueError(f"terms.{axis}.{name}: cannot name a coefficient; use letters, digits and underscores")
            if any(term.name == name for term in (*terms, *inherited.values())):
                raise ValueError(f"terms.{axis}.{name}: is given twice; give one of the two another name")
            terms.append(_term(name, axis, section, values["speed"], controls))
        if sum(term.axis == axis for term in terms) > MAX_TERMS:
            raise ValueError(f"terms.{axis}: there are more than {MAX_TERMS}")
    if not terms:
        raise ValueError('terms: there are none; add some, such as [terms.X] Xuu = { regressor = "u*u", .. }')
    values |= {key: getattr(file, key) for key in ("name", "title", "description", "reference")}
    return EquationSet(terms=tuple(terms), controls=tuple(controls.values()), **values)


def _term(name: str, axis: str, section: TermSection, speed: str, controls) -> Term:
    try:
        parsed = parse(section.regressor, controls)
    except ValueError as error:
        raise ValueError(f"terms.{axis}.{name}: regressor {error}") from None
    if speed == "instantaneous" and section.speed_power:
        function = "inverse" if section.speed_power < 0 else ""
        parsed = Regressor((*parsed.factors, *[Factor("V", function)] * abs(section.speed_power)))
    label = section.label if section.label.startswith("$") else f"${section.label}$"
    # An added mass is known by its text, which may have been written as "vdot*1".
    text = next((symbol for symbol in parsed.symbols if symbol in ACCELERATIONS), section.regressor.strip())
    powers = section.length_power or 0, section.speed_power
    return Term(name, axis, text, parsed, *powers, section.unit, label, section.meaning)


def _check_motions(equations: EquationSet) -> None:
    """ValueError for a term of heave, roll or pitch in a set of three degrees of freedom."""
    if equations.degrees_of_freedom == 6:
        return
    for term in equations.terms:
        if term.name not in equations.subproblems["horizontal"]:
            what = f"terms.{term.axis}.{term.name}: degrees_of_freedom = 3 are surge, sway and yaw, with forces X, Y "
            what += "and N of u, v, r and controls other than planes"
            raise ValueError(f"{what}; leave the term out or set degrees_of_freedom = 6")


def _check_scales(equations: EquationSet) -> None:
    """ValueError for a coefficient whose powers or unit do not make a force or a moment."""
    controls = {control.symbol: control.dimension for control in equations.controls}
    for term in equations.terms:
        forces = [c.symbol for c in equations.controls if c.column.endswith("_n") and c.symbol in term.symbols]
        if term.unit is not None:
            _check_unit(term, controls, forces)
            continue
        if forces:
            what = f"terms.{term.axis}.{term.name}: {forces[0]} is a force in N already"
            raise ValueError(f'{what}; give unit, such as unit = "1", in place of length_power')
        metres, seconds = term.parsed.dimension(controls)
        if equations.speed == "trial":
            metres, seconds = metres + term.speed_power, seconds - term.speed_power
        metres += term.length_power
        wanted = 4 if term.axis in "XYZ" else 5
        if (metres, seconds) != (wanted, -2):
            speed = seconds + 2  # powers of the speed that are too few
            length = term.length_power + wanted - metres - speed
            kind = "force" if wanted == 4 else "moment"
            what = f"(rho/2) l^{term.length_power} U^{term.speed_power} * {term.regressor} is no {kind}"
            remedy = f"with length_power = {length} and speed_power = {term.speed_power + speed} it would be"
            raise ValueError(f"terms.{term.axis}.{term.name}: {what}; {remedy}")


def _check_unit(term: Term, controls: dict[str, tuple[int, int]], forces: list[str]) -> None:
    """ValueError for a unit with which the term is no force or moment; one of other words than these is not judged."""
    unit, given = term.unit or "", np.zeros(3, dtype=int)
    for k, part in enumerate(unit.split("/")):
        for word in part.replace("*", " ").split():
            match = _UNIT.fullmatch(word)
            if not match or k > 1:
                return
            given += (1 if k == 0 else -1) * int(match[2] or 1) * np.array(_BASE[match[1]])
    metres, seconds = term.parsed.dimension(controls)
    wanted = np.array([1, (1 if term.axis in "XYZ" else 2) - metres, -2 - seconds])
    wanted -= sum(f.symbol in forces for f in term.parsed.factors if f.function != "sgn") * np.array(_BASE["N"])
    if (given != wanted).any():
        fit = " ".join(b if n == 1 else f"{b}^{n}" for b, n in zip(("kg", "m", "s"), wanted, strict=True) if n) or "1"
        kind = "force" if term.axis in "XYZ" else "moment"
        what = f"terms.{term.axis}.{term.name}: {term.regressor} with a coefficient in {unit} is no {kind}"
        raise ValueError(f"{what}; in {fit} it would be")


def _check_independence(equations: EquationSet) -> None:
    """ValueError for terms of an axis that are linearly dependent whatever the motion."""
    rng = np.random.default_rng(0)
    states, accelerations = rng.standard_normal((_N_SAMPLES, 12)), rng.standard_normal((_N_SAMPLES, 6))
    controls = rng.standard_normal((_N_SAMPLES, len(equations.controls) + 1))
    hull = np.stack([np.linspace(-0.5, 0.4, 7), rng.uniform(0.5, 1.0, 7), rng.uniform(0.5, 1.0, 7)])
    blocks = equations.regressors(states, accelerations, controls, equations.constants(1.3, hull))
    for axis, block in blocks.items():
        names = equations.names_of_axis(axis)
        scaled = block / np.linalg.norm(block, axis=0)
        distances = np.abs(np.diag(np.linalg.qr(scaled, mode="r")))  # of each column from those before it
        dependent = np.flatnonzero(distances < 1e-9)
        if dependent.size:
            k = dependent[0]
            solution, *_ = np.linalg.lstsq(scaled[:, :k], scaled[:, k])
            others = [names[j] for j in np.flatnonzero(np.abs(solution) > 1e-6)]
            same = "is the same as" if len(others) == 1 else "depends linearly on"
            what = f"its regressor {same} that of {' and '.join(others)}, whatever the motion"
            raise ValueError(f"terms.{axis}.{names[k]}: {what}; leave one out")
