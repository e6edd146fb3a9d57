"""What is compiled for each equation set: lane functions between rows of the workspace (:mod:`.workspace`)."""

from collections.abc import Callable
from types import ModuleType

from bayesub.kernels.dynamics import (
    Boat,
    InverseMass,
    down,
    euler_derivative,
    mechanical_forces,
    quaternion_derivative,
    weight_slopes,
)
from bayesub.kernels.lanes import Rows
from bayesub.kernels.tangent import state_jacobian
from bayesub.kernels.workspace import (
    ACCELERATIONS,
    BODY_ROWS,
    COEFFICIENTS,
    INVERSE_MASS,
    JACOBIAN,
    N_COLUMNS,
    STAGE,
    STATE,
    SUM,
)


class _Controls:
    """The controls of all lanes, with what each lane adds."""

    def __init__(self, shared, own):
        self.shared, self.own = shared, own

    def __getitem__(self, k):
        return self.shared[k] + self.own[k]


def _boat(given, equations: ModuleType) -> Boat:
    """The boats of the lanes, each at its state STAGE."""
    work, controls = given.work, COEFFICIENTS + equations.N_COEFFICIENTS
    return Boat(
        equations,
        Rows(work, STAGE),
        Rows(work, BODY_ROWS),
        InverseMass(Rows(work, INVERSE_MASS)),
        Rows(work, COEFFICIENTS),
        Rows(work, controls + equations.N_CONTROLS),
        _Controls(given.control, Rows(work, controls)),
    )


def _stage(derivative: Callable) -> Callable:
    def stage(given, equations):
        """Add `a` times the rates at STAGE to SUM, then put STATE + `b` times the rates into STAGE."""
        for k, rate in enumerate(derivative(_boat(given, equations))):
            given.work[SUM + k] = given.work[SUM + k] + given.a * rate
            given.work[STAGE + k] = given.work[STATE + k] + given.b * rate

    return stage


def linearise(given, equations: ModuleType) -> None:
    """The accelerations and the state Jacobian at STAGE."""
    boat = _boat(given, equations)
    rates = euler_derivative(boat)
    for k in range(6):
        given.work[ACCELERATIONS + k] = rates[6 + k]
    for n, row in enumerate(state_jacobian(boat)):
        for k, slope in enumerate(row):
            given.work[JACOBIAN + N_COLUMNS * n + k] = slope


def regressors(given, equations: ModuleType) -> None:
    """The regressor of each coefficient into the rows of `out`."""
    boat = _boat(given, equations)
    motion = [boat.state[6 + k] for k in range(6)], [given.work[ACCELERATIONS + k] for k in range(6)]
    for k, regressor in enumerate(equations.regressors(boat.controls, boat.constants, *motion[0], *motion[1])):
        given.out[k] = regressor


def slopes(given, equations: ModuleType) -> None:
    """The derivatives of the forces by the controls into `out`, six rows of them, which begin as zero."""
    boat = _boat(given, equations)
    velocity = [boat.state[6 + k] for k in range(6)]
    of_forces = equations.control_slopes(boat.coefficients, boat.controls, boat.constants, *velocity)
    for (axis, k), slope in (of_forces | weight_slopes(boat, *down(boat))).items():
        given.out[axis * equations.N_CONTROLS + k] = slope


def mechanical(given, equations: ModuleType) -> None:
    """The forces that do not come from coefficients into six rows of `out`."""
    boat = _boat(given, equations)
    for k, force in enumerate(mechanical_forces(boat, *down(boat))):
        given.out[k] = force


UNITS = {
    "stage": _stage(euler_derivative),
    "stage_quaternion": _stage(quaternion_derivative),
    "linearise": linearise,
    "regressors": regressors,
    "slopes": slopes,
    "mechanical": mechanical,
}
