"""The lines of the card of a vehicle about its actuators."""

import pytest

import bayesub as bs
from bayesub.findings import actuator_examination, vehicle_examinations


def test_card_of_a_glider_says_what_ballast_and_water_do():
    """A newton of lift, a denser water and a bar of pressure, with the boat on even keel."""
    glider = bs.load_vehicle("slocum_comet")
    numbers = actuator_examination.actuators(glider).numbers
    assert numbers["actuators"]["ballast_n"]["forces"] == {"Z": -1.0}
    volume = 70.0 / 1004.0
    assert numbers["actuators"]["density_anomaly_kgm3"]["forces"]["Z"] == pytest.approx(-9.81 * volume)
    assert numbers["actuators"]["pressure_bar"]["forces"]["Z"] == pytest.approx(70.0 * 9.81 * 5e-5)
    lines = actuator_examination.lines(numbers)
    assert lines["ballast_n"] == "1 N make Z -1 N"
    assert lines["density_anomaly_kgm3"].startswith("1 kg/m3 make Z -0.68")


def test_a_glider_has_no_thrust_to_balance():
    """It is driven by its weight: neither thrust nor a straight flight on even keel is looked at."""
    glider = bs.load_vehicle("slocum_comet")
    for examine in (vehicle_examinations.balance, vehicle_examinations.straight_flight):
        examination = examine(glider)
        assert not examination.warnings
        assert set(examination.skipped.values()) == {"the boat has no thrust and is driven by its weight"}
