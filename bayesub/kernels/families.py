"""The kernels of motion of an equation set: machine code of its forces, and the loops that all sets share.

What is compiled for each equation set are UNITS, lane functions (:mod:`bayesub.kernels.lanes`) between rows of the
workspace (:mod:`bayesub.kernels.workspace`); the loops call them by address.
"""

import functools
import linecache
from collections.abc import Callable
from types import ModuleType

import numpy as np

from bayesub.kernels import dynamics, integrate, mass, sensitivities
from bayesub.kernels import workspace as at
from bayesub.kernels.jit import unit_address, unit_assembly
from bayesub.kernels.lanes import Rows


class _Controls:
    """The controls of all lanes, with what each lane adds."""

    def __init__(self, shared, own):
        self.shared, self.own = shared, own

    def __getitem__(self, k):
        return self.shared[k] + self.own[k]


def _boat(given, equations: ModuleType) -> dynamics.Boat:
    """The boats of the lanes, each at its state STAGE."""
    work, controls = given.work, at.COEFFICIENTS + equations.N_COEFFICIENTS
    return dynamics.Boat(
        equations,
        Rows(work, at.STAGE),
        Rows(work, at.BODY_ROWS),
        dynamics.InverseMass(Rows(work, at.INVERSE_MASS)),
        Rows(work, at.COEFFICIENTS),
        Rows(work, controls + equations.N_CONTROLS),
        _Controls(given.control, Rows(work, controls)),
    )


def _stage(derivative: Callable) -> Callable:
    def stage(given, equations):
        """Add `a` times the rates at STAGE to SUM, then put STATE + `b` times the rates into STAGE."""
        for k, rate in enumerate(derivative(_boat(given, equations))):
            given.work[at.SUM + k] = given.work[at.SUM + k] + given.a * rate
            given.work[at.STAGE + k] = given.work[at.STATE + k] + given.b * rate

    return stage


def linearise(given, equations: ModuleType) -> None:
    """The accelerations and the state Jacobian at STAGE."""
    boat = _boat(given, equations)
    rates = dynamics.euler_derivative(boat)
    for k in range(6):
        given.work[at.ACCELERATIONS + k] = rates[6 + k]
    for n, row in enumerate(dynamics.state_jacobian(boat)):
        for k, slope in enumerate(row):
            given.work[at.JACOBIAN + at.N_COLUMNS * n + k] = slope


def regressors(given, equations: ModuleType) -> None:
    """The regressor of each coefficient into the rows of `out`."""
    boat = _boat(given, equations)
    motion = [boat.state[6 + k] for k in range(6)] + [given.work[at.ACCELERATIONS + k] for k in range(6)]
    for k, regressor in enumerate(equations.regressors(boat.controls, boat.constants, *motion)):
        given.out[k] = regressor


def slopes(given, equations: ModuleType) -> None:
    """The derivatives of the forces by the controls into `out`, six rows of them, which begin as zero."""
    boat = _boat(given, equations)
    velocity = [boat.state[6 + k] for k in range(6)]
    of_forces = equations.control_slopes(boat.coefficients, boat.controls, boat.constants, *velocity)
    for (axis, k), slope in (of_forces | dynamics.weight_slopes(boat, *dynamics.down(boat))).items():
        given.out[axis * equations.N_CONTROLS + k] = slope


def mechanical(given, equations: ModuleType) -> None:
    """The forces that do not come from coefficients into six rows of `out`."""
    boat = _boat(given, equations)
    for k, force in enumerate(dynamics.mechanical_forces(boat, *dynamics.down(boat))):
        given.out[k] = force


UNITS = {
    "stage": _stage(dynamics.euler_derivative),
    "stage_quaternion": _stage(dynamics.quaternion_derivative),
    "linearise": linearise,
    "regressors": regressors,
    "slopes": slopes,
    "mechanical": mechanical,
}


class Family:
    """The kernels for the forces of one equation set, sub-problem and kind of controls.

    `source` is the text of the module of the forces (:func:`bayesub.model.equations.generate.source`). Machine code is
    compiled or loaded when it is first needed; it is never sent to another process, which has its own.
    """

    def __init__(self, source: str):
        self.source = source

    def __reduce__(self):
        return family, (self.source,)

    @functools.cached_property
    def equations(self) -> ModuleType:
        """The module of the forces."""
        module = ModuleType("bayesub_forces")
        file = f"<{self.source.partition(chr(10))[0].strip(chr(34))}>"
        linecache.cache[file] = len(self.source), None, self.source.splitlines(keepends=True), file  # for tracebacks
        exec(compile(self.source, file, "exec"), vars(module))
        return module

    @functools.cached_property
    def added_mass(self) -> np.ndarray:
        """(n, 3) axis, acceleration and coefficient of each added-mass term."""
        return np.array(self.equations.ADDED_MASS, dtype=int).reshape(-1, 3)

    @property
    def n_rows(self) -> int:
        """Rows of the workspace of a block."""
        equations = self.equations
        return at.COEFFICIENTS + equations.N_COEFFICIENTS + equations.N_CONTROLS + equations.N_CONSTANTS

    def unit(self, name: str):
        """The functions that loops call, of one of UNITS."""
        return unit_address(self.lane_function(name), name, self.source)

    def lane_function(self, name: str) -> Callable:
        """One of UNITS for these forces (:mod:`bayesub.kernels.lanes`)."""
        return lambda given: UNITS[name](given, self.equations)

    def assembly(self, name: str) -> str:
        """The instructions of one of UNITS."""
        return unit_assembly(self.lane_function(name))

    @functools.cached_property
    def _euler(self) -> integrate.Forces:
        return self._forces("stage", quaternions=False)

    @functools.cached_property
    def _quaternion(self) -> integrate.Forces:
        return self._forces("stage_quaternion", quaternions=True)

    def _forces(self, stage, quaternions):
        of = self.equations
        return integrate.Forces(self.unit(stage), quaternions, of.N_COEFFICIENTS, of.N_CONTROLS, of.N_CONSTANTS)

    @functools.cached_property
    def _slopes(self) -> sensitivities.Slopes:
        return sensitivities.Slopes(*map(self.unit, sensitivities.Slopes._fields))

    def integrate(self, *arguments, quaternions: bool = False, **options):
        """:func:`bayesub.kernels.integrate.integrate` from its `coefficients` on."""
        forces = self._quaternion if quaternions else self._euler
        return integrate.integrate(forces, self.added_mass, *arguments, **options)

    def body_accelerations(self, *arguments):
        """:func:`bayesub.kernels.integrate.body_accelerations` from its `coefficients` on."""
        return integrate.body_accelerations(self._euler, self.added_mass, *arguments)

    def fly(self, *arguments):
        """:func:`bayesub.kernels.sensitivities.fly` from its `coefficients` on."""
        return sensitivities.fly(self._euler, self.added_mass, *arguments)

    def sensitivities(self, *arguments):
        """:func:`bayesub.kernels.sensitivities.sensitivities` from its `coefficients` on."""
        return sensitivities.sensitivities(self._euler, self._slopes, self.added_mass, *arguments)

    def mass_matrix(self, coefficients: np.ndarray, body: np.ndarray) -> np.ndarray:
        """(6, 6) mass and added mass of dimensional coefficients (n_terms,) and a body vector, kg, kg m and kg m^2."""
        return mass.mass_matrices(np.array(coefficients)[None], np.array(body)[None], self.added_mass)[0]


@functools.cache
def family(source: str) -> Family:
    """The kernels for the forces in a text."""
    return Family(source)
