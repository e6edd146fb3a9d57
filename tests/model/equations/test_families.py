"""Families of kernels: several in one process, and the same in another process."""

import os
import shutil
import subprocess
import sys

import joblib
import numba
import numpy as np
import pytest
import tomli_w
from support import user_set

import bayesub as bs
from bayesub.kernels.families import family
from bayesub.model.equations import load_equations
from bayesub.model.equations.generate import source
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.simulator import Simulator


@pytest.fixture(scope="module")
def path(boat, tmp_path_factory):
    """A file of a boat with equations of its own."""
    folder = tmp_path_factory.mktemp("families")
    user_set.write(folder)
    path = folder / "boat.toml"
    path.write_text(tomli_w.dumps(user_set.content(boat, "every_symbol.toml")))
    return path


@pytest.fixture(scope="module")
def simulators(path, suboff, spiral):
    """A boat with equations of its own, and one with those of booth, in the plane and not."""
    vehicle = bs.load_vehicle(path)
    times = np.array([0.0, 10.0])
    controls = np.full((2, 5), 0.05) * [1, 1, 1, 1e5, 1e3]
    start = np.eye(12)[6] * 7.5
    flown = Manoeuvre("turn", times, controls, np.full(2, 80.0), start, columns=user_set.COLUMNS)
    own = Simulator(vehicle, flown, [1.0, 5.0, 10.0], dt=0.5)
    planar, full = (Simulator(suboff, spiral, [1.0, 5.0, 30.0], dt=0.5, subproblem=p) for p in ("horizontal", None))
    return {"own": own, "planar": planar, "full": full}


def states_of(simulator):
    """In a function of its own, so that another process can be asked."""
    return simulator.run(simulator.vehicle.xi)[0]


def test_families_live_side_by_side(simulators):
    """Each has its own forces and numbers, whichever is asked first or in between."""
    first = {name: states_of(simulator) for name, simulator in simulators.items()}
    for name in ("planar", "own", "full", "own", "planar"):
        np.testing.assert_array_equal(states_of(simulators[name]), first[name])
    sizes = {name: simulator.kernels.equations.N_COEFFICIENTS for name, simulator in simulators.items()}
    assert sizes == {"own": len(user_set.VALUES), "planar": 101, "full": 101}
    controls = {name: simulator.kernels.equations.N_CONTROLS for name, simulator in simulators.items()}
    assert controls == {"own": 6, "planar": 4, "full": 4}


def test_the_same_set_of_another_file_is_the_same_family(simulators, tmp_path):
    """What is compiled depends on the forces, not on where the set was read."""
    assert family(source(load_equations(user_set.write(tmp_path)), None)) is simulators["own"].kernels


@pytest.mark.parametrize("name", ["own", "planar", "full"])
def test_a_simulator_works_in_another_process(simulators, name):
    """It is sent as it is, and its kernels are loaded there; the bits are the same."""
    elsewhere = joblib.Parallel(n_jobs=2)(joblib.delayed(states_of)(s) for s in [simulators[name]] * 2)
    for states in elsewhere:
        np.testing.assert_array_equal(states, states_of(simulators[name]))


NEW_SET = """
import sys
import bayesub as bs
from bayesub.kernels import jit, lanes
if len(sys.argv) > 2:
    jit.lanes = None  # what writes LLVM
vehicle = bs.load_vehicle(sys.argv[1])
print(vehicle.kernels().unit("stage") > 0)
"""


@pytest.mark.skipif(numba.config.DISABLE_JIT, reason="nothing is compiled")
def test_another_clone_compiles_nothing(path, tmp_path):
    """A set of one's own is compiled once for a user, in whichever folder it stands and whoever asks."""
    other = tmp_path / "elsewhere"
    shutil.copytree(path.parent, other)
    for arguments in ([path], [other / path.name, "nothing is written"]):
        done = subprocess.run(
            [sys.executable, "-c", NEW_SET, *map(str, arguments)],
            env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)},
            capture_output=True,
            text=True,
            check=False,
        )
        assert (done.stdout, done.stderr) == ("True\n", "")
