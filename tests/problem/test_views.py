"""Views of views have the changes of both, whichever comes first."""

from itertools import combinations

import numpy as np
import pytest

import bayesub as bs
from bayesub.problem.disturbances import UnknownDisturbance
from bayesub.problem.likelihoods import SetMembership, StudentT
from bayesub.problem.priors import log_normal, normal, relative_normal

NUISANCE = {"sd_x_m": log_normal(0.5, 0.7), "bias_yaw_deg": normal(0.5, 0.3)}
DISTURBANCE = UnknownDisturbance(("X", "N"), {"X": log_normal(1e-4, 0.7), "N": 1e-5}, 60.0, knot_interval_s=200.0)
CHANGES = {
    "wider": lambda one: one.widened(2.0),
    "shorter": lambda one: one.truncated(300.0),
    "smooth": lambda one: one.smoothed(0.1),
    "wide process": lambda one: one.with_wide_process(),
    "plain": lambda one: one.searchable(),
}
OF_TRIALS = {"earlier": lambda one: one.read_earlier(40.0), "read anew": lambda one: one.with_readings(_shifted(one))}
# An interval gets its sd from the view that smooths it, so that one made wider before has none to widen.
APART = {"smooth", "wider"}
PAIRS = [pair for pair in combinations(CHANGES, 2) if set(pair) != APART]


def _shifted(one):
    return one.record.values + np.resize([0.0, 0.001], len(one.record.values))


@pytest.fixture(scope="module")
def problem(suboff, spiral, spiral_track):
    """Inferred noise and bias, unknown forces, and a channel of which the intervals are all that is known."""
    sensor = bs.sensors.Track(0.5, 0.1, interval_s=20.0, channels=("x", "y", "yaw"))
    record = bs.observe(spiral_track, sensor, np.random.default_rng(2))
    noise = {"x": StudentT(0.5, 4.0), "y": SetMembership(2.0)}
    pose = {"free": ("Xuu", "Nuv"), "prior": relative_normal(0.05), "dt": 1.0, "disturbance": DISTURBANCE}
    return bs.Problem(suboff, spiral, record, noise=noise, nuisance=NUISANCE, **pose)


def _same(one, other):
    assert one.names == other.names
    values = one.prior.parameters(0.1 * np.ones((1, one.n_params)))
    for pair in zip(one.misfit(values), other.misfit(values), strict=True):
        np.testing.assert_array_equal(*pair)
    np.testing.assert_array_equal(one.jacobian(values[0]), other.jacobian(values[0]))


@pytest.mark.parametrize(("first", "second"), PAIRS)
@pytest.mark.parametrize("joint", [False, True], ids=["trial", "joint"])
def test_the_order_of_views_does_not_matter(problem, first, second, joint):
    one = bs.JointProblem({"a": problem}) if joint else problem
    _same(CHANGES[second](CHANGES[first](one)), CHANGES[first](CHANGES[second](one)))


@pytest.mark.parametrize("second", OF_TRIALS)
def test_inferred_noise_stays_as_wide_as_it_was_made(problem, second):
    """Of a record that is cut, shifted or changed, and of a known process."""
    _same(OF_TRIALS[second](problem.widened(2.0)), OF_TRIALS[second](problem).widened(2.0))


def test_a_longer_noise_is_another_likelihood(problem):
    """What these tests compare is no constant: without the widening the inferred noise of a part fits otherwise."""
    values = problem.prior.parameters(np.zeros((1, problem.n_params)))
    wide, plain = problem.widened(2.0).truncated(300.0), problem.truncated(300.0)
    assert wide.log_likelihoods(values)["x"] != plain.log_likelihoods(values)["x"]
    assert wide.widening == 2.0
    assert wide.costs is problem.costs


def test_a_joint_problem_of_which_no_trial_changes_is_itself(problem):
    joint = bs.JointProblem({"a": problem})
    assert joint.truncated(joint.duration) is joint
    assert joint.widened(2.0) is not joint
