"""What a user would write instead of the simulator: it computes the same, and is no worse than it could be."""

import math
import shutil
import subprocess

import numpy as np
import pytest
from llvmlite.binding import get_host_cpu_features
from numba.core.runtime import _nrt_python, rtsys
from support.refusals import refused

from bayesub.campaign.executors import Serial
from bayesub.io.errors import InputError
from bayesub.kernels.workspace import BODY_ROWS, COEFFICIENTS, INVERSE_MASS, LANES, N_STATES, STATE
from bayesub.study.before.bench import perturbed, spiral
from rivals import arithmetic, cluster, comparison, cpp_simulator, jax_simulator, scalar_simulator
from rivals.right_hand_side import PYTHON, written
from rivals.tables import tables

AGREEMENT_M = comparison.AGREEMENT_M


@pytest.fixture(scope="module")
def simulator():
    return spiral(1.0)


@pytest.fixture(scope="module")
def expected(simulator):
    return simulator.run(simulator.vehicle.xi)[0][0]


def test_equations_that_are_written_out_are_those_of_the_kernels(full, motions):
    """As lines of Python they give the same rates for all terms, in every branch; not with choices swapped."""
    states, controls, rpm = motions
    kernels, dimensional = full.kernels(None), (full.xi * full.dimensional_factors)[None]
    body = np.concatenate([full.body, full.constants])[None]
    given = np.column_stack([controls, rpm / full.rpm_per_mps])
    expected = kernels.body_accelerations(dimensional, body, states[None], given)[0]
    rows = np.zeros(kernels.n_rows)
    rows[BODY_ROWS : BODY_ROWS + len(full.body)], rows[COEFFICIENTS : COEFFICIENTS + 101] = full.body, dimensional
    rows[INVERSE_MASS : INVERSE_MASS + 36] = np.linalg.inv(full.mass_matrix).ravel()
    swapped = PYTHON._replace(chosen="({2} if {0} else {1})")
    for language, agrees in ((PYTHON, True), (swapped, False)):
        lines, rates = written(kernels, language)
        code = compile("\n".join([*lines, f"rates = {', '.join(rates)}"]), "rates", "exec")
        found = []
        for state, control in zip(states, given, strict=True):
            rows[STATE : STATE + N_STATES] = state
            with np.errstate(all="ignore"):
                exec(code, names := {"work": rows, "control": control, "math": math})
            found.append(names["rates"][6:])
        assert np.allclose(found, expected, rtol=1e-11, atol=1e-11) == agrees


@pytest.mark.skipif(not get_host_cpu_features().get("fma"), reason="the processor has no packed multiply-adds")
def test_right_hand_side_is_packed(simulator):
    _, bits = arithmetic.packed_instructions(simulator.kernels.assembly("stage"))
    assert bits >= 256


@pytest.mark.slow
@pytest.mark.parametrize("step", [1.0, 0.1])
def test_one_boat_at_a_time_flies_the_same_track(step):
    simulator = spiral(step)
    states = scalar_simulator.simulate(simulator)
    expected = simulator.run(simulator.vehicle.xi)[0][0]
    assert states.shape == expected.shape
    assert np.abs(states - expected)[:, :3].max() <= AGREEMENT_M


def test_one_boat_at_a_time_makes_no_arrays_in_its_steps(simulator):
    """As many arrays for six hundred steps as for ten; one whose steps make arrays is told apart."""
    work = scalar_simulator.rows_of(simulator, simulator.vehicle.xi)
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
@pytest.mark.slow
def test_jax_flies_the_same_track_and_differentiates_it(simulator, expected, tmp_path):
    measured = comparison._by_process(tmp_path, jax_simulator, "1", "0", **jax_simulator.environment(1, str(tmp_path)))
    assert measured["states"].shape == (len(expected), N_STATES)
    assert np.abs(measured["states"] - expected)[:, :3].max() <= AGREEMENT_M
    names = simulator.vehicle.equations.names
    jacobian = simulator.sensitivities(simulator.vehicle.xi, names, jax_simulator.OUTPUTS)
    scale = np.abs(jacobian).max(axis=(0, 1))
    assert (scale > 0).sum() > 20
    assert (np.abs(measured["jacobian"] - jacobian).max(axis=(0, 1)) <= comparison.AGREEMENT_OF_JACOBIANS * scale).all()


def test_what_is_missing_is_left_out_in_words(simulator, monkeypatch):
    """JAX that is not there or does not run, a compiler that is not there or fails."""
    monkeypatch.setattr(jax_simulator, "is_installed", lambda: True)
    monkeypatch.setattr(comparison, "with_python", lambda *_, **__: subprocess.run([shutil.which("false")], check=True))
    assert comparison.by_jax(0.0) == ({}, ["left out: JAX, whose process ended with status 1"])
    monkeypatch.setattr(jax_simulator, "is_installed", lambda: False)
    assert comparison.by_jax(0.0) == ({}, ["left out: JAX, which is not installed (pip install 'bayesub[bench]')"])
    monkeypatch.setenv("CXX", "no-such-compiler")
    rows, (words,) = comparison._cpp(simulator, perturbed(simulator.vehicle, LANES))
    assert not rows
    assert words == "left out: C++, for which there is no compiler (c++, or what the environment variable CXX names)"
    monkeypatch.setenv("CXX", shutil.which("false"))
    rows, (words,) = comparison._cpp(simulator, perturbed(simulator.vehicle, LANES))
    assert not rows
    assert words.startswith(f"left out: C++, which {shutil.which('false')} does not compile: ")


def test_a_method_that_computes_something_else_ends_the_command(monkeypatch):
    """A track that is longer by 1e-12 of itself, before anything is timed; and what is not a number."""
    comparison.check_agreement("the same", 0.9 * AGREEMENT_M, AGREEMENT_M, " m")
    for difference in (1.1 * AGREEMENT_M, np.nan):
        with refused("state", "another"):
            comparison.check_agreement("another", difference, AGREEMENT_M, " m")
    of_numba = scalar_simulator.simulate
    monkeypatch.setattr(comparison, "_cpp", lambda *_: ([], []))
    monkeypatch.setattr(scalar_simulator, "simulate", lambda simulator: of_numba(simulator) * (1.0 + 1e-12))
    with pytest.raises(InputError) as caught:  # by how much depends on the processor
        comparison.compare(0.0, {})
    assert (caught.value.kind, caught.value.key) == ("state", "numba, one at a time")


def test_a_cluster_is_measured_by_the_time_inside_its_pieces(monkeypatch):
    """Pieces share their workers' time with what it takes to hand them out."""
    sizes = {"QUICK_EMPTY": 3, "QUICK_LENGTHS": {0.05: 2}, "RESULT": 10, "FUNCTION": 10}
    for name, value in sizes.items():
        monkeypatch.setattr(cluster, name, value)
    numbers = cluster.run(Serial(), quick=True)
    assert numbers["workers"] == 1
    assert [row["work"] for row in numbers["lengths"]] == ["waiting", "simulating"]
    for row in numbers["lengths"]:
        assert row["pieces"] == 2
        assert row["length_s"] >= 0.05
        assert 0.0 < row["efficiency"] <= 1.0
    text, table = cluster.tables(numbers)
    assert table.row_count == 2
    assert f"{1e3 * numbers['seconds_per_piece']:.2f} ms" in text


def test_tables_have_a_row_for_each_measurement():
    numbers = {
        "batch": 4,
        "methods": [
            {"method": "bayesub", "step_s": 1.0, "seconds": {1: 2e-5, 2: 1e-5}, "error_m": 1e-3, "differs_m": 0.0},
            {"method": "other", "step_s": 1.0, "seconds": {1: 1e-4, 2: 6e-5}, "error_m": 1e-3, "differs_m": 3e-13},
            {"method": "adaptive", "step_s": None, "seconds": {1: 1e-3}, "error_m": 1e-3, "differs_m": None},
        ],
        "left_out": ["left out: a snail"],
        "jacobians": [
            {"method": method, "coefficients": 21, "threads": threads, "seconds": seconds}
            for method, seconds in (("bayesub", 1e-3), ("other", 4e-3)) for threads in (1, 2)
        ],
        "arithmetic": {
            "instructions": {"fma": 3}, "vector_bits": 256, "peak_vector_bits": 512, "fma_per_s": 1e9, "limit_s": 1e-5
        },
    }  # fmt: skip
    methods, agreement, jacobians, text = tables(numbers)
    assert [table.row_count for table in (methods, jacobians)] == [3, 4]
    one, two = ([*methods.columns[k].cells] for k in (3, 5))
    assert (one, two) == (["1.0", "5.0", "50.0"], ["1.0", "6.0", ""])
    assert agreement == "rows with steps differ from bayesub with these steps by at most 3.0e-13 m\nleft out: a snail"
    assert [*jacobians.columns[4].cells] == ["50", "100", "200", "400"]
    assert [*jacobians.columns[5].cells] == ["1.0", "1.0", "4.0", "4.0"]
    assert "2.00 times" in text
