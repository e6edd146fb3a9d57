"""Columns of a log against each other: every kind of damage is named, and nothing is said of a clean log."""

import numpy as np
import pytest

import bayesub as bs
from bayesub.checks import logs
from bayesub.io import log_files, toml_files
from bayesub.sensors import ADCP, DVL, INS, Compass, Pressure, Sensor, Track

DEGREE, KNOT = np.pi / 180.0, 1852.0 / 3600.0
INSTRUMENTS = {
    "navigator": [
        Track(0.2, 0.1, 1.0),
        ADCP(sd_mps=0.02, interval_s=2.0),
        DVL(sd_mps=0.01, resolution_mps=0.01),
        INS(sd_degps=0.05, channels=("p", "q", "r"), interval_s=0.5),
        Compass(sd_deg=0.5, resolution_deg=1.0),
        Pressure(sd_m=0.1),
    ],
    "small": [
        Sensor("x_m", 1.0),
        Sensor("y_m", 1.0),
        Compass(sd_deg=1.0, resolution_deg=0.1, interval_s=0.5),
        INS(sd_deg=0.5, sd_degps=0.2, interval_s=0.2, channels=("roll", "pitch", "p", "q", "r")),
        Pressure(sd_m=0.05, resolution_m=0.01),
    ],
    "autosub": bs.sensors.autosub(),
    "range": bs.sensors.tracking_range(),
}
TRIALS = [
    ("auv690", "random"),
    ("suboff", "coupled"),
    ("suboff", "vertical"),
    ("remus100", "turning_circle"),
    ("mariner", "zigzag_20_20"),
    ("npsauv", "horizontal"),
]


def flown(vehicle, manoeuvre):
    boat = bs.load_vehicle(vehicle)
    return bs.simulate(boat, bs.load_manoeuvre(manoeuvre, boat))


def log_of(trajectory, instruments, folder):
    """The log of a simulated trial in a current, through a file."""
    speed = trajectory.simulator.vehicle.speed_mps
    rng = np.random.default_rng(1)
    record = bs.observe(trajectory, instruments, rng, current_mps=(0.1 * speed, -0.05 * speed))
    record.save(folder / "log.csv", trajectory.simulator.manoeuvre)
    return log_files.read_log(folder / "log.csv")


def lines(log):
    return [finding.line() for finding in logs.findings(log, {name: log_files.HEADERS[name] for name in log})]


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    """The log of a navigator on a boat with random orders to rudder and planes."""
    return log_of(flown("auv690", "random"), INSTRUMENTS["navigator"], tmp_path_factory.mktemp("clean"))


@pytest.mark.parametrize(("vehicle", "manoeuvre"), TRIALS)
def test_nothing_is_said_of_clean_logs(vehicle, manoeuvre, tmp_path):
    trajectory = flown(vehicle, manoeuvre)
    for instruments in INSTRUMENTS.values():
        assert lines(log_of(trajectory, instruments, tmp_path)) == []
    trajectory.save(tmp_path / "track.csv")
    assert lines(log_files.read_log(tmp_path / "track.csv")) == []


def scaled(*names, by):
    return lambda log: {name: by * log[name] for name in names}


def exchanged(one, other):
    return lambda log: {one: log[other], other: log[one]}


def along_north_and_east(suffix):
    def damage(log):
        cells = np.isfinite(log["psi"])
        psi = np.interp(log["time"], log["time"][cells], log["psi"][cells])
        u, v = log[f"u{suffix}"], log[f"v{suffix}"]
        return {f"u{suffix}": u * np.cos(psi) - v * np.sin(psi), f"v{suffix}": u * np.sin(psi) + v * np.cos(psi)}

    return damage


KINEMATICS = {
    "yaw rate to port": (scaled("r", by=-1.0), "r_degps: of the other sign", "multiply it by -1"),
    "pitch rate": (scaled("q", by=-1.0), "q_degps: of the other sign", "multiply it by -1"),
    "roll": (scaled("phi", by=-1.0), "roll_deg: of the other sign", "multiply it by -1"),
    "one gyro in rad/s": (scaled("r", by=DEGREE), "r_degps: in radians", "rename it r_radps"),
    "gyros in rad/s": (scaled("p", "q", "r", by=DEGREE), "p_degps, q_degps, r_degps: in radians", "p_radps, q_radps"),
    "pitch in rad": (scaled("theta", by=DEGREE), "pitch_deg: in radians", "rename it pitch_rad"),
    "yaw in rad": (lambda log: {"psi": DEGREE * log["psi"]}, "yaw_deg: in radians", "rename it yaw_rad"),
    "knots": (scaled("u", "v", "w", by=1 / KNOT), "u_mps, v_mps, w_mps: in knots", "rename them u_kn, v_kn, w_kn"),
    "knots over ground": (
        scaled("u_ground", "v_ground", "w_ground", by=1 / KNOT),
        "u_ground_mps, v_ground_mps, w_ground_mps: in knots",
        "u_ground_kn, v_ground_kn",
    ),
    "earth axes": (
        along_north_and_east("_ground"),
        "u_ground_mps, v_ground_mps: velocities to north and east",
        "velocity_north_mps, velocity_east_mps",
    ),
    "v to port": (scaled("v_ground", by=-1.0), "v_ground_mps: of the other sign", "multiply it by -1"),
    "w up": (scaled("w_ground", by=-1.0), "w_ground_mps: of the other sign", "multiply it by -1"),
    "u and v": (exchanged("u_ground", "v_ground"), "u_ground_mps, v_ground_mps: u_ground_mps holds", "exchange"),
    "x and y": (exchanged("x", "y"), "x_m, y_m: x_m holds what y_m should", "exchange the two names"),
    "p and r": (exchanged("p", "r"), "p_degps, r_degps: p_degps holds what r_degps should", "exchange the two names"),
    "q and r": (exchanged("q", "r"), "q_degps, r_degps: q_degps holds what r_degps should", "exchange the two names"),
    "yaw to port": (scaled("psi", by=-1.0), "yaw_deg: counted anticlockwise", "multiply it by -1"),
    "yaw from east": (
        lambda log: {"psi": np.pi / 2 - log["psi"]},
        "yaw_deg: counted anticlockwise from east",
        "90 - yaw_deg",
    ),
    "yaw astern": (lambda log: {"psi": np.pi + log["psi"]}, "yaw_deg: off by half a turn", "add 180 to it"),
    "y to the west": (scaled("y", by=-1.0), "y_m: of the other sign", "multiply it by -1"),
    "z up": (scaled("z", by=-1.0), "z_m: of the other sign", "multiply it by -1"),
    "depth negative": (scaled("depth", by=-1.0), "depth_m: of the other sign", "multiply it by -1"),
    "milliseconds": (scaled("time", by=1000.0), "time_s: in ms", "multiply it by 0.001"),
    "rudder to starboard": (
        scaled("delta_r", by=-1.0),
        "rudder_deg: positive turns the boat to starboard",
        "sign = -1",
    ),
    "planes the other way": (
        scaled("delta_s", by=-1.0),
        "stern_plane_deg: positive turns the boat nose up",
        "sign = -1",
    ),
    "rudder in rad": (scaled("delta_r", by=DEGREE), "rudder_deg: in radians", "rename it rudder_rad"),
}


@pytest.mark.parametrize("kind", KINEMATICS)
def test_a_column_that_holds_something_else_is_named(clean, kind):
    damage, beginning, remedy = KINEMATICS[kind]
    (line,) = lines(clean | damage(clean))
    assert line.startswith(beginning)
    assert remedy in line


def test_a_heading_of_any_range_is_right(clean):
    turned = np.where(np.isfinite(clean["psi"]), np.mod(clean["psi"], 2 * np.pi), np.nan)
    assert lines(clean | {"psi": turned, "heading": clean["heading"] + 6 * np.pi}) == []


def test_a_missing_name_is_given_to_the_column_that_holds_it(clean):
    """The yaw rate under the name of the roll rate, as in the catalogue of a tanker's trials."""
    log = {name: values for name, values in clean.items() if name not in ("p", "q", "r", "phi")}
    (line,) = lines(log | {"p": clean["r"]})
    assert line.startswith("p_degps: the rate of yaw")
    assert "rename it r_degps" in line


def test_two_faults_are_two_findings(clean):
    damaged = clean | exchanged("p", "r")(clean) | along_north_and_east("_ground")(clean)
    assert sorted(line.partition(":")[0] for line in lines(damaged)) == [
        "p_degps, r_degps",
        "u_ground_mps, v_ground_mps",
    ]


def test_heading_against_course_without_velocities(clean):
    log = {name: clean[name] for name in ("time", "x", "y", "psi", "delta_r")}
    assert lines(log) == []
    (line,) = lines(log | {"psi": np.pi / 2 - clean["psi"]})
    assert line.startswith("yaw_deg: counted anticlockwise from east: directions of the track and the heading")


def over_ground(log):
    """The columns of a satellite receiver by the navigator's own track."""
    cells = np.isfinite(log["x"]) & np.isfinite(log["y"])
    times = log["time"][cells]
    north, east = (np.gradient(log[name][cells], times) for name in "xy")
    columns = {"sog": np.hypot(north, east), "cog": np.arctan2(east, north), "north": north, "east": east}
    result = {name: log[name] for name in ("time", "x", "y", "psi", "delta_r")}
    for name, values in columns.items():
        result[name] = np.full(len(cells), np.nan)
        result[name][cells] = values
    return result


@pytest.mark.parametrize(
    ("damage", "beginning"),
    [
        (scaled("sog", by=1 / KNOT), "speed_over_ground_mps: in knots"),
        (scaled("north", "east", by=3.6), "velocity_north_mps, velocity_east_mps: in km/h"),
        (exchanged("north", "east"), "velocity_north_mps, velocity_east_mps: velocity_north_mps holds what"),
        (lambda log: {"cog": np.pi / 2 - log["cog"]}, "course_over_ground_deg: counted anticlockwise from east"),
        (lambda log: {"cog": DEGREE * np.mod(log["cog"], 2 * np.pi)}, "course_over_ground_deg: in radians"),
    ],
)
def test_velocities_over_ground(clean, damage, beginning):
    log = over_ground(clean)
    assert lines(log) == []
    (line,) = lines(log | damage(log))
    assert line.startswith(beginning)


def test_a_boat_goes_ahead(clean):
    """Without a track, velocities through the water are told from each other by their size; a rudder by its reach."""
    log = {name: clean[name] for name in ("time", "u", "v", "r", "delta_r")}
    assert lines(log) == []
    (line,) = lines(log | exchanged("u", "v")(log))
    assert line.startswith("u_mps, v_mps: u_mps holds what v_mps should: ahead")
    (line,) = lines(log | scaled("delta_r", by=1 / DEGREE)(log))
    assert line.startswith("rudder_deg: in another unit: it reaches")


def test_units_by_the_jump_of_a_heading_alone():
    """400 gon, 6400 mils and 2 pi are seen without any other column; a half turn of noise about north is not."""
    times = np.arange(0.0, 400.0)
    turns = np.mod(times / 90.0, 1.0)
    rudder = {"delta_r": np.full_like(times, 0.1)}
    for full, words in ((400.0, "in gon"), (6400.0, "in mils"), (2 * np.pi, "in radians")):
        (line,) = lines({"time": times, "heading": DEGREE * full * turns} | rudder)
        assert line.startswith(f"heading_deg: {words}: it jumps by")
    assert lines({"time": times, "heading": DEGREE * 360.0 * turns} | rudder) == []


def test_headings_averaged_across_north():
    times = np.arange(0.0, 400.0)
    heading = np.mod(0.5 + times / 90.0, 1.0) * 2 * np.pi
    before = int(np.flatnonzero(np.diff(heading) < -3.0)[1])
    heading[before] = 0.5 * (heading[before - 1] + heading[before + 1])
    (line,) = lines({"time": times, "heading": heading})
    assert line.startswith("heading_deg: averaged across its wrap, 17")
    assert "(1 readings)" in line


def test_stamps_that_repeat_go_back_or_have_too_few_digits(clean):
    times = clean["time"]
    repeated = np.array(times)
    repeated[100] = repeated[99]
    (line,) = lines(clean | {"time": repeated})
    assert line.startswith(f"time_s: 1 of {len(times)} rows repeat the stamp of the row before, first at")

    back = np.where(np.arange(len(times)) < 3000, times, times - 50.0)
    (line,) = lines(clean | {"time": back})
    assert "time_s: goes back from" in line
    assert "add 50 to the rows after it" in line or "add 50." in line or "add 49.9" in line

    (line,) = lines(clean | {"time": np.round(times)})
    assert "too few digits; space the rows evenly" in line

    order = np.random.default_rng(0).permutation(len(times))
    (line,) = lines({name: values[order] for name, values in clean.items()})
    assert "sort the rows by it" in line


def test_a_jump_of_the_clock_is_not_a_gap(clean):
    """Where rows are missing the boat has moved on; where the clock jumped it has not."""
    times = clean["time"]
    jump = np.where(times < 80.0, times, times + 40.0)
    (line,) = lines(clean | {"time": jump})
    assert line.startswith("time_s: jumps from 79.")
    assert "subtract 39" in line or "subtract 40" in line
    rest = (times < 80.0) | (times > 120.0)
    assert lines({name: values[rest] for name, values in clean.items()}) == []


@pytest.mark.parametrize("name", ["u_ground", "depth", "r", "heading"])
def test_a_column_that_stands_still_is_named(clean, name):
    cells = np.flatnonzero(np.isfinite(clean[name]))
    values = clean[name].copy()
    values[cells[60:110]] = values[cells[60]]
    (line,) = lines(clean | {name: values})
    assert line.startswith(f"{log_files.HEADERS[name]}: stands still for 5")
    assert line.endswith("empty these cells")


def test_a_boat_that_turns_back_in_a_gap_is_no_jump_of_the_clock():
    """A glider at the surface: it comes up, says nothing for three minutes, and goes down."""
    times = np.concatenate([np.arange(0.0, 400.0), np.arange(590.0, 900.0)])
    depth = np.where(times < 400.0, 0.1 * (400.0 - times), 0.1 * (times - 590.0))
    assert lines({"time": times, "depth": depth}) == []


def test_nothing_is_said_of_the_log_of_the_glider(bayesub):
    """Between its parts it lies at the surface for three minutes."""
    log = toml_files.find_log("slocum_comet")
    status, out, _ = bayesub("check", "slocum_comet", log)
    assert (status, out.splitlines()[-1]) == (0, "no column contradicts another")


def test_radians_are_likelier_than_minutes(clean):
    """By pitch, speed and depth alone they differ by a twentieth."""
    log = {name: clean[name] for name in ("time", "theta", "depth", "u_ground")}
    (line,) = lines(log | {"theta": DEGREE * clean["theta"]})
    assert line.startswith("pitch_deg: in radians")


def test_the_command_says_it(bayesub, clean, tmp_path):
    log_files.write_log(tmp_path / "log.csv", clean)
    status, out, _ = bayesub("check", tmp_path / "log.csv")
    assert status == 0
    assert out.splitlines()[1:] == ["no column contradicts another"]
    log_files.write_log(tmp_path / "log.csv", clean | scaled("r", by=-1.0)(clean))
    status, out, _ = bayesub("check", tmp_path / "log.csv")
    assert out.splitlines()[1].startswith("r_degps: of the other sign")
    status, out, _ = bayesub("check", tmp_path / "log.csv", "--json")
    assert '"remedy": "multiply it by -1"' in out
