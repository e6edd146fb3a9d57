"""What a user would write instead of the simulator: one simulation at a time, by Runge-Kutta 4 with a fixed step.

The equations of motion are the package's own, for one state, and no step makes an array. With ``NUMBA_DISABLE_JIT=1``
everything here is plain Python and NumPy; ``python -m rivals.scalar_simulator FILE STEP`` writes the seconds of a
simulation and its states.
"""

import math
import sys
import timeit

import numba
import numpy as np

from bayesub.kernels.mass import inverses, mass_matrices
from bayesub.kernels.workspace import BODY_ROWS, COEFFICIENTS, INVERSE_MASS, LANES, N_STATES, STATE
from bayesub.model.simulator import Simulator
from bayesub.model.vehicles import load_vehicle
from bayesub.study.before.bench import spiral
from rivals.right_hand_side import PYTHON, written

_jit = numba.njit(nogil=True, error_model="numpy", fastmath={"contract"})


def workspaces(simulator: Simulator, xi: np.ndarray) -> np.ndarray:
    """Boats with coefficients `xi` (n_batch, n_terms) as the equations of motion read them.

    They are (n_batch / LANES, n_rows, LANES), blocks of LANES boats, each at the start of its manoeuvre.
    """
    vehicle, kernels = simulator.vehicle, simulator.kernels
    body, dimensional = np.tile(vehicle.body, (len(xi), 1)), simulator.dimensional(xi)
    inverse_mass = inverses(mass_matrices(dimensional, body, kernels.added_mass)).reshape(len(xi), -1)
    rows = np.zeros((len(xi), kernels.n_rows))
    parts = {STATE: simulator.manoeuvre.initial_state, BODY_ROWS: body, INVERSE_MASS: inverse_mass}
    parts |= {COEFFICIENTS: dimensional, kernels.n_rows - len(vehicle.constants): vehicle.constants}
    for first, values in parts.items():
        rows[:, first : first + np.shape(values)[-1]] = values
    return np.ascontiguousarray(rows.reshape(-1, LANES, kernels.n_rows).swapaxes(1, 2))


def rows_of(simulator: Simulator, xi: np.ndarray) -> np.ndarray:
    """(n_rows,) one boat of coefficients `xi` (n_terms,) at the start of its manoeuvre."""
    return np.ascontiguousarray(workspaces(simulator, np.tile(xi, (LANES, 1)))[0, :, 0])


def _written_derivative():
    """derivative(work, control): rates of the state among the rows of one boat of `suboff` in the horizontal plane."""
    lines, rates = written(load_vehicle("suboff").kernels("horizontal"), PYTHON)
    body = "".join(f"    {line}\n" for line in [*lines, f"return {', '.join(rates)}"])
    exec(f"def derivative(work, control):\n{body}", names := {"math": math})
    return names["derivative"]


_derivative = _jit(_written_derivative())


@_jit
def derivative(state, controls, work):
    """Rates (12,) of a state (12,) under controls (4,), of a boat whose rows are `work`."""
    for k in range(N_STATES):
        work[STATE + k] = state[k]
    return np.array(_derivative(work, controls))


@_jit
def runge_kutta(stages, step, work):
    """States (n, 12) of the boat whose rows are `work`, from controls (n, 3, 4) at start, middle and end of steps."""
    work = work.copy()
    states, total = np.empty((len(stages), N_STATES)), np.empty(N_STATES)
    for n in range(len(stages)):
        for k in range(N_STATES):
            states[n, k] = work[STATE + k]
            total[k] = 0.0
        for part, weight, ahead in ((0, 1.0, 0.5), (1, 2.0, 0.5), (1, 2.0, 1.0), (2, 1.0, 0.0)):
            rates = _derivative(work, stages[n, part])
            for k in range(N_STATES):
                total[k] += weight * rates[k]
                work[STATE + k] = states[n, k] + ahead * step * rates[k]
        for k in range(N_STATES):
            work[STATE + k] = states[n, k] + step / 6.0 * total[k]
    return states


def simulate(simulator: Simulator) -> np.ndarray:
    """States (601, 12) of the vehicle of a simulator, at its output times and by its step."""
    work = rows_of(simulator, simulator.vehicle.xi)
    return runge_kutta(simulator._stages, simulator.step, work)[:: round(1.0 / simulator.step)]


if __name__ == "__main__":
    simulator = spiral(float(sys.argv[2]))
    shortest = min(timeit.repeat(lambda: simulate(simulator), number=1, repeat=3))
    np.savez(sys.argv[1], seconds=shortest, states=simulate(simulator))
