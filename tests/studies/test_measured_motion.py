"""Motion as a record holds it."""

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.model.linear_form import linear_systems
from thesis.measured_motion import measure, recorded


@pytest.fixture(scope="module")
def exact(suboff):
    """A random manoeuvre and a record of its true velocities, attitudes and accelerations."""
    track = bs.simulate(suboff, bs.load_manoeuvre("random:0", suboff), dt=1.0, sample=1.0)
    return track, bs.observe(track, bs.sensors.autosub(), None)


def test_exact_readings_make_the_exact_linear_form(exact, suboff):
    """Of readings without error the linear form is that of the simulation, from the first reading on."""
    track, record = exact
    simulated = linear_systems(track)
    for axis, system in linear_systems(recorded(record, track.simulator, suboff.xi)).items():
        assert system.names == simulated[axis].names
        reference = simulated[axis].matrix[1:]
        # Outputs between steps are interpolated, here at the ends of steps: round-off of a sum of four terms.
        np.testing.assert_allclose(system.matrix, reference, rtol=1e-9, atol=1e-9 * np.abs(reference).max())
        scale = np.abs(system.matrix * suboff.xi[bs.coefficients.columns(system.names)]).max()
        np.testing.assert_allclose(system.load, simulated[axis].load[1:], atol=1e-9 * scale)


def test_a_plane_confines_the_motion(suboff, spiral_track, rng):
    """In the horizontal plane readings of heave, roll and pitch play no part: there is no such motion."""
    record = bs.observe(spiral_track, bs.sensors.autosub(interval_s=5.0), rng)
    motion = recorded(record, spiral_track.simulator, suboff.xi)
    assert not motion.states[..., [3, 4, 8, 9, 10]].any()
    assert not motion.accelerations[..., [2, 3, 4]].any()
    readings = {channel.name: channel.values for channel in record.channels}
    np.testing.assert_array_equal(motion.states[0, :, 6], readings["u_ground"])
    np.testing.assert_array_equal(motion.accelerations[0, :, 5], readings["rdot"])
    assert set(linear_systems(motion)) == {"X", "Y", "N"}
    assert motion.controls.shape == (120, 3)


def test_readings_that_are_missing(suboff, spiral_track, rng):
    """A record without what the equations need, or with other times for it, is refused by its column."""
    sensors = bs.sensors.autosub(channels=("u_ground", "v_ground", "r", "udot", "vdot"))
    with refused("missing", "rdot_degps2"):
        recorded(bs.observe(spiral_track, sensors, rng), spiral_track.simulator, suboff.xi)
    sensors = bs.sensors.modified(bs.sensors.autosub(), ["vdot"], interval_s=2.0)
    with refused("data", "vdot_mps2"):
        recorded(bs.observe(spiral_track, sensors, rng), spiral_track.simulator, suboff.xi)
    sensors = bs.sensors.modified(bs.sensors.autosub(), ["v_ground"], lever_arm_m=(-30.0, 0.0, 0.0))
    with refused("data", "v_mps"):
        recorded(bs.observe(spiral_track, sensors, rng), spiral_track.simulator, suboff.xi)


def test_measured_motion(spiral_track, rng):
    """Velocities and accelerations are multiples of their resolution, everything else is exact; noise has its sd."""
    rounded = measure(spiral_track, velocity_resolution=0.01, acceleration_resolution=0.001)
    np.testing.assert_allclose(rounded.states[..., 6:9] / 0.01, np.round(spiral_track.states[..., 6:9] / 0.01))
    off = rounded.accelerations - spiral_track.accelerations
    assert 0.0004 < np.abs(off[..., :2]).max() <= 0.0005 + 1e-12
    assert not off[..., 3:].any()
    np.testing.assert_array_equal(rounded.states[..., :6], spiral_track.states[..., :6])
    noisy = measure(spiral_track, velocity_sd=0.02, rng=rng)
    spread = np.std(noisy.states[..., 6:9] - spiral_track.states[..., 6:9])
    assert spread == pytest.approx(0.02, rel=4 / np.sqrt(2 * 3 * 6001))


def test_exact_measurements_make_the_exact_linear_form(spiral_track):
    """Measured without error, a motion is its trajectory."""
    exact, same = linear_systems(spiral_track), linear_systems(measure(spiral_track))
    for axis, system in exact.items():
        np.testing.assert_array_equal(same[axis].matrix, system.matrix)
        np.testing.assert_array_equal(same[axis].load, system.load)
