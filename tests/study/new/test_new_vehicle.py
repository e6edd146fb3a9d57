"""New files: what is written loads, holds every key, and replaces nothing."""

import re
import tomllib

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.io import toml_files
from bayesub.model import hulls
from bayesub.model.actuator_files import ActuatorsSection
from bayesub.model.coefficients import EQUATIONS, NAMES
from bayesub.model.propulsion import PolynomialSection
from bayesub.model.vehicle_files import BodySection, InertiaSection, TrialSpeedSection, VehicleFile
from bayesub.study.new import files

OPTIONAL = {"buoyancy_n", "model"}  # they exclude other keys; both are in comments


def load(text, folder):
    path = folder / "boat.toml"
    path.write_text(text)
    return bs.load_vehicle(path)


def test_a_template_has_every_key_and_no_coefficient(tmp_path):
    text = files.vehicle("mine")
    vehicle = load(text, tmp_path)
    assert vehicle.name == "mine"
    np.testing.assert_array_equal(vehicle.xi, 0.0)
    assert np.isnan(vehicle.sd).all()
    content = tomllib.loads(text)
    sections = {
        "trial": TrialSpeedSection,
        "body": BodySection,
        "propulsion": PolynomialSection,
        "actuators": ActuatorsSection,
    }
    others = {"hull", "displacement", "correlations"}  # of a cross-flow, of gliders, of coefficients with an sd
    assert content.keys() == VehicleFile.model_fields.keys() - others
    assert "# [correlations]" in text
    for key, section in sections.items():
        assert content[key].keys() == section.model_fields.keys() - OPTIONAL, key
    assert content["body"]["inertia_kgm2"].keys() == InertiaSection.model_fields.keys()
    assert list(content["coefficients"]) == list(NAMES)
    for term in bs.coefficients.TERMS:
        assert re.search(
            rf"(?m)^{term.name} .*# .*l\^{term.length_power} {re.escape(term.regressor.replace('*', ' '))}$", text
        )


def test_the_speed_of_a_set_is_named_by_its_symbol():
    """Coefficients of the ship are non-dimensional on the speed of the moment V, not on that of trials."""
    text = files.vehicle("mine", equations="abkowitz")
    assert re.search(r"(?m)^Yvvv .* # \(rho/2\) l\^2 V\^-1 v\^3$", text)
    assert "(rho/2) l^k V^j" in text
    assert "V = sqrt(u^2 + v^2 + w^2)" in text.replace("\n# ", " ")


def test_a_geometry_fills_the_added_masses(tmp_path):
    """The estimates are in the file to the digits it has, with their sd and source; the body is the displaced water."""
    path = tmp_path / "hull.toml"
    path.write_text(files.geometry("mine"))
    hull = hulls.load_hull(path)
    text = files.vehicle("mine", hull)
    vehicle = load(text, tmp_path)
    estimates = hull.estimates(EQUATIONS)
    for name, value, sd in zip(NAMES, vehicle.xi, vehicle.sd, strict=True):
        if name in estimates:
            assert value == pytest.approx(estimates[name].value, rel=1e-3)
            assert sd == pytest.approx(estimates[name].sd, rel=0.05)
            assert re.search(rf"(?m)^{name} .*{re.escape(estimates[name].source)}$", text)
        else:
            assert value == 0.0
            assert np.isnan(sd)
    assert vehicle.length_m == 5.0
    assert vehicle.body[0] == pytest.approx(1025.0 * hull.volume, rel=1e-5)
    prior = bs.priors.from_vehicle(vehicle)
    assert prior.has_scale(np.arange(101), vehicle.xi, EQUATIONS).sum() == len(estimates)


@pytest.mark.parametrize("name", toml_files.built_in("vehicles"))
def test_a_copy_is_the_vehicle_under_another_name(name, tmp_path):
    copied, original = load(files.copied_vehicle("mine", name), tmp_path), bs.load_vehicle(name)
    assert copied.name == "mine"
    np.testing.assert_array_equal(copied.xi, original.xi)
    np.testing.assert_array_equal(copied.body, original.body)


@pytest.mark.parametrize("name", ["", "my boat", 'quo"te', "../up", ".hidden", "boat\n"])
def test_names_that_are_no_names(name):
    with refused("value", "name"):
        files.vehicle(name)


def test_nothing_is_overwritten(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("precious")
    with refused("file", "-o"):
        files.write_new(path, "new")
    assert path.read_text() == "precious"
    with refused("file", "-o"):
        files.write_new(tmp_path / "absent" / "mine.toml", "new")
