import pytest

from bayesub.report.plots import style


@pytest.fixture
def drawings(monkeypatch):
    """The figures that are made."""
    figures = []
    make = style.Figure
    monkeypatch.setattr(style, "Figure", lambda **options: figures.append(make(**options)) or figures[-1])
    return figures
