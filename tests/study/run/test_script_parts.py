"""What a study script has done is read back after a kill, in whatever process it was done."""

import json
import os
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from bayesub.study.run.script import ScriptRun


class Reports:
    """A progress that cannot be sent to another process."""

    def __init__(self):
        self.stages, self.updates, self.lock = [], [], open(os.devnull)  # noqa: SIM115, PTH123

    def stage(self, name):
        self.stages.append(name)

    def update(self, *report):
        self.updates.append(report)


@pytest.fixture
def run(tmp_path):
    reports = Reports()
    yield ScriptRun("study", tmp_path, quick=True, progress=reports)
    reports.lock.close()


def test_a_finished_part_is_read_back(run):
    """What a file holds is not computed again."""
    first = run.part("part", lambda: {"errors": [0.1 + 0.2]})
    again = replace(run, taken=set()).part("part", lambda: pytest.fail("computed again"))  # of a later session
    assert again == first == json.loads((run.folder / "part.json").read_text())


def test_parts_of_a_stage(run):
    """Each has a file of its own, named after stage and part; one that is there is read back."""
    (run.folder / "cases_one_0_5_s.json").write_text('{"n": 1}')
    results = run.parts("cases", {"one: 0.5 s": lambda: pytest.fail("computed again"), "two": lambda: {"n": 2}})
    assert results == {"one: 0.5 s": {"n": 1}, "two": {"n": 2}}
    assert run.progress.stages == ["cases"]
    assert run.progress.updates == [(1, 2, "parts", "one: 0.5 s"), (2, 2, "parts", "two")]


def _part(run, name):
    return run.part(name, lambda: {"process": os.getpid()})


def test_parts_may_be_kept_by_other_processes(run):
    results = list(run.in_processes(partial(_part, run), ["one", "two"]))
    assert [json.loads((run.folder / f"{name}.json").read_text()) for name in ("one", "two")] == results


SKIPPING = '''"""Is there data?

Claim: there is.
"""


def compute(run):
    return {"skipped": "DATA does not name a folder"}


def draw(run, numbers):
    raise AssertionError


def claims(numbers):
    raise AssertionError
'''


def test_a_study_without_its_data_is_skipped(bayesub, tmp_path):
    """The reason is said, nothing is drawn or judged, and the exit status is zero."""
    (tmp_path / "needs.py").write_text(SKIPPING)
    status, out, _ = bayesub("run", tmp_path / "needs.py", "-o", tmp_path / "run")
    assert (status, out.splitlines()[-1]) == (0, "SKIPPED: DATA does not name a folder")
    status, out, _ = bayesub("report", tmp_path / "run", "--run-code")
    assert (status, out.splitlines()[-1]) == (0, "SKIPPED: DATA does not name a folder")


UNKNOWN = '''"""Is a number that is none written as one?

Claim: no.
"""

def compute(run):
    return {"off_m": [float("nan"), 1.0, -float("inf")]}

def draw(run, numbers):
    run.page([str(numbers["off_m"])])

def claims(numbers):
    yield numbers["off_m"] == [None, 1.0, None], f"{numbers['off_m']}"
'''


def test_what_is_not_finite_is_null(bayesub, tmp_path):
    """Other programs read no NaN in JSON; figures and claims get what they get when the run is drawn again."""
    (tmp_path / "unknown.py").write_text(UNKNOWN)
    status, out, err = bayesub("run", tmp_path / "unknown.py", "-o", tmp_path / "run")
    assert status == 0, (out, err)
    assert (tmp_path / "run" / "numbers.json").read_text() == '{"off_m": [null, 1.0, null]}'
    assert bayesub("report", tmp_path / "run", "--run-code")[0] == 0


def test_numbers_of_numpy_are_numbers(run):
    """Of a part, of a piece and of a cluster; what is no number is not."""
    made = {"n": np.int64(3), "x": np.float32(0.5), "yes": np.bool_(True), "all": np.arange(3.0)}
    plain = {"n": 3, "x": 0.5, "yes": True, "all": [0.0, 1.0, 2.0]}
    assert run.part("made", lambda: made) == plain
    assert run.repeat("pieces", lambda k: made | {"k": k}, 2)[1] == plain | {"k": 1}
    with pytest.raises(TypeError, match="part wrong must return JSON types"):
        run.part("wrong", lambda: {"run": run})
