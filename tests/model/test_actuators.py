"""Actuators: fins that are mixed into the controls of the equations; propellers and thrusters."""

from dataclasses import replace

import numpy as np
import pytest
from support.fins import BOW, FIN, PORT, STARBOARD, X_TAIL, fins, with_actuators
from support.refusals import refused

import bayesub as bs
from bayesub.io import toml_files
from bayesub.logs import log_files
from bayesub.model import closed_loop
from bayesub.model.manoeuvre_files import read_manoeuvre
from bayesub.model.manoeuvres import of_inputs
from bayesub.model.simulator import Simulator

TAILS = {
    "cruciform": (0.0, 90.0, 180.0, 270.0),
    "X": X_TAIL,
    "three, one up": (0.0, 120.0, 240.0),
    "three, one down": (60.0, 180.0, 300.0),
    "V": (45.0, 315.0),
    "rudder below, planes": (180.0, 90.0, 270.0),
}
RATE, LAG = {"rate_deg_s": 5.0, "time_constant_s": 1.0}, np.linspace(0.0, 8.0, 81)
RUDDER, BOW_PLANE, STERN_PLANE = 0, 1, 2  # controls of the equations
V, W, P, Q, R = log_files.positions("v", "w", "p", "q", "r")


@pytest.fixture
def finned(boat, vehicle_with):
    """finned(*actuators): the boat of the tests with these actuators."""
    return lambda *actuators, **sections: vehicle_with(with_actuators(boat, *actuators, **sections))


@pytest.fixture
def crossed(finned):
    """A boat with an X tail."""
    return finned(*fins(*X_TAIL))


def rates_after(vehicle, **inputs):
    """The accelerations vdot wdot pdot qdot rdot that actuators make at once in straight flight."""
    shorts = vehicle.actuators.shorts
    values, rest = np.tile(vehicle.actuators.rest, (2, 1)), np.zeros((1, 12))
    for name, value in inputs.items():
        values[:, shorts.index(name)] = value
    rest[0, 6] = vehicle.speed_mps
    rpm = vehicle.rpm_per_mps * vehicle.speed_mps
    still = np.tile(vehicle.actuators.rest, (1, 1))
    moved = bs.accelerations(vehicle, rest, vehicle.actuators.mixed(values[:1]), rpm, values[:1])
    unmoved = bs.accelerations(vehicle, rest, vehicle.actuators.mixed(still), rpm, still)
    return (moved - unmoved)[0]


@pytest.mark.parametrize("tail", TAILS)
def test_orders_come_back_through_the_fins(finned, tail):
    """Orders of rudder and stern planes are shared among the fins so that they make just these."""
    actuators = finned(*fins(*TAILS[tail])).actuators
    orders = np.array([[0.1, 0.0, 0.0], [0.0, 0.0, -0.2], [0.05, 0.0, 0.15]])
    np.testing.assert_allclose(actuators.mixed(orders @ actuators.allocation.T), orders, rtol=0, atol=1e-15)
    # The fins that are asked for least: any other angles that make the same controls are larger together.
    np.testing.assert_allclose(actuators.allocation, np.linalg.pinv(actuators.mixing), rtol=0, atol=1e-15)
    assert not actuators.allocation[:, BOW_PLANE].any()


def test_mixing_of_known_tails(finned):
    """By hand: a cruciform has two fins in each plane; fins at 45 degrees make the cosine of it in both."""
    half, cosine = 0.5, np.sqrt(0.5)
    mixing = finned(*fins(*TAILS["cruciform"])).actuators.mixing
    np.testing.assert_allclose(mixing[RUDDER], [half, 0, -half, 0], atol=1e-15)
    np.testing.assert_allclose(mixing[STERN_PLANE], [0, -half, 0, half], atol=1e-15)
    mixing = finned(*fins(*X_TAIL)).actuators.mixing
    np.testing.assert_allclose(mixing[RUDDER], half * cosine * np.array([1, -1, -1, 1]), atol=1e-15)
    np.testing.assert_allclose(mixing[STERN_PLANE], half * cosine * np.array([-1, -1, 1, 1]), atol=1e-15)
    mixing = finned(*fins(*TAILS["three, one up"])).actuators.mixing
    np.testing.assert_allclose(mixing[RUDDER], np.array([2, -1, -1]) / 3, atol=1e-15)


def test_aileron_of_equations_that_know_one(boat, tmp_path, vehicle_with):
    """All fins alike roll the boat; a tail of two fins leaves the roll to what it becomes."""
    (tmp_path / "rolling.toml").write_text(
        'name = "rolling"\ntitle = "with ailerons"\nextends = "booth"\n[controls]\nda = "aileron_deg"\n[terms.K]\n'
        'Kuu_da = { regressor = "u*u*da", length_power = 3, label = "K\'", meaning = "roll by ailerons" }\n'
        "[terms.X]\n[terms.Y]\n[terms.Z]\n[terms.M]\n[terms.N]\n"
    )
    coefficients = boat["coefficients"] | {"Kuu_da": 1e-3}
    rolling = {"equations": str(tmp_path / "rolling.toml"), "coefficients": coefficients}

    def actuators(*angles):
        return vehicle_with(with_actuators(boat, *fins(*angles), **rolling)).actuators

    np.testing.assert_allclose(actuators(*X_TAIL).allocation[:, 3], 1.0)
    four, two = actuators(*X_TAIL), actuators(45.0, 315.0)
    np.testing.assert_allclose(four.mixing @ four.allocation, np.diag([1, 0, 1, 1]), atol=1e-15)
    np.testing.assert_allclose((two.mixing @ two.allocation)[:3, :3], np.diag([1, 0, 1]), atol=1e-15)
    with refused("model", "aileron_deg"):
        two.share("aileron_deg", "manoeuvre 'roll'")


@pytest.mark.parametrize("vehicle", ["suboff", "auv690", "npsauv"])
@pytest.mark.parametrize("tail", ["cruciform", "X", "three, one up"])
def test_which_way_the_boat_turns(finned, vehicle, tail):
    """A fin whose trailing edge goes counterclockwise seen from astern is pushed clockwise by the water.

    So that the top fin pushes the stern to starboard and the bow to port (model manual, section 7), the starboard fin
    the stern down and the bow up, whatever the tail: the sign of each follows from where it stands.
    """
    boat = replace(bs.load_vehicle(vehicle), actuators=finned(*fins(*TAILS[tail])).actuators)
    for k, angle in enumerate(np.radians(TAILS[tail]), 1):
        rates = rates_after(boat, **{f"fin_{k}_deg": 0.05})
        for side, turn, push in ((rates[1], rates[5], np.cos(angle)), (rates[2], -rates[4], np.sin(angle))):
            if abs(push) > 0.1:
                assert np.sign(side) == np.sign(push)
                assert np.sign(turn) == -np.sign(push)
    # Positive rudder turns to port, positive stern planes pitch down, with X fins as with a rudder.
    boat = replace(bs.load_vehicle(vehicle), actuators=finned(*fins(*X_TAIL)).actuators)
    turn = bs.simulate(boat, bs.load_manoeuvre("turning_circle", boat), dt=0.1)
    assert turn.states[0, 200:, R].max() < 0.0


def test_a_sign_is_one_key(finned):
    """The same order with the log's sign reversed: the fin's column is the other way round, and nothing else is."""
    plain = finned(*fins(*X_TAIL))
    first, *others = fins(*X_TAIL)
    turned = finned(first | {"sign": -1}, *others)
    one, two = (bs.load_manoeuvre("coupled", vehicle) for vehicle in (plain, turned))
    np.testing.assert_array_equal(two.inputs * [-1, 1, 1, 1], one.inputs)
    np.testing.assert_array_equal(two.controls, one.controls)


def test_a_given_matrix_stands_instead_of_geometry(finned):
    shares = [{"rudder_deg": 0.25 * a, "stern_plane_deg": 0.25 * b} for a, b in ((1, -1), (-1, -1), (-1, 1), (1, 1))]
    given = [fin | {"mixing": mixing, "sign": -1} for fin, mixing in zip(fins(*X_TAIL), shares, strict=True)]
    given.append(FIN | {"name": "bow_planes", "mixing": {"bow_plane_deg": 1.0}})
    actuators = finned(*given).actuators
    np.testing.assert_allclose(actuators.mixing[RUDDER], [-0.25, 0.25, 0.25, -0.25, 0])
    np.testing.assert_allclose(actuators.mixing @ actuators.allocation, np.eye(3), atol=1e-15)
    assert actuators.columns[-1] == "bow_planes_deg"


def test_x_fins_fly_as_rudder_and_planes_that_are_not_hurried(finned):
    """A tail that is never short of rate or angle answers rudder alone as a rudder does, with its lag."""
    dynamics = {"rate_deg_s": 500.0, "time_constant_s": 1.0, "limit_deg": 60.0}
    given = {"rate_deg_s": 500.0, "time_constant_s": 1.0, "rudder_limit_deg": 60.0, "plane_limit_deg": 60.0}
    crossed = finned(*fins(*X_TAIL, **dynamics))
    plain = finned(actuators=given)  # instead of the array
    for name in ("horizontal", "vertical", "coupled", "random:5"):
        one, two = (bs.load_manoeuvre(name, vehicle) for vehicle in (crossed, plain))
        np.testing.assert_allclose(one.controls, two.controls, rtol=0, atol=1e-9)  # closed loops see round-off
        tracks = [bs.simulate(*pair, dt=0.5).states[0] for pair in ((crossed, one), (plain, two))]
        np.testing.assert_allclose(*tracks, rtol=0, atol=1e-5)


def test_each_fin_has_its_own_limit_and_rate(finned):
    """Rudder and stern planes together ask more of two fins of an X tail than they have."""
    vehicle = finned(*fins(*X_TAIL, limit_deg=20.0, **RATE))
    orders = {"rudder_deg": (np.zeros(1), np.radians([20.0])), "stern_plane_deg": (np.ones(1), np.radians([20.0]))}
    angles = np.degrees(vehicle.actuators.responses(LAG, orders, "test"))
    assert np.abs(angles).max() <= 20.0 + 1e-12
    assert np.abs(np.diff(angles, axis=0)).max() <= 0.1 * RATE["rate_deg_s"] + 1e-12
    np.testing.assert_allclose(angles[-1], [0.0, -20.0, 0.0, 20.0], atol=0.1)  # of 28.3 that are asked
    np.testing.assert_allclose(np.degrees(vehicle.actuators.limits[RUDDER]), 20.0 * np.sqrt(2.0))


def test_a_closed_loop_of_fins_is_a_fixed_point(finned, monkeypatch):
    """Rudder by the clock and stern planes by the autopilot share the fins: the recorded inputs fly the same track."""
    kept = {}
    hold = closed_loop.Flight.hold

    def keeping(flight, orders, n):
        hold(flight, orders, n)
        kept["inputs"] = flight.inputs

    vehicle = finned(*fins(*X_TAIL, **RATE))
    file = read_manoeuvre(toml_files.find("coupled", "manoeuvres")).model_copy(update={"recorded_on": None})
    monkeypatch.setattr(closed_loop.Flight, "hold", keeping)
    orders = file.recorded(vehicle)
    replayed = file.responses(vehicle, orders)
    assert np.abs(replayed).max(axis=0).min() > 0.1
    np.testing.assert_allclose(replayed, kept["inputs"], rtol=0, atol=1e-13)


def test_thrust_and_torque_of_a_propeller(finned):
    """Against the open-water diagram itself: T = (1 - t) rho n^2 D^4 K_T(J), Q = rho n^2 D^5 K_Q(J)."""
    vehicle = finned(PORT, propulsion={"model": "none"})
    n, u, rho, d = 100.0 / 60.0, 6.0, vehicle.water_density_kgm3, 4.0
    advance = 0.8 * u / (n * d)
    thrust = 0.9 * rho * n**2 * d**4 * (0.4 - 0.3 * advance)
    torque = rho * n**2 * d**5 * (0.05 - 0.03 * advance)
    wrench = vehicle.actuators.wrenches(np.array([[100.0]]), None)[0]
    expected = [thrust, 0, 0, -torque, 0.5 * thrust, 3.0 * thrust]  # 3 m to port: turns the bow to starboard
    np.testing.assert_allclose(wrench[:6] + u * wrench[6:], expected, rtol=1e-12, atol=1e-9)
    wrench = vehicle.actuators.wrenches(np.array([[-100.0]]), None)[0]
    advance = -advance
    thrust = -0.9 * rho * n**2 * d**4 * (0.4 - 0.3 * advance)
    np.testing.assert_allclose(wrench[0] + u * wrench[6], thrust, rtol=1e-12)
    horizontal = vehicle.actuators.wrenches(np.array([[100.0]]), "horizontal")[0]
    np.testing.assert_array_equal(horizontal.reshape(2, 6)[:, 2:5], 0.0)


def test_which_way_propellers_and_thrusters_turn(finned):
    """More revolutions to port turn to starboard, counter-rotating shafts leave no roll, a thruster pushes the bow."""
    vehicle = finned(*fins(*X_TAIL), PORT, STARBOARD, BOW, propulsion={"model": "none"})
    even = rates_after(vehicle, port_rpm=100.0, starboard_rpm=100.0)
    uneven = rates_after(vehicle, port_rpm=100.0)
    assert even[0] > uneven[0] > 0.0
    assert uneven[5] > 0.0
    torques = vehicle.actuators.wrenches(np.array([[0, 0, 0, 0, 100.0, 100.0, 0]]), None)[0]
    np.testing.assert_allclose(torques[[1, 3, 5]], 0.0, atol=1e-9)
    pushed = rates_after(vehicle, bow_thruster_n=5e4)
    assert pushed[1] > 0.0
    assert pushed[5] > 0.0


def test_a_wrench_is_a_force(finned):
    """M a = the wrench, with the mass matrix of the boat: forces from outside act as any others."""
    vehicle = finned(*fins(*X_TAIL), PORT, BOW)
    values = dict(zip(vehicle.actuators.shorts, [0, 0, 0, 0, 120.0, 4e4], strict=True))
    change = vehicle.actuators.wrenches(np.array([list(values.values()), vehicle.actuators.rest]), None)
    change = change[:, :6] + vehicle.speed_mps * change[:, 6:]
    rates = rates_after(vehicle, port_rpm=120.0, bow_thruster_n=4e4)
    np.testing.assert_allclose(vehicle.mass_matrix @ rates, change[0] - change[1], rtol=1e-8, atol=1e-3)


def test_propellers_instead_of_propulsion(finned):
    """A propeller on the axis with a constant K_T is that of [propulsion]."""
    section = {"model": "constant_kt", "kt": 0.35, "diameter_m": 4.0, "thrust_deduction": 0.15}
    usual = finned(*fins(*X_TAIL), propulsion=section)
    own = PORT | {"name": "main", "position_m": [-45, 0, 0], "kt0": 0.35, "kt1": 0.0, "kq0": 0.0, "kq1": 0.0}
    own |= {"thrust_deduction": 0.15, "rpm": usual.rpm_per_mps * usual.speed_mps}
    other = finned(*fins(*X_TAIL), own, propulsion={"model": "none"})
    tracks = [bs.simulate(v, bs.load_manoeuvre("random:4", v), dt=0.5).states[0] for v in (usual, other)]
    np.testing.assert_allclose(*tracks, rtol=0, atol=1e-7)


def test_a_log_has_the_columns_of_the_fins(finned, tmp_path):
    """What is simulated is written with angles of fins, revolutions and forces, and read back as the same manoeuvre."""
    vehicle = finned(*fins(*X_TAIL), PORT, BOW)
    manoeuvre = bs.load_manoeuvre("random:6", vehicle)
    assert manoeuvre.input_columns == (*(f"fin_{k}_deg" for k in range(1, 5)), "port_rpm", "bow_thruster_n")
    track = bs.simulate(vehicle, manoeuvre, dt=0.5)
    track.save(tmp_path / "track.csv")
    log = log_files.read_log(tmp_path / "track.csv", vehicle.actuators.columns)
    assert set(manoeuvre.input_columns) <= log.keys()
    assert not set(log_files.CONTROLS) & log.keys()
    back = bs.load_manoeuvre(tmp_path / "track.csv", vehicle)
    np.testing.assert_allclose(back.inputs, manoeuvre.inputs, rtol=1e-11, atol=1e-13)  # twelve digits
    np.testing.assert_allclose(back.controls, manoeuvre.controls, rtol=0, atol=4e-12)
    # What a log does not say: fins and thrusters rest at zero, propellers at the revolutions of the trial speed.
    (tmp_path / "fin.csv").write_text("time_s,fin_1_deg\n0,0\n100,10\n")
    back = bs.load_manoeuvre(tmp_path / "fin.csv", vehicle)
    np.testing.assert_allclose(back.inputs[-1], [np.radians(10.0), 0, 0, 0, 90.0, 0])


def test_thrusters_and_fins_are_ordered_by_their_columns(finned, tmp_path):
    """Steps of a manoeuvre file may order single actuators; those of a fin add to what the rudder asks of it."""
    vehicle = finned(*fins(*X_TAIL), PORT, BOW)
    (tmp_path / "steps.toml").write_text(
        'name = "steps"\nkind = "steps"\nduration_s = 100.0\n[demands]\ntime_s = [10, 50]\nrudder_deg = [10, 0]\n'
        "fin_1_deg = [2, 2]\nport_rpm = [60, 120]\nbow_thruster_n = [2e4, 2e5]\n"
    )
    manoeuvre = bs.load_manoeuvre(tmp_path / "steps.toml", vehicle)
    at = dict(zip(manoeuvre.input_columns, manoeuvre.inputs[[0, 400, -1]].T, strict=True))
    cosine = 10.0 * np.sqrt(0.5)
    np.testing.assert_allclose(np.degrees(at["fin_1_deg"]), [0.0, cosine + 2.0, 2.0], atol=1e-6)
    np.testing.assert_allclose(np.degrees(at["fin_2_deg"]), [0.0, -cosine, 0.0], atol=1e-6)
    np.testing.assert_array_equal(at["port_rpm"], [90.0, 60.0, 120.0])
    np.testing.assert_array_equal(at["bow_thruster_n"], [0.0, 2e4, 1e5])  # its limit


def test_logs_and_orders_of_another_boat(crossed, suboff, tmp_path):
    """Errors in one line that say what the boat has."""
    (tmp_path / "log.csv").write_text("time_s,rudder_deg,fin_1_deg\n0,0,0\n100,10,0\n")
    with refused("unknown", "rudder_deg"):
        bs.load_manoeuvre(tmp_path / "log.csv", crossed)
    with refused("unknown", "fin_1_deg"):
        bs.load_manoeuvre(tmp_path / "log.csv", suboff)
    (tmp_path / "still.csv").write_text("time_s,rudder_deg,fin_1_deg\n0,0,0\n100,0,5\n")
    assert bs.load_manoeuvre(tmp_path / "still.csv", crossed).controls[-1, RUDDER] > 0.0
    with refused("conflict", "m"):
        bs.simulate(crossed, bs.Manoeuvre("m", LAG, np.zeros((81, 3)), np.ones(81), np.eye(12)[6]), dt=0.1)
    with refused("model", "bow_plane_deg"):
        bs.load_manoeuvre("comparison", crossed)
    with refused("unknown", "elevator_deg"):
        crossed.actuators.share("elevator_deg", "'x'")


def test_a_tail_without_a_rudder(finned):
    vehicle = finned(*fins(90.0, 270.0))
    bs.load_manoeuvre("vertical", vehicle)
    with refused("model", "rudder_deg"):
        bs.load_manoeuvre("turning_circle", vehicle)


def test_parameters_change_what_acts(crossed):
    """scale * value + bias, as if the log had said so; a batch has its own amounts, bit for bit."""
    manoeuvre = bs.load_manoeuvre("random:7", crossed)
    amounts = {"bias_fin_1_deg": 1.5, "scale_fin_3": -0.2}
    inputs = manoeuvre.inputs.copy()
    inputs[:, 0] += np.radians(1.5)
    inputs[:, 2] *= 0.8
    changed = of_inputs("bent", manoeuvre.times, inputs, manoeuvre.rpm, manoeuvre.initial_state, crossed)
    times = np.linspace(0.0, manoeuvre.duration, 50)
    expected = Simulator(crossed, changed, times, dt=0.5).run(crossed.xi)[0]
    simulator = Simulator(crossed, manoeuvre, times, dt=0.5, varied=tuple(amounts))
    sets = np.repeat(crossed.xi[None], 3, axis=0)
    found = simulator.run(sets, amounts=np.array([[0.0, 0.0], list(amounts.values()), [1.5, 0.0]]))[0]
    np.testing.assert_allclose(found[1], expected[0], rtol=0, atol=1e-9)  # round-off over 600 s and 4,000 m
    np.testing.assert_array_equal(found[0], simulator.run(crossed.xi)[0][0])
    assert np.abs(found[2] - expected[0]).max() > 1.0
    fixed = Simulator(crossed, manoeuvre, times, dt=0.5, changes=amounts).run(crossed.xi)[0]
    np.testing.assert_allclose(fixed, expected, rtol=0, atol=1e-9)


REFUSED = [
    ([FIN | {"name": "a"}], "value", "actuators.0"),
    ([FIN | {"name": "a", "angle_deg": 0.0, "limit_deg": 0.0}], "value", "actuators.0.limit_deg"),
    ([FIN | {"name": "a", "angle_deg": 0.0, "rate_deg_s": -1.0}], "value", "actuators.0.rate_deg_s"),
    ([FIN | {"name": "a", "angle_deg": 0.0, "time_constant_s": 0.0}], "value", "actuators.0.time_constant_s"),
    ([FIN | {"name": "a", "angle_deg": 0.0, "sign": 2}], "value", "actuators.0.sign"),
    ([FIN | {"name": "a", "angle_deg": 0.0, "angel_deg": 0.0}], "unknown", "actuators.0.angel_deg"),
    ([FIN | {"name": "a", "angle_deg": 0.0, "x_m": 3.0}], "value", "actuators.0"),
    ([FIN | {"name": "A fin", "angle_deg": 0.0}], "value", "actuators.0.name"),
    ([FIN | {"name": "a", "mixing": {"ruder_deg": 1.0}}], "unknown", "ruder_deg"),
    ([FIN | {"name": "a", "mixing": {"aileron_deg": 1.0}}], "model", "a"),
    ([FIN | {"name": "a", "mixing": {"rudder_deg": 0.0}}], "value", "actuators.0"),
    (fins(0.0, 90.0, name="a"), "conflict", "a"),
    (fins(0.0, 90.0, column="a_deg"), "conflict", "a_deg"),
    (fins(0.0, column="a_n"), "value", "actuators.0"),
    (fins(0.0, column="yaw_deg"), "value", "actuators.0"),
    ([], "missing", "actuators"),
    ([{"name": "a"}], "missing", "actuators.0.kind"),
    ([{"kind": "finn", "name": "a"}], "unknown", "actuators.0.kind"),
    ([BOW | {"direction": [0, 0, 0]}], "value", "actuators.0"),
    ([BOW | {"limit_n": 0}], "value", "actuators.0.limit_n"),
    ([BOW | {"position_m": [300.0, 0, 0]}], "value", "position_m"),
    ([PORT | {"column": "rpm"}], "value", "actuators.0"),
    ([PORT | {"diameter_m": -1.0}], "value", "actuators.0.diameter_m"),
    ([PORT | {"kt0": 1e300, "diameter_m": 1e6}], "model", ""),
    (3, "value", "actuators"),
]


@pytest.mark.parametrize(("actuators", "kind", "key"), REFUSED)
def test_refused(boat, vehicle_with, actuators, kind, key):
    with refused(kind, key) as error:
        vehicle_with(boat | {"actuators": actuators})
    assert "boat.toml" in str(error.value)
    assert len(str(error.value).splitlines()) == 1


def test_both_tables_are_refused(suboff_file, tmp_path):
    (tmp_path / "boat.toml").write_text(f'{suboff_file}\n[[actuators]]\nkind = "fin"\n')
    with refused("conflict", "actuators"):
        bs.load_vehicle(tmp_path / "boat.toml")
