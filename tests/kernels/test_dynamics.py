"""The force model and the equations of motion, against the slow twin and against physics."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import slow_twin

import bayesub as bs
from bayesub.kernels import mass
from bayesub.kernels.dynamics import Boat, InverseMass, euler_derivative
from bayesub.model.coefficients import ADDED_MASSES, AXES, NAMES, names_of_axis
from bayesub.model.simulator import Simulator

# Round-off of a sum of about 150 terms, magnified by the mass matrix; 1e-12 is 4500 machine epsilons. It is taken
# relative to the acceleration of the bow, in which linear and angular parts have one unit.
ROUND_OFF = 1e-12


def bow(accelerations, length):
    """Accelerations with the angular ones in m/s^2 at one length from the origin, and their size (n, 1)."""
    scaled = accelerations * np.array([1, 1, 1, length, length, length])
    return scaled, np.linalg.norm(scaled, axis=-1, keepdims=True)


def twin_accelerations(boat, states, controls, rpm):
    return np.array([slow_twin.accelerations(boat, s, c, n) for s, c, n in zip(states, controls, rpm, strict=True)])


def test_accelerations_equal_those_of_the_twin(full, boat, motions):
    """The compiled equations of motion are those of the model, in every branch and with no coefficient zero."""
    states, controls, rpm = motions
    found, _ = bow(bs.accelerations(full, states, controls, rpm), full.length_m)
    expected, size = bow(twin_accelerations(boat, states, controls, rpm), full.length_m)
    assert np.all(np.abs(found - expected) < ROUND_OFF * size)


def test_motions_cover_every_branch(motions):
    """The motions compared with the twin include each thrust branch, ahead and astern, rest, and no drift."""
    states, _, rpm = motions
    u, ordered = states[:, 6], rpm / 11.0
    moving = u != 0
    ratio = ordered[moving] / u[moving]
    assert min((ratio > 1).sum(), ((ratio > 0) & (ratio <= 1)).sum(), (ratio <= 0).sum(), (ratio == 1).sum()) >= 5
    assert min((u < 0).sum(), (~moving).sum(), (rpm < 0).sum(), ((rpm > 0) & (u < 0)).sum()) >= 3
    assert (states[:, 7:9] == 0).all(axis=1).sum() > 3


def test_full_boat_has_nothing_zero(full):
    """Every coefficient and every property of the body of the boat compared with the twin matters."""
    assert np.all(full.xi != 0)
    assert np.all(full.body != 0)


def test_mass_matrix_is_what_accelerations_cost(full, boat):
    """M is the left-hand side less the added-mass terms, column by column."""
    expected = slow_twin.mass_matrix(boat)
    compiled = full.kernels().mass_matrix(full.xi * full.dimensional_factors, full.body)
    for matrix in (compiled, full.mass_matrix):
        np.testing.assert_allclose(matrix, expected, rtol=4e-15, atol=0)  # one product and one sum an entry


def test_inverses_of_small_matrices(rng):
    """Gauss-Jordan inverts also where a pivot on the diagonal is zero, and marks a singular matrix as not finite."""
    matrices = rng.standard_normal((3, 6, 6))
    matrices[:, 0, 0] = matrices[:, 3, 3] = 0.0
    for matrix, inverse in zip(matrices, mass.inverses(matrices), strict=True):
        np.testing.assert_allclose(inverse @ matrix, np.eye(6), atol=1e-13 * np.linalg.cond(matrix))
    matrices[1, 4] = 0.0
    finite = np.isfinite(mass.inverses(matrices)).all(axis=(1, 2))
    np.testing.assert_array_equal(finite, [True, False, True])


def test_trajectory_equals_that_of_the_twin(full, boat, coupled):
    """Forty steps of the compiled integrator are forty steps of a plain Runge-Kutta with the twin."""
    step, n_steps = 0.5, 40

    def history(t):
        planes = [np.interp(t, coupled.times, column) for column in coupled.controls.T]
        return planes, np.interp(t, coupled.times, coupled.rpm)

    expected = slow_twin.fly(boat, coupled.initial_state, history, step, n_steps)
    simulator = Simulator(full, coupled, np.arange(n_steps + 1) * step, dt=step)
    found, _ = simulator.run(full.xi)
    # Positions reach 150 m and the flow is stable, so round-off stays near 1e-13 of them.
    np.testing.assert_allclose(found[0], expected, rtol=0, atol=1e-10)
    assert np.all(np.ptp(expected[:, 3:], axis=0) > 1e-4)  # the motion involves every degree of freedom


@pytest.mark.parametrize("name", NAMES)
def test_force_of_one_coefficient(full, boat, motions, name):
    """A coefficient adds (rho/2) l^k * coefficient * regressor along its own axis and nothing elsewhere."""
    states, controls, rpm = (part[:30] for part in motions)
    only = np.where(np.array(NAMES) == name, 0.5 * full.xi, 0.0)
    with_it = bs.accelerations(replace(full, xi=only), states, controls, rpm)
    without = bs.accelerations(replace(full, xi=np.zeros(101)), states, controls, rpm)
    bare = boat | {"coefficients": dict.fromkeys(NAMES, 0.0)}
    force = (with_it - without) @ slow_twin.mass_matrix(bare).T
    k = NAMES.index(name)
    columns = bs.regressors(states, with_it, controls)[name[0]]
    expected = np.zeros_like(force)
    expected[:, AXES.index(name[0])] = (
        full.dimensional_factors[k] * only[k] * columns[:, names_of_axis(name[0]).index(name)]
    )
    # Round-off of the difference of two accelerations under forces of up to a hundred meganewtons.
    heavy = np.abs(without) @ np.abs(slow_twin.mass_matrix(bare).T)
    assert np.all(np.abs(force - expected) <= 1e-13 * heavy.max(axis=1, keepdims=True) * [1, 1, 1, 10, 100, 100])


def test_forces_superpose(full, motions, rng):
    """With the mass held, the acceleration of the sum of two coefficient sets is the sum of their accelerations."""
    states, controls, rpm = motions
    steady = ~np.isin(NAMES, ADDED_MASSES)
    first, second = full.xi * rng.uniform(0.2, 0.5, (2, 101)) * steady

    def accelerations(xi):
        return bow(bs.accelerations(replace(full, xi=xi), states, controls, rpm), full.length_m)[0]

    none, a, b, both = (accelerations(xi) for xi in (np.zeros(101), first, second, first + second))
    size = sum(np.linalg.norm(part, axis=1, keepdims=True) for part in (none, a, b))
    assert np.all(np.abs(a + b - both - none) < ROUND_OFF * size)


def kinematics(attitude, velocity, body_rates):
    """Rates of position and of the Euler angles, of a massless boat."""
    zeros = np.zeros(120)
    state = np.concatenate([np.zeros(3), attitude, velocity, body_rates])
    forces = bs.load_vehicle("suboff").kernels().equations
    boat = Boat(forces, state, zeros, InverseMass(zeros), zeros, zeros, zeros)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.array(euler_derivative(boat), dtype=float)[:6]


angles = st.floats(-3.0, 3.0)
speeds = st.floats(-20.0, 20.0)


@settings(deadline=None, max_examples=60)
@given(phi=angles, theta=st.floats(-1.45, 1.45), psi=angles, velocity=st.tuples(speeds, speeds, speeds))
def test_speed_is_the_same_in_both_frames(phi, theta, psi, velocity):
    """The rotation to inertial axes preserves the length of the velocity."""
    rates = kinematics((phi, theta, psi), velocity, np.zeros(3))
    assert np.linalg.norm(rates[:3]) == pytest.approx(np.linalg.norm(velocity), rel=1e-14, abs=1e-300)


@settings(deadline=None, max_examples=60)
@given(phi=angles, theta=st.floats(-1.3, 1.3), rates=st.tuples(speeds, speeds, speeds))
def test_euler_rates_turn_back_into_body_rates(phi, theta, rates):
    """p = phi' - psi' sin theta, q = theta' cos phi + psi' cos theta sin phi, and so on."""
    roll, pitch, yaw = kinematics((phi, theta, 0.0), np.zeros(3), rates)[3:]
    p = roll - yaw * np.sin(theta)
    q = pitch * np.cos(phi) + yaw * np.cos(theta) * np.sin(phi)
    r = -pitch * np.sin(phi) + yaw * np.cos(theta) * np.cos(phi)
    # Euler rates are up to 1 / cos(1.3) = 4 times the body rates of at most 35 rad/s.
    np.testing.assert_allclose((p, q, r), rates, rtol=0, atol=1e-13)
