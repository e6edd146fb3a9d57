"""Speed of the simulator. The default test run skips this file; to run it:

python -m pytest tests/benchmarks --benchmark-only
"""

import numba
import numpy as np
import pytest

from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulator import STEP_TOLERANCE_M, Simulator
from bayesub.model.vehicles import load_vehicle
from bayesub.study.before.bench import spiral
from rivals import arithmetic, scalar_simulator


@pytest.fixture(scope="module")
def simulator():
    vehicle = load_vehicle("suboff")
    return Simulator(vehicle, load_manoeuvre("horizontal", vehicle), np.linspace(0.0, 600.0, 601))


@pytest.fixture
def threads(request):
    before = numba.get_num_threads()
    numba.set_num_threads(min(request.param, numba.config.NUMBA_NUM_THREADS))
    yield request.param
    numba.set_num_threads(before)


@pytest.mark.parametrize("threads", [1, 2], indirect=True)
@pytest.mark.parametrize("size", [1, 8, 64, 256])
@pytest.mark.usefixtures("threads")
def test_batch(benchmark, simulator, size):
    """A batch on the 600 s spiral; divide by its size."""
    xi = simulator.vehicle.xi[None].repeat(size, axis=0)
    _, status = benchmark(simulator.run, xi)
    assert (status == 0).all()


@pytest.fixture(params=["horizontal", None], ids=["terms of the plane", "all terms"])
def confined(request, simulator):
    """The boat confined to the plane, flown by the kernels of the plane and by those of all terms."""
    boat = simulator.vehicle.restricted("horizontal")
    return Simulator(boat, simulator.manoeuvre, simulator.times, dt=1.0, subproblem=request.param)


@pytest.mark.parametrize("threads", [1], indirect=True)
@pytest.mark.usefixtures("threads")
def test_terms_of_a_plane(benchmark, confined):
    """A batch of 256 on the 600 s spiral with the 25 terms of the plane, and with 101 of which 76 are zero."""
    xi = confined.vehicle.xi[None].repeat(256, axis=0)
    _, status = benchmark(confined.run, xi)
    assert (status == 0).all()


@pytest.mark.parametrize("threads", [1], indirect=True)
@pytest.mark.usefixtures("threads")
def test_sensitivities_of_a_plane(benchmark, confined):
    """By the coefficients of the plane, with its kernels and with those of all terms."""
    names = confined.vehicle.equations.subproblems["horizontal"]
    derivatives = benchmark(confined.sensitivities, confined.vehicle.xi, names)
    assert np.isfinite(derivatives).all()


def test_scalar_numba(benchmark, simulator):
    """One simulation by the scalar integrator that a user would write, at 0.1 s."""
    states = benchmark(scalar_simulator.simulate, spiral(0.1))
    ours = simulator.run(simulator.vehicle.xi)[0][0]
    assert np.linalg.norm(states[:, :3] - ours[:, :3], axis=1).max() < STEP_TOLERANCE_M


def test_right_hand_side_is_packed(benchmark, simulator):
    """The stages use packed arithmetic, and the arithmetic limit follows from them."""
    limit = benchmark.pedantic(arithmetic.limit, args=(simulator.kernels, 2400), rounds=1)
    assert limit["vector_bits"] >= 256
    assert limit["instructions"]["fma"] > 200
