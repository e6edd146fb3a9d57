"""A trial as a random process: what it expects of the readings is what the problem predicts."""

from dataclasses import replace

import numpy as np
import pytest

import bayesub as bs
from bayesub.model.coefficients import HORIZONTAL
from bayesub.problem.disturbances import UnknownDisturbance
from bayesub.problem.priors import normal, relative_normal
from bayesub.sensors.record import Channel, Record
from disturbed.state_space import StateSpace

NUISANCE = {
    "u0_mps": normal(1.7, 0.05),
    "yaw0_deg": normal(0.0, 1.0),
    "mass_kg": normal(2400.0, 50.0),
    "bias_rudder_deg": normal(0.0, 0.5),
    "current_north_mps": normal(0.0, 0.1),
    "current_east_mps": normal(0.0, 0.1),
    "bias_r_degps": normal(0.0, 0.02),
}


@pytest.fixture
def problem():
    """Readings at times of their own, with a lever arm, accelerations, and headings of a log."""
    boat = bs.load_vehicle("auv690")
    fast, slow = np.arange(0.0, 20.01, 0.8), np.arange(0.5, 20.0, 3.0)
    times = {"x": slow, "y": slow, "psi": fast, "r": fast, "u_ground": fast, "v_ground": fast, "vdot": fast}
    channels = [Channel(name, at, np.zeros(len(at)), 0.01) for name, at in times.items()]
    channels[2] = replace(channels[2], modulo_turn=True, values=np.full(len(fast), 6.0))
    channels[5] = replace(channels[5], lever_arm_m=(1.5, 0.2, 0.0))
    return bs.Problem(
        boat,
        bs.load_manoeuvre("horizontal", boat),
        Record(tuple(channels)),
        free=HORIZONTAL,
        prior=relative_normal(0.1),
        nuisance=NUISANCE,
        disturbance=UnknownDisturbance(("X", "Y", "N"), {"X": 1e-5, "Y": normal(5e-5, 5e-6), "N": 1e-5}, 4.0),
        dt=0.1,
    )


def expected(space, parameters):
    """(n_batch, n_readings) what the process expects of all readings, none of which the filter takes in."""
    members = space.members(parameters)
    states, result = members.states, np.zeros((len(parameters), len(space.problem.readings)))
    for k, time in enumerate(space.times):
        means, *_ = members.advance(k, states)
        states, result[:, time.positions] = means[:, : states.shape[1]], means[:, states.shape[1] :]
    return result


def test_without_forces_it_expects_what_the_problem_predicts(problem, rng):
    """With nuisance parameters, current, lever arm and biases; times between steps are on other steps."""
    space = StateSpace(problem)
    assert [name for name in problem.names if not name.startswith("disturbance_")] == list(space.names)
    parameters = space.prior.sample(rng, 2)
    complete = np.zeros((2, problem.n_params))
    complete[:, : space.n_params] = parameters
    predicted = problem.predicted(complete)
    # The heading is read as 6 rad, and so is on its turn.
    assert np.all(np.abs(predicted[:, problem.rows["yaw"]] - 6.0) < np.pi)
    for name, rows in problem.rows.items():
        scale = np.abs(predicted[:, rows]).max()
        np.testing.assert_allclose(
            expected(space, parameters)[:, rows], predicted[:, rows], atol=2e-4 * scale, rtol=0, err_msg=name
        )


def test_intervals_are_shorter_than_half_of_the_correlation_time(problem):
    """Times without readings are put in between; each reading is at one time."""
    space = StateSpace(problem)
    positions = np.concatenate([time.positions for time in space.times])
    np.testing.assert_array_equal(np.sort(positions), np.arange(len(problem.readings)))
    np.testing.assert_array_equal(np.concatenate(space.readings), problem.readings[positions])
    np.testing.assert_array_equal(np.concatenate(space.variances), problem.sds[positions] ** 2)
    assert max(time.interval for time in space.times) <= 2.0
    assert space.times[0].interval == 0.0
    sparse = Record((Channel("r", np.array([5.0, 10.0]), np.zeros(2), 0.01),))
    options = {"free": ["Nuv"], "prior": relative_normal(0.1)}
    disturbed = UnknownDisturbance(("N",), {"N": 1e-5}, 4.0, knot_interval_s=10.0)
    posed = bs.Problem(problem.vehicle, problem.manoeuvre, sparse, disturbance=disturbed, **options)
    assert [len(time.positions) for time in StateSpace(posed).times] == [0, 0, 1, 0, 0, 1]


def test_derivatives_are_those_of_the_process(problem, rng):
    """By the states, with larger differences; and the forces keep their variance of one."""
    space = StateSpace(problem)
    members = space.members(space.prior.sample(rng, 2))
    states, n = members.states, members.states.shape[1]
    for k in range(10):
        states = members.advance(k, states)[0][:, :n]
    states[:, -3:] = rng.standard_normal((2, 3))
    _, by_states, by_noise = members.advance(10, states)
    for j, step in enumerate(np.concatenate([np.full(n - 3, 1e-3), np.full(3, 0.1)])):
        change = step * np.eye(n)[j]
        slope = (members.advance(10, states + change)[0] - members.advance(10, states - change)[0]) / (2.0 * step)
        np.testing.assert_allclose(by_states[..., j], slope, rtol=1e-3, atol=1e-4)
    of_forces = by_states[:, n - 3 : n] @ np.swapaxes(by_states[:, n - 3 : n], 1, 2)
    of_noise = by_noise[:, n - 3 : n] @ np.swapaxes(by_noise[:, n - 3 : n], 1, 2)
    np.testing.assert_allclose(of_forces + of_noise, np.tile(np.eye(3), (2, 1, 1)), atol=1e-9)
