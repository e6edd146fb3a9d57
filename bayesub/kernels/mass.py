"""Mass matrices M = M_rb - M_a (model manual, sections 2 and 6) and their inverses."""

import numpy as np

from bayesub.kernels.jit import jit
from bayesub.kernels.workspace import IXX, IXY, IYY, IYZ, IZX, IZZ, MASS, XG, YG, ZG


def mass_matrices(coefficients: np.ndarray, body: np.ndarray, added_mass: np.ndarray) -> np.ndarray:
    """M of dimensional coefficients (n, n_terms) and body vectors (n, N_BODY or more): (n, 6, 6), kg, kg m and kg m^2.

    Rows of `added_mass` are axis, acceleration and coefficient of an added-mass term. Arrays are contiguous.
    """
    result = np.zeros((len(body), 6, 6))
    _mass_matrices(coefficients, body, added_mass, result)
    return result


@jit
def _mass_matrices(coefficients, body, added_mass, result):
    for member in range(body.shape[0]):
        given, matrix = body[member], result[member]
        m, x, y, z = given[MASS], given[XG], given[YG], given[ZG]
        matrix[0, 0] = matrix[1, 1] = matrix[2, 2] = m
        matrix[3, 3], matrix[4, 4], matrix[5, 5] = given[IXX], given[IYY], given[IZZ]
        matrix[3, 4] = matrix[4, 3] = -given[IXY]
        matrix[4, 5] = matrix[5, 4] = -given[IYZ]
        matrix[3, 5] = matrix[5, 3] = -given[IZX]
        matrix[0, 4] = matrix[4, 0] = m * z
        matrix[0, 5] = matrix[5, 0] = -m * y
        matrix[1, 3] = matrix[3, 1] = -m * z
        matrix[1, 5] = matrix[5, 1] = m * x
        matrix[2, 3] = matrix[3, 2] = m * y
        matrix[2, 4] = matrix[4, 2] = -m * x
        for n in range(added_mass.shape[0]):
            matrix[added_mass[n, 0], added_mass[n, 1]] -= coefficients[member, added_mass[n, 2]]


def inverses(matrices: np.ndarray) -> np.ndarray:
    """Inverses (n, k, k) of matrices by Gauss-Jordan elimination with partial pivoting; not finite if singular."""
    result = np.empty(matrices.shape)
    result[:] = np.eye(matrices.shape[1])
    _invert(matrices.copy(), result)
    return result


@jit
def _invert(matrices, result):
    for member in range(matrices.shape[0]):
        a, b = matrices[member], result[member]
        n = a.shape[0]
        for k in range(n):
            pivot = k
            for row in range(k + 1, n):
                if abs(a[row, k]) > abs(a[pivot, k]):
                    pivot = row
            scale = 1.0 / a[pivot, k]
            for j in range(n):
                a[pivot, j], a[k, j] = a[k, j], a[pivot, j] * scale
                b[pivot, j], b[k, j] = b[k, j], b[pivot, j] * scale
            for row in range(n):
                if row != k:
                    factor = a[row, k]
                    for j in range(n):
                        a[row, j] -= factor * a[k, j]
                        b[row, j] -= factor * b[k, j]
