"""A boat exported to Gazebo flies by the formulas of its plugins as `simulate` does."""

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from support import gazebo
from support.refusals import refused

import bayesub as bs
from bayesub.findings import simulator_conventions as conventions
from bayesub.model.added_mass import coefficients_of
from bayesub.study.after.knowledge import of_moments

TURNED = np.array([1.0, -1.0, -1.0] * 2)  # from axes forward, to starboard and down
# Orders in N at 0 and 15 s. The horizontal thrusters push below the origin; the vertical ones balance their moment.
THRUSTERS = {
    "ahead_and_round": {
        "t1_n": [15, 14.7], "t2_n": [15, 15.3], "t3_n": [-15, -14.7], "t4_n": [-15, -15.3],
        "t5_n": [-7.5, -7.5], "t6_n": [-7.5, -7.5], "t7_n": [7.5, 7.5], "t8_n": [7.5, 7.5],
    },
    "aside_and_up": {
        "t1_n": [-8, -8.5], "t2_n": [8, 8.5], "t3_n": [-8, -7.5], "t4_n": [8, 7.5],
        "t5_n": [0.8, 0.5], "t6_n": [5.2, 5], "t7_n": [0.8, 1], "t8_n": [5.2, 5],
    },
    "pitching_and_rolling": {
        "t1_n": [2.3, -2.8], "t2_n": [3.7, -1.2], "t3_n": [-3.3, 0.8], "t4_n": [-2.7, 3.2],
        "t5_n": [1, -0.5], "t6_n": [-1, 0.8], "t7_n": [1, 0.5], "t8_n": [0.5, -0.3],
    },
}  # fmt: skip


def known(vehicle):
    return of_moments(vehicle.equations.names[:1], vehicle.xi[:1], np.eye(1) * 1e-12)


def model(vehicle, changes=None):
    return gazebo.Model(conventions.written("gazebo", conventions.Boat(vehicle, known(vehicle)), "test"), changes)


def thruster_manoeuvre(name, folder):
    orders = "".join(f"{column} = {values}\n" for column, values in THRUSTERS[name].items())
    path = folder / f"{name}.toml"
    path.write_text(f'name = "{name}"\nkind = "steps"\nduration_s = 40.0\n[demands]\ntime_s = [0.0, 15.0]\n{orders}')
    return path


def errors(vehicle, manoeuvre, exported, extra=None):
    """Largest distance (m) of the exported boat from ours at the same time, and the length of the path, m."""
    flown = bs.simulate(vehicle, manoeuvre, subproblem=None, sample=manoeuvre.duration / 800)
    times, histories = flown.times, manoeuvre.log
    assert flown.status[0] == "ok"

    def pushed(time, velocity):
        force = np.zeros(6)
        for name, column in (("rudder", "delta_r"), ("stern_plane", "delta_s")):
            if name in exported.fins and column in histories:
                force += exported.fin(name, np.interp(time, manoeuvre.times, histories[column]), velocity)
        for name, push in exported.thrusters.items():
            force += push * np.interp(time, manoeuvre.times, histories[f"{name}_n"])
        return force + (0.0 if extra is None else extra(time, velocity, histories))

    start = manoeuvre.initial_state
    track = exported.fly(times, start[6], start[2], pushed, substeps=2)
    ours = flown.states[0, :, :3]
    way = np.linalg.norm(np.diff(ours, axis=0), axis=1).sum()
    return np.linalg.norm(track - ours, axis=1).max(), way


@pytest.mark.parametrize("name", THRUSTERS)
def test_bluerov2_flies_by_the_plugins_as_simulated(name, tmp_path):
    """Nothing of it is lost: hull and thrusters repeat the track to 0.1 % of the path."""
    vehicle = bs.load_vehicle("bluerov2")
    manoeuvre = bs.load_manoeuvre(thruster_manoeuvre(name, tmp_path), vehicle)
    error, way = errors(vehicle, manoeuvre, model(vehicle))
    print(f"{name}: {error:.3g} m of {way:.4g} m")
    assert way > 2.0
    assert error < 1e-3 * way


def test_a_changed_sign_is_seen(tmp_path):
    """Negative control: the product that turns with the wrong sign leads astray by more than ten times as much."""
    vehicle = bs.load_vehicle("bluerov2")
    manoeuvre = bs.load_manoeuvre(thruster_manoeuvre("ahead_and_round", tmp_path), vehicle)
    wrong = model(vehicle, {"yRU": 2.0 * 6.36})
    error, way = errors(vehicle, manoeuvre, wrong)
    assert error > 1e-2 * way


def of_remus(time, velocity, histories):  # noqa: ARG001
    """The propeller, which is not part of the file: 3.86 N and -0.543 N m (Prestero 2001, table C.9)."""
    return np.array([3.86, 0.0, 0.0, -0.543, 0.0, 0.0])


def own_fins(vehicle):
    """The forces of the fins as the terms have them, turned to the axes of Gazebo."""
    xi = dict(zip(vehicle.equations.names, vehicle.xi.tolist(), strict=True))

    def pushed(time, velocity, histories):
        dr, ds = (np.interp(time, histories["at"], histories[column]) for column in ("delta_r", "delta_s"))
        square = velocity[0] ** 2
        side, yaw = xi["Yuudr"] * square * dr, xi["Nuudr"] * square * dr
        down, pitch = xi["Zuuds"] * square * ds, xi["Muuds"] * square * ds
        return TURNED * [0.0, side, down, 0.0, pitch, yaw] + of_remus(time, velocity, histories)

    return pushed


@pytest.fixture(scope="module")
def remus():
    return bs.load_vehicle("remus100")


@pytest.mark.parametrize("name", ["turning_circle", "vertical", "coupled"])
def test_a_torpedo_flies_by_the_plugin_as_simulated(remus, name):
    """All products of the hull, with the fins as its terms have them: 0.1 % of the path."""
    manoeuvre = bs.load_manoeuvre(name, remus)
    exported = model(remus)
    exported.fins = {}
    extra = own_fins(remus)
    error, way = errors(remus, manoeuvre, exported, lambda t, v, h: extra(t, v, h | {"at": manoeuvre.times}))
    print(f"{name}: {error:.3g} m of {way:.4g} m")
    assert error < 1e-3 * way


@pytest.mark.parametrize("name", ["turning_circle", "vertical", "coupled"])
def test_fins_of_liftdrag_are_nearly_those_of_the_terms(remus, name):
    """They take the speed at the fin, not u, and turn with the flow there: some per cent of the path."""
    manoeuvre = bs.load_manoeuvre(name, remus)
    error, way = errors(remus, manoeuvre, model(remus), of_remus)
    print(f"{name}: {error:.3g} m of {way:.4g} m")
    assert error < 0.1 * way


def test_fins_push_as_terms_do_in_straight_flight(remus):
    """Force and moment of a fin without drift: those of the coefficients, in Gazebo's axes."""
    exported, xi = model(remus), dict(zip(remus.equations.names, remus.xi.tolist(), strict=True))
    velocity = np.array([1.4, 0.0, 0.0, 0.0, 0.0, 0.0])
    rudder = 1.4**2 * 0.1 * np.array([0.0, xi["Yuudr"], 0.0, 0.0, 0.0, xi["Nuudr"]])
    np.testing.assert_allclose(exported.fin("rudder", 0.1, velocity), TURNED * rudder, rtol=1e-7, atol=1e-12)
    plane = 1.4**2 * 0.1 * np.array([0.0, 0.0, xi["Zuuds"], 0.0, xi["Muuds"], 0.0])
    np.testing.assert_allclose(exported.fin("stern_plane", 0.1, velocity), TURNED * plane, rtol=1e-7, atol=1e-12)


@pytest.mark.parametrize("name", ["remus100", "suboff", "npsauv_crossflow", "slocum_comet", "lrauv", "bluerov2"])
def test_forces_of_the_plugin_are_ours_without_what_is_named(name, rng):
    """At random motions; every term that is not zero is a parameter, a fin, or named with a reason."""
    vehicle = bs.load_vehicle(name)
    boat = conventions.Boat(vehicle, known(vehicle))
    text = conventions.written("gazebo", boat, "test")
    lost = {row["from"] for row in boat.others({"": ""})}
    exported = gazebo.Model(text)
    named = text.partition("-->")[0]
    assert all(f"{term} = " in named for term in lost)
    fins = {name for name in boat.taken if vehicle.equations.term(name).symbols & {"dr", "ds", "db"}}
    xi = np.array([0.0 if n in lost | fins else x for n, x in zip(vehicle.equations.names, vehicle.xi, strict=True)])
    states = np.zeros((1, 12))
    states[0, 6:] = vehicle.speed_mps * rng.uniform(-1.0, 1.0, 6)
    controls = np.zeros((1, len(vehicle.equations.controls) + 1))
    accelerations = rng.uniform(-1.0, 1.0, (1, 6))
    columns = vehicle.equations.regressors(states, accelerations, controls, vehicle.constants)
    ours = []
    for axis in "XYZKMN":
        places = vehicle.equations.columns(vehicle.equations.names_of_axis(axis))
        ours.append(columns[axis][0] @ (xi * vehicle.dimensional_factors)[places])
    velocity, rates = TURNED * states[0, 6:], TURNED * accelerations[0]
    theirs = exported.hydrodynamics(velocity) + (exported.added - exported.fluid) @ rates
    theirs = theirs - gazebo.carried(velocity, exported.fluid @ velocity)
    np.testing.assert_allclose(TURNED * theirs, ours, rtol=1e-6, atol=1e-7 * np.abs(ours).max())
    xml = ElementTree.fromstring(text)
    assert xml.find("model").get("name") == name


def test_mass_and_places_are_turned():
    """The rigid body of a boat with all offsets and products of inertia is ours in Gazebo's axes."""
    vehicle = bs.load_vehicle("npsauv_crossflow")
    body = vehicle.rigid_body | {"xG": 0.1, "yG": -0.05, "zG": 0.07, "Ixy": 12.0, "Iyz": -7.0, "Izx": 5.0}
    body |= {"xB": 0.02, "yB": 0.03, "zB": -0.01}
    changed = replace(vehicle, body=np.array(list(body.values())))
    exported, boat = model(changed), conventions.Boat(changed, known(changed))
    np.testing.assert_allclose(exported.rigid, boat.rigid_mass * np.outer(TURNED, TURNED), rtol=1e-7, atol=1e-4)
    np.testing.assert_allclose(exported.buoyant, [0.02, -0.03, 0.01])
    assert exported.lift == pytest.approx(body["buoyancy"], rel=1e-7)


def test_products_of_fossen_are_those_of_the_added_mass():
    """Kirchhoff's, so that Gazebo, whose engine adds these to an added mass, gets no product from the file."""
    vehicle = bs.load_vehicle("bluerov2")
    equations, diagonal = vehicle.equations, [6.36, 7.12, 18.68, 0.189, 0.135, 0.222]
    ideal = coefficients_of(np.diag(diagonal), equations)
    names = [n for n, x in zip(equations.names, ideal, strict=True) if x]
    assert len(names) == 18
    places = equations.columns(names)
    np.testing.assert_allclose(vehicle.xi[places], ideal[places], rtol=1e-12)
    exported = model(vehicle)
    assert not exported.products.any()
    np.testing.assert_allclose(exported.fluid, np.diag(diagonal), rtol=1e-9)


def test_correlations_of_bluerov2_tie_the_products(rng):
    """Draws from the prior obey Kirchhoff to a fifth of the sds, the root of 2 - 2 * 0.98; without ties to 1.4."""
    vehicle = bs.load_vehicle("bluerov2")
    equations = vehicle.equations
    has_sd = np.flatnonzero(np.isfinite(vehicle.sd))
    correlation = vehicle.correlation[np.ix_(has_sd, has_sd)]
    draws = rng.standard_normal((200, len(has_sd))) @ np.linalg.cholesky(correlation).T
    xi = np.tile(vehicle.xi, (200, 1))
    xi[:, has_sd] += vehicle.sd[has_sd] * draws
    own = equations.columns(("Xudot", "Yvdot", "Zwdot", "Kpdot", "Mqdot", "Nrdot"))
    ideal = np.array([coefficients_of(np.diag(-one[own]), equations) for one in xi])
    example = coefficients_of(np.diag([1.0, 2.0, 3.0, 4.0, 6.0, 9.0]), equations)
    products = [k for k, x in enumerate(example) if x and k not in own]
    assert len(products) == 12
    off = (xi - ideal)[:, products] / vehicle.sd[products]
    assert off.std() == pytest.approx(0.2, rel=0.15)


def test_top_speed_of_bluerov2_is_that_of_its_comment():
    """Four thrusters of 40 N at 45 degrees against linear and quadratic drag: 0.85 m/s; with Wu's drag 2.4 m/s."""
    vehicle = bs.load_vehicle("bluerov2")
    thrust = sum(abs(one.force[0]) * one.limit for one in vehicle.actuators.members[:4])
    xi = dict(zip(vehicle.equations.names, vehicle.xi.tolist(), strict=True))
    for linear, square, speed in ((-xi["Xu"], -xi["Xuu"], 0.85), (4.03, 18.18, 2.4)):
        found = (-linear + np.sqrt(linear**2 + 4.0 * square * thrust)) / (2.0 * square)
        assert found == pytest.approx(speed, rel=0.01)


@pytest.mark.parametrize("kind", ["gazebo", "stonefish", "holoocean"])
def test_a_planar_boat_is_refused(kind):
    vehicle = bs.load_vehicle("mariner")
    with refused("conflict", "--as"):
        conventions.written(kind, conventions.Boat(vehicle, known(vehicle)), "test")
