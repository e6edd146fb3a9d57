"""Logs as trials of a study: from a record in memory to a file and back to a problem."""

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.inference.baselines import gauss_newton
from bayesub.io import toml_files
from bayesub.logs import log_files
from bayesub.problem.priors import normal, relative_normal
from bayesub.sensors import Sensor, modified
from bayesub.study.schema import trial_log
from bayesub.study.schema.trial_log import read_trial

FREE = ("Xuu", "Yuv", "Yuu_dr", "Nuv", "Nuu_dr", "Nur")
KNOWN = {"x0_m": 0.0, "y0_m": 0.0, "yaw0_deg": 0.0, "u0_mps": 7.5, "v0_mps": 0.0, "r0_degps": 0.0}
INSTRUMENTS = [
    modified(bs.sensors.DVL(0.01, channels=("u_ground", "v_ground")), lever_arm_m=(-30.0, 0.0, 4.0), dropout=0.1),
    modified(bs.sensors.Track(0.5, 0.1, 4.0, ("x", "y", "yaw")), clock_offset_s=0.75, gaps=((100.0, 150.0),)),
    Sensor("r_degps", 0.02, interval_s=0.7),
]


def problem_of(vehicle, manoeuvre, record, nuisance=None):
    options = {"free": FREE, "prior": relative_normal(0.2), "nuisance": nuisance, "dt": 1.0}
    return bs.Problem(vehicle, manoeuvre, record, **options)


@pytest.fixture(scope="module")
def flight(suboff):
    """A track and the controls that it was flown with, a row a second."""
    return bs.simulate(suboff, bs.load_manoeuvre("horizontal", suboff), dt=1.0, sample=1.0)


@pytest.fixture
def rewritten(tmp_path, flight, rng):
    """rewritten(change): a log of the flight, after `change` of its columns."""

    def write(change=dict):
        record = bs.observe(flight, INSTRUMENTS, rng)
        record.save(tmp_path / "log.csv", flight)
        log = log_files.read_log(tmp_path / "log.csv")
        change(log)
        log_files.write_log(tmp_path / "log.csv", log)
        return tmp_path / "log.csv"

    return write


def test_a_log_gives_the_posterior_of_the_record_that_it_was_written_from(tmp_path, suboff, spiral, flight, rng):
    """With the start known, lever arms, clocks, dropouts and gaps included: the same density to digits of the file."""
    record = bs.observe(flight, INSTRUMENTS, rng)
    record.save(tmp_path / "log.csv", spiral)
    log = log_files.read_log(tmp_path / "log.csv")
    log["time"] += 1000.0  # a log has a clock of its own
    log_files.write_log(tmp_path / "log.csv", log)
    trial = read_trial(tmp_path / "log.csv", suboff, INSTRUMENTS, subproblem="horizontal", nuisance=KNOWN)
    assert trial.nuisance == {}
    assert trial.n_left_out == 0
    memory, file = problem_of(suboff, spiral, record), problem_of(suboff, trial.manoeuvre, trial.record)
    parameters = memory.prior.mean * (1 + 0.1 * rng.standard_normal((5, len(FREE))))
    # Times to 1e-9 s at up to a metre in each tenth of a second, over sds of half a metre, times 1e4 sds.
    np.testing.assert_allclose(file.log_prob(parameters), memory.log_prob(parameters), rtol=1e-7)


def test_clock_and_place_of_a_log_are_inferred(rewritten, suboff):
    """Of sensors whose file says neither; the start is as uncertain as both make it."""
    sensors = [modified(part, clock_offset_s=0.0, lever_arm_m=(0.0, 0.0, 0.0)) for part in INSTRUMENTS]
    unknown = {"clock_track_s": normal(0.5, 0.5), "lever_dvl_x_m": normal(-20.0, 20.0)}
    path = rewritten()
    trial = read_trial(path, suboff, sensors, subproblem="horizontal", nuisance=unknown)
    without = read_trial(path, suboff, sensors, subproblem="horizontal")
    # About 7.5 m/s times half a second, and the arm times a tenth of a radian in a ship length travelled.
    assert trial.nuisance["x0_m"].sd > np.hypot(without.nuisance["x0_m"].sd, 0.5 * 7.5)
    turn = 20.0 * trial_log.UNREAD_TURN * suboff.speed_mps / suboff.length_m
    assert trial.nuisance["v0_mps"].sd > np.hypot(without.nuisance["v0_mps"].sd, turn)
    problem = problem_of(suboff, trial.manoeuvre, trial.record, trial.nuisance)
    fit = gauss_newton(problem)
    n = len(problem.readings)
    assert fit.costs[0] < n + 4 * np.sqrt(2 * n)
    values, sds = (dict(zip(fit.names, x, strict=True)) for x in (fit.values, np.sqrt(np.diag(fit.covariance))))
    for name, truth in (("clock_track_s", 0.75), ("lever_dvl_x_m", -30.0)):
        assert abs(values[name] - truth) < 4 * sds[name], name
        assert sds[name] < 0.2 * unknown[name].sd[0], name


def test_a_clock_offset_recovers_the_times(rewritten, suboff):
    """Readings stamped by a fast clock are where they were; of all sensors as of one."""
    sensors = [modified(part, clock_offset_s=0.75) for part in INSTRUMENTS]
    path = rewritten()
    own = read_trial(path, suboff, INSTRUMENTS, subproblem="horizontal")
    late = read_trial(path, suboff, sensors, subproblem="horizontal")
    for channel, other in zip(own.record.channels, late.record.channels, strict=True):
        stamped = channel.times + channel.clock_offset_s
        np.testing.assert_allclose(other.times, stamped[stamped >= 0.75] - 0.75, atol=1e-9)
    assert own.n_left_out == 0
    assert late.n_left_out == 1  # r at 0.7 s, before the first control by this clock
    np.testing.assert_allclose(own.record.channels[2].times % 4.0, 0.0, atol=1e-9)


def test_the_start_is_unknown_and_its_prior_holds_the_truth(rewritten, suboff):
    """Every state that the readings depend on, also that nobody read; wider than the readings alone would have it."""
    trial = read_trial(rewritten(), suboff, INSTRUMENTS, subproblem="horizontal")
    assert list(trial.nuisance) == list(KNOWN)
    for name, prior in trial.nuisance.items():
        assert abs(prior.mean[0] - KNOWN[name]) < 3 * prior.sd[0]
    read = problem_of(suboff, trial.manoeuvre, trial.record, trial.nuisance)
    information = read.jacobian(read.prior.mean)
    sds = np.sqrt(np.diag(np.linalg.inv(information.T @ information + np.diag(read.prior.sd**-2.0))))
    assert np.all(sds[len(FREE) :] < 0.5 * read.prior.sd[len(FREE) :])  # the data rule, not the prior made of them
    given = read_trial(rewritten(), suboff, INSTRUMENTS, subproblem="horizontal", nuisance={"u0_mps": normal(7.4, 0.2)})
    assert given.nuisance["u0_mps"].sd[0] == 0.2
    assert given.manoeuvre.initial_state[6] == 7.4


def test_a_line_through_the_first_readings_is_where_the_start_is():
    """Of exact readings on a line it is the line; its error grows with the time before the first."""
    times = np.array([2.0, 3.0, 4.0, 5.0])
    channel = bs.sensors.Channel("u", times, 7.0 - 0.1 * times, sd=0.05)
    value, sd, slope = trial_log._at_zero(channel, 10.0)
    assert slope == pytest.approx(-0.1)
    assert value == pytest.approx(7.0)
    # Standard error of an intercept: sd sqrt(1/n + mean^2 / sum of squares), besides 2 s of slope.
    assert sd == pytest.approx(np.hypot(0.05 * np.sqrt(1 / 4 + 3.5**2 / 5.0), 0.2))


def test_controls_have_times_of_their_own_and_are_joined_by_lines(tmp_path, suboff):
    """Cells of rudder and rpm in different rows; the trial is where both are given."""
    nan = np.nan
    log = {"time": np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0]), "delta_r": np.array([nan, 0.0, nan, 0.2, nan, 0.4])}
    log |= {"rpm": np.array([90.0, nan, 80.0, nan, 60.0, nan]), "u": np.full(6, 7.0)}
    log_files.write_log(tmp_path / "log.csv", log)
    trial = read_trial(tmp_path / "log.csv", suboff, Sensor("u_mps", 0.1))
    np.testing.assert_allclose(trial.manoeuvre.times, [0, 1, 2, 3])
    np.testing.assert_allclose(trial.manoeuvre.controls[:, 0], [0.0, 0.1, 0.2, 0.3])
    np.testing.assert_allclose(trial.manoeuvre.rpm, [85.0, 80.0, 70.0, 60.0])
    assert trial.n_left_out == 2


def blank(name, low, high):
    def change(log):
        log[name][(log["time"] > low) & (log["time"] < high)] = np.nan

    return change


REFUSED = [
    (blank("delta_r", 60, 90), {}, "data", "rudder_deg"),
    (blank("delta_r", -1, 1000), {}, "data", "rudder_deg"),
    (
        lambda log: [log.pop(n) for n in (*log_files.CONTROLS, "rpm")],
        {},
        "missing",
        "rudder_deg, bow_plane_deg, stern_plane_deg, rpm",
    ),
    (blank("u_ground", -1, 1000), {}, "data", "u_ground_mps"),
    (lambda log: log.update(z=log["x"]), {}, "conflict", "z_m"),
    (dict, {"ignore": ("z_m",)}, "unknown", "z_m"),
    (dict, {"nuisance": {"z0_m": 1.0}}, "conflict", "nuisance.z0_m"),
    (lambda log: log.pop("r"), {}, "missing", "r_degps"),
]


@pytest.mark.parametrize(("change", "options", "kind", "key"), REFUSED)
def test_logs_that_do_not_fit(rewritten, suboff, change, options, kind, key):
    """Refused in one line that names the file or key, and the remedy."""
    with refused(kind, key):
        read_trial(rewritten(change), suboff, INSTRUMENTS, subproblem="horizontal", **options)


def test_a_gap_that_was_flown_straight_may_be_closed_and_a_column_ignored(rewritten, suboff):
    def change(log):
        blank("delta_r", 60, 90)(log)
        log["z"] = log["x"]

    options = {"subproblem": "horizontal", "max_control_gap_s": 31.0, "ignore": ("z_m",)}
    trial = read_trial(rewritten(change), suboff, INSTRUMENTS, **options)
    controls, times = trial.manoeuvre.controls[:, 0], trial.manoeuvre.times
    middle, ends = np.interp(75.0, times, controls), np.interp([60.0, 90.0], times, controls)
    assert middle == pytest.approx(ends.mean())


def test_channels_of_motion_that_a_plane_does_not_have(rewritten, suboff):
    path = rewritten(lambda log: log.update(depth=log["x"]))
    with refused("conflict", "depth_m"):
        read_trial(path, suboff, [*INSTRUMENTS, Sensor("depth_m", 0.1)], subproblem="horizontal")


def test_a_heading_that_nobody_read(tmp_path, suboff, flight, rng):
    bs.observe(flight, bs.sensors.Track(0.5, 0.1, channels=("x", "y")), rng).save(tmp_path / "log.csv", flight)
    with refused("missing", "nuisance.yaw0_deg"):
        read_trial(tmp_path / "log.csv", suboff, bs.sensors.Track(0.5, 0.1, channels=("x", "y")))


def test_a_boat_of_three_degrees_of_freedom_needs_no_plane(tmp_path):
    """Its log is one of the horizontal plane, without starts of depth, roll and pitch."""
    ship = bs.load_vehicle("mariner")
    path = tmp_path / "log.csv"
    rows = "".join(f"{k},{k % 3},{7.7 * k},0\n" for k in range(120))
    path.write_text("time_s,rudder_deg,x_m,y_m\n" + rows)
    sensors, heading = [bs.sensors.Track(1.0, 0.1, channels=("x", "y"))], {"yaw0_deg": normal(0.0, 1.0)}
    trial = read_trial(path, ship, sensors, nuisance=heading)
    assert trial.manoeuvre.subproblem == "horizontal"
    assert set(trial.nuisance) == {"x0_m", "y0_m", "yaw0_deg", "u0_mps", "v0_mps", "r0_degps"}


def test_revolutions_that_do_not_push_are_no_control(tmp_path):
    """Thrust is in the terms of the ship's equations: a log may have its rpm, which say nothing of its speed."""
    ship = bs.load_vehicle("mariner")
    path = tmp_path / "log.csv"
    rows = "".join(f"{k},{k % 3},80,{7.7 * k},0\n" for k in range(120))
    path.write_text("time_s,rudder_deg,rpm,x_m,y_m\n" + rows)
    sensors, heading = [bs.sensors.Track(1.0, 0.1, channels=("x", "y"))], {"yaw0_deg": normal(0.0, 1.0)}
    trial = read_trial(path, ship, sensors, nuisance=heading)
    assert trial.nuisance["u0_mps"].mean[0] == pytest.approx(7.7, abs=0.2)
    path.write_text(path.read_text().replace("rudder_deg", "roll_deg"))
    with refused("missing", "rudder_deg"):
        read_trial(path, ship, sensors, nuisance=heading)


GLIDER_SENSORS = (bs.sensors.Sensor("depth_m", sd=0.15), bs.sensors.Sensor("pitch_deg", sd=0.1))


def test_prescribed_pitch_of_the_built_in_log():
    """A part of the log of the glider: its pitch is smoothed and no reading, its water moves the boat."""
    glider = bs.load_vehicle("slocum_comet")
    options = {"subproblem": "vertical", "ignore": ["u_mps"], "window_s": (1925.0, 2115.0)}
    trial = read_trial("slocum_comet", glider, GLIDER_SENSORS, prescribed=["pitch"], **options)
    assert [channel.name for channel in trial.record.channels] == ["depth"]
    assert set(trial.nuisance) == {"z0_m", "u0_mps", "w0_mps"}
    assert trial.manoeuvre.duration == pytest.approx(190.0, abs=2.0)
    (pitch,) = trial.manoeuvre.prescribed
    assert np.degrees(pitch.of(np.array([100.0])))[0] == pytest.approx(-22.0, abs=2.0)
    assert trial.manoeuvre.log["ballast_n"].mean() == pytest.approx(-230e-6 * 1005.0 * 9.81, rel=0.01)
    flown = read_trial("slocum_comet", glider, GLIDER_SENSORS, **options)
    assert {"pitch0_deg", "q0_degps"} < set(flown.nuisance)
    assert not flown.manoeuvre.prescribed


@pytest.mark.parametrize(
    ("options", "kind", "key"),
    [
        ({"prescribed": ["yaw"]}, "conflict", "yaw"),
        ({"prescribed": ["pitch"], "sensors": GLIDER_SENSORS[:1]}, "missing", "pitch_deg"),
        ({"prescribed": ["pitch"], "sensors": GLIDER_SENSORS[1:]}, "missing", "sensors"),
        ({"window_s": (1e6, 2e6)}, "data", "window_s"),
    ],
)
def test_prescribed_angles_and_windows_that_cannot_be(options, kind, key):
    """Each is one line that says what to give."""
    options = {"sensors": GLIDER_SENSORS, "window_s": (1925.0, 2115.0)} | options
    unread = {"depth_m", "pitch_deg"} - {sensor.column for sensor in options["sensors"]}
    ignored = ["u_mps", *unread]
    glider = bs.load_vehicle("slocum_comet")
    sensors = options.pop("sensors")
    with refused(kind, key):
        read_trial("slocum_comet", glider, sensors, subproblem="vertical", ignore=ignored, **options)


@pytest.mark.parametrize(
    ("column", "change", "kind", "header"),
    [
        ("rpm", lambda rpm: 0.0 * rpm, "data", "rpm"),
        ("rpm", lambda rpm: 50.0 * rpm, "unit", "rpm"),
        ("u_ground", lambda u: 100.0 * u, "unit", "u_ground_mps"),
        ("v_ground", lambda v: np.where(np.arange(len(v)) == 100, -90.0, v), "unit", "v_ground_mps"),
    ],
)
def test_what_this_boat_cannot_have_done_is_refused(rewritten, suboff, column, change, kind, header):
    """A propeller that never turns, and speeds of more than ten times that of the trial."""
    path = rewritten(lambda log: log.update({column: change(log[column])}))
    with refused(kind, header):
        read_trial(path, suboff, INSTRUMENTS, subproblem="horizontal")


def test_a_coast_down_is_a_trial(rewritten, suboff):
    """A propeller that stands still all the time is no error if the boat is seen to lose speed."""

    def stop(log):
        log["rpm"], log["u_ground"] = 0.0 * log["rpm"], log["u_ground"] / (1.0 + log["time"] / 60.0)

    read_trial(rewritten(stop), suboff, INSTRUMENTS, subproblem="horizontal")


def test_real_logs_are_possible():
    """Every log that comes with the package is read, and its boat can have done it."""
    for name in toml_files.built_in("logs"):
        boat = bs.load_vehicle(name)
        log = log_files.read_log(toml_files.find_log(name), boat.actuators.log_columns)
        boat.check_log(log, name)
        assert len(log["time"]) > 1000
