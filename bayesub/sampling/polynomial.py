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


@numba.njit(cache=True, nogil=True)
def _products(a, n_cubic, terms):
    """Write a_i a_j for i <= j, then a_i a_j a_k for i <= j <= k < n_cubic."""
    n, n_active = a.shape
    for m in range(n):
        row, first = a[m], 0
        for i in range(n_active):
            first = _multiples(row[i], row[i:], terms[m], first)
        for i in range(n_cubic):
            for j in range(i, n_cubic):
                first = _multiples(row[i] * row[j], row[j:n_cubic], terms[m], first)


@numba.njit(cache=True, nogil=True)
def _multiples(factor, values, terms, first):
    """Write factor * values from `first` on; the position after them.

    A loop over slices from zero is what the compiler makes vector instructions of.
    """
    last = first + len(values)
    part = terms[first:last]
    for k in range(len(values)):
        part[k] = factor * values[k]
    return last


@numba.njit(cache=True, nogil=True)
def _products_pullback(a, n_cubic, slopes, by_a):
    """Add to by_a (n, n_active) the gradient of what has the gradient slopes by the products."""
    n, n_active = a.shape
    for m in range(n):
        row, given, out, first = a[m], slopes[m], by_a[m], 0
        for i in range(n_active):
            by_factor = _multiples_pullback(row[i], row[i:], given, first, out[i:])
            out[i] += by_factor
            first += n_active - i
        for i in range(n_cubic):
            for j in range(i, n_cubic):
                by_both = _multiples_pullback(row[i] * row[j], row[j:n_cubic], given, first, out[j:n_cubic])
                out[i] += by_both * row[j]
                out[j] += by_both * row[i]
                first += n_cubic - j


@numba.njit(cache=True, nogil=True)
def _multiples_pullback(factor, values, slopes, first, by_values):
    """Add to by_values the gradient of what has the gradient slopes, from `first` on, by factor * values.

    Returns the derivative by the factor.
    """
    part, by_factor = slopes[first : first + len(values)], 0.0
    for k in range(len(values)):
        by_values[k] += factor * part[k]
        by_factor += part[k] * values[k]
    return by_factor
