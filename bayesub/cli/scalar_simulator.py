"""What a user would write instead of the simulator: one simulation at a time, by Runge-Kutta 4 with a fixed step.

The equations of motion are the package's own, for one state. With ``NUMBA_DISABLE_JIT=1`` everything here is plain
Python and NumPy; ``python -m bayesub.cli.scalar_simulator STEP`` prints the seconds of one simulation.
"""

import sys
import timeit

import numba
import numpy as np

from bayesub.kernels.workspace import LANES, N_STATES, STATE
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulator import Simulator
from bayesub.model.vehicles import load_vehicle

_KERNELS = load_vehicle("suboff").kernels("horizontal")
_N_ROWS = _KERNELS.layout.N_ROWS
_euler_derivative = _KERNELS.dynamics.euler_derivative
TIMES = np.linspace(0.0, 600.0, 601)


def spiral(step: float | None = None, subproblem: str | None = "horizontal") -> Simulator:
    """The simulator of the 600 s spiral of `suboff` at 601 output times, with its own step or a given one (s)."""
    vehicle = load_vehicle("suboff")
    return Simulator(vehicle, load_manoeuvre("horizontal", vehicle), TIMES, dt=step, subproblem=subproblem)


def workspace(simulator: Simulator) -> np.ndarray:
    """The vehicle of a simulator, as the equations of motion read it, and its initial state."""
    vehicle, work = simulator.vehicle, np.zeros(_N_ROWS * LANES)
    initial = simulator.manoeuvre.initial_state
    body = np.concatenate([vehicle.body, vehicle.constants])
    _KERNELS.integrate.load_block(work, 0, simulator.dimensional(vehicle.xi), body[None], initial[None])
    return work


@numba.njit
def derivative(state, controls, work):
    """Rates (12,) of a state (12,) under controls (4,)."""
    for k in range(N_STATES):
        work[(STATE + k) * LANES] = state[k]
    return np.array(_euler_derivative(work, 0, STATE, controls))


@numba.njit
def runge_kutta(state, stages, step, work):
    """States (n, 12) at all steps, from controls (n, 3, 4) at the beginning, middle and end of each."""
    states = np.empty((len(stages), N_STATES))
    states[0] = state
    for n in range(len(stages) - 1):
        k1 = derivative(state, stages[n, 0], work)
        k2 = derivative(state + 0.5 * step * k1, stages[n, 1], work)
        k3 = derivative(state + 0.5 * step * k2, stages[n, 1], work)
        k4 = derivative(state + step * k3, stages[n, 2], work)
        state = state + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        states[n + 1] = state
    return states


def simulate(simulator: Simulator) -> np.ndarray:
    """States (601, 12) of the vehicle of a simulator, at its output times and by its step."""
    initial, work = simulator.manoeuvre.initial_state, workspace(simulator)
    return runge_kutta(initial, simulator._stages, simulator.step, work)[:: round(1.0 / simulator.step)]


if __name__ == "__main__":
    simulator = spiral(float(sys.argv[1]))
    print(min(timeit.repeat(lambda: simulate(simulator), number=1, repeat=3)))
