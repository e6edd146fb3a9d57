"""Numbers that a text quotes: paths, operations, formats."""

import pytest

from bayesub.report import markdown

NUMBERS = {
    "cases": {
        "a horizontal": {"errors": [0.1, 0.4, None]},
        "b horizontal": {"errors": [0.2, 0.3]},
        "c": {"errors": [9.0]},
    },
    "rows": [{"name": "Xuu", "sd": 2.0}, {"name": "Yuv", "sd": 3.0}],
    "m": 0.0123,
    "not reached": None,
}


@pytest.mark.parametrize(
    ("what", "text"),
    [
        ("m; milli; .1f", "12.3"),
        ("rows/Yuv/sd; .0f", "3"),
        ("rows/0/sd; .1f", "2.0"),
        ("cases/*/errors; max; .0f", "9"),
        ("cases/* horizontal/errors; max; percent; .0f", "40"),
        ("cases/*/errors; each median; min; .2f", "0.25"),
        ("cases/*/errors; count; .0f", "5"),
        ("cases/* horizontal/errors; below 0.25; count; .0f", "2"),
        ("cases/* horizontal/errors; each share above 0.25; max; percent; .0f", "50"),
        ("rows/*/sd & m; min; .4f", "0.0123"),
    ],
)
def test_what_stands_for_a_number(what, text):
    assert markdown.evaluate(NUMBERS, what) == text


def test_a_text_is_filled_across_lines_and_a_path_to_nothing_is_an_error():
    assert markdown.fill("It is {m; milli;\n.1f} mm of {rows/Xuu/sd; .0f} m.", NUMBERS) == "It is 12.3 mm of 2 m."
    for path in ("none; .0f", "not reached; .0f", "not reached/0; .0f", "cases/d*/errors; max; .0f"):
        with pytest.raises(KeyError):
            markdown.evaluate(NUMBERS, path)
