"""Reports that draw one figure and fly few boats, for tests of what a run keeps and how it goes on; finished runs."""

from dataclasses import replace

import pytest

import bayesub as bs
from bayesub.plots import style
from bayesub.report import derived, report

TINY = """
name = "tiny"
vehicle = "auv690"
manoeuvre = "turning_circle"
seed = 1
dt_s = 0.4
[[sensors]]
kind = "track"
channels = ["x", "y", "yaw"]
position_sd_m = 0.2
attitude_sd_deg = 0.2
interval_s = 5.0
[free]
coefficients = ["Xuu", "Nuv", "Nuu_dr"]
[prior]
kind = "relative_normal"
sd = 0.25
[baselines]
linear_least_squares = false
sqp_starts = 1
[sampler]
max_steps = 5000
"""


def leave_empty(paths):
    """Files in place of a figure that no test looks at."""
    for path in paths:
        path.write_bytes(b'<svg viewBox="0 0 1 1"></svg>' if path.suffix == ".svg" else b"")


@pytest.fixture
def draw_only(monkeypatch):
    """draw_only(name): from now on reports draw the figure of that name, and the files of others are empty."""
    figures = report.figures

    def patch(name):
        def few(*given):
            return (f if f.name == name else replace(f, draw=leave_empty) for f in figures(*given))

        monkeypatch.setattr(report, "figures", few)
        monkeypatch.setattr(derived, "N_DRAWS", 16)

    return patch


@pytest.fixture
def few_figures(draw_only):
    """A report draws the spectrum only, the quickest."""
    draw_only("spectrum")


@pytest.fixture(scope="session")
def finished(tmp_path_factory):
    """finished(name, (old, new), ..): the folder of a run of TINY with parts of its text replaced, run once."""
    folder, done, figures = tmp_path_factory.mktemp("finished"), {}, report.figures

    def run(name, *changes):
        if name not in done:
            text = TINY.replace('"tiny"', f'"{name}"')
            for old, new in changes:
                assert old in text
                text = text.replace(old, new)
            (folder / f"{name}.toml").write_text(text)
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr(report, "figures", lambda *given: (replace(f, draw=leave_empty) for f in figures(*given)))
                patch.setattr(derived, "N_DRAWS", 16)
                bs.run(folder / f"{name}.toml", folder / name)
            done[name] = folder / name
        return done[name]

    return run


@pytest.fixture
def unrendered(monkeypatch):
    """Figures are drawn, and not rendered, which takes longest; their files are empty."""
    monkeypatch.setattr(style, "save", lambda _, paths: leave_empty(paths))
