"""Standard manoeuvres of a batch: mirrored ones, stopping in closed form, jams, and boats of other bodies."""

from dataclasses import replace

import numpy as np
import pytest
from support.fins import weaker

import bayesub as bs
from bayesub.kernels import workspace
from bayesub.model import standard_manoeuvres
from bayesub.model.boats import Boats
from bayesub.model.quantities import QUANTITIES
from bayesub.model.standard_manoeuvres import (
    PSI,
    STILL,
    Y,
    at_heading,
    circle_diameter,
    dive_depth,
    fly,
    jam_depth_excursion,
    stopping_distance,
    tactical_diameter,
    turn,
)

SUBOFF = bs.load_vehicle("suboff")
ALONE = Boats(SUBOFF, SUBOFF.xi[None])
UNSTABLE = replace(SUBOFF, xi=np.where(np.array(SUBOFF.equations.names) == "Nuv", 2.1, 1.0) * SUBOFF.xi)


def test_a_mirrored_turn_has_mirrored_numbers():
    port = ALONE.once(turn)
    starboard = fly(ALONE, standard_manoeuvres.TURN, "horizontal", {"rudder_deg": (0.0, -35.0)})
    assert port[0, -1, PSI] < 0.0 < starboard[0, -1, PSI]
    there, here = at_heading(starboard, 180.0)[0], at_heading(port, 180.0)[0]
    assert there[Y] == pytest.approx(-here[Y], rel=1e-12)
    assert circle_diameter(starboard[:, -1]) == pytest.approx(circle_diameter(port[:, -1]), rel=1e-12)
    assert tactical_diameter(ALONE)[0] == pytest.approx(there[Y], rel=1e-12)


@pytest.mark.parametrize("name", ["suboff", "auv690", "npsauv"])
def test_the_stopping_distance_is_that_of_the_equation_of_surge(name):
    """(m - Xudot) u du/dx = (Xuu + b7) u^2 + b9 U^2, on (rho/2) l^2, with m and Xudot on (rho/2) l^3."""
    boat = bs.load_vehicle(name)
    c = dict(zip(boat.equations.names, boat.xi, strict=True))
    body = dict(zip(workspace.BODY, boat.body / (0.5 * boat.water_density_kgm3 * boat.length_m**2), strict=True))
    mass = body["mass"] / boat.length_m - c["Xudot"]
    drag, push = -c["Xuu"] - body["b7"], -body["b9"]
    assert body["b8"] == 0.0
    expected = boat.length_m * mass / (2.0 * drag) * np.log((drag + push) / (drag * STILL**2 + push))
    found = stopping_distance(Boats(boat, np.tile(boat.xi, (3, 1))))
    assert found == pytest.approx(np.full(3, expected), rel=1e-3)


def test_without_a_thrust_polynomial_nothing_is_said_of_stopping():
    for name in ("stopping_distance_m", "jam_depth_excursion_m"):
        assert not QUANTITIES[name].reason(SUBOFF)
    assert "thrust polynomial" in QUANTITIES["stopping_distance_m"].reason(bs.load_vehicle("mariner"))


def test_a_jam_goes_deeper_the_later_the_propeller_is_reversed(monkeypatch):
    depths = []
    for reaction in (0.5, 2.0, 4.0):
        monkeypatch.setattr(standard_manoeuvres, "REACTION", reaction)
        depths.append(jam_depth_excursion(ALONE)[0])
    assert 0.0 < depths[0] < depths[1] < depths[2]
    assert depths[2] > dive_depth(ALONE)[0]  # which ends four lengths after the order
    monkeypatch.setattr(standard_manoeuvres, "REACTION", standard_manoeuvres.JAM)
    assert np.isnan(jam_depth_excursion(ALONE)[0])  # still going down at the end


def test_kernels_of_all_degrees_of_freedom_give_the_same_in_a_plane(rng):
    sets = SUBOFF.xi * (1.0 + 0.05 * rng.standard_normal((3, len(SUBOFF.xi))))
    for quantity in QUANTITIES.values():
        plane, six = (quantity.of(Boats(SUBOFF, sets, in_six=in_six)) for in_six in (False, True))
        assert six == pytest.approx(plane, rel=1e-6, abs=1e-9, nan_ok=True), quantity.name


def test_changes_of_the_body_are_those_of_another_vehicle():
    changes = np.zeros((1, workspace.N_BODY))
    changes[0, [workspace.MASS, workspace.ZG]] = 0.02 * SUBOFF.body[workspace.MASS], 0.1
    other = replace(SUBOFF, body=SUBOFF.body + changes[0])
    for quantity in QUANTITIES.values():
        expected, found = (
            quantity.of(Boats(other, SUBOFF.xi[None])),
            quantity.of(Boats(SUBOFF, SUBOFF.xi[None], changes)),
        )
        assert found == pytest.approx(expected, rel=1e-6, nan_ok=True), quantity.name


@pytest.mark.parametrize(("boat", "depends"), [(SUBOFF, "zigzag_overshoot_deg"), (UNSTABLE, "spiral_loop_width_deg")])
def test_a_scale_of_an_actuator_is_that_of_the_coefficients_of_its_control(boat, depends):
    """Of rudder and stern planes: every quantity, those with a spiral curve and with an inversion speed too."""
    scales, sets = np.array([0.7, 1.0, 1.2]), np.tile(boat.xi, (3, 1))
    boats = Boats(boat, sets, actuator_changes=dict.fromkeys(("scale_rudder", "scale_stern_plane"), scales - 1.0))
    others = Boats(boat, weaker(boat, weaker(boat, sets, "dr", scales), "ds", scales))
    for quantity in QUANTITIES.values():
        assert quantity.of(boats) == pytest.approx(quantity.of(others), rel=1e-9, nan_ok=True), quantity.name
    for name in (depends, "tactical_diameter_m", "dive_depth_m"):
        values = QUANTITIES[name].of(others)
        assert np.ptp(values) > 0.05 * np.abs(values).max(), name


def test_a_bias_of_the_rudder_moves_the_spiral_curve_and_a_delay_the_turn():
    later = 5
    delay = later * standard_manoeuvres.STEP * 2 * SUBOFF.length_m / SUBOFF.speed_mps
    changes = {"bias_rudder_deg": np.array([0.0, 2.0]), "delay_rudder_s": np.array([0.0, delay])}
    biased, late = (Boats(SUBOFF, np.tile(SUBOFF.xi, (2, 1)), actuator_changes={n: c}) for n, c in changes.items())
    _, rudder = standard_manoeuvres.spiral_curve(biased)
    assert rudder[1] == pytest.approx(rudder[0] - np.radians(2.0), abs=1e-7)
    states = turn(late)
    assert np.abs(states[0, later, PSI]) > 1e-3
    np.testing.assert_allclose(states[1, later:, PSI], states[0, :-later, PSI], rtol=0.0, atol=1e-5)


def test_what_is_computed_once_is_not_computed_again():
    calls = []
    boats = Boats(SUBOFF, SUBOFF.xi[None])
    assert boats.once(lambda some, number: calls.append((some, number)), 3) is None
    assert calls == [(boats, 3)]
    assert boats.once(turn) is boats.once(turn)


def test_peaks_and_places_are_those_of_smooth_histories():
    times = np.linspace(0.0, 3.0, 61)
    assert standard_manoeuvres.peak(np.sin(times)[None])[0] == pytest.approx(1.0, abs=1e-6)
    assert np.isnan(standard_manoeuvres.peak(times[None])[0])
    rising = np.stack([times**2, -times])
    reached = standard_manoeuvres.at(np.repeat(times[None, :, None], 2, axis=0), rising, 2.0)
    assert reached[0, 0] == pytest.approx(np.sqrt(2.0), abs=1e-6)
    assert np.isnan(reached[1, 0])
