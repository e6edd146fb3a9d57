"""Every citation in code and manual is resolved: literature in references.bib, sections of the model in the page."""

import re
import unicodedata

import pytest
from manual.pages import ROOT

BIB = (ROOT / "bayesub" / "manual" / "references.bib").read_text(encoding="utf-8")
FOLDERS = ("bayesub", "studies", "tests")
SUFFIXES = (".py", ".toml", ".md", ".html")
FILES = [path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*")) if path.suffix in SUFFIXES]
SOURCES = [*FILES, ROOT / "README.md"]

NAME = r"(?:van )?[A-Z][\w'-]+"
CITATION = re.compile(rf"({NAME})((?:(?:, {NAME})*,? (?:&|and) {NAME}| et al\.)?),? \(?((?:18|19|20)\d\d)\b")
NO_AUTHOR = {"Thesis", "Over", "Structures", "Hydrodynamics", "April", "August", "SEED", "IFAC", "GCUV", "Python", "Of"}
NUMBER = r"\d+(?:\.\d+)?"
SECTIONS = re.compile(rf"\bmodel(?: manual,)? (?:sections?|equations?) ({NUMBER}(?:(?:, | and | to ){NUMBER})*)")


def plain(text):
    """Without accents and BibTeX commands."""
    text = re.sub(r"\\[\"'vc`^~]?|[{}]", "", text)
    return unicodedata.normalize("NFKD", text.replace("ä", "ae")).encode("ascii", "ignore").decode().replace("ae", "a")


def entries():
    """(first author's family name, year) -> fields of every entry."""
    found = {}
    for kind, key, body in re.findall(r"^@(\w+)\{(\w+),\n(.*?)^\}", BIB, flags=re.MULTILINE | re.DOTALL):
        fields = dict(re.findall(r"^ +(\w+) = \{(.*)\},?$", body, flags=re.MULTILINE))
        family = plain(re.split(r" and ", fields["author"])[0].split(",")[0])
        found[family, fields["year"]] = fields | {"kind": kind, "key": key}
    return found


def cited(text):
    """(first author, other authors, year) of each citation in a text."""
    joined = re.sub(r"\s*\n\s*(?:#\s*)?", " ", text)
    return [match.groups() for match in CITATION.finditer(joined) if match[1] not in NO_AUTHOR]


def test_the_bibliography_is_complete():
    """Each entry says who, what, where and when; there is no other way to end a block than its brace."""
    assert BIB.count("\n@") == len(entries())
    where = {"article": "journal", "book": "publisher", "incollection": "booktitle"}
    where |= {"techreport": "institution", "misc": "howpublished"}
    for fields in entries().values():
        assert {"author", "title", "year", where[fields["kind"]]} <= set(fields), fields["key"]
        assert fields["key"].endswith(fields["year"])


def test_citations_are_resolved():
    """By the family name of the first author and the year; the other authors that are named are those of the entry."""
    known, missing, seen = entries(), [], set()
    for path in SOURCES:
        for first, others, year in cited(path.read_text(encoding="utf-8")):
            entry = known.get((plain(first), year))
            if entry is None:
                missing.append(f"{path.relative_to(ROOT)}: {first}{others} {year}")
                continue
            seen.add(entry["key"])
            authors = plain(entry["author"])
            assert all(plain(name) in authors for name in re.findall(NAME, others)), f"{path}: {first}{others} {year}"
    assert not missing
    assert len(seen) >= 35, "the pattern finds citations"


def test_every_entry_is_cited():
    texts = plain(" ".join(path.read_text(encoding="utf-8") for path in SOURCES))
    for (family, year), fields in entries().items():
        assert re.search(rf"{family}.{{0,80}}{year}|{year}.{{0,80}}{family}", texts, flags=re.DOTALL), fields["key"]


@pytest.fixture(scope="module")
def model():
    return (ROOT / "bayesub" / "manual" / "model.md").read_text(encoding="utf-8")


def test_sections_of_the_model_exist(model):
    """Of "model manual, section N" in code and "`model` section N" in pages; equations too."""
    sections = set(re.findall(r"^## (\d+)\. ", model, flags=re.MULTILINE))
    equations = set(re.findall(r"&& \((\d+\.\d+)\)", model))
    assert len(sections) >= 11
    count = 0
    for path in SOURCES:
        text = re.sub(r"\s*\n\s*(?:#\s*)?", " ", path.read_text(encoding="utf-8")).replace("`model`", "model")
        assert not re.search(r"design [s]ection|model\.md [s]ection", text), f"{path}: cites what readers do not have"
        for match in SECTIONS.finditer(text):
            for number in re.findall(NUMBER, match[1]):
                assert number in sections | equations, f"{path.relative_to(ROOT)}: {match[0]}"
                count += 1
    assert count >= 20


def test_equations_are_numbered_in_order(model):
    for part in re.split(r"^## ", model, flags=re.MULTILINE)[1:]:
        number = part.partition(".")[0]
        labels = [int(n) for n in re.findall(rf"&& \({number}\.(\d+)\)", part)]
        assert labels == list(range(1, len(labels) + 1)), f"section {number}"
