"""Call every kernel of the noise with the types that a study gives it, so that all are compiled and cached."""

import numpy as np

from bayesub.kernels import noise
from bayesub.kernels.workspace import LANES

_N_TIMES = 3


def call_all() -> None:
    """Compare batches of predictions to readings under each model of noise, by the serial and the parallel variant."""
    for n_batch in (1, 2 * LANES):
        _call(n_batch)


def _call(n_batch: int) -> None:
    predicted, readings, times = np.zeros((n_batch, _N_TIMES)), np.zeros(_N_TIMES), np.arange(float(_N_TIMES))
    ones = np.ones(n_batch)
    noise.gathered(predicted, np.arange(_N_TIMES))
    noise.sums_of_squares(predicted, readings)
    noise.student_t_logarithms(predicted, readings, ones, ones)
    noise.autoregressive_sums(predicted, readings, times, ones)
    noise.rounded_log_probabilities(predicted, readings, 0.5, ones)
    noise.rounded_slopes(predicted, readings, 0.5, ones)
