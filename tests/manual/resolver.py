"""Numbers in README and manual: a comment after each says where in the figures it comes from.

``0.69<!--n time_step: suboff horizontal/hold/position_m/0.1; .2f-->`` is right if that entry of
``figures/time_step/numbers.json``, formatted so, is 0.69; paths and operations are those of
:mod:`bayesub.report.markdown`.
``<!--n given-->`` marks a number that is no result but a choice, such as the level of an interval.
"""

import json
import re
from functools import cache
from pathlib import Path

from bayesub.report import markdown

ROOT = Path(__file__).parents[2]
MARKER = re.compile(r"(?P<shown>[-+\d.,e]*\d)(?P<unit>[ %a-z]*)<!--n (?P<what>.*?)-->", re.DOTALL)
GIVEN = "given"


@cache
def numbers(study: str) -> dict:
    """The numbers of a study, as its last full run left them."""
    return json.loads((ROOT / "figures" / study / "numbers.json").read_text(encoding="utf-8"))


def evaluate(what: str) -> str:
    """What a marker stands for, formatted."""
    study, _, where = what.partition(":")
    return markdown.evaluate(numbers(study.strip()), where)


def markers(text: str) -> list[tuple[str, str]]:
    """The number before each marker, and what the marker says."""
    return [(match["shown"].replace(",", ""), " ".join(match["what"].split())) for match in MARKER.finditer(text)]
