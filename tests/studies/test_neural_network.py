"""The network of the study `neural_network`."""

from functools import partial

import numpy as np
import pytest

import bayesub as bs
from bayesub.model.simulate import accelerations
from bayesub.model.simulator import Simulator
from neural_network import methods


@pytest.fixture(scope="module")
def trial(suboff):
    """A record whose guess is right to a millionth."""
    return methods.trial(suboff, 1e-6, np.random.default_rng(7))


@pytest.fixture(scope="module")
def network(trial):
    """The network that has learned it."""
    return methods.Network(trial, seed=0)


def nothing(states, _):
    """What a network adds that adds nothing."""
    return np.zeros((len(states), 3))


def mass_of(boat):
    """The whole mass matrix (6, 6), with added masses."""
    return boat.kernels().mass_matrix(boat.xi * boat.dimensional_factors, boat.body)


def flown(network, vehicle, manoeuvre):
    """The largest distance from the boat on a manoeuvre, over the path."""
    times = np.arange(0.0, manoeuvre.duration, network.one.step)
    truth = Simulator(vehicle, manoeuvre, times).trajectory(vehicle.xi).states[0, :, :2]
    path = np.linalg.norm(np.diff(truth, axis=0), axis=1).sum()
    return np.linalg.norm(network.fly(manoeuvre, times)[:, :2] - truth, axis=1).max() / path


def test_what_is_known_flies_as_the_boat_does(network, suboff, monkeypatch):
    """With all coefficients known and a network that adds nothing, a boat of the plane flies as it is simulated."""
    monkeypatch.setattr(network, "vehicle", suboff)
    monkeypatch.setattr(network, "_mass", mass_of(suboff))
    monkeypatch.setattr(network, "forces", nothing)
    assert flown(network, suboff, bs.load_manoeuvre("zigzag_20_20", suboff)) < 2e-4


def exact(network, boat, states, controls):
    """What the boat's own coefficients add to what the network knows, by its accelerations (n, 3), N and N m."""
    rpm = boat.rpm_per_mps * boat.speed_mps
    of_boat = accelerations(boat, states, controls, rpm) @ mass_of(boat).T
    return of_boat[:, methods.PLACES] - network._known(states, controls, rpm)


def test_the_network_has_learned_the_forces(network, suboff):
    """Along its own motion it gives what was left out to 3 % (rms), axis by axis."""
    left_out = exact(network, suboff, network.states, network.controls)
    off = network.forces(network.states, network.controls) - left_out
    assert (np.sqrt(np.mean(off**2, axis=0) / np.mean(left_out**2, axis=0)) < 0.03).all()


def test_the_network_follows_what_it_has_learned(network, trial, suboff, monkeypatch):
    """The zig-zag that it was trained on, twenty times nearer than without what it adds.

    How near depends on where the training ends, which another kernel of the BLAS changes: 0.3 to 0.9 % of the path.
    """
    with_it = flown(network, suboff, trial.manoeuvre)
    monkeypatch.setattr(network, "forces", nothing)
    assert with_it < flown(network, suboff, trial.manoeuvre) / 20


def test_regression_finds_the_coefficients_of_exact_forces(network, suboff, monkeypatch):
    """Of a network that gives what the boat's own coefficients add, by its accelerations, it has all of them."""
    monkeypatch.setattr(network, "forces", partial(exact, network, suboff))
    free = methods.columns([name for name in network.one.free if name not in methods.ADDED])
    np.testing.assert_allclose(network.coefficients()[free], suboff.xi[free], rtol=1e-6)
