"""The pages of the committed runs: each study has one, and every picture stands on one with words of its own."""

import json
import re
from pathlib import Path

import pytest

from bayesub.report import markdown
from bayesub.study.run import script, script_page

ROOT = Path(__file__).parents[2]
FIGURES = ROOT / "figures"
FOLDERS = sorted(file.parent for file in FIGURES.glob("*/config.toml"))
SCRIPTS = [folder for folder in FOLDERS if (ROOT / "studies" / f"{folder.name}.py").is_file()]
LINK = re.compile(r"""(?:\]\(|src=")([^)"]+\.png)""")
pytestmark = pytest.mark.skipif(not FIGURES.is_dir(), reason="figures are not part of a source distribution")


def page_of(folder):
    """The text of the page of a run."""
    return next(file for file in (folder / f"{folder.name}.md", folder / "report.md") if file.is_file()).read_text()


def test_every_committed_picture_is_linked_from_a_page():
    pages = [ROOT / "README.md", *FIGURES.rglob("*.md"), *(ROOT / "bayesub" / "manual").glob("*.md")]
    linked = {(page.parent / link).resolve() for page in pages for link in LINK.findall(page.read_text())}
    pictures = {file.resolve() for file in FIGURES.rglob("*.png")}
    assert len(pictures) > 150
    assert sorted(str(file.relative_to(ROOT)) for file in pictures - linked) == []
    assert not [file for file in linked if not file.is_file()]


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_a_page_asks_answers_shows_and_says_what_made_it(folder):
    text = page_of(folder)
    assert re.match(r"# .+\n\n\*\*.+\?\*\*\n", text)
    for part in ("**Verdict.**", "**Answer.**", "## Numbers", "## Cost and code", "Made by "):
        assert part in text, part
    assert LINK.findall(text) or not list(folder.glob("*.png"))


@pytest.mark.parametrize("folder", SCRIPTS, ids=lambda folder: folder.name)
def test_every_picture_of_a_script_has_a_caption_and_the_answer_is_that_of_the_numbers(folder):
    study = script.load(ROOT / "studies" / f"{folder.name}.py")
    files = sorted(file.name for file in folder.glob("*.png"))
    captions = getattr(study, "FIGURES", {})
    captioned = script_page.captioned(files, captions)
    assert [file for file, caption in captioned.items() if caption == default_caption(file)] == []
    text, numbers = page_of(folder), json.loads((folder / "numbers.json").read_text())
    for caption in captioned.values():
        assert markdown.escaped(caption) in text
    assert markdown.escaped(script_page.answer(study.ANSWER, numbers, quick=False)) in text


def default_caption(file):
    return script_page.captioned([file], {})[file]
