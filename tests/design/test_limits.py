"""Limits of a trial: margins against flights, what is refused, and draws of the prior."""

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.design.families import Family, controls
from bayesub.design.limits import Limits, Margin, Range, load_limits, usual_limits

STEP = 1.0
WIDE = Limits(
    depth_change_m=1e4, surface_m=-1e4, bottom_m=1e5, pitch_deg=89.0, roll_deg=180.0, min_speed_mps=-5.0,
    max_speed_mps=50.0, range_north_m=1e5, range_east_m=1e5,
)  # fmt: skip


def draws_of(boat, n, sd, seed=5):
    rng = np.random.default_rng(seed)
    return boat.xi * (1.0 + sd * rng.standard_normal((n, len(boat.xi))))


def straight(boat, limits):
    return Family("steps", boat, limits, controls(boat, limits)).straight()


def test_margins_are_the_extremes_of_simulated_flights(boat, manoeuvre):
    draws = draws_of(boat, 3, 0.05)
    margins = {m.key: m for m in Range(boat, WIDE, draws, None, STEP).margins(manoeuvre)}
    flights = bs.simulate(boat, manoeuvre, xi=np.vstack([boat.xi, draws]), dt=STEP, sample=0.5)
    x, y, z, phi, theta, u = np.moveaxis(flights.outputs(("x", "y", "z", "phi", "theta", "u")), -1, 0)
    ends = 0.5 * boat.length_m * np.abs(np.sin(theta))
    extremes = {
        "depth_change_m": np.abs(z - boat.depth_m).max(1),
        "surface_m": (z - ends).min(1),
        "bottom_m": (z + ends).max(1),
        "pitch_deg": np.degrees(np.abs(theta).max(1)),
        "roll_deg": np.degrees(np.abs(phi).max(1)),
        "min_speed_mps": u.min(1),
        "max_speed_mps": u.max(1),
        "range_north_m": x.max(1) - x.min(1),
        "range_east_m": y.max(1) - y.min(1),
    }
    assert list(margins) == list(extremes)
    for key, extreme in extremes.items():
        size = {"deg": 0.2, "mps": 0.02}.get(key.rpartition("_")[2], 0.5)
        assert margins[key].reached == pytest.approx(extreme, abs=size), key
        assert margins[key].is_upper == (key not in ("surface_m", "min_speed_mps"))
        assert np.all(margins[key].excess < 0.0)
        assert margins[key].share_within == 1.0


def test_only_limits_that_are_given_are_judged(boat, manoeuvre):
    margins = Range(boat, Limits(pitch_deg=20.0), np.empty((0, len(boat.xi))), None, STEP).margins(manoeuvre)
    assert [m.key for m in margins] == ["pitch_deg"]
    assert np.isnan(margins[0].share_within)


def test_the_excess_is_a_share_of_the_limit():
    upper = Margin("pitch_deg", 20.0, np.array([25.0, 10.0, 20.0]))
    assert upper.excess == pytest.approx([0.25, -0.5, 0.0])
    assert upper.share_within == 1.0
    lower = Margin("min_speed_mps", 2.0, np.array([1.0, 3.0, 1.5]), is_upper=False)
    assert lower.excess == pytest.approx([0.5, -0.5, 0.25])
    assert lower.share_within == 0.5
    assert Margin("surface_m", 0.0, np.array([-1.0]), is_upper=False).excess[0] > 1.0


def test_a_flight_that_fails_is_beyond_every_limit(boat, manoeuvre):
    """Heave and pitch that grow without bound."""
    xi = boat.xi.copy()
    xi[boat.equations.columns(["Muw", "Muq"])] *= [50.0, -50.0]
    flown = Range(boat, WIDE, xi[None], None, STEP)
    assert flown.flown(manoeuvre)[2].tolist() == [True, False]
    for margin in flown.margins(manoeuvre):
        assert margin.excess[0] < 0.0 < margin.excess[1]
        assert np.isinf(margin.reached[1])
        assert margin.share_within == 0.0
    assert flown.penalty(flown.margins(manoeuvre)) == pytest.approx(10.0)
    bold = Range(boat, WIDE.model_copy(update={"share_of_draws": 0.0}), xi[None], None, STEP)
    assert bold.penalty(bold.margins(manoeuvre)) == 0.0  # no draw is asked to keep limits
    alone = Range(boat, WIDE, np.empty((0, len(xi))), None, STEP)
    assert alone.penalty(alone.margins(manoeuvre)) == 0.0


def test_the_share_of_draws_that_keep_all_limits_is_what_is_asked_for(boat):
    """Ten draws of which k are beyond: a share that leaves out k costs nothing, and one more costs its excess."""
    limits = Limits(pitch_deg=10.0)
    reached = np.array([9.0, *np.full(7, 8.0), 11.0, 12.0, 14.0])
    for share, penalty in ((0.0, 0.0), (0.7, 0.0), (0.8, 0.1 / 8.0), (0.9, 0.3 / 9.0), (1.0, 0.7 / 10.0)):
        flown = Range(boat, limits.model_copy(update={"share_of_draws": share}), np.tile(boat.xi, (10, 1)), None, STEP)
        assert flown.penalty([Margin("pitch_deg", 10.0, reached)]) == pytest.approx(penalty), share


def test_no_more_draws_must_keep_limits_than_keep_them_in_straight_flight(boat):
    """Of twenty boats three are too slow, and one more may be; but a share that the limits give is kept."""
    xi = np.tile(boat.xi, (20, 1))
    xi[:3, boat.equations.columns(["Xuu"])] *= 9.0
    limits = Limits(min_speed_mps=0.8 * boat.speed_mps)
    for given, wanted in ((limits, 17), (Limits(min_speed_mps=0.8 * boat.speed_mps, share_of_draws=0.97), 20)):
        flown = Range(boat, given, xi, None, STEP)
        assert flown.n_wanted == 20
        flown.allow(straight(boat, given))
        assert flown.n_wanted == wanted


def test_straight_flight_need_not_stay_in_an_area_where_turns_do(boat):
    """It is not refused, and all boats are asked to keep what none keeps straight ahead; so they are of no limit."""
    for limits in (Limits(range_north_m=2000.0), Limits()):
        flown = Range(boat, limits, np.tile(boat.xi, (20, 1)), None, STEP)
        flown.refuse(straight(boat, limits))
        flown.allow(straight(boat, limits))
        assert flown.n_wanted == 20


def test_the_penalty_is_that_of_the_worst_limit_of_each_flight(boat):
    flown = Range(boat, Limits(), np.empty((0, len(boat.xi))), None, STEP)
    pitch, roll = Margin("pitch_deg", 10.0, np.array([12.0])), Margin("roll_deg", 10.0, np.array([15.0]))
    assert flown.penalty([pitch, roll]) == pytest.approx(0.5)
    assert flown.penalty([]) == 0.0


@pytest.mark.parametrize("name", ["suboff", "auv690", "npsauv", "remus100", "mariner", "phoenix"])
def test_usual_limits_allow_straight_flight(name):
    vehicle = bs.load_vehicle(name)
    limits = usual_limits(vehicle)
    step = 0.1 * vehicle.length_m / vehicle.speed_mps
    Range(vehicle, limits, np.empty((0, len(vehicle.xi))), None, step).refuse(straight(vehicle, limits))


@pytest.mark.parametrize(
    ("limits", "key"),
    [
        ({"surface_m": 101.0}, "surface_m"),
        ({"bottom_m": 99.0}, "bottom_m"),
        ({"max_speed_mps": 7.0}, "max_speed_mps"),
        ({"min_speed_mps": 8.0}, "min_speed_mps"),
    ],
)
def test_limits_that_straight_flight_breaks_are_refused_in_one_line(boat, limits, key):
    limits = Limits(**limits)
    with refused("conflict", key):
        Range(boat, limits, np.empty((0, len(boat.xi))), None, STEP).refuse(straight(boat, limits))


@pytest.mark.parametrize(
    ("text", "kind", "key"),
    [
        ("pitch_deg = -1.0", "value", "pitch_deg"),
        ("rudder_deg = 0.0", "value", "rudder_deg"),
        ("rudder_deg = 1.5e154", "value", "rudder_deg"),
        ("surface_m = 50.0\nbottom_m = 10.0", "conflict", ""),
        ("min_speed_mps = 9.0\nmax_speed_mps = 1.0", "conflict", ""),
        ("min_rpm_percent = 120.0", "conflict", ""),
        ("share_of_draws = 1.5", "value", "share_of_draws"),
        ('roll_deg = "much"', "value", "roll_deg"),
        ("depth_change_m = nan", "value", "depth_change_m"),
        ("duration_s = inf", "value", "duration_s"),
    ],
)
def test_limits_files_are_refused_in_one_line(tmp_path, text, kind, key):
    path = tmp_path / "limits.toml"
    path.write_text(text)
    with refused(kind, key) as error:
        load_limits(path)
    assert "limits.toml" in str(error.value)


def test_limits_of_controls_and_what_is_none_of_them(tmp_path, boat):
    path = tmp_path / "limits.toml"
    path.write_text("rudder_deg = 10.0\nrudder_degps = 2.0\nstern_plane_deg = 90.0\nmax_rpm_percent = 120.0\n")
    rudder, bow, stern, rpm = controls(boat, load_limits(path))
    assert (np.degrees(rudder.upper), np.degrees(rudder.rate)) == pytest.approx((10.0, 2.0))
    assert (np.degrees(stern.lower), np.degrees(bow.upper)) == pytest.approx((-20.0, 20.0))
    steady = boat.rpm_per_mps * boat.speed_mps
    assert (rpm.lower, rpm.rest, rpm.upper) == pytest.approx((0.5 * steady, steady, 1.2 * steady))
    path.write_text("ruder_deg = 10.0")
    with refused("unknown", "ruder_deg"):
        controls(boat, load_limits(path))
    path.write_text("pitch_degree = 10.0")
    with refused("unknown", "pitch_degree"):
        controls(boat, load_limits(path))
