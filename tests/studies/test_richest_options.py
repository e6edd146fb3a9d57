"""Options of a trial that the thesis leaves untried."""

import numpy as np
import pytest

import bayesub as bs
from bayesub.kernels import workspace
from bayesub.model.manoeuvre_files import straight_and_level
from bayesub.model.simulate import accelerations
from richest import options
from richest.options import OPTIONS, best, equipped, log_sensors

STEP = 4.0


@pytest.mark.parametrize("name", OPTIONS)
def test_each_option_has_a_cost(name, rng):
    cost = OPTIONS[name].cost(STEP, log_sensors(20))
    assert [control.column for control in cost.families[0].controls if control.column in OPTIONS[name].moved] == list(
        dict.fromkeys(control.column for control in cost.families[0].controls)
    )
    assert len(cost.families[0].controls) == len(OPTIONS[name].moved)
    numbers = 0.03 * np.concatenate([family.start(rng) for family in cost.families])
    assert np.isfinite(cost(numbers))
    longest = max(manoeuvre.duration for manoeuvre in cost.manoeuvres(numbers))
    assert longest == OPTIONS[name].limits.get("duration_s", 600.0)


def test_ballast_trim_and_thrusters_push_as_they_say():
    """Lift accelerates the boat upwards, a mass forward lowers the bow, thrusters turn and raise it."""
    vehicle = equipped()
    columns = vehicle.actuators.columns
    values = np.eye(len(columns))[[columns.index(c) for c in ("ballast_n", "trim_m", "side_n", "lift_n")]]
    states = np.tile(straight_and_level(vehicle), (4, 1))
    rpm = vehicle.rpm_per_mps * vehicle.speed_mps
    weights = 1e5, 0.2, 1e5, 1e5
    still = accelerations(vehicle, states, np.zeros((4, 3)), rpm)
    moved = accelerations(vehicle, states, np.zeros((4, 3)), rpm, np.array(weights)[:, None] * values)
    ballast, trim, side, lift = moved - still
    mass = vehicle.mass_matrix
    assert mass @ ballast == pytest.approx([0.0, 0.0, -1e5, 0.0, 0.0, 0.0], abs=1e-3)
    moment = -0.2 * vehicle.body[workspace.WEIGHT]
    assert mass @ trim == pytest.approx([0.0, 0.0, 0.0, 0.0, moment, 0.0], rel=1e-9, abs=1e-3)
    bow = 0.4 * vehicle.length_m
    assert mass @ side == pytest.approx([0.0, 1e5, 0.0, 0.0, 0.0, 1e5 * bow], rel=1e-9, abs=1e-3)
    assert mass @ lift == pytest.approx([0.0, 0.0, -1e5, 0.0, 1e5 * bow, 0.0], rel=1e-9, abs=1e-3)


def test_one_reading_in_four_with_four_times_the_weight_tells_nearly_the_same(rng):
    whole, thinned = (OPTIONS["rpm"].cost(STEP, log_sensors(n)) for n in (1, 4))
    numbers = 0.1 * whole.families[0].start(rng)
    ((one,), (other,)) = (cost.judge.information(cost.manoeuvres(numbers)[0]) for cost in (whole, thinned))
    assert other.relative_sd == pytest.approx(one.relative_sd, rel=0.1)


def test_the_best_of_a_short_search_is_within_the_limits():
    cost, result = best("planes", 1, 100, STEP, thinned=20)
    (manoeuvre,) = cost.manoeuvres(result.numbers)
    assert cost.range.penalty(cost.range.margins(manoeuvre)) == 0.0
    again = best("planes", 1, 100, STEP, thinned=20)[1]
    assert np.array_equal(result.numbers, again.numbers)


def test_a_faster_boat_is_the_same_boat():
    faster, suboff = equipped(10.0), bs.load_vehicle("suboff")
    assert faster.speed_mps == 10.0
    assert np.array_equal(faster.xi, suboff.xi)
    assert options.equipped().speed_mps == suboff.speed_mps
