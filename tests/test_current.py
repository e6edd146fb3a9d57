"""A constant current."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

import bayesub as bs
from bayesub.sensors import ADCP, DVL, Sensor, Track, over_ground

CURRENT = (0.37, -0.52)
SPACING = 1 / 16


@pytest.fixture(scope="module")
def flown(full, coupled):
    """The full boat in six degrees of freedom, rolling and pitching."""
    return bs.simulate(full, coupled, dt=SPACING)


def travelled(attitude, velocities):
    """Displacement in the fixed frame by integration of body velocities (n, 3), turned by SciPy."""
    turned = Rotation.from_euler("ZYX", attitude[:, ::-1]).apply(velocities)
    times = SPACING * np.arange(len(turned))
    return CubicSpline(times, turned).antiderivative()(times)


def test_bottom_track_integrates_to_the_position_over_the_ground(flown):
    """Turned and summed, u v w over the ground are the way over the ground, and those through the water are not."""
    smooth = flown.times <= 11.0  # later thrust changes branch, and velocities have kinks
    times, states = flown.times[smooth], flown.states[0, smooth]
    ground = over_ground(states, times, CURRENT)
    way = ground[:, :3] - ground[0, :3]
    # Cubic splines of 16 samples a second: (1/16)^4 / 384 of tens of metres on a time scale of seconds.
    np.testing.assert_allclose(travelled(ground[:, 3:6], ground[:, 6:9]), way, rtol=0, atol=2e-6)
    in_water = travelled(states[:, 3:6], states[:, 6:9])
    np.testing.assert_allclose(in_water, states[:, :3] - states[0, :3], rtol=0, atol=2e-6)
    assert np.linalg.norm((way - in_water)[-1]) == pytest.approx(np.hypot(*CURRENT) * 11.0, abs=4e-6)
    assert np.abs(states[:, 3:6]).max(axis=0).min() > 0.01  # it rolls, pitches and turns


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
            expected = (ground - states)[:, bs.logs.STATES.index(column)]
            np.testing.assert_allclose(after.values - before.values, expected, rtol=0, atol=1e-10)
        else:
            np.testing.assert_array_equal(after.values, before.values)


@pytest.mark.parametrize("current", [(np.nan, 0.0), (1.0,), (0.1, 0.2, 0.3)])
def test_bad_currents(flown, rng, current):
    with pytest.raises(bs.InputError, match="current_mps must be two finite numbers, north and east"):
        bs.observe(flown, ADCP(sd_mps=0.1), rng, current_mps=current)
