"""Ballast, sliding masses and hulls whose buoyancy follows the water: weights from outside."""

from dataclasses import replace

import numpy as np
import pytest
from support.fins import fins, with_actuators
from support.refusals import refused

import bayesub as bs
from bayesub.kernels import workspace
from bayesub.logs import log_files
from bayesub.model.actuator import Actuator, WaterColumn, with_water
from bayesub.model.simulator import Simulator
from bayesub.model.vehicles import GRAVITY_MPS2

BALLAST = {"kind": "ballast", "name": "ballast", "position_m": [20.0, 1.0, -2.0]}
SLIDING = {"kind": "sliding_mass", "name": "battery", "mass_kg": 4e4, "direction": [2.0, 0.0, 0.0]}
TIMES = np.linspace(0.0, 60.0, 61)
STERN = fins(90.0, 270.0, 0.0)


@pytest.fixture
def weighted(boat, vehicle_with):
    """weighted(**sections): the boat of the tests with fins, ballast and a sliding mass."""
    return lambda **sections: vehicle_with(with_actuators(boat, *STERN, BALLAST, SLIDING, **sections))


def flown(vehicle, inputs, **others):
    """The states (n_times, 12) of a vehicle with constant inputs, in six degrees of freedom, of a pitched start."""
    columns = vehicle.actuators.shorts
    values = np.tile(vehicle.actuators.rest, (len(TIMES), 1))
    for name, value in inputs.items():
        values[:, columns.index(name)] = value
    start = np.zeros(12)
    start[log_files.positions("u", "theta", "phi")] = vehicle.speed_mps, 0.2, 0.1
    rpm = np.full(len(TIMES), vehicle.rpm_per_mps * vehicle.speed_mps)
    controls = vehicle.actuators.mixed(values)
    manoeuvre = bs.Manoeuvre("m", TIMES, controls, rpm, start, inputs=values, input_columns=columns)
    return Simulator(vehicle, manoeuvre, TIMES, dt=0.5, **others).run(vehicle.xi)[0][0]


def with_body(vehicle, **changes):
    """The vehicle with other entries of the body vector."""
    body = np.array(vehicle.body)
    for name, value in changes.items():
        body[workspace.BODY.index(name)] += value
    return replace(vehicle, body=body)


def test_ballast_lifts_as_buoyancy_at_its_place(weighted):
    """A constant lift is buoyancy of the hull, with the centre of buoyancy where both together act."""
    vehicle, lift = weighted(), 3e4
    body = dict(zip(workspace.BODY, vehicle.body, strict=True))
    buoyancy = body["buoyancy"]
    centre = {
        f"{axis}B": (buoyancy * body[f"{axis}B"] + lift * at) / (buoyancy + lift) - body[f"{axis}B"]
        for axis, at in zip("xyz", BALLAST["position_m"], strict=True)
    }
    expected = flown(with_body(vehicle, buoyancy=lift, **centre), {})
    states = flown(vehicle, {"ballast_n": lift})
    np.testing.assert_allclose(states, expected, rtol=0, atol=1e-9)
    assert np.abs(states - flown(vehicle, {}))[-1, 2] > 1.0


def test_sliding_mass_shifts_the_weight(weighted):
    """Its moment about the origin is that of the centre of gravity that it shifts, of which the inertia stays."""
    vehicle, way = weighted(), 0.5
    moment = SLIDING["mass_kg"] * GRAVITY_MPS2 * way
    body = dict(zip(workspace.BODY, vehicle.body, strict=True))
    expected = flown(with_body(vehicle, xB=-moment / body["buoyancy"]), {})
    np.testing.assert_allclose(flown(vehicle, {"battery_m": way}), expected, rtol=0, atol=1e-9)


def test_hull_follows_density_and_pressure(weighted):
    """Denser water lifts as more buoyancy, and pressure takes a share of it."""
    vehicle = weighted(displacement={"compressibility_per_bar": 1e-4})
    buoyancy = vehicle.body[workspace.BODY.index("buoyancy")]
    share = 5.0 / vehicle.water_density_kgm3
    denser = flown(vehicle, {"density_anomaly_kgm3": 5.0})
    np.testing.assert_allclose(denser, flown(with_body(vehicle, buoyancy=share * buoyancy), {}), rtol=0, atol=1e-9)
    deep = flown(vehicle, {"pressure_bar": 10.0})
    np.testing.assert_allclose(deep, flown(with_body(vehicle, buoyancy=-1e-3 * buoyancy), {}), rtol=0, atol=1e-9)


def test_displaced_volume_becomes_lift_with_the_density_of_the_place():
    """A density that is read more rarely is interpolated; without it the lift is that in water of the vehicle file."""
    time, volume = np.arange(3.0), np.array([0.0, 100.0, -200.0])
    waters = {"b_n": WaterColumn("b_cm3", 1000.0), "density_anomaly_kgm3": WaterColumn(None, 1000.0)}
    nothing = np.zeros(1), *np.zeros((3, 6))
    columns = [Actuator("one", column, *nothing, water=water) for column, water in waters.items()]
    log = {"time": time, "b_cm3": volume, "density_kgm3": np.array([1000.0, np.nan, 1020.0]), "depth": time}
    values = with_water(log, columns)
    assert set(values) == {"time", "depth", "b_n", "density_anomaly_kgm3"}
    np.testing.assert_allclose(values["b_n"], GRAVITY_MPS2 * np.array([1000.0, 1010.0, 1020.0]) * volume * 1e-6)
    np.testing.assert_array_equal(values["density_anomaly_kgm3"], [0.0, np.nan, 20.0])
    alone = with_water({"time": time, "b_cm3": volume}, columns)
    np.testing.assert_allclose(alone["b_n"], GRAVITY_MPS2 * volume * 1e-3)
    assert "density_anomaly_kgm3" not in alone
    assert with_water({"time": time, "b_n": volume}, columns)["b_n"] is volume


def test_log_with_volumes_is_flown(weighted, tmp_path):
    """A control history with a displaced volume is that with the lift that follows."""
    vehicle = weighted()
    path = tmp_path / "log.csv"
    path.write_text("time_s,ballast_cm3,density_kgm3\n0,1e6,1030\n60,2e6,1010\n")
    manoeuvre = bs.load_manoeuvre(path, vehicle)
    lift = manoeuvre.log["ballast_n"]
    np.testing.assert_allclose(lift, GRAVITY_MPS2 * np.array([1030.0, 2020.0]))


def test_displacement_needs_an_array_of_actuators(boat, vehicle_with):
    """The plain table has no room for what the hull adds, and the names of the hull are taken."""
    with refused("conflict", "displacement"):
        vehicle_with(boat | {"displacement": {}})
    with refused("conflict", "volume"):
        vehicle_with(with_actuators(boat, *STERN, BALLAST | {"name": "volume"}, displacement={}))
