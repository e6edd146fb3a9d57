"""Velocity over the ground in inertial axes, speed and course over ground, and speed through the water."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.refusals import refused

import bayesub as bs
from bayesub.logs import log_files
from bayesub.problem.priors import normal, relative_normal
from bayesub.sensors import GPS, Record, Sensor, velocity

ARM = (1.3, -0.7, 2.1)
CURRENT = (0.4, -0.3)
OVER_GROUND = tuple(log_files.HEADERS[name] for name in velocity.OVER_GROUND)
STW = "speed_through_water_mps"
DIRECTION = (3.0, 0.0, -4.0)


@pytest.fixture(scope="module")
def track(full, coupled):
    return bs.simulate(full, coupled, dt=0.25)


def sensors(lever_arm=None, **options):
    options = {"lever_arm_m": lever_arm} | options
    return [*(Sensor(column, 0.1, **options) for column in OVER_GROUND), Sensor(STW, 0.1, **options)]


def readings(track, sensors, current=CURRENT):
    return {c.quantity: c.values for c in bs.observe(track, sensors, None, current_mps=current).channels}


@pytest.mark.parametrize("lever_arm", [None, ARM])
def test_what_the_instruments_read(track, lever_arm):
    """Body velocities at the sensor by SciPy's rotation, plus the current."""
    at = readings(track, [*sensors(lever_arm)])
    states = track.resampled(np.arange(1.0, 49.0)).states[0]
    body = states[:, 6:9] + np.cross(states[:, 9:], np.zeros(3) if lever_arm is None else ARM)
    through_water = Rotation.from_euler("ZYX", states[:, [5, 4, 3]]).apply(body)
    north, east, down = (through_water + np.array([*CURRENT, 0.0])).T
    np.testing.assert_allclose(at["north"], north, atol=1e-12)
    np.testing.assert_allclose(at["east"], east, atol=1e-12)
    np.testing.assert_allclose(at["down"], down, atol=1e-12)
    np.testing.assert_allclose(at["sog"], np.hypot(north, east), atol=1e-12)
    np.testing.assert_allclose(np.exp(1j * at["cog"]), (north + 1j * east) / np.hypot(north, east), atol=1e-12)
    np.testing.assert_allclose(at["stw"], np.hypot(*through_water[:, :2].T), atol=1e-12)
    (along,) = readings(track, [Sensor(STW, 0.1, lever_arm_m=lever_arm, direction=DIRECTION)]).values()
    np.testing.assert_allclose(along, body @ [0.6, 0.0, -0.8], atol=1e-12)


def test_velocity_over_ground_is_the_rate_of_change_of_position(track):
    h, t = 1e-3, np.arange(2.0, 46.0, 5.0)
    times = {"times": tuple(np.sort([*(t - h), *t, *(t + h)]))}
    columns = [Sensor(column, 0.1, lever_arm_m=ARM, **times) for column in ("x_m", "y_m", "z_m")]
    at = readings(track, [*columns, *sensors(ARM, **times)])
    for position, name in (("x", "north"), ("y", "east"), ("z", "down")):
        moved = at[position].reshape(-1, 3)
        np.testing.assert_allclose(at[name].reshape(-1, 3)[:, 1], (moved[:, 2] - moved[:, 0]) / (2 * h), atol=1e-7)


@pytest.mark.parametrize("current", [(0.0, 0.0), CURRENT])
@pytest.mark.parametrize("lever_arm", [None, ARM])
def test_predictions_and_exact_derivatives(full, coupled, track, rng, lever_arm, current):
    """By coefficients, by the start and by the current, in which speed and course are not linear."""
    instruments = sensors(lever_arm, interval_s=4.0)
    record = bs.observe(track, instruments, None, current_mps=current)
    nuisance = {"yaw0_deg": normal(0, 3), "roll0_deg": normal(0, 3)}
    if any(current):
        nuisance |= {"current_north_mps": normal(0.0, 0.5), "current_east_mps": normal(0.0, 0.5)}
    free = ("Xuu", "Yuv", "Nuv", "Kup", "Muw")
    problem = bs.Problem(full, coupled, record, free=free, prior=relative_normal(0.2), nuisance=nuisance, dt=0.25)
    np.testing.assert_allclose(problem.predicted(problem.reference)[0], record.values, atol=1e-9)
    differences_agree(problem, problem.prior.mean + 0.2 * problem.prior.sd * rng.standard_normal(problem.n_params))


def differences_agree(problem, at):
    jacobian = problem.jacobian(at)
    for k, step in enumerate(1e-4 * problem.prior.sd):
        shift = step * np.eye(problem.n_params)[k]
        ends = problem.residuals(np.array([at - shift, at + shift]))
        difference = (ends[1] - ends[0]) / (2 * step)
        scale = max(1e-12, np.abs(difference).max())
        np.testing.assert_allclose(jacobian[:, k] / scale, difference / scale, atol=2e-6, err_msg=problem.names[k])


def test_a_log_along_an_axis_has_exact_derivatives(full, coupled, track, rng):
    record = bs.observe(track, Sensor(STW, 0.1, interval_s=4.0, lever_arm_m=ARM, direction=DIRECTION), None)
    options = {"free": ("Yuv", "Nuv", "Zuw"), "prior": relative_normal(0.2), "dt": 0.25}
    problem = bs.Problem(full, coupled, record, **options)
    differences_agree(problem, problem.prior.mean + 0.2 * problem.prior.sd * rng.standard_normal(problem.n_params))


def test_a_course_is_compared_modulo_one_turn(tmp_path, suboff, spiral, spiral_track):
    """Readings of a receiver lie between 0 and 360 degrees; a spiral turns through north."""
    record = bs.observe(
        spiral_track,
        GPS(sd_mps=0.01, sd_deg=0.1, interval_s=5.0, channels=("speed_over_ground", "course_over_ground")),
        None,
    )
    sog, cog = record.channels
    assert np.ptp(cog.values) > 2 * np.pi
    record = Record((sog, replace(cog, values=np.mod(cog.values, 2 * np.pi))))
    record.save(tmp_path / "log.csv")
    record = Record.load(
        tmp_path / "log.csv", GPS(sd_mps=0.01, sd_deg=0.1, channels=("speed_over_ground", "course_over_ground"))
    )
    problem = bs.Problem(suboff, spiral, record, free=("Xuu",), prior=relative_normal(0.2), dt=0.5)
    assert np.abs(problem.residuals(problem.reference)).max() < 1e-6


def test_the_start_is_from_speed_and_course(tmp_path, suboff, spiral, spiral_track):
    """Without a compass or a log the boat starts about where a receiver says that it goes."""
    from bayesub.study.schema.trial_log import read_trial

    instruments = GPS(sd_m=1.0, sd_mps=0.05, sd_deg=1.0, channels=("x", "y", "speed_over_ground", "course_over_ground"))
    record = bs.observe(spiral_track, instruments, np.random.default_rng(0))
    record.save(tmp_path / "log.csv", spiral)
    trial = read_trial(tmp_path / "log.csv", suboff, instruments, subproblem="horizontal")
    assert abs(trial.nuisance["yaw0_deg"].mean[0]) < trial.nuisance["yaw0_deg"].sd[0] < 30.0
    speed = trial.nuisance["u0_mps"]
    assert abs(speed.mean[0] - suboff.speed_mps) < speed.sd[0] < 0.2 * suboff.speed_mps


@pytest.mark.parametrize(
    ("column", "direction", "kind", "key"),
    [
        ("speed_over_ground_mps", (1.0, 0.0, 0.0), "conflict", "direction"),
        (STW, (0.0, 0.0, 0.0), "value", "direction"),
        (STW, (1.0, np.nan, 0.0), "value", "direction"),
    ],
)
def test_directions_that_cannot_be(column, direction, kind, key):
    with refused(kind, key):
        Sensor(column, 0.1, direction=direction)
