"""Equation files: what is read, and one clear line for what cannot be."""

import json
import re
import time

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.model.equations import load_equations

SMALL = """
name = "small"
title = "A few terms"

[controls]
dr = "rudder_deg"

[terms.X]
Xuu   = { regressor = "u*abs(u)", length_power = 2, label = "X'_{u|u|}", meaning = "resistance" }
Xudot = { regressor = "udot", length_power = 3, label = "X'_{\\\\dot{u}}", meaning = "added mass" }

[terms.Y]
Yuv    = { regressor = "u*v", length_power = 2, label = "Y'_{uv}", meaning = "side force of drift" }
Yuu_dr = { regressor = "u^2*dr", length_power = 2, label = "Y'_{uu\\\\delta_r}", meaning = "side force of the rudder" }
"""


@pytest.fixture
def equations_file(tmp_path):
    """equations_file(text): the path of a file with this text."""

    def write(text, name="small.toml"):
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


def term(regressor, **keys):
    """A term as a table of TOML."""
    keys = {"regressor": regressor, "length_power": 2, "label": "F'", "meaning": "a force"} | keys
    return "{ " + ", ".join(f"{key} = {json.dumps(value)}" for key, value in keys.items()) + " }"


@pytest.mark.parametrize("written", ["udot", " udot ", "udot*1", "1*udot", "udot^1"])
def test_an_added_mass_is_one_however_it_is_written(equations_file, written):
    """It stands in the mass matrix, and not among the forces, where kernels know no acceleration."""
    equations = load_equations(equations_file(SMALL.replace('"udot"', f'"{written}"')))
    assert equations.added_masses == ("Xudot",)
    assert equations.term("Xudot").regressor == "udot"


def test_a_small_set(equations_file):
    """What is written is what is read, with defaults for what is not."""
    equations = load_equations(equations_file(SMALL))
    assert equations.names == ("Xuu", "Xudot", "Yuv", "Yuu_dr")
    assert [(c.symbol, c.column, c.short) for c in equations.controls] == [("dr", "rudder_deg", "delta_r")]
    assert (equations.name, equations.title) == ("small", "A few terms")
    assert (equations.degrees_of_freedom, equations.rigid_body_terms, equations.speed) == (6, "separate", "trial")
    assert (equations.stations, equations.has_crossflow) == (16, False)
    assert equations.label("Yuv") == "$Y'_{uv}$"
    assert equations.added_masses == ("Xudot",)
    assert load_equations("booth").name == "booth"


def test_a_changed_file_is_read_again(equations_file):
    """Also when what changes is the set that a file extends."""
    path = equations_file(SMALL)
    child = equations_file('name = "child"\ntitle = "t"\nextends = "small.toml"\n[terms.N]\n'
                           f"Nuv = {term('u*v', length_power=3)}\n", "child.toml")  # fmt: skip
    assert load_equations(path) is load_equations(path)
    assert load_equations(child).names == ("Xuu", "Xudot", "Yuv", "Yuu_dr", "Nuv")
    equations_file(SMALL.replace("Yuv ", "Yvu "))
    assert load_equations(path).names == ("Xuu", "Xudot", "Yvu", "Yuu_dr")
    assert load_equations(child).names == ("Xuu", "Xudot", "Yvu", "Yuu_dr", "Nuv")


YUV = 'Yuv    = { regressor = "u*v", length_power = 2, label = "Y\'_{uv}", meaning = "side force of drift" }'


def more(line, axis="Y"):
    """A change of SMALL: another term."""
    return f"[terms.{axis}]", f"[terms.{axis}]\n{line}"


def instead(old, new):
    """A change of SMALL: the line of Yuv with something else in it."""
    assert old in YUV
    return YUV, YUV.replace(old, new)


FORCE = ("[controls]", '[controls]\nT = "thruster_n"')
REFUSED = {
    "unknown symbol": ([instead("u*v", "u*x")], "model", "terms.Y.Yuv"),
    "mistyped symbol": ([instead("u*v", "vdott")], "model", "terms.Y.Yuv"),
    "control of another set": ([instead("u*v", "u*u*ds")], "model", "terms.Y.Yuv"),
    "no product": ([instead("u*v", "u+v")], "model", "terms.Y.Yuv"),
    "no call": ([instead("u*v", "exit()")], "model", "terms.Y.Yuv"),
    "too many factors": ([instead("u*v", "u^9*v^9*r^3")], "model", "terms.Y.Yuv"),
    "unknown axis": ([("[terms.Y]", "[terms.W]")], "unknown", "terms.W"),
    "small axis": ([("[terms.Y]", "[terms.y]")], "unknown", "terms.y"),
    "no axis": ([("[terms.Y]", "[terms]")], "unknown", "terms.Yuv"),
    "no label": ([instead('label = "Y\'_{uv}", ', "")], "missing", "terms.Y.Yuv.label"),
    "empty label": ([instead("Y'_{uv}", "")], "value", "terms.Y.Yuv.label"),
    "no meaning": ([instead(', meaning = "side force of drift"', "")], "missing", "terms.Y.Yuv.meaning"),
    "no regressor": ([instead('regressor = "u*v", ', "")], "missing", "terms.Y.Yuv.regressor"),
    "a number for a regressor": ([instead('"u*v"', "2")], "value", "terms.Y.Yuv.regressor"),
    "unknown key of a term": ([instead("length_power", "lenght_power")], "unknown", "terms.Y.Yuv.lenght_power"),
    "a text for a term": ([(YUV, 'Yuv = "u*v"')], "value", "terms.Y.Yuv"),
    "twice in an axis": ([more(YUV)], "format", ""),
    "twice in two axes": (
        [("[terms.Y]", f"[terms.N]\nYuv = {term('u*v', length_power=3)}\n[terms.Y]")],
        "model",
        "terms.N.Yuv",
    ),
    "a name of a symbol": ([(YUV, YUV.replace("Yuv ", "nu "))], "model", "terms.Y.nu"),
    "a name of a control": ([(YUV, YUV.replace("Yuv ", "dr "))], "model", "terms.Y.dr"),
    "a name of a mass": ([(YUV, YUV.replace("Yuv ", "mass "))], "model", "terms.Y.mass"),
    "a name of a start": ([(YUV, YUV.replace("Yuv ", "u0 "))], "model", "terms.Y.u0"),
    "a name with a prime": ([(YUV, YUV.replace("Yuv ", '"Y\'uv" '))], "model", "terms.Y.Y'uv"),
    "a long name": ([(YUV, YUV.replace("Yuv ", "Y" * 61 + " "))], "model", "terms.Y." + "Y" * 61),
    "no force": ([instead("u*v", "v^3")], "model", "terms.Y.Yuv"),
    "a unit of no force": ([instead("length_power = 2", 'unit = "kg"')], "model", "terms.Y.Yuv"),
    "unit and power": ([instead("length_power = 2", 'length_power = 2, unit = "kg/m"')], "value", "terms.Y.Yuv"),
    "neither": ([instead("length_power = 2, ", "")], "value", "terms.Y.Yuv"),
    "speed power with unit": ([instead("length_power = 2", 'speed_power = -1, unit = "kg/m"')], "value", "terms.Y.Yuv"),
    "empty unit": ([instead("length_power = 2", 'unit = ""')], "value", "terms.Y.Yuv.unit"),
    "a power that is no whole number": (
        [instead("length_power = 2", "length_power = 2.5")],
        "value",
        "terms.Y.Yuv.length_power",
    ),
    "a huge power": ([instead("length_power = 2", "length_power = 999")], "value", "terms.Y.Yuv.length_power"),
    "a force by powers": (
        [
            FORCE,
            instead('"u*v"', '"T"'),
        ],
        "model",
        "terms.Y.Yuv",
    ),
    "no terms": ([(SMALL[SMALL.index("[terms.X]") :], "[terms]")], "model", "terms"),
    "no table of terms": ([(SMALL[SMALL.index("[terms.X]") :], "")], "missing", "terms"),
    "the same product": ([more(f"Yvu = {term('v*u')}")], "model", "terms.Y.Yuv"),
    "the same product twice over": ([more(f"Y2 = {term('abs(u)*abs(u)*dr')}")], "model", "terms.Y.Yuu_dr"),
    "cross-flow and its squares": (
        [
            (
                "[terms.Y]",
                f"[terms.Z]\nZvv = {term('v^2')}\nZww = {term('w^2')}\n"
                f"Zuw = {term('u*w')}\nZnn = {term('nu^2')}\n[terms.Y]",
            )
        ],
        "model",
        "terms.Z.Znn",
    ),
    "speed loss": ([more(f"Y1 = {term('U*v')}\nY2 = {term('du*v')}")], "model", "terms.Y.Yuv"),
    "slip": ([more(f"Y1 = {term('uc*v')}\nY2 = {term('duc*v')}")], "model", "terms.Y.Yuv"),
    "cross-flow of a symmetric product": ([more(f"Y1 = {term('sgn(v)*abs(v)*u')}")], "model", "terms.Y.Yuv"),
    "control without a unit": ([("rudder_deg", "rudder")], "value", "controls"),
    "control with another unit": ([("rudder_deg", "rudder_rad")], "value", "controls"),
    "control that is a unit": ([("rudder_deg", "deg")], "value", "controls"),
    "two controls in a column": ([("[controls]", '[controls]\ndelta = "rudder_deg"')], "value", "controls"),
    "control named like a velocity": ([("dr =", "r =")], "value", "controls"),
    "control named like an axis": ([("dr =", "N =")], "value", "controls"),
    "control named like a word of the kernels": ([("dr =", "lambda =")], "value", "controls"),
    "control named like a slope": ([("dr =", "Y_v =")], "value", "controls"),
    "heave in three degrees of freedom": (
        [("[controls]", "degrees_of_freedom = 3\n[controls]"), instead('"u*v"', '"u*w"')],
        "model",
        "terms.Y.Yuv",
    ),
    "Z in three degrees of freedom": (
        [("[controls]", "degrees_of_freedom = 3\n[controls]"), ("[terms.Y]", "[terms.Z]")],
        "model",
        "terms.Z.Yuv",
    ),
    "planes in three degrees of freedom": (
        [("[controls]", "degrees_of_freedom = 3\n[controls]"), ("rudder_deg", "stern_plane_deg")],
        "model",
        "terms.Y.Yuu_dr",
    ),
    "four degrees of freedom": ([("[controls]", "degrees_of_freedom = 4\n[controls]")], "value", "degrees_of_freedom"),
    "one station": ([("[controls]", "stations = 1\n[controls]")], "value", "stations"),
    "many stations": ([("[controls]", "stations = 1000000\n[controls]")], "value", "stations"),
    "unknown speed": ([("[controls]", 'speed = "mean"\n[controls]')], "value", "speed"),
    "unknown rigid body terms": (
        [("[controls]", 'rigid_body_terms = "included"\n[controls]')],
        "value",
        "rigid_body_terms",
    ),
    "a name with a path in it": ([('"small"', '"../small"')], "value", "name"),
    "a name with a line end": ([('"small"', '"small\\n"')], "value", "name"),
    "a long name of the set": ([('"small"', f'"{"s" * 300}"')], "value", "name"),
    "unknown key": ([("[controls]", "dof = 3\n[controls]")], "unknown", "dof"),
    "unknown base": ([("[controls]", 'extends = "both"\n[controls]')], "unknown", "both"),
    "absent base": ([("[controls]", 'extends = "absent.toml"\n[controls]')], "file", ""),
}


@pytest.mark.parametrize("what", REFUSED)
def test_refused(equations_file, what):
    """In one line that names the file and says what would be right."""
    changes, kind, key = REFUSED[what]
    text = SMALL
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path = equations_file(text)
    with refused(kind, key) as error:
        load_equations(path)
    message = str(error.value)
    assert str(path.parent) in message
    assert message.isprintable()


@pytest.mark.parametrize("speed", ["trial", "instantaneous"])
@pytest.mark.parametrize("axis", ["Y", "N"])
@pytest.mark.parametrize(
    "regressor",
    ["1", "v", "v^3", "v*dr", "nu*r", "rdot", "vdot", "p^9", "V^-2*v^3*r", "u^9*v^9", "crossflow_y", "n*n", "dr"],
)
def test_the_powers_proposed_are_right(equations_file, regressor, axis, speed):
    """What the message says makes a file that is read."""
    text = SMALL.replace("[controls]", f'speed = "{speed}"\n[controls]\nn = "rpm"')
    for powers in ({"length_power": 1, "speed_power": 2}, {"length_power": 9, "speed_power": 0}):
        added = f"[terms.{axis}]\nfirst = {term(regressor, **powers)}\n"
        wrong = text.replace("[terms.Y]", added) if axis == "Y" else text + added
        with pytest.raises(bs.InputError) as error:
            load_equations(equations_file(wrong))
        proposal = r"is no (?:force|moment); with length_power = (-?\d+) and speed_power = (-?\d+)"
        length, of_speed = map(int, re.search(proposal, str(error.value)).groups())
        right = wrong.replace(term(regressor, **powers), term(regressor, length_power=length, speed_power=of_speed))
        equations = load_equations(equations_file(right))
        assert equations.term("first").length_power == length


@pytest.mark.parametrize("speed", ["trial", "instantaneous"])
def test_non_dimensional_coefficients_do_not_know_the_scale(equations_file, speed):
    """Lengths times 7 and times times 3: forces times 7^4/3^2, moments times 7^5/3^2, with the same coefficients."""
    lengths, times = 7.0, 3.0
    text = SMALL.replace("[controls]", f'speed = "{speed}"\n[controls]\nn = "rpm"') + (
        f"Yvvr = {term('v*v*r', length_power=3, speed_power=-1)}\nYn = {term('n*n*dr', length_power=4)}\n"
        f"Yc = {term('crossflow_y', length_power=0)}\n[terms.N]\nNc = {term('crossflow_n', length_power=0)}\n"
        f"Nrdot = {term('rdot', length_power=5)}\nN0 = {term('1', length_power=3, speed_power=2)}\n"
    )
    equations = load_equations(equations_file(text))
    rng = np.random.default_rng(4)
    states, rates = rng.standard_normal((5, 12)), rng.standard_normal((5, 6))
    controls = rng.standard_normal((5, 3))
    hull = np.array([[-1.0, 0.2, 1.1], [0.1, 0.6, 0.3], [0.2, 0.4, 0.1]])
    by_speed = np.array([lengths / times] * 3 + [1 / times] * 3)
    forces = []
    for scale in (0, 1):
        change = np.concatenate([np.ones(6), by_speed]) ** scale
        scaled = equations.regressors(
            states * change,
            rates * (by_speed / times) ** scale,
            controls * np.array([1 / times, 1.0, lengths / times]) ** scale,
            equations.constants(1.7 * (lengths / times) ** scale, hull * lengths**scale),
        )
        factors = equations.factors(2.0 * lengths**scale, 1000.0, 1.7 * (lengths / times) ** scale)
        forces.append(np.hstack([scaled[axis] for axis in "XYZKMN"]) * factors)
    moments = np.array([t.axis in "KMN" for t in equations.terms])
    expected = forces[0] * np.where(moments, lengths**5, lengths**4) / times**2
    np.testing.assert_allclose(forces[1], expected, rtol=1e-12)


def child(base, name="child", **keys):
    lines = [f"{key} = {value!r}" for key, value in {"name": name, "title": "t", "extends": base, **keys}.items()]
    return "\n".join(lines) + "\n[terms]\n"


def test_extending_adds_terms_and_controls(equations_file):
    """Those of the other set come first in each axis; the values of the base hold unless others are given."""
    equations_file(SMALL.replace("[controls]", 'stations = 8\nrigid_body_terms = "in_coefficients"\n[controls]'))
    text = child("small.toml") + f"[terms.X]\nXds = {term('u^2*ds^2')}\n[controls]\nds = 'stern_plane_deg'\n"
    middle = equations_file(text, "middle.toml")
    equations = load_equations(middle)
    assert equations.names == ("Xuu", "Xudot", "Xds", "Yuv", "Yuu_dr")
    assert [control.symbol for control in equations.controls] == ["dr", "ds"]
    assert (equations.stations, equations.rigid_body_terms) == (8, "in_coefficients")
    last = equations_file(
        child("middle.toml", "last", stations=4) + f"[terms.N]\nNds = {term('u^2*ds', length_power=3)}\n", "last.toml"
    )
    assert load_equations(last).names == ("Xuu", "Xudot", "Xds", "Yuv", "Yuu_dr", "Nds")
    assert load_equations(last).stations == 4
    of_booth = equations_file(
        child("booth") + f"[terms.N]\nNvvv = {term('v^3', length_power=3, speed_power=-1)}\n", "of_booth.toml"
    )
    assert load_equations(of_booth).names == (*load_equations("booth").names, "Nvvv")


def test_a_set_cannot_extend_itself(equations_file):
    """Nor by way of others; the chain is named."""
    for names in (["a"], ["a", "b"], ["a", "b", "c"]):
        for name, base in zip(names, [*names[1:], names[0]], strict=True):
            path = equations_file(child(f"{base}.toml", name), f"{name}.toml")
        for name in names:
            with refused("model", "extends") as error:
                load_equations(path.with_name(f"{name}.toml"))
            chain = [*names[names.index(name) :], *names[: names.index(name)], name]
            assert " extends ".join(f"{link}.toml" for link in chain) in str(error.value)
    outside = equations_file(child("a.toml", "outside"), "outside.toml")
    with refused("model", "extends"):
        load_equations(outside)
    roundabout = equations_file(child("../" + outside.parent.name + "/round.toml", "round"), "round.toml")
    with refused("model", "extends"):
        load_equations(roundabout)


@pytest.mark.parametrize(
    ("text", "kind", "key"),
    [
        (f"[terms.Y]\nYuv = {term('v*abs(v)')}\n", "model", "terms.Y.Yuv"),
        (f"[terms.N]\nYuv = {term('u*v', length_power=3)}\n", "model", "terms.N.Yuv"),
        (f"[terms.Y]\nY2 = {term('v*u')}\n", "model", "terms.Y.Y2"),
        ("[controls]\ndr = 'rudder_2_deg'\n", "model", "controls.dr"),
        ("[controls]\ndelta = 'rudder_deg'\n", "model", "controls.delta"),
    ],
)
def test_what_a_set_cannot_add(equations_file, text, kind, key):
    equations_file(SMALL)
    with refused(kind, key) as error:
        load_equations(equations_file(child("small.toml") + text, "child.toml"))
    assert "child.toml: " in str(error.value)


def test_a_set_cannot_change_the_speed_of_another(equations_file):
    """The powers of the other's terms refer to it; without powers it may."""
    with_powers = SMALL + f"Yvvv = {term('v^3', speed_power=-1)}\n"
    for text, has_powers in ((SMALL, False), (with_powers, True)):
        equations_file(text)
        path = equations_file(child("small.toml", speed="instantaneous"), "child.toml")
        if has_powers:
            with refused("model", "speed"):
                load_equations(path)
        else:
            assert load_equations(path).speed == "instantaneous"
    same = equations_file(child("small.toml"), "child.toml")
    assert load_equations(same).speed == "trial"


def test_many_terms_take_no_time(equations_file):
    """The largest set that is allowed is checked in a second or two, and a larger one refused."""
    powers = [(a, b, c) for a in range(1, 7) for b in range(1, 7) for c in range(1, 7)]
    products = {f"u^{a}*v^{b}*r^{c}*dr": f"kg m^{1 - a - b} s^{a + b + c - 2}" for a, b, c in powers}
    unscaled = [term(text, unit=unit).replace("length_power = 2, ", "") for text, unit in products.items()]
    lines = [f"Y{k} = {section}" for k, section in enumerate(unscaled)]
    began = time.perf_counter()
    with refused("model", "terms.Y"):
        load_equations(equations_file(SMALL + "\n".join(lines) + "\n"))
    equations = load_equations(equations_file(SMALL + "\n".join(lines[:150]) + "\n"))
    assert len(equations.names) == 154
    assert time.perf_counter() - began < 10.0


def test_a_vehicle_names_what_does_not_fit_its_equations(tmp_path, suboff_file, equations_file):
    """Coefficients that the set does not have, those that are missing, and a hull to integrate along."""
    equations_file(SMALL)
    path = tmp_path / "boat.toml"
    top, coefficients = suboff_file.split("[coefficients]")
    few = "Xuu = -0.001\nXudot = -0.001\nYuv = -0.03\nYuu_dr = 0.006\n"
    for text, code in (
        (f"{top}[coefficients]{coefficients}", ("unknown", "coefficients.Xvv")),
        (f"{top}[coefficients]\nXuu = -0.001\n", ("missing", "coefficients.Xudot")),
        (f"{top}[coefficients]\n{few}", None),
    ):
        path.write_text('equations = "small.toml"\n' + text)
        if code is None:
            assert bs.load_vehicle(path).equations.name == "small"
            continue
        with refused(*code):
            bs.load_vehicle(path)
    equations_file(SMALL + f"Yc = {term('crossflow_y', length_power=0)}\n")
    path.write_text('equations = "small.toml"\n' + f"{top}[coefficients]\n{few}Yc = 0.5\n")
    with refused("missing", "hull"):
        bs.load_vehicle(path)
    path.write_text('equations = "absent.toml"\n' + suboff_file)
    with refused("file"):
        bs.load_vehicle(path)
