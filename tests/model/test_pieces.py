"""Motions between knots, linearised, against derivatives of the whole motion."""

import numpy as np
import pytest

import bayesub as bs
from bayesub.kernels.kalman import HATS
from bayesub.model.disturbance import Knots
from bayesub.model.simulator import MOVING, Simulator

AXES, END = ("X", "Y", "N"), 40.0


@pytest.mark.parametrize(
    ("subproblem", "step", "interval"), [("horizontal", 0.25, 2.5), ("horizontal", 0.4, 2.5), (None, 0.2, 0.7)]
)
def test_pieces_make_the_derivatives_of_the_whole_motion(subproblem, step, interval):
    """From piece to piece the columns of the start and of all forces follow, of accelerations and between steps too."""
    boat = bs.load_vehicle("auv690")
    knots = Knots(np.linspace(0.0, END, round(END / interval) + 1), AXES)
    times = np.unique(np.concatenate([np.arange(0.0, END), np.linspace(0.3, END - 1e-3, 37)]))
    manoeuvre = bs.load_manoeuvre("horizontal", boat)
    simulator = Simulator(boat, manoeuvre, times, dt=step, knots=knots, subproblem=subproblem)
    states, forces = MOVING[subproblem], 0.5 * np.random.default_rng(0).standard_normal(3 * len(knots.times))
    outputs, starts = (*states, "udot", "rdot"), tuple(f"{state}0" for state in states)
    whole = simulator.sensitivities(boat.xi, (*starts, *knots.parameters), outputs, amounts=forces)
    pieces = simulator.pieces(boat.xi, outputs, amounts=forces)
    n, n_states = len(knots.times), len(states)
    padded = np.zeros((3, n + HATS, whole.shape[2]))
    padded[:, :n, n_states:] = np.eye(3 * n).reshape(3, n, 3 * n)
    state, found = np.eye(n_states, whole.shape[2]), np.empty_like(whole)
    for k, end in enumerate(pieces.ends):
        acting = np.vstack([state, padded[:, k : k + HATS].reshape(3 * HATS, -1)])
        found[pieces.numbers == k] = pieces.outputs[pieces.numbers == k] @ acting
        state = end @ acting
    scale = np.abs(whole).max(axis=0)
    np.testing.assert_allclose(found / np.maximum(scale, 1e-9), whole / np.maximum(scale, 1e-9), atol=1e-11)
    assert (np.diff(pieces.bounds) >= interval - step).all()
