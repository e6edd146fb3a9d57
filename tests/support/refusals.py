"""Bad input that is refused: tests ask for kind and key of the error, and one file holds the sentences.

So do tests of findings in logs, by kind and columns.

``pytest --sentences -n 0 PATH`` writes the sentences of the tests that it runs to that file again, for a reader to look
at the difference.
"""

import json
import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from bayesub.io import atomic
from bayesub.io.errors import InputError

if TYPE_CHECKING:
    from bayesub.logs.series import Finding

FILE = Path(__file__).parents[1] / "sentences.json"
_HOME = Path(__file__).parents[2]
writing = False  # set by --sentences
_begun: dict[str, int] = {}  # test -> refusals that it has seen


@contextmanager
def refused(kind: str, key: str = "") -> Iterator[pytest.ExceptionInfo[InputError]]:
    """Something is refused with that kind of error, about that key, in the sentence that is kept for this test."""
    with pytest.raises(InputError) as caught:
        yield caught
    check(caught.value, kind, key)


def check(error: InputError | None, kind: str, key: str = "") -> None:
    """The same of an error that was caught."""
    assert error is not None, "nothing was refused"
    assert (error.kind, error.key) == (kind, key), str(error)
    _compare(str(error))


def told(finding: "Finding", kind: str, *columns: str) -> None:
    """A finding of that kind about those columns, in the line that is kept for this test."""
    assert (finding.kind, finding.columns) == (kind, columns), finding.line()
    _compare(finding.line())


def _compare(sentence: str) -> None:
    """The next sentence of the running test with the one that is kept."""
    test = os.environ["PYTEST_CURRENT_TEST"].rpartition(" ")[0]
    n = _begun[test] = _begun.get(test, -1) + 1
    sentence = _same_everywhere(sentence)
    kept = json.loads(FILE.read_text()) if FILE.is_file() else {}
    if writing:
        kept[test] = [*kept.get(test, [])[:n], sentence]
        atomic.write_text(FILE, json.dumps(dict(sorted(kept.items())), indent=1, ensure_ascii=False) + "\n")
    else:
        assert [sentence] == kept.get(test, [])[n : n + 1], "see tests/support/refusals.py"


def _same_everywhere(sentence: str) -> str:
    """A sentence without folders, ports, digests and versions of this machine and run, and the words of libraries."""
    places = [
        re.escape(tempfile.gettempdir()) + r"/pytest-of-[^/]*/pytest-\d+/(popen-gw\d+/)?[^/\s:']+",
        re.escape(str(_HOME)),
    ]
    sentence = re.sub("|".join(places), "..", sentence)
    sentence = re.sub(r"(?<=127\.0\.0\.1:)\d+|\b[0-9a-f]{12}\b(?!\.)|(?<= is now )'\d+(\.\d+)+'", "..", sentence)
    sentence = re.sub(r"(is not a readable posterior|is damaged|is not supported) \([^;]*\)", r"\1 (..)", sentence)
    return re.sub(r"(cannot be read as [^:]+|is not valid (TOML|YAML|Python)): (?!brackets)[^;]*", r"\1: ..", sentence)
