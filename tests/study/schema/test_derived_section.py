"""Quantities of a study's own: functions in Python beside the study, and one line for each that is wrong."""

import hashlib

import numpy as np
import pytest
from support import small_study
from support.refusals import refused

import bayesub as bs
from bayesub.model.boats import Boats
from bayesub.study.schema.study_file import DerivedSection, load_study

OWN = '''
import numpy as np

import bayesub as bs


def heading_deg(boats):
    """Heading after two minutes of a turning circle."""
    circle = bs.load_manoeuvre("turning_circle", boats.vehicle)
    return np.degrees(boats.fly(circle, np.array([120.0]), dt=1.0)[:, -1, 5])


def fails(boats):
    raise ValueError("no\\nway")


def single(boats):
    return 1.0
'''


@pytest.fixture
def own(tmp_path):
    (tmp_path / "own.py").write_text(OWN)
    return lambda function, name="my_heading_deg": DerivedSection(name=name, function=function).build(
        bs.load_vehicle("suboff"), lambda file: str(tmp_path / file), run_code=True
    )


def test_a_function_is_called_with_all_boats_at_once(own):
    boat = bs.load_vehicle("suboff")
    values = own("own.py:heading_deg").of(Boats(boat, boat.xi * np.array([[1.0], [1.02]])))
    flown = bs.simulate(boat, bs.load_manoeuvre("turning_circle", boat), dt=1.0, sample=60.0)
    assert values[0] == pytest.approx(np.degrees(flown.outputs(("psi",))[0, 2, 0]), rel=1e-9)
    assert values.shape == (2,)
    assert values[1] != values[0]


@pytest.mark.parametrize(
    ("function", "name", "kind", "key"),
    [
        ("own.py:headin_deg", "a_deg", "unknown", "derived.function"),
        ("own.py:fails", "a_deg", "value", "own.py:fails"),
        ("own.py:single", "a_deg", "value", "own.py:single"),
        ("other.py:fails", "a_deg", "format", "derived.file"),
        ("own.py:single", "advance_m", "conflict", "advance_m"),
    ],
)
def test_what_is_wrong_is_one_line(own, function, name, kind, key):
    with refused(kind, key):
        own(function, name)


def _study(folder, *tables):
    folder.joinpath("own.py").write_text(OWN)
    path = small_study.write(
        folder / "study.toml",
        **small_study.SUBOFF | {"dt_s": None},
        name="own",
        manoeuvre="turning_circle",
        seed=1,
        sensors=[small_study.track(channels=["x", "y"], position_sd_m=1.0, interval_s=20.0)],
        free={"coefficients": ["Xuu", "Nuv"]},
        prior={"sd": 0.1},
        baselines={"sqp_starts": 0, "linear_least_squares": False},
        derived=tables,
    )
    return load_study(path)


TABLE = {"name": "my_heading_deg", "function": "own.py:heading_deg", "meaning": "Two minutes on."}


def test_a_run_keeps_the_function_and_draws_again_with_the_copy(tmp_path, few_figures):  # noqa: ARG001
    study = _study(tmp_path, TABLE)
    result = bs.run(study, tmp_path / "run")
    (tmp_path / "own.py").unlink()
    from bayesub.study.after.finished_run import redraw

    before = (tmp_path / "run" / "numbers.json").read_bytes()
    assert b'"my_heading_deg"' in before
    assert redraw(tmp_path / "run").sentences == result.sentences
    assert (tmp_path / "run" / "numbers.json").read_bytes() == before


@pytest.mark.slow
def test_no_code_of_a_run_folder_runs_unless_that_is_said(tmp_path, finished, monkeypatch, bayesub):
    """Values of derived quantities are kept; without them the refusal names the file and the option."""
    (tmp_path / "mine.py").write_text("def heading_deg(boats):\n    return boats.xi[:, 0]\n")
    path = small_study.write(
        tmp_path / "study.toml", **small_study.TINY, derived=[TABLE | {"function": "mine.py:heading_deg"}]
    )
    run = tmp_path / "run"
    small_study.run(path, run)
    (code,) = (run / "inputs").glob("*-mine.py")
    ran = tmp_path / "ran"
    code = _spoil(
        run,
        code,
        f"from pathlib import Path\nPath({str(ran)!r}).touch()\ndef heading_deg(boats): return boats.xi[:, 0]\n",
    )
    path.parent.joinpath("mine.py").write_text(code.read_text())
    other = finished()
    monkeypatch.chdir(tmp_path)
    predicted = ("predict run zigzag_20_20 -o p --draws 40", f"compare run {other} -o c --draws 40")
    for command in ("check study.toml", "report run", "export run -o k.toml", *predicted):
        status, _, error = bayesub(*command.split())
        assert status < 2, error
        assert not ran.exists(), command
    kept = (run / "derived.json").read_text()
    (run / "derived.json").write_text(kept.replace("[", "[ ", 1))  # noticed after the page was drawn again, too
    assert bayesub("report", "run")[0] == 2
    assert bayesub.error.key == "derived.json"
    (run / "derived.json").unlink()
    status, _, error = bayesub("report", "run")
    assert (status, error.count("\n")) == (2, 1)
    assert f"run/inputs/{code.name}" in error
    assert "--run-code" in error
    assert not ran.exists()
    status, _, error = bayesub("report", "run", "--run-code")
    assert status < 2, error
    assert ran.exists()


def _spoil(run, code, text):
    """What somebody may do to a run folder before passing it on: other code, with its digests."""
    config = (run / "config.toml").read_text()
    before = hashlib.sha256(code.read_bytes()).hexdigest()
    after = hashlib.sha256(text.encode()).hexdigest()
    (run / "config.toml").write_text(config.replace(before, after))
    small_study.forget_config(run)
    code.write_text(text)
    return code.rename(code.with_name(code.name.replace(before[:12], after[:12])))


def test_two_of_a_name_are_refused(tmp_path):
    with refused("conflict"):
        _study(tmp_path, TABLE, TABLE)
