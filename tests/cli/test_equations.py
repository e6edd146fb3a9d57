"""Equation sets on the command line: listed, checked, written, copied, and given to new vehicles."""

import json
import tomllib

import numpy as np
import pytest
from support import refusals

import bayesub as bs
from bayesub.io import toml_files
from bayesub.model.equations.files import AxesSection, EquationFile, TermSection
from bayesub.study.new import files


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_list_says_what_each_set_has(bayesub):
    status, out, _ = bayesub("list", "equations", "--json")
    sets = json.loads(out)["equations"]
    assert status == 0
    assert list(sets) == list(toml_files.built_in("equations"))
    assert sets["booth"].startswith(
        "101 terms, 6 degrees of freedom, rudder_deg, bow_plane_deg, stern_plane_deg: Standard"
    )
    assert "3 degrees of freedom, rudder_deg:" in sets["abkowitz"]


@pytest.mark.parametrize("name", toml_files.built_in("equations"))
def test_check_says_what_a_set_has(bayesub, name):
    equations = bs.load_equations(name)
    status, out, _ = bayesub("check", name)
    assert status == 0
    assert out.startswith(f"{name}: equations '{name}', {len(equations.terms)} terms, ")
    words = out.split()
    assert all(term in words for term in equations.names)
    content = json.loads(bayesub("check", name, "--json")[1])[name]
    assert [term for names in content["terms"].values() for term in names] == list(equations.names)
    assert content["subproblems"] == {plane: list(names) for plane, names in equations.subproblems.items()}
    assert content["controls"] == {control.symbol: control.column for control in equations.controls}
    assert content["crossflow_points"] == (16 if name == "feldman" else None)
    assert all(content["units"].get(term.name) == term.unit for term in equations.terms)


def test_a_template_explains_every_key_and_loads(bayesub, tmp_path):
    status, out, _ = bayesub("new", "equations", "few")
    assert (status, out.split(":")[0]) == (0, "few.toml")
    text = (tmp_path / "few.toml").read_text()
    keys = {
        *EquationFile.model_fields,
        *TermSection.model_fields,
        *(f"terms.{axis}" for axis in AxesSection.model_fields),
    }
    assert all(key in text for key in keys)
    few = bs.load_equations("few.toml")
    assert few.term("Yvv").unit == "kg/m"
    assert set(few.subproblems) == {"horizontal", "vertical"}
    assert "dimensional       Yvv kg/m, Zww kg/m" in bayesub("check", "few.toml")[1]


def test_a_copy_is_the_set_under_another_name(bayesub):
    assert bayesub("new", "equations", "mine", "--from", "remus")[0] == 0
    mine, remus = bs.load_equations("mine.toml"), bs.load_equations("remus")
    assert (mine.name, mine.terms, mine.controls) == ("mine", remus.terms, remus.controls)


def test_copies_in_another_folder_find_the_sets_that_they_name(bayesub, tmp_path):
    """Of a set that extends another file, and of a vehicle that names a file."""
    (tmp_path / "sets").mkdir()
    (tmp_path / "boats").mkdir()
    assert bayesub("new", "equations", "base", "-o", "sets/base.toml")[0] == 0
    (tmp_path / "sets" / "more.toml").write_text(
        'name = "more"\ntitle = ""\nextends = "base.toml"\n[terms.N]\n'
        'Nvv = { regressor = "v*abs(v)", length_power = 3, label = "N_{vv}", meaning = "yaw moment" }\n'
    )
    assert bayesub("new", "equations", "copy", "--from", "sets/more.toml")[0] == 0
    assert bs.load_equations("copy.toml").terms == bs.load_equations("sets/more.toml").terms
    assert bayesub("new", "vehicle", "boat", "--equations", "copy.toml", "-o", "boats/boat.toml")[0] == 0
    assert tomllib.loads((tmp_path / "boats" / "boat.toml").read_text())["equations"] == "../copy.toml"
    assert bayesub("new", "vehicle", "other", "--from", "boats/boat.toml")[0] == 0
    assert bs.load_vehicle("other.toml").equations.names == bs.load_equations("copy.toml").names


TERM = '{ regressor = "%s", length_power = 2, label = "X", meaning = "force" }'
HEAD = 'name = "bad"\ntitle = ""\n[controls]\ndr = "rudder_deg"\n[terms.X]\nXuu = ' + TERM % "u*u" + "\n"
BAD = {
    "an unknown symbol": ("Xa = " + TERM % "u*vv", "model", "terms.X.Xa"),
    "a term twice": ("Xa = " + TERM % "u^2", "model", "terms.X.Xa"),
    "no label": ('Xa = { regressor = "u*v", length_power = 2, meaning = "force" }', "missing", "terms.X.Xa.label"),
    "no force": ("Xa = " + TERM % "u*r", "model", "terms.X.Xa"),
    "a wrong axis": ("[terms.W]\nWuu = " + TERM % "u*u", "unknown", "terms.W"),
    "no TOML": ("Xa = {", "format", ""),
}


@pytest.mark.parametrize("mistake", BAD)
def test_a_bad_set_is_one_line(bayesub, tmp_path, mistake):
    line, kind, key = BAD[mistake]
    (tmp_path / "bad.toml").write_text(HEAD + line + "\n")
    status, _, err = bayesub("check", "bad.toml")
    assert (status, err.count("\n")) == (2, 1)
    assert "bad.toml" in err
    refusals.check(bayesub.error, kind, key)


def test_sets_that_extend_each_other_are_refused(bayesub, tmp_path):
    for one, other in (("one", "two"), ("two", "one")):
        (tmp_path / f"{one}.toml").write_text(f'name = "{one}"\ntitle = ""\nextends = "{other}.toml"\n[terms.X]\n')
    status, _, err = bayesub("check", "one.toml")
    assert (status, err.count("\n")) == (2, 1)
    refusals.check(bayesub.error, "model", "extends")


def test_a_changed_set_is_read_again_through_those_that_extend_it(tmp_path):
    base = tmp_path / "base.toml"
    base.write_text(HEAD.replace("bad", "base"))
    (tmp_path / "more.toml").write_text('name = "more"\ntitle = ""\nextends = "base.toml"\n[terms.X]\n')
    assert bs.load_equations("more.toml").names == ("Xuu",)
    base.write_text(HEAD.replace("bad", "base") + "Xvv = " + TERM % "v^2" + "\n")
    assert bs.load_equations("more.toml").names == ("Xuu", "Xvv")


@pytest.mark.parametrize("name", ["1st", "my set", "a.b", ""])
def test_names_that_are_no_names_of_sets(name):
    with refusals.refused("value", "name"):
        files.equations(name)


@pytest.mark.parametrize("name", toml_files.built_in("equations"))
def test_a_new_vehicle_has_the_coefficients_of_its_set(bayesub, tmp_path, name):
    """Each with its factor and regressor, and the sections that the set needs."""
    assert bayesub("new", "vehicle", "boat", "--equations", name)[0] == 0
    boat, text = bs.load_vehicle("boat.toml"), (tmp_path / "boat.toml").read_text()
    assert boat.equations.name == name
    np.testing.assert_array_equal(boat.xi, 0.0)
    assert list(tomllib.loads(text)["coefficients"]) == list(boat.equations.names)
    for term in boat.equations.terms:
        (line,) = (line for line in text.splitlines() if line.startswith(f"{term.name} "))
        assert term.regressor.replace("*", " ") in line
        scale = term.scale.replace("U", "V") if boat.equations.speed == "instantaneous" else term.scale
        assert (f"unit {term.unit}" if term.unit else f"# {scale} ") in line
    assert ("[hull]" in text) == boat.equations.has_crossflow
    assert ('model = "none"' in text) == (name in ("abkowitz", "mmg"))


def test_a_geometry_gives_the_stations_of_its_hull(bayesub):
    bayesub("new", "geometry", "shape")
    assert bayesub("new", "vehicle", "boat", "--geometry", "shape_hull.toml", "--equations", "feldman")[0] == 0
    boat = bs.load_vehicle("boat.toml")
    x, height, breadth = boat.hull
    assert x[-1] - x[0] == pytest.approx(boat.length_m, abs=1e-4)
    assert height.max() == breadth.max() == pytest.approx(0.55)
    assert boat.xi[boat.equations.index["Yvdot"]] < 0.0
    status, _, err = bayesub("new", "vehicle", "x", "--from", "suboff", "--equations", "remus")
    assert (status, err.count("\n")) == (2, 1)
    refusals.check(bayesub.error, "conflict", "--equations")


def test_the_card_of_a_set_is_not_drawn(bayesub):
    status, _, err = bayesub("check", "booth", "--card", "card.png")
    assert (status, err.count("\n")) == (2, 1)
    refusals.check(bayesub.error, "conflict", "--card")
