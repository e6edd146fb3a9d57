"""Studies that give the same numbers by two versions of the code: .ci/equal.py BEFORE AFTER, folders of .ci/studies.py.

A change that only refuses more, or says more, leaves every number as it is. Where those of the small version of a study
are the same bit for bit, but for measured times, a full run by the code before counts as one by the code after: what is
printed goes into figures/equal.toml, with the reason. A study without a small version rests on all others, and a study
whose numbers differ is run again. Fails if none is the same.
"""

import json
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

# Keys of times, of what derivatives cost in simulations, which is timed, of ratios to these, and of when and by what.
MEASURED = re.compile(
    r"seconds|per_second|share_simulating|price|/work$|to_target|per_(effective_)?sample|check/sentence"
    r"|set_up/(bayesub|begun|time taken)"
)


def leaves(content: Any, place: str = "") -> Iterator[tuple[str, Any]]:
    """Every number and text of JSON with the keys that lead to it."""
    if isinstance(content, dict | list):
        items = content.items() if isinstance(content, dict) else enumerate(content)
        for key, value in items:
            yield from leaves(value, f"{place}/{key}")
    else:
        yield place, content


def numbers(folder: Path) -> dict[str, Any]:
    """The numbers of a run but for measured times."""
    content = json.loads((folder / "numbers.json").read_text(encoding="utf-8"))
    return {place: value for place, value in leaves(content) if not MEASURED.search(place)}


def digest(folder: Path) -> str:
    """That of the sources that made a run."""
    return tomllib.loads((folder / "config.toml").read_text(encoding="utf-8"))["sources_sha256"]


def main(before: str, after: str) -> int:
    """Compare; 0 if some study is the same."""
    same, n_compared = {}, 0
    for now in sorted(Path(after).glob("studies/**/config.toml")):
        then, now = Path(before) / now.parent.relative_to(after), now.parent
        if not all((run / "numbers.json").exists() for run in (then, now)) or digest(then) == digest(now):
            continue
        first, second = numbers(then), numbers(now)
        others = sorted(place for place in first | second if first.get(place) != second.get(place))
        print(f"# {now.name}: {len(first)} numbers, {len(others)} differ {others[:3]}", file=sys.stderr)
        if not others:
            n_compared += len(first)
            same[now.stem] = [digest(then), digest(now)]
    print(f"n_numbers = {n_compared}\n\n[change.studies]")
    print("\n".join(f'{name} = ["{first}", "{second}"]' for name, (first, second) in same.items()))
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
