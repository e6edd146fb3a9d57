"""What is below the edge of a figure."""

import numpy as np
from matplotlib.figure import Figure

from thesis.plots.floors import above_floor


def test_what_is_below_a_floor_is_an_arrow_and_no_datum():
    panel = Figure().subplots()
    values = above_floor(panel, [1, 2, 3], [1e-3, 1e-12, 1e-15], 1e-9, "k")
    np.testing.assert_array_equal(values, [1e-3, np.nan, np.nan])
    (arrows,) = panel.lines
    assert list(arrows.get_xdata()) == [2, 3]
    assert above_floor(Figure().subplots(), [1], [1.0], 1e-9, "k") == [1.0]
