"""Random limits files of any boat: a design or a refusal in one line, never anything else."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import bayesub as bs
from bayesub.design import information as goals
from bayesub.design.families import KINDS, LENGTHS, Family, controls
from bayesub.design.judge import Judge
from bayesub.design.limits import Limits, Range, load_limits
from bayesub.design.search import Cost
from bayesub.io.errors import InputError
from bayesub.sensors import Sensor
from richest.options import equipped

NUMBERS = st.one_of(
    st.floats(-1e3, 1e3),
    st.floats(allow_nan=True, allow_infinity=True),
    st.sampled_from([0.0, -0.0, 1e-300, 1e300, 5e-324, 1.0, 100.0, -1.0]),
)
CONTROLS = st.sampled_from(
    ["rudder_deg", "rudder_degps", "stern_plane_deg", "bow_plane_degps", "ballast_n", "ballast_nps", "trim_m", "rpm"]
)
KEYS = st.one_of(st.sampled_from(sorted(Limits.model_fields)), CONTROLS, st.text("abdeg_", min_size=1, max_size=9))
VALUES = st.one_of(NUMBERS, st.integers(-10, 10_000), st.booleans(), st.text("ab1", max_size=3))
VEHICLES = ("suboff", "auv690", "npsauv", "mariner", "equipped")


@cache
def vehicle_of(name):
    return equipped() if name == "equipped" else bs.load_vehicle(name)


def toml(value):
    if isinstance(value, float):
        return {math.inf: "inf", -math.inf: "-inf"}.get(value, "nan" if math.isnan(value) else repr(value))
    return str(value).lower() if isinstance(value, bool) else f'"{value}"' if isinstance(value, str) else repr(value)


def cost_of(vehicle, limits, kind, interval):
    """What a search asks for the cost of numbers; limits that straight flight breaks are refused."""
    family = Family(kind, vehicle, limits, controls(vehicle, limits), n_knots=5)
    step = 0.25 * vehicle.length_m / vehicle.speed_mps
    draws = np.tile(vehicle.xi, (2, 1)) * [[1.1], [0.9]]
    kept = Range(vehicle, limits, draws, None, step)
    kept.refuse(family.straight())
    sensors = tuple(Sensor(column, 0.1, interval_s=interval) for column in ("yaw_deg", "u_mps"))
    return Cost(Judge(vehicle, sensors, step_s=step), kept, (family,), goals.Known(0.1))


def refusal(vehicle, path, kind, numbers):
    """The message with which limits are refused; empty if they give a cost and a manoeuvre that are numbers."""
    try:
        cost = cost_of(vehicle, load_limits(path), kind, 20.0)
        numbers = np.resize(numbers, cost.n_dims)
        assert math.isfinite(cost(numbers))
        (manoeuvre,) = cost.manoeuvres(numbers)
    except InputError as error:
        return str(error)
    assert np.isfinite(manoeuvre.controls).all()
    assert np.isfinite(manoeuvre.rpm).all()
    return ""


@settings(max_examples=150, deadline=None)
@given(
    st.dictionaries(KEYS, VALUES, max_size=5),
    st.sampled_from(VEHICLES),
    st.sampled_from(sorted(KINDS)),
    st.lists(st.floats(-1.5, 1.5), min_size=1, max_size=20),
)
@example({"ballast_n": 1.5e154}, "equipped", "curves", [1.0])  # whose square is no number
@pytest.mark.slow
def test_any_limits_of_any_boat(tmp_path_factory, content, name, kind, numbers):
    vehicle = vehicle_of(name)
    path = tmp_path_factory.mktemp("limits") / "limits.toml"
    path.write_text("".join(f"{key} = {toml(value)}\n" for key, value in content.items()), encoding="utf-8")
    message = refusal(vehicle, path, kind, numbers)
    assert "\n" not in message
    assert not message or 10 < len(message) < 500


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(VEHICLES),
    st.integers(0, 10_000),
    st.sampled_from([0.1, 1.0, 30.0]),
    st.sampled_from(sorted(KINDS)),
)
@pytest.mark.slow
def test_boats_of_any_coefficients(tmp_path_factory, name, seed, spread, kind):
    """Coefficients from a tenth off to thirty times as large and of the other sign: some boats fly, some do not."""
    vehicle, rng = vehicle_of(name), np.random.default_rng(seed)
    boat = replace(vehicle, xi=vehicle.xi * (1.0 + spread * rng.standard_normal(len(vehicle.xi))))
    path = tmp_path_factory.mktemp("limits") / "limits.toml"
    path.write_text("pitch_deg = 60.0\nroll_deg = 60.0\n", encoding="utf-8")
    message = refusal(boat, path, kind, rng.uniform(-1.0, 1.0, 20))
    assert "\n" not in message
    assert not message or "straight flight" in message or "mass" in message


LENIENT = {
    "duration_s": st.floats(0.1, 3.0),
    "orders_an_hour": st.floats(0.1, 1e4),
    "depth_change_m": st.floats(0.01, 10.0),
    "pitch_deg": st.floats(0.1, 90.0),
    "roll_deg": st.floats(0.1, 90.0),
    "min_rpm_percent": st.floats(0.0, 100.0),
    "max_rpm_percent": st.floats(100.0, 200.0),
    "share_of_draws": st.floats(0.0, 1.0),
    "rudder_deg": st.floats(1e-6, 90.0),
    "rudder_degps": st.floats(1e-6, 1e3),
}


@settings(max_examples=100, deadline=None)
@given(
    st.fixed_dictionaries({}, optional=LENIENT),
    st.sampled_from(VEHICLES),
    st.sampled_from(sorted(KINDS)),
    st.lists(st.floats(-1.5, 1.5), min_size=1, max_size=20),
)
def test_sensible_limits_give_a_cost(content, name, kind, numbers):
    """The duration is a share of the usual one, the change of depth one of the length."""
    vehicle = vehicle_of(name)
    usual = LENGTHS * vehicle.length_m / vehicle.speed_mps
    content = content | {"duration_s": content.get("duration_s", 1.0) * usual}
    if "depth_change_m" in content:
        content["depth_change_m"] *= vehicle.length_m
    cost = cost_of(vehicle, Limits(**content), kind, usual / 30.0)
    assert math.isfinite(cost(np.resize(numbers, cost.n_dims)))
