"""What the page of a script takes from its docstring, its captions, its answer and the folder."""

from types import SimpleNamespace

import pytest
from support.refusals import refused

from bayesub.study.run import script_page
from thesis import page

DOCSTRING = """Is it so?

Question: somebody asked,
in two lines.
Claim: it is.
Cost: seconds.

The method :func:`bayesub.simulate` is used
throughout.

And <b>more</b>.
"""


def test_the_parts_of_a_docstring():
    first, parts, rest = script_page.docstring_parts(DOCSTRING)
    assert first == "Is it so?"
    assert parts == {"Question": "Somebody asked, in two lines.", "Claim": "It is.", "Cost": "Seconds."}
    assert rest == "The method :func:`bayesub.simulate` is used throughout.\n\nAnd <b>more</b>."
    assert script_page.docstring_parts("Only this?") == ("Only this?", dict.fromkeys(script_page.PARTS, ""), "")


def test_captions_by_pattern_in_the_order_of_the_patterns():
    files = ["all.png", "case_one_two.png", "case_x.png", "new.png"]
    captions = {"case_*": "{}: a case.", "all": "All of them.", "none_*": "Not there."}
    assert script_page.captioned(files, captions) == {
        "case_one_two.png": "one two: a case.",
        "case_x.png": "x: a case.",
        "all.png": "All of them.",
        "new.png": "New.",
    }


def test_an_answer_has_its_numbers_and_says_where_they_lack():
    numbers = {"boats": {"a": {"off_m": [0.012, 0.5]}}}
    assert script_page.answer("Up to {boats/*/off_m; max; centi; .0f} cm.", numbers, quick=False) == "Up to 50 cm."
    with refused("unknown", "other"):
        script_page.answer("{other; .0f}", numbers, quick=False)
    assert "full version" in script_page.answer("{other; .0f}", numbers, quick=True)
    assert script_page.answer("", numbers, quick=False) == ""


def test_the_page_of_a_script_and_its_place_in_the_gallery(tmp_path):
    run = tmp_path / "mine"
    run.mkdir()
    (run / "config.toml").write_text('name = "mine"\nquestion = "Is it so?"\nscript_sha256 = "f"\n')
    (run / "seconds.json").write_text('{"seconds": 754.2}')
    for name in ("b_picture", "a_picture"):
        (run / f"{name}.png").write_bytes(b"")
    module = SimpleNamespace(
        __doc__=DOCSTRING,
        FIGURES={"b_*": "First {}. With Nuv and <i>."},
        ANSWER="{a; .1f} m.",
        GLOSSARY="booth",
    )
    config = {"name": "mine", "script_sha256": "f" * 64, "quick_run": False, "versions": {"python": "3.11"}}
    script_page.write(run, config, module, {"a": 2.0}, ["| x |", "| --- |"], ["two is three", "four"])
    text = (run / "mine.md").read_text()
    order = (
        "# Mine",
        "**Is it so?**",
        "Somebody asked",
        "**Claim.** It is.",
        "fails: two is three; four.",
        "**Answer.** 2.0 m.",
    )
    order += ("![First picture](b_picture.png)", "![A picture](a_picture.png)", "| x |", "`bayesub.simulate`")
    order += ("| $N'_{uv}$ | `Nuv` | `u*v` |", "Seconds. This run took 12 min 34 s.")
    order += ("Made by script ffffffffffff, python 3.11.",)
    places = [text.index(words) for words in order]
    assert places == sorted(places)
    assert "<b>" not in text
    assert "<i>" not in text
    lines = page.gallery(tmp_path)
    assert lines[2].startswith(
        '| [<img src="mine/b_picture.png" width="270" alt="mine"><br>**mine**](mine/mine.md)<br>Is it'
    )
    assert len({line.count("|") for line in lines}) == 1


@pytest.mark.parametrize(
    "kept", ['{"seconds": NaN}', '{"seconds": Infinity}', '{"seconds": "x"}', "{", "[1]", '{"seconds": 0}']
)
def test_a_page_does_not_need_the_seconds(tmp_path, kept):
    (tmp_path / "seconds.json").write_text(kept)
    script_page.write(tmp_path, {"name": "mine"}, SimpleNamespace(__doc__=DOCSTRING), {}, [], [])
    text = (tmp_path / "mine.md").read_text()
    assert "Seconds." in text
    assert "took" not in text
