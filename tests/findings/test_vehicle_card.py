"""The card of a vehicle: planted faults are found, indices mean what they say, and nothing breaks it."""

import copy
import json
import tomllib
from dataclasses import replace

import numpy as np
import pytest
import tomli_w
from hypothesis import given, settings
from hypothesis import strategies as st
from support import refusals
from support.fins import PORT, STARBOARD, fins, with_actuators

import bayesub as bs
from bayesub.findings import coefficient_examinations
from bayesub.findings.coefficient_examinations import negative, pairs, sizes_and_signs, typical_ranges
from bayesub.findings.vehicle_card import actuators, check
from bayesub.findings.vehicle_examinations import (
    balance,
    dive,
    fly,
    growth,
    slopes,
    stability_indices,
    straight_flight,
    turn,
    turning_circle,
)
from bayesub.io import toml_files
from bayesub.kernels import workspace
from bayesub.logs.log_files import VELOCITIES
from bayesub.model.coefficients import EQUATIONS, INDEX, NAMES
from bayesub.report.plots import cards, style
from bayesub.study.new import files


def changed(vehicle, **values):
    """The vehicle with other coefficients."""
    xi = vehicle.xi.copy()
    for name, value in values.items():
        xi[INDEX[name]] = value
    return replace(vehicle, xi=xi)


def of(vehicle, *names):
    return [vehicle.xi[INDEX[name]] for name in names]


def test_built_in_vehicles():
    """suboff and npsauv give no cause for a warning; auv690's published added masses are not symmetric."""
    assert check(bs.load_vehicle("suboff")).warnings == ()
    assert check(bs.load_vehicle("npsauv")).warnings == ()
    told = [w.text for w in check(bs.load_vehicle("auv690")).warnings]
    assert len(told) == 3
    assert "G_v = -0.10" in told[0]
    assert "which suffices at trial speed" in told[0]
    assert all("not symmetric" in text for text in told[1:])


@pytest.mark.parametrize("name", ["suboff", "auv690", "npsauv"])
def test_a_horizontal_index_of_zero_is_neutral_stability(name):
    """Where G_h vanishes, so does the growth of small motions in the plane; on either side the signs agree."""
    boat = bs.load_vehicle(name)
    mass = boat.body[workspace.MASS] / boat.dimensional_factors[INDEX["Yvdot"]]
    yv, yr, nr = of(boat, "Yuv", "Yur", "Nur")
    neutral = yv * nr / (yr - mass)
    for factor in (0.9, 1.0, 1.1):
        other = changed(boat, Nuv=factor * neutral).restricted("horizontal")
        index, rate = stability_indices(other)["horizontal_G_h"], growth(other)
        assert index == pytest.approx(1.0 - factor, abs=1e-12)
        # Heading, depth, .. and, confined to the plane, roll and pitch neither grow nor decay.
        assert (rate > 1e-4) == (factor > 1.0)


def test_a_vertical_index_of_zero_is_neutral_without_righting_moment(suboff):
    mass = suboff.body[workspace.MASS] / suboff.dimensional_factors[INDEX["Zwdot"]]
    zw, zq, mq = of(suboff, "Zuw", "Zuq", "Muq")
    body = suboff.body.copy()
    body[workspace.ZB] = body[workspace.ZG]
    for factor in (0.9, 1.1):
        other = replace(changed(suboff, Muw=factor * zw * mq / (zq + mass), Zu_absw=0.0, Mu_absw=0.0), body=body)
        assert stability_indices(other)["vertical_G_v"] == pytest.approx(1.0 - factor, abs=1e-12)
        assert (growth(other.restricted("vertical")) > 1e-4) == (factor > 1.0)


@pytest.mark.parametrize("name", ["suboff", "auv690", "npsauv"])
def test_a_gentle_turn_is_that_of_the_linear_equations(name):
    """r l/U = (Nv Yd - Yv Nd) d / (Yv Nr - Nv (Yr - m)), within the share of cross-flow drag.

    That share is proportional to the rudder: 6 % at half a degree, and so above 1 % at a tenth.
    """
    boat = bs.load_vehicle(name)
    angle = np.radians(0.1)
    mass = boat.body[workspace.MASS] / boat.dimensional_factors[INDEX["Yvdot"]]
    yv, yr, nv, nr, yd, nd = of(boat, "Yuv", "Yur", "Nuv", "Nur", "Yuu_dr", "Nuu_dr")
    rate = (nv * yd - yv * nd) * angle / (yv * nr - nv * (yr - mass))
    states = fly(boat, 40.0, {"rudder_deg": angle}, "horizontal").states[0]
    found = turning_circle(boat, states, 0.1)
    assert found["diameter_lengths"] == pytest.approx(2.0 / abs(rate), rel=0.02)
    assert found["positive_rudder_turns"] == "to port"


def test_a_circle_is_measured_as_one(suboff):
    """Of a circle of four ship lengths flown sideways by five degrees."""
    radius, speed, drift = 2.0 * suboff.length_m, 6.0, np.radians(5.0)
    angle = np.linspace(0.0, 2.0 * np.pi, 2001)
    states = np.zeros((len(angle), 12))
    states[:, 0], states[:, 1] = radius * np.sin(angle), radius * (1.0 - np.cos(angle))
    states[:, 5], states[:, 11] = angle, speed / radius
    states[:, 6], states[:, 7] = speed * np.cos(drift), -speed * np.sin(drift)
    found = turning_circle(suboff, states, 15.0)
    assert found["diameter_lengths"] == pytest.approx(4.0)
    assert found["tactical_diameter_lengths"] == pytest.approx(4.0, rel=1e-5)
    assert found["drift_angle_deg"] == pytest.approx(5.0)
    assert found["speed_ratio"] == pytest.approx(0.8)
    assert found["positive_rudder_turns"] == "to starboard"


FAULTS = {
    "thrust 2 times the drag": ({"Xuu": -0.0005}, "the thrust is 2 times the drag"),
    "no drag": ({"Xuu": 0.0}, "no drag"),
    "speed": ({"Xuu": -0.0005}, "does not hold its speed"),
    "unstable course": ({"Nuv": -0.03}, "G_h = -0.34: straight flight is unstable and it holds no course"),
    "unstable depth": ({"Muw": 0.05}, "which does not suffice at trial speed"),
    "undamped": ({"Nur": 0.0}, "G_h is undefined: Nur (less the moment of the mass) is not negative"),
    "unheld": ({"Yuv": 0.0}, "G_h is undefined: Yuv is not negative"),
    "degrees for radians": ({"Yuu_dr": 0.005929 * 180 / np.pi}, "Yuu_dr = 0.34 is out of the ordinary"),
    "wide circle": ({"Nuu_dr": -0.0002, "Yuu_dr": 0.0005}, "ship lengths, where boats need"),
    "no rudder": ({"Nuu_dr": 0.0, "Yuu_dr": 0.0}, "does not answer its rudder"),
    "rudder ahead": ({"Nuu_dr": 0.002217}, "the rudder acts ahead of the centre"),
    "bow up": ({"Muu_ds": 0.002409, "Zuu_ds": 0.005603}, "pitches the bow up"),
    "no stern planes": ({"Muu_ds": 0.0, "Zuu_ds": 0.0}, "does not answer its stern planes"),
    "planes ahead": ({"Zuu_ds": 0.005603}, "the stern planes act ahead"),
    "asymmetric": ({"Yrdot": -0.0008}, "not symmetric: Yrdot = -0.0008, Nvdot = 0.000609"),
    "mass": ({"Yvdot": 0.02}, "the mass matrix is not positive definite"),
    "sign": ({"Yuv": 0.03}, "damping has the wrong sign: Yuv positive"),
    "no added mass": ({"Zwdot": 0.0}, "no added mass: Zwdot zero"),
    "sinks": ({"Zuu": 0.001, "Muu": -0.0005}, "does not fly straight"),
    "rolls": ({"Kup": 0.006, "Kp_absp": 0.0}, "small disturbances of straight flight grow"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_planted_faults_are_found(suboff, fault):
    values, words = FAULTS[fault]
    card = check(changed(suboff, **values))
    assert any(words in w.text for w in card.warnings), card.warnings
    assert all(w.remedy for w in card.warnings)


@pytest.mark.parametrize(
    ("entry", "value", "words"),
    [
        ("zG", -1.0, "no righting moment: the centre of gravity lies 0.6 m above that of buoyancy"),
        ("zG", -0.4, "lies at the height of that of buoyancy"),
        ("buoyancy", 9.6e7, "buoyancy is 97.59 % of the weight"),
        ("Ixx", 2e10, "not those of a body"),
        ("Iyy", 6.2e6, "Iyy is that of a radius of gyration of 0.0077 ship lengths"),
        ("zP", 3.0, "does not fly straight"),
    ],
)
def test_planted_faults_of_the_body(suboff, entry, value, words):
    body = suboff.body.copy()
    body[workspace.BODY.index(entry)] = value
    texts = [w.text for w in check(replace(suboff, body=body)).warnings]
    assert any(words in text for text in texts), texts


def test_a_ship_is_not_out_of_the_ordinary(suboff):
    """Hull derivatives of the tanker KVLCC2 (Yasukawa & Yoshimura 2015), on length instead of draught."""
    tanker = {"Xuu": -0.022, "Xvv": -0.040, "Xvr": 0.002, "Xrr": 0.011, "Yuv": -0.315, "Yur": 0.083, "Nuv": -0.137}
    tanker |= {"Nur": -0.049, "Nr_absr": -0.013, "Yvdot": -0.223, "Nrdot": -0.011, "Xudot": -0.022}
    card = check(changed(suboff, **{name: 20.8 / 320.0 * value for name, value in tanker.items()}))
    assert not [w.text for w in card.warnings if "out of the ordinary" in w.text]


def test_typical_ranges():
    """Every built-in coefficient is in its range, and a coefficient that no boat has has none."""
    for name in toml_files.built_in("vehicles"):
        boat = bs.load_vehicle(name)
        ranges, sizes = typical_ranges(boat.equations), np.abs(boat.xi)
        used = sizes > 0
        assert np.all((sizes >= ranges[:, 0]) & (sizes <= ranges[:, 1]) | ~used)
    ranges = typical_ranges(EQUATIONS)
    assert np.isnan(ranges[INDEX["Nu_absr_dr"]]).all()


def test_zeros_are_listed_by_axis(suboff):
    zeros = check(suboff).numbers["zero_coefficients"]
    assert sorted(name for names in zeros.values() for name in names) == sorted(
        name for name in NAMES if suboff.xi[INDEX[name]] == 0.0
    )
    assert zeros["K"] == ["Kuu"]


finite = st.floats(allow_nan=False, allow_infinity=False)
absurd = st.one_of(finite, st.sampled_from([0.0, 1e-300, -1e-300, 1e10, -1e10, 1e200, -1e200, 5e-324]))
CONTENT = tomllib.loads(toml_files.find("suboff", "vehicles").read_text())


def card_of(content, folder):
    """The card of a file of `content`, printed and as JSON; None if the file is refused in one line."""
    path = folder / "boat.toml"
    path.write_text(tomli_w.dumps(content))
    try:
        vehicle = bs.load_vehicle(path)
    except bs.InputError as error:
        refusal = str(error)
    else:
        refusal = ""
    assert "\n" not in refusal
    if refusal:
        return None
    card = check(vehicle)
    assert all(isinstance(line, str) and "nan" not in line.split() for line in card.lines())
    return json.loads(json.dumps(card.to_json(), allow_nan=False))


@settings(max_examples=60, deadline=None)
@given(values=st.dictionaries(st.sampled_from(NAMES), absurd, max_size=20))
def test_absurd_coefficients(values, tmp_path_factory):
    """Whatever the coefficients, the answer is a card or one line."""
    content = CONTENT | {"coefficients": CONTENT["coefficients"] | values}
    card_of(content, tmp_path_factory.mktemp("absurd"))


@pytest.mark.parametrize(("name", "value"), [("Yvdot", 1e100), ("Nur", 5e-324), ("Muu_ds", -1e3)])
@pytest.mark.rendered
def test_absurd_boats_can_be_drawn(suboff, tmp_path, name, value):
    cards.draw(check(changed(suboff, **{name: value})), tmp_path / "card.png")
    assert (tmp_path / "card.png").stat().st_size > 20_000


KEYS = [
    ("trial", "speed_mps"),
    ("trial", "depth_m"),
    ("body", "length_m"),
    ("body", "mass_kg"),
    ("body", "water_density_kgm3"),
    ("body", "inertia_kgm2", "Ixx"),
    ("body", "inertia_kgm2", "Ixy"),
    ("propulsion", "rpm_per_mps"),
    ("propulsion", "thrust_line_z_m"),
    ("actuators", "rate_deg_s"),
    ("actuators", "time_constant_s"),
    ("actuators", "rudder_limit_deg"),
    ("actuators", "plane_limit_deg"),
]


@settings(max_examples=80, deadline=None)
@given(changes=st.dictionaries(st.sampled_from(KEYS), absurd, min_size=1, max_size=4))
def test_absurd_bodies(changes, tmp_path_factory):
    """Whatever the masses, lengths and speeds; what is not positive and must be is refused."""
    content = copy.deepcopy(CONTENT)
    for (*tables, key), value in changes.items():
        table = content
        for name in tables:
            table = table[name]
        table[key] = value
    found = card_of(content, tmp_path_factory.mktemp("absurd"))
    signed = {"depth_m", "Ixy", "thrust_line_z_m"}
    if any(value <= 0.0 and keys[-1] not in signed for keys, value in changes.items()):
        assert found is None


@pytest.mark.slow
@pytest.mark.rendered
def test_from_an_outline_to_a_card(bayesub, tmp_path, monkeypatch):
    """new geometry, new vehicle, check: status 0 with warnings; a second time nothing is replaced."""
    monkeypatch.chdir(tmp_path)
    assert bayesub("new", "geometry", "mine")[0] == 0
    assert bayesub("new", "vehicle", "mine", "--geometry", "mine_hull.toml")[0] == 0
    assert bayesub("new", "vehicle", "copy", "-o", "other.toml", "--from", "npsauv")[0] == 0
    status, out, _ = bayesub("check", "mine.toml", "mine_hull.toml", "--card", "card.png")
    assert status == 0
    assert "warning: the boat has no drag" in out
    assert "mine_hull.toml: geometry of a hull of 5 m" in out
    assert (tmp_path / "card.png").stat().st_size > 20_000
    status, out, _ = bayesub("check", "--json", "other.toml", "suboff", "horizontal.csv")
    assert status == 2
    status, out, _ = bayesub("check", "--json", "other.toml", "suboff")
    found = json.loads(out)
    assert found["other.toml"]["vehicle"] == "copy"
    assert found["suboff"]["stability"]["horizontal_G_h"] == pytest.approx(0.46, abs=0.005)
    for arguments, kind, key in (
        (("new", "vehicle", "mine"), "file", "-o"),
        (("new", "vehicle", "x", "--from", "suboff", "--geometry", "mine_hull.toml"), "conflict", "--geometry"),
        (("new", "vehicle", "x", "--from", "subof"), "unknown", "subof"),
        (("check", "suboff", "npsauv", "--card", "two.png"), "conflict", "--card"),
        (("check", "absent.toml"), "file", ""),
        (("check", "suboff", "--card", "absent/card.png"), "file", ""),
        (("check", "suboff", "--card", "card.boat"), "file", ""),
    ):
        status, _, err = bayesub(*arguments)
        assert status == 2
        refusals.check(bayesub.error, kind, key)
        assert err.count("\n") == 1


def test_pairs_are_the_added_masses_that_are_equal_in_ideal_fluid():
    """Each is the other with force and acceleration exchanged."""
    forces, motions = "XYZKMN", "uvwpqr"
    names = [(one.name, other.name) for one, other in pairs(EQUATIONS)]
    assert names == [("Yrdot", "Nvdot"), ("Zqdot", "Mwdot"), ("Ypdot", "Kvdot"), ("Krdot", "Npdot")]
    for one, other in names:
        assert forces.index(one[0]) == motions.index(other[1])
        assert forces.index(other[0]) == motions.index(one[1])


def test_coefficients_that_take_energy_are_found_by_their_regressors():
    assert negative(EQUATIONS) == {
        "drag": ["Xuu", "Xuu_drdr", "Xuu_dbdb", "Xuu_dsds"],
        "damping": ["Yuv", "Yv_absnu", "Zuw", "Zw_absnu", "Kup", "Kp_absp", "Muq", "Mq_absq", "Nur", "Nr_absr"],
        "added mass": ["Xudot", "Yvdot", "Zwdot", "Kpdot", "Mqdot", "Nrdot"],
    }


def test_every_built_in_vehicle_is_drawn_beside_another(suboff, tmp_path, monkeypatch):
    """A fourth boat counts in the warnings and in the picture: nothing names the three."""
    files = toml_files.built_in("vehicles")
    built_in, names = toml_files.built_in, []
    more = {"vehicles": {"fourth": files["npsauv"]}}
    monkeypatch.setattr(toml_files, "built_in", lambda kind: built_in(kind) | more.get(kind, {}))
    monkeypatch.setattr(
        coefficient_examinations, "built_in_vehicle", lambda name: names.append(name) or bs.load_vehicle("npsauv")
    )
    card = check(suboff)
    names.clear()
    cards.draw(card, tmp_path / "card.png")
    assert set(names) == {*files, "fourth"}


@pytest.mark.parametrize("name", ["suboff", "remus100", "mariner", "npsauv_crossflow"])
def test_slopes_are_those_of_the_forces(name):
    """By central differences with two steps, which tells the slope of v from the size of v |v|."""
    boat = bs.load_vehicle(name)
    zero = np.zeros(len(boat.equations.controls) + 1)
    zero[-1] = boat.speed_mps
    for variable, axis in (("v", "Y"), ("v", "N"), ("r", "Y"), ("r", "N"), ("rudder_deg", "N")):

        def force(step, variable=variable, axis=axis):
            states, controls = np.zeros((1, 12)), zero[None].copy()
            states[0, 6] = boat.speed_mps
            if variable in VELOCITIES:
                states[0, 6 + VELOCITIES.index(variable)] = step
            else:
                controls[0, boat.equations.control(variable, "test")] = step
            columns = boat.equations.regressors(states, np.zeros((1, 6)), controls, boat.constants)[axis][0]
            k = boat.equations.columns(boat.equations.names_of_axis(axis))
            return boat.xi[k] * boat.dimensional_factors[k] @ columns

        def slope(step, force=force):
            return (force(step) - force(-step)) / (2.0 * step)

        step = 1e-4 * boat.speed_mps / (boat.length_m if variable == "r" else 1.0)
        expected = 2.0 * slope(step) - slope(2.0 * step)
        assert slopes(boat, variable).values[axis] == pytest.approx(expected, rel=1e-6)


def test_the_index_of_a_ship_whose_coefficients_contain_the_mass():
    """G_h = 1 - Nv Yr / (Yv Nr), and of the two sides of zero the motion knows the same one."""
    ship = bs.load_vehicle("mariner")
    yv, yr, nv, nr = (ship.xi[ship.equations.index[name]] for name in ("Yv", "Yr", "Nv", "Nr"))
    assert stability_indices(ship) == {"horizontal_G_h": pytest.approx(1.0 - nv * yr / (yv * nr), rel=1e-12)}
    for factor in (0.9, 1.1):
        xi = ship.xi.copy()
        xi[ship.equations.index["Nv"]] = factor * yv * nr / yr
        other = replace(ship, xi=xi)
        assert stability_indices(other)["horizontal_G_h"] == pytest.approx(1.0 - factor, abs=1e-12)
        assert (growth(other) > 1e-4) == (factor > 1.0)


def test_a_ship_has_no_vertical_examination():
    card = check(bs.load_vehicle("mariner"))
    assert card.numbers["stern_plane"] is card.numbers["hydrostatics"] is card.numbers["thrust_over_drag"] is None
    assert set(card.numbers["skipped"]) == {"stern_plane", "hydrostatics", "thrust_over_drag"}
    assert list(card.numbers["zero_coefficients"]) == ["X", "Y", "N"]
    assert list(card.numbers["mass_matrix"]["radii_of_gyration_lengths"]) == ["Izz"]
    assert card.numbers["mass_matrix"]["added_mass_differences"].keys() == {"Yrdot-Nvdot"}
    lines = "\n".join(card.lines())
    assert "stern planes      not examined: the equations have three degrees of freedom" in lines
    assert "G_v" not in lines
    assert "with rudder amidships the boat does not run straight" in lines
    assert "look at Y0 and N0" in lines
    assert "look at Xu, Xuu and Xuuu" in lines  # not at a line that is not examined
    assert card.numbers["straight_flight"].keys() == {"lengths", "speed_ratio", "heading_deg"}
    json.dumps(card.to_json(), allow_nan=False)


def test_the_card_of_a_boat_with_units():
    card = check(bs.load_vehicle("remus100"))
    assert card.numbers["thrust_over_drag"]["above_self_propulsion"] == pytest.approx(3.86 / (1.62 * 1.54**2), rel=1e-6)
    assert "skipped" not in card.numbers
    values = {"Nrdot": 40.0, "Nvdot": 5.0, "Xuu": -0.01}
    boat = bs.load_vehicle("remus100")
    xi = boat.xi.copy()
    xi[boat.equations.columns(values)] = list(values.values())
    texts = [f"{w.text}; {w.remedy}" for w in check(replace(boat, xi=xi)).warnings]
    for words in (
        "Yrdot = 1.93 kg m, Nvdot = 5 kg m",
        "Xuu = -0.01 kg/m is out of the ordinary: built-in boats have 1.6 to 1.6; check that it is in kg/m",
        "times the drag of 0.02372 N; scale the thrust",
        "added mass has the wrong sign: Nrdot positive",
    ):
        assert any(words in text for text in texts), texts


def test_a_control_that_the_equations_do_not_have_is_not_tried(tmp_path):
    """The flights are left out in words, before anything is flown."""
    path = tmp_path / "few.toml"
    path.write_text(files.equations("few").replace("rudder_deg", "fin_deg").replace("stern_plane_deg", "tab_deg"))
    boat_file = tmp_path / "boat.toml"
    boat_file.write_text(files.vehicle("boat", equations=str(path), path=boat_file))
    boat = bs.load_vehicle(boat_file)
    assert turn(boat).skipped == {"turning_circle": "the equations 'few' know no rudder_deg"}
    assert dive(boat).skipped == {"stern_plane": "the equations 'few' know no stern_plane_deg"}
    texts = [f"{w.text}; {w.remedy}" for w in (*balance(boat).warnings, *sizes_and_signs(boat).warnings)]
    assert texts[0] == "the boat has no drag: Xuu is zero; set Xuu, and b1 + b2 + b3 = b4 + b5 + b6 = -Xuu with it"
    assert texts[1].startswith("no added mass: Xudot, Yvdot, Zwdot, Kpdot, Mqdot, Nrdot zero")
    assert len(texts) == 2  # nothing is said of sizes: no built-in vehicle has these equations


def test_coefficients_that_take_energy_in_other_sets():
    remus, abkowitz = (negative(bs.load_equations(name)) for name in ("remus", "abkowitz"))
    assert remus["drag"] == ["Xuu"]
    assert remus["damping"] == ["Yvv", "Yuv", "Zww", "Zuw", "Kpp", "Mqq", "Muq", "Nrr", "Nur"]
    assert abkowitz["drag"] == ["Xdd"]
    assert abkowitz["damping"] == ["Xu", "Yv", "Yvvv", "Nr"]
    assert abkowitz["added mass"] == ["Xudot", "Yvdot", "Nrdot"]


@pytest.mark.parametrize(("name", "n_panels"), [("remus100", 6), ("mariner", 3), ("npsauv_crossflow", 6)])
def test_cards_of_other_sets_are_drawn(name, n_panels, tmp_path, monkeypatch):
    """A panel for each axis that has terms, boats of the same equations beside it, units at the names."""
    figures = []
    make = style.Figure
    monkeypatch.setattr(style, "Figure", lambda **options: figures.append(make(**options)) or figures[-1])
    cards.draw(check(bs.load_vehicle(name)), tmp_path / "card.png")
    below = figures[0].subfigs[1]
    shown = [axis for axis in below.axes if axis.axison]
    assert len(shown) == n_panels
    words = {label.get_text() for axis in shown for label in axis.get_xticklabels()}
    assert len(words) == len(bs.load_vehicle(name).xi)
    assert ("Kpp (kg m²)" in words) == (name == "remus100")
    others = {text.get_text() for text in below.legends[0].get_texts()}
    assert ("phoenix" in others) == (name == "npsauv_crossflow")
    assert "suboff" not in others


def test_propellers_that_push_too_little_are_one_warning(boat, vehicle_with):
    """Of both branches of the propulsion, which they are not part of."""
    card = balance(vehicle_with(with_actuators(boat, *fins(0.0, 90.0), PORT, STARBOARD, propulsion={"model": "none"})))
    (warning,) = card.warnings
    assert "times the drag of" in warning.text
    assert warning.remedy == "change rpm of the propellers"


def test_card_of_a_glider_says_what_ballast_and_water_do():
    """A newton of lift, a denser water and a bar of pressure, with the boat on even keel."""
    glider = bs.load_vehicle("slocum_comet")
    numbers = actuators(glider).numbers
    assert numbers["actuators"]["ballast_n"]["forces"] == {"Z": -1.0}
    volume = 70.0 / 1004.0
    assert numbers["actuators"]["density_anomaly_kgm3"]["forces"]["Z"] == pytest.approx(-9.81 * volume)
    assert numbers["actuators"]["pressure_bar"]["forces"]["Z"] == pytest.approx(70.0 * 9.81 * 5e-5)
    lines = check(glider).lines()
    assert f"  {'ballast_n':<17} 1 N make Z -1 N" in lines
    assert any(
        line.split()[:5] == ["density_anomaly_kgm3", "1", "kg/m3", "make", "Z"] and " -0.68" in line for line in lines
    )


def test_a_glider_has_no_thrust_to_balance():
    """It is driven by its weight: neither thrust nor a straight flight on even keel is looked at."""
    glider = bs.load_vehicle("slocum_comet")
    for examine in (balance, straight_flight):
        examination = examine(glider)
        assert not examination.warnings
        assert set(examination.skipped.values()) == {"the boat has no thrust and is driven by its weight"}


def test_thrusters_at_rest_have_no_thrust_to_balance():
    """Neither is looked at of a vehicle that only thrusters drive; with propellers both are."""
    for examine in (balance, straight_flight):
        examination = examine(bs.load_vehicle("bluerov2"))
        assert not examination.warnings
        assert set(examination.skipped.values()) == {"thrusters drive the boat, and rest until they are ordered"}
