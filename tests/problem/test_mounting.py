"""Unknown clocks and lever arms of instruments: predictions, exact derivatives, calibration, and what no data tell."""

from dataclasses import replace

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.inference.baselines import gauss_newton, sqp, trust_region
from bayesub.problem.disturbances import UnknownDisturbance
from bayesub.problem.mounting import mounts
from bayesub.problem.priors import normal, relative_normal, uniform
from bayesub.sensors import DVL, GPS, INS, Compass, Sensor, modified
from disturbed.state_space import StateSpace

FREE = ("Xuu", "Yuv", "Nuv", "Nur", "Yuu_dr", "Nuu_dr")
GPS_CHANNELS = ("x", "y", "velocity_north", "speed_over_ground", "course_over_ground")
STEP = 0.2
INSTRUMENTS = (
    modified(
        GPS(sd_m=0.5, sd_mps=0.05, sd_deg=0.5, interval_s=2.0, channels=GPS_CHANNELS),
        clock_offset_s=0.4,
        lever_arm_m=(0.6, 0.1, -0.3),
    ),
    Compass(sd_deg=0.2, interval_s=3.0),
    modified(DVL(sd_mps=0.01, interval_s=2.5, channels=("u_ground", "v_ground")), clock_offset_s=-0.2),
    INS(sd_degps=0.05, sd_mps2=0.002, interval_s=2.0, channels=("r", "vdot")),
)
CLOCKS = {"clock_gps_s": normal(0.3, 0.3), "clock_dvl_s": normal(0.0, 0.3), "clock_ins_s": normal(0.0, 0.2)}
ARMS = {
    "lever_gps_x_m": normal(0.5, 0.2),
    "lever_gps_y_m": normal(0.0, 0.2),
    "lever_dvl_x_m": normal(0.0, 0.2),
    "lever_ins_x_m": normal(0.0, 0.2),
}
OTHERS = {
    "current_north_mps": normal(0.0, 0.2),
    "current_east_mps": normal(0.0, 0.2),
    "bias_heading_deg": normal(0.0, 1.0),
    "bias_rudder_deg": normal(0.0, 1.0),
    "scale_rudder": normal(1.0, 0.1),
    "scale_u_ground": normal(1.0, 0.02),
    "scale_speed_over_ground": normal(1.0, 0.02),
    "scale_vdot": normal(1.0, 0.05),
    "bias_u_ground_mps": normal(0.0, 0.01),
    "u0_mps": normal(1.5, 0.05),
}


@pytest.fixture(scope="module")
def circle(auv):
    return bs.load_manoeuvre("turning_circle", auv)


@pytest.fixture(scope="module")
def record(auv, circle):
    """Of the circle in a current, noise-free."""
    return bs.observe(bs.simulate(auv, circle, dt=0.02), INSTRUMENTS, None, current_mps=(0.1, -0.05))


def posed(auv, circle, record, nuisance, **options):
    prior = relative_normal(0.2)
    return bs.Problem(auv, circle, record, free=FREE, prior=prior, nuisance=nuisance, **{"dt": STEP} | options)


@pytest.fixture(scope="module")
def problem(auv, circle, record):
    return posed(auv, circle, record, CLOCKS | ARMS | OTHERS)


def differences_agree(problem, at, tolerance):
    """Derivatives against differences of fourth order, over the largest of each column."""
    jacobian = problem.jacobian(at)
    for k, step in enumerate(1e-3 * problem.prior.sd):
        offsets = step * np.eye(problem.n_params)[k] * np.array([[-2.0], [-1.0], [1.0], [2.0]])
        ends = problem.residuals(at + offsets)
        difference = (8 * (ends[2] - ends[1]) - (ends[3] - ends[0])) / (12 * step)
        scale = np.abs(difference).max()
        np.testing.assert_allclose(
            jacobian[:, k] / scale, difference / scale, rtol=0, atol=tolerance, err_msg=problem.names[k]
        )


def test_derivatives_with_currents_biases_and_actuators(problem, rng):
    """By clocks, places and all else; positions, velocities in both axes, course, rate and acceleration."""
    differences_agree(
        problem, problem.prior.mean + 0.3 * problem.prior.sd * rng.standard_normal(problem.n_params), 1e-9
    )


def test_derivatives_in_six_degrees_of_freedom(full, coupled, rng):
    """Place and time of instruments on a boat that rolls and pitches, in a current that varies."""
    columns = ("x_m", "y_m", "z_m", "u_ground_mps", "w_mps", "wdot_mps2", "velocity_down_mps", "course_over_ground_deg")
    sensors = [Sensor(column, 0.05, interval_s=4.0, instrument="one") for column in columns]
    record = bs.observe(bs.simulate(full, coupled, dt=0.25), sensors, None, current_mps=(0.4, -0.3))
    nuisance = {"clock_one_s": normal(0.1, 0.2)} | {f"lever_one_{axis}_m": normal(1.0, 0.5) for axis in "xyz"}
    varying = UnknownDisturbance(("north", "east"), {"north": 0.1, "east": 0.1}, 20.0)
    problem = bs.Problem(
        full, coupled, record, free=("Yuv", "Nur"), prior=relative_normal(0.2), nuisance=nuisance,
        disturbance=varying, dt=0.25,
    )  # fmt: skip
    at = problem.prior.mean + 0.3 * problem.prior.sd * rng.standard_normal(problem.n_params)
    differences_agree(problem, at, 1e-9)


def test_members_are_records_with_other_clocks_and_places(problem, auv, circle, record, rng):
    """A batch of different offsets and arms predicts what a problem without them does of records so changed."""
    known = dict.fromkeys(CLOCKS | ARMS)
    values = problem.prior.mean + problem.prior.sd * np.clip(rng.standard_normal((12, problem.n_params)), -2.0, 2.0)
    predicted = problem.predicted(values)
    others = [k for k, name in enumerate(problem.names) if name not in known]
    for member, found in zip(values, predicted, strict=True):
        at, channels = dict(zip(problem.names, member, strict=True)), []
        for channel in problem.record.channels:
            name = channel.instrument
            late = channel.clock_offset_s - at.get(f"clock_{name}_s", channel.clock_offset_s)
            arm = tuple(at.get(f"lever_{name}_{x}_m", part) for x, part in zip("xyz", channel.lever_arm_m, strict=True))
            channels.append(replace(channel, times=channel.times + late, lever_arm_m=arm))
        changed = posed(auv, circle, replace(record, channels=tuple(channels)), OTHERS)
        (expected,) = changed.predicted(member[others])
        scales = np.repeat(
            [max(1.0, np.abs(c.values).max()) for c in record.channels], [len(c.times) for c in channels]
        )
        np.testing.assert_allclose(found / scales, expected / scales, rtol=0, atol=1e-12)


def test_readings_that_a_clock_may_put_outside_the_trial_are_left_out(problem, record, circle):
    """So much as the prior allows but for one in ten thousand on either side; of known clocks none."""
    times = {channel.name: channel.times for channel in problem.record.channels}
    before = {channel.name: channel.times for channel in record.channels}
    np.testing.assert_array_equal(times["heading"], before["heading"])
    reach = 3.719 * 0.3
    later = (0.4 - 0.3 - reach, 0.4 - 0.3 + reach)
    kept = (before["x"] + later[0] >= 0.0) & (before["x"] + later[1] <= circle.duration)
    np.testing.assert_array_equal(times["x"], before["x"][kept])
    assert len(times["x"]) < len(before["x"])


def test_reference_is_what_the_sensors_of_the_truth_have(problem):
    values = dict(zip(problem.names, problem.reference, strict=True))
    assert (values["clock_gps_s"], values["clock_dvl_s"], values["clock_ins_s"]) == (0.4, -0.2, 0.0)
    assert (values["lever_gps_x_m"], values["lever_gps_y_m"], values["lever_dvl_x_m"]) == (0.6, 0.1, 0.0)
    readings, _ = problem.truth()
    np.testing.assert_allclose(readings, problem.readings, rtol=0, atol=2e-4)  # flown at another step, metres


@pytest.fixture(scope="module")
def trials(auv, circle):
    """trial(seed): a boat, clocks and places drawn from the prior, flown at a tenth of the step, and measured."""

    def trial(seed, nuisance):
        rng = np.random.default_rng(seed)
        xi, columns = auv.xi.copy(), auv.equations.columns(FREE)
        xi[columns] *= 1.0 + 0.05 * rng.standard_normal(len(columns))
        drawn = {name: float(prior.sample(rng, 1)[0, 0]) for name, prior in (CLOCKS | ARMS).items()}
        sensors = []
        for sensor in bs.sensors.flat(INSTRUMENTS):
            name, arm = sensor.instrument, sensor.lever_arm_m or (0.0, 0.0, 0.0)
            arm = tuple(drawn.get(f"lever_{name}_{x}_m", part) for x, part in zip("xyz", arm, strict=True))
            sensors.append(replace(sensor, clock_offset_s=drawn.get(f"clock_{name}_s", 0.0), lever_arm_m=arm))
        truth = bs.simulate(replace(auv, xi=xi), circle, dt=STEP / 10)
        record = bs.observe(truth, sensors, rng)
        if not nuisance:  # the times as they are stamped, and the places as somebody said
            said = [replace(c, times=c.times + c.clock_offset_s, lever_arm_m=(0.0, 0.0, 0.0)) for c in record.channels]
            said = [replace(c, times=np.clip(c.times, 0.0, circle.duration)) for c in said]
            record = replace(record, channels=tuple(said))
        prior = relative_normal(0.05, auv.xi)
        return bs.Problem(auv, circle, record, free=FREE, prior=prior, nuisance=nuisance, dt=STEP)

    return trial


@pytest.mark.slow
def test_errors_are_as_large_as_they_are_said_to_be(trials):
    """Over boats and offsets drawn from the prior, errors of the mode in posterior sds are standard normal."""
    errors = []
    for seed in range(12):
        fit = gauss_newton(problem := trials(seed, CLOCKS | ARMS))
        assert fit.statuses == ("converged",)
        factor = np.linalg.cholesky(np.linalg.inv(fit.covariance))
        errors.append(factor.T @ (fit.values - problem.reference))
    squares = np.square(errors)
    n = squares.size
    assert abs(squares.sum() - n) < 3.5 * np.sqrt(2.0 * n)
    assert np.abs(errors).max() < 4.5


def test_a_clock_that_is_not_inferred_is_read_as_coefficients(trials):
    """Negative control: with offsets of tenths of a second and arms of decimetres, errors are many sds."""
    fit = gauss_newton(problem := trials(3, {}))
    errors = (fit.values - problem.reference) / np.sqrt(np.diag(fit.covariance))
    assert np.sum(errors**2) > 100.0
    assert fit.costs[0] > len(problem.readings) + 10 * np.sqrt(2.0 * len(problem.readings))


def test_one_clock_for_all_is_a_delay_of_all_controls(auv, circle):
    """What no readings tell: all clocks ahead, the controls earlier, and a start so much further along.

    Within the accuracy of the integrator, where controls have kinks.
    """
    sensors = (*INSTRUMENTS[:1], INSTRUMENTS[3], replace(Sensor("heading_deg", 0.2, interval_s=3.0)))
    record = bs.observe(bs.simulate(auv, circle, dt=0.02), sensors, None)
    nuisance = {f"clock_{name}_s": normal(0.0, 0.3) for name in ("gps", "ins", "heading")}
    nuisance |= {"delay_rudder_s": normal(0.5, 0.2), "x0_m": normal(0.0, 1.0)}
    problem = posed(auv, circle, record, nuisance)
    at = problem.reference
    at[problem.names.index("delay_rudder_s")] = 0.5
    jacobian = problem.jacobian(at)
    speed = circle.initial_state[6]
    direction = {name: 1.0 for name in nuisance if name.startswith("clock")} | {"delay_rudder_s": -1.0, "x0_m": speed}
    vector = np.array([direction.get(name, 0.0) for name in problem.names])
    lengths = np.linalg.norm(jacobian, axis=0) * np.abs(vector)
    assert np.linalg.norm(jacobian @ vector) < 1e-3 * lengths.max()
    without = vector * [name != "delay_rudder_s" for name in problem.names]  # negative control
    assert np.linalg.norm(jacobian @ without) > 0.1 * lengths.max()


def test_a_fix_reads_a_clock_as_a_place(auv, circle):
    """A late fix is where the boat comes to in that time: a lever arm along its velocity, in body axes.

    Only changes of that velocity, and other channels of the instrument, tell the two apart.
    """
    fix = GPS(sd_m=1.0, interval_s=2.0)
    record = bs.observe(bs.simulate(auv, circle, dt=0.02), fix, None)
    nuisance = {"clock_gps_s": normal(0.0, 0.1), "lever_gps_x_m": normal(0.0, 1.0), "lever_gps_y_m": normal(0.0, 1.0)}
    problem = posed(auv, circle, record, nuisance)
    late, ahead, starboard = problem.jacobian(problem.reference).T[len(FREE) :]
    (states,) = problem.motion(problem.reference)
    u, v = np.tile(states[:, 6:8], (2, 1)).T
    np.testing.assert_allclose(late, -(u * ahead + v * starboard), rtol=0, atol=2e-3)  # m/s; fixes lie on steps


@pytest.mark.slow
def test_searches_find_them(trials):
    """SQP and trust-region least squares with the priors as readings end at clocks and places as a posterior mode does.

    Negative control: with clocks and places at their prior means the best fit is poor.
    """
    problem = trials(5, CLOCKS | ARMS)
    mode, plain = gauss_newton(problem), problem.searchable()
    assert plain.names == problem.names
    informed = [*CLOCKS, *ARMS]
    rng = np.random.default_rng(1)
    found = sqp(plain, rng=rng, informed=informed, n_starts=1)
    other = trust_region(plain, rng=rng, informed=informed, n_starts=1)
    n = len(problem.readings)
    assert other.costs[0] < n + 4 * np.sqrt(2.0 * n)
    np.testing.assert_allclose(found.costs[0], other.costs[0], rtol=1e-3)
    sds = np.sqrt(np.diag(mode.covariance))
    own = np.arange(len(FREE), problem.n_params)
    assert np.all(np.abs(other.values - mode.values)[own] < sds[own])
    np.testing.assert_array_less(other.covariance.diagonal()[own], problem.prior.sd[own] ** 2)
    held = trust_region(problem.naive(), rng=rng, n_starts=1)
    assert held.costs[0] > other.costs[0] + 200.0


def test_several_trials_share_places_and_not_clocks(auv, circle, record):
    one = posed(auv, circle, record, {"clock_gps_s": normal(0, 1), "lever_gps_x_m": normal(0, 1)})
    other = posed(auv, circle, record, {"clock_gps_s": normal(0, 1)})
    joint = bs.JointProblem({"a": one, "b": one, "c": other})
    assert joint.names[len(FREE) :] == ("clock_gps_s[a]", "lever_gps_x_m", "clock_gps_s[b]", "clock_gps_s[c]")
    assert joint.searchable().names == joint.names
    assert joint.jacobian(joint.prior.mean).shape == (3 * len(one.readings), len(joint.names))


def test_every_name(record):
    """A clock for every instrument, and a place for those whose readings depend on it."""
    assert [name for name in mounts(record.channels) if "gps" in name or "compass" in name or "ins" in name] == [
        "clock_gps_s", "lever_gps_x_m", "lever_gps_y_m", "lever_gps_z_m", "clock_compass_s",
        "clock_ins_s", "lever_ins_x_m", "lever_ins_y_m", "lever_ins_z_m",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("name", "kind", "key"),
    [
        ("clok_gps_s", "unknown", "clok_gps_s"),
        ("clock_gps", "unknown", "clock_gps"),
        ("clock_x_s", "unknown", "clock_x_s"),
        ("lever_compass_x_m", "unknown", "lever_compass_x_m"),
        ("lever_gps_w_m", "unknown", "lever_gps_w_m"),
        ("lever_gps_m", "unknown", "lever_gps_m"),
        ("lever_gps_z_m", "conflict", "lever_gps_z_m"),
        ("lever_ins_y_m", "conflict", "lever_ins_y_m"),
        ("lever_dvl_x_m\n", "unknown", "lever_dvl_x_m\n"),
    ],
)
def test_refused(auv, circle, record, name, kind, key):
    with refused(kind, key) as error:
        posed(auv, circle, record, {name: normal(0.0, 0.1)})
    assert "\n" not in str(error.value).replace(name, "")


def test_priors_that_leave_no_reading_are_refused(auv, circle, record):
    for prior in (normal(0.0, 1e6), uniform(-1e9, 0.0), normal(1e9, 1.0)):
        with refused("conflict", "clock_gps_s"):
            posed(auv, circle, record, {"clock_gps_s": prior})


def test_channels_of_one_instrument_have_one_place_and_one_clock(auv, circle):
    sensors = [modified(DVL(0.01), ["u_ground"], lever_arm_m=(1.0, 0.0, 0.0), clock_offset_s=0.1)]
    record = bs.observe(bs.simulate(auv, circle, dt=0.1), sensors, None)
    for name in ("clock_dvl_s", "lever_dvl_x_m"):
        with refused("conflict", name):
            posed(auv, circle, record, {name: normal(0.0, 0.1)})
    sensors = modified(sensors, ["u_ground"], instrument="bow")
    record = bs.observe(bs.simulate(auv, circle, dt=0.1), sensors, None)
    problem = posed(auv, circle, record, {"clock_bow_s": normal(0.0, 0.1), "lever_dvl_x_m": normal(0.0, 0.1)})
    assert problem.reference[-2:].tolist() == [0.1, 0.0]
    with refused("value", "instrument"):
        Sensor("u_mps", 0.1, instrument="the bow")


def test_the_filter_takes_known_ones(problem):
    with refused("conflict", "clock_gps_s"):
        StateSpace(problem)
