"""Writes ``hydrodynamics.py``, the forces of an equation set and sub-problem and their derivatives, for the kernels.

    python -m bayesub.model.equations.generate

writes those of the built-in sets, which are committed, so that they can be read and stepped through; a test checks
that they are current. Those of other sets are written where they are cached. Forces that a sub-problem does not have
are left out, but for what keeps the last digits.
"""

from __future__ import annotations

import functools
import hashlib
import os
import tempfile
import textwrap
from collections.abc import Callable
from pathlib import Path

import platformdirs

from bayesub.io import atomic, toml_files
from bayesub.io.log_files import ACCELERATIONS, VELOCITIES
from bayesub.kernels import workspace
from bayesub.model.equations.equation_set import AXES, EquationSet, Term
from bayesub.model.equations.regressors import CROSSFLOW, Regressor

BUILT_IN = Path(__file__).parents[2] / "kernels" / "sets"

_HEADER = '''\
"""Hydrodynamic forces of one lane, by bayesub.model.equations.generate: do not edit.

Equations '{name}', {motion}, {terms} terms.
"""

from math import sqrt

from bayesub.kernels.jit import inline
from bayesub.kernels.workspace import COEFFICIENTS, LANES

N_COEFFICIENTS = {n_coefficients}
N_CONTROLS = {n_controls}
ORDERED_SPEED = {ordered}  # position of n/k0 among the controls
N_CONSTANTS = {n_constants}
RIGID_BODY_TERMS = {rigid_body}  # whether the velocity terms of the rigid body are apart from the coefficients

# (axis, acceleration, coefficient) of the added-mass terms, which stand in the mass matrix.
ADDED_MASS = {added_mass}


@inline
def sgn(x):
    """Sign of x; zero for zero."""
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)

{crossflow}
@inline
def hydrodynamic_forces(work, i, control, u, v, w, p, q, r):
    """X, Y, Z (N) and K, M, N (N m) of lane `i`, terms without accelerations (model manual, section 4)."""
{forces}


@inline
def hydrodynamic_gradient(work, i, control, u, v, w, p, q, r):
    """Derivatives of :func:`hydrodynamic_forces` by u, v, w, p, q and r, six forces each."""
{gradient}


@inline
def store_regressors(row, work, i, control, u, v, w, p, q, r, udot, vdot, wdot, pdot, qdot, rdot):
    """Write the regressors of the terms into `row`; zero for those that play no part."""
{regressors}


@inline
def store_control_slopes(slopes, work, i, control, u, v, w, p, q, r):
    """Add the derivatives of the forces by the controls into `slopes` (6, N_CONTROLS)."""
{controls}
'''

_CROSSFLOW = '''
@inline
def crossflow(x, height, breadth, v, w, q, r):
    """Side and normal force of the local cross-flow at a station, without density and drag coefficient."""
    v, w = v + x * r, w - x * q
    speed = sqrt(v * v + w * w)
    return -height * v * speed, -breadth * w * speed


@inline
def crossflow_slopes(x, height, breadth, v, w, q, r):
    """Derivatives of :func:`crossflow` by the local velocities across and down: y by v, y by w, z by v, z by w."""
    v, w = v + x * r, w - x * q
    speed = sqrt(v * v + w * w)
    inverse = 1.0 / speed if speed > 0.0 else 0.0
    vw = v * w * inverse
    return -height * (speed + v * v * inverse), -height * vw, -breadth * vw, -breadth * (speed + w * w * inverse)

'''
WEIGHTS = ("external_W", "external_Wx", "external_Wy", "external_Wz")  # a weight, and its moments about the origin
EXTERNAL = (*(f"external_{axis}{suffix}" for suffix in ("", "_u") for axis in AXES), *WEIGHTS)


def source(equations: EquationSet, subproblem: str | None, external: bool = False) -> str:
    """The text of the module for a set and a sub-problem.

    With `external` the controls end on sixteen more: forces and moments from outside, what of them goes with the surge
    velocity, and a weight with its moments about the origin.
    """
    return _Writer(equations, subproblem, external).text()


class _Writer:
    def __init__(self, equations, subproblem, external):
        self.equations, self.subproblem, self.external = equations, subproblem, external
        active = set(equations.active(subproblem=subproblem))
        self.terms = [(k, term) for k, term in enumerate(equations.terms) if term.name in active]
        self.active = active
        self.steady = [(k, term) for k, term in enumerate(equations.terms) if not term.is_added_mass]
        self.controls = [*(control.symbol for control in equations.controls), "uc", *(EXTERNAL if external else ())]
        self.n_constants = 1 + 3 * equations.stations * equations.has_crossflow
        self.first_control = workspace.COEFFICIENTS + len(equations.terms)
        self.first_constant = self.first_control + len(self.controls)

    def text(self) -> str:
        added = tuple(
            (AXES.index(t.axis), ACCELERATIONS.index(t.regressor), k) for k, t in self.terms if t.is_added_mass
        )
        n_terms = len(self.equations.terms)
        motion = (
            f"{self.subproblem or 'all'} degrees of freedom"
            if not self.subproblem
            else f"{self.subproblem} sub-problem"
        )
        integrates = any(term.symbols & set(CROSSFLOW) for _, term in self.terms)
        parts = {
            "name": self.equations.name,
            "motion": motion + (", forces from outside" if self.external else ""),
            "terms": str(len(self.terms)) if len(self.terms) == n_terms else f"{len(self.terms)} of {n_terms}",
            "n_coefficients": str(n_terms),
            "n_controls": str(len(self.controls)),
            "ordered": str(len(self.equations.controls)),
            "n_constants": str(self.n_constants),
            "rigid_body": str(self.equations.rigid_body_terms == "separate"),
            "added_mass": str(added),
            "crossflow": _CROSSFLOW if integrates else "",
        }
        bodies = {"forces": self._forces(), "gradient": self._gradient()}
        bodies |= {"regressors": self._regressors(), "controls": self._control_slopes()}
        text = _HEADER
        for name, part in parts.items():
            text = text.replace(f"{{{name}}}", part)
        for name, lines in bodies.items():
            text = text.replace(f"{{{name}}}", textwrap.indent("\n".join(lines), "    "))
        return text

    def _parts(self, axis: str, expression: Callable[[Regressor], str]) -> list[tuple[int, Term, str]]:
        """Position, term and expression of the summands of an axis, if any plays a part.

        The first two stay in any case: a compiler that contracts multiplies and adds begins with either of them, so
        that without one of them the last digits would be others than those of the whole sum.
        """
        parts = [(k, t, text) for k, t in self.steady if t.axis == axis and (text := expression(t.parsed))]
        if not any(term.name in self.active for _, term, _ in parts):
            return []
        return [part for n, part in enumerate(parts) if n < 2 or part[1].name in self.active]

    def _forces(self) -> list[str]:
        sums, used = [], []
        for axis in AXES:
            parts = self._parts(axis, lambda regressor: regressor.code)
            used += [term for _, term, _ in parts]
            sums += _sum(axis, parts, f"external_{axis} + external_{axis}_u * u" if self.external else "")
        return [*self._values(used, of_external=True), *sums, f"return {', '.join(AXES)}"]

    def _gradient(self) -> list[str]:
        sums, used = [], []
        for axis in AXES:
            for variable in VELOCITIES:
                parts = self._parts(axis, lambda regressor, x=variable: regressor.derivative(x))
                used += [term for _, term, _ in parts]
                external = f"external_{axis}_u" if self.external and variable == "u" else ""
                sums += _sum(f"{axis}_{variable}", parts, external)
        columns = ["(" + ", ".join(f"{axis}_{variable}" for axis in AXES) + ")" for variable in VELOCITIES]
        lines = [*self._values(used, of_external=True), *self._slopes_of_values(used), *sums]
        return [*lines, "return (", *(f"    {column}," for column in columns), ")"]

    def _regressors(self) -> list[str]:
        active = dict(self.terms)
        rows = [
            f"row[{k}] = {active[k].parsed.code if k in active else '0.0'}  # {term.name}"
            for k, term in enumerate(self.equations.terms)
        ]
        return [*self._values([term for _, term in self.terms]), *rows]

    def _control_slopes(self) -> list[str]:
        sums, used = [], []
        for k, control in enumerate(self.controls):
            for a, axis in enumerate(AXES):
                parts = self._parts(axis, lambda regressor, x=control: regressor.derivative(x))
                used += [term for _, term, _ in parts]
                factor = {f"external_{axis}": "1.0", f"external_{axis}_u": "u"}.get(control, "")
                if parts or factor:
                    sums += _sum(f"slopes[{a}, {k}]", parts, factor)
        return [*self._values(used), *sums] or ["pass"]

    def _values(self, terms: list[Term], of_external: bool = False) -> list[str]:
        """Assignments of what the regressors of these terms contain besides velocities and accelerations."""
        symbols = {symbol for term in terms for symbol in term.symbols}
        lines = []
        for k, control in enumerate(self.controls):
            needed = symbols | ({"uc"} if "duc" in symbols else set())
            if control in needed or (of_external and control in EXTERNAL and control not in WEIGHTS):
                lines.append(f"{control} = control[{k}] + work[{self.first_control + k} * LANES + i]")
        if symbols & {"U", "du"}:
            lines.append(f"U = work[{self.first_constant} * LANES + i]")
        if "nu" in symbols:
            lines.append("nu = sqrt(v * v + w * w)")
        if "V" in symbols:
            lines.append("V = sqrt(u * u + v * v + w * w)")
            lines.append("inverse_V = 1.0 / V if V > 0.0 else 0.0")
        lines += ["du = u - U"] if "du" in symbols else []
        lines += ["duc = uc - u"] if "duc" in symbols else []
        if symbols & set(CROSSFLOW):
            lines += ["crossflow_y = crossflow_z = crossflow_m = crossflow_n = 0.0"]
            for s in range(self.equations.stations):
                lines += [
                    *self._station(s),
                    "y, z = crossflow(x, height, breadth, v, w, q, r)",
                    "crossflow_y, crossflow_n = crossflow_y + y, crossflow_n + x * y",
                    "crossflow_z, crossflow_m = crossflow_z + z, crossflow_m - x * z",
                ]
        return lines

    def _slopes_of_values(self, terms: list[Term]) -> list[str]:
        """Assignments of the derivatives of what :meth:`_values` assigns."""
        symbols = {symbol for term in terms for symbol in term.symbols}
        lines = []
        if "nu" in symbols:
            lines += ["inverse = 1.0 / nu if nu > 0.0 else 0.0", "nu_v, nu_w = v * inverse, w * inverse"]
        if "V" in symbols:
            lines += ["V_u, V_v, V_w = u * inverse_V, v * inverse_V, w * inverse_V"]
        if symbols & set(CROSSFLOW):
            names = [f"crossflow_{force}_{x}" for force in "yzmn" for x in "vwqr"]
            lines += [f"{' = '.join(names)} = 0.0"]
            for s in range(self.equations.stations):
                lines += [*self._station(s), "y_v, y_w, z_v, z_w = crossflow_slopes(x, height, breadth, v, w, q, r)"]
                # Local velocities are v + x r and w - x q; moments are x times the side force, -x times the normal.
                for force, moment, sign in (("y", "n", ""), ("z", "m", "-")):
                    for x, slope in (
                        ("v", f"{force}_v"),
                        ("w", f"{force}_w"),
                        ("q", f"-x * {force}_w"),
                        ("r", f"x * {force}_v"),
                    ):
                        lines += [f"crossflow_{force}_{x} += {slope}", f"crossflow_{moment}_{x} += {sign}x * ({slope})"]
        return lines

    def _station(self, s: int) -> list[str]:
        rows = [self.first_constant + 1 + k * self.equations.stations + s for k in range(3)]
        return [f"x, height, breadth = {', '.join(f'work[{row} * LANES + i]' for row in rows)}"]


def _sum(target: str, parts: list[tuple[int, Term, str]], external: str = "") -> list[str]:
    """Lines that assign the sum of coefficient times expression to `target`."""
    if not parts:
        return [f"{target} = {external or '0.0'}"]
    signs = [""] + ["+ "] * (len(parts) - 1)
    return [
        f"{target} = (",
        *(
            f"    {sign}work[(COEFFICIENTS + {k}) * LANES + i] * ({expression})  # {term.name}"
            for sign, (k, term, expression) in zip(signs, parts, strict=True)
        ),
        *([f"    + {external}"] if external else []),
        ")",
    ]


@functools.cache
def _directory(equations: EquationSet, subproblem: str | None, external: bool) -> Path:
    text = source(equations, subproblem, external)
    committed = BUILT_IN / equations.name / (subproblem or "full")
    if (
        not external
        and (committed / "hydrodynamics.py").is_file()
        and (committed / "hydrodynamics.py").read_text() == text
    ):
        return committed
    folder = (
        Path(platformdirs.user_cache_dir("bayesub"))
        / f"{equations.name}-{hashlib.sha256(text.encode()).hexdigest()[:16]}"
    )
    if not (folder / "hydrodynamics.py").is_file():
        with atomic.writing(folder):
            folder.mkdir(parents=True, exist_ok=True)
            # Several processes may do this at once, each with a file of its own; the last one's stays.
            descriptor, partial = tempfile.mkstemp(dir=folder, suffix=atomic.PARTIAL)
            with os.fdopen(descriptor, "w", encoding="utf-8") as file:
                file.write(text)
            Path(partial).replace(folder / "hydrodynamics.py")
    return folder


def directory(equations: EquationSet, subproblem: str | None, external: bool = False) -> Path:
    """The folder that holds ``hydrodynamics.py`` of a set and sub-problem; it is written if there is none yet."""
    return _directory(equations, equations.subproblem(subproblem), external)


def main() -> None:
    """Write the modules of the built-in sets."""
    from bayesub.model.equations.files import load_equations

    for name in toml_files.built_in("equations"):
        equations = load_equations(name)
        planes = [None, *equations.subproblems] if equations.degrees_of_freedom == 6 else [*equations.subproblems]
        for plane in planes:
            folder = BUILT_IN / name / (plane or "full")
            folder.mkdir(parents=True, exist_ok=True)
            (folder / "hydrodynamics.py").write_text(source(equations, plane))


if __name__ == "__main__":
    main()
