"""Linear algebra that scipy does not have in one call, and null directions kept apart from ill-conditioned ones.

A null direction follows from the equations (:mod:`bayesub.inference.identifiability.null_space`) and is exact: no data
of any accuracy tell anything along it. A sloppy direction follows from a sensor and is a matter of degree. Null
directions are therefore an argument here, and are never read off the small singular values of a sensitivity.
"""

from collections.abc import Mapping, Sequence

import numpy as np

_ROWS = 2000  # of a block that stays in a processor's cache
TIE = 1e-6  # relative difference of sizes that is none: no choice is left to rounding


def complete_svd(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Singular value decomposition ``matrix = u diag(s) vt`` with as many values as columns.

    Of a matrix (n, p), with n readings below p parameters as well: the directions that no reading sees have value zero.
    u is (n, p), s (p,) descends and vt (p, p) is orthogonal.
    """
    n, p = matrix.shape
    u, s, vt = np.linalg.svd(matrix, full_matrices=n < p)
    return np.pad(u, ((0, 0), (0, p - u.shape[1]))), np.pad(s, (0, p - len(s))), vt


def triangle(matrix: np.ndarray) -> np.ndarray:
    """The triangle R (min(n, p), p) of ``matrix = Q R`` for a tall matrix (n, p), block after block of its rows.

    (Tall-skinny QR: Demmel et al. 2012.) For a few hundred thousand rows it takes a fifth of the time of all at once.
    """
    blocks = np.array_split(matrix, -(-len(matrix) // _ROWS))
    if len(blocks) > 1:
        matrix = np.concatenate([np.linalg.qr(block, mode="r") for block in blocks])
    return np.asarray(np.linalg.qr(matrix, mode="r"))


def varimax(columns: np.ndarray, n_iterations: int = 200) -> np.ndarray:
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


def null_basis(names: Sequence[str], vectors: Sequence[Mapping[str, float]], scale: np.ndarray) -> np.ndarray:
    """Orthonormal basis (n_null, n_params) of a null space in scaled coordinates ``t = parameters / scale``.

    The null vectors are dicts of name -> change, independent of each other. The basis is exactly zero in every column
    that no vector names. ValueError for one not among `names` (n_params,): more have another null space.
    """
    place = {name: k for k, name in enumerate(names)}
    matrix = np.zeros((len(vectors), len(names)))
    for row, vector in zip(matrix, vectors, strict=True):
        for name, change in vector.items():
            if name not in place:
                raise ValueError(f"null vector names {name}, which is not free; take null vectors of the free ones")
            row[place[name]] = change / scale[place[name]]
    return orthonormal(matrix)


def orthonormal(rows: np.ndarray) -> np.ndarray:
    """Orthonormal basis (n, p) of the span of independent rows (n, p); columns that are zero stay exactly zero."""
    lengths = np.linalg.norm(rows, axis=1, keepdims=True)
    return np.where(np.any(rows != 0.0, axis=0), np.linalg.qr((rows / lengths).T)[0].T, 0.0)


def signed(vectors: np.ndarray) -> np.ndarray:
    """Vectors (n, p) with the sign that makes the largest entry positive, the first one of several as large.

    The sign of a singular vector is that of a rounding error, and differs from one processor to another.
    """
    sizes = np.abs(vectors)
    largest = np.argmax(sizes > (1.0 - TIE) * sizes.max(axis=1, keepdims=True), axis=1)
    return vectors * np.where(vectors[np.arange(len(vectors)), largest] < 0.0, -1.0, 1.0)[:, None]


def split_svd(matrix: np.ndarray, null: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Singular value decomposition ``u diag(s) vt`` of a matrix (n, p) with given null directions last.

    Along these, orthonormal rows `null` (n_null, p), the matrix vanishes up to its own error. The first p - n_null rows
    of vt (p, p) are orthogonal to them and s (p,) descends along these; the others are the rows of `null` in their
    order, and the length that the matrix gives them, which is its error, is in s.
    """
    if not len(null):
        return complete_svd(matrix)
    complement = np.linalg.qr(null.T, mode="complete")[0][:, len(null) :].T
    u, s, vt = complete_svd(matrix @ complement.T)
    images = matrix @ null.T
    sizes = np.linalg.norm(images, axis=0)
    images = np.divide(images, sizes, out=np.zeros_like(images), where=sizes > 0.0)
    return np.hstack([u, images]), np.concatenate([s, sizes]), np.vstack([vt @ complement, null])
