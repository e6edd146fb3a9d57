"""Numbers in README and manual are those of the figures."""

import re
import tomllib
from datetime import date

import pytest
from manual.pages import PAGES, ROOT
from manual.resolver import GIVEN, evaluate, markers

from bayesub.study.run import runs

FIGURES = ROOT / "figures"
CHANGES = tomllib.loads((FIGURES / "equal.toml").read_text(encoding="utf-8"))["change"]
MOST_DAYS = 60  # for which a stale run may be quoted
RESULTS = {  # the parts of pages in which every measured number has a marker
    "README.md": ("## What was found", "## Gallery"),
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


def flaws(name):
    """Why the run of a study is not what these sources make; other versions are those of whoever runs the tests."""
    studies = {path.stem: path for path in runs.study_files(ROOT / "studies")}
    found = runs.flaws(FIGURES / name, studies[name])
    found.pop("versions", None)
    return found


def test_a_run_counts_as_present_only_from_change_to_change(tmp_path):
    """What .ci/equal.py found to leave the numbers of a study as they were, in the order in which it was changed."""
    first, second = (
        '[change.studies]\none = ["aa", "bb"]\n',
        '[change.studies]\none = ["bb", "cc"]\ntwo = ["dd", "ee"]\n',
    )
    for text, name, made, wanted in (
        (f"[[change]]\n{first}[[change]]\n{second}", "one", "aa", "cc"),
        (f"[[change]]\n{second}[[change]]\n{first}", "one", "aa", "bb"),
        (f"[[change]]\n{first}[[change]]\n{second}", "two", "aa", "aa"),
        (f"[[change]]\n{first}[[change]]\n{second}", "one", "ff", "ff"),
    ):
        (tmp_path / "equal.toml").write_text(text)
        assert runs.counts_as(made, name, tmp_path / "equal.toml") == wanted
    assert runs.counts_as("aa", "one", tmp_path / "none.toml") == "aa"


def test_changes_that_count_as_none_say_why():
    assert all(change["why"] and change["n_numbers"] > 1000 and change["studies"] for change in CHANGES)


def quoted():
    """The studies that README and manual quote or link to."""
    texts = [page.read_text(encoding="utf-8") for page in PAGES]
    names = {name for text in texts for name in re.findall(r"figures/(\w+)/", text)}
    names |= {what.partition(":")[0].strip() for text in texts for _, what in markers(text) if what != GIVEN}
    return sorted(name for name in names if (FIGURES / name / "config.toml").exists())


def test_what_is_quoted_is_of_this_code():
    """But for what a file names, says why, and dates; it names nothing that is current, and not for long."""
    grace = tomllib.loads((FIGURES / "stale.toml").read_text(encoding="utf-8"))
    stale = {name: why for name in quoted() if (why := flaws(name))}
    assert len(quoted()) > 20
    assert {name: why for name, why in stale.items() if name not in grace} == {}
    assert [name for name in grace if not (stale.get(name) or flaws(name))] == [], "these are current"
    too_old = [name for name, entry in grace.items() if (date.today() - entry["date"]).days > MOST_DAYS]
    assert too_old == [], "these have been stale for long; run them again"
    assert all(entry["why"] for entry in grace.values())
