"""Tables and pages in Markdown: question, claim, answer, figures with captions, numbers, coefficients, cost, code."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

_ROLE = re.compile(r":\w+:`~?([^`]+)`")
_WORD = re.compile(r"\w+")


def table(header, lines) -> list[str]:
    """The lines of a table: `header` (n,) and each of `lines` (n,) texts."""
    return [row(line) for line in (header, ["---"] * len(header), *lines)]


def row(cells) -> str:
    """One line of a table."""
    return "| " + " | ".join(map(str, cells)) + " |"


def columns(results: Iterable, cells: dict[str, Callable]) -> list[str]:
    """The lines of a table with a row for each result; `cells` is header -> text of a result."""
    return table(tuple(cells), [[cell(result) for cell in cells.values()] for result in results])


def named(results: dict[str, dict]) -> list[dict]:
    """The results with their names among them, under ``name``."""
    return [{"name": name} | result for name, result in results.items()]


@dataclass(frozen=True)
class StudyPage:
    """What stands on the page of a study; what is empty is left out.

    Attributes
    ----------
    name : str
        Of the study.
    question : str
        In one line.
    background : str
        Where the question comes from.
    claim : str
        What the study asserts.
    verdict : str
        What became of the claim, or of the convergence.
    answer : str
        With the numbers of the run.
    pictures : mapping of str to str
        File in the folder of the page -> caption.
    tables : sequence of str
        Lines of Markdown.
    method : str
        How the answer was found.
    coefficients : sequence of mappings
        What the page explains those of them by that it names: name, label, regressor and meaning of each, as
        :func:`bayesub.findings.equation_card.glossary` has them.
    cost : str
        What the study takes.
    code : str
        What made the numbers.
    """

    name: str
    question: str
    background: str = ""
    claim: str = ""
    verdict: str = ""
    answer: str = ""
    pictures: Mapping[str, str] = field(default_factory=dict)
    tables: Iterable[str] = ()
    method: str = ""
    coefficients: Sequence[Mapping[str, str]] = ()
    cost: str = ""
    code: str = ""

    def text(self) -> str:
        """The page."""
        tables = "\n".join(self.tables).strip()
        parts = [f"# {self.name.replace('_', ' ').capitalize()}", f"**{escaped(self.question)}**"]
        parts += [escaped(self.background)] if self.background else []
        parts += [f"**Claim.** {escaped(self.claim)}"] if self.claim else []
        parts += [f"**Verdict.** {escaped(self.verdict)}"] if self.verdict else []
        parts += [f"**Answer.** {escaped(self.answer)}"] if self.answer else []
        parts += ["## Figures"] if self.pictures else []
        for file, caption in self.pictures.items():
            parts += [f"![{alternative(caption)}]({file})", f"*{file.rpartition('.')[0]}.* {escaped(caption)}"]
        parts += ["## Numbers", tables] if tables else []
        parts += ["## How", escaped(self.method)] if self.method else []
        words = " ".join([self.claim, self.answer, self.method, *self.pictures.values(), tables])
        parts += glossary(self.coefficients, words)
        parts += ["## Cost and code"] if self.cost or self.code else []
        parts += [escaped(text) for text in (self.cost, self.code) if text]
        return "\n\n".join(parts) + "\n"


def escaped(text: str) -> str:
    """A text of a study as Markdown: no tags, and references to Python names as code."""
    return _ROLE.sub(r"`\1`", text).replace("``", "`").replace("<", "&lt;")


def alternative(caption: str) -> str:
    """What stands for a picture where it cannot be seen: the first sentence of its caption."""
    first = caption.split(". ")[0].rstrip(".")
    return re.sub(r"[\[\]\n<]", " ", first)


def glossary(coefficients: Sequence[Mapping[str, str]], words: str) -> list[str]:
    """The coefficients that a text names, with symbol, code name, regressor and meaning; empty if it names none."""
    names = set(_WORD.findall(words))
    rows = [
        (symbol(c["label"]), f"`{c['name']}`", f"`{c['regressor']}`".replace("|", "\\|"), c["meaning"])
        for c in coefficients
        if c["name"] in names
    ]
    if not rows:
        return []
    return ["## Coefficients", "\n".join(table(("in figures", "in text and files", "multiplies", "meaning"), rows))]


def symbol(label: str) -> str:
    """The label of a coefficient as mathematics in a cell of a table."""
    return label.replace("|", r"\vert ")
