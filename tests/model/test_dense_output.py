"""The motion between the steps of the integrator: its own, its derivative by time, and its order."""

import numpy as np
import pytest
from support.motions import smooth_manoeuvre

from bayesub.model.dense_output import DenseOutput
from bayesub.model.simulator import Simulator

OUTPUTS = ("x", "y", "psi", "u", "v", "r", "udot", "rdot")
END = 36.3  # not a multiple of the step


@pytest.fixture(scope="module")
def simulated(suboff):
    """simulated(step, end) of a smooth manoeuvre in the horizontal plane."""
    manoeuvre = smooth_manoeuvre(suboff, 40.0)
    return lambda step, end=END: Simulator(suboff, manoeuvre, np.array([end]), dt=step, subproblem="horizontal")


def between(simulator, times, **options):
    """Outputs at times (n_batch, n), and their derivatives by two coefficients."""
    dense = DenseOutput(simulator.step, simulator.times[-1])
    pieces = dense.pieces(times)
    looked = np.unique(pieces)
    sets = np.repeat(simulator.vehicle.xi[None], len(times), axis=0)
    outputs, _ = simulator.run(sets, outputs=OUTPUTS, times=dense.looks(looked))
    return dense.at(times, pieces, looked, outputs, **options)


@pytest.mark.parametrize("end", [END, 36.0])
def test_it_is_the_motion_of_the_integrator(simulated, suboff, rng, end):
    """At times of their own, members have what the integrator gives at these, to round-off; also in the last piece."""
    simulator = simulated(0.5, end)
    times = np.sort(rng.uniform(0.0, end, (3, 50)), axis=1)
    times[0, :3] = 0.0, 0.5, 1.0  # on steps
    times[:, -1] = end
    found = between(simulator, times)
    for member, own in zip(found, times, strict=True):
        expected = simulator.at(own).run(suboff.xi[None], outputs=OUTPUTS)[0][0]
        np.testing.assert_allclose(member, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_the_derivatives_by_parameters_are_those_of_the_integrator(simulated, suboff, rng):
    simulator, dense = simulated(0.5), DenseOutput(0.5, END)
    own = np.sort(rng.uniform(0.0, END, 40))
    pieces = dense.pieces(own[None])
    looked = np.unique(pieces)
    looks = simulator.sensitivities(suboff.xi, ("Xuu", "Nuv"), OUTPUTS, times=dense.looks(looked))
    found = dense.at(own[None], pieces, looked, looks.reshape(1, len(looks), -1)).reshape(40, len(OUTPUTS), 2)
    expected = simulator.at(own).sensitivities(suboff.xi, ("Xuu", "Nuv"), OUTPUTS)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_rates_are_derivatives_by_time(simulated, rng):
    """Within a step differences of a cubic are exact but for round-off; accelerations are the rates of velocities."""
    simulator, step = simulated(0.5), 1e-3
    times = 0.5 * np.arange(1, 70)[None] + rng.uniform(0.05, 0.45, (2, 69))
    ends = [between(simulator, times + k * step) for k in (-2, -1, 1, 2)]
    differences = (8 * (ends[2] - ends[1]) - (ends[3] - ends[0])) / (12 * step)
    rates = between(simulator, times, rates=True)
    for k, name in enumerate(OUTPUTS):
        scale = np.abs(differences[..., k]).max()
        np.testing.assert_allclose(rates[..., k] / scale, differences[..., k] / scale, rtol=0, atol=1e-9, err_msg=name)
    values = between(simulator, times)
    np.testing.assert_allclose(rates[..., OUTPUTS.index("u")], values[..., OUTPUTS.index("udot")], rtol=0, atol=1e-12)


@pytest.mark.parametrize("rates", [False, True])
def test_order(suboff, rng, rates):
    """The order of the error is four for states, three for their rates, and two for the rates of accelerations."""
    manoeuvre = smooth_manoeuvre(suboff, 40.0, spacing=1 / 2048)  # so that no step sees its corners
    times = np.sort(rng.uniform(4.0, 32.0, (1, 200)), axis=1)
    found = {
        step: between(Simulator(suboff, manoeuvre, [END], dt=step, subproblem="horizontal"), times, rates=rates)
        for step in (1.0, 0.5, 1 / 32)
    }
    coarse, fine = (np.abs(found[step] - found[1 / 32]).max(axis=(0, 1)) for step in (1.0, 0.5))
    orders = np.array([3.0 if name.endswith("dot") else 4.0 for name in OUTPUTS]) - rates
    np.testing.assert_allclose(np.log2(coarse / fine), orders, rtol=0, atol=0.25)
