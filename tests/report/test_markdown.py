"""Tables in Markdown."""

from bayesub.report import markdown


def test_columns_say_header_and_cell_together():
    results = markdown.named({"one": {"n": 3}, "two": {"n": 4}})
    lines = markdown.columns(results, {"case": lambda r: r["name"], "square": lambda r: r["n"] ** 2})
    assert lines == ["| case | square |", "| --- | --- |", "| one | 9 |", "| two | 16 |"]
