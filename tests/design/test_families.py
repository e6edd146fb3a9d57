"""Families of manoeuvres: whatever the numbers, what they order can be followed."""

import numpy as np
import pytest

import bayesub as bs
from bayesub.design.families import KINDS, LENGTHS, RPM, Family, controls
from bayesub.design.limits import Limits, usual_limits
from bayesub.logs.log_files import write_log
from bayesub.model.simulator import Simulator
from richest.options import equipped

VEHICLES = ("suboff", "auv690", "npsauv", "remus100", "mariner", "phoenix")


def family_of(name, kind, **changes):
    vehicle = bs.load_vehicle(name)
    limits = usual_limits(vehicle).model_copy(update=changes)
    return Family(kind, vehicle, limits, controls(vehicle, limits), n_knots=12)


def orders_of(family, manoeuvre):
    """Column of each control -> its history, SI units."""
    log = manoeuvre.log
    shorts = {member.column: member.short for member in family.vehicle.actuators.members} | {RPM: RPM}
    return {control.column: (control, log[shorts[control.column]]) for control in family.controls}


def extreme_numbers(family, rng):
    """Random numbers, those of a corner, and some that are out of bounds."""
    yield family.start(rng)
    yield np.sign(family.start(rng))
    yield 3.0 * family.start(rng)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", VEHICLES)
def test_ranges_and_rates_are_kept(name, kind, rng):
    family = family_of(name, kind)
    assert family.controls
    for numbers in extreme_numbers(family, rng):
        manoeuvre = family.manoeuvre(numbers)
        assert manoeuvre.duration == pytest.approx(LENGTHS * family.vehicle.length_m / family.vehicle.speed_mps)
        manoeuvre.check(family.vehicle)
        moved = 0.0
        for control, history in orders_of(family, manoeuvre).values():
            slack = 1e-9 * (control.upper - control.lower)
            assert history.min() >= control.lower - slack
            assert history.max() <= control.upper + slack
            if np.isfinite(control.rate):
                assert np.abs(np.diff(history)).max() <= control.rate * np.diff(manoeuvre.times).max() * (1.0 + 1e-9)
            assert history[0] == pytest.approx(control.rest)
            moved += np.ptp(history)
        assert moved > 0.0


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", VEHICLES)
@pytest.mark.slow
def test_a_manoeuvre_in_a_file_is_the_same_flight(name, kind, rng, tmp_path):
    family = family_of(name, kind)
    vehicle, manoeuvre = family.vehicle, family.manoeuvre(family.start(rng))
    write_log(tmp_path / "manoeuvre.csv", {"time": manoeuvre.times} | manoeuvre.log)
    read = bs.load_manoeuvre(tmp_path / "manoeuvre.csv", vehicle)
    assert read.controls == pytest.approx(manoeuvre.controls, abs=1e-10)
    assert read.rpm == pytest.approx(manoeuvre.rpm, rel=1e-10)
    times = np.linspace(0.0, 0.5 * manoeuvre.duration, 20)
    step = 0.1 * vehicle.length_m / vehicle.speed_mps
    flights = [Simulator(vehicle, one, times, dt=step).run(vehicle.xi[None])[0] for one in (manoeuvre, read)]
    assert flights[0] == pytest.approx(flights[1], abs=1e-6, nan_ok=True)


@pytest.mark.parametrize("kind", KINDS)
def test_limits_of_a_control_are_kept(kind, rng):
    family = family_of("suboff", kind, min_rpm_percent=80.0, max_rpm_percent=95.0)
    limits = Limits(rudder_deg=7.0, rudder_degps=1.0, min_rpm_percent=80.0, max_rpm_percent=95.0)
    family = Family(kind, family.vehicle, limits, controls(family.vehicle, limits), n_knots=12)
    for numbers in extreme_numbers(family, rng):
        log = family.manoeuvre(numbers).log
        assert np.abs(np.degrees(log["delta_r"])).max() <= 7.0 + 1e-9
        step = family.times[1] - family.times[0]
        assert np.abs(np.diff(np.degrees(log["delta_r"]))).max() <= step * (1.0 + 1e-9)
        steady = family.vehicle.rpm_per_mps * family.vehicle.speed_mps
        assert log["rpm"][0] == pytest.approx(0.95 * steady)  # nearest to self-propulsion
        assert 0.8 * steady * (1 - 1e-9) <= log["rpm"].min()
        assert log["rpm"].max() <= 0.95 * steady * (1 + 1e-9)


@pytest.mark.parametrize("percent", [100.0, 80.0])
def test_equal_ends_keep_the_propeller_speed(percent):
    family = family_of("suboff", "steps", min_rpm_percent=percent, max_rpm_percent=percent)
    assert RPM not in [control.column for control in family.controls]
    for flown in (family.manoeuvre(np.ones(family.n_dims)), family.straight()):
        assert flown.rpm == pytest.approx(0.01 * percent * family.vehicle.rpm_per_mps * family.vehicle.speed_mps)


def test_a_helmsman_gets_no_more_orders_than_he_can_follow(rng):
    family = family_of("suboff", "steps", orders_an_hour=30.0, duration_s=1200.0)
    assert family.n_dims == 10 * len(family.controls)
    rudder = family.manoeuvre(family.start(rng)).log["delta_r"]
    settled = rudder[np.flatnonzero(np.diff(rudder) == 0.0)]
    assert len(np.unique(settled)) == 10
    free = family_of("suboff", "steps", duration_s=1200.0)
    assert free.n_dims == 12 * len(free.controls)


def test_multisines_share_the_harmonics(rng):
    """The spectra of the orders of different controls do not overlap where no plane is too slow."""
    limits = Limits(rudder_deg=2.0, bow_plane_deg=2.0, stern_plane_deg=2.0, min_rpm_percent=100.0)
    vehicle = bs.load_vehicle("suboff")
    family = Family("multisines", vehicle, limits, controls(vehicle, limits), n_knots=4)
    log = family.manoeuvre(family.start(rng)).log
    spectra = {name: np.abs(np.fft.rfft(log[name][:-1])) for name in ("delta_r", "delta_b", "delta_s")}
    for j, spectrum in enumerate(spectra.values()):
        own = 1 + j + 3 * np.arange(4)
        others = np.setdiff1d(np.arange(1, 13), own)
        assert spectrum[own].max() > 20.0 * spectrum[others].max()


def test_the_same_numbers_are_the_same_manoeuvre_and_nothing_moves_in_straight_flight(rng):
    family = family_of("npsauv", "curves")
    numbers = family.start(rng)
    first, second = family.manoeuvre(numbers), family.manoeuvre(numbers.copy())
    assert np.array_equal(first.controls, second.controls)
    assert np.array_equal(first.rpm, second.rpm)
    straight = family.straight()
    assert not straight.controls.any()
    assert np.ptp(straight.rpm) == 0.0


TANKS = {"ballast_n": 4e5, "ballast_nps": 8e3, "trim_m": 0.2, "trim_mps": 4e-3}


@pytest.mark.parametrize("kind", KINDS)
def test_tanks_and_sliding_masses_move_within_limits_that_say_how_large_and_fast_they_are(kind, rng, tmp_path):
    vehicle, limits = equipped(), Limits(**TANKS)
    moved = {control.column: control for control in controls(vehicle, limits)}
    assert list(moved) == [
        "rudder_deg",
        "bow_plane_deg",
        "stern_plane_deg",
        "ballast_n",
        "trim_m",
        "side_n",
        "lift_n",
        RPM,
    ]
    family = Family(kind, vehicle, limits, tuple(moved.values()), n_knots=12)
    log = family.manoeuvre(np.sign(family.start(rng))).log
    for column in ("ballast_n", "trim_m"):
        control = moved[column]
        assert (control.lower, control.rest, control.upper) == (-TANKS[column], 0.0, TANKS[column])
        assert np.abs(log[column]).max() <= TANKS[column] * (1.0 + 1e-12)
        rates = np.abs(np.diff(log[column])) / np.diff(family.times)
        assert 0.0 < rates.max() <= TANKS[f"{column}ps"] * (1.0 + 1e-9)
    manoeuvre = family.manoeuvre(family.start(rng))
    write_log(tmp_path / "manoeuvre.csv", {"time": manoeuvre.times} | manoeuvre.log)
    read = bs.load_manoeuvre(tmp_path / "manoeuvre.csv", vehicle)
    assert read.inputs == pytest.approx(manoeuvre.inputs, rel=1e-9, abs=1e-9)


def test_what_has_no_limit_stays_at_rest():
    """Of a tank of which nobody says how large it is, and of the density of the water, which no crew orders."""
    columns = [control.column for control in controls(equipped(), Limits())]
    assert "ballast_n" not in columns
    assert "trim_m" not in columns
    assert "side_n" in columns
    assert controls(bs.load_vehicle("slocum_comet"), Limits()) == ()
    (ballast,) = controls(bs.load_vehicle("slocum_comet"), Limits(ballast_n=2.0))
    assert (ballast.lower, ballast.upper, ballast.rate) == (-2.0, 2.0, np.inf)


@pytest.mark.slow
def test_a_boat_with_tanks_at_rest_flies_as_one_without():
    """Fins one by one, and actuators that do nothing, are the same boat."""
    plain, with_tanks = bs.load_vehicle("suboff"), equipped()
    flights = []
    for vehicle in (plain, with_tanks):
        moved = tuple(c for c in controls(vehicle, Limits()) if c.column.endswith("_deg"))
        family = Family("steps", vehicle, Limits(duration_s=100.0), moved, n_knots=5)
        numbers = np.random.default_rng(4).uniform(-0.5, 0.5, family.n_dims)
        flights.append(
            Simulator(vehicle, family.manoeuvre(numbers), np.linspace(0.0, 100.0, 11), dt=0.5).run(vehicle.xi[None])[0]
        )
    assert flights[0] == pytest.approx(flights[1], rel=1e-9, abs=1e-9)


def test_orders_of_a_helmsman_are_what_the_rudder_settles_at(rng):
    family = family_of("suboff", "steps", orders_an_hour=30.0, duration_s=1200.0)
    numbers = family.start(rng)
    times, rudder = family.orders(numbers)["rudder_deg"]
    assert np.diff(times) == pytest.approx(120.0, abs=2.0)
    manoeuvre = family.manoeuvre(numbers)
    late = np.interp(times + 100.0, manoeuvre.times, np.degrees(manoeuvre.log["delta_r"]))
    assert late == pytest.approx(rudder)
    assert family_of("suboff", "curves").orders(np.zeros(1)) == {}


def test_the_propeller_changes_no_faster_than_its_limit(rng):
    family = family_of("suboff", "steps", rpm_percentps=2.0)
    rpm = family.manoeuvre(family.start(rng)).rpm
    steady = family.vehicle.rpm_per_mps * family.vehicle.speed_mps
    fastest = np.abs(np.diff(rpm)).max() / (family.times[1] - family.times[0])
    assert fastest == pytest.approx(0.02 * steady)
