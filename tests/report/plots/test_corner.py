"""The corner plots: what they choose, and that contours and lines are where they are said to be."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from bayesub.inference.identifiability.fisher import Spectrum
from bayesub.model.coefficients import EQUATIONS
from bayesub.problem.distributions import Normal
from bayesub.report.plots import corner, style

QUICKSTART = Path(__file__).parents[2] / "figures" / "quickstart" / "numbers.json"
NAMES = ("Xuu", "Yuv", "Yur", "Yvdot", "Nuv", "Nur")


def posterior_of(names, pairs, prior_sd=None):
    """What is asked of a posterior, with these correlations of pairs of names."""
    correlation = np.eye(len(names))
    for first, second, value in pairs:
        i, j = names.index(first), names.index(second)
        correlation[i, j] = correlation[j, i] = value
    return SimpleNamespace(names=tuple(names), correlation=correlation, prior_sd=prior_sd or np.ones(len(names)))


def chosen_names(posterior, null=()):
    return [posterior.names[k] for k in corner.trade_off_parameters(posterior, len(posterior.names), null)]


@pytest.mark.skipif(not QUICKSTART.is_file(), reason="figures are not part of a source distribution")
def test_the_corner_of_the_quickstart_shows_what_trades_off():
    """Its strongest pairs, which the best and the worst known coefficients leave out, and its null directions."""
    numbers = json.loads(QUICKSTART.read_text())
    names = [row["name"] for row in numbers["parameters"]]
    pairs = [(*trade["pair"], trade["correlation"]) for trade in numbers["trade_offs"]]
    null = [vector for axis in numbers["ranks"].values() for vector in axis["null_vectors"]]
    chosen = chosen_names(posterior_of(names, pairs, [row["prior_sd"] for row in numbers["parameters"]]), null)
    assert {"Nuv", "Nur", "Yuv", "Yur"} <= set(chosen)
    assert len(null) == numbers["spectrum"]["n_null"] == 3
    for vector in null:
        assert len(set(vector) & set(chosen)) >= 2
    assert len(chosen) == corner.PARAMETERS


def test_trade_offs_come_first_and_null_directions_have_their_places():
    names = [f"a{k}" for k in range(30)]
    pairs = [(f"a{2 * k}", f"a{2 * k + 1}", 0.99 - 0.01 * k) for k in range(8)]
    null = [{"a29": 1.0, "a28": 0.5, "a27": 0.1}, {"a26": 1.0}]
    assert chosen_names(posterior_of(names, pairs), null) == ["a0", "a1", "a2", "a3", "a26", "a27", "a28", "a29"]
    assert chosen_names(posterior_of(names, pairs)) == [f"a{k}" for k in range(8)]


def test_few_parameters_are_all_there():
    assert chosen_names(posterior_of(NAMES, [])) == list(NAMES)
    assert chosen_names(posterior_of(("Xuu",), [])) == ["Xuu"]


def test_directions_of_each_kind():
    """The first and the last; a kind without directions is left out."""
    values = np.array([1e4, 1e3, 1e2, 10.0, 2.0, 0.5, 0.1, 1e-14])
    some = Spectrum(tuple("abcdefgh"), values, np.eye(8), np.ones(8), 1, np.ones(8))
    assert [(kind, places) for kind, _, places in corner.choose_directions(some)] == [
        ("stiff", [0, 4]),
        ("sloppy", [5, 6]),
        ("null", [7]),
    ]
    all_stiff = Spectrum(("a", "b"), np.array([9.0, 3.0]), np.eye(2), np.ones(2), 0, np.ones(2))
    assert [(kind, places) for kind, _, places in corner.choose_directions(all_stiff)] == [("stiff", [0, 1])]


def test_a_null_direction_is_a_line_through_the_posterior_mean(tmp_path, monkeypatch):
    """In the panel of its two entries and in no other, with the slope of its entries as ratios."""
    figures = []
    make = style.Figure
    monkeypatch.setattr(style, "Figure", lambda **options: figures.append(make(**options)) or figures[-1])
    reference = np.array([1.0, 2.0, -4.0])
    draws = reference * (1.0 + 0.1 * np.random.default_rng(0).standard_normal((2000, 3)))
    posterior = SimpleNamespace(names=("Xuu", "Yuv", "Nuv"), draws=draws, correlation=np.eye(3), prior_sd=np.ones(3))
    prior = Normal(reference, 0.2 * np.abs(reference))
    null = ({"Yuv": 1.0, "Nuv": -0.5},)
    corner.draw(tmp_path / "corner.png", posterior, prior, reference, EQUATIONS, null=null)
    (axis,) = figures[0].axes
    (line,) = (line for line in axis.lines if line.get_color() == style.NULL and len(line.get_xdata()))
    x, y = line.get_data()
    assert (np.abs(x - 1.0 - 0.5 * corner.SIDE) <= 0.5 * corner.SIDE).all()
    assert (np.abs(y - 2.0 - 0.5 * corner.SIDE) <= 0.5 * corner.SIDE).all()
    extent = np.quantile(draws / reference, [0.001, 0.999], axis=0)
    low, high = extent.min(axis=0), extent.max(axis=0)
    length = 1.1 * (high - low)[1:]
    slope = -np.polyfit(x, y, 1)[0] * length[1] / length[0]
    assert slope == pytest.approx((-0.5 / -4.0) / (1.0 / 2.0), rel=1e-6)
    middle = (
        low[1:]
        - 0.05 * (high - low)[1:]
        + length * np.array([np.mean(x) - 1.0, 2.0 + corner.SIDE - np.mean(y)]) / corner.SIDE
    )
    assert middle == pytest.approx(draws.mean(axis=0)[1:] / reference[1:], abs=0.15)


def test_the_corner_holds_the_shares_of_draws_that_it_says():
    """Of a correlated normal pair 50 and 90 % of the draws lie within the contours.

    Smoothing by one cell widens a cloud whose sd is three cells or more by 5 % at most, and its contours with it.
    """
    draws = 0.5 + np.random.default_rng(0).standard_normal((20_000, 2)) @ np.array([[0.15, 0.06], [0.0, 0.12]])
    axis = Figure().subplots()
    corner.draw_joint(axis, draws)
    lines = next(c for c in axis.collections if len(c.get_paths()) == 2 and not c.get_fill())
    side = corner.SIDE
    points = np.stack([side * draws[:, 0], 1.0 + side * (1.0 - draws[:, 1])], axis=1)
    shares = sorted(path.contains_points(points).mean() for path in lines.get_paths())
    wider = [1.0 - (1.0 - share) ** 1.05**2 for share in corner.SHARES]
    for measured, share, limit in zip(shares, corner.SHARES, wider, strict=True):
        assert share - 0.01 < measured < limit + 0.01
