"""The card of a study's data."""

import re

import numpy as np
import pytest

import bayesub as bs
from bayesub.findings import data_card
from bayesub.problem.joint import JointProblem
from bayesub.problem.priors import normal, relative_normal
from bayesub.report.plots import cards
from bayesub.sensors import Track, modified

FREE = ("Xuu", "Yuv", "Nuv", "Nur")


@pytest.fixture(scope="module")
def problem(suboff, spiral, spiral_track):
    sensors = [
        modified(Track(0.5, 0.1, 4.0, ("x", "yaw")), gaps=((100.0, 140.0),)),
        bs.sensors.Sensor("heading_deg", 3000.0, interval_s=300.0),  # tells next to nothing
    ]
    record = bs.observe(spiral_track, sensors, np.random.default_rng(0))
    nuisance = {"x0_m": normal(0.0, 5.0)}
    return bs.Problem(suboff, spiral, record, free=FREE, prior=relative_normal(0.2), nuisance=nuisance, dt=1.0)


def test_information_of_a_channel_is_that_of_a_problem_without_the_others(problem, suboff, spiral):
    """The posterior sds of the linearised problem of one channel, by inverting its precision matrix."""
    card = data_card.check(problem, "spiral")
    assert card.n_coefficients == 4
    for channel, found in zip(problem.record.channels, card.channels, strict=True):
        options = {"free": FREE, "prior": relative_normal(0.2), "nuisance": {"x0_m": normal(0.0, 5.0)}, "dt": 1.0}
        alone = bs.Problem(suboff, spiral, bs.Record((channel,)), **options)
        jacobian = alone.jacobian(alone.prior.mean)
        covariance = np.linalg.inv(jacobian.T @ jacobian + np.diag(alone.prior.sd**-2.0))
        np.testing.assert_allclose(found.contraction, np.sqrt(np.diag(covariance)) / alone.prior.sd, rtol=1e-6)
        assert found.n_directions == np.count_nonzero(np.linalg.svd(jacobian * alone.prior.sd, compute_uv=False) > 1.0)
    x, yaw, heading = card.channels
    assert yaw.contraction[4] == 1.0  # where the boat began does not turn it
    assert heading.n_directions == 0
    assert np.all(card.contraction <= np.minimum(x.contraction, yaw.contraction) + 1e-12)


def test_gaps_are_where_readings_are_missing(problem):
    x, yaw, _ = data_card.check(problem, "spiral").channels
    assert x.gaps == yaw.gaps == ((96.0, 144.0),)
    assert x.interval_s == 4.0


def test_outliers_of_a_smooth_motion_are_found_and_nothing_else():
    """Planted in noise about a sine at irregular times; of channels without, one in a hundred may have a candidate."""
    rng = np.random.default_rng(1)
    alarms = 0
    for _ in range(100):
        times = np.cumsum(rng.uniform(0.5, 1.5, 300))
        values = 50.0 * np.sin(times / 20.0) + 0.1 * rng.standard_normal(300)
        alarms += len(data_card.outlier_candidates(times, values, 0.1))
        planted = np.array([40, 200])
        values[planted] += [3.0, -2.0]
        assert set(planted) <= set(data_card.outlier_candidates(times, values, 0.1))
    assert alarms <= 6  # binomial with 1 in 100: more has a probability of 1e-4
    assert len(data_card.outlier_candidates(times[:4], values[:4], 0.1)) == 0


@pytest.mark.rendered
def test_trials_have_rows_of_their_own_and_the_card_is_drawn(problem, tmp_path):
    joint = JointProblem({"first": problem, "second": problem})
    card = data_card.check(joint, "two")
    assert [c.name for c in card.channels][:4] == ["x[first]", "yaw[first]", "heading[first]", "x[second]"]
    assert card.channels[0].contraction[joint.names.index("x0_m[second]")] == 1.0
    assert len([line for line in card.lines() if re.match(r"  \w+\[(first|second)\] ", line)]) == 6
    assert "gap 96-144 s" in card.lines()[1]
    cards.draw(card, tmp_path / "card.png")
    assert (tmp_path / "card.png").stat().st_size > 5000
    assert list(card.to_json()["channels"][0]["contraction"]) == list(joint.names)
