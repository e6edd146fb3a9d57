"""Pages in HTML: the list of contents, every heading once with a link that leads there, and symbols."""

import re

import pytest

from bayesub.model.coefficients import EQUATIONS
from bayesub.report.page import PLACE, product, symbol, with_contents


def test_headings_have_names_of_their_own_and_are_listed():
    page = f"{PLACE}<h2>What is &lt;new&gt;?</h2>text<h2>Track: one</h2><h2>Track: One</h2><h3>no</h3>"
    made = with_contents(page)
    names = re.findall(r'<h2 id="([^"]+)">', made)
    assert names == ["what-is-new", "track-one", "track-one-2"]
    assert re.findall(r'<a href="#([^"]+)">([^<]+)</a>', made) == list(
        zip(names, ["What is &lt;new&gt;?", "Track: one", "Track: One"], strict=True)
    )
    assert made.index("<nav") < made.index("<h2")
    assert "<h3>no</h3>" in made


def test_a_page_without_a_place_for_it_has_no_list():
    assert with_contents("<h2>One</h2>") == '<h2 id="one">One</h2>'


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("Nuv", "<i>N′</i><sub>uv</sub>"),
        ("Yv_absnu", "<i>Y′</i><sub>v|ν|</sub>"),
        ("Xuu_drdr", "<i>X′</i><sub>uuδrδr</sub>"),
        ("Nrdot", "<i>N′</i><sub>ṙ</sub>"),
    ],
)
def test_symbols_in_html(name, text):
    assert symbol(EQUATIONS.label(name)) == text


def test_every_symbol_of_the_set_is_written_without_latex():
    assert not [name for name in EQUATIONS.names if set("\\${}") & set(symbol(EQUATIONS.label(name)))]


@pytest.mark.parametrize(
    ("regressor", "text"),
    [
        ("u*u*dr*dr", "<i>u</i><sup>2</sup> <i>δ</i><sub>r</sub><sup>2</sup>"),
        ("sgn(v)*nu*abs(r)", "sgn(<i>v</i>) <i>ν</i> |<i>r</i>|"),
        ("rdot", "<i>ṙ</i>"),
        ("crossflow_y", "<i>crossflow</i><sub>y</sub>"),
        ("<b>*u", "<i>&lt;b&gt;</i> <i>u</i>"),
        ("v*abs(v)^2", "<i>v</i> |<i>v</i>|<sup>2</sup>"),
    ],
)
def test_regressors_in_html(regressor, text):
    assert product(regressor) == text


def test_every_regressor_of_the_set_is_written_without_code():
    shown = {term.regressor: product(term.regressor) for term in EQUATIONS.terms}
    assert not [regressor for regressor, text in shown.items() if "*" in text or "_" in text or "abs" in text]
