"""What a user would write instead of the simulator: one simulation at a time, by Runge-Kutta 4 with a fixed step.

The equations of motion are the package's own, for one state, and no step makes an array. With ``NUMBA_DISABLE_JIT=1``
everything here is plain Python and NumPy; ``python -m bayesub.cli.scalar_simulator FILE STEP`` writes the seconds of a
simulation and its states.
"""

import sys
import timeit

import numba
import numpy as np

from bayesub.kernels.workspace import LANES, N_STATES, STATE
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulator import Simulator
from bayesub.model.vehicles import Vehicle, load_vehicle

_KERNELS = load_vehicle("suboff").kernels("horizontal")
_euler_derivative = _KERNELS.dynamics.euler_derivative
_jit = numba.njit(nogil=True, error_model="numpy", fastmath={"contract"})
TIMES = np.linspace(0.0, 600.0, 601)
BATCH = 256


def spiral(step: float | None = None, subproblem: str | None = "horizontal") -> Simulator:
    """The simulator of the 600 s spiral of `suboff` at 601 output times, with its own step or a given one (s)."""
    vehicle = load_vehicle("suboff")
    return Simulator(vehicle, load_manoeuvre("horizontal", vehicle), TIMES, dt=step, subproblem=subproblem)


def perturbed(vehicle: Vehicle, n_batch: int) -> np.ndarray:
    """(n_batch, 101) coefficients that are off by one per cent."""
    return vehicle.xi * (1.0 + 0.01 * np.random.default_rng(0).standard_normal((n_batch, len(vehicle.xi))))


def workspaces(simulator: Simulator, xi: np.ndarray) -> np.ndarray:
    """Boats with coefficients `xi` (n_batch, n_terms) as the equations of motion read them.

    They are (n_blocks, n_rows * LANES), blocks of LANES boats, each at the start of its manoeuvre.
    """
    vehicle, n = simulator.vehicle, len(xi)
    body = np.concatenate([vehicle.body, vehicle.constants])[None].repeat(n, axis=0)
    initial, dimensional = simulator.manoeuvre.initial_state[None].repeat(n, axis=0), simulator.dimensional(xi)
    blocks = np.zeros((-(-n // LANES), simulator.kernels.layout.N_ROWS * LANES))
    for k, work in enumerate(blocks):
        simulator.kernels.integrate.load_block(work, k * LANES, dimensional, body, initial)
    return blocks


@_jit
def derivative(state, controls, work):
    """Rates (12,) of a state (12,) under controls (4,)."""
    for k in range(N_STATES):
        work[(STATE + k) * LANES] = state[k]
    return np.array(_euler_derivative(work, 0, STATE, controls))


@_jit
def runge_kutta(stages, step, work):
    """States (n, 12) of the first boat of a workspace, from controls (n, 3, 4) at start, middle and end of steps."""
    work = work.copy()
    states, total = np.empty((len(stages), N_STATES)), np.empty(N_STATES)
    for n in range(len(stages)):
        for k in range(N_STATES):
            states[n, k] = work[(STATE + k) * LANES]
            total[k] = 0.0
        for part, weight, ahead in ((0, 1.0, 0.5), (1, 2.0, 0.5), (1, 2.0, 1.0), (2, 1.0, 0.0)):
            rates = _euler_derivative(work, 0, STATE, stages[n, part])
            for k in range(N_STATES):
                total[k] += weight * rates[k]
                work[(STATE + k) * LANES] = states[n, k] + ahead * step * rates[k]
        for k in range(N_STATES):
            work[(STATE + k) * LANES] = states[n, k] + step / 6.0 * total[k]
    return states


def simulate(simulator: Simulator) -> np.ndarray:
    """States (601, 12) of the vehicle of a simulator, at its output times and by its step."""
    (work,) = workspaces(simulator, simulator.vehicle.xi[None])
    return runge_kutta(simulator._stages, simulator.step, work)[:: round(1.0 / simulator.step)]


if __name__ == "__main__":
    simulator = spiral(float(sys.argv[2]))
    shortest = min(timeit.repeat(lambda: simulate(simulator), number=1, repeat=3))
    np.savez(sys.argv[1], seconds=shortest, states=simulate(simulator))
