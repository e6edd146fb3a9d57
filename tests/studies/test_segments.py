"""Pieces of a manoeuvre: one after the other they are the whole of it."""

from itertools import pairwise

import numpy as np
import pytest

import bayesub as bs
from bayesub.logs.log_files import STATES
from bayesub.model.disturbance import ForceHistory, Knots
from bayesub.model.simulator import Simulator
from disturbed.segments import Segment


@pytest.fixture(scope="module")
def boat():
    return bs.load_vehicle("auv690")


def chained(segments, simulator, xi, forces, amounts, outputs=STATES):
    """States (n, 12) at the ends of segments, and what is wanted (n_outputs,) of the last."""
    dimensional = simulator.dimensional(xi)
    bodies = np.concatenate([simulator.vehicle.body, simulator.vehicle.constants])[None]
    states = [simulator.manoeuvre.initial_state]
    for segment, before, after in zip(segments, forces[:-1], forces[1:], strict=True):
        rows = np.concatenate([amounts, before, after])[None]
        states.append(segment.fly(dimensional, bodies, np.array([states[-1]]), rows, STATES)[0])
    return np.array(states[1:]), segment.fly(dimensional, bodies, np.array([states[-2]]), rows, outputs)[0]


def test_segments_make_up_the_manoeuvre(boat, rng):
    """With forces that are lines between their ends, and a rudder that is off: as in one flight, to round-off."""
    manoeuvre, axes, varied = bs.load_manoeuvre("horizontal", boat), ("Y", "N"), ("bias_rudder_deg",)
    ends = np.array([0.0, 1.0, 3.0, 3.4, 8.0])
    forces, amounts = rng.standard_normal((5, 2)) * [20.0, 15.0], np.array([0.7])
    history = ForceHistory(ends, axes, forces)
    whole = Simulator(boat, manoeuvre, ends[1:], dt=0.2, varied=varied, forces=history)
    outputs = ("vdot", "r", "rdot")
    expected = whole.run(boat.xi, amounts=amounts[None])[0][0]
    rates = whole.run(boat.xi, amounts=amounts[None], outputs=outputs)[0][0, -1]
    pieces = Simulator(boat, manoeuvre, ends, dt=0.2, knots=Knots(ends[[0, -1]], axes))
    segments = [Segment(pieces, *pair, axes, varied) for pair in pairwise(ends)]
    states, last = chained(segments, pieces, boat.xi, forces, amounts, outputs)
    np.testing.assert_allclose(states, expected, rtol=1e-10, atol=1e-11)
    np.testing.assert_allclose(last, rates, rtol=1e-9)


def test_a_segment_without_length_stays_where_it_is(boat):
    """The states are those that it begins with; accelerations feel the force there."""
    manoeuvre = bs.load_manoeuvre("horizontal", boat)
    simulator = Simulator(boat, manoeuvre, [0.0], dt=0.2, knots=Knots(np.array([0.0, 1.0]), ("Y",)))
    segment = Segment(simulator, 4.0, 4.0, ("Y",))
    arguments = simulator, boat.xi, np.array([[50.0], [-7.0]]), np.zeros(0), ("vdot",)
    (states,), (pushed,) = chained([segment], *arguments)
    np.testing.assert_array_equal(states, manoeuvre.initial_state)
    (_,), (still,) = chained([segment], simulator, boat.xi, np.zeros((2, 1)), np.zeros(0), ("vdot",))
    assert pushed > still


def test_a_boat_that_fails_has_no_states(boat):
    """A member that is too fast, beside one that is not."""
    simulator = Simulator(boat, bs.load_manoeuvre("horizontal", boat), [0.0], dt=0.2)
    bodies = np.tile(np.concatenate([simulator.vehicle.body, simulator.vehicle.constants]), (2, 1))
    states = np.tile(simulator.manoeuvre.initial_state, (2, 1))
    states[1, 6] *= 100.0
    dimensional = simulator.dimensional(np.tile(boat.xi, (2, 1)))
    found = Segment(simulator, 0.0, 1.0, ()).fly(dimensional, bodies, states, np.zeros((2, 0)), STATES)
    np.testing.assert_array_equal(np.isnan(found).all(axis=1), [False, True])
