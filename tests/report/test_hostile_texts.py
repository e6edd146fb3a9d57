"""Texts of equation sets and vehicles, whatever they hold, are texts in every language that they are written in."""

import ast
import functools
import json
import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rich.table import Table
from support.refusals import refused

import bayesub as bs
from bayesub.findings import simulator_conventions as conventions
from bayesub.inference.sampling import Posterior
from bayesub.io import terminal, words
from bayesub.model.equations import EquationSet, load_equations
from bayesub.report import markdown, parameter_tables
from bayesub.report.markdown import StudyPage
from bayesub.study.after.knowledge import of_moments

EVIL = (
    "1\nimport os; os.system('touch x')\n# ",
    "\r\nsystem('x');\n%{\n",
    r"\input{/etc/passwd}$\write18{x}",
    "^^5cinput|a|b\n| c |",
    "<img src=x onerror=alert(1)>`|![x](http://x)",
    "a\x1b[31m\u202eb\x00\u2028c\x85'); x('",
    "'''\"\"\"\\",
)
texts = st.one_of(st.sampled_from(EVIL), st.text(max_size=30), st.text("\\^{}$%#&_~|<`\n\r'\" ax", max_size=30))
each = settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])


def boat_of(text):
    """The boat with the text in place of each of its texts, of a few terms; built in Python, past the files."""
    suboff = bs.load_vehicle("suboff")
    terms = [replace(t, label=text, meaning=text, unit=text or None) for t in suboff.equations.terms]
    given = {name: getattr(suboff.equations, name) for name in EquationSet.__dataclass_fields__}
    equations = EquationSet(**given | {"terms": tuple(terms), "title": text, "reference": text})
    return replace(suboff, name=text, description=text, reference=text, equations=equations)


KNOWN = of_moments(("Xuu", "Nuv"), np.array([-0.0011, -0.013]), np.diag([1e-5, 1e-3]) ** 2)


@functools.cache
def posterior():
    chain = np.random.default_rng(1).standard_normal((2, 20, 6, 2))
    given = {"prior_mean": np.zeros(2), "prior_sd": np.ones(2), "n_warmup": 0, "acceptance": 0.5, "evaluations": 1}
    return Posterior(names=KNOWN.names, chain=chain, log_prob=chain[..., 0], seconds=1.0, failures={}, **given)


def tags(kind, text):
    """Those of a file, but for parameters, whose values are nothing if a text takes the unit of coefficients away."""
    root = ElementTree.fromstring(conventions.written(kind, conventions.Boat(boat_of(text), KNOWN), text))
    return {e.tag for e in root.iter() if not re.match("[xyzkmn][A-Z]", e.tag)}


@pytest.mark.slow
@each
@given(text=texts)
def test_python_has_one_function_of_assignments_and_matlab_one_assignment_a_line(text):
    boat = boat_of(text)
    imported, function = ast.parse(conventions.written("pvs", conventions.Boat(boat, KNOWN), text)).body
    assert isinstance(imported, ast.Import)
    assert {type(statement) for statement in function.body} == {ast.Assign}
    assert {ast.unparse(s.targets[0]).partition(".")[0] for s in function.body} <= {
        "vehicle", "righting", "(vehicle",
    }  # fmt: skip
    script = conventions.written("mss", conventions.Boat(boat, KNOWN), text)
    assert not re.search(r"[^\x20-\x7e\n]", "".join(c for c in script if not c.isprintable()))
    inside = r"vehicle\.\w+ +?= (?:'(?:[^']|'')*'|\[?[-+.e\d ]*\]?|\[);(?: %.*)?|vehicle\.\w+ = \[|[-+.e\d ]+|\];|"
    for line in script.split("\n"):
        assert line.startswith("% ") or re.fullmatch(inside, line), line
    for kind in ("gazebo", "stonefish"):
        assert tags(kind, text) == tags(kind, "plain")
    json.loads(conventions.written("holoocean", conventions.Boat(boat, KNOWN), text))


@each
@given(text=texts)
def test_latex_has_no_commands_beyond_ours_and_markdown_no_columns(text):
    equations = boat_of(text).equations
    table = parameter_tables.latex(posterior(), equations)
    assert "^^" not in table
    ours = "frac usepackage begin end toprule midrule bottomrule texttt pm ldots textbackslash"
    known = {*ours.split(), *words._COMMANDS.split()}
    assert set(re.findall(r"\\([A-Za-z]+)", table)) <= known
    assert len(table.split("\n")) == 10
    lines = parameter_tables.markdown(posterior(), equations).splitlines()
    assert {len(re.findall(r"(?<!\\)\|", line)) for line in lines} == {len(parameter_tables.HEADS) + 2}
    entries = [
        {"name": t.name, "label": t.label, "regressor": t.regressor, "meaning": t.meaning} for t in equations.terms
    ]
    page = StudyPage("x", "?", background=words.markdown(text), tables=["Xuu"], coefficients=entries).text()
    rows = [line for line in page.split("\n") if line.startswith("|")]
    assert {len(re.findall(r"(?<!\\)\|", line)) for line in rows} == {5}
    assert not re.search(r"<|(?<!\\)\[", page)
    assert markdown.row([words.markdown(text)]).count("\n") == 0


@each
@given(text=texts)
def test_nothing_that_is_shown_controls_the_terminal(text):
    table = Table(text, title=text)
    table.add_row(text)
    with terminal.console.capture() as shown:
        terminal.say(text)
        terminal.console.print(table)
    assert all(c.isprintable() or c == "\n" for c in shown.get())


@pytest.mark.parametrize("key", ["unit", "label", "meaning"])
def test_files_have_texts_of_one_line_and_formulae(tmp_path, key):
    """What an equation set says becomes a part of other languages; meanings are any text of one line."""
    path, head = tmp_path / "evil.toml", 'name = "evil"\nextends = "booth"\ntitle = "t"\n[terms.X]\n'
    for text in EVIL if key != "meaning" else filter(lambda text: not text.isprintable(), EVIL):
        keys = {"unit": "1", "label": "X_e", "meaning": "m"} | {key: text}
        given = ", ".join(f'{name} = "{_escapes(value)}"' for name, value in keys.items())
        path.write_text(f'{head}Xevil = {{ regressor = "v*v*u*u", {given} }}\n')
        with refused("value", f"terms.X.Xevil.{key}"):
            load_equations(path)


def _escapes(text):
    return "".join(f"\\U{ord(c):08x}" for c in text)
