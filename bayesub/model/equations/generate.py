"""Writes the forces of an equation set and sub-problem, and their derivatives, as Python that becomes kernels.

Forces that a sub-problem does not have are left out, but for what keeps the last digits. The text is never a file;
tracebacks show its lines all the same (:class:`bayesub.kernels.families.Family`).
"""

from __future__ import annotations

import functools
import textwrap

from bayesub.logs.log_files import ACCELERATIONS, VELOCITIES
from bayesub.model.equations.equation_set import AXES, EquationSet, Term
from bayesub.model.equations.regressors import CROSSFLOW

_HEADER = '''\
"""Equations '{name}', {motion}, {terms} terms, by bayesub.model.equations.generate."""

from bayesub.kernels.lanes import choose, sqrt

N_COEFFICIENTS = {n_coefficients}
N_CONTROLS = {n_controls}
ORDERED_SPEED = {ordered}  # position of n/k0 among the controls
WEIGHTS = {weights}  # position of the weight from outside, which its three moments follow, if there are any
N_CONSTANTS = {n_constants}
RIGID_BODY_TERMS = {rigid_body}  # whether the velocity terms of the rigid body are apart from the coefficients

# (axis, acceleration, coefficient) of the added-mass terms, which stand in the mass matrix.
ADDED_MASS = {added_mass}


def sgn(x):
    """Sign of x; zero for zero."""
    return choose(x > 0.0, 1.0, choose(x < 0.0, -1.0, 0.0))

{crossflow}
def forces(c, control, constant, u, v, w, p, q, r):
    """X, Y, Z (N) and K, M, N (N m) of coefficients c, terms without accelerations (model manual, section 4)."""
{forces}


def gradient(c, control, constant, u, v, w, p, q, r):
    """Derivatives of :func:`forces` by u, v, w, p, q and r, six forces each."""
{gradient}


def regressors(control, constant, u, v, w, p, q, r, udot, vdot, wdot, pdot, qdot, rdot):
    """The regressors of the terms; zero for those that play no part."""
{regressors}


def control_slopes(c, control, constant, u, v, w, p, q, r):
    """Derivatives of the forces by the controls, as far as they are not zero: (axis, control) -> derivative."""
{controls}
'''

_CROSSFLOW = '''
def crossflow(x, height, breadth, v, w, q, r):
    """Side and normal force of the local cross-flow at a station, without density and drag coefficient."""
    v, w = v + x * r, w - x * q
    speed = sqrt(w * w + v * v)
    return -height * v * speed, -breadth * w * speed


def crossflow_slopes(x, height, breadth, v, w, q, r):
    """Derivatives of :func:`crossflow` by the local velocities across and down: y by v, y by w, z by v, z by w."""
    v, w = v + x * r, w - x * q
    speed = sqrt(w * w + v * v)
    inverse = choose(speed > 0.0, 1.0 / speed, 0.0)
    vw = v * w * inverse
    return -height * (speed + v * v * inverse), -height * vw, -breadth * vw, -breadth * (speed + w * w * inverse)

'''
WEIGHTS = ("external_W", "external_Wx", "external_Wy", "external_Wz")  # a weight, and its moments about the origin
EXTERNAL = (*(f"external_{axis}{suffix}" for suffix in ("", "_u") for axis in AXES), *WEIGHTS)


@functools.cache
def source(equations: EquationSet, subproblem: str | None, external: bool = False) -> str:
    """The text of the module for a set and a plane of :meth:`EquationSet.subproblem`.

    With `external` the controls end on sixteen more: forces and moments from outside, what of them goes with the surge
    velocity, and a weight with its moments about the origin.
    """
    return _Writer(equations, subproblem, external).text()


class _Writer:
    def __init__(self, equations, subproblem, external):
        self.equations, self.subproblem, self.external = equations, subproblem, external
        self.active = set(equations.active(subproblem=subproblem))
        self.terms = [(k, term) for k, term in enumerate(equations.terms) if term.name in self.active]
        self.steady = [(k, term) for k, term in enumerate(equations.terms) if not term.is_added_mass]
        self.controls = [*(control.symbol for control in equations.controls), "uc", *(EXTERNAL if external else ())]
        self.n_constants = 1 + 3 * equations.stations * equations.has_crossflow

    def text(self) -> str:
        added = tuple(
            (AXES.index(t.axis), ACCELERATIONS.index(t.regressor), k) for k, t in self.terms if t.is_added_mass
        )
        n_terms = len(self.equations.terms)
        motion = f"{self.subproblem} sub-problem" if self.subproblem else "all degrees of freedom"
        integrates = any(term.symbols & set(CROSSFLOW) for _, term in self.terms)
        parts = {
            "name": self.equations.name,
            "motion": motion + (", forces from outside" if self.external else ""),
            "terms": str(len(self.terms)) if len(self.terms) == n_terms else f"{len(self.terms)} of {n_terms}",
            "n_coefficients": str(n_terms),
            "n_controls": str(len(self.controls)),
            "ordered": str(len(self.equations.controls)),
            "weights": str(len(self.controls) - len(WEIGHTS) if self.external else None),
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

    def _parts(self, axis: str, variable: str | None = None) -> list[tuple[int, Term, str]]:
        """Position, term and expression of the summands of an axis, or of its derivative, if any plays a part.

        The first two stay in any case: a compiler that contracts multiplies and adds begins with either of them, so
        that without one of them the last digits would be others than those of the whole sum.
        """
        of_axis = [(k, term) for k, term in self.steady if term.axis == axis]
        texts = [term.parsed.code if variable is None else term.parsed.derivative(variable) for _, term in of_axis]
        parts = [(k, term, text) for (k, term), text in zip(of_axis, texts, strict=True) if text]
        if not any(term.name in self.active for _, term, _ in parts):
            return []
        return [part for n, part in enumerate(parts) if n < 2 or part[1].name in self.active]

    def _forces(self) -> list[str]:
        sums, used = [], []
        for axis in AXES:
            parts = self._parts(axis)
            used += [term for _, term, _ in parts]
            sums += _sum(axis, parts, f"external_{axis} + external_{axis}_u * u" if self.external else "")
        return [*self._values(used, of_external=True), *sums, f"return {', '.join(AXES)}"]

    def _gradient(self) -> list[str]:
        sums, used = [], []
        for axis in AXES:
            for variable in VELOCITIES:
                parts = self._parts(axis, variable)
                used += [term for _, term, _ in parts]
                external = f"external_{axis}_u" if self.external and variable == "u" else ""
                sums += _sum(f"{axis}_{variable}", parts, external)
        columns = ["(" + ", ".join(f"{axis}_{variable}" for axis in AXES) + ")" for variable in VELOCITIES]
        lines = [*self._values(used, of_external=True), *self._slopes_of_values(used), *sums]
        return [*lines, "return (", *(f"    {column}," for column in columns), ")"]

    def _regressors(self) -> list[str]:
        codes = {t.name: t.parsed.code if t.name in self.active else "0.0" for t in self.equations.terms}
        rows = [f"    {code},  # {name}" for name, code in codes.items()]
        return [*self._values([term for _, term in self.terms]), "return (", *rows, ")"]

    def _control_slopes(self) -> list[str]:
        sums, used = [], []
        for k, control in enumerate(self.controls):
            for a, axis in enumerate(AXES):
                parts = self._parts(axis, control)
                used += [term for _, term, _ in parts]
                factor = {f"external_{axis}": "1.0", f"external_{axis}_u": "u"}.get(control, "")
                if parts or factor:
                    sums += _sum(f"slopes[{a}, {k}]", parts, factor)
        return [*self._values(used), "slopes = {}", *sums, "return slopes"]

    def _values(self, terms: list[Term], of_external: bool = False) -> list[str]:
        """Assignments of what the regressors of these terms contain besides velocities and accelerations."""
        symbols = {symbol for term in terms for symbol in term.symbols}
        lines = []
        for k, control in enumerate(self.controls):
            needed = symbols | ({"uc"} if "duc" in symbols else set())
            if control in needed or (of_external and control in EXTERNAL and control not in WEIGHTS):
                lines.append(f"{control} = control[{k}]")
        lines += ["U = constant[0]"] if symbols & {"U", "du"} else []
        lines += ["nu = sqrt(v * v + w * w)"] if "nu" in symbols else []
        if "V" in symbols:
            lines += ["V = sqrt(u * u + v * v + w * w)", "inverse_V = choose(V > 0.0, 1.0 / V, 0.0)"]
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
            lines += ["inverse = choose(nu > 0.0, 1.0 / nu, 0.0)", "nu_v, nu_w = v * inverse, w * inverse"]
        if "V" in symbols:
            lines += ["V_u, V_v, V_w = u * inverse_V, v * inverse_V, w * inverse_V"]
        if symbols & set(CROSSFLOW):
            names = [f"crossflow_{force}_{x}" for force in "yzmn" for x in "vwqr"]
            lines += [f"{' = '.join(names)} = 0.0"]
            for s in range(self.equations.stations):
                lines += [*self._station(s), "y_v, y_w, z_v, z_w = crossflow_slopes(x, height, breadth, v, w, q, r)"]
                # Local velocities are v + x r and w - x q; moments are x times the side force, -x times the normal.
                for force, moment, of_moment in (("y", "n", "+"), ("z", "m", "-")):
                    v, w = f"{force}_v", f"{force}_w"
                    slopes = (("v", "+", v), ("w", "+", w), ("q", "-", f"x * {w}"), ("r", "+", f"x * {v}"))
                    for x, sign, slope in slopes:
                        turned = "+" if sign == of_moment else "-"
                        lines += [f"crossflow_{force}_{x} {sign}= {slope}"]
                        lines += [f"crossflow_{moment}_{x} {turned}= x * ({slope})"]
        return lines

    def _station(self, s: int) -> list[str]:
        rows = [1 + k * self.equations.stations + s for k in range(3)]
        return [f"x, height, breadth = {', '.join(f'constant[{row}]' for row in rows)}"]


def _sum(target: str, parts: list[tuple[int, Term, str]], external: str = "") -> list[str]:
    """Lines that assign the sum of coefficient times expression to `target`."""
    if not parts:
        return [f"{target} = {external or '0.0'}"]
    lines = [f"    {'+ ' if n else ''}c[{k}] * ({code})  # {term.name}" for n, (k, term, code) in enumerate(parts)]
    return [f"{target} = (", *lines, *([f"    + {external}"] if external else []), ")"]
