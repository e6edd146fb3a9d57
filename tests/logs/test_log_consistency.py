"""Columns of a log against each other: every kind of damage is named, and nothing is said of a clean log."""

import numpy as np
import pytest
from support.refusals import told

import bayesub as bs
from bayesub.io import toml_files
from bayesub.logs import consistency, log_files
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


def findings(log):
    return consistency.findings(log, {name: log_files.HEADERS[name] for name in log})


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    """The log of a navigator on a boat with random orders to rudder and planes."""
    return log_of(flown("auv690", "random"), INSTRUMENTS["navigator"], tmp_path_factory.mktemp("clean"))


@pytest.mark.parametrize(("vehicle", "manoeuvre"), TRIALS)
def test_nothing_is_said_of_clean_logs(vehicle, manoeuvre, tmp_path):
    trajectory = flown(vehicle, manoeuvre)
    for instruments in INSTRUMENTS.values():
        assert findings(log_of(trajectory, instruments, tmp_path)) == []
    trajectory.save(tmp_path / "track.csv")
    assert findings(log_files.read_log(tmp_path / "track.csv")) == []


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


OVER_GROUND = ("u_ground_mps", "v_ground_mps", "w_ground_mps")
KINEMATICS = {
    "yaw rate to port": (scaled("r", by=-1.0), "sign", "r_degps"),
    "pitch rate": (scaled("q", by=-1.0), "sign", "q_degps"),
    "roll": (scaled("phi", by=-1.0), "sign", "roll_deg"),
    "one gyro in rad/s": (scaled("r", by=DEGREE), "unit", "r_degps"),
    "gyros in rad/s": (scaled("p", "q", "r", by=DEGREE), "unit", "p_degps", "q_degps", "r_degps"),
    "pitch in rad": (scaled("theta", by=DEGREE), "unit", "pitch_deg"),
    "yaw in rad": (lambda log: {"psi": DEGREE * log["psi"]}, "unit", "yaw_deg"),
    "knots": (scaled("u", "v", "w", by=1 / KNOT), "unit", "u_mps", "v_mps", "w_mps"),
    "knots over ground": (scaled("u_ground", "v_ground", "w_ground", by=1 / KNOT), "unit", *OVER_GROUND),
    "earth axes": (along_north_and_east("_ground"), "axes", *OVER_GROUND[:2]),
    "v to port": (scaled("v_ground", by=-1.0), "sign", "v_ground_mps"),
    "w up": (scaled("w_ground", by=-1.0), "sign", "w_ground_mps"),
    "u and v": (exchanged("u_ground", "v_ground"), "name", *OVER_GROUND[:2]),
    "x and y": (exchanged("x", "y"), "name", "x_m", "y_m"),
    "p and r": (exchanged("p", "r"), "name", "p_degps", "r_degps"),
    "q and r": (exchanged("q", "r"), "name", "q_degps", "r_degps"),
    "yaw to port": (scaled("psi", by=-1.0), "sign", "yaw_deg"),
    "yaw from east": (lambda log: {"psi": np.pi / 2 - log["psi"]}, "origin", "yaw_deg"),
    "yaw astern": (lambda log: {"psi": np.pi + log["psi"]}, "origin", "yaw_deg"),
    "y to the west": (scaled("y", by=-1.0), "sign", "y_m"),
    "z up": (scaled("z", by=-1.0), "sign", "z_m"),
    "depth negative": (scaled("depth", by=-1.0), "sign", "depth_m"),
    "milliseconds": (scaled("time", by=1000.0), "unit", "time_s"),
    "hours": (scaled("time", by=1.0 / 3600.0), "unit", "time_s"),
    "rudder to starboard": (scaled("delta_r", by=-1.0), "sign", "rudder_deg"),
    "planes the other way": (scaled("delta_s", by=-1.0), "sign", "stern_plane_deg"),
    "rudder in rad": (scaled("delta_r", by=DEGREE), "unit", "rudder_deg"),
}


@pytest.mark.parametrize("what", KINEMATICS)
def test_a_column_that_holds_something_else_is_named(clean, what):
    damage, kind, *columns = KINEMATICS[what]
    (finding,) = findings(clean | damage(clean))
    told(finding, kind, *columns)


def test_a_heading_of_any_range_is_right(clean):
    turned = np.where(np.isfinite(clean["psi"]), np.mod(clean["psi"], 2 * np.pi), np.nan)
    assert findings(clean | {"psi": turned, "heading": clean["heading"] + 6 * np.pi}) == []


def test_a_missing_name_is_given_to_the_column_that_holds_it(clean):
    """The yaw rate under the name of the roll rate, as in the catalogue of a tanker's trials."""
    log = {name: values for name, values in clean.items() if name not in ("p", "q", "r", "phi")}
    (finding,) = findings(log | {"p": clean["r"]})
    told(finding, "name", "p_degps")


def test_two_faults_are_two_findings(clean):
    damaged = clean | exchanged("p", "r")(clean) | along_north_and_east("_ground")(clean)
    first, second = sorted(findings(damaged), key=lambda finding: finding.columns)
    told(first, "name", "p_degps", "r_degps")
    told(second, "axes", "u_ground_mps", "v_ground_mps")


def test_heading_against_course_without_velocities(clean):
    log = {name: clean[name] for name in ("time", "x", "y", "psi", "delta_r")}
    assert findings(log) == []
    (finding,) = findings(log | {"psi": np.pi / 2 - clean["psi"]})
    told(finding, "origin", "yaw_deg")


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
    ("damage", "kind", "columns"),
    [
        (scaled("sog", by=1 / KNOT), "unit", ["speed_over_ground_mps"]),
        (scaled("north", "east", by=3.6), "unit", ["velocity_north_mps", "velocity_east_mps"]),
        (exchanged("north", "east"), "name", ["velocity_north_mps", "velocity_east_mps"]),
        (lambda log: {"cog": np.pi / 2 - log["cog"]}, "origin", ["course_over_ground_deg"]),
        (lambda log: {"cog": DEGREE * np.mod(log["cog"], 2 * np.pi)}, "unit", ["course_over_ground_deg"]),
    ],
)
def test_velocities_over_ground(clean, damage, kind, columns):
    log = over_ground(clean)
    assert findings(log) == []
    (finding,) = findings(log | damage(log))
    told(finding, kind, *columns)


@pytest.mark.parametrize(
    ("names", "factor", "words"),
    [
        (("u_ground", "v_ground"), 1 / KNOT, "in knots"),
        (("u_ground", "v_ground"), 3.6, "in km/h"),
        (("u_ground", "v_ground"), 1 / 0.3048, "in ft/s"),
        (("x", "y"), 1 / 0.3048, "in feet"),
    ],
)
def test_units_where_a_track_alone_tells_a_velocity(clean, names, factor, words):
    """Without the relation of a column there is nothing against it: other names for it would have none."""
    log = {name: clean[name] for name in ("time", "x", "y", "heading", "r", "u_ground", "v_ground", "delta_r")}
    assert findings(log) == []
    (finding,) = findings(log | scaled(*names, by=factor)(log))
    told(finding, "unit", *(log_files.HEADERS[name] for name in names))
    assert finding.message.startswith(words)


def test_a_boat_goes_ahead(clean):
    """Without a track, velocities through the water are told from each other by their size; a rudder by its reach."""
    log = {name: clean[name] for name in ("time", "u", "v", "r", "delta_r")}
    assert findings(log) == []
    (finding,) = findings(log | exchanged("u", "v")(log))
    told(finding, "name", "u_mps", "v_mps")
    (finding,) = findings(log | scaled("delta_r", by=1 / DEGREE)(log))
    told(finding, "unit", "rudder_deg")


def test_units_by_the_jump_of_a_heading_alone():
    """400 gon, 6400 mils and 2 pi are seen without any other column; a half turn of noise about north is not."""
    times = np.arange(0.0, 400.0)
    turns = np.mod(times / 90.0, 1.0)
    rudder = {"delta_r": np.full_like(times, 0.1)}
    for full, words in ((400.0, "in gon"), (6400.0, "in mils"), (2 * np.pi, "in radians")):
        (finding,) = findings({"time": times, "heading": DEGREE * full * turns} | rudder)
        told(finding, "unit", "heading_deg")
        assert finding.message.startswith(words)
    assert findings({"time": times, "heading": DEGREE * 360.0 * turns} | rudder) == []


def test_headings_averaged_across_north():
    times = np.arange(0.0, 400.0)
    heading = np.mod(0.5 + times / 90.0, 1.0) * 2 * np.pi
    before = int(np.flatnonzero(np.diff(heading) < -3.0)[1])
    heading[before] = 0.5 * (heading[before - 1] + heading[before + 1])
    (finding,) = findings({"time": times, "heading": heading})
    told(finding, "wrap", "heading_deg")


def test_stamps_that_repeat_go_back_or_have_too_few_digits(clean):
    times = clean["time"]
    repeated = np.array(times)
    repeated[100] = repeated[99]
    (finding,) = findings(clean | {"time": repeated})
    told(finding, "stamp", "time_s")
    assert finding.message.startswith(f"1 of {len(times)} rows repeat")

    back = np.where(np.arange(len(times)) < 3000, times, times - 50.0)
    (finding,) = findings(clean | {"time": back})
    told(finding, "clock", "time_s")

    (finding,) = findings(clean | {"time": np.round(times)})
    told(finding, "stamp", "time_s")

    order = np.random.default_rng(0).permutation(len(times))
    (finding,) = findings({name: values[order] for name, values in clean.items()})
    told(finding, "order", "time_s")


def test_a_jump_of_the_clock_is_not_a_gap(clean):
    """Where rows are missing the boat has moved on; where the clock jumped it has not."""
    times = clean["time"]
    jump = np.where(times < 80.0, times, times + 40.0)
    (finding,) = findings(clean | {"time": jump})
    told(finding, "clock", "time_s")
    rest = (times < 80.0) | (times > 120.0)
    assert findings({name: values[rest] for name, values in clean.items()}) == []


@pytest.mark.parametrize("name", ["u_ground", "depth", "r", "heading"])
def test_a_column_that_stands_still_is_named(clean, name):
    cells = np.flatnonzero(np.isfinite(clean[name]))
    values = clean[name].copy()
    values[cells[60:110]] = values[cells[60]]
    (finding,) = findings(clean | {name: values})
    told(finding, "stuck", log_files.HEADERS[name])


MARKS = [
    ("u_ground", -9999.0, 1), ("u_ground", 999.9, 3), ("u_ground", -32.768, 5), ("u_ground", -1.0, 30),
    ("r", -999.0, 2), ("heading", 655.35, 10), ("heading", 511.0, 3), ("depth", 0.0, 20),
    ("x", 65535.0, 1), ("z", -99.0, 2),
]  # fmt: skip


@pytest.mark.parametrize(("name", "mark", "n"), MARKS)
def test_a_number_that_stands_for_no_reading_is_named(clean, name, mark, n, rng):
    values, header = clean[name].copy(), log_files.HEADERS[name]
    values[rng.choice(np.flatnonzero(np.isfinite(values)), n, replace=False)] = mark * log_files.si_factor(name)
    (finding,) = findings(clean | {name: values})
    assert (finding.kind, finding.columns) == ("mark", (header,))
    assert f"missing = [{mark:.10g}] under [columns.{header}]" in finding.remedy


def test_a_control_may_jump_but_not_to_what_stands_for_no_reading(clean):
    assert findings(clean | {"rpm": np.where(clean["time"] % 20 < 10, 0.0, 1500.0)}) == []
    rudder = clean["delta_r"].copy()
    rudder[1000] = 65535.0 * DEGREE
    (finding,) = (one for one in findings(clean | {"delta_r": rudder}) if one.kind == "mark")
    told(finding, "mark", "rudder_deg")


def constant(log, name):
    return np.where(np.isfinite(log[name]), log[name][np.isfinite(log[name])][0], np.nan)


@pytest.mark.parametrize("name", ["r", "q", "theta", "psi", "heading", "x", "y", "z", "depth", "delta_r"])
def test_a_column_that_never_changes_beside_one_that_says_it_must(clean, name):
    (finding,) = findings(clean | {name: constant(clean, name)})
    told(finding, "constant", log_files.HEADERS[name])


def test_a_speed_of_zero_beside_a_track(clean):
    (finding,) = findings(clean | {"u_ground": 0.0 * clean["u_ground"]})
    told(finding, "constant", "u_ground_mps")


def test_a_boat_at_rest_or_on_a_straight_course_may_hold_all_its_columns(clean):
    straight = {"time": clean["time"], "y": 0.0 * clean["time"], "psi": 0.0 * clean["time"]}
    assert findings(straight | {"x": 2.0 * clean["time"], "u": 2.0 + 0.0 * clean["time"]}) == []


def elsewhere(log):
    """The log of another boat: at another place, and to the other side."""
    return log | {name: -log[name] for name in ("psi", "heading", "y", "v")} | {"x": log["x"] + 300.0}


@pytest.mark.parametrize("pattern", ["ab", "abb", "random"])
def test_rows_of_two_boats(clean, pattern, rng):
    log = {name: values[np.isfinite(clean["x"])] for name, values in clean.items()}
    n, other = len(log["time"]), elsewhere(log)
    rows = rng.integers(0, 2, n) if pattern == "random" else np.resize([c == "b" for c in pattern], n)
    (finding,) = findings({name: np.where(rows, other[name], values) for name, values in log.items()})
    assert (finding.kind, finding.misread) == ("mixed", True)
    assert "x_m" in finding.columns


def test_rows_of_two_runs(clean):
    other = elsewhere(clean)
    both = {name: np.concatenate([values, other[name]]) for name, values in clean.items()}
    assert {finding.kind for finding in findings(both)} == {"clock", "run"}
    both["time"] = np.concatenate([clean["time"], clean["time"][-1] + 0.1 + clean["time"]])
    (finding,) = findings(both)
    assert finding.kind == "run"


SMOOTH = [Sensor(f"{name}_m", 0.005, interval_s=0.1) for name in "xy"]


def test_times_of_receipt(tmp_path):
    """Rows that were received in bursts, and a sensor that does read in bursts."""
    log = log_of(flown("remus100", "zigzag_20_20"), SMOOTH, tmp_path)
    log = {name: values[np.isfinite(log["x"])] for name, values in log.items()}
    times = log["time"]
    assert findings(log) == []
    rows = np.arange(len(times))
    ends = np.minimum(rows // 5 * 5 + 4, len(times) - 1)
    (finding,) = findings(log | {"time": times[ends] + 1e-3 * (rows % 5)})
    told(finding, "clock", "time_s")
    assert findings({name: values[rows // 5 % 2 == 0] for name, values in log.items()}) == []


def test_a_jump_of_the_clock_after_the_last_reading_of_a_column(clean):
    log = {name: values.copy() for name, values in clean.items()}
    late = log["time"] > 100.0
    for name in ("x", "y", "z", "depth"):
        log[name][late] = np.nan
    gap = (log["time"] < 120.0) | (log["time"] > 130.0)
    assert findings({name: values[gap] for name, values in log.items()}) == []


def test_a_boat_that_turns_back_in_a_gap_is_no_jump_of_the_clock():
    """A glider at the surface: it comes up, says nothing for three minutes, and goes down."""
    times = np.concatenate([np.arange(0.0, 400.0), np.arange(590.0, 900.0)])
    depth = np.where(times < 400.0, 0.1 * (400.0 - times), 0.1 * (times - 590.0))
    assert findings({"time": times, "depth": depth}) == []


def test_nothing_is_said_of_the_log_of_the_glider(bayesub):
    """Between its parts it lies at the surface for three minutes."""
    log = toml_files.find_log("slocum_comet")
    status, out, _ = bayesub("check", "slocum_comet", log)
    assert (status, out.splitlines()[-1]) == (0, "no column contradicts another")


def test_radians_are_likelier_than_minutes(clean):
    """By pitch, speed and depth alone they differ by a twentieth."""
    log = {name: clean[name] for name in ("time", "theta", "depth", "u_ground")}
    (finding,) = findings(log | {"theta": DEGREE * clean["theta"]})
    told(finding, "unit", "pitch_deg")


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
    assert '"kind": "sign"' in out


@pytest.mark.parametrize("manoeuvre", ["random", "coupled"])
def test_stern_planes_of_a_boat_that_rights_itself(manoeuvre, tmp_path):
    """The pitch of phoenix swings about that of its planes, against which its rate is as often as with them."""
    log = log_of(flown("phoenix", manoeuvre), INSTRUMENTS["navigator"], tmp_path)
    assert findings(log) == []
    (finding,) = findings(log | scaled("delta_s", by=-1.0)(log))
    told(finding, "sign", "stern_plane_deg")
