"""Numbers in README and manual are those of the figures."""

import re

import pytest
from manual.pages import PAGES, ROOT
from manual.resolver import GIVEN, evaluate, markers

RESULTS = {  # the parts of pages in which every measured number has a marker
    "README.md": ("## What was found", "## Where to go on"),
    "findings.md": ("# What the studies found", None),
}
MEASURED = re.compile(r"\d[\d.,]*(e-?\d+)? (%|[cm]?m|m/s|cm/s|mm/s|degrees|s|hours)(?![\w/])")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_marker_says_what_the_figures_say(page):
    text = page.read_text(encoding="utf-8")
    found = markers(text)
    assert len(found) == text.count("<!--n"), "a marker does not stand behind a number"
    wrong = [(shown, what) for shown, what in found if what != GIVEN and evaluate(what) != shown]
    assert not wrong


def test_a_wrong_number_is_found():
    """So that the test above is none that cannot fail."""
    (right,) = markers("it is 0.69<!--n time_step: suboff horizontal/hold/position_m/0.1; .2f--> m")
    (wrong,) = markers("it is 0.68<!--n time_step: suboff horizontal/hold/position_m/0.1; .2f--> m")
    assert evaluate(right[1]) == right[0]
    assert evaluate(wrong[1]) != wrong[0]


@pytest.mark.parametrize(("page", "part"), RESULTS.items(), ids=RESULTS)
def test_no_result_is_without_a_marker(page, part):
    (path,) = [path for path in PAGES if path.name == page]
    text = path.read_text(encoding="utf-8")
    first, last = part
    text = text[text.index(first) : text.index(last) if last else None]
    unmarked = re.sub(r"\S*<!--.*?-->", "", text, flags=re.DOTALL)
    assert not [match[0] for match in MEASURED.finditer(unmarked)]


def test_figures_are_those_of_full_runs():
    """What markers refer to was not made with --quick."""
    for file in (ROOT / "figures").glob("*/config.toml"):
        assert "quick_run = false" in file.read_text(encoding="utf-8"), file
