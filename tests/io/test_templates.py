"""Templates: nothing unescaped in HTML, nothing undefined, includes by path, plain text as it is."""

from pathlib import Path

import jinja2
import jinja2.meta
import pytest
from jinja2 import meta

import bayesub
from bayesub.io import templates

PACKAGE = Path(bayesub.__file__).parent


def test_a_name_without_a_value_is_an_error():
    with pytest.raises(jinja2.UndefinedError, match="numbers"):
        templates.fill("bayesub.report", "report.html", pictures={})


def test_html_is_escaped_and_other_files_are_not():
    page = templates.fill("bayesub.study.run", "index.html", rows=[_row("<b>&")], duration=str)
    assert "&lt;b&gt;&amp;" in page
    assert "<b>" not in page
    assert 'name = "<b>"' in templates.fill("bayesub.study.new", "new_equations.toml", name="<b>")


@pytest.mark.parametrize("file", sorted(PACKAGE.rglob("*.html")), ids=lambda file: file.name)
def test_every_template_finds_what_it_includes(file):
    name = file.relative_to(PACKAGE).as_posix()
    environment = templates.environment()
    for part in meta.find_referenced_templates(environment.parse(file.read_text(), name)):
        assert environment.get_template(part)


def test_a_style_sheet_is_included_as_it_is():
    page = templates.fill("bayesub.study.run", "index.html", rows=[], duration=str)
    assert "@media print {" in page
    assert "{%" not in page


def _row(text):
    return {
        "good": True,
        "verdict": text,
        "link": "",
        "picture": "",
        "place": text,
        "question": text,
        "text": text,
        "seconds": 1.0,
    }
