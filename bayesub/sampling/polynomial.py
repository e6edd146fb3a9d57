"""Polynomials of many variables with products in few directions, compiled.

A polynomial has a constant, all z linearly, squares and products of the components a = z'A along `active` directions A,
and cubes and triple products of the first :data:`CUBIC` of these. Compiled functions take places place after place, z
(n_params, n), so that a sum over terms is one matrix product: few places at once, whose terms stay in a core's cache.
"""

from math import comb

import numpy as np
from scipy import linalg

from bayesub.sampling.compiled import compiled

CUBIC = 8  # of the most active directions that are worth a cubic too
PLACES = 64  # at once


def n_features(n_params: int, n_active: int) -> int:
    """Number of terms."""
    return 1 + n_params + _n_products(n_active)


def _n_products(n_active):
    return comb(n_active + 1, 2) + comb(min(n_active, CUBIC) + 2, 3)


def features(z, active) -> np.ndarray:
    """(n, n_features) terms of z (n, n_params), with `active` (n_params, n_active): 1, z, a_i a_j, a_i a_j a_k.

    They lie in memory term after term, so that all places are multiplied at once, and are seen transposed.
    """
    n_linear = z.shape[1] + 1
    terms = np.empty((n_features(*active.shape), len(z)))
    terms[0] = 1.0
    terms[1:n_linear] = z.T
    _products(np.dot(active.T, z.T), min(active.shape[1], CUBIC), terms[n_linear:])
    return terms.T


def fitted(z, active, wanted, ridge: float) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (n_features, k) of the polynomials nearest to values `wanted` (n, k) at z (n, n_params).

    And what is left of the values (n, k). A relative `ridge` keeps the normal equations regular when places repeat.
    """
    known = features(z, active)
    gram = known.T @ known
    gram[np.diag_indices(len(gram))] *= 1.0 + ridge
    coefficients = linalg.solve(gram, known.T @ wanted, assume_a="pos")
    return coefficients, wanted - known @ coefficients


def values(z, active, coefficients) -> np.ndarray:
    """(n, k) polynomials at z (n, n_params), with coefficients (n_features, k) of the terms."""
    active, coefficients = np.ascontiguousarray(active), np.ascontiguousarray(coefficients)
    found = np.empty((len(z), coefficients.shape[1]))
    for k in range(0, len(z), PLACES):
        found[k : k + PLACES] = values_at(np.ascontiguousarray(z[k : k + PLACES].T), active, coefficients).T
    return found


@compiled
def values_at(z, active, coefficients):
    """(k, n) polynomials at z (n_params, n), with coefficients (n_features, k) of the terms."""
    n_linear = len(z) + 1
    products = coefficients[n_linear:]
    terms = np.empty((len(products), z.shape[1]))
    _products(np.dot(active.T, z), min(active.shape[1], CUBIC), terms)
    found = np.dot(products.T, terms)
    found += np.dot(coefficients[1:n_linear].T, z)
    for k in range(len(found)):
        found[k] += coefficients[0, k]
    return found


@compiled
def pullback_at(z, active, coefficients, slopes):
    """(n_params, n) gradient by z of what has the gradient slopes (k, n) by the polynomials."""
    n_linear = len(z) + 1
    along = np.dot(active.T, z)
    by_along = np.zeros_like(along)
    _products_pullback(along, min(active.shape[1], CUBIC), np.dot(coefficients[n_linear:], slopes), by_along)
    found = np.dot(coefficients[1:n_linear], slopes)
    found += np.dot(active, by_along)
    return found


@compiled
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


@compiled
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


@compiled
def _multiply(first, second, product):
    for m in range(len(product)):
        product[m] = first[m] * second[m]


@compiled
def _add_multiple(first, second, total):
    for m in range(len(total)):
        total[m] += first[m] * second[m]
