"""Distances from a path, and what is compared with feedback and without."""

import numpy as np
import pytest

import bayesub as bs
from autopilot import courses


def test_distances_from_a_path():
    """Of a corner: beside a leg, beyond the corner, and past the end, which does not count."""
    path = np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 50.0]])
    assert courses.from_path(path, np.array([[30.0, 4.0], [60.0, -2.0]])) == pytest.approx(4.0)
    assert courses.from_path(path, np.array([[103.0, -4.0]])) == pytest.approx(5.0)
    assert courses.from_path(path, np.array([[100.0, 80.0], [99.0, 20.0]])) == pytest.approx(1.0)


def test_the_truth_has_no_error_and_drag_is_not_masked():
    """The boat itself is off by the error of the step; a boat with a tenth more drag is late, and near the path."""
    boat = bs.load_vehicle("npsauv")
    slow = boat.xi.copy()
    slow[boat.equations.index["Xuu"]] *= 1.1
    pilot = courses.course(boat, courses.COURSES[0], np.random.default_rng(1))
    found = courses.with_and_without(boat, pilot, np.array([boat.xi, slow]))
    track, path, depth, _ = found["with"].T
    assert track[0] < 0.01 * boat.length_m
    assert track[1] > 0.5 * boat.length_m
    assert path[1] < 0.5 * track[1]
    assert depth[1] < 0.05 * boat.length_m
