"""The set `mmg` and the ship `esso_osaka`: forces typed here once more, rest, a propeller astern, wind in a log."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.model.manoeuvres import Manoeuvre, straight_and_level

X, Y, N = 0, 1, 5
SHIP = Path(__file__).parents[3] / "studies" / "esso_osaka" / "vehicle.toml"
WIND = "wind_along_mps", "wind_across_mps"
HEAD = (
    'name = "mine"\ntitle = ""\n[controls]\n{}\n[terms.X]\n'
    'Xuu = {{ regressor = "u^2", length_power = 2, label = "X", meaning = "m" }}\n'
)


@pytest.fixture(scope="module")
def ship():
    return bs.load_vehicle(SHIP)


def forces(ship, u, v, r, turns, angle, along, across):
    """X and Y, N, and N, N m, without added mass: rates times the length are speeds, as that of the propeller is.

    The propeller turns `turns` times a minute, the rudder has an `angle`, rad, and the wind past the boat the
    velocities `along` and `across`.
    """
    c = dict(zip(ship.equations.names, ship.xi, strict=True))
    w, n, size = r * ship.length_m, turns / ship.rpm_per_mps, np.abs
    square, cube = angle**2, angle**3
    surge = c["Xu_absu"] * u * size(u) + c["Xuu"] * u**2 + c["Xvv"] * v**2 + c["Xvr"] * v * w + c["Xrr"] * w**2
    surge += (c["Xn_absn"] * n + c["Xu_absn"] * u) * size(n) + (c["Xnn"] * n + c["Xun"] * u) * n
    surge += (c["Xn_absn_dd"] * n * size(n) + c["Xnndd"] * n**2 + c["Xu_absn_dd"] * u * size(n)) * square
    surge += c["Xu_absu_dd"] * u * size(u) * square
    surge += ((c["Xv_absn_d"] * v + c["Xr_absn_d"] * w) * size(n) + (c["Xuvd"] * v + c["Xurd"] * w) * u) * angle
    surge += (c["Xwx_abswx"] * size(along) + c["Xwx_abswy"] * size(across)) * along

    def lateral(axis):
        c = {name[1:]: value for name, value in zip(ship.equations.names, ship.xi, strict=True) if name[0] == axis}
        force = (c["uv"] * u + c["v_absu"] * size(u) + c["v_absv"] * size(v) + c["v_absr"] * size(w)) * v
        force += (c["ur"] * u + c["r_absu"] * size(u) + c["r_absv"] * size(v) + c["r_absr"] * size(w)) * w
        force += c["uu"] * u**2 + (c["n_absn"] * size(n) + c["nn"] * n) * n + (c["un"] * n + c["u_absn"] * size(n)) * u
        force += (c["vn"] * n + c["v_absn"] * size(n)) * v + (c["rn"] * n + c["r_absn"] * size(n)) * w
        force += (
            c["n_absn_d"] * n * size(n) + c["nnd"] * n**2 + c["und"] * u * n + c["u_absn_d"] * u * size(n)
        ) * angle
        force += (c["u_absu_d"] * u * size(u) + c["uud"] * u**2) * angle
        force += (c["n_absn_ddd"] * n * size(n) + c["nnddd"] * n**2 + c["u_absn_ddd"] * u * size(n)) * cube
        force += c["uuddd"] * u**2 * cube + (c["v_absn_dd"] * v + c["r_absn_dd"] * w) * size(n) * square
        return force + (c["wy_abswy"] * size(across) + c["wy_abswx"] * size(along) + c["wxwy"] * along) * across

    scale = 0.5 * ship.water_density_kgm3 * ship.length_m**2
    return scale * surge, scale * lateral("Y"), scale * ship.length_m * lateral("N")


def accelerations(ship, u, v, r, *inputs):
    """udot, vdot and rdot of the rigid body with the added masses of the file."""
    x, y, n = forces(ship, u, v, r, *inputs)
    body, mass = ship.rigid_body, ship.mass_matrix
    m, xg = body["mass"], body["xG"]
    y, n = y - m * u * r, n - m * xg * u * r
    lateral = np.linalg.solve(mass[np.ix_([Y, N], [Y, N])], np.stack([y, n]))
    return np.stack([(x + m * (v * r + xg * r**2)) / mass[X, X], *lateral])


def test_accelerations_are_those_of_the_formulae(ship, rng):
    """Ahead, astern, at any angle of the rudder and in any wind; in the plane and with nothing out of it."""
    u, v, r = rng.uniform([[-0.3], [-0.2], [-0.1]], [[0.4], [0.2], [0.1]], (3, 60))
    turns, angle = rng.uniform(-1000.0, 1000.0, 60), rng.uniform(-0.7, 0.7, 60)
    along, across = rng.normal(0.0, 3.0, (2, 60))
    states = np.zeros((60, 12))
    states[:, [6, 7, 11]] = np.stack([u, v, r]).T
    found = bs.accelerations(ship, states, np.stack([angle, along, across], axis=1), turns)
    np.testing.assert_allclose(
        found[:, [X, Y, N]].T, accelerations(ship, u, v, r, turns, angle, along, across), rtol=1e-9
    )
    np.testing.assert_array_equal(found[:, 2:5], 0.0)


def flown(ship, turns, wind=(0.0, 0.0), speed=0.0, duration=60.0):
    """The trajectory with the rudder amidships."""
    times = np.arange(0.0, duration + 0.25, 0.5)
    controls = np.tile([0.0, *wind], (len(times), 1))
    start = straight_and_level(ship)
    start[6] = speed
    columns = tuple(control.short for control in ship.equations.controls)
    trial = Manoeuvre("drift", times, controls, np.full(len(times), turns), start, columns=columns)
    return bs.simulate(ship, trial, dt=0.5)


def test_it_rests_in_still_air(ship):
    """Without wind and with the propeller stopped nothing moves, and no derivative is lost at rest."""
    track = flown(ship, 0.0)
    np.testing.assert_array_equal(track.states, 0.0)
    equations = ship.kernels("horizontal").equations
    zero = [np.zeros(4), ship.constants, *np.zeros(6)]
    c = ship.xi * ship.dimensional_factors
    assert np.isfinite(equations.gradient(c, *zero)).all()
    assert np.isfinite(list(equations.control_slopes(c, *zero).values())).all()


def test_the_propeller_stops_it_and_drives_it_astern(ship):
    """It keeps the speed of trials with the propeller speed of its file; turned astern, the propeller stops it."""
    steady = flown(ship, 390.0, speed=ship.speed_mps, duration=100.0).states[0, -1, 6]
    assert steady == pytest.approx(ship.speed_mps, rel=0.05)
    reversed_ = flown(ship, -600.0, speed=ship.speed_mps, duration=300.0).states[0, :, 6]
    assert reversed_.min() < -0.02
    assert np.argmax(reversed_ < 0.0) * 0.5 < 120.0  # s, until it stands


@pytest.mark.parametrize(
    ("wind", "moved", "sign"),
    [((0.0, 3.0), 7, 1.0), ((0.0, -3.0), 7, -1.0), ((3.0, 0.0), 6, 1.0), ((-3.0, 0.0), 6, -1.0)],
)
def test_wind_drives_it_to_lee(ship, wind, moved, sign):
    """A boat at rest is moved to the side to which the air moves."""
    assert sign * flown(ship, 0.0, wind, duration=10.0).states[0, -1, moved] > 1e-3


def test_a_log_with_wind(bayesub, tmp_path, monkeypatch):
    """Written by `simulate`, read by `check` beside the ship, and flown again as it was."""
    monkeypatch.chdir(tmp_path)
    times = np.arange(0.0, 60.5, 1.0)
    gusts = 2.0 + np.sin(times / 5.0), 1.0 + np.cos(times / 7.0)
    rows = np.column_stack([times, 10.0 * np.sin(times / 10.0), 600.0 * np.cos(times / 15.0), *gusts])
    np.savetxt("in.csv", rows, delimiter=",", comments="", header=f"time_s,rudder_deg,rpm,{WIND[0]},{WIND[1]}")
    assert bayesub("simulate", str(SHIP), "in.csv", "-o", "track.csv")[0] == 0
    assert bayesub("simulate", str(SHIP), "in.csv", "-o", "log.csv", "--sensors", "autosub")[0] == 0
    track = np.genfromtxt("track.csv", delimiter=",", names=True)
    assert {*WIND, "rpm", "rudder_deg"} <= set(track.dtype.names)
    np.testing.assert_allclose(track["wind_across_mps"], np.interp(track["time_s"], times, gusts[1]), rtol=1e-9)
    assert bayesub("check", str(SHIP), "log.csv")[0] == 0
    still = np.column_stack([rows[:, :3], 0.0 * rows[:, 3:]])
    np.savetxt("still.csv", still, delimiter=",", comments="", header=f"time_s,rudder_deg,rpm,{WIND[0]},{WIND[1]}")
    assert bayesub("simulate", str(SHIP), "still.csv", "-o", "calm.csv")[0] == 0
    assert abs(track["y_m"] - np.genfromtxt("calm.csv", delimiter=",", names=True)["y_m"])[-1] > 0.3


def test_a_boat_that_the_wind_alone_drives(ship):
    """A log with a propeller that stands still is none of a boat that nothing drives."""
    log = {"time": np.arange(10.0), "rpm": np.zeros(10), "u": np.full(10, 0.1)}
    ship.check_log(log, "drift.csv")
    with refused("data", "rpm"):
        bs.load_vehicle("suboff").check_log(log, "drift.csv")


def test_a_column_of_the_motion_is_no_control(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(HEAD.format('wx = "wind_mps"'))
    assert bs.load_equations(path).controls[0].dimension == (1, -1)
    path.write_text(HEAD.format('wx = "u_mps"'))
    with refused("value", "controls"):
        bs.load_equations(path)


def test_terms_of_the_propeller_need_its_speed(ship, vehicle_with, tmp_path):
    """Of the speed of trials: otherwise a term of n/k0 would have any size."""
    path = tmp_path / "ship.toml"
    path.write_text(SHIP.read_text())
    content = tomllib.loads(path.read_text())
    assert content["propulsion"]["rpm"] / content["trial"]["speed_mps"] == pytest.approx(ship.rpm_per_mps)
    del content["propulsion"]["rpm"]
    with refused("missing", "propulsion.rpm"):
        vehicle_with(content)
