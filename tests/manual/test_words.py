"""Plain English: words of a list that readers stumbled at stand in no text that a user or developer reads.

Texts are README, manual, what pages and new files are made of, and strings, docstrings and comments of the package;
code between backticks is none of them, and neither is a string without a space, which is a name or a key.
"""

import re
import tokenize
from pathlib import Path

import pytest
from manual.pages import OTHERS, PAGES, ROOT

PACKAGE = ROOT / "bayesub"
WORDS = {  # pattern -> what to write in its place
    r"(fore|un)?told\b|foretells?\b": "predicted, reported, distinguished; of draws of the prior: prior predictive",
    r"tells? (nothing|little|much|most|less|all) ?\b|to be told\b": "says nothing about, determines",
    r"hangs? on\b|hung on\b": "depends on",
    r"sharper\b|sharpen(s|ed|ing)?\b": "better known, narrower, more precise",
    r"nobody\b": "a negated verb, or the passive",
    r"(?-i:of none\b|none of (its|their) own\b|(is|are) none of (its|their|these)\b|, none is\b)": "no and a noun",
    r"(is|are|was|to be) said of\b|nothing is said\b": "what .. says about",
    r"excuses?\b": "explains, allows",
    r"as far as (it|they) goe?s?\b": "to its limit",
}
BANNED = {re.compile(rf"(?<![\w-])(?:{pattern})", re.IGNORECASE): instead for pattern, instead in WORDS.items()}
_CODE = re.compile(r"<!--.*?-->|^ *```.*?^ *```$|``[^`]*``|`[^`\n]*`", re.DOTALL | re.MULTILINE)
_NAMES = re.compile(r"\{[^{}]*\}|'[a-z_]+'")  # values in texts, and keys in templates


def texts(path: Path) -> list[str]:
    """What a file says in words."""
    if path.suffix != ".py":
        return [path.read_text(encoding="utf-8")]
    with tokenize.open(path) as file:
        kinds = (tokenize.STRING, tokenize.COMMENT, getattr(tokenize, "FSTRING_MIDDLE", tokenize.COMMENT))
        return [token.string for token in tokenize.generate_tokens(file.readline) if token.type in kinds]


def flaws(path: Path) -> list[str]:
    """The words of the list in a file, each with what is better."""
    words = [_NAMES.sub("", _CODE.sub("", text)) for text in texts(path)]
    return [
        f"{path.name}: '{' '.join(text[max(0, hit.start() - 30) : hit.end() + 30].split())}': rather {instead}"
        for text in words
        if " " in text.strip()
        for pattern, instead in BANNED.items()
        for hit in pattern.finditer(text)
    ]


@pytest.mark.parametrize(
    "files",
    [
        pytest.param(paths, id=name)
        for name, paths in {
            "manual": [*PAGES, *OTHERS],
            "templates": [p for form in ("*.html", "new_*.toml", "findings/*.txt") for p in PACKAGE.rglob(form)],
            **{room.name: sorted(room.rglob("*.py")) for room in PACKAGE.iterdir() if (room / "__init__.py").exists()},
        }.items()
    ],
)
def test_words_of_the_list_are_not_used(files):
    assert files
    assert [flaw for path in files for flaw in flaws(path)] == []


def test_a_word_of_the_list_is_found(tmp_path):
    """Also in the middle of a formatted text, but not in code and in names."""
    file = tmp_path / "page.py"
    file.write_text('def f(told):\n    """What `told` is."""\n    return f"{told} hangs on it", "told", told\n')
    assert flaws(file) == ["""page.py: 'f" hangs on it"': rather depends on"""]
