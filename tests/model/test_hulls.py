"""Estimates from the geometry of a hull."""

import numpy as np
import pytest
import tomli_w
from support.refusals import refused

from bayesub.model import added_mass as am
from bayesub.model.coefficients import ADDED_MASSES, EQUATIONS, INDEX, TERMS
from bayesub.model.hull_files import HullFile
from bayesub.model.hulls import Hull, load_hull

TAIL = {"name": "tail", "from_m": 4.3, "to_m": 4.6, "top_m": 0.45, "bottom_m": 0.45, "side_m": 0.45}
TORPEDO = {"shape": "torpedo", "length_m": 5.0, "diameter_m": 0.55, "nose_m": 0.6, "tail_m": 1.4}


def hull_of(hull, *fins, **others) -> Hull:
    return Hull(HullFile.model_validate({"hull": hull, "fins": fins, **others}))


def dimensional(hull: Hull, name: str) -> float:
    """An estimate per water density, m^3 and so on."""
    factors = EQUATIONS.factors(hull.file.hull.length_m, hull.file.water_density_kgm3, 1.0)
    return hull.estimates(EQUATIONS)[name].value * factors[INDEX[name]] / hull.file.water_density_kgm3


def test_an_ellipsoid_is_lambs():
    a, b, c = 6.0, 1.1, 0.8
    hull = hull_of({"shape": "ellipsoid", "length_m": 2 * a, "beam_m": 2 * b, "height_m": 2 * c})
    volume = 4.0 / 3.0 * np.pi * a * b * c
    # sqrt at the ends of the outline: quadrature with 64 nodes a piece.
    assert hull.volume == pytest.approx(volume, rel=1e-6)
    assert hull.centre == pytest.approx(a)
    moved, turned = am.ellipsoid(a, b, c)
    for name, factor in zip(("Xudot", "Yvdot", "Zwdot"), moved, strict=True):
        assert dimensional(hull, name) == pytest.approx(-factor * volume, rel=1e-6)
    inertia = volume / 5.0 * np.array([b**2 + c**2, a**2 + c**2, a**2 + b**2])
    for name, factor in zip(("Kpdot", "Mqdot", "Nrdot"), turned * inertia, strict=True):
        assert dimensional(hull, name) == pytest.approx(-factor, rel=1e-6)
    assert {"Yrdot", "Nvdot", "Zqdot", "Mwdot"} <= hull.estimates(EQUATIONS).keys()  # zero, but not certainly
    assert hull.estimates(EQUATIONS)["Yrdot"].value == 0.0


@pytest.mark.parametrize("slenderness", [10.0, 30.0, 100.0])
def test_strip_theory_is_the_slender_limit(slenderness):
    """A long hull has the added mass of its sections, pi r^2 each; what is missing falls as log(s)/s^2.

    For spheroids it is about 2 log(s)/s^2 of k2 and three times that of k' (expansions of Lamb's factors).
    """
    hull = hull_of(TORPEDO | {"diameter_m": 5.0 / slenderness})
    aft = np.linspace(0.0, 5.0, 200_001)
    area = np.pi * hull.file.hull.half_widths(aft)[0] ** 2
    strips = np.trapezoid(area, aft), np.trapezoid(area * (aft - hull.centre) ** 2, aft)
    missing = 6.0 * np.log(slenderness) / slenderness**2
    for name, strip in zip(("Yvdot", "Nrdot"), strips, strict=True):
        assert 1.0 - missing < -dimensional(hull, name) / strip < 1.0


def test_symmetry_leaves_nothing_that_is_not_there():
    """A body of revolution with a cross of fins has no Kvw, Kqr, Kvdot; a sail makes them."""
    round_hull = hull_of(TORPEDO, TAIL)
    for name in ("Kvw", "Kqr", "Kvdot", "Krdot", "Ypdot", "Xrp"):
        assert name not in round_hull.estimates(EQUATIONS)
    sail = {"name": "sail", "from_m": 1.5, "to_m": 2.0, "top_m": 0.6}
    with_sail = hull_of(TORPEDO, TAIL, sail).estimates(EQUATIONS)
    assert with_sail["Kvdot"].value < 0.0
    assert with_sail["Kvdot"].value == with_sail["Ypdot"].value
    assert with_sail["Krdot"].value < 0.0  # ahead of the centre
    assert with_sail["Kvw"].value > 0.0


def test_a_moved_origin_moves_the_moments():
    """Parallel axes: Yrdot = x Yvdot and Nrdot grows by x^2 Yvdot."""
    at_centre, moved = hull_of(TORPEDO, TAIL), hull_of(TORPEDO, TAIL, origin_m=1.0)
    arm = moved.origin - at_centre.origin
    added = {name: dimensional(at_centre, name) for name in ("Yvdot", "Yrdot", "Nrdot", "Zqdot", "Mqdot")}
    assert dimensional(moved, "Yrdot") == pytest.approx(added["Yrdot"] + arm * added["Yvdot"])
    assert dimensional(moved, "Zqdot") == pytest.approx(added["Zqdot"] - arm * added["Yvdot"])
    for name in ("Nrdot", "Mqdot"):
        expected = added[name] + 2 * arm * added["Yrdot"] + arm**2 * added["Yvdot"]
        assert dimensional(moved, name) == pytest.approx(expected)


def test_fins_on_a_cylinder():
    """What fins add is chord times the finned section less the bare one, corrected for their span."""
    cylinder = {"shape": "offsets", "station_m": [0.0, 10.0], "radius_m": [0.5, 0.5]}
    fins = {"name": "planes", "from_m": 8.0, "to_m": 9.0, "side_m": 0.8}
    bare, finned = hull_of(cylinder), hull_of(cylinder, fins)
    correction = am.finite_span(0.6, 1.0)
    added = correction * np.pi * (0.8**2 - 2 * 0.5**2 + 0.5**4 / 0.8**2)
    assert dimensional(bare, "Zwdot") - dimensional(finned, "Zwdot") == pytest.approx(added)
    assert dimensional(finned, "Yvdot") == pytest.approx(dimensional(bare, "Yvdot"))  # edge on
    assert dimensional(finned, "Zqdot") == pytest.approx(-3.5 * added)  # aft of the centre
    rolling = correction * am.section_roll(0.5, 0.8, 0.8)
    assert dimensional(finned, "Kpdot") == pytest.approx(-rolling)


def test_suboff_from_its_outline(suboff):
    """DARPA SUBOFF's outline gives the measured added masses within two of the stated standard deviations.

    Outline of Groves, Huang & Chang (1989), DTRC/SHD-1298-01, as ellipse, cylinder and parabola; stern appendages as
    rectangles. Kpdot was not measured.
    """
    scale = suboff.length_m / 4.356
    sizes = {"length_m": 4.356, "diameter_m": 0.508, "nose_m": 1.016, "tail_m": 1.111}
    fins = [
        {"name": "sail", "from_m": 0.924, "to_m": 1.293, "top_m": 0.460},
        {"name": "stern", "from_m": 3.83, "to_m": 4.02, "top_m": 0.26, "bottom_m": 0.26, "side_m": 0.26},
    ]
    scaled = [{k: v if k == "name" else v * scale for k, v in fin.items()} for fin in fins]
    estimates = hull_of({"shape": "torpedo"} | {k: v * scale for k, v in sizes.items()}, *scaled).estimates(EQUATIONS)
    for name in (
        "Xudot",
        "Yvdot",
        "Zwdot",
        "Mqdot",
        "Nrdot",
        "Yrdot",
        "Nvdot",
        "Zqdot",
        "Mwdot",
        "Kvdot",
        "Nuv",
        "Muw",
    ):
        measured, estimate = suboff.xi[INDEX[name]], estimates[name]
        assert abs(estimate.value - measured) < 2.0 * estimate.sd, name
    assert set(ADDED_MASSES) == {t.name for t in TERMS if t.is_added_mass} <= estimates.keys()


@pytest.mark.parametrize(
    ("hull", "fins", "kind", "key"),
    [
        (TORPEDO | {"nose_m": 4.0}, [], "value", "hull"),
        (TORPEDO | {"diameter_m": -0.5}, [], "value", "hull.diameter_m"),
        (TORPEDO | {"diametre_m": 0.5}, [], "unknown", "hull.diametre_m"),
        (TORPEDO | {"shape": "sphere"}, [], "unknown", "hull.shape"),
        (TORPEDO, [TAIL | {"to_m": 4.0}], "value", "fins.0"),
        (TORPEDO, [TAIL | {"top_m": 0.01}], "value", "fins"),
        (TORPEDO, [TAIL | {"from_m": 50.0, "to_m": 51.0}], "value", "fins"),
        (TORPEDO | {"diameter_m": 500.0}, [], "value", ""),
        ({"shape": "ellipsoid", "length_m": 4.0, "beam_m": 0.5, "height_m": 4.1}, [], "value", ""),
        (TORPEDO, [{"name": "none", "from_m": 1.0, "to_m": 2.0}], "value", "fins.0"),
        ({"shape": "offsets", "station_m": [1.0, 2.0], "radius_m": [1.0, 1.0]}, [], "value", "hull"),
        ({"shape": "offsets", "station_m": [0.0, 2.0], "radius_m": [1.0]}, [], "value", "hull"),
        (TORPEDO | {"length_m": 1e200, "diameter_m": 1e200}, [], "value", "hull.length_m"),
        (TORPEDO | {"diameter_m": 1e-200}, [], "value", "hull.diameter_m"),
    ],
)
def test_refused(tmp_path, hull, fins, kind, key):
    path = tmp_path / "hull.toml"
    path.write_text(tomli_w.dumps({"hull": hull, "fins": fins}))
    with refused(kind, key) as error:
        load_hull(path)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)
