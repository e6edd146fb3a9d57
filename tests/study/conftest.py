"""Reports that draw one figure and fly few boats, for tests of what a run keeps and how it goes on."""

from dataclasses import replace

import pytest
from support.small_study import leave_empty

from bayesub.findings import derived
from bayesub.report import report


@pytest.fixture
def draw_only(monkeypatch):
    """draw_only(names): from now on reports draw the figures of these names, and the files of others are empty."""
    figures = report.figures

    def patch(*names):
        def few(*given):
            return (f if f.name in names else replace(f, draw=leave_empty) for f in figures(*given))

        monkeypatch.setattr(report, "figures", few)
        monkeypatch.setattr(derived, "N_DRAWS", 16)

    return patch


@pytest.fixture
def few_figures(draw_only):
    """A report draws one small picture only, the quickest."""
    draw_only("forest_small")
