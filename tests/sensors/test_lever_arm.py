"""Sensors away from the body origin."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.refusals import refused

import bayesub as bs
from bayesub.problem.priors import normal, relative_normal
from bayesub.sensors import Sensor

ARM = (1.3, -0.7, 2.1)
COLUMNS = ("x_m", "y_m", "depth_m", "u_mps", "v_ground_mps", "w_mps", "udot_mps2", "vdot_mps2", "wdot_mps2", "p_degps")


@pytest.fixture(scope="module")
def coupled_track(full, coupled):
    return bs.simulate(full, coupled, dt=0.25)


def readings(track, lever_arm, **options):
    sensors = [Sensor(column, 0.1, interval_s=1.0, lever_arm_m=lever_arm) for column in COLUMNS]
    return {channel.name: channel.values for channel in bs.observe(track, sensors, None, **options).channels}


def test_a_sensor_reads_the_motion_of_its_point_of_a_rigid_body(coupled_track):
    """Position by SciPy's rotation, velocity v + omega x l, and their rates of change; rates are those of the body."""
    at, origin = readings(coupled_track, ARM), readings(coupled_track, None)
    track = coupled_track.resampled(np.arange(1.0, 49.0))
    states, rates = track.states[0], track.accelerations[0, :, 3:]
    to_inertial = Rotation.from_euler("ZYX", states[:, [5, 4, 3]])
    arm = to_inertial.apply(ARM)
    for name, added in zip(("x", "y", "depth"), arm.T, strict=True):
        np.testing.assert_allclose(at[name], origin[name] + added, rtol=1e-12, atol=1e-12)
    for names, turning in ((("u", "v_ground", "w"), states[:, 9:]), (("udot", "vdot", "wdot"), rates)):
        for name, added in zip(names, np.cross(turning, ARM).T, strict=True):
            np.testing.assert_allclose(at[name], origin[name] + added, rtol=1e-12, atol=1e-13)
    np.testing.assert_array_equal(at["p"], origin["p"])


def test_the_acceleration_of_an_accelerometer(coupled_track):
    """a + omega_dot x l + omega x (omega x l) of the point is udot_s + omega x v_s, with all of the point."""
    track = coupled_track.resampled(np.arange(1.0, 49.0))
    states, rates = track.states[0], track.accelerations[0]
    at = readings(coupled_track, ARM)
    velocity = np.stack([at["u"], at["v_ground"], at["w"]], axis=-1)
    change = np.stack([at["udot"], at["vdot"], at["wdot"]], axis=-1)
    omega = states[:, 9:]
    of_origin = rates[:, :3] + np.cross(omega, states[:, 6:9])
    inertial = of_origin + np.cross(rates[:, 3:], ARM) + np.cross(omega, np.cross(omega, ARM))
    np.testing.assert_allclose(change + np.cross(omega, velocity), inertial, rtol=1e-11, atol=1e-12)


def test_velocity_is_the_rate_of_change_of_position(coupled_track):
    """Central differences of the position of the sensor, turned into body axes."""
    h, t = 1e-3, np.arange(2.0, 46.0, 5.0)
    sensors = [Sensor(c, 0.1, times=tuple(np.sort([*(t - h), *t, *(t + h)])), lever_arm_m=ARM) for c in COLUMNS[:6]]
    record = {c.name: c.values.reshape(-1, 3) for c in bs.observe(coupled_track, sensors, None).channels}
    moving = np.stack([(record[n][:, 2] - record[n][:, 0]) / (2 * h) for n in ("x", "y", "depth")], axis=-1)
    attitude = coupled_track.resampled(t).states[0, :, [5, 4, 3]].T
    velocity = Rotation.from_euler("ZYX", attitude).inv().apply(moving)
    # Round-off of positions, 1e-13 m, over 2 h, and h^2 times the third derivative: 1e-9 m/s was seen.
    for name, expected in zip(("u", "v_ground", "w"), velocity.T, strict=True):
        np.testing.assert_allclose(record[name][:, 1], expected, atol=1e-7)


def test_predictions_and_exact_derivatives(full, coupled, coupled_track, rng):
    """The problem reads what the sensors read, with a current too, and its Jacobian agrees with differences."""
    sensors = [Sensor(column, 0.1, interval_s=4.0, lever_arm_m=ARM) for column in COLUMNS]
    current = (0.4, -0.3)
    record = bs.observe(coupled_track, sensors, None, current_mps=current)
    nuisance = {"current_north_mps": normal(0.0, 0.5), "current_east_mps": normal(0.0, 0.5), "roll0_deg": normal(0, 3)}
    free = ("Xuu", "Yuv", "Nuv", "Kup", "Muw")
    problem = bs.Problem(full, coupled, record, free=free, prior=relative_normal(0.2), nuisance=nuisance, dt=0.25)
    np.testing.assert_allclose(problem.predicted(problem.reference)[0], record_values(record), atol=1e-9)
    at = problem.prior.mean + 0.3 * problem.prior.sd * rng.standard_normal(problem.n_params)
    jacobian = problem.jacobian(at)
    for k, step in enumerate(1e-4 * problem.prior.sd):
        shift = step * np.eye(problem.n_params)[k]
        ends = problem.residuals(np.array([at - shift, at + shift]))
        difference = (ends[1] - ends[0]) / (2 * step)
        np.testing.assert_allclose(jacobian[:, k], difference, atol=1e-5 * np.abs(difference).max())


def record_values(record):
    return np.concatenate([channel.values for channel in record.channels])


def test_bad_lever_arms_are_refused():
    with refused("value", "lever_arm_m"):
        Sensor("x_m", 0.1, lever_arm_m=(1.0, np.nan, 0.0))
    with refused("value", "clock_offset_s"):
        Sensor("x_m", 0.1, clock_offset_s=np.inf)
