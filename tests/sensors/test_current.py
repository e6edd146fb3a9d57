"""Currents."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation
from support.refusals import refused

import bayesub as bs
from bayesub.logs.log_files import STATES
from bayesub.model.disturbance import ForceHistory
from bayesub.sensors import ADCP, DVL, Sensor, Track, over_ground
from bayesub.sensors.current import Water

CURRENT = (0.37, -0.52)
SPACING = 1 / 16


@pytest.fixture(scope="module")
def flown(full, coupled):
    """The full boat in six degrees of freedom, rolling and pitching."""
    return bs.simulate(full, coupled, dt=SPACING)


def travelled(times, attitude, velocities):
    """Displacement (n, 3) in the fixed frame by integration of body velocities (n, 3), turned by SciPy."""
    turned = Rotation.from_euler("ZYX", attitude[:, ::-1]).apply(velocities)
    return CubicSpline(times, turned).antiderivative()(times)


def test_bottom_track_integrates_to_the_position_over_the_ground():
    """Turned and summed, u v w over the ground are the way over the ground, and those through the water are not."""
    t = SPACING * np.arange(641)
    states = np.zeros((len(t), 12))
    states[:, 3:6] = np.stack([0.6 * np.sin(t / 3), 0.5 * np.sin(t / 4), 0.3 * t], axis=1)
    states[:, 6:9] = np.stack([5 + np.sin(t / 5), 0.5 * np.cos(t / 2), 0.2 * np.sin(t)], axis=1)
    states[:, :3] = travelled(t, states[:, 3:6], states[:, 6:9])
    ground = over_ground(states, t, CURRENT)
    # The spline of a velocity of size 5 m/s that swings at up to 1.3 rad/s is off by less than
    # 5 / 384 (1.3 / 16)^4 = 6e-7 m/s, which swings as well and sums up over a second or two.
    way = travelled(t, ground[:, 3:6], ground[:, 6:9])
    np.testing.assert_allclose(way, ground[:, :3], rtol=0, atol=1e-6)
    assert np.linalg.norm((way - states[:, :3])[-1]) == pytest.approx(np.hypot(*CURRENT) * 40.0, rel=1e-6)


def test_what_a_current_leaves_alone(flown):
    """Depth, attitude and rates stay; the velocity added has the size of the current at any attitude."""
    ground, states = over_ground(flown.states, flown.times, CURRENT), flown.states
    np.testing.assert_array_equal(ground[..., [2, 3, 4, 5, 9, 10, 11]], states[..., [2, 3, 4, 5, 9, 10, 11]])
    added = np.linalg.norm(ground[..., 6:9] - states[..., 6:9], axis=-1)
    np.testing.assert_allclose(added, np.hypot(*CURRENT), rtol=1e-13)
    np.testing.assert_array_equal(over_ground(states, flown.times, (0.0, 0.0)), states)


def test_the_motion_over_the_ground_is_linear_in_the_current(flown):
    """The changes made by a north-going and an east-going current add up to that of their sum."""
    north, east, both = (
        over_ground(flown.states, flown.times, current) - flown.states for current in ((2, 0), (0, -3), (2, -3))
    )
    # Differences of positions of a hundred metres, rounded to 1e-14 m each.
    np.testing.assert_allclose(north + east, both, rtol=0, atol=1e-12)


def test_only_what_is_over_the_ground_feels_the_current(flown):
    """Position and bottom track read over the ground, a profiler and the compass in the water."""
    sensors = [
        Track(1e-9, 1e-9, channels=("x", "y", "z", "yaw")),
        DVL(sd_mps=1e-9),
        ADCP(sd_mps=1e-9),
        Sensor("udot_mps2", 1e-9),
    ]
    still, moving = (bs.observe(flown, sensors, np.random.default_rng(3), current_mps=c) for c in ((0, 0), CURRENT))
    times = still.channels[0].times
    states = flown.resampled(times).states[0]
    ground = over_ground(states, times, CURRENT)
    for before, after in zip(still.channels, moving.channels, strict=True):
        if before.over_ground:
            column = bs.sensors.QUANTITIES[before.quantity].state
            expected = (ground - states)[:, STATES.index(column)]
            np.testing.assert_allclose(after.values - before.values, expected, rtol=0, atol=1e-10)
        else:
            np.testing.assert_array_equal(after.values, before.values)


def test_a_current_that_varies_carries_the_boat_by_its_integral(flown):
    """With knots of its own: the way over the ground is the integral, a bottom log reads what the current is then."""
    history = ForceHistory(
        np.array([0.0, 7.0, 20.0]), ("east", "north"), np.array([[0.0, 0.4], [0.3, -0.2], [0.1, 0.5]])
    )
    times = np.linspace(0.0, 26.0, 105)
    water = Water.varying(history, times)
    fine = np.linspace(0.0, 26.0, 26001)
    way = np.stack([np.interp(fine, history.times, history.values[:, k]) for k in (1, 0)], axis=1)
    exact = np.vstack([np.zeros(2), np.cumsum(0.5 * (way[1:] + way[:-1]), axis=0) * 1e-3])
    np.testing.assert_allclose(water.displacement, exact[::250], atol=1e-9)
    np.testing.assert_allclose(water.velocity, way[::250], atol=1e-12)
    states = flown.resampled(times).states
    ground = over_ground(states, times, water)
    np.testing.assert_allclose(ground[0, :, :2] - states[0, :, :2], exact[::250], atol=1e-9)
    added = np.linalg.norm(ground[0, :, 6:9] - states[0, :, 6:9], axis=-1)
    np.testing.assert_allclose(added, np.linalg.norm(way[::250], axis=1), rtol=1e-12)


def test_a_constant_history_is_a_constant_current(flown):
    """Readings of a boat in a history that does not change are those in a current of that size."""
    history = ForceHistory(np.array([0.0, 10.0]), ("north", "east"), np.tile(CURRENT, (2, 1)))
    moved = replace(flown, simulator=flown.simulator.disturbed(history))
    sensors = [Track(1e-9, 1e-9, channels=("x", "y", "z", "yaw")), DVL(sd_mps=1e-9), ADCP(sd_mps=1e-9)]
    varying = bs.observe(moved, sensors, np.random.default_rng(3))
    steady = bs.observe(flown, sensors, np.random.default_rng(3), current_mps=CURRENT)
    np.testing.assert_allclose(varying.values, steady.values, rtol=1e-13, atol=1e-11)


@pytest.mark.parametrize("current", [(np.nan, 0.0), (1.0,), (0.1, 0.2, 0.3)])
def test_bad_currents(flown, rng, current):
    with refused("value", "current_mps"):
        bs.observe(flown, ADCP(sd_mps=0.1), rng, current_mps=current)
