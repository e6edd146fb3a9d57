"""Numbers that a text quotes: by a path in the numbers of a study, operations, and a format.

``suboff horizontal/hold/position_m/0.1; .2f`` is that entry in two digits. Between path and format there may be
operations, one after the other. A path has a key or an index a step; ``*`` stands for any text in a
key, and the entry of a list of tables is chosen by its name. ``&`` joins paths.
"""

import operator
import re
from collections.abc import Iterator
from fnmatch import fnmatchcase
from statistics import mean, median

_REDUCE = {"min": min, "max": max, "mean": mean, "median": median, "sum": sum, "count": len}
_EACH = {
    "percent": lambda x: 100 * x,
    "per cent more": lambda x: 100 * (x - 1),
    "milli": lambda x: 1e3 * x,
    "centi": lambda x: 1e2 * x,
    "size": abs,
    "hours": lambda x: x / 3600,
}
_TESTS = {"below": operator.lt, "above": operator.gt}
_PLACE = re.compile(r"\{([^{}]+)\}")


def filled(text: str, numbers: dict) -> str:
    """A text with ``{path; operations; format}`` in it; KeyError for a path that leads nowhere."""
    return _PLACE.sub(lambda match: evaluate(numbers, " ".join(match[1].split())), text)


def evaluate(numbers: dict, what: str) -> str:
    """What a path with operations and format stands for.

    Parameters
    ----------
    numbers : dict
        Of the study.
    what : str
        Path, operations and format, apart by semicolons. Operations reduce all numbers (``min``, ``max``, ``mean``,
        ``median``, ``sum``, ``count``), or those of each path (``each median``, ``each share below 1e-3``), change them
        (``percent``, ``milli``, ..), or choose among them (``below 1e-6``, ``above 3``).

    Raises
    ------
    KeyError
        If the path leads nowhere, or to null.
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


def leaves(content, path: list[str]) -> Iterator:
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


def flat(content) -> list[float]:
    """The numbers in lists and tables, however deep."""
    if isinstance(content, list | dict):
        entries = content if isinstance(content, list) else content.values()
        return [number for entry in entries for number in flat(entry)]
    return [] if content is None else [content]
