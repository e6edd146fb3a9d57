"""Added masses: closed forms, limits and tables."""

import tomllib

import numpy as np
import pytest
from scipy import integrate, optimize

import bayesub as bs
from bayesub.io import toml_files
from bayesub.model import added_mass as am
from bayesub.model.coefficients import EQUATIONS, INDEX, NAMES

# Length over breadth, k1, k2, k' (Lamb, Hydrodynamics, article 115).
LAMB = [
    (1.0, 0.5, 0.5, 0.0),
    (1.50, 0.305, 0.621, 0.094),
    (2.00, 0.209, 0.702, 0.240),
    (2.51, 0.156, 0.763, 0.367),
    (2.99, 0.122, 0.803, 0.465),
    (3.99, 0.082, 0.860, 0.608),
    (4.99, 0.059, 0.895, 0.701),
    (6.01, 0.045, 0.918, 0.764),
    (6.97, 0.036, 0.933, 0.805),
    (8.01, 0.029, 0.945, 0.840),
    (9.02, 0.024, 0.954, 0.865),
    (9.97, 0.021, 0.960, 0.883),
]


def spheroid(slenderness):
    """k1, k2, k' of a prolate spheroid in elementary functions (Lamb, articles 114 and 115)."""
    e = np.sqrt(1.0 - slenderness**-2)
    logarithm = np.log((1.0 + e) / (1.0 - e))
    alpha = 2.0 * (1.0 - e**2) / e**3 * (0.5 * logarithm - e)
    beta = 1.0 / e**2 - (1.0 - e**2) / (2.0 * e**3) * logarithm
    turning = e**4 * (beta - alpha) / ((2.0 - e**2) * (2.0 * e**2 - (2.0 - e**2) * (beta - alpha)))
    return alpha / (2.0 - alpha), beta / (2.0 - beta), turning


def factors(slenderness):
    moved, turned = am.ellipsoid(slenderness, 1.0, 1.0)
    return moved[0], moved[1], turned[1]


def test_a_sphere_carries_half_its_displaced_mass():
    moved, turned = am.ellipsoid(2.3, 2.3, 2.3)
    np.testing.assert_allclose(moved, 0.5, rtol=1e-14)
    np.testing.assert_array_equal(turned, 0.0)


@pytest.mark.parametrize("row", LAMB)
def test_lambs_table(row):
    # Lamb's third digits: 0.209 and 0.702 at 2.00 are 0.2100 and 0.7042.
    np.testing.assert_allclose(factors(row[0]), row[1:], atol=2.5e-3)


@pytest.mark.parametrize("slenderness", [1.3, 2.0, 4.0, 7.8, 20.0, 100.0])
def test_spheroid_in_elementary_functions(slenderness):
    # The elementary forms cancel at either end: 1e-16 over e^5 or over the smallest factor.
    np.testing.assert_allclose(factors(slenderness), spheroid(slenderness), rtol=1e-10)


def test_axes_are_alike():
    """Exchanging the axes of an ellipsoid exchanges the factors."""
    moved, turned = am.ellipsoid(3.0, 2.0, 0.7)
    for order in ([1, 0, 2], [2, 1, 0], [1, 2, 0]):
        other = am.ellipsoid(*np.array([3.0, 2.0, 0.7])[order])
        np.testing.assert_allclose(other, [moved[order], turned[order]], rtol=1e-12)


def test_disc_and_cylinder_are_the_limits():
    """A disc has (8/3) a^3 broadside on and (16/45) a^5 about a diameter (Lamb 108); a long spheroid is its strips."""
    thin = 1e-7
    volume = 4.0 / 3.0 * np.pi * thin
    moved, turned = am.ellipsoid(thin, 1.0, 1.0)
    assert moved[0] * volume == pytest.approx(8.0 / 3.0, rel=1e-6)
    assert turned[1] * volume * (1.0 + thin**2) / 5.0 == pytest.approx(16.0 / 45.0, rel=1e-6)
    k1, k2, turning = factors(1000.0)
    assert k1 < 1e-5
    assert k2 == pytest.approx(1.0, abs=2e-5)
    assert turning == pytest.approx(1.0, abs=1e-4)


def test_a_long_rankine_ovoid():
    """Flux times distance of its source and sink, less its volume from the stream function, for 100 radii of length.

    What is left are terms of the radius over the length.
    """
    half = 50.0
    flux = np.pi * np.sqrt(1.0 + half**-2)  # of a source at -half and a sink at half, for a middle radius of one
    end = optimize.brentq(
        lambda x: flux / (4 * np.pi) * (1 / (x - half) ** 2 - 1 / (x + half) ** 2) - 1, half + 0.1, 60
    )

    def excess(r, x):
        angles = (x + half) / np.hypot(x + half, r) - (x - half) / np.hypot(x - half, r)
        return flux / (2.0 * np.pi) * angles - r**2

    def radius(x):
        return optimize.brentq(excess, 1e-3, 2.0, args=(x,)) if excess(1e-3, x) > 0.0 else 0.0

    pieces = [(0.0, half - 5.0), (half - 5.0, half), (half, end)]
    volume = 2.0 * sum(integrate.quad(lambda x: np.pi * radius(x) ** 2, *piece, epsrel=1e-9)[0] for piece in pieces)
    assert flux * 2.0 * half - volume == pytest.approx(am.long_ovoid(1.0), rel=0.05)


def newmans_finned_circle(radius, tip):
    """Roll added inertia of a circle with two equal fins, as printed in Newman's table 4.3."""
    alpha = np.pi - np.arcsin(2.0 * radius * tip / (radius**2 + tip**2))
    bracket = 2.0 * alpha**2 - alpha * np.sin(4.0 * alpha) + 0.5 * np.sin(2.0 * alpha) ** 2
    return radius**4 * (bracket / (np.pi * np.sin(alpha) ** 4) - 0.5 * np.pi)


def test_sections():
    """Circle, plate and finned circle (Newman, table 4.3); a fin on one side of a point is a plate of its length."""
    assert am.section(0.3, 0.0, 0.0) == pytest.approx(np.pi * 0.09)
    assert am.section(0.0, 1.2, 1.2) == pytest.approx(np.pi * 1.44)
    assert am.section(0.0, 1.2, 0.0) == pytest.approx(np.pi * 0.36)
    r, s = 0.4, 1.1
    assert am.section(r, s, s) == pytest.approx(np.pi * (s**2 - r**2 + r**4 / s**2))
    assert am.section(r, s, 0.0) == am.section(r, 0.0, s) == am.section(r, r, s)
    assert am.section(r, r, r) < am.section(r, s, r) < am.section(r, s, s)


def test_roll_of_sections():
    """Plate (pi/8) s^4, cruciform (2/pi) s^4 and Newman's finned circle; a bare circle has none.

    Fourier sums are cut after 4096 terms, whose squares fall as n^-3 from roots of fins: one part in a thousand of
    the plate is left at most.
    """
    assert am.section_roll(0.0, 1.5, 1.5) == pytest.approx(np.pi / 8.0 * 1.5**4, rel=1e-12)
    assert am.cruciform_roll(0.0, 1.5) == pytest.approx(2.0 / np.pi * 1.5**4, rel=1e-6)
    assert am.section_roll(1.0, 1.0, 1.0) == am.cruciform_roll(1.0, 1.0) == 0.0
    for radius in (0.1, 0.3, 0.5, 0.7, 0.9):
        assert am.section_roll(radius, 1.0, 1.0) == pytest.approx(newmans_finned_circle(radius, 1.0), abs=4e-4)
    # A plate turned about one end: that about its middle, and its sway added mass at half its length.
    assert am.section_roll(0.0, 1.0, 0.0) == pytest.approx(np.pi / 8.0 / 16.0 + np.pi / 4.0 / 4.0, rel=1e-12)


def test_figure_5_of_the_thesis():
    """Up to half the span the circle changes plates and crosses little; beyond it a lot."""
    assert newmans_finned_circle(0.5, 1.0) == pytest.approx(np.pi / 8.0, rel=0.15)
    assert am.cruciform_roll(0.5, 1.0) == pytest.approx(2.0 / np.pi, rel=0.15)
    assert newmans_finned_circle(0.9, 1.0) < 0.1 * np.pi / 8.0


def test_finite_span():
    """A square plate has 0.579 of its strips (Blevins; Pabst's formula is 4 % short), a long one chord over span."""
    assert am.finite_span(1.0, 1.0) == pytest.approx(0.579, rel=0.04)
    assert am.finite_span(1e-6, 1.0) == pytest.approx(1.0, rel=1e-6)
    assert 1e4 * am.finite_span(1e4, 1.0) == pytest.approx(1.0, rel=1e-4)
    # A plate is the same plate when chord and span change places: strips times factor stay.
    assert 3.0**2 * am.finite_span(3.0, 1.0) == pytest.approx(3.0 * am.finite_span(1.0, 3.0))


def test_water_frozen_to_the_hull_moves_like_mass(motions, vehicle_with):
    """Mass and inertia moved from the body to the added masses, with what follows from them, change no acceleration."""
    states, controls, rpm = motions
    content = tomllib.loads(toml_files.find("npsauv", "vehicles").read_text())
    content["coefficients"] |= dict.fromkeys(content["coefficients"], 0.0)
    content["body"] |= {"centre_of_gravity_m": [0.0] * 3, "inertia_kgm2": {"Ixx": 9e3, "Iyy": 5e4, "Izz": 7e4}}
    content["body"]["mass_kg"] = 8000.0
    content["propulsion"]["b"] = [0.0] * 9
    solid = vehicle_with(content)
    frozen = am.coefficients_of(np.diag([3000.0] * 3 + [4e3, 3e4, 2e4]), EQUATIONS) / solid.dimensional_factors
    content["coefficients"] = dict(zip(NAMES, map(float, frozen), strict=True))
    content["body"] |= {"mass_kg": 5000.0, "inertia_kgm2": {"Ixx": 5e3, "Iyy": 2e4, "Izz": 5e4}}
    thawed = vehicle_with(content)
    expected = bs.accelerations(solid, states, controls, rpm)
    np.testing.assert_allclose(bs.accelerations(thawed, states, controls, rpm), expected, rtol=1e-9, atol=1e-9)


def test_ideal_fluid_does_no_work_on_steady_motion(rng):
    """The products of speeds take no power from a boat with a sail, whatever it does (d'Alembert)."""
    added = np.diag([0.1, 2.0, 1.8, 0.03, 0.9, 1.0])
    for i, j, value in ((1, 5, 0.2), (2, 4, -0.15), (1, 3, 0.04), (3, 5, 0.01)):
        added[i, j] = added[j, i] = value
    velocities = rng.standard_normal((40, 6))
    xi = am.coefficients_of(added, EQUATIONS)
    columns = bs.regressors(np.hstack([np.zeros((40, 6)), velocities]), np.zeros((40, 6)), np.zeros((40, 3)))
    forces = [columns[axis] @ [xi[INDEX[n]] for n in bs.coefficients.names_of_axis(axis)] for axis in "XYZKMN"]
    work = np.sum(np.transpose(forces) * velocities, axis=1)
    assert np.abs(work).max() < 1e-12


def test_munk_moment():
    """A body at an angle to its way turns broadside on: Nuv = -(A22 - A11), Muw = A33 - A11 (Munk 1924)."""
    xi = am.coefficients_of(np.diag([0.1, 2.0, 1.8, 0.0, 0.0, 0.0]), EQUATIONS)
    assert xi[INDEX["Nuv"]] == pytest.approx(-1.9)
    assert xi[INDEX["Muw"]] == pytest.approx(1.7)


def test_the_derived_coefficients_of_suboff(suboff):
    """suboff's file has coefficients derived by hand from its added masses; the same follow here."""
    added = np.zeros((6, 6))
    for name in bs.coefficients.ADDED_MASSES:
        place = "XYZKMN".index(name[0]), "uvwpqr".index(name[1])
        added[place] = -suboff.xi[INDEX[name]]
    found = am.coefficients_of(0.5 * (added + added.T), EQUATIONS)
    for name in (
        "Xvr",
        "Xwq",
        "Xrp",
        "Ywp",
        "Zvp",
        "Zpp",
        "Kvw",
        "Kwp",
        "Kqr",
        "Kpq",
        "Mpp",
        "Mrp",
        "Nvq",
        "Npq",
        "Nqr",
    ):
        assert found[INDEX[name]] == pytest.approx(suboff.xi[INDEX[name]], rel=1e-3), name
