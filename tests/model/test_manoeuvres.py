"""Manoeuvres: the built-in ones, those recorded in closed loop, and control histories from files."""

import re
from dataclasses import replace

import numpy as np
import pytest
from support import refusals, user_set
from support.refusals import refused

import bayesub as bs
from bayesub.io import toml_files
from bayesub.model import closed_loop
from bayesub.model.manoeuvre_files import read_manoeuvre
from bayesub.model.simulator import Simulator

# Submarines of the 101 terms, an AUV and a ship: the kernels of further boats would take minutes to compile.
VEHICLES = ("auv690", "npsauv", "suboff", "remus100", "mariner")
MANOEUVRES = tuple(toml_files.built_in("manoeuvres"))

# Columns of the controls that the built-in manoeuvres move.
MOVED = {name: {"rudder_deg"} for name in MANOEUVRES} | {"vertical": {"stern_plane_deg"}}
MOVED |= {name: {"rudder_deg", "stern_plane_deg"} for name in ("coupled", "random")}
MOVED |= {"comparison": {"rudder_deg", "bow_plane_deg", "stern_plane_deg"}}

STAIRS = [5, 10, 15, 20, 25, 30, 25, 20, 15, 10, 5, 0]  # degrees, thesis 4.6.1


@pytest.mark.parametrize(("name", "limit"), [("suboff", 30.0), ("auv690", 30.0), ("npsauv", 20.0)])
def test_spiral(name, limit):
    """Twelve rudder steps to 30 degrees and back within 600 s of a 102.26 m boat at 7.5 m/s, or the vehicle's limit."""
    vehicle = bs.load_vehicle(name)
    spiral = bs.load_manoeuvre("horizontal", vehicle)
    second = vehicle.length_m / vehicle.speed_mps / (102.2606 / 7.5)
    assert spiral.duration == pytest.approx(600 * second, rel=1e-12)
    assert spiral.subproblem == "horizontal"
    rudder = np.degrees(spiral.controls[:, 0])
    assert rudder.max() == pytest.approx(limit, rel=1e-6)
    assert not spiral.controls[:, 1:].any()
    # Just before the next step, 50 s or more than 40 time constants after the last, the plane is where it was sent.
    before = np.interp(np.arange(59.5, 600, 50) * second, spiral.times, rudder)
    np.testing.assert_allclose(before[:11], np.minimum(STAIRS, limit)[:11], atol=1e-9)
    assert rudder[spiral.times <= 10 * second].max() == 0.0
    assert rudder[-1] == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_array_equal(spiral.rpm, vehicle.rpm_per_mps * vehicle.speed_mps)
    np.testing.assert_array_equal(
        spiral.initial_state, [0, 0, vehicle.depth_m, 0, 0, 0, vehicle.speed_mps, 0, 0, 0, 0, 0]
    )


def test_thesis_table_5(suboff, spiral):
    """Held controls give the thesis's position errors at 0.1 s and 1 s steps, interpolation millimetres."""
    reference = Simulator(suboff, spiral, spiral.times, dt=0.05).run(suboff.xi)[0][0, :, :3]

    def error(dt, controls):
        states, _ = Simulator(suboff, spiral, spiral.times, dt=dt, controls=controls).run(suboff.xi)
        return np.linalg.norm(states[0, :, :3] - reference, axis=1).max()

    # Thesis: 0.688-0.695 m and 8.13-8.30 m for its three boats. Its boats and the details of its spiral are not
    # printed, hence the margins around them.
    assert 0.65 < error(0.1, "hold") < 0.72
    assert 7.9 < error(1.0, "hold") < 8.4
    assert error(1.0, "linear") < 0.01


def can_fly(vehicle, name):
    """Whether the equations of a vehicle have the controls that a built-in manoeuvre moves."""
    return MOVED[name] <= {control.column for control in bs.load_vehicle(vehicle).equations.controls}


def flown(vehicle, manoeuvre):
    """States (n, 12) at the samples of the control history, one integration step each."""
    track = bs.simulate(vehicle, manoeuvre, dt=manoeuvre.times[1])
    assert track.status[0] == "ok"
    return track.states[0]


@pytest.mark.parametrize(
    ("name", "vehicle"), [(name, v) for name in MANOEUVRES for v in VEHICLES if not can_fly(v, name)]
)
def test_a_manoeuvre_of_controls_that_a_vehicle_does_not_have(vehicle, name):
    """It is refused in one line that names file and control."""
    vehicle = bs.load_vehicle(vehicle)
    with pytest.raises(bs.InputError) as error:
        bs.load_manoeuvre(name, vehicle)
    assert f"{name}.toml: " in str(error.value)
    assert error.value.key in MOVED[name]
    refusals.check(error.value, "unknown", error.value.key)


@pytest.mark.parametrize(("name", "vehicle"), [(name, v) for name in MANOEUVRES for v in VEHICLES if can_fly(v, name)])
def test_every_vehicle_flies_every_built_in_manoeuvre(vehicle, name):
    """Planes stay within the vehicle's own limits and rates, and no vehicle diverges or pitches up to 85 degrees."""
    vehicle = bs.load_vehicle(vehicle)
    manoeuvre = bs.load_manoeuvre(name, vehicle)
    assert manoeuvre.name == name
    assert manoeuvre.description
    file = read_manoeuvre(toml_files.find(name, "manoeuvres"))
    second = vehicle.length_m / vehicle.speed_mps / (102.2606 / 7.5)
    assert manoeuvre.duration == pytest.approx(file.duration_s * second, rel=1e-12)
    assert manoeuvre.controls.any()
    assert (np.abs(manoeuvre.controls) <= vehicle.actuators.limits * (1 + 1e-12)).all()
    rates = np.abs(np.diff(manoeuvre.controls, axis=0)) / np.diff(manoeuvre.times)[:, None]
    assert rates.max() <= vehicle.actuators.members[0].rate * (1 + 1e-9)  # differences of angles 0.02 s and more apart
    flown(vehicle, manoeuvre)


@pytest.mark.parametrize(
    ("name", "recorder"), [("vertical", "suboff"), ("coupled", "suboff"), ("comparison", "npsauv")]
)
def test_replay_is_a_fixed_point(name, recorder, monkeypatch):
    """The recorded controls flown open loop with steps of a sample give the track of the closed loop to round-off."""
    track = {}
    hold = closed_loop.Flight.hold

    def state_kept(flight, orders, n):
        hold(flight, orders, n)
        track[flight.now] = flight.state
        track["controls"] = flight.inputs

    vehicle = bs.load_vehicle(recorder)
    with monkeypatch.context() as patched:
        patched.setattr(closed_loop.Flight, "hold", state_kept)
        read_manoeuvre(toml_files.find(name, "manoeuvres")).recorded(vehicle)
    controls = track.pop("controls")
    manoeuvre = bs.load_manoeuvre(name, vehicle)
    # Round-off of 600 s, 1e-13 s, times the fastest plane, 0.35 rad/s.
    np.testing.assert_allclose(manoeuvre.controls, controls, rtol=0, atol=5e-14)
    states = flown(vehicle, manoeuvre)
    # Round-off in controls and times, over 7,500 steps and positions of 1,000 m.
    np.testing.assert_allclose(states[list(track)], list(track.values()), rtol=0, atol=1e-8)
    # Negative control: a quarter of a percent more stern plane is not the same track.
    other = replace(manoeuvre, controls=manoeuvre.controls * [1.0, 1.0, 1.0025])
    assert np.abs(flown(vehicle, other)[-1] - states[-1]).max() > 1e-3


def turns(controls, amplitude):
    """Last samples at which a plane is at `amplitude` to either side before it leaves."""
    over = np.sign(controls) * (np.abs(controls) > 0.999 * amplitude)
    return np.flatnonzero((over[:-1] != 0) & (over[1:] != over[:-1]))


def test_vertical_turns_at_five_degrees_of_pitch(suboff):
    """Suboff's stern planes go over six times, each time when the pitch has just reached 5 degrees (thesis 4.6.2)."""
    manoeuvre = bs.load_manoeuvre("vertical", suboff)
    states = flown(suboff, manoeuvre)
    pitch, stern = np.degrees(states[:, 4]), manoeuvre.controls[:, 2]
    assert manoeuvre.subproblem == "vertical"
    assert not manoeuvre.controls[:, :2].any()
    assert not stern[manoeuvre.times <= 10.0].any()
    # A plane that takes 0.1 s to leave has moved by 0.5 degrees: the turn is seen one sample after its order.
    turned = pitch[turns(stern, np.radians(5.0))]
    np.testing.assert_allclose(turned, [-5, 5, -5, 5, -5, 5], atol=0.05)
    assert np.degrees(np.abs(stern[-1])) < 1e-3
    # Negative control: the other vehicles get the same orders and turn elsewhere.
    auv690 = bs.load_vehicle("auv690")
    replayed = bs.load_manoeuvre("vertical", auv690)
    turned = np.degrees(flown(auv690, replayed)[turns(replayed.controls[:, 2], np.radians(5.0)), 4])
    assert np.abs(np.abs(turned) - 5.0).max() > 1.0


def test_coupled_keeps_suboff_within_its_band(suboff, spiral):
    """Within 15 m of 100 m in six degrees of freedom, with the spiral's rudder; without stern planes 80 m higher."""
    manoeuvre = bs.load_manoeuvre("coupled", suboff)
    assert manoeuvre.subproblem is None
    np.testing.assert_array_equal(manoeuvre.controls[:, 0], spiral.controls[:, 0])
    assert not manoeuvre.controls[:, 1].any()
    depth = flown(suboff, manoeuvre)[:, 2]
    assert 85.0 < depth.min() < 95.0
    assert 105.0 < depth.max() < 115.0
    uncontrolled = replace(manoeuvre, controls=manoeuvre.controls * [1, 0, 0])
    assert flown(suboff, uncontrolled)[:, 2].min() < 20.0


def test_coupled_excites_the_z_axis(suboff, tmp_path):
    """The Z axis has the one null direction that the thesis's Table 7 gives; with one depth ordered it has more."""
    text = toml_files.find("coupled", "manoeuvres").read_text()
    level = re.sub(r"depth_m .*", f"depth_m = {[100.0] * 12}", text)
    found = []
    for content in (text, level):
        manoeuvre = bs.load_manoeuvre(write(tmp_path, content, "coupled.toml"), suboff)
        track = bs.simulate(suboff, manoeuvre, dt=0.5, sample=0.5)
        matrix = bs.regressors(track.states[0], track.accelerations[0], track.controls)["Z"]
        lengths = np.linalg.norm(matrix, axis=0)
        singular = np.linalg.svd(matrix[:, lengths > 0] / lengths[lengths > 0], compute_uv=False)
        found.append(int((singular < 1e-10).sum()))
    assert found == [1, 3]


@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize("angle", [10, 20])
def test_zigzag(vehicle, angle):
    """The rudder goes over five times as the heading passes the angle, and the heading overshoots and comes back."""
    vehicle = bs.load_vehicle(vehicle)
    if vehicle.actuators.limits[0] < np.radians(angle):
        assert (vehicle.name, angle) == ("remus100", 20)  # its rudder stops at 13.6 degrees
        return
    manoeuvre = bs.load_manoeuvre(f"zigzag_{angle}_{angle}", vehicle)
    yaw = np.degrees(flown(vehicle, manoeuvre)[:, 5])
    rudder = manoeuvre.controls[:, 0]
    turned = turns(rudder, np.radians(angle))
    # The fastest, npsauv, yaws 6 deg/s: 0.12 degrees in a sample of 0.02 s, and the rudder leaves within two.
    np.testing.assert_allclose(yaw[turned], angle * np.array([-1, 1, -1, 1, -1]), atol=0.3)
    assert np.abs(rudder[-1]) < 1e-3
    for begin, end, side in zip(turned, turned[1:], (-1, 1, -1, 1), strict=False):
        overshoot = (side * yaw[begin:end]).max() - angle
        assert 1.0 < overshoot < angle


def test_comparison_reaches_its_depth(suboff):
    """Suboff goes from 300 m to 125 m and stays; small vehicles do the same in ship lengths."""
    for vehicle in (bs.load_vehicle(name) for name in VEHICLES if can_fly(name, "comparison")):
        manoeuvre = bs.load_manoeuvre("comparison", vehicle)
        lengths = flown(vehicle, manoeuvre)[:, 2] / vehicle.length_m * suboff.length_m
        assert lengths[0] == pytest.approx(300.0)
        np.testing.assert_allclose(lengths[manoeuvre.times > 0.9 * manoeuvre.duration], 125.0, atol=2.0)
        assert (lengths > 105.0).all()
        np.testing.assert_array_equal(manoeuvre.controls[:, 1], -manoeuvre.controls[:, 2])


def test_turning_circle(suboff):
    """A steady turn: constant yaw rate at the end."""
    manoeuvre = bs.load_manoeuvre("turning_circle", suboff)
    states = flown(suboff, manoeuvre)
    assert np.degrees(manoeuvre.controls[-1, 0]) == pytest.approx(20.0)
    assert np.ptp(states[-1000:, 11]) < 1e-3 * abs(states[-1, 11])
    assert abs(states[-1, 5]) > 2 * np.pi


def test_random_manoeuvres(suboff, rng):
    """The seed alone decides; rudder within 30 degrees and stern planes within 8, new every 30 s; no bow planes."""
    first = bs.load_manoeuvre("random:17", suboff)
    np.testing.assert_array_equal(first.controls, bs.load_manoeuvre("random:17", suboff).controls)
    assert np.abs(first.controls - bs.load_manoeuvre("random:18", suboff).controls).max() > 0.1
    seed_0 = bs.load_manoeuvre("random", suboff)
    np.testing.assert_array_equal(bs.load_manoeuvre("random:0", suboff).controls, seed_0.controls)
    assert first.name == "random:17"
    degrees = np.degrees([bs.random_manoeuvre(suboff, rng).controls for _ in range(100)])
    assert not degrees[:, first.times <= 10.0].any()
    assert not degrees[:, :, 1].any()
    for plane, limit in ((0, 30.0), (2, 8.0)):
        # Just before a step, 20 time constants after the last, the planes are where they were sent.
        demanded = degrees[:, np.searchsorted(first.times, np.arange(39.5, 610.0, 30.0)), plane]
        assert demanded.shape == (100, 20)
        assert np.abs(demanded).max() <= limit
        assert np.abs(demanded).max() > 0.99 * limit
        assert np.std(demanded) == pytest.approx(limit / np.sqrt(3), rel=0.05)  # 2,000 numbers: 1 % to a standard error


def test_random_manoeuvre_of_a_generator(suboff, rng):
    """The name of a drawn manoeuvre loads it again; its keys can be changed, but not mistyped."""
    drawn = bs.random_manoeuvre(suboff, rng)
    np.testing.assert_array_equal(bs.load_manoeuvre(drawn.name, suboff).controls, drawn.controls)
    short = bs.random_manoeuvre(suboff, rng, duration_s=100.0, interval_s=5.0, rudder_limit_deg=3.0)
    assert short.duration == 100.0
    assert np.degrees(np.abs(short.controls[:, 0])).max() <= 3.0
    with refused("unknown", "interval"):
        bs.random_manoeuvre(suboff, rng, interval=5.0)
    with refused("value", "seed"):
        bs.load_manoeuvre("random:x", suboff)


def test_random_survey(suboff, rng):
    """None of the random manoeuvres leaves the envelope (thesis 8.2 chose its 8 degrees for that)."""
    for _ in range(20):
        assert bs.simulate(suboff, bs.random_manoeuvre(suboff, rng), dt=0.5, sample=10.0).status[0] == "ok"


ZIGZAG = """
name = "test"
kind = "zigzag"
duration_s = 60.0
start_s = 5.0
plane = "rudder"
angle_deg = 10.0
reversal_deg = 10.0
executes = 2
"""


@pytest.mark.parametrize(
    ("old", "new", "kind", "key"),
    [
        ('"rudder"', '"bow_plane"', "value", "plane"),
        ("executes = 2", "execute = 2", "unknown", "execute"),
        ("executes = 2", 'executes = 2\nrecorded_on = "subof"', "value", "recorded_on"),
    ],
)
def test_bad_zigzag_files(tmp_path, suboff, old, new, kind, key):
    """A zig-zag that does not fit is refused in one line that names file and key."""
    path = write(tmp_path, ZIGZAG.replace(old, new), "zigzag.toml")
    with refused(kind, key) as error:
        bs.load_manoeuvre(path, suboff)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


def test_unfinished_zigzag(tmp_path, suboff):
    """A zig-zag that its time ends is cut there."""
    path = write(tmp_path, ZIGZAG.replace("60.0", "20.0"), "zigzag.toml")
    assert bs.load_manoeuvre(path, suboff).controls[-1, 0] == pytest.approx(np.radians(10.0), rel=1e-4)


@pytest.mark.parametrize(
    ("name", "old", "new", "key"),
    [
        ("zigzag_20_20", r"start_s = .*", "start_s = 1e4", "start_s"),
        ("random", r"start_s = .*", "start_s = 1e4", "start_s"),
        ("turning_circle", r"duration_s = .*", "duration_s = 1.5", "demands"),
        ("comparison", r"duration_s = .*", "duration_s = 1.5", "demands"),
    ],
)
def test_an_order_after_the_end_is_refused(tmp_path, suboff, name, old, new, key):
    """Of every kind: the time of a start, or any of those of demands."""
    text = re.sub(old, new, toml_files.find(name, "manoeuvres").read_text())
    assert new in text
    with refused("value", key):
        bs.load_manoeuvre(write(tmp_path, text, f"{name}.toml"), suboff)


def test_a_vehicle_that_fails_in_closed_loop_says_so(suboff):
    """A vehicle that leaves the envelope while being recorded gives one line, not numbers."""
    unstable = replace(suboff, xi=-suboff.xi)
    with refused("model", "suboff"):
        bs.load_manoeuvre("comparison", unstable)


def write(tmp_path, text, name="history.csv"):
    path = tmp_path / name
    path.write_text(text)
    return path


def test_control_history_is_flown(tmp_path, suboff):
    """A CSV with planes in degrees or radians and a changing propeller speed is what the boat gets."""
    path = write(
        tmp_path,
        "time_s,rudder_deg,stern_plane_rad,rpm\n0,0,0,75\n10,10,-0.05,60\n20,10,-0.05,0\n30,0,0,-30\n",
    )
    history = bs.load_manoeuvre(path, suboff)
    np.testing.assert_allclose(history.controls[1], [np.radians(10), 0.0, -0.05], rtol=1e-15)
    track = bs.simulate(suboff, history, sample=5.0, dt=0.5)
    np.testing.assert_allclose(track.rpm, [75, 67.5, 60, 30, 0, -15, -30], atol=1e-12)
    steady = replace(history, rpm=np.full(4, 75.0))
    faster = bs.simulate(suboff, steady, sample=5.0, dt=0.5)
    assert (
        faster.states[0, -1, 6] - track.states[0, -1, 6] > 0.5
    )  # the propeller that slows and reverses brakes the boat
    np.testing.assert_array_equal(faster.states[0, 0], track.states[0, 0])


def test_missing_columns_are_zero_and_self_propelled(tmp_path, suboff):
    """Without plane columns the planes stay amidships, without rpm the propeller keeps its speed."""
    history = bs.load_manoeuvre(write(tmp_path, "time_s,bow_plane_deg\n0,1\n5,2\n"), suboff)
    np.testing.assert_allclose(history.controls, np.radians([[0, 1, 0], [0, 2, 0]]))
    np.testing.assert_array_equal(history.rpm, 75.0)


def test_a_saved_track_can_be_flown_again(tmp_path, suboff, spiral_track):
    """A track written by one simulation is a control history that gives the same track."""
    short = spiral_track.resampled(np.arange(0.0, 100.1, 0.1))
    short.save(tmp_path / "track.csv")
    again = bs.simulate(
        suboff, bs.load_manoeuvre(tmp_path / "track.csv", suboff), dt=0.5, sample=1.0, subproblem="horizontal"
    )
    # Twelve digits in the file: 1e-10 m of 750 m, and as much again through the controls.
    np.testing.assert_allclose(again.states, short.states[:, ::10], rtol=0, atol=1e-8)


@pytest.mark.parametrize(
    ("text", "kind", "key"),
    [
        ("time_s,rudder_deg\n0,1\n1,\n2,3\n", "data", ""),
        ("time_s,x_m\n0,1\n1,2\n", "missing", ""),
        ("time_s,rudder_deg\n1,1\n2,2\n", "data", "time_s"),
        ("time_s,rudder_deg\n0,1\n", "data", "time_s"),
    ],
)
def test_bad_histories(tmp_path, suboff, text, kind, key):
    """A control history with gaps, without controls, late or too short is refused in one line that names the file."""
    path = write(tmp_path, text)
    with refused(kind, key) as error:
        bs.load_manoeuvre(path, suboff)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


STEPS = """
name = "test"
kind = "steps"
duration_s = 100.0
[demands]
time_s = [10, 50]
rudder_deg = [5, 0]
"""


def test_steps_file(tmp_path, suboff):
    """A file of demanded steps without a time scale has its times in seconds."""
    manoeuvre = bs.load_manoeuvre(write(tmp_path, STEPS, "steps.toml"), suboff)
    assert manoeuvre.duration == 100.0
    assert np.degrees(np.interp(45.0, manoeuvre.times, manoeuvre.controls[:, 0])) == pytest.approx(5.0, abs=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "kind", "key"),
    [
        ('kind = "steps"', 'kind = "step"', "unknown", "kind"),
        ('kind = "steps"', 'kind = ["steps"]', "unknown", "kind"),
        ('kind = "steps"', "", "missing", "kind"),
        ("time_s = [10, 50]", "time_s = [50, 10]", "value", "demands"),
        ("time_s = [10, 50]", "time_s = [-1, 50]", "value", "demands"),
        ("rudder_deg = [5, 0]", "rudder_deg = [5]", "value", "demands"),
        ("rudder_deg = [5, 0]", "", "value", "demands"),
        ("rudder_deg = [5, 0]", "ruder_deg = [5, 0]", "unknown", "ruder_deg"),
        ("rudder_deg = [5, 0]", "rudder_deg = [5, nan]", "value", "demands.rudder_deg.1"),
        ("duration_s = 100.0", "duration_s = -1", "value", "duration_s"),
        ("duration_s = 100.0", "", "missing", "duration_s"),
    ],
)
def test_bad_steps_files(tmp_path, suboff, old, new, kind, key):
    """A manoeuvre file that does not fit is refused in one line that names file and key."""
    assert old in STEPS
    path = write(tmp_path, STEPS.replace(old, new), "steps.toml")
    with refused(kind, key) as error:
        bs.load_manoeuvre(path, suboff)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


def test_unknown_manoeuvre(suboff):
    """A mistyped built-in name gets the nearest one."""
    with refused("unknown", "horizntal"):
        bs.load_manoeuvre("horizntal", suboff)


def test_the_propeller_speed_as_a_control(tmp_path, suboff_file):
    """Equations with a term of `rpm` get what the log says of it: self-propelled unless something else is ordered."""
    user_set.write(tmp_path)
    boat = bs.load_vehicle(write(tmp_path, user_set.vehicle(suboff_file), "boat.toml"))
    turn = bs.load_manoeuvre("turning_circle", boat)
    np.testing.assert_array_equal(turn.controls[:, user_set.COLUMNS.index("rpm")], turn.rpm)
    np.testing.assert_array_equal(turn.rpm, boat.rpm_per_mps * boat.speed_mps)
    ordered = STEPS.replace("rudder_deg = [5, 0]", "rpm = [50, 90]")
    steps = bs.load_manoeuvre(write(tmp_path, ordered, "steps.toml"), boat)
    np.testing.assert_array_equal(steps.controls[:, -1], steps.rpm)
    assert (steps.rpm[0], steps.rpm[-1]) == (75.0, 90.0)
