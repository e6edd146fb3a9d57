"""The plan of a design: budgets, families, curves that begin as another manoeuvre, and searches that go on."""

from dataclasses import replace

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.design.families import Family
from bayesub.design.information import Known
from bayesub.design.judge import Judge
from bayesub.design.limits import Limits, Range
from bayesub.design.plan import Plan, at_knots, best, families, kinds, of_time, of_total
from bayesub.sensors import DVL, INS, flat

LIMITS = Limits(duration_s=40.0)
SENSORS = flat([DVL(sd_mps=0.005, channels=("u_ground", "v_ground")), INS(sd_degps=0.01, channels=("r",))])


@pytest.fixture(scope="module")
def boat():
    return bs.load_vehicle("auv690")


@pytest.fixture
def plan(boat, tmp_path):
    """Of a short trial in the plane."""
    judge = Judge(boat, tuple(SENSORS), subproblem="horizontal", step_s=0.2)
    flights = Range(boat, LIMITS, np.tile(boat.xi, (2, 1)), "horizontal", 0.2)
    return Plan(judge, flights, families(boat, LIMITS, (), "horizontal"), Known(0.1), 1, 7, tmp_path)


@pytest.mark.parametrize("n_families", [1, 3])
def test_a_budget_is_spent(n_families):
    """On a fast machine all of it; on a slow one no family has fewer than its starts and some generations."""
    fast = of_time(600.0, 25.0, 0.01, n_families)
    assert fast[0] * n_families == pytest.approx(2500, rel=0.01)
    assert fast[0] * n_families + fast[1] == 60_000
    slow = of_time(60.0, 25.0, 10.0, n_families)
    assert slow == (120, 0)
    total = of_total(6000, n_families)
    assert total[0] * n_families + total[1] == 6000


def test_a_helmsman_is_given_steps():
    assert kinds(Limits()) == ("standard", "curves", "multisines")
    assert kinds(Limits(orders_an_hour=60.0)) == ("steps",)
    assert kinds(Limits(), ("curves", "steps", "curves")) == ("curves", "steps")
    with refused("conflict", "--family"):
        kinds(Limits(orders_an_hour=60.0), ("multisines",))


def test_in_a_plane_only_what_acts_there_is_moved(boat):
    for plane, columns in (("horizontal", {"rudder_deg", "rpm"}), ("vertical", {"stern_plane_deg", "rpm"})):
        (family,) = families(boat, LIMITS, ("curves",), plane).values()
        assert {control.column for control in family.controls} - {"bow_plane_deg"} == columns


def test_curves_through_the_knots_of_curves_are_the_same_curves(plan, rng):
    """Slow ones, which the controls can follow."""
    family = replace(plan.families["curves"], n_knots=9)
    numbers = np.clip(0.3 * rng.standard_normal(family.n_dims), -1.0, 1.0)
    numbers[0] = 0.0  # the rudder begins at rest
    again = at_knots(family, family.manoeuvre(numbers))
    assert again[1:9] == pytest.approx(numbers[1:9], abs=1e-9)
    assert again[10:] == pytest.approx(numbers[10:], abs=1e-9)


def test_a_search_goes_on_where_it_was(plan):
    """That of 240 manoeuvres costs what it would without a stop after 120."""
    first = plan.search("standard", 120)
    more = plan.search("standard", 240)
    whole = replace(plan, folder=plan.folder / "other")
    whole.folder.mkdir()
    assert np.array_equal(whole.search("standard", 240).numbers, more.numbers)
    assert more.cost <= first.cost
    costs = [(folder / "costs_standard.txt").read_text() for folder in (plan.folder, whole.folder)]
    assert costs[0] == costs[1]


@pytest.mark.slow
def test_more_judgements_make_nothing_worse(plan):
    """Whether or not curves that begin as the best of the families become better than it."""
    *_, (_, answers) = plan.stages((120, 0))
    assert set(answers) == set(plan.families)
    thorough = plan.thorough(answers, 300)
    assert thorough[best(thorough)].cost <= answers[best(answers)].cost
    assert isinstance(plan.family("refined"), Family)
    assert thorough["refined"].n_judgements >= 225
