"""Casts of the glider's log, and the comparison with gliderflight where it is installed."""

import sys

import numpy as np
import pytest

from glider import flight


@pytest.fixture(scope="module")
def casts():
    """All casts of the log."""
    return flight.find_casts()


def test_every_dive_is_a_descent_and_an_ascent(casts):
    """18 dives without surface and turn, each with the start of steady flight."""
    assert len(casts) == 36
    assert [cast["down"] for cast in casts] == [True, False] * 18
    assert [cast["dive"] for cast in casts] == sorted(2 * list(range(18)))
    for cast in casts:
        begin, end = cast["window"]
        assert 150.0 < end - begin < 200.0
        assert 0.28 < cast["start"]["u0_mps"] < 0.42
        assert (cast["start"]["w0_mps"] > 0.0) == cast["down"]


def test_slopes_of_a_straight_descent(casts):
    """Whatever the stamps are."""
    log = flight.whole_log()
    straight = log | {"depth": 0.13 * log["time"]}
    rates = flight.slopes(straight, casts[:1])
    rows = flight.rows_of(log, casts[0])
    np.testing.assert_allclose(rates[rows], -0.13, rtol=1e-9)
    assert not rates[~rows].any()


def test_without_the_package_there_is_no_comparison(casts, monkeypatch):
    """The study then runs without it."""
    monkeypatch.setitem(sys.modules, "gliderflight", None)
    assert flight.peer(None, casts[:2], casts[2:4]) is None
