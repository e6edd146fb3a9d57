"""A thrust and a torque that the log has, in place of revolutions."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from support.refusals import refused

import bayesub as bs
from bayesub.inference.baselines import gauss_newton
from bayesub.model.simulator import Simulator
from bayesub.problem.priors import normal

MEASURED = {"model": "measured", "thrust_deduction": 0.2, "thrust_line_z_m": 0.5}
U = 6


@pytest.fixture
def measured(suboff_file, vehicle_with):
    return vehicle_with(tomllib.loads(suboff_file) | {"propulsion": MEASURED})


@pytest.fixture(scope="module")
def turning(suboff):
    """A zigzag with revolutions above those of self-propulsion, so that one branch of the thrust acts."""
    zigzag = bs.load_manoeuvre("zigzag_20_20", suboff)
    upto = zigzag.times <= 200.0
    faster = 1.2 + 0.1 * np.sin(zigzag.times[upto] / 20.0)
    parts = {"times": zigzag.times[upto], "controls": zigzag.controls[upto], "rpm": zigzag.rpm[upto] * faster}
    return replace(zigzag, subproblem="horizontal", **parts)


def thrust_of(vehicle, manoeuvre, states):
    """By equation 5.1 of the model manual, along states (n, 12) at the times of the controls."""
    u, ordered = states[:, U], manoeuvre.rpm / vehicle.rpm_per_mps
    assert np.all(ordered > u)
    b = vehicle.body[[bs.kernels.workspace.BODY.index(f"b{k}") for k in (1, 2, 3)]]
    return b[0] * u**2 + b[1] * u * ordered + b[2] * ordered**2


def pushed(vehicle, manoeuvre, thrust):
    """The manoeuvre with this thrust, of a boat that measures it."""
    inputs = np.column_stack([manoeuvre.controls, thrust, np.zeros(len(thrust))])
    return replace(manoeuvre, inputs=inputs, input_columns=vehicle.actuators.shorts)


def test_the_thrust_of_a_propeller_is_as_good_as_the_propeller(suboff, measured, turning):
    """The log of the thrust at the shaft, of which the deduction takes a fifth, flies the same track."""
    track = bs.simulate(suboff, turning, dt=0.1)
    thrust = thrust_of(suboff, turning, track.states[0]) / 0.8
    again = bs.simulate(measured, pushed(measured, turning, thrust), dt=0.1)
    np.testing.assert_allclose(again.states, track.states, rtol=0, atol=1e-3)
    assert {"thrust_n", "torque_nm", "delta_r"} < set(again.log)
    assert "rpm" not in measured.inputs


def test_without_a_column_it_balances_the_drag(measured):
    """A boat that nobody pushes more goes straight ahead at the speed of trials."""
    names = [actuator.name for actuator in measured.actuators.members]
    assert names == ["rudder", "bow_plane", "stern_plane", "thrust", "torque"]
    straight = bs.load_manoeuvre("zigzag_20_20", measured)
    rest = replace(straight, inputs=np.tile(measured.actuators.rest, (len(straight.times), 1)))
    track = bs.simulate(measured, rest, subproblem="horizontal", dt=0.5, sample=10.0)
    np.testing.assert_allclose(track.states[0, :, U], measured.speed_mps, rtol=1e-12)


def test_thrust_line_and_torque(measured):
    """Thrust below the origin lifts the bow, and a right-handed propeller rolls the hull to port."""
    steady = np.tile(measured.actuators.rest, (2, 1))
    steady[1, 3:] = 1e5, 2e4
    wrench = np.diff(measured.actuators.wrenches(steady, None), axis=0)[0]
    push = 0.8 * (1e5 - steady[0, 3])
    np.testing.assert_allclose(wrench[:6], [push, 0.0, 0.0, -2e4, 0.5 * push, 0.0], rtol=1e-12, atol=1e-9)


def test_a_log_has_thrust_in_place_of_revolutions(measured, tmp_path):
    rows = (f"{t},{5.0 * np.sin(t / 9.0)},{1e5 + 1e3 * t}" for t in range(60))
    (tmp_path / "controls.csv").write_text("\n".join(["time_s,rudder_deg,thrust_n", *rows]) + "\n")
    read = bs.load_manoeuvre(tmp_path / "controls.csv", measured)
    np.testing.assert_allclose(read.inputs[:, 3], 1e5 + 1e3 * np.arange(60))
    track = bs.simulate(measured, read, dt=0.5)
    track.save(tmp_path / "track.csv")
    assert "thrust_n" in (tmp_path / "track.csv").read_text().partition("\n")[0]


def test_a_gauge_that_reads_wrong(measured, turning):
    """Eight truths of its scale and bias come out beside a coefficient, and the blind fits are wrong.

    Twenty-four squares of standard normal errors; the probability of a sum outside is 1 in 1000.
    """
    thrust = measured.actuators.rest[3] * (1.5 + 0.6 * np.sin(turning.times / 25.0))
    manoeuvre = pushed(measured, turning, thrust)
    nuisance = {"scale_thrust": normal(1.0, 0.1), "bias_thrust_n": normal(0.0, 2e4)}
    sensors = [bs.sensors.Track(0.5, 0.1, interval_s=2.0), bs.sensors.Sensor("u_mps", 0.01, interval_s=2.0)]
    settings = {"free": ["Xuu"], "prior": bs.priors.relative_normal(0.2), "dt": 0.5}
    place, errors, blind = measured.equations.index["Xuu"], [], []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        truth = {name: prior.sample(rng, 1).item() for name, prior in nuisance.items()}
        xi = measured.xi.copy()
        xi[place] *= 1.0 + 0.1 * rng.standard_normal()
        track = bs.simulate(measured, manoeuvre, xi=xi, dt=0.25, actuators=truth)
        record = bs.observe(track, sensors, rng)
        fit = gauss_newton(bs.Problem(measured, manoeuvre, record, nuisance=nuisance, **settings))
        errors.append((fit.values - [xi[place], *truth.values()]) / np.sqrt(np.diag(fit.covariance)))
        fit = gauss_newton(bs.Problem(measured, manoeuvre, record, **settings))
        blind.append((fit.values[0] - xi[place]) / np.sqrt(fit.covariance[0, 0]))
    low, high = stats.chi2.ppf([0.0005, 0.9995], 24)
    assert low < np.sum(np.square(errors)) < high
    assert np.median(np.abs(blind)) > 5.0


def test_derivatives(measured, turning):
    """By scale and bias of the thrust, to the truncation of differences; the gauge may be late too."""
    thrust = measured.actuators.rest[3] * (1.5 + 0.6 * np.sin(turning.times / 25.0))
    names = ("scale_thrust", "bias_thrust_n", "delay_thrust_s")
    simulator = Simulator(
        measured, pushed(measured, turning, thrust), np.linspace(0.0, 200.0, 41), dt=0.5, varied=names
    )
    amounts = np.array([0.1, 1e3, 0.7])
    slopes = simulator.sensitivities(measured.xi, names, amounts=amounts)
    for k, size in enumerate((1e-4, 10.0, 1e-3)):
        steps = size * np.array([[1.0], [-1.0]]) * np.eye(3)[k]
        plus, minus = simulator.run(np.repeat(measured.xi[None], 2, axis=0), amounts=amounts + steps)[0]
        expected = (plus - minus) / (2 * size)
        scale = np.maximum(np.abs(expected).max(axis=0), 1e-15)
        np.testing.assert_allclose(slopes[..., k] / scale, expected / scale, rtol=0, atol=1e-4)


def test_refused(suboff_file, vehicle_with):
    content = tomllib.loads(suboff_file)
    with refused("value", "propulsion"):
        vehicle_with(content | {"propulsion": MEASURED | {"torque": [1.0, 0.0]}})
    thruster = {"kind": "thruster", "name": "thrust", "position_m": [0.0, 0.0, 0.0], "direction": [1.0, 0.0, 0.0]}
    with refused("conflict", "thrust_n"):
        vehicle_with(content | {"propulsion": MEASURED, "actuators": [thruster]})
