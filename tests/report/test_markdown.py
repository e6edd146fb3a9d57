"""Tables in Markdown."""

from bayesub.report import markdown


def test_columns_say_header_and_cell_together():
    results = markdown.named({"one": {"n": 3}, "two": {"n": 4}})
    lines = markdown.columns(results, {"case": lambda r: r["name"], "square": lambda r: r["n"] ** 2})
    assert lines == ["| case | square |", "| --- | --- |", "| one | 9 |", "| two | 16 |"]


def test_quantities_stand_beside_the_thesis():
    """Ours, the thesis's and the ratio; ours alone where the thesis has none."""
    assert markdown.beside(3.0, 2.0) == "3 / 2 = 1.5"
    assert markdown.beside(3.0, None) == "3"
