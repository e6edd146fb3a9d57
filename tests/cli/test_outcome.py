"""The last lines of a run."""

import json
from dataclasses import replace

import pytest

from bayesub.cli import run
from bayesub.findings.verdicts import DOES_NOT_FIT, FITS, MEANING
from bayesub.io import terminal
from bayesub.study.run.result import NUMBERS, SUGGESTED, StudyResult

MISFIT = "The model does not fit (18 tests). " + "Residuals follow from those before them, " * 20
GLANCE = {
    "boat": [
        {"name": "tactical_diameter_m", "label": "tactical diameter", "unit": "m", "posterior": ["650.4", "650.9"],
         "prior": ["320", "810"]},
        {"name": "zigzag_overshoot_deg", "label": "zigzag overshoot", "unit": "deg", "posterior": ["3.5", "3.6"],
         "prior": ["2", "17"]},
    ],
    "stable": [{"where": "on a straight course", "posterior": 1.0, "prior": 0.5225}],
    "known": [{"name": f"Coefficient{k}", "percent": 0.1 * k} for k in range(40)],
    "n_coefficients": 83,
    "n_sharper": 40,
    "n_untouched": 3,
    "n_null": 3,
    "n_faint": 1,
    "hold": ["Yvdot", "Nvdot", "Nrdot"],
    "pairs": [{"pair": ["Nuv", f"Coefficient{k}"], "correlation": -0.99} for k in range(30)],
    "n_pairs": 100,
    "marks": [
        {"topic": "sampling", "good": True, "word": "converged", "text": "R-hat 1.0014, ESS 3527"},
        {"topic": "fit", "good": True, "word": "fits", "text": "The residuals look like noise."},
    ],
}  # fmt: skip


@pytest.fixture(params=[80, 100, 200])
def told(request, tmp_path, monkeypatch, capsys):
    """Tells the result of a run at a width; gives the lines."""
    monkeypatch.setattr(terminal.console, "width", request.param)
    monkeypatch.setattr(terminal.console, "quiet", False)  # whatever command ran before
    sentences = {"fit": MISFIT, "lines_to_add": "[nuisance]\nbias_x_m = 1"}
    result = StudyResult("quickstart", "What?", FITS, str(tmp_path / "run"), 34.0, sentences=sentences)

    def tell(glance=GLANCE, verbose=False, **changes):
        (tmp_path / "run").mkdir(exist_ok=True)
        numbers = {"vehicle": "suboff", "manoeuvre": "horizontal", "n_readings": 1800, "glance": glance}
        (tmp_path / "run" / NUMBERS).write_text(json.dumps(numbers))
        run.tell(replace(result, **changes), verbose=verbose)
        return capsys.readouterr().out.splitlines()

    return tell


def lines_of(lines, topic):
    """The words of a topic."""
    (first,) = [k for k, line in enumerate(lines) if line.startswith(f"  {topic}  ")]
    return " ".join([lines[first][16:], *(line[16:] for line in lines[first + 1 :] if line.startswith(" " * 16))])


def test_a_run_ends_in_twelve_lines_within_the_width(told, tmp_path):
    """Whatever the number of coefficients and pairs; commands and paths are whole."""
    lines = told()
    assert len(lines) <= 12
    assert lines[-1] == "CONVERGED AND FITS"
    folder = tmp_path / "run"
    assert f"  next          bayesub predict {folder} zigzag_20_20 -o {folder}_predicted" in lines
    assert all(len(line) <= terminal.width() for line in lines if str(folder) not in line)
    assert lines_of(lines, "boat").startswith("tactical diameter  650.4 .. 650.9 m  (before 320 .. 810)")
    assert lines_of(lines, "not unique ") == "3 combinations, 1 more nearly; hold Yvdot, Nvdot, Nrdot"
    assert " more" in lines_of(lines, "coefficients").partition("40 better")[0]


def test_an_answer_that_is_not_to_be_used_is_not_said(told, tmp_path):
    """What is wrong is, in part, and what to run next; every sentence comes before it if that is asked for."""
    bad = {"topic": "fit", "good": False, "word": "does not fit", "text": MISFIT}
    glance = GLANCE | {"marks": [GLANCE["marks"][0], bad]}
    changes = {"verdict": DOES_NOT_FIT, "text": MEANING[DOES_NOT_FIT]}
    lines = told(glance, **changes)
    assert len(lines) <= 12
    assert "tactical" not in "".join(lines)
    assert lines_of(lines, "fit         ").startswith("The model does not fit. Residuals follow")
    assert lines[-1].startswith("DOES NOT FIT: ")
    assert lines[-2] == "  next          bayesub manual troubleshooting"
    (tmp_path / "run" / SUGGESTED).touch()
    lines = told(glance, verbose=True, **changes)
    assert lines[-2].startswith(f"  next          bayesub run {tmp_path / 'run' / SUGGESTED} -o ")
    assert "bias_x_m = 1" in lines  # to paste
    assert "".join(lines).count("before them,") == pytest.approx(20, abs=12)
