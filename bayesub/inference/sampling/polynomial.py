"""Polynomials of many variables with products in few directions, compiled.

A polynomial has a constant, all z linearly, squares and products of the components a = z'A along `active` directions A,
and products of three and of four of the first few of these, or those of all these products that are `chosen`. Of many
such polynomials of the same z only some combinations are not nearly linear. Products are summed for few `bent`
combinations, whose share in each is its `mix`.

Compiled functions take places place after place, z (n_params, n), so that a sum over terms is one matrix product: few
places at once, whose terms stay in a core's cache.
"""

from collections.abc import Callable
from math import comb
from typing import Any, NamedTuple

import numpy as np
from scipy import linalg

from bayesub.kernels.jit import inline_exact, jit

# Numbers of the most active directions that have products of three, and of four.
PLAIN, RICH, RICHER = (8, 0), (12, 6), (20, 8)
PLACES = 64  # at once


def compiled(function: Callable) -> Callable[..., Any]:
    """A loop as those of the kernels are compiled, but with each product and each sum rounded."""
    return jit(function, exact=True)


def inline(function: Callable) -> Callable[..., Any]:
    """A function that becomes part of the loops that call it."""
    return inline_exact(function)


class Polynomials(NamedTuple):
    """``(1, z) linear + products(z) bent mix`` of variables z (n, n_params)."""

    active: np.ndarray  # (n_params, n_active) directions
    linear: np.ndarray  # (1 + n_params, k) coefficients of one and of z
    bent: np.ndarray  # (n_products, n_bent) coefficients of the chosen products
    mix: np.ndarray  # (n_bent, k)
    degrees: tuple[int, int]  # numbers of the active directions that have products of three, and of four
    chosen: np.ndarray  # (n_all_products,) whether they are chosen

    def arrays(self) -> dict[str, np.ndarray]:
        """Their arrays by name."""
        return {name: np.asarray(part) for name, part in self._asdict().items()}

    @classmethod
    def restored(cls, arrays: dict[str, np.ndarray]) -> "Polynomials":
        """The polynomials of :meth:`arrays`."""
        *parts, (three, four), chosen = (arrays[name] for name in cls._fields)
        return cls(parts[0], parts[1], parts[2], parts[3], (int(three), int(four)), chosen)

    def mixed(self, matrix: np.ndarray) -> "Polynomials":
        """The polynomials times a matrix (k, l)."""
        linear, mix = (np.ascontiguousarray(part @ matrix) for part in (self.linear, self.mix))
        return self._replace(linear=linear, mix=mix)

    def __call__(self, z) -> np.ndarray:
        """(n, k) values at z (n, n_params)."""
        result = np.empty((len(z), self.linear.shape[1]))
        for k in range(0, len(z), PLACES):
            result[k : k + PLACES] = values_at(np.ascontiguousarray(z[k : k + PLACES].T), self).T
        return result


def n_features(n_params: int, n_active: int, degrees: tuple[int, int] = PLAIN) -> int:
    """Number of terms."""
    products = (comb(min(n_active, n) + order - 1, order) for order, n in enumerate((n_active, *degrees), start=2))
    return 1 + n_params + sum(products)


def features(z: np.ndarray, active: np.ndarray, degrees: tuple[int, int] = PLAIN) -> np.ndarray:
    """(n, n_features) terms of z (n, n_params), with `active` (n_params, n_active): 1, z, a_i a_j, a_i a_j a_k, ..

    They lie in memory term after term, so that all places are multiplied at once, and are seen transposed.
    """
    n_linear = z.shape[1] + 1
    terms = np.empty((n_features(active.shape[0], active.shape[1], degrees), len(z)))
    terms[0] = 1.0
    terms[1:n_linear] = z.T
    _products(np.dot(active.T, z.T), degrees, np.ones(len(terms) - n_linear, dtype=bool), terms[n_linear:])
    return terms.T


def fitted(
    z: np.ndarray,
    active: np.ndarray,
    wanted: np.ndarray,
    worth: float,
    *,
    unit: np.ndarray | None = None,
    degrees: tuple[int, int] = PLAIN,
    least: float = 0.0,
    ridge: float = 1e-10,
) -> tuple[Polynomials, np.ndarray]:
    """The polynomials nearest to values `wanted` (n, k) at z (n, n_params), and what is left of these (n, k).

    Products are kept in combinations of the values where they explain more than is `worth` it, in standard deviations
    of the covariance `unit` (k, k), by default that of the misfit, and twice as much variance as so many terms explain
    of noise. Products are chosen that explain more than `least` beside all others, in standard deviations of `unit`
    and of the misfit together: what noise they would fit makes the rest wrong between the places. The relative `ridge`
    keeps the normal equations regular when places repeat.
    """
    known = features(z, active, degrees)
    n, n_linear = len(z), 1 + z.shape[1]
    gram, moments = known.T @ known, known.T @ wanted
    gram[np.diag_indices(len(gram))] *= 1.0 + ridge
    # In units of each term, so that they are as regular as the ridge makes them however far places lie from the
    # origin; units are powers of two, which round nothing.
    units = np.exp2(-np.round(0.5 * np.log2(np.diag(gram))))[:, None]
    gram, moments = units * gram * units.T, units * moments
    full = units * linalg.solve(gram, moments, assume_a="pos")
    chosen = np.ones(len(full) - n_linear, dtype=bool)
    if least > 0.0:
        misfit = wanted - known @ full
        noise = (0.0 if unit is None else unit) + misfit.T @ misfit / max(n - len(full), 1)
        slopes = linalg.solve_triangular(np.linalg.cholesky(noise), (full / units).T, lower=True)
        inverse, _ = linalg.lapack.dpotri(linalg.cholesky(gram))
        chosen = (np.sum(slopes**2, axis=0) / np.diag(inverse) > n * least**2)[n_linear:]
        kept = np.concatenate([np.ones(n_linear, dtype=bool), chosen])
        known, gram, moments, units = known[:, kept], gram[np.ix_(kept, kept)], moments[kept], units[kept]
        full = units * linalg.solve(gram, moments, assume_a="pos")
    flat = units[:n_linear] * linalg.solve(gram[:n_linear, :n_linear], moments[:n_linear], assume_a="pos")
    values = known @ full
    gained, misfit = values - known[:, :n_linear] @ flat, wanted - values
    noise = misfit.T @ misfit / max(n - len(full), 1)
    bar = worth**2 * (noise if unit is None else unit) + 2.0 * (len(full) - n_linear) / n * noise
    explained, combinations = linalg.eigh(gained.T @ gained / n, bar)
    kept = explained > 1.0
    combinations, mix = combinations[:, kept], (bar @ combinations[:, kept]).T
    linear = flat + (full[:n_linear] - flat) @ combinations @ mix
    arrays = [np.ascontiguousarray(part) for part in (active, linear, full[n_linear:] @ combinations, mix)]
    polynomials = Polynomials(arrays[0], arrays[1], arrays[2], arrays[3], degrees, chosen)
    return polynomials, wanted - polynomials(z)


@compiled
def values_at(z: np.ndarray, polynomials: Polynomials) -> np.ndarray:
    """(k, n) polynomials at z (n_params, n)."""
    active, linear, bent, mix, degrees, chosen = polynomials
    result = np.dot(linear[1:].T, z)
    if len(mix) > 0:
        terms = np.empty((len(bent), z.shape[1]))
        _products(np.dot(active.T, z), degrees, chosen, terms)
        add(np.dot(mix.T, np.dot(bent.T, terms)), result)
    for row in range(len(result)):
        for k in range(result.shape[1]):
            result[row, k] += linear[0, row]
    return result


@compiled
def pullback_at(z: np.ndarray, polynomials: Polynomials, slopes: np.ndarray) -> np.ndarray:
    """(n_params, n) gradient by z of what has the gradient slopes (k, n) by the polynomials."""
    active, linear, bent, mix, degrees, chosen = polynomials
    result = np.dot(linear[1:], slopes)
    if len(mix) > 0:
        along = np.dot(active.T, z)
        by_along = np.zeros(along.shape)
        _products_pullback(along, degrees, chosen, np.dot(bent, np.dot(mix, slopes)), by_along)
        add(np.dot(active, by_along), result)
    return result


@compiled
def _products(a, degrees, chosen, terms):
    """Write a_i a_j for i <= j, then products of three and of four, those that are chosen (n_all_products,), to terms.

    Components are a (n_active, n), and terms (n_products, n).
    """
    n_active, row, number = len(a), 0, 0
    n_cubic, n_quartic = min(n_active, degrees[0]), min(n_active, degrees[1])
    both, three = np.empty(a.shape[1]), np.empty(a.shape[1])
    for i in range(n_active):
        for j in range(i, n_active):
            if chosen[number]:
                _multiply(a[i], a[j], terms[row])
                row += 1
            number += 1
    for i in range(n_cubic):
        for j in range(i, n_cubic):
            _multiply(a[i], a[j], both)
            for k in range(j, n_cubic):
                if chosen[number]:
                    _multiply(both, a[k], terms[row])
                    row += 1
                number += 1
    for i in range(n_quartic):
        for j in range(i, n_quartic):
            _multiply(a[i], a[j], both)
            for k in range(j, n_quartic):
                _multiply(both, a[k], three)
                for m in range(k, n_quartic):
                    if chosen[number]:
                        _multiply(three, a[m], terms[row])
                        row += 1
                    number += 1


@compiled
def _products_pullback(a, degrees, chosen, slopes, by_a):
    """Add to by_a (n_active, n) the gradient of what has the gradient slopes (n_products, n) by the chosen products."""
    n_active, n = a.shape
    n_cubic, n_quartic = min(n_active, degrees[0]), min(n_active, degrees[1])
    both, by_both, three, by_three = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    row, number = 0, 0
    for i in range(n_active):
        for j in range(i, n_active):
            if chosen[number]:
                _add_multiple(slopes[row], a[j], by_a[i])
                _add_multiple(slopes[row], a[i], by_a[j])
                row += 1
            number += 1
    for i in range(n_cubic):
        for j in range(i, n_cubic):
            _multiply(a[i], a[j], both)
            _clear(by_both)
            for k in range(j, n_cubic):
                if chosen[number]:
                    _add_multiple(slopes[row], both, by_a[k])
                    _add_multiple(slopes[row], a[k], by_both)
                    row += 1
                number += 1
            _add_multiple(by_both, a[j], by_a[i])
            _add_multiple(by_both, a[i], by_a[j])
    for i in range(n_quartic):
        for j in range(i, n_quartic):
            _multiply(a[i], a[j], both)
            _clear(by_both)
            for k in range(j, n_quartic):
                _multiply(both, a[k], three)
                _clear(by_three)
                for m in range(k, n_quartic):
                    if chosen[number]:
                        _add_multiple(slopes[row], three, by_a[m])
                        _add_multiple(slopes[row], a[m], by_three)
                        row += 1
                    number += 1
                _add_multiple(by_three, both, by_a[k])
                _add_multiple(by_three, a[k], by_both)
            _add_multiple(by_both, a[j], by_a[i])
            _add_multiple(by_both, a[i], by_a[j])


@inline
def _multiply(first, second, product):
    for m in range(len(product)):
        product[m] = first[m] * second[m]


@inline
def _add_multiple(first, second, total):
    for m in range(len(total)):
        total[m] += first[m] * second[m]


@inline
def _clear(total):
    for m in range(len(total)):
        total[m] = 0.0


@inline
def add(part: np.ndarray, total: np.ndarray) -> None:
    """Add a matrix to another one, in place."""
    for row in range(part.shape[0]):
        for k in range(part.shape[1]):
            total[row, k] += part[row, k]


@inline
def copy(source: np.ndarray, target: np.ndarray) -> None:
    """Write a matrix into another one."""
    for row in range(source.shape[0]):
        for k in range(source.shape[1]):
            target[row, k] = source[row, k]


@inline
def columns(rows: np.ndarray, first: int) -> np.ndarray:
    """Rows of a matrix from `first` on, PLACES of them at most, as the columns of another one."""
    n = min(PLACES, len(rows) - first)
    result = np.empty((rows.shape[1], n))
    for param in range(rows.shape[1]):
        for k in range(n):
            result[param, k] = rows[first + k, param]
    return result


@inline
def put(columns_of: np.ndarray, rows: np.ndarray, first: int) -> None:
    """Write the columns of a matrix into rows of another one from `first` on."""
    for param in range(columns_of.shape[0]):
        for k in range(columns_of.shape[1]):
            rows[first + k, param] = columns_of[param, k]
