"""Tables and pages in Markdown: what is escaped, what is explained, what stands for a picture."""

from bayesub.findings.equation_card import glossary as entries
from bayesub.model.coefficients import EQUATIONS
from bayesub.report import markdown
from bayesub.report.markdown import StudyPage, alternative, glossary


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


def test_columns_say_header_and_cell_together():
    results = markdown.named({"one": {"n": 3}, "two": {"n": 4}})
    lines = markdown.columns(results, {"case": lambda r: r["name"], "square": lambda r: r["n"] ** 2})
    assert lines == ["| case | square |", "| --- | --- |", "| one | 9 |", "| two | 16 |"]
