"""Null directions in relative changes: the motion does not notice them, and the words say them."""

from dataclasses import replace

import numpy as np
import pytest

import bayesub as bs
from bayesub.findings import run_numbers
from bayesub.inference import identifiability
from bayesub.inference.identifiability import NullSpace
from bayesub.inference.identifiability.rank import AxisRank


@pytest.fixture(scope="module")
def problem(spiral_track):
    sensors = bs.sensors.Track(0.5, 0.1, interval_s=20.0, channels=("x", "y", "yaw"))
    record = bs.observe(spiral_track, sensors, np.random.default_rng(0))
    given = {"free": bs.coefficients.HORIZONTAL, "prior": bs.priors.relative_normal(0.25), "dt": 1.0}
    return bs.Problem(spiral_track.simulator.vehicle, spiral_track.simulator.manoeuvre, record, **given)


@pytest.fixture(scope="module")
def directions(problem):
    values = dict(zip(problem.names, problem.reference.tolist(), strict=True))
    return run_numbers.null_changes(identifiability.null_space(problem, problem.reference), values)


def moved(problem, changes):
    """How far readings move, in their noise, when coefficients change by these parts of themselves."""
    factors = np.array([1.0 + changes.get(name, 0.0) for name in problem.names])
    sets = np.stack([problem.reference, problem.reference * factors])
    before, after = problem.predicted(sets)
    return np.abs(after - before).max() / problem.sds.min()


def test_the_motion_is_the_same_after_half_a_coefficient_has_gone(problem, directions):
    """And another one as soon as one of the coefficients does not go along."""
    assert len(directions) == 3
    for direction in directions:
        changes = direction["changes"]
        assert {name[0] for name in changes} == {direction["axis"]}
        assert next(iter(changes.values())) == pytest.approx(0.5)
        assert moved(problem, changes) < 1e-6
        assert moved(problem, {name: -change for name, change in changes.items()}) < 1e-6
        largest = next(iter(changes))
        assert moved(problem, {name: change for name, change in changes.items() if name != largest}) > 1.0


def test_words():
    """Two digits, largest first; what changes by less than a twentieth of itself is counted or left out."""
    said = {"Yvdot": 0.5, "Yuv": 0.2134, "Yur": -0.1, "Yrdot": 0.01}
    many = {"Zvp": 0.5, "Zwdot": 0.47} | {f"Z{k}": 0.23 for k in range(4)}
    alone = {"Nvdot": 0.5, "Nuv": 0.04, "Nur": 0.001}
    both = [{"axis": "Y", "changes": said}, {"axis": "N", "changes": alone}]
    assert run_numbers.null_sentence(both) == (
        "Y: 50 % of Yvdot with 21 % of Yuv and -10 % of Yur; N: 50 % of Nvdot with less than 5 % of 2 others"
    )
    assert run_numbers.null_sentence([{"axis": "Z", "changes": many}]) == (
        "Z: 50 % of Zvp with 47 % of Zwdot, 23 % of Z0, 23 % of Z1 and 2 others"
    )
    assert run_numbers.null_sentence([{"axis": "X", "changes": {"Xuu": 0.5}}]) == "X: 50 % of Xuu"
    assert run_numbers.null_sentence([]) == ""


def test_a_coefficient_of_zero_has_no_relative_change():
    rank = AxisRank(("a", "b"), np.array([1.0, 0.0]), 1e-12, ({"a": 1.0, "b": 0.4},))
    found = run_numbers.null_changes(NullSpace(("a", "b"), {"Y": rank}), {"a": 0.0, "b": -2.0})
    assert found == [{"axis": "Y", "changes": {"b": 0.5}}]


@pytest.mark.parametrize("noise", [{}, {"x": bs.likelihoods.Normal(5.0)}, {"x": bs.likelihoods.UnknownSd(5.0)}])
def test_chi_square_is_of_the_noise_that_the_study_gives(spiral_track, noise):
    """About one at the truth, whether the sd is that of the sensors, of the study, or of the errors."""
    sensors = bs.sensors.Track(5.0 if noise else 0.5, 0.1, interval_s=4.0, channels=("x", "y", "yaw"))
    record = bs.observe(spiral_track, sensors, np.random.default_rng(0))
    claimed = replace(record, channels=tuple(replace(c, sd=0.5) if c.name == "x" else c for c in record.channels))
    given = {"free": ("Nuv",), "prior": bs.priors.relative_normal(0.25), "dt": 1.0, "noise": noise}
    problem = bs.Problem(spiral_track.simulator.vehicle, spiral_track.simulator.manoeuvre, claimed, **given)
    (chi_square,) = run_numbers._chi_squares(problem, problem.reference[None])
    assert chi_square == pytest.approx(1.0, abs=0.2)
