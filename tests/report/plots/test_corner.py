"""The corners and the strip of pairs: what they choose, and that contours and points are where they are said to be."""

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.colors import same_color
from matplotlib.figure import Figure

from bayesub.model.coefficients import EQUATIONS
from bayesub.problem.distributions import Normal
from bayesub.report.plots import corner, style
from bayesub.report.plots.coefficients import Found

NAMES = ("Xuu", "Yuv", "Nuv")
REFERENCE = np.array([1.0, 2.0, -4.0])


def correlation_of(n, pairs):
    """A matrix (n, n) with these correlations of pairs of positions."""
    matrix = np.eye(n)
    for i, j, value in pairs:
        matrix[i, j] = matrix[j, i] = value
    return matrix


def posterior_of(draws):
    return SimpleNamespace(names=NAMES, draws=draws)


def test_what_trades_off_is_chosen_strongest_pairs_first():
    pairs = [(2 * k, 2 * k + 1, 0.95 - 0.1 * k) for k in range(8)]
    some = correlation_of(20, pairs)
    assert list(corner.strong_pairs(some)) == [(2 * k, 2 * k + 1) for k in range(7)]  # those of 0.3 and more
    assert corner.trading(some).tolist() == list(range(corner.PARAMETERS))
    assert corner.trading(np.eye(5)).tolist() == []
    # A pair that has no room leaves it to one that shares a parameter with what is there.
    crowded = correlation_of(20, [*((2 * k, 2 * k + 1, 0.9) for k in range(3)), (0, 6, 0.8), (7, 8, 0.7), (1, 9, 0.6)])
    assert corner.trading(crowded).tolist() == [0, 1, 2, 3, 4, 5, 6, 9]


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.999, -0.99999])
def test_contours_hold_the_shares_of_draws_that_they_say(rho):
    """Also of a blade: smoothing by a cell widens a cloud by 3 % at most, by its own standard deviations."""
    factor = np.array([[0.2, 0.0], [0.1 * rho, 0.1 * np.sqrt(1.0 - rho**2)]])
    points = 0.5 + np.random.default_rng(0).standard_normal((20_000, 2)) @ factor.T
    axis = Figure().subplots()
    corner.contours(axis, points)
    areas = [path for filled in axis.collections for path in filled.get_paths()]
    (filled,) = axis.collections
    axis.figure.draw_without_rendering()
    wide, narrow = filled.get_facecolor()
    assert same_color(narrow, style.POSTERIOR)
    assert not same_color(narrow, wide)
    shares = sorted(path.contains_points(points).mean() for path in areas)
    wider = [1.0 - (1.0 - share) ** 1.03**2 for share in corner.SHARES]
    for measured, share, limit in zip(shares, corner.SHARES, wider, strict=True):
        assert share - 0.01 < measured < limit + 0.01


def test_what_is_constant_is_drawn_without_a_warning(tmp_path):
    draws = REFERENCE * (1.0 + 0.1 * np.random.default_rng(0).standard_normal((500, 3)))
    draws[:, 1] = 2.0
    prior = Normal(REFERENCE, 0.2 * np.abs(REFERENCE))
    corner.draw(tmp_path / "corner.png", posterior_of(draws), prior, REFERENCE, EQUATIONS, chosen=np.arange(3))
    corner.draw_pairs(tmp_path / "pairs.png", posterior_of(draws), prior, REFERENCE, EQUATIONS, [(0, 1), (0, 2)])


def test_number_and_picture_of_a_pair_have_one_sign(tmp_path, drawings):
    """Of coefficients of unlike sign: what falls as ratios has a negative number in its title, and in its corner."""
    rng = np.random.default_rng(0)
    common, own = 0.1 * rng.standard_normal((2, 2000, 1))
    ratios = 1.0 + np.hstack([own, common, -common + 0.1 * own])
    prior = Normal(REFERENCE, 0.2 * np.abs(REFERENCE))
    posterior = posterior_of(ratios * REFERENCE)
    corner.draw_pairs(tmp_path / "pairs.png", posterior, prior, REFERENCE, EQUATIONS, [(1, 2)])
    corner.draw(tmp_path / "corner.png", posterior, prior, REFERENCE, EQUATIONS, chosen=np.array([1, 2]))
    rho = np.corrcoef(ratios.T)[1, 2]
    assert rho < -0.9
    assert drawings[0].axes[0].get_title() == rf"$\rho$ = {rho:+.2f}".replace("-", "\u2212")
    assert f"{rho:.2f}".replace("-", "\u2212") in [text.get_text() for text in drawings[1].axes[0].texts]


def test_solutions_that_do_not_fit_are_hollow_and_those_beyond_do_not_stretch_the_axes(tmp_path, drawings):
    draws = REFERENCE * (1.0 + 0.1 * np.random.default_rng(0).standard_normal((2000, 3)))
    ratios = np.array([[1.0, 1.1, 1.0], [1.0, 0.9, 1.0], [1.0, 9.0, 1.0]])
    good = np.array([True, False, True])
    found = Found("SQP, 3 starts: 2 fit", ratios * REFERENCE, good, np.tile(good[:, None], 3))
    prior = Normal(REFERENCE, 0.2 * np.abs(REFERENCE))
    arguments = posterior_of(draws), prior, REFERENCE, EQUATIONS
    corner.draw_pairs(tmp_path / "pairs.png", *arguments, [(0, 1)], [found])
    (axis,) = drawings[0].axes
    assert axis.get_ylim()[1] < 2.0
    points = {line.get_marker(): line for line in axis.lines if len(line.get_xdata()) and line.get_marker() in "o^"}
    shown = [line for line in axis.lines if line.get_marker() == "o"]
    assert [same_color(line.get_markerfacecolor(), style.SQP) for line in shown] == [True, False]
    assert 0.9 < points["^"].get_ydata()[0] < 1.0  # at the upper edge, in the axis's own units
    words = [text.get_text() for text in drawings[0].legends[0].get_texts()]
    assert {"hollow: no fit, or at a bound", "arrow: beyond the axes (1)", found.label} <= set(words)
