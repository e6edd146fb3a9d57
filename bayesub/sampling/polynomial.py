"""Polynomials of many variables with products in few directions, compiled.

A polynomial has a constant, all z linearly, squares and products of the components a = z'A along `active` directions A,
and cubes and triple products of the first :data:`CUBIC` of these.
"""

from math import comb

import numba
import numpy as np

CUBIC = 6  # of the most active directions that are worth a cubic too


def n_features(n_params: int, n_active: int) -> int:
    """Number of terms."""
    return 1 + n_params + comb(n_active + 1, 2) + comb(min(n_active, CUBIC) + 2, 3)


def features(z, active) -> np.ndarray:
    """(n, n_features) terms of z (n, n_params), with `active` (n_params, n_active): 1, z, a_i a_j, a_i a_j a_k."""
    terms = np.empty((len(z), n_features(*active.shape)))
    terms[:, 0] = 1.0
    terms[:, 1 : z.shape[1] + 1] = z
    _products(z @ active, min(active.shape[1], CUBIC), terms[:, z.shape[1] + 1 :])
    return terms


def pullback(z, active, slopes) -> np.ndarray:
    """(n, n_params) gradient by z of what has the gradient slopes (n, n_features) by the terms of z."""
    n_linear = z.shape[1] + 1
    along = z @ active
    by_along = np.zeros_like(along)
    _products_pullback(along, min(active.shape[1], CUBIC), slopes[:, n_linear:], by_along)
    return slopes[:, 1:n_linear] + by_along @ active.T


@numba.njit(cache=True)
def _products(a, n_cubic, terms):
    """Write a_i a_j for i <= j, then a_i a_j a_k for i <= j <= k < n_cubic."""
    n, n_active = a.shape
    for m in range(n):
        row, out, t = a[m], terms[m], 0
        for i in range(n_active):
            for j in range(i, n_active):
                out[t + j - i] = row[i] * row[j]
            t += n_active - i
        for i in range(n_cubic):
            for j in range(i, n_cubic):
                both = row[i] * row[j]
                for k in range(j, n_cubic):
                    out[t + k - j] = both * row[k]
                t += n_cubic - j


@numba.njit(cache=True)
def _products_pullback(a, n_cubic, slopes, by_a):
    """Add to by_a (n, n_active) the gradient of what has the gradient slopes by the products."""
    n, n_active = a.shape
    for m in range(n):
        row, given, out, t = a[m], slopes[m], by_a[m], 0
        for i in range(n_active):
            for j in range(i, n_active):
                slope = given[t + j - i]
                out[i] += slope * row[j]
                out[j] += slope * row[i]
            t += n_active - i
        for i in range(n_cubic):
            for j in range(i, n_cubic):
                for k in range(j, n_cubic):
                    slope = given[t + k - j]
                    out[i] += slope * row[j] * row[k]
                    out[j] += slope * row[i] * row[k]
                    out[k] += slope * row[i] * row[j]
                t += n_cubic - j
