"""What the Jacobians of several manoeuvres show of null directions.

A direction that none sees belongs to the equations (structural); one that some manoeuvre sees, however faintly, is a
matter of accuracy (practical) and of the manoeuvre.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from bayesub.inference.identifiability.linalg import complete_svd
from bayesub.inference.identifiability.rank import ACCURACY


@dataclass(frozen=True)
class Structure:
    """What several Jacobians of the same parameters cannot see together.

    Attributes
    ----------
    singular_values : (n_params,) of all Jacobians together, columns scaled to unit length, descending
    threshold : singular values below it are round-off
    structural : (n_structural, n_params) unit vectors, in the coordinates of the columns, that stay at round-off in
        every Jacobian
    practical : (n_practical, n_params) unit vectors above round-off but below the accuracy of readings, faintest first
    alone : one count a Jacobian, the directions at round-off there; what exceeds n_structural is its own blindness
    spectra : (n_jacobians, n_params) singular values of each Jacobian by itself over the largest
    """

    singular_values: np.ndarray
    threshold: float
    structural: np.ndarray
    practical: np.ndarray
    alone: tuple[int, ...]
    spectra: np.ndarray

    @property
    def n_structural(self) -> int:
        """Number of directions that no Jacobian sees."""
        return len(self.structural)

    @property
    def n_practical(self) -> int:
        """Number of directions that are seen, but below the accuracy of readings."""
        return len(self.practical)

    @property
    def gap(self) -> float | None:
        """Smallest singular value above round-off over the largest below it; None without structural directions."""
        if self.n_structural == 0:
            return None
        first = len(self.singular_values) - self.n_structural
        return float(self.singular_values[first - 1] / max(self.singular_values[first], np.finfo(float).tiny))


def structure(jacobians: Iterable[np.ndarray], *, noise: float | None = None, accuracy: float = ACCURACY) -> Structure:
    """Directions that stay at round-off in all of several Jacobians, and those that are merely faint.

    The Jacobians are divided by their norms and stacked. What a vector gives in the stack is the root of the sum of
    squares of what it gives in each, so that the null space of the stack holds exactly the directions that are null in
    every one: the same directions, where equal counts could belong to different ones.

    Parameters
    ----------
    jacobians : sequence of (n_readings, n_params), readings differing; columns of comparable size, such as derivatives
        in prior standard deviations. The null directions of a submarine change with its coefficients (a multiple of
        what the coefficients are short of the rigid body's own terms), so these are manoeuvres of one coefficient set
    noise : error of a Jacobian over its largest singular value. By default ten machine epsilons a reading, for exact
        derivatives: the hundred or so roundings of a step add up as a random walk, the steps add up in line, and there
        are about as many readings as steps. Differences need more: theirs is the round-off of the track over the step
    accuracy : relative accuracy of the best readings, below which a direction is practical

    Raises
    ------
    ValueError : for Jacobians that differ in their number of columns, or that are not finite
    """
    jacobians = [np.asarray(jacobian, dtype=float) for jacobian in jacobians]
    if len({jacobian.shape[1] for jacobian in jacobians}) != 1:
        raise ValueError("structure needs at least one Jacobian, and all of them of the same parameters")
    if noise is None:
        noise = 10 * np.finfo(float).eps * max(len(jacobian) for jacobian in jacobians)
    parts = [jacobian / np.linalg.norm(jacobian) for jacobian in jacobians]
    lengths = np.linalg.norm(np.vstack(parts), axis=0)
    lengths[lengths == 0.0] = 1.0
    parts = [np.linalg.qr(part / lengths, mode="r") for part in parts]  # the same singular values and directions

    _, s, vt = complete_svd(np.vstack(parts))
    # Each Jacobian brings its own error; together they are a root of their number larger.
    threshold = float(noise * np.sqrt(len(parts)) * s[0])
    spectra = np.array([complete_svd(part)[1] for part in parts])
    spectra /= spectra[:, :1]
    null, faint = s <= threshold, (s > threshold) & (s <= accuracy * s[0])
    return Structure(
        singular_values=s,
        threshold=threshold,
        structural=_units(vt[null] / lengths),
        practical=_units(vt[faint][::-1] / lengths),
        alone=tuple(int(n) for n in np.count_nonzero(spectra <= noise, axis=1)),
        spectra=spectra,
    )


def _units(vectors):
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
