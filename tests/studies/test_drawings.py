"""Pictures of the committed runs, drawn again from their numbers: all that is written in them can be read."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from support.layout import WrittenTexts

from bayesub.report.plots import style
from bayesub.study.run import script
from posteriors import plots as posteriors

pytestmark = pytest.mark.rendered
ROOT = Path(__file__).parents[2]
STUDIES = ("criticism", "explanations", "how_many_terms", "other_engines", "other_equations")
committed = pytest.mark.skipif(not (ROOT / "figures").is_dir(), reason="figures are not part of a source distribution")


@pytest.fixture
def texts(monkeypatch):
    return WrittenTexts(monkeypatch)


def test_texts_that_cannot_be_read_are_found(texts, tmp_path):
    """A word on another, one that begins outside, and labels that are turned and only their boxes cross."""
    with style.figure(tmp_path / "figure.png", 4.0, 3.0, (0.5, 0.1, 1.2, 0.1)) as figure:
        axis = figure.subplots()
        axis.text(0.50, 0.5, "one")
        axis.text(0.52, 0.5, "two")
        axis.text(-0.3, 0.9, "outside")
        axis.set_xticks([0.5, 0.6, 0.7], ["a long name", "a long name too", "another"], rotation=70, ha="right")
    assert texts.unreadable() == ["'outside' leaves the canvas", "'one' overlaps 'two'"]


@committed
@pytest.mark.parametrize("name", STUDIES)
def test_nothing_that_is_written_is_cut_or_covered(name, tmp_path, texts):
    study = script.load(ROOT / "studies" / f"{name}.py")
    run = SimpleNamespace(figure=lambda stem: [tmp_path / f"{stem}.png"], page=list, quick=False)
    study.draw(run, json.loads((ROOT / "figures" / name / "numbers.json").read_text()))
    assert texts.texts
    assert texts.unreadable() == []
    assert {f"{file.stem}" for file in tmp_path.glob("*.png")} <= set(study.FIGURES)


def test_scatter_of_all_cases_is_one_panel_with_names_at_its_lines(tmp_path, texts):
    """Groups that end at one height have names below each other; null directions stand in a panel of their own."""
    values, null = np.array([1e4, 1e2, 1.0, 1e-2, 1e-9]), np.array([False] * 4 + [True])
    groups = {"exact": ("SQP, exact track", "o", "#D55E00"), "posterior": ("posterior", "x", "#0072B2")}
    cases = {name: (values, null, {group: 1.0 / np.hypot(1.0, values) for group in groups}) for name in "ab"}
    posteriors.draw_scatter(tmp_path / "scatter.png", cases, groups)
    assert texts.unreadable() == []
    assert {"SQP, exact track", "posterior", "data and prior, linear", "null\ndirections"} <= {
        t[1] for t in texts.texts
    }
