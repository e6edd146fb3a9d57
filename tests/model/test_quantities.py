"""Quantities of a boat: turning circles, zig-zags, stability and dives, and their derivatives by coefficients."""

import numpy as np
import pytest

import bayesub as bs
from bayesub.kernels import workspace
from bayesub.model.quantities import GLIDES, QUANTITIES, gradient

SUBOFF = bs.load_vehicle("suboff")
UNSTABLE = {"spiral_loop_width_deg": "remus100", "critical_speed_mps": "auv690"}  # which suboff does not have


def _value(name, vehicle=SUBOFF):
    return QUANTITIES[name].values(vehicle, vehicle.xi)[0]


def _flown(manoeuvre, dt=0.05):
    return bs.simulate(SUBOFF, bs.load_manoeuvre(manoeuvre, SUBOFF), dt=dt)


def test_turning_measures_are_those_of_a_simulated_turn(tmp_path):
    (tmp_path / "turn.toml").write_text(
        'name = "turn"\nkind = "steps"\nsubproblem = "horizontal"\nduration_s = 800.0\n'
        "[demands]\ntime_s = [0.0]\nrudder_deg = [30.0]\n"
    )
    flight = _flown(tmp_path / "turn.toml")
    x, y, psi, u, v, r = flight.outputs(("x", "y", "psi", "u", "v", "r"))[0].T
    quarter, half = (np.argmax(np.abs(psi) >= angle) for angle in (np.pi / 2, np.pi))
    assert _value("advance_m") == pytest.approx(x[quarter], abs=0.5)
    assert _value("transfer_m") == pytest.approx(abs(y[quarter]), abs=0.8)
    assert _value("tactical_diameter_m") == pytest.approx(abs(y[half]), abs=0.5)
    assert _value("steady_turning_diameter_m") == pytest.approx(2 * np.hypot(u[-1], v[-1]) / abs(r[-1]), rel=1e-6)
    assert _value("turning_speed_loss") == pytest.approx(1 - np.hypot(u[-1], v[-1]) / SUBOFF.speed_mps, abs=1e-6)


def test_the_overshoot_is_that_of_the_zigzag_in_closed_loop():
    flight = _flown("zigzag_10_10")
    first = np.argmax(np.diff(np.sign(np.diff(flight.controls[:, 0]))))
    headings = np.abs(np.degrees(flight.outputs(("psi",))[0, : first + 1000, 0]))
    assert _value("zigzag_overshoot_deg") == pytest.approx(headings.max() - 10.0, abs=0.1)


def test_the_depth_of_a_dive_is_simulated(tmp_path):
    duration = 4.0 * SUBOFF.length_m / SUBOFF.speed_mps
    (tmp_path / "dive.toml").write_text(
        f'name = "dive"\nkind = "steps"\nsubproblem = "vertical"\nduration_s = {duration}\n'
        "[demands]\ntime_s = [0.0]\nstern_plane_deg = [10.0]\n"
    )
    depths = _flown(tmp_path / "dive.toml").outputs(("z",))[0, :, 0]
    assert _value("dive_depth_m") == pytest.approx(depths[-1] - depths[0], rel=1e-3)


def test_roots_of_sway_and_yaw_are_those_of_the_linear_equations():
    c = dict(zip(SUBOFF.equations.names, SUBOFF.xi * SUBOFF.dimensional_factors, strict=True))
    mass, speed = SUBOFF.body[workspace.MASS], SUBOFF.speed_mps
    inertia = SUBOFF.mass_matrix[np.ix_([1, 5], [1, 5])]
    inertia[0, 1] = -c["Yrdot"]  # the horizontal plane has no offset of the centre of gravity
    inertia[1, 0] = -c["Nvdot"]
    damping = np.array([[c["Yuv"], c["Yur"] - mass], [c["Nuv"], c["Nur"]]]) * speed
    roots = np.linalg.eigvals(np.linalg.solve(inertia, damping))
    assert _value("straight_line_stability") == pytest.approx(roots.real.max(), rel=1e-5)


@pytest.mark.parametrize("name", QUANTITIES)
def test_a_batch_is_its_members_and_gradients_tell_small_changes(name, rng):
    boat, quantity = bs.load_vehicle(UNSTABLE.get(name, "suboff")), QUANTITIES[name]
    columns = np.flatnonzero(boat.xi)
    changes = np.zeros((3, len(boat.xi)))
    changes[:, columns] = 1e-3 * rng.standard_normal((3, len(columns))) * boat.xi[columns]
    after, before = (quantity.values(boat, boat.xi + sign * changes) for sign in (1.0, -1.0))
    assert after == pytest.approx([quantity.values(boat, boat.xi + one)[0] for one in changes], rel=1e-9)
    expected = changes[:, columns] @ gradient(boat, quantity, columns)
    assert 0.5 * (after - before) == pytest.approx(expected, rel=1e-3)


def test_a_ship_does_not_dive_and_says_why():
    ship = bs.load_vehicle("mariner")
    assert "three degrees of freedom" in QUANTITIES["dive_depth_m"].reason(ship)
    assert np.isnan(_value("dive_depth_m", ship))
    assert not QUANTITIES["advance_m"].reason(ship)
    glider = bs.load_vehicle("slocum_comet")
    assert "rudder_deg" in QUANTITIES["advance_m"].reason(glider)
    assert QUANTITIES["vertical_stability"].reason(glider) == GLIDES


def test_a_heading_that_is_not_reached_is_no_number():
    xi = SUBOFF.xi.copy()
    xi[SUBOFF.equations.columns(["Nuu_dr", "Yuu_dr"])] = 0.0
    sets = np.stack([SUBOFF.xi, xi])
    for name in ("tactical_diameter_m", "advance_m", "transfer_m", "zigzag_overshoot_deg"):
        values = QUANTITIES[name].values(SUBOFF, sets)
        assert np.isfinite(values).tolist() == [True, False], name
