"""Names under which a script keeps things, what it claims, and where it runs: no result stands for another."""

import json

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.findings.verdicts import CLAIM_FAILED, CLAIM_HOLDS, SKIPPED
from bayesub.study.run import runs
from bayesub.study.run.script import ScriptRun

SCRIPT = '''"""Is it so?

Claim: it is.
Cost: nothing.
"""
{head}

def compute(run):
    {compute}


def draw(run, numbers):
    pass


def claims(numbers):
    {claims}
'''


def written(tmp_path, compute="return {}", claims='yield True, "it is not"', head=""):
    path = tmp_path / "study.py"
    path.write_text(SCRIPT.format(compute=compute, claims=claims, head=head))
    return path


@pytest.fixture
def run(tmp_path):
    return ScriptRun("study", tmp_path, quick=True)


def test_a_name_is_taken_once_in_a_session(run):
    """Two names of one file, a name again, and those of files that every run writes."""
    with refused("conflict", "angle_10_deg"):
        run.parts("angle", {"-10 deg": lambda: {"n": -1}, "+10 deg": lambda: {"n": 1}})
    run.part("fit", lambda: {"n": 1})
    with refused("conflict", "fit"):
        run.part("fit", lambda: {"n": 2})
    with refused("conflict", "seconds"):
        run.part("seconds", lambda: {"n": 2})


def test_arrays_of_a_part_have_the_name_of_stage_and_part(run):
    run.parts("angle", {"-10 deg": lambda: ({"n": 1}, {"a": np.arange(3)})})
    assert run.load_arrays("angle -10 deg")["a"].tolist() == [0, 1, 2]


@pytest.mark.parametrize(
    ("claims", "verdict"),
    [('yield True, "no"', CLAIM_HOLDS), ('yield False, "no"', CLAIM_FAILED), ("return iter(())", CLAIM_FAILED)],
)
def test_what_is_not_judged_does_not_hold(tmp_path, claims, verdict):
    assert bs.run(written(tmp_path, claims=claims), tmp_path / "run").verdict == verdict


@pytest.mark.parametrize("claims", ['yield "it is not", False', 'yield float("nan"), "it is not"'])
def test_a_claim_that_is_none_is_refused(tmp_path, claims):
    with refused("value", "claims"):
        bs.run(written(tmp_path, claims=claims), tmp_path / "run")
    assert json.loads((tmp_path / "run" / "numbers.json").read_text()) == {}


def test_only_a_reason_alone_skips(tmp_path):
    found = [
        bs.run(written(tmp_path, compute), tmp_path / f"run_{k}").verdict
        for k, compute in enumerate(('return {"skipped": "no data"}', 'return {"skipped": 0, "mean": 5}'))
    ]
    assert found == [SKIPPED, CLAIM_HOLDS]


def test_a_script_may_go_elsewhere_and_may_have_dataclasses(tmp_path, monkeypatch):
    """Results stay in the folder that was named, and annotations may be texts."""
    (tmp_path / "away").mkdir()
    head = f"import os\nfrom dataclasses import dataclass\n\nos.chdir({str(tmp_path / 'away')!r})\n"
    head = f"from __future__ import annotations\n\n{head}\n\n@dataclass\nclass One:\n    n: int\n\n"
    path = written(tmp_path, 'return {"n": One(2).n}', head=head)
    monkeypatch.chdir(tmp_path)
    assert bs.run(path, "run").verdict == CLAIM_HOLDS
    assert json.loads((tmp_path / "run" / "numbers.json").read_text()) == {"n": 2}


def test_a_damaged_part_is_named(run):
    (run.folder / "fit.json").write_text('{"n": ')
    with refused("format", "fit.json"):
        run.part("fit", lambda: {"n": 1})


def test_modules_beside_scripts_are_no_studies(tmp_path):
    written(tmp_path)
    (tmp_path / "helper.py").write_text('"""What scripts share."""\n\n\ndef area(r):\n    return r * r\n')
    assert runs.study_files(tmp_path) == [tmp_path / "study.py"]


def test_braces_in_a_caption_are_no_place(tmp_path):
    path = written(tmp_path, head="FIGURES = {'ends_*': \"Where N'_{uv} of {} ends.\"}\n")
    text = path.read_text().replace("    pass\n", "    for file in run.figure('ends_of_it'):\n        file.touch()\n")
    path.write_text(text)
    assert bs.run(path, tmp_path / "run").verdict == CLAIM_HOLDS
    assert "Where N'_{uv} of of it ends." in (tmp_path / "run" / "study.md").read_text()
