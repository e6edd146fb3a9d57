"""Forces that are chosen during a simulation, by the states that it reaches.

A policy (:mod:`bayesub.kernels.kalman`) says how the forces of a knot follow the state two knots earlier.
"""

from typing import NamedTuple

import numpy as np

from bayesub.kernels.jit import inline
from bayesub.kernels.kalman import Policy, decide, proceed
from bayesub.kernels.workspace import HATS, LANES, STATE


class Steering(NamedTuple):
    """Where members are looked at, and steered by a policy. What they do is filled in."""

    steps: np.ndarray  # (n_pieces,) at whose start a piece has ended
    rows: np.ndarray  # (n_moved,) of the state, that are looked at
    places: np.ndarray  # (n_axes, n_knots) of the forces among the amounts, -1 of what is no force
    seen: np.ndarray  # (n_batch, n_pieces, n_moved) states
    shocks: np.ndarray  # (n_batch, n_axes, n_knots) changes of the white coordinates; empty where none is steered
    # Parts of the Policy.
    reference: np.ndarray
    ends: np.ndarray
    last: np.ndarray
    gains: np.ndarray
    roots: np.ndarray
    levels: np.ndarray
    feedback: np.ndarray


FREE = Policy(*(np.zeros((0,) * n) for n in (3, 4, 3, 4, 3, 3, 4)))  # steers nothing
_NONE = np.zeros(0, dtype=int)
NOWHERE = Steering(_NONE, _NONE, np.zeros((0, 0), dtype=int), np.zeros((0, 0, 0)), np.zeros((0, 0, 0)), *FREE)


@inline
def _take(steering, member, lane, knot, state, amounts):
    """Choose the forces of a knot, and add what they change to the amounts (n, LANES)."""
    decide(steering, member, knot, state, steering.shocks[member])
    if knot < steering.places.shape[1]:
        for a in range(steering.places.shape[0]):
            if steering.places[a, knot] >= 0:
                force = state[steering.ends.shape[2] + HATS * a + HATS - 1]
                amounts[steering.places[a, knot], lane] += force


@inline
def set_out(steering, first, members, states, amounts):
    """Choose the forces of the first knots of the members of a block, whose states (LANES, n_z) are zero."""
    if len(steering.shocks):
        for i in range(members):
            for knot in range(min(HATS, steering.places.shape[1])):
                _take(steering, first + i, i, knot, states[i], amounts)


@inline
def steer(steering, piece, first, members, work, states, amounts):
    """Look at the members of a block at the end of a piece, and choose the forces of the knot that acts next."""
    for i in range(members):
        member = first + i
        for k in range(len(steering.rows)):
            steering.seen[member, piece, k] = work[(STATE + steering.rows[k]) * LANES + i]
        if len(steering.shocks):
            proceed(steering, member, piece, states[i])
            for k in range(len(steering.rows)):
                states[i, k] = steering.seen[member, piece, k] - steering.reference[member, piece, k]
            _take(steering, member, i, piece + HATS, states[i], amounts)
