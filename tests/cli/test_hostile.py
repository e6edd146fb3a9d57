"""Input that is wrong by accident or on purpose: refused in one line, never run, never a traceback."""

import contextlib
import copy
import gzip
import os
import subprocess
import sys
import tomllib
import warnings
from pathlib import Path

import pytest
import tomli_w
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support import fuzz, mutations, small_study
from support.refusals import refused

import bayesub as bs
from bayesub.io import toml_files
from bayesub.io.errors import LONGEST, Remark
from bayesub.logs import log_files, readers
from bayesub.model.equations import load_equations
from bayesub.model.hulls import load_hull
from bayesub.model.manoeuvre_files import read_manoeuvre
from bayesub.study.schema.disturbance_section import read_disturbance
from bayesub.study.schema.study_file import load_study

COMMAND = [sys.executable, "-m", "bayesub"]
READERS = {
    "vehicle": bs.load_vehicle,
    "equations": load_equations,
    "manoeuvre": read_manoeuvre,
    "geometry": load_hull,
    "study": load_study,
    "disturbance": read_disturbance,
}


@pytest.mark.slow
def test_changed_files_are_refused_in_a_line_or_fly(tmp_path, monkeypatch):
    """A sample, or with BAYESUB_FUZZ=5000 so many, each within ten seconds and two gigabytes."""
    monkeypatch.chdir(tmp_path)
    n, outcomes, defects = int(os.environ.get("BAYESUB_FUZZ", "152")), [], []
    mutations.write_beside(tmp_path)
    with fuzz.limited(tmp_path) if n > 152 else contextlib.nullcontext(lambda: None) as begin:
        for k, (kind, suffix, change, data) in enumerate(fuzz.files(n, seed=690)):
            mutations.write_beside(tmp_path)
            path = tmp_path / f"mutant{suffix}"
            path.write_bytes(data)
            begin()
            outcome, said = fuzz.verdict(kind, path)
            if outcome not in ("refused", "accepted"):
                defects.append(f"{k}, {kind}, {change}: {outcome}: {said}")
                path.rename(tmp_path / f"{k}_{kind}_{outcome}{suffix}")
            outcomes.append(outcome)
    assert not defects, "\n".join([f"kept in {tmp_path}", *defects])
    assert 12 < 152 / n * outcomes.count("accepted") < 76  # the corpus is neither hopeless nor harmless


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
    ("what", "old", "new", "kind", "key"),
    [
        ("manoeuvre", "duration_s = 600.0", 'duration_s = "7"', "value", "duration_s"),
        ("manoeuvre", "duration_s = 600.0", "duration_s = true", "value", "duration_s"),
        ("manoeuvre", "duration_s = 600.0", f"duration_s = {'9' * 5000}", "format", ""),
        ("manoeuvre", "duration_s = 600.0", f"x = {'[' * 9000}", "format", ""),
        ("manoeuvre", "duration_s = 600.0", "duration_s = 1e6", "value", "duration_s"),
        ("manoeuvre", "[ 5, 10,", "[ 5, 1000,", "value", "demands.rudder_deg.1"),
        ("manoeuvre", "length_m = 102.2606", "length_m = 102e9", "value", "time_scale.length_m"),
        ("vehicle", "mass_kg = ", "mass_kg = 1e12 # ", "unit", "body.mass_kg"),
        ("vehicle", "water_density_kgm3 = ", "water_density_kgm3 = 1.025 # ", "value", "body.water_density_kgm3"),
        ("vehicle", 'description = "', 'description = "\\u001b[31m', "value", "description"),
        ("geometry", "from_m = 4.3", "from_m = -4.3", "value", "fins.0.from_m"),
        ("geometry", "# origin_m = 2.5", "origin_m = 25", "value", ""),
        ("study", "current_mps = [0.1", "current_mps = [1e8", "unit", "truth.current_mps"),
        ("study", "seed = 3", "seed = 3.0", "value", "seed"),
    ],
    ids=lambda value: value[:30],
)  # fmt: skip
def test_what_was_accepted_once(tmp_path, what, old, new, kind, key):
    """Gaps that the corpus has found; each message names the key, what is found and what is expected."""
    sources = {
        "vehicle": toml_files.built_in("vehicles")["suboff"],
        "manoeuvre": toml_files.built_in("manoeuvres")["horizontal"],
    }
    text = (
        sources[what].read_text()
        if what in sources
        else {"geometry": mutations.TORPEDO, "study": mutations.STUDY}[what]
    )
    assert old in text
    path = tmp_path / "file.toml"
    path.write_text(text.replace(old, new, 1))
    with refused(kind, key) as error:
        READERS[what](path)
    assert str(error.value).startswith(str(path))


def test_a_flight_has_a_bounded_number_of_steps_and_rows(suboff, spiral):
    """Too many are refused before memory is asked for."""
    with refused("limit", "dt"):
        bs.simulate(suboff, spiral, dt=1e-6)
    with refused("limit", "sample"):
        bs.simulate(suboff, spiral, dt=1.0, sample=1e-9)
    with refused("limit", "interval_s"):
        bs.observe(bs.simulate(suboff, spiral, dt=1.0), bs.sensors.Pressure(0.1, interval_s=1e-9), None)


@pytest.mark.rendered
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
        with refused("file"):
            fuzz.bayesub(*flown, place)


def test_a_study_whose_readings_weigh_too_much(tmp_path, monkeypatch):
    """Is refused by its name; and one whose boat fails at the prior means is told so and has no card."""
    monkeypatch.chdir(tmp_path)
    mutations.write_beside(tmp_path)
    study = tmp_path / "study.toml"
    study.write_text(mutations.STUDY.replace("sd = 0.005\n", "sd = 1e-310\n"))
    with refused("model"):
        fuzz.bayesub("check", study)
    study.write_text(mutations.STUDY.replace("lower = -0.01, upper = -0.001", "mean = 0.1, sd = 0.01"))
    out = fuzz.bayesub("check", study)[1]
    assert "at the prior means the boat " in out
    assert "directions" not in out


def test_what_is_no_file_or_too_large_is_refused(tmp_path, monkeypatch):
    """A device, a pipe, a packed file that unpacks to more than fits, and one that is cut; before it is read."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "zero.toml").symlink_to("/dev/zero")
    os.mkfifo("pipe.csv")
    with gzip.open("bomb.csv.gz", "wb") as file:
        file.write(b"time_s,x_m\n" + b"1,2\n" * 1_000_000)
    packed = (tmp_path / "bomb.csv.gz").read_bytes()
    (tmp_path / "cut.csv.gz").write_bytes(packed[: len(packed) // 2])
    for name, read in {"zero.toml": bs.load_vehicle, "pipe.csv": log_files.read_log}.items():
        with refused("file"):
            read(tmp_path / name)
    with refused("file"):
        readers.read("csv", [tmp_path / "pipe.csv"])
    with refused("format"):
        log_files.read_log(tmp_path / "cut.csv.gz", ascending=False)
    monkeypatch.setattr(toml_files, "MOST_LOG", 3_999_999)
    for read in (log_files.read_log, lambda path: readers.read("csv", [path])):
        with refused("limit"):
            read(tmp_path / "bomb.csv.gz")


@pytest.mark.parametrize("words", ["list", "manual convert", "list --json", "--help"])
def test_a_full_output_is_one_line(words):
    with Path("/dev/full").open("w") as full:
        done = subprocess.run([*COMMAND, *words.split()], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert "no space left" in done.stderr


def test_names_that_a_terminal_cannot_print(tmp_path):
    """An encoding that lacks a letter of a name, on either stream: the name as Python writes it, and no traceback."""
    path, circle = tmp_path / "circle.toml", toml_files.find("turning_circle", "manoeuvres").read_text()
    path.write_text(circle.replace('name = "', 'name = "Žluťoučký ', 1), encoding="utf-8")
    for encoding in ("ascii", "cp1252"):
        environment = os.environ | {"PYTHONIOENCODING": f"{encoding}:strict"}
        options = {"capture_output": True, "encoding": encoding, "env": environment, "check": False}
        done = subprocess.run([*COMMAND, "check", path], **options)
        assert (done.returncode, done.stderr) == (0, "")
        assert "lu\\u0165ou\\u010dk" in done.stdout


@pytest.mark.parametrize("row", ["2,5,10.2", "4,5,1"])
def test_a_row_that_is_short_is_named(row, bayesub, tmp_path):
    """A cell that is missing has moved those after it; one that is empty has its comma."""
    lines = ["time_s,rudder_deg,heading_deg,depth_m", *(f"{k},5,{157 + k},10" for k in range(6))]
    log = tmp_path / "log.csv"
    log.write_text("\n".join(lines) + "\n7,5,,10\n\n")
    assert bayesub("check", str(log))[0] == 0
    log.write_text("\n".join([*lines[:4], row, *lines[5:]]))
    small_study.write(tmp_path / "s.toml", **small_study.LOG)
    for words in (["check", log], ["run", tmp_path / "s.toml", "-o", tmp_path / "run"]):
        status, _, err = bayesub(*map(str, words))
        assert (status, err.count("\n")) == (2, 1)
        assert "line 5: has 3 cells, expected 4" in err


def test_out_of_memory_is_one_line(bayesub, monkeypatch):
    def fails(*_, **__):
        raise MemoryError("Unable to allocate 3 TiB")

    monkeypatch.setattr(toml_files, "read_toml_table", fails)
    status, _, err = bayesub("check", "boat.toml")
    assert (status, err.count("\n")) == (2, 1)
    assert err.startswith("bayesub: out of memory (Unable to allocate 3 TiB); ")


def test_warnings_of_libraries_do_not_speak_as_ours(bayesub, monkeypatch):
    def warns(*_, **__):
        warnings.warn("An ill-conditioned matrix detected", UserWarning, stacklevel=1)
        warnings.warn("run: the last block is damaged", Remark, stacklevel=1)
        return {}

    monkeypatch.setattr(toml_files, "read_toml_table", warns)
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        _, _, err = bayesub("check", "boat.toml")
    assert err.splitlines()[0] == "bayesub: run: the last block is damaged"
    assert "ill-conditioned" not in err
