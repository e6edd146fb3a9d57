"""The set `abkowitz` and the vehicle `mariner` against published numbers and an independent implementation.

Sources, and what they have:

- Chislett & Strom-Tejsen (1965): the coefficients, here by mariner.m of the MSS toolbox.
- MSS, mssExamples/exNomoto.m: the linear steering equation, gain 0.185 1/s, time constants 118, 7.8 and 18.5 s.
- The textbook of the toolbox (Fossen 2002) prints what turncircle.m and exTurnCircle.m give at 15 degrees of rudder (35
  since 2003-06-11). The seven numbers are quoted from memory: the book was not at hand, so their page is not known.
- github.com/Rocketman-99/usv-heading-rl, docs/02_plant_model.md: steady yaw rates of another port of mariner.m.

Numbers for zig-zags and for turns at 35 degrees, such as those of the full-scale trials of USS Compass Island, were in
no source that could be opened: the independent implementation and the limits of IMO MSC.137(76) stand beside ours.
"""

import math

import numpy as np
import pytest
from support import mariner

import bayesub as bs
from bayesub.io import toml_files
from bayesub.model.linear_form import linear_systems

PORT, STARBOARD = 1.0, -1.0  # signs of the rudder angle that turns the ship to this side
IMO_LIMIT_DEG = {10: 5.0 + 0.5 * mariner.LENGTH / mariner.SPEED, 20: 25.0}  # of the first overshoot


@pytest.fixture(scope="module")
def ship():
    return bs.load_vehicle("mariner")


@pytest.fixture
def turn(tmp_path):
    """Track of a turn as `mariner.fly` returns it."""

    def sail(ship, rudder_deg, start, duration):
        path = tmp_path / "turn.toml"
        path.write_text(
            f'name = "turn"\nkind = "steps"\nduration_s = {duration}\n'
            f"[demands]\ntime_s = [{start}]\nrudder_deg = [{rudder_deg}]\n"
        )
        return columns(bs.simulate(ship, bs.load_manoeuvre(str(path), ship)))

    return sail


def columns(trajectory):
    """Time, x, y, heading, surge, sway and yaw rate of a trajectory."""
    return np.column_stack([trajectory.times, trajectory.outputs(("x", "y", "psi", "u", "v", "r"))[0]])


def planar_states(rng, n):
    """States (n, 12) in the plane, at velocities as in tight turns, and rudder angles (n, 1)."""
    states = np.zeros((n, 12))
    states[:, [0, 1, 5]] = rng.uniform(-3.0, 3.0, (n, 3))
    states[:, 6] = rng.uniform(3.0, 9.0, n)
    states[:, 7] = rng.uniform(-1.5, 1.5, n)
    states[:, 11] = rng.uniform(-0.015, 0.015, n)
    return states, rng.uniform(-0.7, 0.7, (n, 1))


def test_coefficients_are_the_published_ones(ship):
    """Every coefficient of the tables is in the file and no other; mass, centre of gravity and inertia likewise."""
    assert dict(zip(ship.equations.names, ship.xi, strict=True)) == mariner.COEFFICIENTS
    body = toml_files.read_toml_table(toml_files.find("mariner", "vehicles"))["body"]
    length, scale = body["length_m"], 0.5 * body["water_density_kgm3"] * body["length_m"] ** 3
    assert (length, ship.speed_mps) == (mariner.LENGTH, mariner.SPEED)
    assert body["mass_kg"] / scale == pytest.approx(mariner.MASS, rel=1e-14)
    assert body["inertia_kgm2"]["Izz"] / (scale * length**2) == pytest.approx(mariner.INERTIA, rel=1e-14)
    assert body["centre_of_gravity_m"] == [pytest.approx(mariner.XG * length, rel=1e-14), 0.0, 0.0]


def test_accelerations_are_those_of_the_independent_implementation(ship, rng):
    """At random velocities and rudder angles; there is no acceleration out of the plane."""
    states, rudder = planar_states(rng, 50)
    expected = np.zeros((50, 6))
    for row, state, (angle,) in zip(expected, states, rudder, strict=True):
        row[[0, 1, 5]] = mariner.accelerations(state[6], state[7], state[11], angle)
    found = bs.accelerations(ship, states, rudder, 0.0)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=0.0)


def test_steering_constants_are_the_published_ones(ship):
    """Gain and time constants of yaw rate by rudder, T1 T2 r'' + (T1 + T2) r' + r = K (angle + T3 angle')."""
    step = 1e-6
    states, rudder = np.zeros((6, 12)), np.zeros((6, 1))
    states[:, 6] = mariner.SPEED
    states[[0, 1], 7], states[[2, 3], 11], rudder[[4, 5], 0] = [(step, -step)] * 3
    sloped = bs.accelerations(ship, states, rudder, 0.0)[:, [1, 5]]
    (yv, nv), (yr, nr), (yd, nd) = (sloped[::2] - sloped[1::2]) / (2.0 * step)
    determinant = yv * nr - yr * nv
    time_constants = sorted(-1.0 / np.roots([1.0, -(yv + nr), determinant]))
    gain = (nv * yd - yv * nd) / determinant
    assert -gain == pytest.approx(0.185, abs=0.5e-3)  # the toolbox orders rudder angles of the other sign
    assert time_constants == [pytest.approx(7.8, abs=0.05), pytest.approx(118.0, abs=0.5)]
    assert nd / (nv * yd - yv * nd) == pytest.approx(18.5, abs=0.05)


# Rudder 15 degrees, ordered at 100 s by a script that rounds the time, so at 99.5 s; it rounds angles of heading too.
TEXTBOOK_M = {
    "start": 769,
    "advance": 943,
    "transfer": 534,
    "tactical diameter": 1311,
    "largest advance": 947,
    "largest transfer": 1315,
    "steady radius": 711,
}
SCRIPT = {"start": 99.9, "heading_deg": (89.5, 179.5)}


def test_textbook_turn_by_the_independent_implementation():
    """With the script's Euler steps of 0.1 s all seven numbers are those of the book."""
    track = mariner.fly(lambda time, _: math.radians(15.0) * (time > 99.45), 700.0, euler=True)
    assert {name: round(x) for name, x in mariner.turning_circle(track, **SCRIPT).items()} == TEXTBOOK_M


def test_textbook_turn(ship, turn):
    """The tolerance is what the script's Euler steps do to the advance, 0.8 m, and the rounding of the book."""
    measures = mariner.turning_circle(turn(ship, 15.0, 99.5, 700.0), **SCRIPT)
    assert measures == {name: pytest.approx(x, abs=1.5) for name, x in TEXTBOOK_M.items()}
    assert measures["steady radius"] == pytest.approx(711.2, abs=0.1)


@pytest.mark.parametrize(("rudder_deg", "gain"), [(2, 0.1147), (5, 0.0769), (10, 0.0493), (20, 0.0291), (35, 0.0174)])
def test_steady_yaw_rates_are_those_of_another_port(ship, turn, rudder_deg, gain):
    """Half the difference of the yaw rates to either side by the rudder angle, 1/s, printed with four decimals."""
    rates = [turn(ship, side * rudder_deg, 0.0, 2000.0)[-1, 6] for side in (STARBOARD, PORT)]
    assert (rates[0] - rates[1]) / (2.0 * math.radians(rudder_deg)) == pytest.approx(gain, abs=0.5e-4)
    if rudder_deg == 5:
        assert math.degrees(rates[0]) == pytest.approx(0.4228, abs=0.5e-4)


# Advance, transfer, tactical diameter, steady radius in m; in ship lengths 3.54 2.61 6.40 3.45 and 3.71 2.73 6.65 3.58.
TURNS_M = [(STARBOARD, (570.2, 420.2, 1029.2, 555.7)), (PORT, (596.7, 439.6, 1070.3, 575.7))]
MEASURES = ("advance", "transfer", "tactical diameter", "steady radius")


@pytest.mark.parametrize(("side", "metres"), TURNS_M)
def test_turn_at_35_degrees(ship, turn, side, metres):
    """Track and measures are those of the independent implementation; the propeller makes the turns unequal.

    IMO asks of a ship an advance below 4.5 and a tactical diameter below 5 lengths; the second is 6.4 here.
    """
    track = turn(ship, side * 35.0, 0.0, 900.0)
    expected = mariner.fly(lambda *_: math.radians(side * 35.0), 900.0)
    np.testing.assert_allclose(track[:, 1:3], expected[:, 1:3], atol=0.1)
    np.testing.assert_allclose(np.degrees(track[:, 3]), np.degrees(expected[:, 3]), atol=0.01)
    measures = mariner.turning_circle(track, 0.0)
    assert [measures[name] for name in MEASURES] == pytest.approx(metres, abs=0.2)
    assert measures["advance"] < 4.5 * mariner.LENGTH < 5.0 * mariner.LENGTH < measures["tactical diameter"]
    assert math.hypot(*track[-1, 4:6]) / mariner.SPEED == pytest.approx(0.78, abs=0.005)


def test_turn_with_the_constant_speed(turn, tmp_path):
    """A copy of the set whose powers refer to the trial speed, as the coefficients do: 5.0 lengths instead of 6.4."""
    own = toml_files.find("abkowitz", "equations").read_text(encoding="utf-8")
    own = own.replace('name = "abkowitz"', 'name = "constant"').replace('speed = "instantaneous"', 'speed = "trial"')
    (tmp_path / "constant.toml").write_text(own, encoding="utf-8")
    boat = toml_files.find("mariner", "vehicles").read_text(encoding="utf-8")
    boat = boat.replace('equations = "abkowitz"', 'equations = "constant.toml"')
    (tmp_path / "boat.toml").write_text(boat, encoding="utf-8")
    track = turn(bs.load_vehicle(tmp_path / "boat.toml"), STARBOARD * 35.0, 0.0, 900.0)
    expected = mariner.fly(lambda *_: math.radians(STARBOARD * 35.0), 900.0, constant_speed=True)
    np.testing.assert_allclose(track[:, 1:3], expected[:, 1:3], atol=0.1)
    assert mariner.turning_circle(track, 0.0)["tactical diameter"] == pytest.approx(798.5, abs=0.2)


ZIGZAGS_DEG = {10: (3.50, 6.24, 4.48, 6.23), 20: (6.78, 7.36, 6.27, 7.26)}  # overshoot angles, first rudder to port


@pytest.mark.parametrize("angle_deg", [10, 20])
def test_zigzag(ship, angle_deg):
    """Overshoot angles are those of the independent implementation and within the limit of IMO."""
    manoeuvre = bs.load_manoeuvre(f"zigzag_{angle_deg}_{angle_deg}", ship)
    track = columns(bs.simulate(ship, manoeuvre))
    step = manoeuvre.times[1]
    expected = mariner.zigzag(angle_deg, 99.5 * step, manoeuvre.duration, step)
    beyond = mariner.overshoots(track, angle_deg)
    np.testing.assert_allclose(beyond, mariner.overshoots(expected, angle_deg), atol=0.02)
    np.testing.assert_allclose(beyond[:4], ZIGZAGS_DEG[angle_deg], atol=0.02)
    assert beyond[0] < IMO_LIMIT_DEG[angle_deg]


def test_the_set_is_that_of_three_degrees_of_freedom(ship):
    """Surge, sway and yaw, five added masses, and the rudder as the only control."""
    equations = ship.equations
    assert [len(equations.names_of_axis(axis)) for axis in "XYZKMN"] == [11, 17, 0, 0, 0, 17]
    assert equations.added_masses == ("Xudot", "Yvdot", "Yrdot", "Nvdot", "Nrdot")
    assert [(control.symbol, control.column) for control in equations.controls] == [("dr", "rudder_deg")]
    assert (equations.degrees_of_freedom, equations.rigid_body_terms) == (3, "in_coefficients")
    assert tuple(equations.subproblems) == ("horizontal",)


def test_added_masses_are_not_unique(ship):
    """Every axis has all regressors of the equations that give its accelerations, so that these are sums of the others.

    Surge has one acceleration, sway and yaw have two, which both stand in both axes.
    """
    trajectory = bs.simulate(ship, bs.load_manoeuvre("zigzag_20_20", ship))
    systems = linear_systems(trajectory)
    assert list(systems) == ["X", "Y", "N"]
    ranks = {}
    for axis, system in systems.items():
        singular = np.linalg.svd(system.matrix / np.linalg.norm(system.matrix, axis=0), compute_uv=False)
        ranks[axis] = (int(np.sum(singular > 1e-12)), len(system.names))
        assert singular[ranks[axis][0] - 1] > 1e-3  # a wide gap
    assert ranks == {"X": (10, 11), "Y": (15, 17), "N": (15, 17)}
