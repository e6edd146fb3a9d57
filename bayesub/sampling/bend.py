"""How the stiff coordinates of a sheet follow those behind them, and the compiled map of a chain of such bends.

The map from straight coordinates y to whitened ones z and its pullback go over a few places at once, all bends for them
one after another (:mod:`bayesub.sampling.geometry`).
"""

from dataclasses import dataclass

import numpy as np

from bayesub.sampling.compiled import compiled
from bayesub.sampling.polynomial import PLACES, fitted, pullback_at, values, values_at

_RIDGE = 1e-9  # relative


@dataclass(frozen=True)
class Bend:
    """``z_B = features(z_after) coefficients + factor y_B`` for the coordinates ``start .. stop``."""

    start: int
    stop: int
    active: np.ndarray
    coefficients: np.ndarray
    factor: np.ndarray

    def __call__(self, z) -> np.ndarray:
        """The curved surface q_B (n, stop - start) under whitened coordinates z (n, n_params)."""
        return values(z[:, self.stop :], self.active, self.coefficients)

    @classmethod
    def fitted(cls, z, n_independent, start, stop, active):
        """The bend of draws z (n, n_params), of which so many are `n_independent`."""
        coefficients, misfit = fitted(z[:, stop:], active, z[:, start:stop], _RIDGE)
        covariance = misfit.T @ misfit / len(z) / (1.0 - len(coefficients) / n_independent)
        return cls(start, stop, active, coefficients, np.linalg.cholesky(covariance))


def packed(bends) -> tuple[np.ndarray, np.ndarray]:
    """Bends as arrays, for what is compiled.

    Returns
    -------
    (n_bends, 7) of each its start, stop and numbers of active directions and of features, and where among all numbers
    its active directions, its coefficients and its factor begin; and these numbers in a row.
    """
    sizes, parts, first = np.empty((len(bends), 7), dtype=np.int64), [np.empty(0)], 0
    for size, bend in zip(sizes, bends, strict=True):
        size[:4] = bend.start, bend.stop, bend.active.shape[1], len(bend.coefficients)
        for k, part in enumerate((bend.active, bend.coefficients, bend.factor), start=4):
            size[k] = first
            first += part.size
            parts.append(np.ravel(part))
    return sizes, np.concatenate(parts)


@compiled
def _bend(n_params, size, numbers):
    """Active directions, coefficients and factor of a bend."""
    start, stop, n_active, n_features, at_active, at_coefficients, at_factor = size
    n_after, n_block = n_params - stop, stop - start
    active = numbers[at_active : at_active + n_after * n_active].reshape(n_after, n_active)
    coefficients = numbers[at_coefficients : at_coefficients + n_features * n_block].reshape(n_features, n_block)
    factor = numbers[at_factor : at_factor + n_block * n_block].reshape(n_block, n_block)
    return start, stop, active, coefficients, factor


@compiled
def bend_at(y, sizes, numbers):
    """Make straight coordinates y (n_params, n) whitened ones, in place."""
    for b in range(len(sizes) - 1, -1, -1):
        start, stop, active, coefficients, factor = _bend(len(y), sizes[b], numbers)
        moved = np.dot(factor, y[start:stop])
        moved += values_at(y[stop:], active, coefficients)
        y[start:stop] = moved


@compiled
def pull_back_at(z, slopes, sizes, numbers):
    """Make a gradient `slopes` (n_params, n) by whitened coordinates z one by straight coordinates, in place."""
    for b in range(len(sizes)):
        start, stop, active, coefficients, factor = _bend(len(z), sizes[b], numbers)
        slopes[stop:] += pullback_at(z[stop:], active, coefficients, slopes[start:stop])
        slopes[start:stop] = np.dot(factor.T, slopes[start:stop])


@compiled
def bent(y, sizes, numbers):
    """Whitened coordinates z (n, n_params) of straight ones y (n, n_params)."""
    z = np.empty(y.shape)
    for first in range(0, len(y), PLACES):
        some = np.ascontiguousarray(y[first : first + PLACES].T)
        bend_at(some, sizes, numbers)
        z[first : first + PLACES] = some.T
    return z
