"""The equation set `booth`, against a list typed by hand and the slow twin, and what any set answers."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from support import slow_twin
from support.refusals import refused

import bayesub as bs
from bayesub.model.equations import AXES, files, load_equations
from bayesub.model.equations.regressors import parse

# Typed from the model description, section 4: axis, power of the length, coefficient and product, name by name.
PRINTED = """
X 2: Xuu u^2, Xvv v^2, Xww w^2, Xuu_drdr u^2 dr^2, Xuu_dbdb u^2 db^2, Xuu_dsds u^2 ds^2
X 3: Xudot udot, Xvr v r, Xwq w q
X 4: Xqq q^2, Xrr r^2, Xrp r p
Y 2: Yuu u^2, Yuv u v, Yvw v w, Yv_absnu v nu, Yuu_dr u^2 dr
Y 3: Yvdot vdot, Yup u p, Yur u r, Yvq v q, Ywp w p, Ywr w r, Yv_absr sgn(v) nu abs(r), Yu_absr_dr u abs(r) dr
Y 4: Ypdot pdot, Yrdot rdot, Yp_absp p abs(p), Ypq p q, Yqr q r
Z 2: Zuu u^2, Zuw u w, Zvv v^2, Zuu_db u^2 db, Zuu_ds u^2 ds, Zw_absnu w nu, Zu_absw u abs(w), Zabsw_nu abs(w) nu
Z 3: Zwdot wdot, Zuq u q, Zvp v p, Zvr v r, Zu_absq_ds u abs(q) ds, Zw_absq sgn(w) nu abs(q)
Z 4: Zqdot qdot, Zpp p^2, Zrr r^2, Zrp r p
K 3: Kuu u^2, Kuv u v, Kvw v w, Kv_absnu v nu, Kuu_dr u^2 dr
K 4: Kvdot vdot, Kup u p, Kur u r, Kvq v q, Kwp w p, Kwr w r
K 5: Kpdot pdot, Krdot rdot, Kqr q r, Kpq p q, Kp_absp p abs(p)
M 3: Muu u^2, Muw u w, Mvv v^2, Muu_db u^2 db, Muu_ds u^2 ds, Mw_absnu w nu, Mu_absw u abs(w), Mabsw_nu abs(w) nu
M 4: Mwdot wdot, Muq u q, Mvp v p, Mvr v r, Mu_absq_ds u abs(q) ds, Mabsnu_q nu q
M 5: Mqdot qdot, Mpp p^2, Mrr r^2, Mrp r p, Mq_absq q abs(q)
N 3: Nuu u^2, Nuv u v, Nvw v w, Nv_absnu v nu, Nuu_dr u^2 dr
N 4: Nvdot vdot, Nup u p, Nur u r, Nvq v q, Nwp w p, Nwr w r, Nabsnu_r nu r, Nu_absr_dr u abs(r) dr
N 5: Npdot pdot, Nrdot rdot, Npq p q, Nqr q r, Nr_absr r abs(r)
"""
CONTROLS = ("dr", "db", "ds")


def printed():
    """(axis, power, name, regressor) of each term of the list."""
    for line in PRINTED.strip().splitlines():
        group, terms = line.split(": ")
        axis, power = group.split()
        for term in terms.split(", "):
            name, *factors = term.split()
            yield axis, int(power), name, parse("*".join(factors), CONTROLS)


@pytest.fixture(scope="module")
def booth():
    return load_equations("booth")


def test_booth_is_the_printed_list(booth):
    """101 terms, each with its axis, power of length and product, and none with a power of the speed or a unit."""
    terms = {term.name: term for term in booth.terms}
    assert len(terms) == len(booth.terms) == 101
    names = []
    for axis, power, name, regressor in printed():
        names.append(name)
        assert (terms[name].axis, terms[name].length_power) == (axis, power), name
        assert terms[name].parsed.canonical == regressor.canonical, name
        assert (terms[name].speed_power, terms[name].unit) == (0, None), name
    assert set(names) == set(booth.names)
    assert Counter(term.axis for term in booth.terms) == dict(zip("XYZKMN", (12, 18, 18, 16, 19, 18), strict=True))
    assert [(control.symbol, control.column) for control in booth.controls] == [
        ("dr", "rudder_deg"),
        ("db", "bow_plane_deg"),
        ("ds", "stern_plane_deg"),
    ]


@pytest.mark.parametrize("name", load_equations("booth").names)
def test_a_term_is_that_of_the_twin(booth, boat, motions, rng, name):
    """Its force alone, and it acts along its own axis only."""
    states, controls, _ = (part[:8] for part in motions)
    rates = rng.standard_normal((8, 6))
    alone = boat | {"coefficients": dict.fromkeys(boat["coefficients"], 0.0) | {name: 1.0}}
    expected = [slow_twin.hydrodynamics(alone, s[6:], a, c) for s, a, c in zip(states, rates, controls, strict=True)]
    body = boat["body"]
    factor = booth.factors(body["length_m"], body["water_density_kgm3"], 7.5)[booth.index[name]]
    term = booth.term(name)
    column = bs.regressors(states, rates, controls)[term.axis][:, booth.names_of_axis(term.axis).index(name)]
    forces = np.zeros((8, 6))
    forces[:, AXES.index(term.axis)] = factor * column
    np.testing.assert_allclose(forces, expected, rtol=1e-14, atol=1e-300)


def test_subproblems_are_what_is_left_in_a_plane(booth):
    """The terms whose axes, motions and controls a plane has: 25 and 32 (model manual, section 4)."""
    planes = {"horizontal": ("XYN", {"u", "v", "r", "nu", "udot", "vdot", "rdot", "dr"}),
              "vertical": ("XZM", {"u", "w", "q", "nu", "udot", "wdot", "qdot", "db", "ds"})}  # fmt: skip
    for plane, (axes, symbols) in planes.items():
        names = [term.name for term in booth.terms if term.axis in axes and term.symbols <= symbols]
        assert booth.subproblems[plane] == booth.active(subproblem=plane) == tuple(names)
    assert [len(names) for names in booth.subproblems.values()] == [25, 32]
    with refused("unknown", "subproblem"):
        booth.subproblem("lateral")


def test_terms_are_found_by_their_meaning(booth):
    """Whatever the order of factors; None if an axis has no such term."""
    for text, axis, name in (
        ("v*u", "Y", "Yuv"),
        ("dr*abs(r)*u", "N", "Nu_absr_dr"),
        ("abs(r)*nu*sgn(v)", "Y", "Yv_absr"),
        ("dr^2*abs(u)^2", "X", "Xuu_drdr"),
        ("abs(nu)*r", "N", "Nabsnu_r"),
        ("rdot", "N", "Nrdot"),
    ):
        assert booth.find(axis, parse(text, CONTROLS)).name == name
    for text, axis in (("v^3", "Y"), ("u*v", "Z"), ("u*abs(v)", "Y"), ("1", "X")):
        assert booth.find(axis, parse(text, CONTROLS)) is None
    for term in booth.terms:
        assert booth.find(term.axis, term.parsed) is term


def test_unknown_names_suggest_the_nearest(booth):
    for ask in (booth.term, booth.label, lambda name: booth.columns([name])):
        with refused("unknown", "Yuvv"):
            ask("Yuvv")
    with refused("unknown", "ruder_deg"):
        booth.control("ruder_deg", "trial")
    assert booth.control("stern_plane_deg", "trial") == 2


def test_controls_at_rest_leave_their_terms_out(booth, suboff, spiral):
    """Nothing else does: not the sub-problem of the manoeuvre, and zeros only of a vehicle that is named."""
    resting = replace(spiral, controls=spiral.controls * [1, 0, 0])
    assert set(booth.names) - set(booth.active(None, resting)) == {
        t.name for t in booth.terms if t.symbols & {"db", "ds"}
    }
    still = replace(spiral, controls=spiral.controls * 0)
    assert set(booth.names) - set(booth.active(None, still)) == {
        t.name for t in booth.terms if t.symbols & {"dr", "db", "ds"}
    }
    zeros = {name for name, value in zip(booth.names, suboff.xi, strict=True) if value == 0.0}
    assert zeros
    assert set(booth.active(suboff)) == set(booth.names) - zeros


TOWED = """
name = "towed"
title = "Powers of the speed, in three ways"
speed = "{speed}"

[terms.X]
Xuu = {{ regressor = "u*abs(u)", length_power = 2, label = "a", meaning = "resistance" }}
X0  = {{ regressor = "u", length_power = 2, speed_power = 1, label = "b", meaning = "friction" }}
Xu  = {{ regressor = "u^3", unit = "kg s/m^2", label = "c", meaning = "waves" }}

[terms.Y]
Yvvv = {{ regressor = "v^3", length_power = 2, speed_power = -1, label = "d", meaning = "cross-flow" }}
Yv   = {{ regressor = "v", length_power = 2, speed_power = 1, label = "e", meaning = "lift" }}
Yr   = {{ regressor = "r", length_power = 3, speed_power = 1, label = "f", meaning = "damping" }}
Yd   = {{ regressor = "rdot", length_power = 4, speed_power = 0, label = "g", meaning = "added mass" }}
"""


@pytest.fixture(params=["trial", "instantaneous"])
def towed(request, tmp_path):
    (tmp_path / "towed.toml").write_text(TOWED.format(speed=request.param))
    return load_equations(tmp_path / "towed.toml")


def test_powers_of_the_speed(towed, rng):
    """(rho/2) l^a U^b of the trial speed, or of the speed at the moment; a coefficient with a unit has none."""
    length, density, trial = 2.5, 1010.0, 1.4
    states = rng.uniform(0.2, 1.0, (9, 12))
    u, v, w, r = (states[:, k] for k in (6, 7, 8, 11))
    rates = rng.standard_normal((9, 6))
    speed = np.full(9, trial) if towed.speed == "trial" else np.sqrt(u**2 + v**2 + w**2)
    half = 0.5 * density
    expected = {
        "Xuu": half * length**2 * u**2,
        "X0": half * length**2 * speed * u,
        "Xu": u**3,
        "Yvvv": half * length**2 / speed * v**3,
        "Yv": half * length**2 * speed * v,
        "Yr": half * length**3 * speed * r,
        "Yd": half * length**4 * rates[:, 5],
    }
    blocks = towed.regressors(states, rates, np.zeros((9, 1)), towed.constants(trial, None))
    factors = towed.factors(length, density, trial)
    for k, name in enumerate(towed.names):
        term = towed.term(name)
        column = blocks[term.axis][:, towed.names_of_axis(term.axis).index(name)]
        np.testing.assert_allclose(factors[k] * column, expected[name], rtol=1e-14)


def test_drag_of_straight_flight(towed):
    """On (rho/2) l^2 speed^2, of all terms that straight flight has, whatever their scale."""
    length, density, trial = 2.5, 1010.0, 1.4
    xi = np.array([-0.01, -0.02, -3.0, 5.0, 5.0, 5.0, 5.0])
    force = 0.5 * density * length**2 * trial**2 * (0.01 + 0.02) + 3.0 * trial**3
    drag = towed.drag(xi, length, density, trial, None)
    assert drag == pytest.approx(force / (0.5 * density * length**2 * trial**2), rel=1e-14)


def test_drag_of_booth_is_minus_Xuu_to_the_bit(booth, suboff):
    """So that a propeller that is matched to it has the same revolutions as when only Xuu was asked."""
    drag = booth.drag(suboff.xi, suboff.length_m, suboff.water_density_kgm3, suboff.speed_mps, None)
    assert drag == -suboff.xi[booth.index["Xuu"]]


def test_constants_of_sets_without_a_hull(booth):
    np.testing.assert_array_equal(booth.constants(7.5, None), [7.5])


def test_cross_flow_integrals_are_the_definition(tmp_path, rng):
    """Gauss-Legendre points along the hull against many midpoints, for v and w that change sign along it."""
    rest = 'length_power = 0, label = "c", meaning = "cross-flow"'
    lines = [f'[terms.{a}]\n{a}c = {{ regressor = "crossflow_{a.lower()}", {rest} }}' for a in "YZMN"]
    path = tmp_path / "hull.toml"
    path.write_text('name = "hull"\ntitle = "t"\nstations = 32\n' + "\n".join(lines))
    equations = load_equations(path)
    assert equations.has_crossflow
    ends, height, breadth = np.array([-3.0, 4.0]), np.array([0.4, 1.3]), np.array([0.7, 0.5])
    edges = np.linspace(*ends, 200_001)
    x, dx = 0.5 * (edges[1:] + edges[:-1]), edges[1] - edges[0]
    h, b = np.interp(x, ends, height), np.interp(x, ends, breadth)
    # v + x r and w - x q have no zero on the hull in the first, where the integrand is smooth, and one in the second.
    for (v, w, q, r), tolerance in (((2.0, -1.5, 0.2, 0.3), 1e-10), ((0.5, 0.2, 0.3, -0.4), 2e-3)):
        state = np.zeros((1, 12))
        state[0, 6:] = rng.standard_normal(), v, w, rng.standard_normal(), q, r
        found = equations.regressors(
            state, np.zeros((1, 6)), np.zeros((1, 1)), equations.constants(1.0, np.stack([ends, height, breadth]))
        )
        across, down = v + x * r, w - x * q
        speed = np.hypot(across, down)
        expected = {"Y": -(h * across * speed).sum() * dx, "Z": -(b * down * speed).sum() * dx,
                    "M": (x * b * down * speed).sum() * dx, "N": -(x * h * across * speed).sum() * dx}  # fmt: skip
        for axis, value in expected.items():
            assert found[axis][0, 0] == pytest.approx(value, rel=tolerance, abs=tolerance)


def test_three_degrees_of_freedom_are_the_horizontal_plane(tmp_path):
    path = tmp_path / "ship.toml"
    path.write_text(
        'name = "ship"\ntitle = "t"\ndegrees_of_freedom = 3\n[controls]\ndr = "rudder_deg"\n[terms.N]\n'
        'Nr = { regressor = "r", length_power = 4, speed_power = 1, label = "N", meaning = "m" }\n'
    )
    ship = load_equations(path)
    assert ship.subproblems == {"horizontal": ("Nr",)}
    assert ship.subproblem(None) == ship.subproblem("horizontal") == "horizontal"
    with refused("conflict", "subproblem"):
        ship.subproblem("vertical")


@pytest.mark.parametrize("name", ["booth", "remus", "abkowitz", "feldman", "glider", "mmg"])
def test_a_coefficient_in_its_unit_makes_a_force_or_a_moment(name):
    """The unit of coefficient times factor, against the check of the units of files; a metre more is refused."""
    equations = load_equations(name)
    controls = {control.symbol: control.dimension for control in equations.controls}
    for term in equations.terms:
        unit = equations.unit(term.name)
        files._check_unit(replace(term, unit=unit), controls, [])
        with pytest.raises(ValueError, match="with a coefficient in"):
            files._check_unit(replace(term, unit=f"m {unit}"), controls, [])
