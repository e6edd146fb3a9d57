"""Hundreds of forces at knots given the readings, at a cost in proportion to the knots: a filter and a feedback law.

Between two knots a motion is linear in the state s at the start of the piece and in the forces at its knots
(:class:`Pieces`). Each force is a sequence in innovations form,

    c_j = p_j[0] + root_j w_j,    p_j+1 = T p_j + gain_j w_j,

where T moves predictions p up by one and w is white (:mod:`bayesub.problem.innovations`). So readings less their
prediction are those of a linear state-space model whose state is s and, for each axis, the forces at the three knots
that act in a piece and p at the knot after these.

An information filter goes back from the last reading (Fraser & Potter 1969): it finds the log density of all later
readings by the state, which is quadratic. Given the state and all readings, the w of the next knot are normal, and
their mean is linear in the state. So standard normal y make draws of w on the way forward (:class:`Policy`), as the
feedback of a linear-quadratic regulator controls a motion (Bryson & Ho 1975, section 5.2). The states may be those of
the real motion: what it does besides what is linear, the later forces make good.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numba import prange

from bayesub.kernels.jit import inline, jit
from bayesub.kernels.workspace import HATS

_NUMBERS = 32_000_000  # of pieces of members that are in memory at once


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
        _colour(*self, np.array(white, order="C"), result, False)
        return result

    def white(self, forces: np.ndarray) -> np.ndarray:
        """White coordinates (n_batch, n_axes, n_knots) of forces of that shape: the inverse of :meth:`forces`."""
        result = np.empty(forces.shape)
        _colour(*self, result, np.array(forces, order="C"), True)
        return result

    def repeated(self, n: int) -> "Innovations":
        """Those of one member, for n."""
        return Innovations(*(np.repeat(part, n, axis=0) for part in self))


class Policy(NamedTuple):
    """How white coordinates change knot after knot, of members that have reached some state.

    Changes are from where the response was linearised, also those of the state z: n_states, HATS forces of axis after
    axis, and n_lags predictions of axis after axis.
    """

    reference: np.ndarray  # (n_batch, n_pieces, n_moved) first states at the ends of pieces there, of which z is less
    ends: np.ndarray  # (n_batch, n_pieces, n_states, n_columns) derivatives of the state at the end of a piece
    last: np.ndarray  # as of Innovations, as the gains and roots are
    gains: np.ndarray
    roots: np.ndarray
    levels: np.ndarray  # (n_batch, n_axes, n_knots) at z of zero
    feedback: np.ndarray  # (n_batch, n_axes, n_knots, n_z); of it, the ends and innovations one for all may do

    def followed(self) -> np.ndarray:
        """(n_batch, n_axes, n_knots) the changes, if the motion is linear."""
        shocks = np.empty(self.levels.shape)
        _follow(self, shocks)
        return shocks


def _members(pieces: Pieces, features: np.ndarray) -> Iterator[tuple[slice, np.ndarray, np.ndarray]]:
    """Ends and rows of members by their features (n_batch, n_terms), of so many at a time as have room in memory."""
    shapes = pieces.ends.shape[1:], pieces.rows.shape[1:]
    terms = [np.ascontiguousarray(part).reshape(len(part), -1) for part in pieces[:2]]
    step = max(1, _NUMBERS // (terms[0].shape[1] + terms[1].shape[1]))
    for first in range(0, len(features), step):
        some = slice(first, first + step)
        ends, rows = ((features[some] @ part).reshape(-1, *shape) for part, shape in zip(terms, shapes, strict=True))
        yield some, ends, rows


def policy(
    pieces: Pieces,
    features: np.ndarray,
    innovations: Innovations,
    residuals: np.ndarray,
    white: np.ndarray,
    y: np.ndarray,
    reference: np.ndarray,
) -> tuple[Policy, np.ndarray]:
    """The policy that makes of standard normal y draws of white coordinates given the readings, and of zero the best.

    The derivatives of the draws by y have the determinant exp(-d / 2), whatever the motion. If it is linear, with the
    derivatives G of the residuals, d is log det(G'G + 1). The d (n_batch,) come with the policy.

    `features` are (n_batch, n_terms), or (1, n_terms) of members that are alike, and the innovations too. `residuals`
    (n_batch, n_rows) are at the coordinates `white` (n_batch, n_axes, n_knots), about which the response is linear; `y`
    is (n_batch, n_axes, n_knots), and `reference` as of the policy.
    """
    n_different, n_axes, n_knots, n_lags = innovations.gains.shape
    n_z = pieces.ends.shape[3] + n_axes * n_lags
    levels, feedback = np.empty(white.shape), np.empty((n_different, n_axes, n_knots, n_z))
    each, log_determinants, first = [], np.empty(n_different), (n_different, -1)
    alike = [part.reshape(*first, *part.shape[1:]) for part in (residuals, white, y, levels)]
    for some, ends, rows in _members(pieces, features):
        given = [np.ascontiguousarray(part[some]) for part in (*innovations, *alike[:3])]
        _plan(
            ends, rows, *given, pieces.order, pieces.firsts, log_determinants[some], alike[3][some], feedback[some]
        )  # fmt: skip
        each.append(ends)
    last, gains, roots = map(np.ascontiguousarray, innovations)
    law = Policy(np.ascontiguousarray(reference), np.concatenate(each), last, gains, roots, levels, feedback)
    return law, np.repeat(log_determinants, len(white) // n_different)


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
def _colour(last, gains, roots, white, forces, backwards):
    """Fill in forces of white coordinates, or backwards."""
    ahead = np.empty(last.shape[2])
    for m in range(len(last)):
        for a in range(last.shape[1]):
            ahead[:] = 0.0
            for j in range(white.shape[2]):
                if backwards:
                    white[m, a, j] = (forces[m, a, j] - ahead[0]) / roots[m, a, j]
                else:
                    forces[m, a, j] = ahead[0] + roots[m, a, j] * white[m, a, j]
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
def _add(factor, x, y):
    """Add a factor times a vector x to y."""
    for j in range(len(y)):
        y[j] += factor * x[j]


@inline
def _dot(x, y):
    result = 0.0
    for j in range(len(x)):
        result += x[j] * y[j]
    return result


@inline
def _retreat(end, slopes, curvature):
    """From the end of a piece to its start."""
    n_states, n_columns = end.shape
    for i in range(len(slopes)):
        _transposed(end, slopes[i])
    for i in range(len(curvature)):
        _transposed(end, curvature[i])
    moved = curvature[:n_states].copy()
    curvature[:n_states] = 0.0
    for i in range(n_columns):
        for k in range(n_states):
            _add(end[k, i], moved[k], curvature[i])


@inline
def _transposed(end, vector):
    """The transposed transition of a piece times a vector (n,), in place."""
    n_states, n_columns = end.shape
    states = vector[:n_states].copy()
    vector[:n_states] = 0.0
    for k in range(n_states):
        _add(states[k], end[k], vector[:n_columns])


@inline
def _shift(vector, first, lags, last, lives):
    """The state after a knot, of an axis, without its noise: a vector (n,) in place."""
    n_lags = len(last)
    for d in range(HATS - 1):
        vector[first + d] = vector[first + d + 1]
    vector[first + HATS - 1] = vector[lags] if lives else 0.0
    predicted = _dot(last, vector[lags : lags + n_lags])
    for i in range(n_lags - 1):
        vector[lags + i] = vector[lags + i + 1] if lives else 0.0
    vector[lags + n_lags - 1] = predicted if lives else 0.0


@inline
def _unshift(vector, first, lags, last, lives):
    """The transpose of :func:`_shift`."""
    n_lags = len(last)
    end, level = vector[lags + n_lags - 1], vector[first + HATS - 1]
    for i in range(n_lags - 1, -1, -1):
        before = vector[lags + i - 1] if i > 0 else level
        vector[lags + i] = before + last[i] * end if lives else 0.0
    for d in range(HATS - 1, 0, -1):
        vector[first + d] = vector[first + d - 1]
    vector[first] = 0.0


@inline
def _noise(noise, first, lags, root, gain):
    """How a white coordinate enters the state (n,)."""
    noise[:] = 0.0
    noise[first + HATS - 1] = root
    noise[lags : lags + len(gain)] = gain


@inline
def _choose(knot, n_states, n_columns, last, gains, roots, white, y, slopes, curvature, levels, feedback, noise):
    """How the white coordinates of a knot follow the state, and what comes later by the state before it.

    Later readings have minus half a square form of the state, its `curvature`, plus the slope times the state as their
    log density, with slopes of each of some members that are alike. Returns the log determinant of the precisions.
    """
    n_axes, n_knots, n_lags = gains.shape
    lives, log_determinant = knot < n_knots, 0.0
    for a in range(n_axes - 1, -1, -1):
        first, lags = n_states + HATS * a, n_columns + a * n_lags
        if lives:
            _noise(noise, first, lags, roots[a, knot], gains[a, knot])
            across = feedback[a, knot]
            across[:] = 0.0
            _add(roots[a, knot], curvature[first + HATS - 1], across)
            for i in range(n_lags):
                _add(gains[a, knot, i], curvature[lags + i], across)
            precision = 1.0 + _dot(noise, across)
            log_determinant += math.log(precision)
            for m in range(len(slopes)):
                best = (_dot(noise, slopes[m]) - white[m, a, knot]) / precision
                levels[m, a, knot] = best + y[m, a, knot] / math.sqrt(precision)
                _add(-best, across, slopes[m])
            for i in range(len(across)):
                across[i] /= -precision
            for i in range(len(across)):
                _add(-precision * across[i], across, curvature[i])
        for m in range(len(slopes)):
            _unshift(slopes[m], first, lags, last[a], lives)
        for i in range(len(curvature)):
            _unshift(curvature[i], first, lags, last[a], lives)
        for i in range(len(curvature)):
            _unshift(curvature[:, i], first, lags, last[a], lives)
    return log_determinant


@jit
def _plan_one(ends, rows, last, gains, roots, residuals, white, y, order, firsts, levels, feedback):
    n_pieces, n_states, n_columns = ends.shape
    n_axes, n_knots, n_lags = gains.shape
    n, log_determinant = n_columns + n_axes * n_lags, 0.0
    slopes, curvature, noise = np.zeros((len(white), n)), np.zeros((n, n)), np.zeros(n)
    for k in range(n_pieces - 1, -1, -1):
        log_determinant += _choose(
            k + HATS, n_states, n_columns, last, gains, roots, white, y, slopes, curvature, levels, feedback, noise
        )
        _retreat(ends[k], slopes, curvature)
        for i in range(firsts[k], firsts[k + 1]):
            row = rows[order[i]]
            for m in range(len(slopes)):
                _add(-residuals[m, order[i]], row, slopes[m, :n_columns])
            for j in range(n_columns):
                _add(row[j], row, curvature[j, :n_columns])
    for j in range(min(HATS, n_knots) - 1, -1, -1):
        log_determinant += _choose(
            j, n_states, n_columns, last, gains, roots, white, y, slopes, curvature, levels, feedback, noise
        )
    return log_determinant


@jit(threads=True)
def _plan(
    ends, rows, last, gains, roots, residuals, white, y, order, firsts, log_determinants, levels, feedback
):  # fmt: skip
    for k in prange(len(ends)):
        log_determinants[k] = _plan_one(
            ends[k], rows[k], last[k], gains[k], roots[k], residuals[k], white[k], y[k], order, firsts, levels[k],
            feedback[k],
        )  # fmt: skip


@inline
def decide(policy, member, knot, state, shocks):
    """The white coordinates of a knot of a member, by its state (n_z,), of which their forces become part."""
    _, n_axes, n_knots, n_lags = policy.gains.shape
    n_states, n_columns = policy.ends.shape[2:]
    lives, of = knot < n_knots, min(member, len(policy.feedback) - 1)
    for a in range(n_axes):
        first, lags = n_states + HATS * a, n_columns + a * n_lags
        _shift(state, first, lags, policy.last[of, a], lives)
        if lives:
            shock = policy.levels[member, a, knot] + _dot(policy.feedback[of, a, knot], state)
            shocks[a, knot] = shock
            state[first + HATS - 1] += policy.roots[of, a, knot] * shock
            _add(shock, policy.gains[of, a, knot], state[lags : lags + n_lags])


@inline
def proceed(policy, member, piece, state):
    """The state (n_z,) goes to the end of a piece, as if the motion were linear."""
    n_states, n_columns = policy.ends.shape[2:]
    before, of = state[:n_columns].copy(), min(member, len(policy.ends) - 1)
    for k in range(n_states):
        state[k] = _dot(policy.ends[of, piece, k], before)


@jit
def _follow(policy, shocks):
    _, _, n_knots, n_z = policy.feedback.shape
    for member in range(len(shocks)):
        state = np.zeros(n_z)
        for knot in range(min(HATS, n_knots)):
            decide(policy, member, knot, state, shocks[member])
        for piece in range(policy.ends.shape[1]):
            proceed(policy, member, piece, state)
            decide(policy, member, piece + HATS, state, shocks[member])
