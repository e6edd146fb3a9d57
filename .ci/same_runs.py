"""Whether two folders of runs say the same: ``same_runs.py BEFORE AFTER`` compares ``numbers.json`` and the pages.

Clocks and what names the code are left out; of a study's page and its numbers all else must be the same bytes.
"""

import json
import re
import sys
from pathlib import Path

CLOCKS = re.compile(
    r"seconds|_s$|speed|per_second|time taken|price|evaluations_per|sources_sha256|commit|begun|versions|processor"
    r"|^bayesub$"
)
WORDS = re.compile(
    r"[0-9.,]+ (s|min|h|ms|seconds|minutes|hours)\b|[0-9a-f]{7,64}(-dirty)?|20[0-9]{2}-[0-9]{2}-[0-9]{2}[^|\n]*"
    r"|[0-9,]+ (simulations )?(a second|/s)"
)


def timeless(entry: object) -> object:
    """An entry of numbers.json without what depends on the clock."""
    if isinstance(entry, dict):
        return {key: timeless(value) for key, value in entry.items() if not CLOCKS.search(key)}
    return [timeless(value) for value in entry] if isinstance(entry, list) else entry


def content(path: Path) -> str:
    """What a file says, whenever it was written."""
    if path.suffix == ".json":
        return json.dumps(timeless(json.loads(path.read_text(encoding="utf-8"))))
    return WORDS.sub("#", path.read_text(encoding="utf-8"))


def differing(before: Path, after: Path) -> list[str]:
    """The files of two folders of runs that do not say the same."""
    paths = [path.relative_to(before) for path in sorted([*before.rglob("numbers.json"), *before.rglob("*.md")])]
    return [str(path) for path in paths if content(before / path) != content(after / path)]


if __name__ == "__main__":
    found = differing(Path(sys.argv[1]), Path(sys.argv[2]))
    print("\n".join(found) or "the same")
    sys.exit(bool(found))
