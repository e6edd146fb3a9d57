"""Intervals of coefficients: what is known best is seen too."""

from types import SimpleNamespace

import numpy as np
from matplotlib.colors import same_color
from matplotlib.figure import Figure
from scipy import special

from bayesub.report.plots import coefficients, style


def test_the_median_of_a_narrow_box_is_drawn_and_not_left_white():
    sds = np.array([0.2, 1e-4])
    quantiles = 1.0 + special.ndtri(coefficients.QUANTILES)[:, None] * sds
    prior = SimpleNamespace(sd=np.full(2, 0.25), quantiles=lambda p: 1.0 + 0.25 * special.ndtri(p) * np.ones(2))
    axis = Figure().subplots()
    coefficients.intervals(axis, np.arange(2), quantiles, prior, np.ones(2))
    wide, narrow = (line for line in axis.lines if line.get_marker() == "|")
    assert same_color(wide.get_color(), "white")
    assert same_color(narrow.get_color(), style.POSTERIOR)
    assert [line.get_ydata().tolist() for line in (wide, narrow)] == [[0], [1]]
