"""Reports that draw one figure, for tests of what a run keeps and how it goes on."""

from dataclasses import replace

import pytest

from bayesub.report import report


def leave_empty(paths):
    """Files in place of a figure that no test looks at."""
    for path in paths:
        path.write_bytes(b"")


@pytest.fixture
def draw_only(monkeypatch):
    """draw_only(name): from now on reports draw the figure of that name, and the files of others are empty."""
    figures = report.figures

    def patch(name):
        def few(*given):
            return (f if f.name == name else replace(f, draw=leave_empty) for f in figures(*given))

        monkeypatch.setattr(report, "figures", few)

    return patch


@pytest.fixture
def few_figures(draw_only):
    """A report draws the spectrum only, the quickest."""
    draw_only("spectrum")
