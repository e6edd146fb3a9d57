"""The motion between the steps of the integrator, at times that differ from one member of a batch to another.

What a simulator gives between two steps is a cubic polynomial of time, the Hermite interpolation of states and slopes
at both, and accelerations are its rate of change (model manual, section 6). Outputs at four times of a step are
therefore all of it (Lagrange), states and accelerations alike. The motion and its derivatives by parameters are linear
in these outputs, so that at any time they are those that the integrator itself gives there, to round-off. The
derivative by time is that of the polynomial; the one of accelerations jumps from step to step.

Hermite interpolation is of fourth order, as the integrator is where forces are smooth; its rate is of third order.
"""

import numpy as np

_PLACES = np.arange(4) / 3.0  # in a step


class DenseOutput:
    """The steps of the integrator as pieces of a motion; before the first and after the last their polynomials go on.

    Where the `end` of the motion (s, from time zero) is not a multiple of the step (s) the last piece is shorter.
    """

    def __init__(self, step: float, end: float):
        n = max(1, int(np.ceil(end / step * (1.0 - 1e-12))))
        self.step = step
        self._starts = np.arange(n) * step
        self._lengths = np.append(np.diff(self._starts), end - self._starts[-1])

    def pieces(self, times: np.ndarray) -> np.ndarray:
        """Numbers of the pieces at times (..)."""
        return np.clip(np.floor_divide(times, self.step), 0, len(self._starts) - 1).astype(int)

    def looks(self, pieces: np.ndarray) -> np.ndarray:
        """(4 m,) times at which ascending pieces (m,) are looked at; they do not descend."""
        return (self._starts[pieces, None] + self._lengths[pieces, None] * _PLACES).ravel()

    def at(
        self, times: np.ndarray, pieces: np.ndarray, looked: np.ndarray, outputs: np.ndarray, *, rates: bool = False
    ) -> np.ndarray:
        """(n_batch, n, n_outputs) outputs at times (n_batch, n), s, in their :meth:`pieces`, or their rates of change.

        `looked` (m,): different pieces, ascending; `outputs` (n_batch, 4 m, n_outputs): those at their :meth:`looks`.
        """
        lengths = self._lengths[pieces]
        weights = (_slopes if rates else _values)(3.0 * (times - self._starts[pieces]) / lengths)
        if rates:
            weights = [3.0 * weight / lengths for weight in weights]
        position = np.zeros(len(self._starts), dtype=int)
        position[looked] = np.arange(len(looked))
        first = 4 * (position[pieces] + len(looked) * np.arange(len(outputs))[:, None])
        flat = outputs.reshape(-1, outputs.shape[-1])
        return sum(weight[..., None] * flat[first + k] for k, weight in enumerate(weights))


def _values(s) -> list[np.ndarray]:
    """Weights of four values at 0, 1, 2 and 3 in the cubic polynomial through them, at s."""
    a, b, c = s - 1.0, s - 2.0, s - 3.0
    return [-a * b * c / 6.0, s * b * c / 2.0, -s * a * c / 2.0, s * a * b / 6.0]


def _slopes(s) -> list[np.ndarray]:
    """Weights of the same four values in its derivative by s."""
    return [
        -((3.0 * s - 12.0) * s + 11.0) / 6.0,
        ((3.0 * s - 10.0) * s + 6.0) / 2.0,
        -((3.0 * s - 8.0) * s + 3.0) / 2.0,
        ((3.0 * s - 6.0) * s + 2.0) / 6.0,
    ]
