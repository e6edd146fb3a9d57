"""How the stiff coordinates of a sheet follow those behind them, and the compiled map of a chain of such bends.

The map from straight coordinates y to whitened ones z and its pullback go over a few places at once, all bends for them
one after another (:mod:`bayesub.inference.sampling.geometry`).
"""

from dataclasses import dataclass

import numpy as np

from bayesub.inference.sampling.compiled import compiled, inline
from bayesub.inference.sampling.polynomial import (
    PLACES,
    PLAIN,
    Polynomials,
    add,
    columns,
    copy,
    fitted,
    pullback_at,
    put,
    values_at,
)

_WORTH = 0.3  # of the sd of what is left, that products must explain


@dataclass(frozen=True)
class Bend:
    """``z_B = polynomials(z_after) + factor y_B`` for the coordinates ``start .. stop``."""

    start: int
    stop: int
    polynomials: Polynomials
    factor: np.ndarray

    def __call__(self, z) -> np.ndarray:
        """The curved surface q_B (n, stop - start) under whitened coordinates z (n, n_params)."""
        return self.polynomials(z[:, self.stop :])

    @classmethod
    def fitted(cls, z, start, stop, active):
        """The bend of draws z (n, n_params)."""
        polynomials, misfit = fitted(z[:, stop:], active, z[:, start:stop], _WORTH)
        n_terms = len(polynomials.linear) + polynomials.bent.size / (stop - start)
        return cls(start, stop, polynomials, np.linalg.cholesky(misfit.T @ misfit / (len(z) - n_terms)))

    def arrays(self) -> dict[str, np.ndarray]:
        """What it consists of, by name."""
        block = np.array([self.start, self.stop])
        return {"block": block, "factor": self.factor, **self.polynomials.arrays()}

    @classmethod
    def restored(cls, arrays: dict[str, np.ndarray]) -> "Bend":
        """The bend of :meth:`arrays`."""
        return cls(*map(int, arrays["block"]), Polynomials.restored(arrays), arrays["factor"])


def packed(bends) -> tuple[np.ndarray, np.ndarray]:
    """Bends as arrays, for what is compiled.

    Returns
    -------
    (n_bends, 10) of each its start, stop, numbers of active directions, of products and of combinations that have
    these, and where among all numbers its active directions, the three parts of its polynomials and its factor begin;
    and these numbers in a row.
    """
    sizes, parts, first = np.empty((len(bends), 10), dtype=np.int64), [np.empty(0)], 0
    for size, bend in zip(sizes, bends, strict=True):
        size[:5] = bend.start, bend.stop, bend.polynomials.active.shape[1], *bend.polynomials.bent.shape
        for k, part in enumerate((*bend.polynomials[:4], bend.factor), start=5):
            size[k] = first
            first += part.size
            parts.append(np.ravel(part))
    return sizes, np.concatenate(parts)


@inline
def _part(numbers, first, n_rows, n_columns):
    return numbers[first : first + n_rows * n_columns].reshape(n_rows, n_columns)


@compiled
def _bend(n_params, size, numbers):
    """Block, polynomials and factor of a bend."""
    start, stop, n_active, n_products, n_bent, at_active, at_linear, at_bent, at_mix, at_factor = size
    n_after, n_block = n_params - stop, stop - start
    polynomials = Polynomials(
        _part(numbers, at_active, n_after, n_active),
        _part(numbers, at_linear, 1 + n_after, n_block),
        _part(numbers, at_bent, n_products, n_bent),
        _part(numbers, at_mix, n_bent, n_block),
        PLAIN,
    )
    return start, stop, polynomials, _part(numbers, at_factor, n_block, n_block)


@compiled
def bend_at(y, sizes, numbers):
    """Make straight coordinates y (n_params, n) whitened ones, in place."""
    for b in range(len(sizes) - 1, -1, -1):
        start, stop, polynomials, factor = _bend(len(y), sizes[b], numbers)
        moved = np.dot(factor, y[start:stop])
        add(values_at(y[stop:], polynomials), moved)
        copy(moved, y[start:stop])


@compiled
def pull_back_at(z, slopes, sizes, numbers):
    """Make a gradient `slopes` (n_params, n) by whitened coordinates z one by straight coordinates, in place."""
    for b in range(len(sizes)):
        start, stop, polynomials, factor = _bend(len(z), sizes[b], numbers)
        add(pullback_at(z[stop:], polynomials, slopes[start:stop]), slopes[stop:])
        copy(np.dot(factor.T, slopes[start:stop]), slopes[start:stop])


@compiled
def bent(y, sizes, numbers):
    """Whitened coordinates z (n, n_params) of straight ones y (n, n_params)."""
    z = np.empty(y.shape)
    for first in range(0, len(y), PLACES):
        some = columns(y, first)
        bend_at(some, sizes, numbers)
        put(some, z, first)
    return z
