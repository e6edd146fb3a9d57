"""The mass matrix M = M_rb - M_a (model manual, sections 2 and 6) and its inverse."""

import numpy as np

from bayesub.kernels.jit import jit
from bayesub.kernels.workspace import IXX, IXY, IYY, IYZ, IZX, IZZ, MASS, XG, YG, ZG

from .hydrodynamics import ADDED_MASS

_ADDED_MASS = np.array(ADDED_MASS).reshape(-1, 3)


@jit
def mass_matrix(coefficients, body):
    """M of one dimensional coefficient set (n_terms,) and body vector (N_BODY,): (6, 6), kg, kg m and kg m^2."""
    m, x, y, z = body[MASS], body[XG], body[YG], body[ZG]
    matrix = np.zeros((6, 6))
    matrix[0, 0] = matrix[1, 1] = matrix[2, 2] = m
    matrix[3, 3], matrix[4, 4], matrix[5, 5] = body[IXX], body[IYY], body[IZZ]
    matrix[3, 4] = matrix[4, 3] = -body[IXY]
    matrix[4, 5] = matrix[5, 4] = -body[IYZ]
    matrix[3, 5] = matrix[5, 3] = -body[IZX]
    matrix[0, 4] = matrix[4, 0] = m * z
    matrix[0, 5] = matrix[5, 0] = -m * y
    matrix[1, 3] = matrix[3, 1] = -m * z
    matrix[1, 5] = matrix[5, 1] = m * x
    matrix[2, 3] = matrix[3, 2] = m * y
    matrix[2, 4] = matrix[4, 2] = -m * x
    for n in range(_ADDED_MASS.shape[0]):
        matrix[_ADDED_MASS[n, 0], _ADDED_MASS[n, 1]] -= coefficients[_ADDED_MASS[n, 2]]
    return matrix


@jit
def inverse(matrix):
    """Inverse of a small matrix by Gauss-Jordan elimination with partial pivoting; not finite if it is singular."""
    n = matrix.shape[0]
    a = matrix.copy()
    b = np.eye(n)
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
    return b
