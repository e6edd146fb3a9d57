"""The manual as a whole: its command, its kinds, its links, and that its lists are complete."""

import re
import subprocess
import sys
import tomllib
import typing
from importlib import resources

import click
import pydantic
import pytest
from manual.pages import MANUAL, OTHERS, PAGES, ROOT, blocks
from support import refusals

import bayesub as bs
from bayesub.cli import app, learn
from bayesub.findings.verdicts import CLAIM_FAILED, MEANING, NOT_FLOWN
from bayesub.io import toml_files
from bayesub.logs.log_files import HEADERS, VELOCITIES
from bayesub.logs.log_map import LogMap
from bayesub.model.actuator_files import (
    BallastSection,
    FinSection,
    PropellerSection,
    SlidingMassSection,
    ThrusterSection,
)
from bayesub.model.coefficients import AXES, TERMS
from bayesub.model.equations.files import EquationFile, TermSection
from bayesub.model.equations.regressors import SYMBOLS
from bayesub.model.hull_files import HullFile
from bayesub.model.manoeuvre_files import KINDS
from bayesub.model.quantities import QUANTITIES
from bayesub.model.vehicle_files import VehicleFile
from bayesub.study.schema.disturbance_section import DisturbanceFile
from bayesub.study.schema.study_file import Study
from bayesub.study.schema.trial_section import InstrumentsFile

HEAVY = ("numba", "scipy", "matplotlib", "arviz", "pandas")
LONGEST = 150


def page(topic):
    return learn.pages()[topic].path.read_text(encoding="utf-8")


def test_the_list_names_every_page_once(bayesub):
    status, out, _ = bayesub("manual")
    assert status == 0
    topics = re.findall(r"^  (\S+) +\S", out, flags=re.MULTILINE)
    assert sorted(topics) == sorted([path.stem for path in MANUAL] + ["references"])
    assert [line for line in out.splitlines() if line in learn.KINDS.values()] == list(learn.KINDS.values())


def test_a_page_is_printed_without_its_comments(bayesub):
    status, out, _ = bayesub("manual", "findings")
    assert status == 0
    assert out.startswith("# What the studies found")
    assert "<!--" not in out


def test_formulas_are_in_letters_at_the_terminal(bayesub):
    """And the code of the page stays as it is."""
    _, out, _ = bayesub("manual", "model")
    assert re.search(r"^    θ̇ = cos φ q - sin φ r +\(1\.7\)$", out, flags=re.MULTILINE)
    assert "as n/k_0 (section 5). ν = √(v² + w²) is the cross-flow speed" in out
    assert "`u*u*dr*dr`" in out
    assert not re.search(r"[\\$]|&&", out)


def test_the_path_of_a_page(bayesub):
    _, out, _ = bayesub("manual", "model", "--path")
    assert out.strip() == str(ROOT / "bayesub" / "manual" / "model.md")


def test_an_unknown_topic_is_one_line_with_a_suggestion(bayesub):
    assert bayesub("manual", "priors") == bayesub("manual", "priors-and-noise")  # a beginning is enough
    status, out, err = bayesub("manual", "modl")
    assert (status, out, err.count("\n")) == (2, "", 1)
    refusals.check(bayesub.error, "unknown", "modl")


def test_a_terminal_gets_the_pager(monkeypatch, bayesub):
    """With headings and tables laid out; a pager is not asked for where there is no terminal."""
    shown = []
    monkeypatch.setattr(click, "echo_via_pager", shown.append)
    bayesub("manual", "commands")
    assert not shown
    monkeypatch.setattr(learn.sys.stdout, "isatty", lambda: True)
    bayesub("manual", "commands")
    (text,) = shown
    assert "exit status" in text
    assert "<!--" not in text
    assert "|---" not in text


def test_the_manual_needs_nothing_that_computes():
    """None of the libraries that take long to import."""
    code = f"""
import sys
import tomllib
from click.testing import CliRunner
from bayesub.cli.learn import manual
assert CliRunner().invoke(manual, ["thesis"]).exit_code == 0
print([name for name in {HEAVY} if name in sys.modules])
"""
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert out.strip() == "[]"


def test_the_manual_is_a_part_of_the_package():
    assert (resources.files("bayesub") / "manual" / "model.md").is_file()


def test_the_readme_is_short():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= LONGEST


@pytest.mark.parametrize("path", [*PAGES, *OTHERS], ids=lambda path: path.stem)
def test_links_lead_somewhere(path):
    """Within the repository; and what a page calls a page is one."""
    text = path.read_text(encoding="utf-8")
    for target in re.findall(r"\]\((?!https?:)([^)#]+)\)", text):
        assert (path.parent / target).exists(), target
    for topic in re.findall(r"page `([\w-]+)`", text) + re.findall(r"bayesub manual ([a-z][\w-]+)", text):
        assert topic in learn.pages(), topic


def test_the_table_of_terms_is_that_of_the_code():
    """Axis by axis and power by power, in the same order."""
    rows = re.findall(r"^\| ([XYZKMN]) \| (\d) \| (.*) \|$", page("model"), flags=re.MULTILINE)
    shown = [
        (name, axis, int(power), regressor)
        for axis, power, terms in rows
        for name, regressor in re.findall(r"(\w+): `(.*?)`", terms)
    ]
    assert shown == [(t.name, t.axis, t.length_power, t.regressor) for t in TERMS]
    assert list(dict.fromkeys(axis for axis, *_ in rows)) == list(AXES)


def first_cells(topic, heading):
    """The words in the first cells of the tables below a heading of a page."""
    _, _, part = page(topic).partition(f"\n## {heading}\n")
    cells = re.findall(r"^\| (.*?) \|", part.partition("\n## ")[0], flags=re.MULTILINE)
    return re.findall(r"`\[?(\w+)(?:\.X)?\]?`", " ".join(cells))


def test_every_key_and_symbol_of_equations_is_explained():
    keys = {*EquationFile.model_fields, *TermSection.model_fields}
    assert keys <= set(first_cells("equations", "The file"))
    symbols = first_cells("equations", "Regressors")
    assert symbols == list(dict.fromkeys(symbols))
    assert set(symbols) == {*VELOCITIES, *SYMBOLS, "1"}


def test_the_table_of_built_in_sets_is_that_of_the_files():
    rows = re.findall(r"^\| `(\w+)` \| (\d+) \| (\d) \| (.*) \|$", page("equations"), flags=re.MULTILINE)
    vehicles = [bs.load_vehicle(name) for name in toml_files.built_in("vehicles")]
    assert {name for name, *_ in rows} == set(toml_files.built_in("equations"))
    for name, terms, freedom, names in rows:
        equations = bs.load_equations(name)
        assert (int(terms), int(freedom)) == (len(equations.terms), equations.degrees_of_freedom)
        assert set(re.findall(r"`(\w+)`", names)) == {v.name for v in vehicles if v.equations.name == name}


def test_every_key_of_every_actuator_is_explained():
    sections = (FinSection, PropellerSection, ThrusterSection, BallastSection, SlidingMassSection)
    keys = {key for section in sections for key in section.model_fields}
    assert keys == set(first_cells("actuators", "Keys"))


def test_every_key_of_a_map_is_explained():
    keys = {key for section in models(LogMap, []) for key in section.model_fields} - {"time", "columns"}
    assert keys | {"time"} == set(first_cells("convert", "The map"))


def models(kind, found):
    """All sections of an input file."""
    if isinstance(kind, type) and issubclass(kind, pydantic.BaseModel) and kind not in found:
        found.append(kind)
        for field in kind.model_fields.values():
            models(field.annotation, found)
    for part in typing.get_args(kind):
        models(part, found)
    return found


def test_every_key_of_every_file_is_in_the_reference():
    words = set(re.findall(r"`([\w.]+)`", page("files")))
    files = (VehicleFile, EquationFile, HullFile, InstrumentsFile, DisturbanceFile, Study, LogMap, *KINDS.values())
    keys = {key for file in files for section in models(file, []) for key in section.model_fields}
    containers = {"trial", "body", "propulsion", "actuators", "coefficients", "time_scale", "demands", "autopilot"}
    containers |= {
        "displacement",
        "hull",
        "fins",
        "sensors",
        "truth",
        "free",
        "prior",
        "given",
        "noise",
        "nuisance",
        "baselines",
    }
    containers |= {"sampler", "quick", "trials", "derived", "mean", "lower", "upper", "median", "value"}
    containers |= {"check", "controls", "terms", "time", "columns", *AXES}
    assert keys - containers - words == set()


def test_every_column_is_in_the_reference():
    words = set(re.findall(r"`(\w+)`", page("files")))
    assert set(HEADERS.values()) <= words


def test_every_public_name_is_in_the_reference():
    assert set(re.findall(r"`bs\.(\w+)`", page("python"))) == set(bs.__all__)


def test_every_verdict_has_its_remedy():
    text = page("troubleshooting")
    assert [verdict for verdict in (*MEANING, NOT_FLOWN, CLAIM_FAILED) if f"| `{verdict.upper()}` |" not in text] == []


def test_messages_with_remedies_are_those_of_the_package():
    """The words between the dots of each, in a text or template of the package, which may go on in the next line."""
    code = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "bayesub").rglob("*.py"))
    code = re.sub(r'"\s*\n\s*[rf]?"', "", code)
    templates = (path.read_text(encoding="utf-8") for path in (ROOT / "bayesub" / "findings").glob("*.txt"))
    code += " ".join(word for template in templates for word in template.split())
    tables = re.findall(r"^\| message .*\n\|[-|]+\n((?:\|.*\n)+)", page("troubleshooting"), flags=re.MULTILINE)
    messages = [row.split(" | ")[0].strip("| ") for table in tables for row in table.splitlines()]
    assert len(messages) > 20
    parts = [part.strip() for message in messages for part in re.split(r"\.\.|;", message)]
    assert [part for part in parts if len(part.split()) > 1 and part not in code] == []


def leaf_commands(command, path=()):
    inner = getattr(command, "commands", None)
    if inner is None:
        yield " ".join(path), command
    else:
        context = click.Context(command)
        for name in command.list_commands(context):
            yield from leaf_commands(command.get_command(context, name), (*path, name))


def test_the_synopsis_has_every_command_with_its_options():
    (synopsis,) = [block.text for block in blocks(learn.pages()["commands"].path) if block.language == "synopsis"]
    lines = {}
    for line in synopsis.splitlines():
        words = re.match(r"bayesub ((?:new )?\w+)(.*)", line)
        lines[words[1]] = set(re.findall(r"(?<![\w-])(--?[a-z][\w-]*)", words[2]))
    for name, command in leaf_commands(app.app):
        options = [set(p.opts) for p in command.params if isinstance(p, click.Option)]
        assert all(option & lines[name] for option in options), name
        assert lines[name] <= set().union(*options), name


def test_the_version_to_cite_is_that_of_the_package():
    (version,) = re.findall(r"^version: (.+)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), flags=re.MULTILINE)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert version == project["version"]
    assert f"## [{version}]" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_the_table_of_quantities_is_that_of_the_code():
    """Each once."""
    table = page("quantities").partition("## What is measured")[2].partition("\n## ")[0]
    named = [
        name for row in re.findall(r"^\| (`.*?) \|", table, flags=re.MULTILINE) for name in re.findall(r"`(\w+)`", row)
    ]
    assert sorted(named) == sorted(QUANTITIES)
