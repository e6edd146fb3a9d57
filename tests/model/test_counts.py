"""Actuators of which a log has counts, per cent or microseconds."""

from dataclasses import replace

import numpy as np
import pytest
from support.fins import BOW, PORT, X_TAIL, fins, with_actuators
from support.refusals import refused

import bayesub as bs
from bayesub.model.control_histories import ControlHistories
from bayesub.model.simulator import Simulator

UNIT_DEG, ZERO = 0.05, 512.0


def counted(*sections):
    return [
        section | {"column": f"{section['name']}_counts", "unit_deg": UNIT_DEG, "zero": ZERO} for section in sections
    ]


@pytest.fixture
def pair(boat, vehicle_with):
    """The same boat with fins in degrees and in counts."""
    plain = vehicle_with(with_actuators(boat, *fins(*X_TAIL), BOW))
    bow = BOW | {"column": "bow_percent", "unit_n": 300.0, "zero": 50.0}
    return plain, vehicle_with(with_actuators(boat, *counted(*fins(*X_TAIL)), bow))


def test_counts_move_a_boat_as_degrees_do(pair):
    """From the same orders, and in a log; the log of one is that of the other in its units."""
    plain, counts = pair
    tracks = [bs.simulate(boat, bs.load_manoeuvre("random:3", boat), dt=0.5, sample=5.0) for boat in pair]
    np.testing.assert_allclose(tracks[1].states, tracks[0].states, rtol=0, atol=1e-9)
    np.testing.assert_allclose(tracks[1].controls, tracks[0].controls, rtol=0, atol=1e-14)
    for k in range(1, 5):
        degrees = np.degrees(tracks[0].log[f"fin_{k}_deg"])
        np.testing.assert_allclose((tracks[1].log[f"fin_{k}_counts"] - ZERO) * UNIT_DEG, degrees, atol=1e-10)
    np.testing.assert_array_equal(tracks[1].log["bow_percent"], 50.0)
    assert counts.actuators.limits == pytest.approx(plain.actuators.limits)
    assert {"bias_fin_1_counts", "scale_fin_1", "bias_bow_percent"} <= set(counts.actuators.parameters)


def test_a_log_in_counts(pair, tmp_path):
    """Read back from a file it is the same manoeuvre."""
    _, counts = pair
    track = bs.simulate(counts, bs.load_manoeuvre("random:3", counts), dt=0.5, sample=0.5)
    track.save(tmp_path / "track.csv")
    table = (tmp_path / "track.csv").read_text().splitlines()
    columns = table[0].split(",")
    kept = [columns.index(name) for name in columns if name == "time_s" or "counts" in name or "percent" in name]
    rows = [",".join(line.split(",")[k] for k in kept) for line in table]
    (tmp_path / "controls.csv").write_text("\n".join(rows) + "\n")
    read = bs.load_manoeuvre(tmp_path / "controls.csv", counts)
    # To twelve digits of up to a thousand counts.
    np.testing.assert_allclose(read.controls, track.controls, rtol=0, atol=1e-11)


def test_biases_are_of_the_column(pair):
    """In counts, about the zero; of a scale the derivative is that of the counts from zero."""
    _, counts = pair
    manoeuvre = replace(bs.load_manoeuvre("random:3", counts), subproblem=None)
    names = ("bias_fin_2_counts", "scale_fin_2", "scale_bow", "delay_fin_1_s")
    amounts = np.array([[12.0, -0.2, 0.1, 0.3]])
    moved = manoeuvre.inputs.copy()
    moved[:, 1] = ZERO + 0.8 * (moved[:, 1] - ZERO) + 12.0
    times = np.linspace(0.0, 100.0, 21)
    changed = Simulator(counts, replace(manoeuvre, inputs=moved), times, dt=0.5, changes={"delay_fin_1_s": 0.3})
    simulator = Simulator(counts, manoeuvre, times, dt=0.5, varied=names)
    track = simulator.run(counts.xi, amounts=amounts)[0]
    np.testing.assert_allclose(track, changed.run(counts.xi)[0], rtol=0, atol=1e-9)
    assert isinstance(simulator.histories, ControlHistories)
    slopes = simulator.sensitivities(counts.xi, names, amounts=amounts[0])
    for k, size in enumerate((0.1, 1e-4, 1e-4, 1e-5)):
        steps = size * np.array([[1.0], [-1.0]]) * np.eye(4)[k]
        plus, minus = simulator.run(np.repeat(counts.xi[None], 2, axis=0), amounts=amounts + steps)[0]
        expected = (plus - minus) / (2 * size)
        scale = np.maximum(np.abs(expected).max(axis=0), 1e-12)
        np.testing.assert_allclose(slopes[..., k] / scale, expected / scale, rtol=0, atol=1e-4)


@pytest.mark.parametrize(
    ("changes", "kind", "key"),
    [
        ({"column": "fin_1_counts"}, "value", "actuators.0"),
        ({"unit_deg": 0.1}, "value", "actuators.0"),
        ({"column": "fin_1_volts", "unit_deg": 0.1}, "value", "actuators.0"),
    ],
)
def test_refused(boat, vehicle_with, changes, kind, key):
    first, *others = fins(*X_TAIL)
    with refused(kind, key):
        vehicle_with(with_actuators(boat, first | changes, *others))


def test_a_zigzag_steers_by_what_counts_do(pair):
    """A manoeuvre that answers the heading orders counts from their zero."""
    tracks = [bs.simulate(boat, bs.load_manoeuvre("zigzag_20_20", boat), dt=0.5, sample=5.0) for boat in pair]
    np.testing.assert_allclose(tracks[1].states, tracks[0].states, rtol=0, atol=1e-8)
    assert np.ptp(tracks[0].states[0, :, 5]) > 0.5


def test_a_late_propeller(boat, vehicle_with):
    """Its thrust goes with the square of its revolutions: the derivatives, and the motion of a shifted history."""
    vehicle = vehicle_with(with_actuators(boat, *fins(*X_TAIL), PORT, propulsion={"model": "none"}))
    bent = ["abs(" in term.regressor or "sgn(" in term.regressor for term in vehicle.equations.terms]
    xi = np.where(bent, 0.0, vehicle.xi)
    manoeuvre = bs.load_manoeuvre("random:3", vehicle)
    inputs = manoeuvre.inputs.copy()
    inputs[:, 4] *= 1.0 + 0.3 * np.sin(manoeuvre.times / 7.0)
    pushed = replace(manoeuvre, inputs=inputs)
    names, times = ("delay_port_s", "scale_port"), np.linspace(0.0, 60.0, 13)
    simulator = Simulator(vehicle, pushed, times, dt=0.5, varied=names)
    amounts = np.array([0.8, -0.1])
    track = simulator.run(xi, amounts=amounts[None])[0]
    late = inputs.copy()
    late[:, 4] = np.interp(manoeuvre.times - 0.8, manoeuvre.times, inputs[:, 4])
    shifted = replace(manoeuvre, inputs=late)
    expected = Simulator(vehicle, shifted, times, dt=0.5, changes={"scale_port": -0.1}).run(xi)[0]
    np.testing.assert_allclose(track, expected, rtol=0, atol=1e-3)
    slopes = simulator.sensitivities(xi, names, amounts=amounts)
    for k, size in enumerate((1e-4, 1e-4)):
        steps = size * np.array([[1.0], [-1.0]]) * np.eye(2)[k]
        plus, minus = simulator.run(np.repeat(xi[None], 2, axis=0), amounts=amounts + steps)[0]
        expected = (plus - minus) / (2 * size)
        scale = np.maximum(np.abs(expected).max(axis=0), 1e-12)
        np.testing.assert_allclose(slopes[..., k] / scale, expected / scale, rtol=0, atol=1e-5)
