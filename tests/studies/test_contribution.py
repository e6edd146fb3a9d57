"""Error cancellation and contributions."""

import numpy as np
import pytest

import bayesub as bs
from bayesub.inference.identifiability import rank
from bayesub.model.coefficients import HORIZONTAL, INDEX
from bayesub.model.linear_form import linear_systems
from ill_conditioning.contribution import cancellation, contribution


@pytest.fixture(scope="module")
def systems(spiral_track):
    return linear_systems(spiral_track)


def test_terms_sum_to_the_error_of_the_force(spiral_track, systems, suboff, rng):
    """The sum is the force of the wrong coefficients less that of the right ones, from the equations of motion."""
    changes = {name: 0.1 * suboff.xi[INDEX[name]] * rng.standard_normal() for name in ("Xvv", "Xvr", "Xrr", "Yuv")}
    wrong = suboff.xi.copy()
    for name, change in changes.items():
        wrong[INDEX[name]] += change
    simulator = spiral_track.simulator
    accelerations = simulator.accelerations(np.stack([suboff.xi, wrong]), np.repeat(spiral_track.states, 2, axis=0))
    found = cancellation(systems["X"], changes)
    assert found.errors.shape == (len(spiral_track.times), len(systems["X"].names))
    # None of the changes is an added mass, so the force error is the effective mass times the change of acceleration.
    mass = suboff.body[0] - (suboff.xi * suboff.dimensional_factors)[INDEX["Xudot"]]
    expected = mass * (accelerations[1] - accelerations[0])[:, 0]
    np.testing.assert_allclose(found.total, expected, atol=1e-9 * np.abs(found.errors).max())


def test_right_coefficients_have_no_error(systems):
    """A change on another axis, and a coefficient that is not named, leave no error behind."""
    found = cancellation(systems["X"], {"Yuv": 1.0, "Xvv": 1e-3})
    assert next(iter(found.largest)) == "Xvv"
    assert [size for name, size in found.largest.items() if name != "Xvv"] == [0.0] * 5
    assert found.ratio == 1.0


def test_a_null_vector_cancels_completely(systems):
    """Along a null vector of the linear form terms of any size add up to round-off."""
    for axis, found in rank(systems).items():
        for vector in found.null_vectors:
            assert cancellation(systems[axis], vector).ratio > 1e9


def test_contribution_is_that_of_direct_simulation(suboff, spiral, spiral_track):
    """One coefficient at a quarter of its value, simulated by itself: the cost of model manual, section 10."""
    track = bs.sensors.Track(position_sd_m=1.0, attitude_sd_deg=1.0, interval_s=2.0)
    record = bs.observe(spiral_track, track, np.random.default_rng(1))
    problem = bs.Problem(suboff, spiral, record, free=HORIZONTAL, prior=bs.priors.relative_normal(0.25), dt=1.0)
    found = contribution(problem, problem.prior.mean, (0.25, 0.99))
    assert found.costs.shape == (2, problem.n_params)
    assert np.all(found.costs[0] > found.costs[1])
    right = bs.simulate(suboff, spiral, dt=1.0, sample=2.0).states[0]
    for name in ("Xuu", "Nuv", "Yrdot"):
        for fraction, costs in zip((0.25, 0.99), found.costs, strict=True):
            xi = suboff.xi.copy()
            xi[INDEX[name]] *= fraction
            off = bs.simulate(suboff, spiral, xi=xi, dt=1.0, sample=2.0).states[0, 1:, :6] - right[1:, :6]
            off[:, 3:] = np.degrees(off[:, 3:])
            # Predictions agree to 1e-9 m (rounding of the output times) on offsets of a tenth of a metre or more.
            assert costs[problem.names.index(name)] == pytest.approx(np.sum(off**2), rel=1e-7)


def test_a_simulation_that_fails_costs_infinitely_much(suboff, spiral, spiral_track):
    """A coefficient that makes the boat diverge is not passed over."""
    record = bs.observe(spiral_track, bs.sensors.Track(1.0, 1.0, 10.0), np.random.default_rng(1))
    problem = bs.Problem(suboff, spiral, record, free=["Xuu", "Yuv"], prior=bs.priors.relative_normal(0.25), dt=1.0)
    found = contribution(problem, problem.prior.mean, (-50.0,))
    assert np.isinf(found.costs[0, 0])
