"""Rank and null space of the linear form, axis by axis (thesis chapter 6)."""

from dataclasses import dataclass

import numpy as np
from scipy import linalg


@dataclass(frozen=True)
class AxisRank:
    """Uniqueness of the coefficients of one axis.

    Attributes
    ----------
    names : (n_columns,) coefficients
    singular_values : (n_columns,) of the matrix with columns scaled to unit length, descending
    threshold : singular values below it are round-off
    null_vectors : one dict a null direction, coefficient -> change, largest entries first, in non-dimensional
        coefficients: the motion is the same anywhere along it
    pivots : one coefficient a null vector, absent from the others: held fixed, they make the rest unique
    """

    names: tuple[str, ...]
    singular_values: np.ndarray
    threshold: float
    null_vectors: tuple[dict[str, float], ...]
    pivots: tuple[str, ...] = ()

    @property
    def columns(self) -> int:
        return len(self.names)

    @property
    def rank(self) -> int:
        return int(np.count_nonzero(self.singular_values > self.threshold))

    @property
    def condition(self) -> float:
        """Largest over smallest singular value that is not round-off."""
        return float(self.singular_values[0] / self.singular_values[self.rank - 1])


def rank(systems, prefer=()) -> dict[str, AxisRank]:
    """Rank and null space of each axis of :func:`bayesub.problem.linear_systems`.

    Columns are scaled to unit length, because the regressors differ by orders of magnitude. A singular value is
    round-off when it is below ``max(shape) * machine epsilon`` of the largest: the error to which the matrix itself is
    known.

    Parameters
    ----------
    systems : axis -> object with names (n_columns,) and matrix (n_samples, n_columns)
    prefer : names to tie null vectors to where that is possible: those that an engineer would rather hold fixed
    """
    return {axis: _rank(system, prefer) for axis, system in systems.items()}


def _rank(system, prefer) -> AxisRank:
    lengths = np.linalg.norm(system.matrix, axis=0)
    _, s, vt = np.linalg.svd(system.matrix / lengths, full_matrices=False)
    threshold = max(system.matrix.shape) * np.finfo(float).eps * s[0]
    null = vt[s <= threshold]
    vectors = []
    if len(null):
        # Any rotation of the null space is as good; one that ties each vector to a coefficient of its own reads best.
        candidates = np.flatnonzero(np.isin(system.names, list(prefer)))
        if np.linalg.matrix_rank(null[:, candidates], tol=1e-6) < len(null):
            candidates = np.arange(len(system.names))
        pivots = candidates[linalg.qr(null[:, candidates], pivoting=True, mode="r")[1][: len(null)]]
        basis = np.linalg.solve(null[:, pivots], null) / lengths
        for vector in basis:
            vector = np.where(np.abs(vector * lengths) > 1e-9 * np.abs(vector * lengths).max(), vector, 0.0)
            vector = vector / np.abs(vector).max()
            order = np.argsort(-np.abs(vector), kind="stable")
            vectors.append({system.names[k]: float(vector[k]) for k in order if vector[k] != 0.0})
    held = tuple(system.names[k] for k in pivots) if len(null) else ()
    return AxisRank(system.names, s, float(threshold), tuple(vectors), held)
