"""Numbers in README and manual: a comment after each says where in the figures it comes from.

``0.69<!--n time_step: suboff horizontal/hold/position_m/0.1; .2f-->`` is right if that entry of
``figures/time_step/numbers.json``, formatted so, is 0.69. Between path and format there may be operations, one after
the other. A path has a key or an index a step; ``*`` stands for any text in a key, and the entry of a list of tables
is chosen by its name. ``&`` joins paths. ``<!--n given-->`` marks a number that is no result but a choice, such as the
level of an interval.
"""

import json
import operator
import re
from collections.abc import Iterator
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from statistics import mean, median

ROOT = Path(__file__).parents[2]
MARKER = re.compile(r"(?P<shown>[-+\d.,e]*\d)(?P<unit>[ %a-z]*)<!--n (?P<what>.*?)-->", re.DOTALL)
GIVEN = "given"

REDUCE = {"min": min, "max": max, "mean": mean, "median": median, "sum": sum, "count": len}
EACH = {
    "percent": lambda x: 100 * x,
    "per cent more": lambda x: 100 * (x - 1),
    "milli": lambda x: 1e3 * x,
    "centi": lambda x: 1e2 * x,
    "size": abs,
    "hours": lambda x: x / 3600,
}
TESTS = {"below": operator.lt, "above": operator.gt}


@cache
def numbers(study: str) -> dict:
    """The numbers of a study, as its last full run left them."""
    return json.loads((ROOT / "figures" / study / "numbers.json").read_text(encoding="utf-8"))


def leaves(content, path: list[str]) -> Iterator:
    """The entries at a path, null left out."""
    if not path or content is None:
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


def flat(content) -> list[float]:
    """The numbers in lists and tables, however deep."""
    if isinstance(content, list | dict):
        entries = content if isinstance(content, list) else content.values()
        return [number for entry in entries for number in flat(entry)]
    return [] if content is None else [content]


def evaluate(what: str) -> str:
    """What a marker stands for, formatted."""
    where, *operations, form = (part.strip() for part in what.split(";"))
    study, _, path = where.partition(":")
    paths = [one.strip().split("/") for one in path.split("&")]
    parts = [flat(entry) for one in paths for entry in leaves(numbers(study.strip()), one)]
    for operation in operations:
        if operation.startswith("each share "):
            _, _, word, limit = operation.split()
            parts = [[mean(TESTS[word](number, float(limit)) for number in part)] for part in parts]
        elif operation.startswith("each "):
            parts = [[REDUCE[operation.removeprefix("each ")](part)] for part in parts]
        elif operation in EACH:
            parts = [[EACH[operation](number) for number in part] for part in parts]
        elif operation.split()[0] in TESTS:
            word, limit = operation.split()
            parts = [[number for number in part if TESTS[word](number, float(limit))] for part in parts]
        else:
            parts = [[REDUCE[operation]([number for part in parts for number in part])]]
    (number,) = {number for part in parts for number in part}
    return format(number, form)


def markers(text: str) -> list[tuple[str, str]]:
    """The number before each marker, and what the marker says."""
    return [(match["shown"].replace(",", ""), " ".join(match["what"].split())) for match in MARKER.finditer(text)]
