"""Faults in the code that a study brings: one line that names file, line and function, and no traceback."""

from pathlib import Path

import pytest

SCRIPT = '''"""Is it?

Question: is it?
Claim: yes.
"""
{top}

def compute(run):
    {compute}


def draw(run, numbers):
    pass


def claims(numbers):
    return {claims}
'''
HOLDS = '[(True, "yes")]'


def script(folder, compute="return {}", claims=HOLDS, top=""):
    (folder / "s.py").write_text(SCRIPT.format(compute=compute, claims=claims, top=top))
    return folder / "s.py"


def test_a_fault_is_one_line_and_its_traceback_a_file(bayesub, tmp_path):
    path = script(tmp_path, 'return {"a": 1 / 0}')
    status, _, err = bayesub("run", path, "-o", tmp_path / "run")
    (line,) = [one for one in err.splitlines() if one.startswith("bayesub:")]
    assert status == 1
    assert "Traceback" not in err
    assert f"{path}, line 9, in compute: ZeroDivisionError: division by zero" in line
    kept = Path(line.rpartition(" in ")[2])
    assert "Traceback" in kept.read_text()
    kept.unlink()


def test_a_claim_of_another_form_is_one_line(bayesub, tmp_path):
    status, _, err = bayesub("run", script(tmp_path, claims='{"yes": True}'), "-o", tmp_path / "run")
    line = err.splitlines()[-1]
    assert status == 1
    assert "ValueError" in line
    Path(line.rpartition(" in ")[2]).unlink()


@pytest.mark.parametrize("code", ["0", "1", "'done'"])
@pytest.mark.parametrize("place", ["top", "compute"])
def test_code_that_ends_python_is_no_success(code, place, bayesub, tmp_path):
    path = script(tmp_path, **{place: f"import sys; sys.exit({code})"})
    status, _, err = bayesub("run", path, "-o", tmp_path / "run")
    assert status == 2
    assert f"sys.exit({code})" in err.splitlines()[-1]


@pytest.mark.parametrize("numbers", ["3", "None", "[]"])
def test_numbers_of_a_script_may_be_anything(numbers, bayesub, tmp_path):
    status, out, _ = bayesub("run", script(tmp_path, f"return {numbers}"), "-o", tmp_path / "run")
    assert (status, out.splitlines()[-1]) == (0, "CLAIM HOLDS")


def test_a_run_folder_is_no_folder_of_studies(bayesub, tmp_path):
    bayesub("run", script(tmp_path), "-o", tmp_path / "runs" / "s")
    status, _, err = bayesub("run", tmp_path / "runs" / "s")
    assert (status, err.count("\n")) == (2, 1)
    assert "--resume" in err
    assert not (tmp_path / "runs" / "index.html").exists()
