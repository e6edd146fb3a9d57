"""What a user would write instead of the simulator: it computes the same, and is no worse than it could be."""

import shutil
import subprocess

import numpy as np
import pytest
from numba.core.runtime import _nrt_python, rtsys

from bayesub.cli import cpp_simulator, jax_simulator, rivals, scalar_simulator
from bayesub.cli.right_hand_side import followed
from bayesub.cli.scalar_simulator import perturbed, spiral
from bayesub.io.errors import InputError
from bayesub.kernels.workspace import LANES, N_STATES, STAGE, SUM

AGREEMENT_M = rivals.AGREEMENT_M


@pytest.fixture(scope="module")
def simulator():
    return spiral(1.0)


@pytest.fixture(scope="module")
def expected(simulator):
    return simulator.run(simulator.vehicle.xi)[0][0]


def test_equations_that_are_followed_are_those_of_the_kernels(full, motions):
    """Followed by plain numbers they give the same rates for all terms, in every branch; not with branches swapped."""
    kernels = full.kernels(None)
    states, controls, rpm = motions
    choices = {"followed": lambda test, a, b: a if test else b, "swapped": lambda test, a, b: b if test else a}
    derivatives = {name: followed(kernels.dynamics.euler_derivative, choose=choose) for name, choose in choices.items()}
    rates = {name: np.empty_like(states) for name in ("kernel", *choices)}
    dimensional = (full.xi * full.dimensional_factors)[None]
    body = np.concatenate([full.body, full.constants])[None]
    work = np.zeros((kernels.layout.N_ROWS, LANES))
    kernels.integrate.load_block(work.ravel(), 0, dimensional, body, states[:1])
    for k, (state, control) in enumerate(zip(states, np.column_stack([controls, rpm / full.rpm_per_mps]), strict=True)):
        work[STAGE : STAGE + N_STATES], work[SUM : SUM + N_STATES] = state[:, None], 0.0
        for name, derivative in derivatives.items():
            rates[name][k] = derivative(work.ravel(), 0, STAGE, control)
        kernels.integrate.stage(work.ravel(), control, 1.0, 0.0)
        rates["kernel"][k] = work[SUM : SUM + N_STATES, 0]
    np.testing.assert_allclose(rates["followed"], rates["kernel"], rtol=1e-12, atol=1e-12)
    assert np.abs(rates["swapped"] - rates["kernel"]).max() > 1e-2


@pytest.mark.parametrize("step", [1.0, 0.1])
def test_one_boat_at_a_time_flies_the_same_track(step):
    simulator = spiral(step)
    states = scalar_simulator.simulate(simulator)
    expected = simulator.run(simulator.vehicle.xi)[0][0]
    assert states.shape == expected.shape
    assert np.abs(states - expected)[:, :3].max() <= AGREEMENT_M


def test_one_boat_at_a_time_makes_no_arrays_in_its_steps(simulator):
    """As many arrays for six hundred steps as for ten; one whose steps make arrays is told apart."""
    (work,) = scalar_simulator.workspaces(simulator, simulator.vehicle.xi[None])
    stages = simulator._stages

    def arrays(function, n):
        function(n)  # compiled
        before = rtsys.get_allocation_stats().alloc
        function(n)
        return rtsys.get_allocation_stats().alloc - before

    _nrt_python.memsys_enable_stats()
    try:
        few, many = (arrays(lambda n: scalar_simulator.runge_kutta(stages[:n], 1.0, work), n) for n in (10, 600))
        wasteful = arrays(
            lambda n: [scalar_simulator.derivative(np.zeros(12), stages[k, 0], work) for k in range(n)], 9
        )
    finally:
        _nrt_python.memsys_disable_stats()
    assert few == many > 0
    assert wasteful >= 9


@pytest.mark.skipif(cpp_simulator.compiler() is None, reason="no C++ compiler: c++, or what CXX names")
@pytest.mark.parametrize("library_sines", [True, False])
def test_eight_lanes_in_cpp_fly_the_same_tracks(simulator, expected, library_sines):
    """The boat itself to the last digits, and others beside it, each in its lane."""
    rival = cpp_simulator.CppSimulator(simulator, library_sines=library_sines)
    xi = np.vstack([simulator.vehicle.xi, perturbed(simulator.vehicle, 2 * LANES - 1)])
    states = rival.run(rival.prepared(xi))
    assert np.abs(states[0] - expected)[:, :3].max() <= AGREEMENT_M
    others, _ = simulator.run(xi)
    assert np.abs(states - others)[:, :, :3].max() <= 10.0 * AGREEMENT_M
    assert np.abs(np.diff(others[:, -1, :2], axis=0)).min() > 1e-3


@pytest.mark.skipif(not jax_simulator.is_installed(), reason="JAX is in pip install 'bayesub[bench]'")
def test_jax_flies_the_same_track_and_differentiates_it(simulator, expected, tmp_path):
    measured = rivals._by_process(tmp_path, jax_simulator, "1", "0", **jax_simulator.environment(1, str(tmp_path)))
    assert measured["states"].shape == (len(expected), N_STATES)
    assert np.abs(measured["states"] - expected)[:, :3].max() <= AGREEMENT_M
    names = simulator.vehicle.equations.names
    jacobian = simulator.sensitivities(simulator.vehicle.xi, names, jax_simulator.OUTPUTS)
    scale = np.abs(jacobian).max(axis=(0, 1))
    assert (scale > 0).sum() > 20
    assert (np.abs(measured["jacobian"] - jacobian).max(axis=(0, 1)) <= rivals.AGREEMENT_OF_JACOBIANS * scale).all()


def test_what_is_missing_is_left_out_in_words(simulator, monkeypatch):
    """JAX that is not there or does not run, a compiler that is not there or fails."""
    monkeypatch.setattr(jax_simulator, "is_installed", lambda: True)
    monkeypatch.setattr(rivals, "with_python", lambda *_, **__: subprocess.run([shutil.which("false")], check=True))
    assert rivals.by_jax(0.0) == ({}, ["left out: JAX, whose process ended with status 1"])
    monkeypatch.setattr(jax_simulator, "is_installed", lambda: False)
    assert rivals.by_jax(0.0) == ({}, ["left out: JAX, which is not installed (pip install 'bayesub[bench]')"])
    monkeypatch.setenv("CXX", "no-such-compiler")
    rows, (words,) = rivals._cpp(simulator, perturbed(simulator.vehicle, LANES))
    assert not rows
    assert words == "left out: C++, for which there is no compiler (c++, or what the environment variable CXX names)"
    monkeypatch.setenv("CXX", shutil.which("false"))
    rows, (words,) = rivals._cpp(simulator, perturbed(simulator.vehicle, LANES))
    assert not rows
    assert words.startswith(f"left out: C++, which {shutil.which('false')} does not compile: ")


def test_a_method_that_computes_something_else_ends_the_command(monkeypatch):
    """A track that is longer by 1e-12 of itself, before anything is timed; and what is not a number."""
    rivals.check_agreement("the same", 0.9 * AGREEMENT_M, AGREEMENT_M, " m")
    for difference in (1.1 * AGREEMENT_M, np.nan):
        with pytest.raises(InputError, match="bench: another differs from the simulator by"):
            rivals.check_agreement("another", difference, AGREEMENT_M, " m")
    of_numba = scalar_simulator.simulate
    monkeypatch.setattr(rivals, "_cpp", lambda *_: ([], []))
    monkeypatch.setattr(scalar_simulator, "simulate", lambda simulator: of_numba(simulator) * (1.0 + 1e-12))
    with pytest.raises(InputError, match="numba, one at a time differs from the simulator"):
        rivals.compare(0.0, {})
