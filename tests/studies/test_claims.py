"""The committed numbers bear out the claims of their studies, and what draws from numbers alone draws again."""

import json
import shutil
from pathlib import Path

import pytest

from bayesub.study import script

ROOT = Path(__file__).parents[2]
STUDIES = ("calibration", "criticism", "cross_check", "known_coefficients", "rounded", "rounding", "sampler")
pytestmark = pytest.mark.skipif(not (ROOT / "figures").is_dir(), reason="figures are not part of a source distribution")


@pytest.mark.parametrize("name", STUDIES)
def test_claims_hold_of_the_committed_numbers(name):
    numbers = json.loads((ROOT / "figures" / name / "numbers.json").read_text())
    claims = list(script.load(ROOT / "studies" / f"{name}.py").claims(numbers))
    assert claims
    assert [sentence for holds, sentence in claims if not holds] == []


@pytest.mark.parametrize("name", ["criticism", "sampler"])
def test_a_committed_run_is_drawn_again(name, tmp_path):
    """The page says the same, and every figure is there."""
    committed = ROOT / "figures" / name
    shutil.copy(committed / "numbers.json", tmp_path)
    assert script.redraw(ROOT / "studies" / f"{name}.py", tmp_path, quick=False) == ""
    assert (tmp_path / f"{name}.md").read_text() == (committed / f"{name}.md").read_text()
    assert {file.name for file in tmp_path.glob("*.png")} == {file.name for file in committed.glob("*.png")}
