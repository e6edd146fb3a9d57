"""An equation set: the hydrodynamic terms, each linear in its coefficient, of one way to write the forces on a boat.

Every hydrodynamic force is a sum over the terms of an axis,

    F_axis = sum of  factor * coefficient * regressor,

where the factor is ``(rho/2) l^length_power U^speed_power`` of a non-dimensional coefficient and 1 of a dimensional
one. A set is read from a file (:mod:`bayesub.model.equations.files`); its kernels are generated from it
(:mod:`bayesub.model.equations.generate`), and everything that concerns a coefficient asks it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import TYPE_CHECKING

import numpy as np

from bayesub.io.errors import InputError, check_known, nearest
from bayesub.logs.log_files import ACCELERATIONS, COLUMNS, VELOCITIES, positions
from bayesub.model.equations.regressors import CROSSFLOW, Regressor, crossflow_integrals, crossflow_points

if TYPE_CHECKING:
    from bayesub.model.manoeuvres import Manoeuvre
    from bayesub.model.vehicles import Vehicle

AXES = ("X", "Y", "Z", "K", "M", "N")

# Axes and motions of the sub-problems (model manual, section 4).
PLANES = {"horizontal": ("XYN", {"u", "v", "r"}), "vertical": ("XZM", {"u", "w", "q"})}
_MOTIONS = frozenset((*VELOCITIES, *ACCELERATIONS))
_PLANE_OF_CROSSFLOW = {"crossflow_y": "horizontal", "crossflow_n": "horizontal"}
_PLANE_OF_CROSSFLOW |= {"crossflow_z": "vertical", "crossflow_m": "vertical"}
_PLANE_OF_CONTROL = {"rudder_deg": "horizontal", "bow_plane_deg": "vertical", "stern_plane_deg": "vertical"}


@dataclass(frozen=True)
class Control:
    """A control that regressors may contain."""

    symbol: str  # in the regressors
    column: str  # of a log, with the unit as its suffix

    @property
    def short(self) -> str:
        """Name of the column in memory."""
        return COLUMNS[self.column][0] if self.column in COLUMNS else self.column

    @property
    def subproblem(self) -> str | None:
        """The plane of motion in which it acts; None for a control of both."""
        return _PLANE_OF_CONTROL.get(self.column)

    @property
    def dimension(self) -> tuple[int, int]:
        """Powers of metres and seconds: those of a speed and of revolutions; an angle has none."""
        return (int(self.column.endswith("_mps")), -int(self.column.endswith(("_mps", "rpm"))))


@dataclass(frozen=True)
class Term:
    """One hydrodynamic term; its factor is ``(rho/2) l^length_power U^speed_power``."""

    name: str  # of the coefficient
    axis: str  # one of X, Y, Z, K, M, N
    regressor: str  # product of factors such as u, abs(r) or sgn(v), joined by *
    parsed: Regressor  # with the power of the instantaneous speed where that makes the coefficient non-dimensional
    length_power: int
    speed_power: int
    unit: str | None  # of a dimensional coefficient, which has no factor
    label: str  # LaTeX, such as $Y'_{uv}$
    meaning: str  # in words

    @property
    def symbols(self) -> frozenset[str]:
        """Motion variables and controls that the regressor contains."""
        return self.parsed.symbols

    @property
    def is_added_mass(self) -> bool:
        """Whether the force is proportional to an acceleration."""
        return self.regressor in ACCELERATIONS

    @property
    def scale(self) -> str:
        """What makes the coefficient dimensional, such as ``(rho/2) l^3 U^-1``, or the unit that it has."""
        if self.unit is not None:
            return self.unit
        speed = {0: "", 1: " U"}.get(self.speed_power, f" U^{self.speed_power}")
        return f"(rho/2) l^{self.length_power}{speed}"


@dataclass(frozen=True)
class EquationSet:
    """The hydrodynamic terms of a boat."""

    name: str
    title: str
    description: str
    reference: str
    terms: tuple[Term, ...]  # n_terms of them, by axis
    controls: tuple[Control, ...]  # n_controls of them
    degrees_of_freedom: int = 6  # 6, or 3 for surge, sway and yaw
    # "separate", or "in_coefficients" if coefficients include the velocity terms of the rigid body
    rigid_body_terms: str = "separate"
    speed: str = "trial"  # to which the speed powers refer: "trial" (of the vehicle) or "instantaneous"
    stations: int = 16  # points of the integrals along the hull

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the coefficients."""
        return tuple(term.name for term in self.terms)

    @cached_property
    def index(self) -> dict[str, int]:
        """Name of a coefficient -> its position in a coefficient set."""
        return {name: k for k, name in enumerate(self.names)}

    @cached_property
    def added_masses(self) -> tuple[str, ...]:
        """Names of the coefficients of accelerations."""
        return tuple(term.name for term in self.terms if term.is_added_mass)

    @cached_property
    def subproblems(self) -> dict[str, tuple[str, ...]]:
        """Sub-problem -> names of its coefficients; a set of three degrees of freedom has the horizontal one only."""
        planes = ("horizontal", "vertical") if self.degrees_of_freedom == 6 else ("horizontal",)
        return {plane: tuple(t.name for t in self.terms if self._is_of(t, plane)) for plane in planes}

    def _is_of(self, term: Term, plane: str) -> bool:
        axes, motions = PLANES[plane]
        motions = motions | {f"{velocity}dot" for velocity in motions}
        symbols = term.symbols
        other = {c.symbol for c in self.controls if c.subproblem not in (None, plane)}
        other |= {s for s in CROSSFLOW if _PLANE_OF_CROSSFLOW[s] != plane}
        return term.axis in axes and not symbols & other and symbols & _MOTIONS <= motions

    @property
    def has_crossflow(self) -> bool:
        """Whether the terms contain integrals along the hull."""
        return any(term.symbols & set(CROSSFLOW) for term in self.terms)

    def subproblem(self, wanted: str | None) -> str | None:
        """The sub-problem that is flown if `wanted` is asked for: the horizontal one of three degrees of freedom.

        InputError for one that the set does not have.
        """
        if wanted is None:
            return "horizontal" if self.degrees_of_freedom == 3 else None
        if wanted not in PLANES:
            message = f"unknown sub-problem '{wanted}': expected horizontal or vertical"
            raise InputError(message, "unknown", "subproblem")
        if wanted not in self.subproblems:
            text = f"equations '{self.name}' have no {wanted} sub-problem: they are those of surge, sway and yaw"
            raise InputError(text, "conflict", "subproblem")
        return wanted

    def term(self, name: str) -> Term:
        """The term of a coefficient; InputError for an unknown name."""
        return self.terms[self.columns([name])[0]]

    def label(self, name: str) -> str:
        """LaTeX label of a coefficient; InputError for an unknown name."""
        return self.term(name).label

    def find(self, axis: str, regressor: Regressor) -> Term | None:
        """The term of an axis with this regressor, whatever the order of its factors; None if the set has none."""
        wanted = regressor.canonical
        return next((t for t in self.terms if t.axis == axis and t.parsed.canonical == wanted), None)

    def control(self, column: str, wanted_by: str) -> int:
        """Position among the controls of the one in a column of a log; InputError if the set has none."""
        columns = [control.column for control in self.controls]
        if column not in columns:
            listed = ", ".join(columns) or "no controls"
            suggestion = nearest(column, columns) or "."
            text = f"{wanted_by}: unknown control '{column}'{suggestion} The equations '{self.name}' have {listed}"
            raise InputError(text, "unknown", column)
        return columns.index(column)

    def columns(self, names: Iterable[str]) -> np.ndarray:
        """Positions in a coefficient set of coefficients given by name; InputError for an unknown name."""
        names = tuple(names)
        for name in names:
            check_known(name, self.index, f"unknown coefficient '{name}'")
        return np.array([self.index[name] for name in names], dtype=int)

    def names_of_axis(self, axis: str) -> tuple[str, ...]:
        """The coefficients of one axis, in the column order of :meth:`regressors`."""
        return tuple(term.name for term in self.terms if term.axis == axis)

    def active(
        self, vehicle: Vehicle | None = None, manoeuvre: Manoeuvre | None = None, subproblem: str | None = None
    ) -> tuple[str, ...]:
        """Names of the coefficients that play a part in a motion, in the order of the set.

        Those of other axes and of motions that a sub-problem does not have play none, nor do those of controls that
        rest at zero throughout a manoeuvre, nor do coefficients that are zero. A vehicle leaves out the coefficients
        that are zero for it; without it they may have any values, as where a prior or a measurement is to say what they
        are. A manoeuvre leaves out the coefficients of controls that it does not move, and those of moments in whose
        place it prescribes an angle; its own sub-problem is not asked. The sub-problem is "horizontal", "vertical", or
        None for all degrees of freedom; InputError for one that does not exist.
        """
        resting, followed = set(), set()
        if manoeuvre is not None:
            followed = {one.axis for one in manoeuvre.prescribed}
            moves = zip(self.controls, manoeuvre.controls.T, strict=True)
            resting = {control.symbol for control, history in moves if not history.any()}
        subproblem = self.subproblem(subproblem)
        in_equations = self.names if subproblem is None else self.subproblems[subproblem]
        return tuple(
            term.name
            for k, term in enumerate(self.terms)
            if term.name in in_equations
            and term.axis not in followed
            and not (resting and term.symbols & resting)
            and (vehicle is None or vehicle.xi[k] != 0.0)
        )

    def factors(self, length_m: float, water_density_kgm3: float, speed_mps: float) -> np.ndarray:
        """(n_terms,) what makes each coefficient dimensional: (rho/2) l^a U^b, or 1."""
        factors = 0.5 * water_density_kgm3 * length_m ** np.array([term.length_power for term in self.terms])
        speed_powers = np.array([term.speed_power for term in self.terms])
        if self.speed == "trial" and speed_powers.any():
            factors = factors * speed_mps**speed_powers
        return np.where([term.unit is not None for term in self.terms], 1.0, factors)

    def unit(self, name: str) -> str:
        """The unit of a coefficient times its factor of :meth:`factors`, such as ``kg m/s``; or the one that it has."""
        term = self.term(name)
        if term.unit is not None:
            return term.unit
        speed_power = term.speed_power if self.speed == "trial" else 0
        powers = {"kg": 1, "m": term.length_power + speed_power - 3, "s": -speed_power}
        above, below = (
            " ".join(unit if n == 1 else f"{unit}^{n}" for unit, n in signed if n > 0)
            for signed in (powers.items(), [(unit, -n) for unit, n in powers.items()])
        )
        return f"{above}/{below}" if below else above

    def drag(
        self, xi: np.ndarray, length_m: float, water_density_kgm3: float, speed_mps: float, hull: np.ndarray | None
    ) -> float:
        """The resistance in straight flight at a speed, on (rho/2) l^2 speed^2, of coefficients (n_terms,)."""
        state = np.zeros((1, 12))
        state[0, positions("u")] = speed_mps
        controls = np.zeros((1, len(self.controls) + 1))
        controls[0, -1] = speed_mps
        along = self.regressors(state, np.zeros((1, 6)), controls, self.constants(speed_mps, hull))["X"][0]
        factors = self.factors(length_m, water_density_kgm3, speed_mps)[: len(along)]  # surge comes first
        # The power of a NumPy integer, as in `factors`: that of a Python integer may round otherwise.
        unit = 0.5 * water_density_kgm3 * length_m ** np.array([2])[0]
        return float(-np.sum(xi[: len(along)] * (along / speed_mps**2) * (factors / unit)))

    def constants(self, speed_mps: float, hull: np.ndarray | None) -> np.ndarray:
        """(n_constants,) what the kernels need besides the body: the trial speed and the stations of the hull.

        The hull is (3, n) positions from tail to nose, heights and breadths, m.
        """
        if not self.has_crossflow:
            return np.array([speed_mps])
        if hull is None:
            raise ValueError(f"equations '{self.name}' integrate the cross-flow along a hull, and there is none")
        return np.concatenate([[speed_mps], crossflow_points(hull, self.stations).ravel()])

    def regressors(
        self, states: np.ndarray, accelerations: np.ndarray, controls: np.ndarray, constants: np.ndarray
    ) -> dict[str, np.ndarray]:
        """Axis -> regressors (n, n_columns), the columns of the linear form ``A xi = b`` (model manual, section 9).

        States (n, 12) are in m, rad, m/s and rad/s, body accelerations (n, 6) in m/s^2 and rad/s^2; controls (n,
        n_controls + 1) are those of the set, SI units, and after them n/k0, m/s; and :meth:`constants` (n_constants,).
        Columns are in the order of the set, without the factors of :meth:`factors`.
        """
        states, accelerations, controls = np.asarray(states), np.asarray(accelerations), np.asarray(controls)
        values = dict(zip(VELOCITIES, states[:, positions(*VELOCITIES)].T, strict=True))
        values |= dict(zip(ACCELERATIONS, accelerations.T, strict=True))
        values |= dict(zip((*(control.symbol for control in self.controls), "uc"), controls.T, strict=True))
        u, v, w = values["u"], values["v"], values["w"]
        values |= {"nu": np.hypot(v, w), "V": np.sqrt(u * u + v * v + w * w), "U": np.full(len(u), constants[0])}
        values |= {"du": u - constants[0], "duc": values["uc"] - u}
        if self.has_crossflow:
            values |= crossflow_integrals(values, constants[1:].reshape(3, -1))
        functions: dict[str, Callable[[np.ndarray], np.ndarray]] = {
            "": lambda x: x,
            "abs": np.abs,
            "sgn": np.sign,
            "inverse": lambda x: np.divide(1.0, x, out=np.zeros_like(x), where=x > 0.0),  # zero at rest, as in kernels
        }
        columns: dict[str, list[np.ndarray]] = {axis: [] for axis in AXES}
        for term in self.terms:
            factors = (functions[f.function](values[f.symbol]) for f in term.parsed.factors)
            columns[term.axis].append(reduce(np.multiply, factors, np.ones(len(u))))
        return {axis: np.column_stack(c) if c else np.empty((len(u), 0)) for axis, c in columns.items()}
