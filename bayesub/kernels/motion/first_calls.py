"""Call every kernel of motion with the types that a study gives it, so that all are compiled and cached.

The numbers are of no boat: a kernel is compiled for the types of its arguments.
"""

import numpy as np

from bayesub.kernels import first_calls
from bayesub.kernels.variations import of_dense
from bayesub.kernels.workspace import IXX, IYY, IZZ, MASS, N_BODY, N_STATES

from .attitude_form import QUATERNIONS
from .hydrodynamics import N_COEFFICIENTS, N_CONSTANTS, N_CONTROLS
from .integrate import body_accelerations, integrate, integrate_parallel
from .mass import mass_matrix
from .sensitivities import WIDTH, fly, sensitivities

_N_TIMES = 3
_SPEED = 1.0


def call_all() -> None:
    """Call the kernels of this family and those of the noise."""
    call_motion()
    first_calls.call_all()


def call_motion() -> None:
    """Fly a cube of unit mass and no forces for two steps, forwards, linearised and point by point."""
    coefficients, initial = np.zeros((1, N_COEFFICIENTS)), np.zeros((1, N_STATES))
    body = np.zeros((1, N_BODY + N_CONSTANTS))
    body[0, [MASS, IXX, IYY, IZZ]] = 1.0
    initial[0, 6] = _SPEED
    times = np.arange(float(_N_TIMES))
    stages, variations = np.zeros((_N_TIMES, 3, N_CONTROLS)), of_dense(np.zeros((_N_TIMES, 3, 1, N_CONTROLS)))
    rows = np.arange(N_STATES)
    for kernel in (integrate, integrate_parallel):
        states, _ = kernel(
            coefficients, body, initial, stages, variations, np.zeros((1, 1)), 1.0, times, 10.0 * _SPEED, rows
        )
    if QUATERNIONS:
        return  # all else has Euler angles
    body_accelerations(coefficients, body, states, np.zeros((_N_TIMES, N_CONTROLS)))

    history = fly(coefficients, body, initial, stages, 1.0, 10.0 * _SPEED)
    integers = np.zeros(1, dtype=int)
    columns = integers[:0], integers, np.ones(1), integers, np.zeros((1, WIDTH))
    slots = np.zeros((1, 6), dtype=int) - 1
    sensitivities(coefficients, body, history, stages, variations, slots, 1.0, times, *columns, rows)

    constant = body[0].copy()
    constant.setflags(write=False)  # as the body of a vehicle is
    for vector in (body[0], constant):
        mass_matrix(coefficients[0], vector)
