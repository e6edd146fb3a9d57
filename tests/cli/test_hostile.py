"""Input that is wrong by accident or on purpose: refused in one line, never run, never a traceback."""

import copy
import tomllib

import pytest
import tomli_w
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support import fuzz, mutations

import bayesub as bs
from bayesub.io import log_files, toml_files
from bayesub.io.errors import LONGEST
from bayesub.model.equations import load_equations
from bayesub.model.hulls import load_hull
from bayesub.model.manoeuvre_files import read_manoeuvre
from bayesub.study.disturbance_section import read_disturbance
from bayesub.study.study_file import load_study

READERS = {
    "vehicle": bs.load_vehicle,
    "equations": load_equations,
    "manoeuvre": read_manoeuvre,
    "geometry": load_hull,
    "study": load_study,
    "disturbance": read_disturbance,
}


def test_changed_files_are_refused_in_a_line_or_fly(tmp_path, monkeypatch):
    """A sample of the corpus of tests/support/fuzz.py, which drives many thousand."""
    monkeypatch.chdir(tmp_path)
    outcomes = []
    for kind, suffix, change, data in fuzz.files(152, seed=690):
        mutations.write_beside(tmp_path)
        path = tmp_path / f"mutant{suffix}"
        path.write_bytes(data)
        outcome, said = fuzz.verdict(kind, path)
        assert outcome in ("refused", "accepted"), f"{kind}, {change}: {outcome}: {said}"
        outcomes.append(outcome)
    assert 12 < outcomes.count("accepted") < 76  # the corpus is neither hopeless nor harmless


@pytest.mark.parametrize(("kind", "suffix", "text"), mutations.corpus(), ids=lambda value: str(value)[:20].strip())
def test_unchanged_files_are_accepted(tmp_path, monkeypatch, kind, suffix, text):
    monkeypatch.chdir(tmp_path)
    mutations.write_beside(tmp_path)
    path = tmp_path / f"good{suffix}"
    path.write_text(text)
    assert fuzz.verdict(kind, path) == ("accepted", "")


@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.one_of(st.binary(max_size=200), st.text(max_size=200).map(str.encode)))
def test_arbitrary_bytes(tmp_path, data):
    """Whatever the file holds, every reader refuses it in one line that names it."""
    path = tmp_path / "file.toml"
    path.write_bytes(data)
    for read in (*READERS.values(), log_files.read_log):
        with pytest.raises(bs.InputError) as error:
            read(path)
        said = str(error.value)
        assert said.startswith(str(path))
        assert said.isprintable()


values = st.recursive(
    st.one_of(st.booleans(), st.integers(), st.floats(), st.text(max_size=5), st.dates()),
    lambda inner: st.one_of(
        st.lists(inner, max_size=3), st.dictionaries(st.text("abxy_", min_size=1), inner, max_size=2)
    ),
    max_leaves=4,
)
GOOD = {
    kind: tomllib.loads(next(text for k, suffix, text in mutations.corpus() if k == kind and suffix == ".toml"))
    for kind in READERS
}


@settings(deadline=None, max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_one_arbitrary_value_in_a_good_file(tmp_path, data):
    """Read into finite numbers of the right type, or refused in one line."""
    kind = data.draw(st.sampled_from(sorted(READERS)))
    content = table = copy.deepcopy(GOOD[kind])
    key = data.draw(st.sampled_from(sorted(table)))
    while isinstance(table[key], dict) and table[key] and data.draw(st.booleans()):
        table = table[key]
        key = data.draw(st.sampled_from(sorted(table)))
    table[key] = data.draw(values)
    path = tmp_path / "file.toml"
    path.write_text(tomli_w.dumps(content), encoding="utf-8")
    try:
        read = READERS[kind](path)
    except bs.InputError as error:
        said = str(error)
        assert path.name in said
        assert said.isprintable()
        assert len(said) <= LONGEST
    else:
        assert read is not None


@pytest.mark.parametrize(
    ("kind", "old", "new", "words"),
    [
        ("manoeuvre", "duration_s = 600.0", 'duration_s = "7"', "key 'duration_s': input should be a valid number"),
        ("manoeuvre", "duration_s = 600.0", "duration_s = true", "key 'duration_s': input should be a valid number"),
        ("manoeuvre", "duration_s = 600.0", f"duration_s = {'9' * 5000}", "is not valid TOML: Exceeds the limit"),
        ("manoeuvre", "duration_s = 600.0", f"x = {'[' * 9000}", "brackets are nested too deeply"),
        ("manoeuvre", "duration_s = 600.0", "duration_s = 1e6", "key 'duration_s': .* less than or equal to 10000"),
        ("manoeuvre", "[ 5, 10,", "[ 5, 1000,", "key 'demands.rudder_deg.1': .* less than or equal to 90"),
        ("manoeuvre", "length_m = 102.2606", "length_m = 102e9", "time_scale.length_m': .* less than or equal to 1000"),
        ("vehicle", "mass_kg = ", "mass_kg = 1e12 # ", "key 'body.mass_kg': .* is beyond 1e.10; check the unit"),
        ("vehicle", "water_density_kgm3 = ", "water_density_kgm3 = 1.025 # ", "water_density_kgm3'.* or equal to 500"),
        ("vehicle", 'description = "', 'description = "\\u001b[31m', "must not contain control characters"),
        ("geometry", "from_m = 4.3", "from_m = -4.3", "key 'fins.0.from_m'.* greater than or equal to 0"),
        ("geometry", "# origin_m = 2.5", "origin_m = 25", "origin_m must lie on the hull, 0 to 5, found 25"),
        ("study", "current_mps = [0.1", "current_mps = [1e8", "key 'truth.current_mps': 1e.08 is beyond 1000"),
        ("study", "seed = 3", "seed = 3.0", "key 'seed': input should be a valid integer, found 3.0"),
    ],
)  # fmt: skip
def test_what_was_accepted_once(tmp_path, kind, old, new, words):
    """Gaps that the corpus has found; each message names the key, what is found and what is expected."""
    sources = {
        "vehicle": toml_files.built_in("vehicles")["suboff"],
        "manoeuvre": toml_files.built_in("manoeuvres")["horizontal"],
    }
    text = (
        sources[kind].read_text()
        if kind in sources
        else {"geometry": mutations.TORPEDO, "study": mutations.STUDY}[kind]
    )
    assert old in text
    path = tmp_path / "file.toml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(bs.InputError, match=words) as error:
        READERS[kind](path)
    assert str(error.value).startswith(str(path))
    assert "\n" not in str(error.value)


def test_a_flight_has_a_bounded_number_of_steps_and_rows(suboff, spiral):
    """Too many are refused before memory is asked for."""
    with pytest.raises(bs.InputError, match="600 s are more than 2,000,000 steps of 1e-06 s"):
        bs.simulate(suboff, spiral, dt=1e-6)
    with pytest.raises(bs.InputError, match="more than 2,000,000 rows"):
        bs.simulate(suboff, spiral, dt=1.0, sample=1e-9)
    with pytest.raises(bs.InputError, match="more than 1,000,000 readings"):
        bs.observe(bs.simulate(suboff, spiral, dt=1.0), bs.sensors.Pressure(0.1, interval_s=1e-9), None)


def test_names_are_not_markup(tmp_path, monkeypatch):
    """A vehicle whose name looks like a tag of the terminal or a formula is printed and drawn as it is."""
    monkeypatch.chdir(tmp_path)
    text = toml_files.built_in("vehicles")["suboff"].read_text().replace('name = "suboff"', 'name = "[/bold] $_{$"', 1)
    (tmp_path / "boat.toml").write_text(text)
    assert "[/bold] $_{$" in fuzz.bayesub("check", "boat.toml", "--card", "card.png")[1]
    (tmp_path / "good.csv").write_text(mutations.history(3))
    flown = "simulate", "boat.toml", "good.csv", "-o", "track.csv", "--plot"
    assert "[/bold] $_{$ on good" in fuzz.bayesub(*flown, "track.png")[1]
    for place in ("track.xyz", "absent/track.png"):
        with pytest.raises(bs.InputError, match=f"{place}: cannot be drawn: "):
            fuzz.bayesub(*flown, place)


def test_a_study_whose_readings_weigh_too_much(tmp_path, monkeypatch):
    """Is refused by its name; and one whose boat fails at the prior means is told so and has no card."""
    monkeypatch.chdir(tmp_path)
    mutations.write_beside(tmp_path)
    study = tmp_path / "study.toml"
    study.write_text(mutations.STUDY.replace("sd = 0.005\n", "sd = 1e-310\n"))
    with pytest.raises(bs.InputError, match=r"study.toml: small: auv690: .* an sd of next to nothing"):
        fuzz.bayesub("check", study)
    study.write_text(mutations.STUDY.replace("lower = -0.01, upper = -0.001", "mean = 0.1, sd = 0.01"))
    out = fuzz.bayesub("check", study)[1]
    assert "at the prior means the boat " in out
    assert "directions" not in out
