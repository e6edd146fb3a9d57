"""The simulator of strangers flies what ours flies, its forces are the process they should be, and its log is read."""

import importlib

import numpy as np
import pytest

import bayesub as bs
from bayesub.model.disturbance import ForceHistory
from bayesub.model.manoeuvre_files import straight_and_level
from bayesub.model.manoeuvres import of_inputs
from bayesub.model.simulator import Simulator
from bayesub.model.vehicles import load_vehicle
from disturbed import strangers
from disturbed.trials import DisturbedTrials, Truth, read_log

PLANE = [0, 1, 5, 6, 7, 11]  # x y psi u v r among the states


@pytest.fixture(scope="module")
def boat():
    return load_vehicle(strangers.VEHICLE)


def truth_and_inputs(rng, duration):
    """Coefficients off the vehicle's, none of them zero; times, a rudder that is seldom still, and forces."""
    truth = strangers.Boat().coefficients
    truth = {name: (value or 1e-4) * (1.0 + 0.2 * rng.standard_normal()) for name, value in truth.items()}
    times = strangers.STEP_S * np.arange(round(duration / strangers.STEP_S) + 1)
    demands = [(1.0, 20.0), (8.0, -30.0), (9.0, 10.0)]
    rudder = np.radians(strangers.rudder_of(demands, times, strangers.Boat().actuators))
    return truth, times, rudder, strangers.pushes(rng, len(times), np.array([2.0, 3.0, 5.0]))


def test_the_other_simulator_flies_what_ours_flies(boat):
    """With the same forces, the same rudder and every coefficient of the plane, to a ten-millionth of a metre."""
    truth, times, rudder, forces = truth_and_inputs(np.random.default_rng(1), 20.0)
    theirs = strangers.Boat(truth).flown(times, rudder, forces, 1.7)
    start = straight_and_level(boat)
    start[6] = 1.7
    inputs = np.column_stack([rudder, np.zeros((len(times), 2))])
    rpm = np.full(len(times), strangers.RPM)
    manoeuvre = of_inputs("theirs", times, inputs, rpm, start, boat, subproblem="horizontal")
    xi = boat.xi.copy()
    xi[boat.equations.columns(truth)] = list(truth.values())
    history = ForceHistory(times, ("X", "Y", "N"), forces)
    ours = Simulator(boat, manoeuvre, times, dt=strangers.STEP_S, forces=history).trajectory(xi)
    assert np.abs(ours.states[0][:, PLANE] - theirs).max() < 1e-7
    assert np.abs(theirs[-1] - strangers.Boat(truth).flown(times, rudder, 0.0 * forces, 1.7)[-1]).max() > 0.01


def test_the_rudder_follows_its_demand_by_lag_and_rate():
    """15 degrees a second until 4.5 degrees are left, then an exponential of 0.3 s; a new demand begins where it is."""
    times = strangers.STEP_S * np.arange(101)
    angles = strangers.rudder_of([(1.0, 30.0), (2.0, 0.0)], times, strangers.Boat().actuators)
    assert angles[20] == 0.0
    assert angles[30] == pytest.approx(7.5)
    assert angles[40] == pytest.approx(15.0)
    assert angles[50] == pytest.approx(7.5)
    assert angles[60] == pytest.approx(4.5 * np.exp(-1.0))  # 0.7 s at the limit, and 0.3 s


def test_pushes_have_their_sd_and_correlation_time():
    """Over 500 correlation times the variance is right within four of its standard errors, and so is the memory."""
    sds, n_times = np.array([1.0, 4.0]), 500 * round(strangers.TIME_S / strangers.STEP_S)
    values = strangers.pushes(np.random.default_rng(2), n_times, sds) / sds
    error = 4.0 / np.sqrt(500.0)
    later = round(strangers.TIME_S / strangers.STEP_S)
    assert np.abs(np.mean(values**2, axis=0) - 1.0).max() < error
    assert np.abs(np.mean(values[later:] * values[:-later], axis=0) - np.exp(-1.0)).max() < error


def test_a_boat_that_cannot_be_is_not_flown():
    """An added mass that makes the inertia negative, and a hull that is driven away by its own drag."""
    _, times, rudder, forces = truth_and_inputs(np.random.default_rng(3), 20.0)
    for wrong in ({"Yvdot": 1.0}, {"Xuu": 1.0}):
        assert strangers.Boat(wrong).flown(times, rudder, forces, 1.7) is None


def test_a_log_is_read_as_one_of_a_stranger(boat):
    """Six channels at 1 Hz, the plane's coefficients that the vehicle has, and forces on three axes."""
    truth, log, _ = strangers.boat_and_log(np.random.default_rng(4), duration_s=12.0)
    setup = read_log(log, strangers.STUDY)
    problem = setup.problem
    assert [channel.name for channel in problem.record.channels] == ["x", "y", "heading", "u", "v", "r"]
    assert problem.record.n_readings == 6 * 12
    free = [name for name in truth if boat.xi[boat.equations.columns([name])[0]] != 0.0]
    assert sorted(problem.names[: problem.n_coefficients]) == sorted(free)
    inferred = {*(f"sd_disturbance_{axis}" for axis in "XYN"), "correlation_time_disturbance_s"}
    assert inferred <= set(problem.names)


def test_a_search_goes_on_where_the_best_history_fails(monkeypatch):
    """With few sensors and much force it takes a share of the step; negative control: without it ends far off."""
    trials = DisturbedTrials("auv690", [bs.sensors.Track(0.034, 0.1, interval_s=1.0, channels=("x", "y", "yaw"))], 0.25)
    truth = Truth(0.05, 4.0)
    _, record, _ = trials.boat_and_record(truth, 0.1, np.random.default_rng([20, 1, 3]))
    problem = trials.problem(record, dt=0.2, disturbance=trials.known(truth))
    module = importlib.import_module("bayesub.inference.baselines.gauss_newton")
    found = module.gauss_newton(problem).costs[0]
    assert found < 2.0 * problem.n_rows
    monkeypatch.setattr(module, "_SHARES", np.ones(1))
    assert module.gauss_newton(problem).costs[0] > 100.0 * found
