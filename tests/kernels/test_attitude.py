"""Quaternions beside Euler angles (thesis appendix B)."""

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.kernels import integrate


@pytest.fixture
def loop():
    """A maker of stern-plane loops: the planes go hard over after a second and stay."""

    def make(vehicle, plane_deg, duration):
        times = np.linspace(0.0, duration, 501)
        controls = np.zeros((501, 3))
        controls[:, 2] = np.radians(plane_deg) * np.clip(times - 1.0, 0.0, 1.0)
        state = np.zeros(12)
        state[6] = vehicle.speed_mps
        rpm = np.full(501, vehicle.rpm_per_mps * vehicle.speed_mps)
        return bs.Manoeuvre("loop", times, controls, rpm, state)

    return make


def test_euler_angles_and_quaternions_are_inverses(rng):
    for angles in rng.uniform([-np.pi, -1.5, -np.pi], [np.pi, 1.5, np.pi], (50, 3)):
        np.testing.assert_allclose(integrate.euler_angles(*integrate.quaternion(*angles)), angles, atol=1e-13)


def test_a_quaternion_rotates_like_the_euler_angles(rng):
    """Both rotation matrices have the downward direction (-sth, cth sphi, cth cphi) in body axes."""
    phi, theta, psi = rng.uniform(-1.0, 1.0, 3)
    q0, q1, q2, q3 = integrate.quaternion(phi, theta, psi)
    down = 2 * (q1 * q3 - q0 * q2), 2 * (q2 * q3 + q0 * q1), q0**2 - q1**2 - q2**2 + q3**2
    expected = -np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)
    np.testing.assert_allclose(down, expected, atol=1e-15)


@pytest.mark.parametrize("name", ["suboff", "npsauv"])
def test_both_fly_the_same_coupled_track_to_integration_accuracy(name):
    """On the spiral in six degrees of freedom they differ by a fourth-order error: a sixteenth at half the step."""
    vehicle = bs.load_vehicle(name)
    spiral = bs.load_manoeuvre("horizontal", vehicle)
    time = vehicle.length_m / vehicle.speed_mps / 13.6
    difference = []
    for step in (1.0, 0.5):
        euler, quaternion = (
            bs.simulate(vehicle, spiral, subproblem=None, dt=step * time, sample=5 * time, attitude=attitude).states
            for attitude in ("euler", "quaternion")
        )
        difference.append(np.abs(euler - quaternion).max())
    assert difference[0] < 1e-5
    assert difference[0] / difference[1] > 10


def test_a_loop_passes_through_ninety_degrees_only_with_quaternions(loop):
    vehicle = bs.load_vehicle("npsauv")
    manoeuvre = loop(vehicle, -20.0, 60.0)
    options = {"dt": 0.02, "sample": 0.1}
    assert bs.simulate(vehicle, manoeuvre, **options).status[0] == "left_envelope"
    track = bs.simulate(vehicle, manoeuvre, attitude="quaternion", **options)
    assert track.status[0] == "ok"
    assert np.isfinite(track.states).all()
    assert np.degrees(np.abs(track.states[0, :, 4])).max() > 89.0
    # The motion is smooth where Euler angles jump: position is the integral of a velocity of constant size.
    steps = np.linalg.norm(np.diff(track.states[0, :, :3], axis=0), axis=1) / 0.1
    speed = np.linalg.norm(track.states[0, :, 6:9], axis=1)
    np.testing.assert_allclose(steps, 0.5 * (speed[1:] + speed[:-1]), rtol=2e-3)
    # Twice the accuracy changes nothing: the passage is not a lucky step.
    fine = bs.simulate(vehicle, manoeuvre, attitude="quaternion", dt=0.01, sample=0.1)
    np.testing.assert_allclose(fine.states[0, :, :3], track.states[0, :, :3], atol=1e-4)


def test_an_unknown_attitude_is_refused():
    vehicle = bs.load_vehicle("suboff")
    with refused("unknown", "attitude"):
        bs.simulate(vehicle, bs.load_manoeuvre("horizontal", vehicle), attitude="gimbal")
