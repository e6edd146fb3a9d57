"""Rank and null space of the linear form, axis by axis (thesis chapter 6).

Two verdicts are kept apart. A direction is null when its singular value is round-off: the equations do not see it on
this manoeuvre, whatever the instruments (not unique). It is weak when its singular value is above round-off but below
the accuracy of the best instruments: the equations see it and no trial does (ill-conditioned).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bayesub.inference.identifiability.linalg import TIE, complete_svd, orthonormal, signed
from bayesub.inference.interface import LinearForm

ACCURACY = 1e-6  # relative; twenty bits, which no accelerometer or log of a trial reaches

_DIGITS = 5  # by which the entries of a vector are ordered; those that differ by less stay in the order of the names


@dataclass(frozen=True)
class AxisRank:
    """Uniqueness of the coefficients of one axis."""

    names: tuple[str, ...]  # (n_columns,) coefficients
    singular_values: np.ndarray  # (n_columns,) of the matrix with columns scaled to unit length, descending
    threshold: float  # singular values below it are round-off
    # one dict a null direction, coefficient -> change, largest entries first, in non-dimensional coefficients: the
    # motion is the same anywhere along it
    null_vectors: tuple[dict[str, float], ...]
    # one coefficient a null vector, absent from the others: held fixed, they make the rest unique
    pivots: tuple[str, ...] = ()
    weak_vectors: tuple[dict[str, float], ...] = ()  # one dict a weak direction, in the same way, weakest first
    accuracy: float = ACCURACY  # relative, of readings; singular values below that part of the largest are weak

    @property
    def columns(self) -> int:
        """Number of coefficients."""
        return len(self.names)

    @property
    def rank(self) -> int:
        """Singular values above round-off."""
        return int(np.count_nonzero(self.singular_values > self.threshold))

    @property
    def null_dimension(self) -> int:
        """Directions that the equations do not see: what is not unique."""
        return self.columns - self.rank

    @property
    def practical_rank(self) -> int:
        """Singular values above round-off that readings of the given accuracy show."""
        visible = max(self.threshold, self.accuracy * self.singular_values[0])
        return int(np.count_nonzero(self.singular_values > visible))

    @property
    def condition(self) -> float:
        """Largest over smallest singular value that is not round-off."""
        return float(self.singular_values[0] / self.singular_values[self.rank - 1])

    @property
    def gap(self) -> float | None:
        """Smallest singular value that is not round-off over the largest that is; None where all are unique."""
        if self.null_dimension == 0:
            return None
        return float(self.singular_values[self.rank - 1] / max(self.singular_values[self.rank], np.finfo(float).tiny))

    def summary(self) -> dict:
        """Everything as JSON-able values."""
        counts = ("columns", "rank", "null_dimension", "practical_rank", "condition", "threshold", "gap")
        content = {key: getattr(self, key) for key in counts} | {"singular_values": self.singular_values.tolist()}
        return content | {key: list(getattr(self, key)) for key in ("null_vectors", "pivots", "weak_vectors")}


def rank(
    systems: Mapping[str, LinearForm],
    prefer: Iterable[str] = (),
    accuracy: float = ACCURACY,
    others: Sequence[Mapping[str, LinearForm]] = (),
) -> dict[str, AxisRank]:
    """Rank and null space of each axis of :func:`bayesub.model.linear_form.linear_systems`.

    Columns are scaled to unit length: regressors differ by orders of magnitude. :func:`round_off` has the threshold.

    `systems` are axis -> object with names (n_columns,), matrix (n_samples, n_columns) and rounding, the relative error
    of its columns, a number or (n_columns,). Null vectors are tied to names in `prefer` where that is possible: those
    that an engineer would rather hold fixed. A direction is weak below `accuracy`, the relative accuracy of the best
    readings. `others` are the systems at other coefficients. A direction that one of them shows is not null, although
    it may be round-off in `systems` by accident, as where two speeds happen never to differ in sign.
    """
    return {
        axis: _rank(system, [other[axis] for other in others if axis in other], prefer, accuracy)
        for axis, system in systems.items()
    }


def round_off(shape: tuple[int, ...], largest: float, rounding: float | np.ndarray) -> float:
    """Below which a singular value of a matrix (n_samples, n_columns) with unit columns is round-off.

    By Weyl's theorem a singular value moves by no more than the norm of the error of the matrix. Two errors add up:
    that to which the columns are known, whose Frobenius norm is that of `rounding`, the relative error of each, and the
    backward error of the decomposition, an epsilon of the `largest` singular value a row, added up as a random walk
    (Higham & Mary 2019).
    """
    known = np.linalg.norm(np.broadcast_to(rounding, shape[1]))
    return float(known + np.sqrt(max(shape)) * np.finfo(float).eps * largest)


def _decomposed(system) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Lengths of the columns; singular values and directions with unit columns; and what is round-off."""
    lengths = np.linalg.norm(system.matrix, axis=0)
    _, s, vt = complete_svd(np.asarray(np.linalg.qr(system.matrix / lengths, mode="r")))
    return lengths, s, vt, round_off(system.matrix.shape, s[0], system.rounding)


def _shown_by(others, names, lengths, s, vt, threshold) -> tuple[np.ndarray, np.ndarray]:
    """Singular values and directions, of which those that another system shows are no round-off.

    Such a direction has the median of its singular values in the systems that show it.
    """
    own, n = np.count_nonzero(s > threshold), len(s)
    found = [(lengths, s, vt, threshold), *(_decomposed(other) for other in others if other.names == names)]
    ranks = np.array([np.count_nonzero(values > least) for _, values, _, least in found])
    low, high = ranks.min(), ranks.max()
    if low == high:
        return s, vt
    showing = [one for one, rank in zip(found, ranks, strict=True) if rank == high]
    s, usual = s.copy(), np.median([values / least for _, values, _, least in showing], axis=0)
    s[low:high] = np.minimum(threshold * usual[low:high], s[low - 1])
    # Of the directions that are null here, those last that are nearest to what is null there too.
    there_lengths, _, there_vt, _ = showing[0]
    there = orthonormal(there_vt[high:] / there_lengths * lengths) if high < n else np.empty((0, n))
    nearest = np.linalg.svd(vt[own:] @ there.T)[0][:, ::-1]
    return s, np.concatenate([vt[:own], nearest.T @ vt[own:]])


def _rank(system, others, prefer, accuracy) -> AxisRank:
    lengths, s, vt, threshold = _decomposed(system)
    s, vt = _shown_by(others, system.names, lengths, s, vt, threshold)
    null, weak = vt[s <= threshold], vt[(s > threshold) & (s <= accuracy * s[0])][::-1]
    weak = signed(weak / lengths) * lengths
    pivots = _pivots(null, system.names, prefer)
    # Any rotation of the null space is as good; one that ties each vector to a coefficient of its own reads best.
    basis = np.linalg.solve(null[:, pivots], null) if len(null) else null
    return AxisRank(
        names=system.names,
        singular_values=s,
        threshold=threshold,
        null_vectors=tuple(_named(vector, lengths, system.names) for vector in basis),
        pivots=tuple(system.names[k] for k in pivots),
        weak_vectors=tuple(_named(vector, lengths, system.names) for vector in weak),
        accuracy=accuracy,
    )


def _pivots(null, names, prefer) -> np.ndarray:
    """Positions of coefficients, preferred ones if possible, in which the null vectors differ most.

    That is a QR factorisation with column pivoting, in which the first of several columns as long is the pivot.
    """
    candidates = np.flatnonzero(np.isin(names, list(prefer)))
    if np.linalg.matrix_rank(null[:, candidates], tol=1e-6) < len(null):
        candidates = np.arange(len(names))
    columns, pivots = null[:, candidates], []
    for _ in range(len(null)):
        lengths = np.linalg.norm(columns, axis=0)
        pivots.append(int(np.argmax(lengths > (1.0 - TIE) * lengths.max())))
        unit = columns[:, pivots[-1]] / lengths[pivots[-1]]
        columns = columns - np.outer(unit, unit @ columns)
    return candidates[pivots]


def _named(scaled, lengths, names) -> dict[str, float]:
    """A vector of the scaled matrix in coefficients, the largest one, without entries that are round-off."""
    vector = np.where(np.abs(scaled) > 1e-9 * np.abs(scaled).max(), scaled / lengths, 0.0)
    vector = vector / np.abs(vector).max()
    order = np.argsort(-np.round(np.abs(vector), _DIGITS), kind="stable")
    return {names[k]: float(vector[k]) for k in order if vector[k] != 0.0}
