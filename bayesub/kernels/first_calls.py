"""Call every kernel that Python calls, with the types that a study gives them, so that all are compiled and cached.

The numbers are of no boat: a kernel is compiled for the types of its arguments.
"""

import numpy as np

from bayesub.kernels import noise
from bayesub.kernels.integrate import body_accelerations, integrate, integrate_parallel
from bayesub.kernels.mass import mass_matrix
from bayesub.kernels.sensitivities import WIDTH, fly, sensitivities
from bayesub.kernels.workspace import IXX, IYY, IZZ, LANES, MASS, N_BODY, N_COEFFICIENTS, N_CONTROLS, N_STATES

_N_TIMES = 3
_SPEED = 1.0


def call_all() -> None:
    """Call the kernels of the motion and of the noise."""
    call_motion()
    for n_batch in (1, 2 * LANES):  # the serial and the parallel variant
        call_noise(n_batch)


def call_motion() -> None:
    """Fly a cube of unit mass and no forces for two steps, forwards, linearised and point by point."""
    coefficients, body, initial = np.zeros((1, N_COEFFICIENTS)), np.zeros((1, N_BODY)), np.zeros((1, N_STATES))
    body[0, [MASS, IXX, IYY, IZZ]] = 1.0
    initial[0, 6] = _SPEED
    times = np.arange(float(_N_TIMES))
    stages = np.zeros((_N_TIMES, 3, N_CONTROLS))
    rows = np.arange(N_STATES)
    for kernel in (integrate, integrate_parallel):
        states, _ = kernel(coefficients, body, initial, stages, 1.0, times, 10.0 * _SPEED, False, rows)
    body_accelerations(coefficients, body, states, np.zeros((_N_TIMES, N_CONTROLS)))

    history = fly(coefficients, body, initial, stages, 1.0, 10.0 * _SPEED)
    integers = np.zeros(1, dtype=int)
    columns = integers[:0], integers, np.ones(1), integers, np.zeros((1, WIDTH))
    sensitivities(coefficients, body, history, stages, 1.0, times, *columns, rows)

    constant = body[0].copy()
    constant.setflags(write=False)  # as the body of a vehicle is
    for vector in (body[0], constant):
        mass_matrix(coefficients[0], vector)


def call_noise(n_batch: int) -> None:
    """Compare a batch of predictions to readings under each model of noise."""
    predicted, readings, times = np.zeros((n_batch, _N_TIMES)), np.zeros(_N_TIMES), np.arange(float(_N_TIMES))
    ones = np.ones(n_batch)
    noise.gathered(predicted, np.arange(_N_TIMES))
    noise.sums_of_squares(predicted, readings)
    noise.student_t_logarithms(predicted, readings, ones, ones)
    noise.autoregressive_sums(predicted, readings, times, ones)
    noise.rounded_log_probabilities(predicted, readings, 0.5, ones)
    noise.rounded_slopes(predicted, readings, 0.5, ones)
