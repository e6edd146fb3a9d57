"""What manoeuvres tell by several sets of sensors, why coefficients stay unknown, and summaries of trials."""

import numpy as np
import pytest

from bayesub.design.information import Known
from bayesub.design.judge import Judge
from richest import appraisal, floor, proof

OUT_OF_CONTROL = (22, 6925)  # random curves on which remus100 loses its way


@pytest.fixture(scope="module")
def appraiser():
    return appraisal.appraiser_of("remus100")


@pytest.fixture(scope="module")
def coupled(appraiser):
    return appraiser.manoeuvre({"name": "coupled"})


def test_one_simulation_serves_all_sensors(appraiser, coupled):
    """It tells what a judge of each set of sensors tells."""
    step = appraiser.accurate_step(coupled)
    for name, information in appraiser.exact_information(coupled).items():
        (alone,) = Judge(appraiser.boat, appraiser.sensors[name], step_s=step).information(coupled)
        np.testing.assert_allclose(information.posterior_sd, alone.posterior_sd, rtol=1e-6)


def test_one_reading_in_four_with_four_times_the_weight_tells_the_same(appraiser):
    manoeuvre = appraiser.manoeuvre({"seed": (22, 1)})
    fast, exact = appraiser.information(manoeuvre), appraiser.exact_information(manoeuvre)
    for name, information in fast.items():
        assert Known(0.1)(information) == pytest.approx(Known(0.1)(exact[name]), abs=0.1)


def test_a_flight_out_of_control_tells_nothing(appraiser):
    """Its sensitivities are so large that the prior is lost in rounding: its information was no covariance."""
    manoeuvre = appraiser.manoeuvre({"seed": OUT_OF_CONTROL})
    for information in appraiser.information(manoeuvre).values():
        assert information.n_known(0.1) == 0


def test_random_manoeuvres_are_those_of_their_seed(appraiser):
    kinds = [appraiser.random((22, k))[0] for k in range(3)]
    assert kinds == ["steps", "curves", "random"]
    first, again = (appraiser.random((22, 4))[1] for _ in range(2))
    np.testing.assert_array_equal(first.controls, again.controls)
    assert not np.array_equal(first.controls, appraiser.random((22, 7))[1].controls)


def test_steps_follow_a_random_manoeuvre_of_the_thesis(appraiser):
    """They are the same orders for the same times, but begin a third of a step later."""
    manoeuvre = appraiser.manoeuvre({"seed": (22, 2)})
    followed = appraiser.manoeuvre({"kind": "steps", "numbers": appraiser.numbers_like(manoeuvre, "steps")})
    late = np.linspace(0.045, 0.995, 20)  # shares of the duration, near the ends of the steps
    for one, other in zip(manoeuvre.controls.T, followed.controls.T, strict=True):
        values = [np.interp(late * m.duration, m.times, v) for m, v in ((manoeuvre, one), (followed, other))]
        np.testing.assert_allclose(*values, atol=0.03)


def test_every_coefficient_has_one_reason(appraiser, coupled):
    """And with more information no fewer are known, at most those that no null direction holds."""
    null, n_null = floor.null_part(appraiser, coupled)
    assert n_null >= 2
    for information in appraiser.exact_information(coupled).values():
        reasons = floor.reasons(information, null)
        assert sorted(name for some in reasons.values() for name in some) == sorted(information.names)
        assert len(reasons["known"]) == information.n_known(appraisal.SHARE)
        counts = list(floor.sharper(information, null).values())
        assert counts == sorted(counts)
        assert counts[-1] == len(information.names) - np.count_nonzero(0.25 * null > appraisal.SHARE)


def test_random_manoeuvres_are_ranked_within_the_limits():
    results = {
        "penalty": np.array([0.0, 1.0, 0.0, 0.0]),
        "track": {"cost": np.array([-3.0, -9.0, -1.0, -2.0])},
    }
    assert appraisal.ranked(results, "track") == {"worst": 2, "middle": 3, "best": 0, "best beyond": 1}


def test_a_condition_number_that_falls_as_more_is_known_correlates_negatively():
    results = {"penalty": np.zeros(4), "track": {"cost": np.arange(4.0), "d": np.arange(4.0)}}
    conditions = [{"X": 10.0**k, "Y": 10.0**k} for k in range(4)]
    correlations = floor.correlations(conditions, results, [0, 1, 2, 3])
    assert correlations == {"track": {"mean": -1.0, "largest": -1.0, "d": -1.0}}


def test_what_a_search_finds_is_a_share_of_the_coefficients():
    found = proof.found(np.array([[1.05, -2.0], [1.5, -2.3]]), np.array([1.0, -2.0]))
    assert found["found"] == [1.0, 0.0]
    assert found["median_error"] == pytest.approx([0.025, 0.325])
