"""Linear algebra that scipy does not have in one call."""

import numpy as np


def complete_svd(matrix) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Singular value decomposition ``matrix = u diag(s) vt`` with as many values as columns.

    Parameters
    ----------
    matrix : (n, p), with n readings below p parameters as well: the directions that no reading sees have value zero

    Returns
    -------
    u (n, p), s (p,) descending, vt (p, p) orthogonal.
    """
    n, p = matrix.shape
    u, s, vt = np.linalg.svd(matrix, full_matrices=n < p)
    return np.pad(u, ((0, 0), (0, p - u.shape[1]))), np.pad(s, (0, p - len(s))), vt
