"""The spiral curve: steady turns, straight where the boat is linear, and folded if a straight course is not stable."""

from dataclasses import replace

import numpy as np
import pytest

import bayesub as bs
from bayesub.kernels import workspace
from bayesub.model.boats import Boats
from bayesub.model.coefficients import INDEX
from bayesub.model.linear_motion import stability_index
from bayesub.model.standard_manoeuvres import R, fly, spiral, spiral_curve, spiral_loop_width

SUBOFF = bs.load_vehicle("suboff")
MASS = SUBOFF.body[workspace.MASS] / SUBOFF.dimensional_factors[INDEX["Yvdot"]]
YV, YR, NV, NR, YD, ND = (SUBOFF.xi[INDEX[n]] for n in ("Yuv", "Yur", "Nuv", "Nur", "Yuu_dr", "Nuu_dr"))


def _one(vehicle):
    return Boats(vehicle, vehicle.xi[None])


def test_gentle_turns_are_those_of_the_linear_equations():
    """delta = (Yv Nr - Nv (Yr - m)) r' / (Nv Yd - Yv Nd), the gain of Nomoto's equation of first order."""
    speed, length = SUBOFF.speed_mps, SUBOFF.length_m
    linear = replace(SUBOFF, xi=np.where(["abs" in name for name in SUBOFF.equations.names], 0.0, SUBOFF.xi))
    rates, rudder = spiral(_one(linear), 1e-3 * speed / length)
    gain = (YV * NR - NV * (YR - MASS)) / (NV * YD - YV * ND)
    assert rudder[0] == pytest.approx(gain * rates * length / speed, rel=1e-4, abs=1e-12)


def test_the_end_of_the_curve_is_the_turn_with_all_rudder_and_sides_mirror_each_other():
    rates, rudder = spiral_curve(_one(SUBOFF))
    assert np.degrees(rudder[0, 0]) == pytest.approx(30.0, abs=1e-3)
    assert rudder[0] == pytest.approx(-rudder[0, ::-1], abs=1e-9)
    within = fly(_one(SUBOFF), 60.0, "horizontal", {"rudder_deg": (0.0, 12.0)})[0, -1, R]
    assert np.interp(within, rates, np.degrees(rudder[0])) == pytest.approx(12.0, abs=0.03)


def test_there_is_a_loop_where_a_straight_course_is_not_stable_and_nowhere_else():
    neutral = YV * NR / (YR - MASS)
    sets = np.tile(SUBOFF.xi, (4, 1))
    sets[:, INDEX["Nuv"]] = neutral * np.array([0.8, 0.95, 1.05, 1.2])
    boats = Boats(SUBOFF, sets)
    widths = spiral_loop_width(boats)
    assert np.isfinite(widths).tolist() == (stability_index(boats, "horizontal") < 0.0).tolist()
    assert np.isfinite(widths).tolist() == [False, False, True, True]
    assert 0.0 < widths[2] < widths[3]


def test_within_the_loop_a_boat_turns_to_either_side_and_beyond_it_to_one():
    """As in Dieudonne's spiral, of which the curve is the limit of endless patience."""
    boat = _one(bs.load_vehicle("remus100"))
    (half,) = 0.5 * spiral_loop_width(boat)
    for share, sides in ((0.9, 2), (1.1, 1)):
        ends = set()
        for before in (-10.0, 10.0):
            turning = fly(boat, 60.0, "horizontal", {"rudder_deg": (0.0, before)})[:, -1]
            flown = fly(boat, 200.0, "horizontal", {"rudder_deg": (before, share * half)}, initial=turning)
            ends.add(np.sign(flown[0, -1, R]))
        assert len(ends) == sides
