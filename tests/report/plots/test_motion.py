"""Predicted motions and compared posteriors: nothing of a legend is beyond its figure, whatever the names."""

import numpy as np
import pytest

from bayesub.findings.predicted_trial import STATES, predicted_motion
from bayesub.report.plots import coefficients, motion, style

NAMES = ["short", "a_name_of_a_run_that_is_as_long_as_people_make_them", *(f"another_run_{k}" for k in range(5))]


@pytest.fixture
def figures(monkeypatch):
    """Figures that were drawn, in place of their files."""
    drawn = []
    monkeypatch.setattr(style, "save", lambda figure, _: drawn.append(figure))
    return drawn


@pytest.fixture
def motions(rng):
    """Tracks that go ten times as far north as east, by as many runs as there are colours."""
    times = np.linspace(0.0, 100.0, 40)
    states = 0.1 * rng.standard_normal((40, len(times), len(STATES)))
    states[:, :, 0] += 10.0 * times
    states[:, :, 1] += 50.0 * np.sin(times / 20.0)
    one = predicted_motion(times, states)
    some = enumerate(zip(NAMES, coefficients.RUNS, strict=True))
    return [motion.Drawn(name, colour, one, (0.9,), turn=(k, len(NAMES))) for k, (name, colour) in some]


def inside(figure):
    """Whether the legend is within the figure when it is laid out."""
    figure.draw_without_rendering()
    (legend,) = figure.legends
    box, whole = legend.get_window_extent(), figure.bbox
    return whole.x0 <= box.x0 and box.x1 <= whole.x1 and whole.y0 <= box.y0 and box.y1 <= whole.y1


def test_a_legend_of_long_names_is_whole(figures, motions):
    motion.draw_track("track.png", motions)
    numbers = {"ratios": [0.8, 0.9, 1.0, 1.1, 1.2], "prior_ratios": [0.5, 1.5], "contraction": 0.3}
    coefficients.draw_runs("coefficients.png", [("Xuu", dict.fromkeys(NAMES, numbers))], NAMES)
    assert [inside(figure) for figure in figures] == [True, True]
    assert [text.get_text() for text in figures[0].legends[0].get_texts()] == [
        f"{name}, 90 %, median" for name in NAMES
    ]


def test_lines_that_are_the_same_are_all_seen(motions):
    """The dashes of each cover a part of their period that those of no other do, and the first is whole below them."""
    first, *others = [line.line for line in motions]
    assert first["ls"] == "-"
    period = {sum(line["ls"][1]) for line in others}
    assert len(period) == 1
    starts = sorted((-line["ls"][0]) % next(iter(period)) for line in others)
    on = others[0]["ls"][1][0]
    assert (np.diff([0.0, *starts]) >= on).all()  # the first of the period is that of the first line
    assert starts[-1] + on <= next(iter(period))


def test_a_track_gives_its_figure_its_shape(figures, motions):
    """Ten times as far north as east."""
    motion.draw_track("track.png", motions[:1])
    width, height = figures[0].get_size_inches()
    assert 3.0 < width < height < 6.0
