"""Bands of a motion: what they hold, what the ellipses hold, and what is left out."""

import numpy as np
import pytest

from bayesub.findings.predicted_trial import STATES, motion_table, predicted_motion, quantiles, region

N, TIMES = 2000, np.linspace(0.0, 10.0, 6)


@pytest.fixture
def states(rng):
    """Normal states, whose sds grow with time and whose places are correlated."""
    draws = rng.standard_normal((N, len(TIMES), len(STATES))) * (1.0 + TIMES[:, None])
    draws[..., 1] += 3.0 * draws[..., 0]
    return draws


def test_bands_hold_their_share_and_their_ends_are_those_of_a_normal(states):
    motion = predicted_motion(TIMES, states)
    for probability, z in ((0.5, 0.674490), (0.9, 1.644854)):
        low, high = motion.bands[probability]
        inside = np.mean((states >= low) & (states <= high), axis=0)
        assert inside == pytest.approx(np.full(inside.shape, probability), abs=2.0 / N)
        assert high[:, 2] == pytest.approx(z * (1.0 + TIMES), rel=6 * 1.8 / np.sqrt(N))
    np.testing.assert_allclose(motion.half_widths[:, 2], 0.5 * np.ptp(motion.bands[0.9], axis=0)[:, 2])


def test_an_ellipse_holds_its_share_and_leans_with_its_draws(states):
    places = states[..., :2]
    for probability in (0.5, 0.9):
        ellipse = region(places, probability)
        inverse = np.linalg.inv(ellipse.roots)
        sizes = np.linalg.norm(np.einsum("tij,ntj->nti", inverse, places - ellipse.centres), axis=2)
        assert (sizes <= 1.0 + 1e-12).mean(axis=0) == pytest.approx(np.full(len(TIMES), probability), abs=2.0 / N)
        np.testing.assert_allclose(ellipse.roots, np.swapaxes(ellipse.roots, 1, 2), atol=1e-9)
    assert np.all(ellipse.roots[:, 0, 1] > 0.0)


def test_the_distance_holds_nine_of_ten(states):
    motion = predicted_motion(TIMES, states)
    places = states[..., :3]
    distances = np.linalg.norm(places - places.mean(axis=0), axis=2)
    assert (distances <= motion.distance).mean(axis=0) == pytest.approx(np.full(len(TIMES), 0.9), abs=2.0 / N)


def test_a_draw_that_fails_is_left_out_and_counted(states):
    failed = states.copy()
    failed[:300, 3:] = np.nan
    motion = predicted_motion(TIMES, failed)
    assert (motion.n_flown, motion.n_failed, motion.is_flown) == (N - 300, 300, True)
    np.testing.assert_array_equal(motion.median, predicted_motion(TIMES, states[300:]).median)
    assert not predicted_motion(TIMES, failed[:500]).is_flown
    mostly = predicted_motion(TIMES, failed[:310])
    assert (mostly.n_flown, mostly.is_flown) == (10, False)
    assert np.isnan(mostly.median).all()


def test_draws_in_one_place_have_a_region_of_no_size():
    motion = predicted_motion(TIMES, np.ones((50, len(TIMES), len(STATES))))
    assert np.isfinite(motion.above[0.9].roots).all()
    assert motion.distance.max() == 0.0


def test_the_table_is_in_the_units_of_files(states):
    motion = predicted_motion(TIMES, states)
    columns = motion_table({"posterior": motion}, ("x", "psi"))
    assert list(columns)[:3] == ["time_s", "x_m_posterior_median", "x_m_posterior_q5"]
    k = STATES.index("psi")
    np.testing.assert_allclose(columns["yaw_deg_posterior_q95"], np.degrees(motion.bands[0.9][1, :, k]))
    assert list(quantiles({0.9: [1, 4], 0.5: [2, 3]}).items()) == [("q5", 1), ("q25", 2), ("q75", 3), ("q95", 4)]
