"""Vehicle files: what is read and what is refused."""

import re

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.kernels.workspace import BODY
from bayesub.model.coefficients import NAMES
from bayesub.model.vehicles import GRAVITY_MPS2, MOTIONS, without_inertia


@pytest.mark.parametrize("name", ["suboff", "auv690", "npsauv"])
def test_built_in_vehicles(name):
    """Every built-in vehicle floats upright at neutral weight, and its mass matrix is positive definite."""
    vehicle = bs.load_vehicle(name)
    body = dict(zip(BODY, vehicle.body, strict=True))
    assert vehicle.name == name
    assert body["zG"] > body["zB"]
    assert body["weight"] == body["buoyancy"] == GRAVITY_MPS2 * body["mass"]
    matrix = vehicle.mass_matrix
    assert np.linalg.eigvalsh((matrix + matrix.T) / 2).min() > 0


def test_order_of_coefficients_in_the_file_does_not_matter(full, boat, vehicle_with):
    """Coefficients are read by name."""
    shuffled = boat | {"coefficients": dict(reversed(boat["coefficients"].items()))}
    np.testing.assert_array_equal(vehicle_with(shuffled).xi, full.xi)
    np.testing.assert_array_equal(full.xi, [boat["coefficients"][name] for name in NAMES])


def test_arrays_are_read_only(full):
    """A vehicle cannot be changed by accident."""
    for array in (full.xi, full.body):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_standard_deviations_stand_beside_values(boat, vehicle_with):
    """A coefficient with an sd has the same value; the others have none, in any number format."""
    plain = vehicle_with(boat)
    given = {"Yuv": {"value": -0.032, "sd": 0.003}, "Xuu": {"value": -1}, "Nuu": {"value": 0, "sd": 1e-5}}
    vehicle = vehicle_with(boat | {"coefficients": boat["coefficients"] | given})
    found = {name: (x, sd) for name, x, sd in zip(NAMES, vehicle.xi, vehicle.sd, strict=True)}
    assert found["Yuv"] == (-0.032, 0.003)
    assert found["Nuu"] == (0.0, 1e-5)
    assert found["Xuu"][0] == -1.0
    assert np.isnan(found["Xuu"][1])
    assert np.isnan(plain.sd).all()
    assert np.isfinite(vehicle.sd).sum() == 2
    others = [k for k, name in enumerate(NAMES) if name not in given]
    np.testing.assert_array_equal(vehicle.xi[others], plain.xi[others])


REFUSED = [
    (r"length_m = 102.2606\n", "", "missing", "body.length_m"),
    (r"\[actuators\]", "[actuator]", "unknown", "actuator"),
    (r"rpm_per_mps = 10.0", "rpm_per_mps = 10.0\nrpm_per_knot = 5", "unknown", "propulsion.rpm_per_knot"),
    (r"rpm_per_mps = 10.0", "rpm_per_mps = 10.0\nthrust_line_z = 1", "unknown", "propulsion.thrust_line_z"),
    (r"speed_mps = 7.5", "speed_mps = nan", "value", "trial.speed_mps"),
    (r"speed_mps = 7.5", "speed_mps = inf", "value", "trial.speed_mps"),
    (r"speed_mps = 7.5", 'speed_mps = "fast"', "value", "trial.speed_mps"),
    (r"mass_kg = 1.00271e\+07", "mass_kg = -1.0", "value", "body.mass_kg"),
    (r"mass_kg = 1.00271e\+07", "mass_kg = 0", "value", "body.mass_kg"),
    (r"Ixx = 1.83394e\+08, ", "", "missing", "body.inertia_kgm2.Ixx"),
    (r"Ixy = 0", "Ixy = 0, Izzz = 1", "unknown", "body.inertia_kgm2.Izzz"),
    (r"centre_of_gravity_m = \[0.0, ", "centre_of_gravity_m = [", "missing", "body.centre_of_gravity_m.2"),
    (r"b = \[-0.00072709, ", "b = [", "value", "propulsion.b"),
    (r"Xrp        = 6.05e-05", "Xrp        = nan", "value", "coefficients.Xrp"),
    (r"Xrp        = 6.05e-05", 'Xrp = "small"', "value", "coefficients.Xrp"),
    (r"Xrp        = 6.05e-05", "Xrp = true", "value", "coefficients.Xrp"),
    (r"Xrp        = 6.05e-05", "Xrp = { value = 6e-5, sd = -1e-5 }", "value", "coefficients.Xrp.sd"),
    (r"Xrp        = 6.05e-05", "Xrp = { value = 6e-5, sd = 0 }", "value", "coefficients.Xrp.sd"),
    (r"Xrp        = 6.05e-05", "Xrp = { value = 6e-5, std = 1e-5 }", "unknown", "coefficients.Xrp.std"),
    (r"Xrp        = 6.05e-05", "Xrp = { sd = 1e-5 }", "missing", "coefficients.Xrp.value"),
    (r"Xrp        = 6.05e-05", "Xrp = 1e300", "unit", "coefficients.Xrp.value"),
    (r"length_m = 102.2606", "length_m = 1e200", "value", "body.length_m"),
    (r"length_m = 102.2606", "length_m = 1e-200", "value", "body.length_m"),
    (r"Xrp        = 6.05e-05", "", "missing", "coefficients.Xrp"),
    (r"Xrp        = 6.05e-05", "Xrpp       = 6.05e-05", "unknown", "coefficients.Xrpp"),
    (r"neutrally_buoyant = true", "neutrally_buoyant = false", "value", "body"),
    (r"neutrally_buoyant = true", "neutrally_buoyant = true\nbuoyancy_n = 1e8", "value", "body"),
    (r"\[trial\]", "[trial", "format", ""),
    (r"speed_mps = 7.5", "speed_mps = 7.5\nspeed_mps = 8", "format", ""),
]


@pytest.mark.parametrize(("pattern", "replacement", "kind", "key"), REFUSED)
def test_bad_files(tmp_path, suboff_file, pattern, replacement, kind, key):
    """A vehicle file that does not fit is refused in one line that names file, key and remedy."""
    text, count = re.subn(pattern, replacement, suboff_file, count=1)
    assert count == 1
    path = tmp_path / "boat.toml"
    path.write_text(text)
    with refused(kind, key) as error:
        bs.load_vehicle(path)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


def test_a_drag_that_pushes_has_no_self_propulsion(tmp_path, suboff_file):
    """A propeller is matched to the drag -Xuu u^2; the sign of Xuu is the usual mistake, and is named."""
    propeller = 'model = "constant_kt"\nkt = 0.2\ndiameter_m = 5'
    text = re.sub(r"b = \[.*\].*\nrpm_per_mps = 10.0", propeller, suboff_file)
    path = tmp_path / "boat.toml"
    path.write_text(text)
    assert bs.load_vehicle(path).rpm_per_mps > 0.0
    path.write_text(re.sub(r"Xuu        = -0.001", "Xuu = 0.001", text))
    with refused("model"):
        bs.load_vehicle(path)


@pytest.mark.parametrize("motion", ["surge", "sway", "heave", "roll", "pitch", "yaw"])
def test_a_singular_mass_matrix_is_refused(boat, full, vehicle_with, motion):
    """Added masses that take away all that resists a motion are named with the motion; half of them are not."""
    matrix, k = full.mass_matrix, MOTIONS.index(motion)
    # The Schur complement is what of the inertia the other motions leave.
    others = np.arange(6) != k
    rest = matrix[k, k] - matrix[k, others] @ np.linalg.solve(matrix[np.ix_(others, others)], matrix[others, k])
    name = ("Xudot", "Yvdot", "Zwdot", "Kpdot", "Mqdot", "Nrdot")[k]
    factor = full.dimensional_factors[NAMES.index(name)]
    value = boat["coefficients"][name]
    vehicle_with(boat | {"coefficients": boat["coefficients"] | {name: value + 0.5 * rest / factor}})
    with refused("model", "body") as error:
        vehicle_with(boat | {"coefficients": boat["coefficients"] | {name: value + rest / factor}})
    assert name in str(error.value)
    assert str(error.value).isprintable()


def test_the_motion_without_inertia(full):
    """It is that whose row and column are empty; with three degrees of freedom roll is not asked."""
    for k, motion in enumerate(MOTIONS):
        matrix = full.mass_matrix
        matrix[k] = matrix[:, k] = 0.0
        assert without_inertia(matrix, full.length_m, 6) == motion
        assert without_inertia(matrix, full.length_m, 3) == (motion if motion in ("surge", "sway", "yaw") else "")
    assert without_inertia(full.mass_matrix, full.length_m, 6) == ""


def test_files_that_cannot_be_read(tmp_path):
    """A missing file, a directory, and a file that is not text are each said to be that."""
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "noise.toml").write_bytes(b"\xff\xfe\x00\x81")
    for name, kind in (("absent.toml", "file"), ("folder.toml", "file"), ("noise.toml", "format")):
        with refused(kind):
            bs.load_vehicle(tmp_path / name)
    with refused("unknown", "subof"):
        bs.load_vehicle("subof")


CORRELATED = {
    "Yuv": {"value": -0.032, "sd": 0.003},
    "Nuv": {"value": -0.012, "sd": 1e-3},
    "Xuu": {"value": -1e-3, "sd": 1e-4},
}
MATRIX = [[1.0, 0.6, 0.0], [0.6, 1.0, -0.3], [0.0, -0.3, 1.0]]


def with_correlations(boat, names=tuple(CORRELATED), matrix=MATRIX):
    table = {"coefficients": list(names), "matrix": matrix}
    return boat | {"coefficients": boat["coefficients"] | CORRELATED, "correlations": table}


def test_correlations_are_read_by_name(boat, vehicle_with):
    """In the order of the equations, whatever that of the table; all other coefficients are independent."""
    vehicle = vehicle_with(with_correlations(boat))
    places = [NAMES.index(name) for name in CORRELATED]
    np.testing.assert_array_equal(vehicle.correlation[np.ix_(places, places)], MATRIX)
    assert np.count_nonzero(vehicle.correlation) == len(NAMES) + 4
    assert vehicle_with(boat).correlation is None


@pytest.mark.parametrize(
    ("names", "matrix", "kind", "key"),
    [
        (("Yuv", "Nuv", "Xvu"), MATRIX, "unknown", "correlations.coefficients"),
        (("Yuv", "Nuv", "Nur"), MATRIX, "missing", "coefficients.Nur.sd"),
        (("Yuv", "Nuv", "Nuv"), MATRIX, "value", "correlations"),
        (("Yuv", "Nuv"), MATRIX, "value", "correlations"),
        (("Yuv", "Nuv"), [[1.0, 0.2], [0.2]], "value", "correlations"),
        (("Yuv", "Nuv"), [[1.0, 0.2], [0.3, 1.0]], "value", "correlations"),
        (("Yuv", "Nuv"), [[2.0, 0.2], [0.2, 1.0]], "value", "correlations"),
        (("Yuv", "Nuv"), [[1.0, 1.2], [1.2, 1.0]], "value", "correlations"),
        (("Yuv", "Nuv"), [[1.0, 1.0], [1.0, 1.0]], "value", "correlations"),
        (tuple(CORRELATED), [[1.0, 0.9, -0.9], [0.9, 1.0, 0.9], [-0.9, 0.9, 1.0]], "value", "correlations"),
        (("Yuv", "Nuv"), [[1.0, float("nan")], [float("nan"), 1.0]], "value", "correlations.matrix.0.1"),
        (("Yuv",), [[1.0]], "value", "correlations.coefficients"),
    ],
)  # fmt: skip
def test_correlations_that_are_none_are_refused_in_a_line(boat, vehicle_with, names, matrix, kind, key):
    with refused(kind, key) as error:
        vehicle_with(with_correlations(boat, names, matrix))
    assert str(error.value).isprintable()
