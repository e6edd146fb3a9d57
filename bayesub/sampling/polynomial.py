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
    """(n, n_features) terms of z (n, n_params), with `active` (n_params, n_active): 1, z, a_i a_j, a_i a_j a_k.

    They lie in memory term after term, so that all walkers are multiplied at once, and are seen transposed.
    """
    n_linear = z.shape[1] + 1
    terms = np.empty((n_features(*active.shape), len(z)))
    terms[0] = 1.0
    terms[1:n_linear] = z.T
    _products(np.dot(active.T, z.T), min(active.shape[1], CUBIC), terms[n_linear:])
    return terms.T


def pullback(z, active, slopes) -> np.ndarray:
    """(n, n_params) gradient by z of what has the gradient slopes (n, n_features) by the terms of z."""
    n_linear = z.shape[1] + 1
    along = np.dot(active.T, z.T)
    by_along = np.zeros_like(along)
    _products_pullback(along, min(active.shape[1], CUBIC), np.ascontiguousarray(slopes.T)[n_linear:], by_along)
    return slopes[:, 1:n_linear] + by_along.T @ active.T


@numba.njit(cache=True, nogil=True)
def _products(a, n_cubic, terms):
    """Write a_i a_j for i <= j, then a_i a_j a_k for i <= j <= k < n_cubic; a (n_active, n), terms (n_products, n)."""
    n_active, row = len(a), 0
    for i in range(n_active):
        for j in range(i, n_active):
            _multiply(a[i], a[j], terms[row])
            row += 1
    for i in range(n_cubic):
        for j in range(i, n_cubic):
            both = terms[i * n_active - i * (i - 1) // 2 + j - i]
            for k in range(j, n_cubic):
                _multiply(both, a[k], terms[row])
                row += 1


@numba.njit(cache=True, nogil=True)
def _products_pullback(a, n_cubic, slopes, by_a):
    """Add to by_a (n_active, n) the gradient of what has the gradient slopes (n_products, n) by the products."""
    n_active, n = a.shape
    both, by_both = np.empty(n), np.empty(n)
    row = 0
    for i in range(n_active):
        for j in range(i, n_active):
            _add_multiple(slopes[row], a[j], by_a[i])
            _add_multiple(slopes[row], a[i], by_a[j])
            row += 1
    for i in range(n_cubic):
        for j in range(i, n_cubic):
            _multiply(a[i], a[j], both)
            by_both[:] = 0.0
            for k in range(j, n_cubic):
                _add_multiple(slopes[row], both, by_a[k])
                _add_multiple(slopes[row], a[k], by_both)
                row += 1
            _add_multiple(by_both, a[j], by_a[i])
            _add_multiple(by_both, a[i], by_a[j])


@numba.njit(cache=True, nogil=True)
def _multiply(first, second, product):
    for m in range(len(product)):
        product[m] = first[m] * second[m]


@numba.njit(cache=True, nogil=True)
def _add_multiple(first, second, total):
    for m in range(len(total)):
        total[m] += first[m] * second[m]
