"""Pages in Markdown: what is escaped, what is explained, what stands for a picture; symbols in HTML."""

import pytest

from bayesub.findings.equation_card import glossary as entries
from bayesub.model.coefficients import EQUATIONS
from bayesub.report.markdown import StudyPage, alternative, glossary
from bayesub.report.page import symbol as html


def test_what_is_empty_is_left_out():
    assert StudyPage("a_study", "Is <it>?").text() == "# A study\n\n**Is &lt;it>?**\n"


def test_the_coefficients_that_a_text_names_are_explained_in_the_order_of_the_equations():
    title, table = glossary(entries(EQUATIONS), "Of Yv_absnu, `Xuu` and Nuvw only two are coefficients.")
    assert title == "## Coefficients"
    rows = table.splitlines()[2:]
    assert [row.split(" | ")[1] for row in rows] == ["`Xuu`", "`Yv_absnu`"]
    assert rows[1].startswith(r"| $Y'_{v\vert \nu\vert }$ |")
    assert {row.count("|") for row in table.splitlines()} == {5}
    assert glossary(entries(EQUATIONS), "None.") == []


def test_the_first_sentence_stands_for_a_picture():
    assert alternative("Errors of 0.1 m, [so]. More of it.") == "Errors of 0.1 m,  so "


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
    assert html(EQUATIONS.label(name)) == text


def test_every_symbol_of_the_set_is_written_without_latex():
    assert not [name for name in EQUATIONS.names if set("\\${}") & set(html(EQUATIONS.label(name)))]
