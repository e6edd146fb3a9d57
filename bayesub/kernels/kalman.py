"""Hundreds of forces at knots given the readings, at a cost in proportion to the knots: a filter, and draws.

Between two knots a motion is linear in the state s at the start of the piece and in the forces at its knots
(:class:`Pieces`). Each force is a sequence in innovations form,

    c_j = p_j[0] + root_j w_j,    p_j+1 = T p_j + gain_j w_j,

where T moves predictions p up by one and w is white (:mod:`bayesub.problem.innovations`). So readings less their
prediction are those of a linear state-space model of the state s and, for each axis, of the forces at the three knots
that act in a piece and of p at the knot after these. The Kalman filter takes its readings one by one; the product of
the variances of what it could not foresee is the determinant of the information about w. Going back, the simulation
smoother of de Jong and Shephard (Biometrika 1995, 82) makes of standard normal y draws of w, whose mean are the w that
fit best.

Members of a batch are lanes.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numba import prange

from bayesub.kernels.jit import inline, jit

LANES = 8
HATS = 3  # forces of an axis that act in a piece


class Pieces(NamedTuple):
    """The response of the residuals of a trial, piece after piece, as a sum of terms times features of a member.

    The columns are n_states, and axis after axis the forces at the HATS knots from that of the piece on.
    """

    ends: np.ndarray  # (n_terms, n_pieces, n_states, n_columns) derivatives of the state at the end of a piece
    rows: np.ndarray  # (n_terms, n_rows, n_columns) derivatives of the residuals
    order: np.ndarray  # (n_read,) the residuals that the forces move, piece after piece
    firsts: np.ndarray  # (n_pieces + 1,) where those of each piece begin in this order


class Innovations(NamedTuple):
    """Sequences of forces in innovations form, of members and axes."""

    last: np.ndarray  # (n_batch, n_axes, n_lags) weights of p in the last entry of T p
    gains: np.ndarray  # (n_batch, n_axes, n_knots, n_lags), times the sd
    roots: np.ndarray  # (n_batch, n_axes, n_knots), times the sd

    def forces(self, white: np.ndarray) -> np.ndarray:
        """(n_batch, n_axes, n_knots) forces of white coordinates of that shape."""
        result = np.empty(white.shape)
        _colour(*self, np.ascontiguousarray(white), result)
        return result

    def white(self, forces: np.ndarray) -> np.ndarray:
        """White coordinates (n_batch, n_axes, n_knots) of forces of that shape: the inverse of :meth:`forces`."""
        result = np.empty(forces.shape)
        _whiten(*self, np.ascontiguousarray(forces), result)
        return result

    def repeated(self, n: int) -> "Innovations":
        """Those of one member, for n."""
        return Innovations(*(np.repeat(part, n, axis=0) for part in self))


class Smoothed(NamedTuple):
    """What the readings say about white coordinates w, of which the residuals are linear, with the derivatives G."""

    log_determinants: np.ndarray  # (n_batch,) of G'G + 1
    white: np.ndarray  # (n_batch, n_axes, n_knots) that fit best, or draws
    errors: np.ndarray  # (n_batch, n_rows) residuals, at w of zero, times the inverse Cholesky factor of G G' + 1


def smooth(
    pieces: Pieces,
    features: np.ndarray,
    innovations: Innovations,
    residuals: np.ndarray,
    white: np.ndarray,
    y: np.ndarray | None = None,
) -> Smoothed:
    """Integrate out the white coordinates of each member.

    Parameters
    ----------
    features : (n_batch, n_terms)
    residuals : (n_batch, n_rows) at the white coordinates
    white : (n_batch, n_axes, n_knots), about which the response is linear
    y : (n_batch, n_axes, n_knots), standard normal, for draws in place of the best
    """
    n_batch, n_axes, n_knots = white.shape
    n_groups = -(-n_batch // LANES)

    def lanes(array):
        """(n_groups, .., LANES); the last group is filled up with the last member."""
        filled = np.concatenate([array, np.repeat(array[-1:], n_groups * LANES - n_batch, axis=0)])
        return np.ascontiguousarray(np.moveaxis(filled.reshape(n_groups, LANES, *array.shape[1:]), 1, -1))

    given = [lanes(array) for array in (features, *innovations, residuals, white)]
    noise = lanes(np.zeros_like(white) if y is None else y)
    determinants, found, errors = np.empty((n_groups, LANES)), np.empty_like(noise), given[-2].copy()
    ends, rows = np.ascontiguousarray(pieces.ends), np.ascontiguousarray(pieces.rows)
    ends = ends.reshape(*ends.shape[:2], -1)
    _smooth(ends, rows, *given, noise, y is not None, pieces.order, pieces.firsts, determinants, found, errors)

    def members(array):
        return np.moveaxis(array, -1, 1).reshape(-1, *array.shape[1:-1])[:n_batch]

    return Smoothed(determinants.ravel()[:n_batch], members(found), members(errors))


def causes(pieces: Pieces, forces: np.ndarray) -> Iterator[np.ndarray]:
    """(n, n_columns) changes of what acts in each piece by changes (n, n_axes, n_knots) of the forces, of one term."""
    (ends,), n = pieces.ends, len(forces)
    padded = np.pad(forces, ((0, 0), (0, 0), (0, len(ends) + HATS - forces.shape[2])))
    state = np.zeros((n, ends.shape[1]))
    for k, end in enumerate(ends):
        acting = np.hstack([state, padded[:, :, k : k + HATS].reshape(n, -1)])
        yield acting
        state = acting @ end.T


def respond(pieces: Pieces, forces: np.ndarray) -> np.ndarray:
    """(n, n_rows) changes of the residuals by changes (n, n_axes, n_knots) of the forces, of pieces of one term."""
    (rows,) = pieces.rows
    result = np.zeros((len(forces), len(rows)))
    for k, acting in enumerate(causes(pieces, forces)):
        read = pieces.order[pieces.firsts[k] : pieces.firsts[k + 1]]
        result[:, read] = acting @ rows[read].T
    return result


@jit
def _colour(last, gains, roots, white, forces):
    ahead = np.empty(last.shape[2])
    for m in range(len(last)):
        for a in range(last.shape[1]):
            ahead[:] = 0.0
            for j in range(white.shape[2]):
                forces[m, a, j] = ahead[0] + roots[m, a, j] * white[m, a, j]
                _predict(last[m, a], gains[m, a, j], white[m, a, j], ahead)


@jit
def _whiten(last, gains, roots, forces, white):
    ahead = np.empty(last.shape[2])
    for m in range(len(last)):
        for a in range(last.shape[1]):
            ahead[:] = 0.0
            for j in range(white.shape[2]):
                white[m, a, j] = (forces[m, a, j] - ahead[0]) / roots[m, a, j]
                _predict(last[m, a], gains[m, a, j], white[m, a, j], ahead)


@inline
def _predict(last, gain, shock, ahead):
    """Predictions at the next knot, in place."""
    n_lags, predicted = len(ahead), 0.0
    for i in range(n_lags):
        predicted += last[i] * ahead[i]
    for i in range(n_lags - 1):
        ahead[i] = ahead[i + 1] + gain[i] * shock
    ahead[n_lags - 1] = predicted + gain[n_lags - 1] * shock


@inline
def _update(row, residual, n_columns, mean, spread, gain, error, variance, determinant):
    """Take one reading, and keep its gain (n, LANES), its error and the variance of that."""
    n = mean.shape[0]
    for i in range(n):
        for lane in range(LANES):
            gain[i, lane] = 0.0
        for j in range(n_columns):
            for lane in range(LANES):
                gain[i, lane] += spread[i, j, lane] * row[j, lane]
    for lane in range(LANES):
        variance[lane], error[lane] = 1.0, -residual[lane]
    for j in range(n_columns):
        for lane in range(LANES):
            variance[lane] += row[j, lane] * gain[j, lane]
            error[lane] -= row[j, lane] * mean[j, lane]
    for lane in range(LANES):
        determinant[lane] += math.log(variance[lane])
    for i in range(n):
        for j in range(n):
            for lane in range(LANES):
                spread[i, j, lane] -= gain[i, lane] * gain[j, lane] / variance[lane]
    for i in range(n):
        for lane in range(LANES):
            gain[i, lane] /= variance[lane]
            mean[i, lane] += gain[i, lane] * error[lane]


@inline
def _undo(row, n_columns, gain, error, variance, slope, curvature, scratch, draws):
    """Take a reading back: what comes later and it, by the state before it."""
    n = slope.shape[0]
    ahead, onto = scratch[0], scratch[1]
    for lane in range(LANES):
        ahead[0, lane] = error[lane] / variance[lane]
    for i in range(n):
        for lane in range(LANES):
            ahead[0, lane] -= gain[i, lane] * slope[i, lane]
    for j in range(n_columns):
        for lane in range(LANES):
            slope[j, lane] += row[j, lane] * ahead[0, lane]
    if not draws:
        return
    for lane in range(LANES):
        ahead[0, lane] = 1.0 / variance[lane]
    for i in range(n):
        for lane in range(LANES):
            onto[i, lane] = 0.0
        for j in range(n):
            for lane in range(LANES):
                onto[i, lane] += curvature[i, j, lane] * gain[j, lane]
        for lane in range(LANES):
            ahead[0, lane] += gain[i, lane] * onto[i, lane]
    for i in range(n_columns):
        for j in range(n):
            for lane in range(LANES):
                curvature[i, j, lane] -= row[i, lane] * onto[j, lane]
    for i in range(n):
        for j in range(n_columns):
            for lane in range(LANES):
                curvature[i, j, lane] -= onto[i, lane] * row[j, lane]
    for i in range(n_columns):
        for j in range(n_columns):
            for lane in range(LANES):
                curvature[i, j, lane] += ahead[0, lane] * row[i, lane] * row[j, lane]


@inline
def _advance(end, mean, spread, scratch):
    """From the start of a piece to its end."""
    n_states, n_columns, _ = end.shape
    n = mean.shape[0]
    for k in range(n_states):
        for j in range(n):
            for lane in range(LANES):
                scratch[k, j, lane] = 0.0
            for i in range(n_columns):
                for lane in range(LANES):
                    scratch[k, j, lane] += end[k, i, lane] * spread[i, j, lane]
        for lane in range(LANES):
            scratch[n_states, k, lane] = 0.0
        for i in range(n_columns):
            for lane in range(LANES):
                scratch[n_states, k, lane] += end[k, i, lane] * mean[i, lane]
    for k in range(n_states):
        for lane in range(LANES):
            mean[k, lane] = scratch[n_states, k, lane]
        for j in range(n_states, n):
            for lane in range(LANES):
                spread[k, j, lane] = scratch[k, j, lane]
                spread[j, k, lane] = scratch[k, j, lane]
        for m in range(n_states):
            for lane in range(LANES):
                spread[k, m, lane] = 0.0
            for i in range(n_columns):
                for lane in range(LANES):
                    spread[k, m, lane] += scratch[k, i, lane] * end[m, i, lane]


@inline
def _retreat(end, slope, curvature, scratch, draws):
    """From the end of a piece to its start."""
    n_states, n_columns, _ = end.shape
    n = slope.shape[0]
    column = scratch[n_states]
    _transposed(end, slope, column)
    if not draws:
        return
    for j in range(n):  # rows, and then columns, which are the same by symmetry
        for i in range(n):
            for lane in range(LANES):
                column[i, lane] = curvature[i, j, lane]
        _transposed(end, column, scratch[n_states + 1])
        for i in range(n):
            for lane in range(LANES):
                curvature[i, j, lane] = column[i, lane]
    for j in range(n):
        _transposed(end, curvature[j], column)


@inline
def _transposed(end, vector, column):
    """The transposed transition of a piece times a vector (n, LANES), in place."""
    n_states, n_columns, _ = end.shape
    for i in range(n_columns):
        for lane in range(LANES):
            column[i, lane] = 0.0 if i < n_states else vector[i, lane]
        for k in range(n_states):
            for lane in range(LANES):
                column[i, lane] += end[k, i, lane] * vector[k, lane]
    for i in range(n_columns):
        for lane in range(LANES):
            vector[i, lane] = column[i, lane]


@inline
def _shift(vector, axis, n_states, n_columns, last, lives):
    """The state after the knot, of an axis, without its noise: a vector (n, LANES) in place."""
    n_lags = last.shape[1]
    first, lags = n_states + HATS * axis, n_columns + axis * n_lags
    for d in range(HATS - 1):
        for lane in range(LANES):
            vector[first + d, lane] = vector[first + d + 1, lane]
    for lane in range(LANES):
        vector[first + HATS - 1, lane] = vector[lags, lane] if lives else 0.0
        predicted = 0.0
        for i in range(n_lags):
            predicted += last[axis, i, lane] * vector[lags + i, lane]
        for i in range(n_lags - 1):
            vector[lags + i, lane] = vector[lags + i + 1, lane] if lives else 0.0
        vector[lags + n_lags - 1, lane] = predicted if lives else 0.0


@inline
def _unshift(vector, axis, n_states, n_columns, last, lives):
    """The transpose of :func:`_shift`."""
    n_lags = last.shape[1]
    first, lags = n_states + HATS * axis, n_columns + axis * n_lags
    for lane in range(LANES):
        end, level = vector[lags + n_lags - 1, lane], vector[first + HATS - 1, lane]
        for i in range(n_lags - 1, -1, -1):
            before = vector[lags + i - 1, lane] if i > 0 else level
            vector[lags + i, lane] = before + last[axis, i, lane] * end if lives else 0.0
    for d in range(HATS - 1, 0, -1):
        for lane in range(LANES):
            vector[first + d, lane] = vector[first + d - 1, lane]
    for lane in range(LANES):
        vector[first, lane] = 0.0


@inline
def _inject(knot, n_states, n_columns, last, gains, roots, white, mean, spread):
    """The forces of a knot become part of the state, and those of the first knot leave it."""
    n_axes, n_knots, n_lags, _ = gains.shape
    n, lives = mean.shape[0], knot < n_knots
    for a in range(n_axes):
        _shift(mean, a, n_states, n_columns, last, lives)
        for i in range(n):
            _shift(spread[i], a, n_states, n_columns, last, lives)
        for i in range(n):
            _shift(spread[:, i], a, n_states, n_columns, last, lives)
        if lives:
            level, lags = n_states + HATS * a + HATS - 1, n_columns + a * n_lags
            for lane in range(LANES):
                root, offset = roots[a, knot, lane], white[a, knot, lane]
                mean[level, lane] -= root * offset
                spread[level, level, lane] += root * root
                for i in range(n_lags):
                    gain = gains[a, knot, i, lane]
                    mean[lags + i, lane] -= gain * offset
                    spread[level, lags + i, lane] += root * gain
                    spread[lags + i, level, lane] += root * gain
                    for m in range(n_lags):
                        spread[lags + i, lags + m, lane] += gain * gains[a, knot, m, lane]


@inline
def _withdraw(
    knot, n_states, n_columns, last, gains, roots, white, noise, draws, slope, curvature, found, scratch
):  # fmt: skip
    """The white coordinates of a knot, and what comes later by the state before it."""
    n_axes, n_knots, n_lags, _ = gains.shape
    n, lives = slope.shape[0], knot < n_knots
    across = scratch[0]
    for a in range(n_axes - 1, -1, -1):
        level, lags = n_states + HATS * a + HATS - 1, n_columns + a * n_lags
        if lives:
            for lane in range(LANES):
                best = roots[a, knot, lane] * slope[level, lane]
                for i in range(n_lags):
                    best += gains[a, knot, i, lane] * slope[lags + i, lane]
                found[a, knot, lane] = best
        if lives and draws:
            for i in range(n):
                for lane in range(LANES):
                    across[i, lane] = roots[a, knot, lane] * curvature[level, i, lane]
                for m in range(n_lags):
                    for lane in range(LANES):
                        across[i, lane] += gains[a, knot, m, lane] * curvature[lags + m, i, lane]
        _unshift(slope, a, n_states, n_columns, last, lives)
        if not draws:
            continue
        for i in range(n):
            _unshift(curvature[i], a, n_states, n_columns, last, lives)
        for i in range(n):
            _unshift(curvature[:, i], a, n_states, n_columns, last, lives)
        if not lives:
            continue
        for lane in range(LANES):
            left = 1.0 - roots[a, knot, lane] * across[level, lane]
            for m in range(n_lags):
                left -= gains[a, knot, m, lane] * across[lags + m, lane]
            scratch[1, 0, lane] = left
            scratch[1, 1, lane] = math.sqrt(left) * noise[a, knot, lane]
            found[a, knot, lane] += scratch[1, 1, lane]
        _unshift(across, a, n_states, n_columns, last, lives)
        for i in range(n):
            for lane in range(LANES):
                slope[i, lane] -= across[i, lane] * scratch[1, 1, lane] / scratch[1, 0, lane]
            for m in range(n):
                for lane in range(LANES):
                    curvature[i, m, lane] += across[i, lane] * across[m, lane] / scratch[1, 0, lane]


@inline
def _summed(terms, features, result):
    """Numbers (n, LANES) of terms (n_terms, n) and features (n_terms, LANES)."""
    n_terms, n = terms.shape
    for i in range(n):
        for lane in range(LANES):
            result[i, lane] = terms[0, i] * features[0, lane]
    for t in range(1, n_terms):
        for i in range(n):
            for lane in range(LANES):
                result[i, lane] += terms[t, i] * features[t, lane]


@jit
def _smooth_group(
    end_terms, row_terms, features, last, gains, roots, residuals, white, noise, draws, order, firsts, determinant,
    found, errors,
):  # fmt: skip
    n_pieces, n_columns = end_terms.shape[1], row_terms.shape[2]
    n_states = end_terms.shape[2] // n_columns
    n_axes, n_knots, n_lags, _ = gains.shape
    n_read, n = len(order), n_columns + n_axes * n_lags
    ends, row = np.empty((n_pieces, n_states, n_columns, LANES)), np.empty((n_read, n_columns, LANES))
    for k in range(n_pieces):
        _summed(end_terms[:, k], features, ends[k].reshape(n_states * n_columns, LANES))
    for k in range(n_read):
        _summed(row_terms[:, order[k]], features, row[k])
    mean, spread = np.zeros((n, LANES)), np.zeros((n, n, LANES))
    kept_gain, kept_error = np.empty((n_read, n, LANES)), np.empty((n_read, LANES))
    kept_variance = np.empty((n_read, LANES))
    scratch = np.empty((n, n, LANES))
    for i in range(LANES):
        determinant[i] = 0.0
    for j in range(min(HATS, n_knots)):
        _inject(j, n_states, n_columns, last, gains, roots, white, mean, spread)
    for k in range(n_pieces):
        for i in range(firsts[k], firsts[k + 1]):
            _update(
                row[i], residuals[order[i]], n_columns, mean, spread, kept_gain[i], kept_error[i], kept_variance[i],
                determinant,
            )  # fmt: skip
            for lane in range(LANES):
                errors[order[i], lane] = -kept_error[i, lane] / math.sqrt(kept_variance[i, lane])
        _advance(ends[k], mean, spread, scratch)
        _inject(k + HATS, n_states, n_columns, last, gains, roots, white, mean, spread)
    # Back: `slope` is the gradient of the log density of what comes later by the state, `curvature` its information.
    slope, curvature = np.zeros((n, LANES)), np.zeros((n, n, LANES))
    for k in range(n_pieces - 1, -1, -1):
        _withdraw(
            k + HATS, n_states, n_columns, last, gains, roots, white, noise, draws, slope, curvature, found,
            scratch,
        )  # fmt: skip
        _retreat(ends[k], slope, curvature, scratch, draws)
        for i in range(firsts[k + 1] - 1, firsts[k] - 1, -1):
            _undo(
                row[i], n_columns, kept_gain[i], kept_error[i], kept_variance[i], slope, curvature, scratch, draws,
            )  # fmt: skip
    for j in range(min(HATS, n_knots) - 1, -1, -1):
        _withdraw(
            j, n_states, n_columns, last, gains, roots, white, noise, draws, slope, curvature, found, scratch
        )  # fmt: skip


@jit(threads=True)
def _smooth(
    ends, rows, features, last, gains, roots, residuals, white, noise, draws, order, firsts, determinants, found,
    errors,
):  # fmt: skip
    for group in prange(features.shape[0]):
        _smooth_group(
            ends, rows, features[group], last[group], gains[group], roots[group], residuals[group], white[group],
            noise[group], draws, order, firsts, determinants[group], found[group], errors[group],
        )  # fmt: skip
