"""The pages of the manual and the README, taken apart for tests."""

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
MANUAL = sorted((ROOT / "bayesub" / "manual").glob("*.md"))
PAGES = [ROOT / "README.md", *MANUAL]
OTHERS = [ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]

_BLOCK = re.compile(r"((?:^<!-- (?:quick|file): .*? -->\n)*)^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_DIRECTIVE = re.compile(r"<!-- (quick|file): (.*?) -->")


@dataclass(frozen=True)
class Block:
    """A block of code on a page.

    Attributes
    ----------
    page : file name
    language : word behind the fence
    text : what readers see
    run : the same with what the comments above it put in place of slow parts
    file : name that the page gives to a script, or the empty string
    """

    page: str
    language: str
    text: str
    run: str
    file: str

    @property
    def commands(self) -> list[tuple[str, str]]:
        """Commands of a session with what it shows below each; empty if the block is none."""
        if self.language or not re.match(r"(\$ )?bayesub\b", self.text):
            return []
        if not self.text.startswith("$ "):
            return [(line, "...\n") for line in self.run.splitlines()]
        parts = re.split(r"^\$ ", self.run, flags=re.MULTILINE)[1:]
        return [(command, shown or "...\n") for command, _, shown in (part.partition("\n") for part in parts)]


def blocks(page: Path) -> list[Block]:
    """All blocks of a page in order; a slow part that a comment names and the block has not is an error."""
    text = page.read_text(encoding="utf-8")
    found = []
    for comments, language, content in _BLOCK.findall(text):
        run, file = content, ""
        for kind, value in _DIRECTIVE.findall(comments):
            if kind == "file":
                file = value
                continue
            slow, quick = value.split(" => ")
            assert slow in run, f"{page.name}: '{slow}' is not in the block below it"
            run = run.replace(slow, quick)
        found.append(Block(page.name, language, content, run, file))
    assert len(found) == text.count("\n```") / 2, f"{page.name}: a block is not closed or not read"
    return found
