"""The site: its pages are those of manual and studies, links lead somewhere, nothing is loaded from elsewhere."""

import json
import re
from dataclasses import asdict
from html.parser import HTMLParser
from urllib.parse import unquote

import numpy as np
import pytest
from manual.pages import PAGES, ROOT
from PIL import Image
from support import pictures, website
from support.refusals import refused

from bayesub.cli import learn
from bayesub.study.run.result import StudyResult


class Links(HTMLParser):
    """What a page links to and loads, by element."""

    def __init__(self, page):
        super().__init__()
        self.found = []
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        self.found += [(tag, value) for key, value in attrs if key in ("href", "src") and value]


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The site with the report of one run beside those of the figures."""
    folder = tmp_path_factory.mktemp("site")
    run = folder / "runs" / "some" / "misfit.toml"
    run.mkdir(parents=True)
    (run / "config.toml").write_text('name = "misfit"\nquestion = "Does it?"\nsources_sha256 = "0"\n')
    (run / "report.md").write_text("# misfit\n\n![What it is](fan.png)\n")
    (run / "fan.png").write_bytes(b"")
    (run / "report.html").write_text("<p>not to be used</p>")
    (run / "outcome.json").write_text(json.dumps(asdict(StudyResult("misfit", "Does it?", "does not fit", str(run)))))
    n_pages = website.write(folder / "site", learn.pages(), folder / "runs")
    return folder / "site", n_pages


@pytest.mark.docs
def test_links_lead_somewhere_and_nothing_is_loaded_from_elsewhere(built):
    folder, n_pages = built
    pages = sorted(folder.rglob("*.html"))
    assert len(pages) == n_pages > 60
    lost, loaded = [], []
    for page in pages:
        if page.name in ("404.html", "report.html"):  # of the root of a host; with tests of its own
            continue
        for tag, link in Links(page).found:
            file = page.parent / unquote(link.partition("#")[0])
            if re.match("https?:|data:", link):
                loaded += [link] if tag in ("script", "img", "link") and not link.startswith("data:") else []
            elif link.partition("#")[0] and not file.is_file():
                lost.append(f"{page.relative_to(folder)}: {link}")
    assert (lost, loaded) == ([], [])


@pytest.mark.docs
def test_every_page_of_the_manual_stands_under_its_kind(built):
    """Each page lists those of its kind at its side, the landing page has the kinds as tabs, no page has comments."""
    home = (built[0] / "index.html").read_text(encoding="utf-8")
    tabs = re.findall(r'class="md-tabs__link">\s*(.*?)\s*</a>', home)
    assert tabs == ["Home", *(title.partition(":")[0] for title in learn.KINDS.values()), "Reports", "Studies"]
    pages = learn.pages().values()
    for page in pages:
        text = (built[0] / "bayesub" / "manual" / f"{page.topic}.html").read_text(encoding="utf-8")
        assert "<!--n" not in text
        for other in pages:
            assert f'"{other.topic}.html"' in text or f'"./{other.topic}.html"' in text or other.kind != page.kind


@pytest.mark.docs
def test_formulas_are_drawn(built):
    text = (built[0] / "bayesub" / "manual" / "model.html").read_text(encoding="utf-8")
    assert text.count("<math") > 100
    assert "arithmatex" not in text
    assert r"\dot" not in text


@pytest.mark.docs
def test_reports_are_shown_as_they_are_with_their_verdicts(built):
    text = (built[0] / "reports" / "index.html").read_text(encoding="utf-8")
    assert re.search(r'href="misfit/report.html".*?fan.png.*?Does it\?.*?does not fit', text, flags=re.DOTALL)
    assert 'href="quickstart/report.html"' in text
    home = (built[0] / "index.html").read_text(encoding="utf-8")
    assert 'href="reports/misfit/report.html"' in home  # and of the study that was not run the page of all
    assert 'href="reports/index.html">a real log' in home
    committed = (ROOT / "figures" / "quickstart" / "report.html").read_text(encoding="utf-8")
    assert (built[0] / "reports" / "quickstart" / "report.html").read_text(encoding="utf-8") == committed


@pytest.mark.docs
def test_a_site_is_written_anew(built):
    """The one that is there goes, with what it no longer has."""
    folder, n_pages = built
    (folder / "old.html").write_text("")
    assert website.write(folder, learn.pages(), None) == n_pages - 1
    assert not (folder / "old.html").exists()


def test_what_is_no_site_stays(tmp_path):
    (tmp_path / "thesis.doc").write_text("years of work")
    with refused("file"):
        website.write(tmp_path, learn.pages(), None)
    with refused("file"):
        website.write(tmp_path / "thesis.doc", learn.pages(), None)
    assert (tmp_path / "thesis.doc").read_text() == "years of work"


def test_what_a_site_needs_is_named(tmp_path, monkeypatch):
    with monkeypatch.context() as without, refused("install", "zensical"):
        without.setattr(website, "find_spec", lambda _: None)
        website.write(tmp_path / "site", learn.pages(), None)


@pytest.mark.docs
def test_pictures_of_the_manual_are_those_of_its_command_and_each_is_shown(tmp_path):
    """What needs neither a run nor a browser is drawn again: it has the size and nearly the colours of what is kept."""
    assert sorted(pictures.NAMES) == sorted(file.stem for file in pictures.FOLDER.iterdir())
    pictures.make(tmp_path, pictures.DRAWN)
    for name in pictures.DRAWN:
        drawn, kept = (colours(folder / f"{name}.png") for folder in (tmp_path, pictures.FOLDER))
        assert drawn.shape == kept.shape
        assert np.abs(drawn - kept).mean() < 2.0
    shown = {link for page in PAGES for link in re.findall(r"!\[.*?\]\(\S*pictures/(\w+)\.png\)", page.read_text())}
    assert shown == set(pictures.NAMES)


def colours(file):
    """(rows, columns, 3) from 0 to 255."""
    with Image.open(file) as picture:
        return np.asarray(picture.convert("RGB"), float)
