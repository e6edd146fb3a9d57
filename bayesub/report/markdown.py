"""Tables and pages in Markdown: question, claim, answer, figures with captions, numbers, coefficients, cost, code.

A text may quote numbers, by a path in the numbers of a study, operations, and a format:
``suboff horizontal/hold/position_m/0.1; .2f`` is that entry in two digits. Between path and format there may be
operations, one after the other. A path has a key or an index a step; ``*`` stands for any text in a
key, and the entry of a list of tables is chosen by its name. ``&`` joins paths.
"""

import operator
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from statistics import mean, median
from typing import Any

from bayesub.io import templates
from bayesub.io.words import LABEL
from bayesub.io.words import markdown as plain

_ROLE = re.compile(r":\w+:`~?([^`]+)`")
_WORD = re.compile(r"\w+")
_REDUCE: dict[str, Callable] = {"min": min, "max": max, "mean": mean, "median": median, "sum": sum, "count": len}
_EACH: dict[str, Callable] = {"percent": lambda x: 100 * x, "per cent more": lambda x: 100 * (x - 1), "size": abs}
_EACH |= {"milli": lambda x: 1e3 * x, "centi": lambda x: 1e2 * x, "hours": lambda x: x / 3600}
_TESTS = {"below": operator.lt, "above": operator.gt}
_PLACE = re.compile(r"\{([^{}]+)\}")


def table(header: Sequence, lines: Iterable[Iterable]) -> list[str]:
    """The lines of a table: `header` (n,) and each of `lines` (n,) texts."""
    return [row(line) for line in (header, ["---"] * len(header), *lines)]


def row(cells: Iterable) -> str:
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
    """What stands on the page of a study; what is empty is left out."""

    name: str  # of the study
    question: str  # in one line
    background: str = ""  # where the question comes from
    claim: str = ""  # what the study asserts
    verdict: str = ""  # what became of the claim, or of the convergence
    answer: str = ""  # with the numbers of the run
    pictures: Mapping[str, str] = field(default_factory=dict)  # file in the folder of the page -> caption
    tables: Iterable[str] = ()  # lines of Markdown
    method: str = ""  # how the answer was found
    # What the page explains those of them by that it names: name, label, regressor and meaning of each, as
    # :func:`bayesub.findings.equation_card.glossary` has them:
    coefficients: Sequence[Mapping[str, str]] = ()
    cost: str = ""  # what the study takes
    code: str = ""  # what made the numbers

    def text(self) -> str:
        """The page."""
        tables = "\n".join(self.tables).strip()
        words = " ".join([self.claim, self.answer, self.method, *self.pictures.values(), tables])
        values = {"page": self, "tables": tables, "explained": glossary(self.coefficients, words)}
        return templates.fill("bayesub.report", "study.md", escaped=escaped, alternative=alternative, **values)


def escaped(text: str) -> str:
    """A text of a study as Markdown: no tags, and references to Python names as code."""
    return _ROLE.sub(r"`\1`", text).replace("``", "`").replace("<", "&lt;")


def alternative(caption: str) -> str:
    """What stands for a picture where it cannot be seen: the first sentence of its caption."""
    return re.sub(r"[\[\]\n<]", " ", caption.split(". ")[0].rstrip("."))


def glossary(coefficients: Sequence[Mapping[str, str]], words: str) -> list[str]:
    """The coefficients that a text names, with symbol, code name, regressor and meaning; empty if it names none."""
    names = set(_WORD.findall(words))
    rows = [
        (symbol(c["label"]), f"`{c['name']}`", f"`{c['regressor']}`".replace("|", "\\|"), plain(c["meaning"]))
        for c in coefficients
        if c["name"] in names
    ]
    if not rows:
        return []
    return ["## Coefficients", "\n".join(table(("in figures", "in text and files", "multiplies", "meaning"), rows))]


def symbol(label: str) -> str:
    """The label of a coefficient as mathematics in a cell of a table."""
    return label.replace("|", r"\vert ") if LABEL.fullmatch(label) else plain(label)


def fill(text: str, numbers: dict) -> str:
    """A text with ``{path; operations; format}`` in it; KeyError for a path that leads nowhere."""
    return _PLACE.sub(lambda match: evaluate(numbers, " ".join(match[1].split())), text)


def evaluate(numbers: dict, what: str) -> str:
    """What a path in the numbers of a study stands for, with operations and format, apart by semicolons.

    Operations reduce all numbers (``min``, ``max``, ``mean``, ``median``, ``sum``, ``count``), or those of each path
    (``each median``, ``each share below 1e-3``), change them (``percent``, ``milli``, ..), or choose among them
    (``below 1e-6``, ``above 3``). KeyError if the path leads nowhere, or to null.
    """
    where, *operations, form = (part.strip() for part in what.split(";"))
    paths = [one.strip().split("/") for one in where.split("&")]
    parts = [flat(entry) for one in paths for entry in leaves(numbers, one)]
    if not parts:
        raise KeyError(where)
    for operation in operations:
        if operation.startswith("each share "):
            _, _, word, limit = operation.split()
            parts = [[mean(_TESTS[word](number, float(limit)) for number in part)] for part in parts]
        elif operation.startswith("each "):
            parts = [[_REDUCE[operation.removeprefix("each ")](part)] for part in parts]
        elif operation in _EACH:
            parts = [[_EACH[operation](number) for number in part] for part in parts]
        elif operation.split()[0] in _TESTS:
            word, limit = operation.split()
            parts = [[number for number in part if _TESTS[word](number, float(limit))] for part in parts]
        else:
            parts = [[_REDUCE[operation]([number for part in parts for number in part])]]
    (number,) = {number for part in parts for number in part}
    return format(number, form)


def leaves(content: Any, path: list[str]) -> Iterator:
    """The entries at a path, null left out."""
    if content is None:
        return
    if not path:
        yield content
        return
    key, *rest = path
    if isinstance(content, list):
        named = [entry for entry in content if isinstance(entry, dict) and entry.get("name") == key]
        entries = content if key == "*" else named or [content[int(key)]]
    elif "*" in key:
        entries = [entry for name, entry in content.items() if fnmatchcase(name, key)]
    else:
        entries = [content[key]]
    for entry in entries:
        yield from leaves(entry, rest)


def flat(content: Any) -> list[float]:
    """The numbers in lists and tables, however deep."""
    if isinstance(content, list | dict):
        entries = content if isinstance(content, list) else content.values()
        return [number for entry in entries for number in flat(entry)]
    return [] if content is None else [content]
