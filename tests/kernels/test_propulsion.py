"""The two propulsion models of appendix C beside the polynomial."""

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.io import toml_files
from bayesub.kernels import workspace

DIAMETER, DEDUCTION, WAKE = 6.0, 0.15, 0.3
CONSTANT = f'model = "constant_kt"\ndiameter_m = {DIAMETER}\nkt = 0.2\nthrust_deduction = {DEDUCTION}'
LINEAR = (
    f'model = "linear_kt"\ndiameter_m = {DIAMETER}\nkt0 = 0.5\nkt1 = -0.4\n'
    f"thrust_deduction = {DEDUCTION}\nwake_fraction = {WAKE}"
)


@pytest.fixture
def boat(tmp_path):
    """A maker of suboffs with another propulsion section."""

    def make(section):
        text = toml_files.find("suboff", "vehicles").read_text()
        head, rest = text.split("[propulsion]")
        path = tmp_path / "boat.toml"
        path.write_text(f"{head}[propulsion]\n{section}\n[actuators]{rest.split('[actuators]')[1]}")
        return bs.load_vehicle(path)

    return make


def thrust(vehicle, u, rpm):
    """Surge force of the propeller (N): what the acceleration gains by it, times the surge mass."""
    state = np.zeros((1, 12))
    state[0, 6] = u
    bare = bs.load_vehicle("suboff")
    mass = bare.body[workspace.MASS] - (bare.xi * bare.dimensional_factors)[bs.coefficients.INDEX["Xudot"]]
    drag = (bare.xi * bare.dimensional_factors)[bs.coefficients.INDEX["Xuu"]] * u**2
    return bs.accelerations(vehicle, state, np.zeros((1, 3)), rpm)[0, 0] * mass - drag


@pytest.mark.parametrize(
    ("section", "kt"), [(CONSTANT, lambda j: 0.2 + 0 * j), (LINEAR, lambda j: 0.5 - 0.4 * (1 - WAKE) * j)]
)
@pytest.mark.parametrize("u", [0.0, 0.5, 7.5])
@pytest.mark.parametrize("rpm", [-60.0, 40.0, 120.0])
def test_thrust_follows_the_open_water_diagram(boat, section, kt, u, rpm):
    """T = (1 - t) rho D^4 K_T(J) n|n| with J the advance of the boat, in every quadrant with u >= 0."""
    n = rpm / 60.0
    expected = (1 - DEDUCTION) * 1025.0 * DIAMETER**4 * kt(u / (n * DIAMETER)) * n * abs(n)
    assert thrust(boat(section), u, rpm) == pytest.approx(expected, rel=1e-10, abs=1e-3)  # against drags of 1e5 N


@pytest.mark.parametrize("section", [CONSTANT, LINEAR])
def test_the_self_propelled_speed_is_kept(boat, section):
    """k0 comes out so that at n' = 1 thrust balances drag: the boat stays at its trial speed."""
    vehicle = boat(section)
    track = bs.simulate(vehicle, bs.load_manoeuvre("horizontal", vehicle), sample=1.0, dt=1.0)
    np.testing.assert_allclose(track.states[0, :10, 6], 7.5, rtol=1e-12)  # until the rudder moves


def test_constant_kt_is_the_polynomial_that_npsauv_is_given_as():
    """Healey and Lienard's X_prop = Cd0 (n|n|/n0^2) u^2 is b3 = b6 = -b9 = Cd0 in the vehicle file."""
    auv = bs.load_vehicle("npsauv")
    drag = -auv.xi[bs.coefficients.INDEX["Xuu"]]
    b = auv.body[workspace.B1 : workspace.B9 + 1] / (0.5 * auv.water_density_kgm3 * auv.length_m**2)
    np.testing.assert_allclose(b, drag * np.array([0, 0, 1, 0, 0, 1, 0, 0, -1]), rtol=1e-12)


@pytest.mark.parametrize(
    ("section", "kind", "key"),
    [
        (CONSTANT.replace("constant_kt", "constantkt"), "unknown", "propulsion.model"),
        (CONSTANT.replace("diameter_m", "diameter"), "unknown", "propulsion.diameter"),
        (LINEAR.replace("-0.4", "0.4"), "value", "propulsion.kt1"),
        (LINEAR.replace("0.15", "1.5"), "value", "propulsion.thrust_deduction"),
    ],
)
def test_a_wrong_propulsion_section_is_one_clear_line(boat, section, kind, key):
    with refused(kind, key):
        boat(section)
