"""Numbers in figures, and what is drawn of a posterior."""

import numpy as np
import pytest

from bayesub.report.plots import style, trade_offs


@pytest.mark.parametrize(
    ("value", "text"), [(0.0, "0"), (0.68, "0.68"), (4.2e-4, r"$4\times10^{-4}$"), (5.3e5, r"$5\times10^{5}$")]
)
def test_powers_of_ten_are_written_as_in_print(value, text):
    assert style.power(value) == text


def test_only_strong_correlations_are_drawn():
    correlation = np.eye(8)
    correlation[1, 5] = correlation[5, 1] = -0.4
    correlation[2, 3] = correlation[3, 2] = 0.29
    names, block = trade_offs.strong_block(tuple("abcdefgh"), correlation)
    assert names == ["b", "f"]
    np.testing.assert_array_equal(block, [[1.0, -0.4], [-0.4, 1.0]])
    assert len(trade_offs.strong_block(tuple("abcdefgh"), np.eye(8))[0]) == 8
    assert len(trade_offs.strong_block(tuple("abc"), np.eye(3))[0]) == 3
