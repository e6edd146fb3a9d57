"""Scripts import what lies beside them, wherever they are run, and it counts among what a run depends on."""

import json
import os
import subprocess
import sys
from functools import partial

import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.campaign import beside
from bayesub.campaign.executors import Processes
from bayesub.study import sources
from bayesub.study.run import script

STUDY = '''"""Are modules found?

Claim: yes.
"""
from functools import partial

import squares
from mine import Number, tables
from mine.deep import twice


def compute(run):
    numbers = run.in_processes(squares.squared, [Number(k) for k in range(3)])
    assert all(isinstance(number, Number) for number in numbers)
    parts = run.parts("sums", {"one": partial(summed, [1, 2])})
    return {"squares": [number.value for number in numbers], "sum": parts["one"]["sum"], "title": tables.title()}


def summed(numbers):
    return {"sum": twice(sum(numbers))}


def draw(run, numbers): ...


def claims(numbers):
    yield numbers["squares"] == [0, 1, 4] and numbers["sum"] == 6, "no"
'''
FILES = {
    "study.py": STUDY,
    "squares.py": """from functools import cache

from mine import Number


@cache
def squared(number):
    return Number(number.value**2)
""",
    "mine/__init__.py": """from dataclasses import dataclass


@dataclass(frozen=True)
class Number:
    value: int
""",
    "mine/tables.py": """from pathlib import Path


def title():
    return Path(__file__).with_name("words.toml").read_text()
""",
    "mine/words.toml": "word = 1",
    "mine/deep.py": "from .deeper import double as twice",
    "mine/deeper.py": "def double(x): return 2 * x",
    "mine/unused.py": "raise RuntimeError",
    "other.py": "raise RuntimeError",
    "study/boat.toml": "length_m = 7.0",  # which the script reads by its own name
}


@pytest.fixture
def study(tmp_path):
    """A script with modules beside it."""
    for name, text in FILES.items():
        file = tmp_path / "beside" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    return tmp_path / "beside" / "study.py"


def test_those_that_are_imported_and_data_of_their_packages_are_files_of_a_script(study):
    names = ["mine/__init__.py", "mine/deep.py", "mine/deeper.py", "mine/tables.py", "mine/words.toml", "squares.py"]
    names += ["study/boat.toml"]
    assert list(sources.beside(study)) == names


@pytest.mark.parametrize("name", ["squares.py", "mine/deeper.py", "mine/words.toml", "study/boat.toml"])
def test_a_change_of_one_makes_a_run_stale(study, tmp_path, name):
    """It is not resumed, and not drawn again unless the script is named; files that nobody imports do not count."""
    bs.run(study, tmp_path / "run")
    (study.parent / "other.py").write_text("")
    (study.parent / "mine" / "unused.py").write_text("")
    (study.parent / "squares.py").write_text("# a comment\n" + FILES["squares.py"].replace(" cache\n", " cache\n\n\n"))
    study.write_text(STUDY.replace("Claim: yes", "Claim: certainly").replace("def draw", "# it\n\ndef draw"))
    bs.run(study, tmp_path / "run", resume=True)
    with (study.parent / name).open("a") as file:
        file.write("\nother = 2\n")
    with refused("state", "--resume"):
        bs.run(study, tmp_path / "run", resume=True)
    config = script.Script(study).config()
    with refused("state", "--study"):
        script.redraw(tmp_path / "run", config | {"files_sha256": dict.fromkeys(config["files_sha256"], "")}, None)


def test_processes_of_this_machine_import_them(study, tmp_path):
    """Those that have run another study with modules of the same names, or of one of them, too."""
    executor = Processes(2)
    former = tmp_path / "former" / "mine.py"
    former.parent.mkdir()
    former.write_text("")
    script.load(former)
    assert bs.run(study, tmp_path / "run", executor=executor).verdict == "claim holds"
    other = tmp_path / "other" / "study.py"
    for name, text in FILES.items():
        file = other.parent / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text.replace("**2", "**3"))
    assert bs.run(other, tmp_path / "cubes", executor=executor).verdict == "claim failed"
    assert json.loads((tmp_path / "cubes" / "numbers.json").read_text())["squares"] == [0, 1, 8]
    assert bs.run(study, tmp_path / "again", executor=executor).verdict == "claim holds"


def test_a_script_may_load_one_of_another_folder(study, tmp_path):
    """While it is loaded itself: where the order of folders changes, scripts are no modules that are forgotten."""
    other = tmp_path / "other" / "outer.py"
    other.parent.mkdir()
    call = f"from bayesub.study.run.script import load\nOTHER = load(__import__('pathlib').Path({str(study)!r}))\n"
    data = "from dataclasses import dataclass\n@dataclass\nclass Own: number: 'int' = 3\n"
    other.write_text(f"from __future__ import annotations\n{call}{data}")
    assert script.load(other).Own().number == 3


def test_by_value_they_need_no_folder(study, tmp_path):
    """Another process does what functions of them do, without being able to import them."""
    module = script.load(study)
    file = tmp_path / "work"
    for work in (partial(module.summed, [1, 2]), partial(module.squares.squared, module.Number(3))):
        file.write_bytes(beside.by_value()(work))
        code = f"import pickle, sys; print(pickle.load(open({str(file)!r}, 'rb'))(), 'mine' in sys.modules)"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
        assert done.stdout in ("{'sum': 6} False\n", "Number(value=9) False\n")


def test_from_any_folder(study):
    """By the command, and as a script of Python."""
    given = {
        "capture_output": True,
        "text": True,
        "cwd": study.parents[1],
        "check": False,
        "env": os.environ | _no_path(),
    }
    command = [sys.executable, "-m", "bayesub", "run", "beside/study.py", "-o", "run"]
    done = subprocess.run(command, **given)
    assert (done.returncode, done.stdout.splitlines()[-1]) == (0, "CLAIM HOLDS"), done.stderr
    assert subprocess.run([sys.executable, "beside/study.py"], **given).returncode == 0


def _no_path():
    """Nothing but bayesub can be imported, wherever it is."""
    return {"PYTHONPATH": os.path.dirname(os.path.dirname(bs.__file__))}  # noqa: PTH120


@pytest.mark.cluster
def test_workers_of_a_cluster_get_them(study, tmp_path, bayesub):
    pytest.importorskip("distributed")
    status, out, err = bayesub("run", study, "-o", tmp_path / "run", "--dask", "local:2")
    assert status == 0, err
    assert out.splitlines()[-1] == "CLAIM HOLDS"
