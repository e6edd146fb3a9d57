"""Tangent-linear sensitivities against the slow twin, differences of the simulator, and laws of geometry."""

import copy
import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from support import slow_twin
from support.motions import smooth_manoeuvre
from support.refusals import refused

import bayesub as bs
from bayesub.kernels.workspace import BODY
from bayesub.logs.log_files import OUTPUTS, STATES
from bayesub.model.coefficients import HORIZONTAL, INDEX, NAMES
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.simulator import Simulator

INITIAL = tuple(f"{state}0" for state in STATES)
# Eighth-order central differences.
OFFSETS = np.array([-4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0])
WEIGHTS = np.array([3.0, -32.0, 168.0, -672.0, 672.0, -168.0, 32.0, -3.0]) / 840.0


def differences(simulator, names, relative=2e-3, outputs=STATES):
    """Derivatives of the simulated motion by coefficients, (n_times, 12, n): slow, and independent of the kernel."""
    columns = []
    for name in names:
        k = INDEX[name]
        step = relative * abs(simulator.vehicle.xi[k])
        sets = np.repeat(simulator.vehicle.xi[None], len(OFFSETS), axis=0)
        sets[:, k] += step * OFFSETS
        states, _ = simulator.run(sets, outputs=outputs)
        columns.append(np.tensordot(WEIGHTS, states, axes=1) / step)
    return np.stack(columns, axis=-1)


def relative_error(found, expected):
    """Largest error of each state and parameter in units of its largest derivative."""
    size = np.abs(found).max(axis=0)
    return np.abs(found - expected).max(axis=0) / np.where(size > 0, size, 1.0)


@pytest.fixture(scope="module")
def turning(full):
    """The full boat in an unsteady turn with every velocity, rate and control away from zero."""
    manoeuvre = smooth_manoeuvre(full, 6.0, spacing=0.5)
    initial = np.array([10.0, -20.0, 90.0, 0.1, -0.08, 0.5, 7.0, 0.6, -0.9, -0.011, -0.006, 0.03])
    controls = manoeuvre.controls + np.array([0.1, -0.03, 0.04])
    return Manoeuvre("turning", manoeuvre.times, controls, manoeuvre.rpm, initial)


@pytest.fixture(scope="module")
def twin_flight(boat, turning):
    """twin_flight(setter, value): states of the slow twin after setter(boat, initial state, value)."""

    def history(t):
        planes = [np.interp(t, turning.times, column) for column in turning.controls.T]
        return planes, np.interp(t, turning.times, turning.rpm)

    def flight(setter, value):
        content, initial = copy.deepcopy(boat), turning.initial_state.copy()
        setter(content, initial, value)
        return slow_twin.fly(content, initial, history, 0.5, 4)

    return flight


def test_all_parameters_against_the_twin(full, boat, turning, twin_flight):
    """Every coefficient, body number and initial state moves the motion as it does in the twin."""
    simulator = Simulator(full, turning, [0.5, 1.0, 1.5, 2.0], dt=0.5)
    names = (*NAMES, *BODY, *INITIAL)
    found = dict(zip(names, np.moveaxis(simulator.sensitivities(full.xi, names), -1, 0), strict=True))
    # In the file a mass has its weight with it, and the torque is per rpm.
    found["mass"] = found["mass"] + 9.81 * found.pop("weight")
    found["Kn1"] *= full.rpm_per_mps**2
    found["Kn2"] *= full.rpm_per_mps

    body, propulsion, inertia = boat["body"], boat["propulsion"], boat["body"]["inertia_kgm2"]

    def size_and_setter(name):
        if name in INDEX:
            return boat["coefficients"][name], lambda c, _, v: c["coefficients"].update({name: v})
        if name in inertia:
            return inertia[name], lambda c, _, v: c["body"]["inertia_kgm2"].update({name: v})
        if name[-1] in "GB" and len(name) == 2:
            key, n = {"G": "centre_of_gravity_m", "B": "centre_of_buoyancy_m"}[name[-1]], "xyz".index(name[0])
            return body[key][n], lambda c, _, v: c["body"][key].__setitem__(n, v)
        if name[0] == "b" and name[1:].isdigit():
            n = int(name[1:]) - 1
            return propulsion["b"][n], lambda c, _, v: c["propulsion"]["b"].__setitem__(n, v)
        if name in ("Kn1", "Kn2"):
            n = int(name[-1]) - 1
            return propulsion["torque"][n], lambda c, _, v: c["propulsion"]["torque"].__setitem__(n, v)
        if name in INITIAL:
            n = INITIAL.index(name)
            return turning.initial_state[n], lambda _, s, v: s.__setitem__(n, v)
        section, key = {
            "mass": ("body", "mass_kg"),
            "buoyancy": ("body", "buoyancy_n"),
            "zP": ("propulsion", "thrust_line_z_m"),
        }[name]
        return boat[section][key], lambda c, _, v: c[section].update({key: v})

    for name, derivative in found.items():
        value, setter = size_and_setter(name)
        step = 1e-3 * abs(value)
        inner, outer = (twin_flight(setter, value + d * step) - twin_flight(setter, value - d * step) for d in (1, 2))
        expected = ((8 * inner - outer) / (12 * step))[1:]
        # The force models agree to 1e-12, and so do the states, whose difference is taken over a thousandth of a value.
        noise = 1e-12 * np.array([100, 100, 100, 1, 1, 1, 10, 1, 1, 0.01, 0.01, 0.01]) / step
        error = np.abs(derivative - expected)
        assert np.all(error <= 1e-8 * np.abs(expected).max(axis=0) + noise), name


@pytest.mark.parametrize(("name", "manoeuvre"), [("suboff", "horizontal"), ("auv690", "vertical")])
def test_against_differences_on_a_trial(name, manoeuvre):
    """On ten minutes of manoeuvring too, at output times between the steps, with either convention of the controls."""
    boat = bs.load_vehicle(name)
    trial = bs.load_manoeuvre(manoeuvre, boat)
    step = Simulator(boat, trial, [trial.duration]).step
    times = np.linspace(0.37 * step, trial.duration, 101)
    for controls in ("linear", "hold"):
        simulator = Simulator(boat, trial, times, dt=step, controls=controls)
        names = [n for n in NAMES if simulator.vehicle.xi[INDEX[n]] != 0.0]
        found = simulator.sensitivities(boat.xi, names)
        # Large differences see the corners of the forces (a velocity that changes sign a little earlier), small ones
        # lose digits: a parameter is right when one of the two agrees.
        large, small = (relative_error(found, differences(simulator, names, step)) for step in (2e-3, 2e-5))
        assert np.median(large) < 1e-10
        assert np.minimum(large, small).max() < 1e-6


def test_smooth_motion_to_the_differences_own_accuracy(full, turning):
    """Where no velocity changes sign the agreement is that of round-off in the differences."""
    simulator = Simulator(full, turning, np.linspace(0.1, 4.0, 9), dt=0.25)
    assert np.all(np.diff(np.sign(simulator.run(full.xi)[0][0, :, 6:]), axis=0) == 0)
    error = relative_error(simulator.sensitivities(full.xi, NAMES), differences(simulator, NAMES, 0.01))
    # A coefficient that moves the boat by a micrometre leaves few digits in a difference of positions of 50 m.
    assert np.median(error) < 1e-10
    assert error.max() < 1e-5


@pytest.mark.parametrize("times", [np.arange(1, 17) * 0.25, np.linspace(0.1, 4.0, 9)], ids=["on steps", "between"])
def test_accelerations_too(full, turning, times):
    """Accelerations, at the ends of steps and between them, have the derivatives of their differences."""
    simulator = Simulator(full, turning, times, dt=0.25)
    found = simulator.sensitivities(full.xi, NAMES, OUTPUTS)
    error = relative_error(found, differences(simulator, NAMES, 0.01, outputs=OUTPUTS))
    # Between steps a rate is a difference of velocities over the step: their round-off, divided by the step.
    assert np.median(error[12:]) < 1e-9
    assert error.max() < 1e-5


def test_start_position_and_heading_are_geometry(suboff, spiral):
    """Moving the start moves the track along; turning the start turns it about the start."""
    simulator = Simulator(suboff, spiral, np.linspace(1.0, 600.0, 40), dt=1.0)
    states = simulator.run(suboff.xi)[0][0]
    found = simulator.sensitivities(suboff.xi, ("x0", "y0", "psi0"), ("x", "y", "psi", "u"))
    np.testing.assert_allclose(found[:, :, 0], np.tile([1.0, 0.0, 0.0, 0.0], (40, 1)), rtol=1e-15)
    np.testing.assert_allclose(found[:, :, 1], np.tile([0.0, 1.0, 0.0, 0.0], (40, 1)), rtol=1e-15)
    turned = np.stack([-states[:, 1], states[:, 0], np.ones(40), np.zeros(40)], axis=1)
    np.testing.assert_allclose(found[:, :, 2], turned, rtol=1e-12, atol=1e-9)


def test_parts_without_a_part_have_no_effect(suboff, spiral):
    """What a sub-problem leaves out does not move the boat, and neither do bow planes at rest."""
    simulator = Simulator(suboff, spiral, [100.0, 600.0], dt=1.0)
    idle = [name for name in NAMES if name not in HORIZONTAL] + ["zG", "weight", "Ixy", "zP"]
    np.testing.assert_array_equal(simulator.sensitivities(suboff.xi, idle), 0.0)
    assert np.abs(simulator.sensitivities(suboff.xi, ["mass", "Izz", "b1", "b4"])).max(axis=(0, 1)).min() > 0


def test_only_what_is_asked_for(full, turning):
    """Names and states may come in any order and number, and a column does not depend on its neighbours."""
    simulator = Simulator(full, turning, [2.0, 6.0], dt=0.5)
    everything = simulator.sensitivities(full.xi, (*NAMES, *BODY, *INITIAL))
    part = simulator.sensitivities(full.xi, ("zG", "Nur", "q0", "Xuu"), ("psi", "x"))
    columns = [101 + BODY.index("zG"), INDEX["Nur"], 101 + len(BODY) + STATES.index("q"), INDEX["Xuu"]]
    np.testing.assert_array_equal(part, everything[:, [5, 0]][:, :, columns])


TWO_THREADS = """
import numba
import numpy as np
import bayesub as bs
from bayesub.kernels import noise
from bayesub.model.simulator import Simulator

assert numba.get_num_threads() == 2
boat = bs.load_vehicle("suboff")
simulator = Simulator(boat, bs.load_manoeuvre("horizontal", boat), np.linspace(0.5, 200.0, 12), dt=1.0)
xi = boat.xi * np.random.default_rng(1).uniform(0.99, 1.01, (40, 101))

def found():
    states, _ = simulator.run(xi)
    squares = noise.sums_of_squares(states.reshape(40, -1), states[0].ravel())
    return states, squares, simulator.sensitivities(boat.xi, boat.equations.names)

several = found()
numba.set_num_threads(1)
for one, two in zip(found(), several, strict=True):
    np.testing.assert_array_equal(one, two)
np.testing.assert_array_equal(simulator.run(xi, parallel=False)[0], several[0])
"""


def test_threads_do_not_matter():
    """One thread and two give the same bits, of states, of sums over readings and of derivatives."""
    environment = os.environ | {"NUMBA_NUM_THREADS": "2"}
    done = subprocess.run(
        [sys.executable, "-c", TWO_THREADS], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_not_a_number_from_the_failure_on(suboff, spiral):
    """A boat that diverges has sensitivities up to there and none afterwards."""
    xi = suboff.xi.copy()
    xi[INDEX["Xuu"]] = 0.02
    simulator = Simulator(suboff, spiral, np.arange(1.0, 601.0), dt=1.0)
    states, status = simulator.run(xi)
    found = simulator.sensitivities(xi, ["Xuu", "Nur"])
    assert status[0] == 1
    np.testing.assert_array_equal(np.isnan(found).any(axis=(1, 2)), np.isnan(states[0]).any(axis=1))


def test_what_cannot_be_asked(suboff, spiral):
    """Unknown parameters and the quaternion attitude are refused by name."""
    with refused("unknown", "Nurr"):
        Simulator(suboff, spiral, [1.0], dt=1.0).sensitivities(suboff.xi, ["Nurr"])
    with refused("conflict", "attitude"):
        Simulator(suboff, spiral, [1.0], dt=1.0, attitude="quaternion").sensitivities(suboff.xi, ["Nur"])


def test_negative_control(full, turning):
    """The comparison with differences notices a derivative that is one part in a million off."""
    simulator = Simulator(full, turning, np.linspace(0.1, 6.0, 13), dt=0.25)
    wrong = replace(full, xi=full.xi * (1 + 1e-6 * (np.array(NAMES) == "Yuv")))
    found = simulator.sensitivities(wrong.xi, ["Yuv"])
    assert relative_error(found, differences(simulator, ["Yuv"])).max() > 1e-9
