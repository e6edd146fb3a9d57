"""Families of kernels: several in one process, the same in another process, and caches that cannot be written."""

import os
import subprocess
import sys
import threading
from pathlib import Path

import joblib
import numba
import numpy as np
import pytest
import tomli_w
from support import user_set

import bayesub as bs
from bayesub.kernels import compilation, families
from bayesub.model.equations import generate, load_equations
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
    """Each has its own modules and numbers, whichever is asked first or in between."""
    packages = {name: simulator.kernels.package for name, simulator in simulators.items()}
    assert len(set(packages.values())) == 3
    first = {name: states_of(simulator) for name, simulator in simulators.items()}
    for name in ("planar", "own", "full", "own", "planar"):
        np.testing.assert_array_equal(states_of(simulators[name]), first[name])
    sizes = {name: simulator.kernels.layout.N_COEFFICIENTS for name, simulator in simulators.items()}
    assert sizes == {"own": len(user_set.VALUES), "planar": 101, "full": 101}
    controls = {name: simulator.kernels.layout.N_CONTROLS for name, simulator in simulators.items()}
    assert controls == {"own": 6, "planar": 4, "full": 4}
    for simulator in simulators.values():
        assert sys.modules[simulator.kernels.package].__path__[0] == str(simulator._folder)
        assert simulator.kernels is families.compiled(simulator._folder)


def test_the_same_set_of_another_file_is_the_same_family(simulators, path, tmp_path):
    """What is compiled depends on the forces, not on where the set was read."""
    user_set.write(tmp_path)
    assert generate.directory(load_equations(tmp_path / "every_symbol.toml"), None) == generate.directory(
        load_equations(path.with_name("every_symbol.toml")), None
    )
    assert str(generate.directory(bs.load_vehicle(path).equations, None)) == simulators["own"]._folder


@pytest.mark.parametrize("name", ["own", "planar", "full"])
def test_a_simulator_works_in_another_process(simulators, name):
    """It is sent as it is, and its kernels are loaded there; the bits are the same."""
    elsewhere = joblib.Parallel(n_jobs=2)(joblib.delayed(states_of)(s) for s in [simulators[name]] * 2)
    for states in elsewhere:
        np.testing.assert_array_equal(states, states_of(simulators[name]))


ANOTHER_PROCESS = """
import sys
import numpy as np
import bayesub as bs
from bayesub.kernels import families
from bayesub.model.equations.generate import directory
vehicle = bs.load_vehicle(sys.argv[1])
kernels = vehicle.kernels()
states = np.random.default_rng(1).uniform(0.1, 1.0, (4, 12))
print(bs.accelerations(vehicle, states, np.full((4, 5), 0.1), 80.0).tobytes().hex())
for module in ("integrate", "mass"):
    for name, function in vars(getattr(kernels, module)).items():
        for signature in getattr(getattr(function, "stats", None), "cache_misses", {}):
            print("compiled", name, signature)
"""


def run(script, *arguments, **environment):
    """Standard output and error of a script in another process."""
    process = subprocess.run(
        [sys.executable, "-c", script, *map(str, arguments)],
        env=os.environ | {key: str(value) for key, value in environment.items()},
        capture_output=True,
        text=True,
        check=False,
    )
    assert process.returncode == 0, process.stderr
    return process.stdout, process.stderr


@pytest.mark.skipif(numba.config.DISABLE_JIT, reason="nothing is compiled")
def test_another_process_compiles_nothing(path, simulators):
    """It finds the forces where they were written, and the kernels in numba's cache, with the same bits."""
    folder = Path(simulators["own"].kernels.hydrodynamics.__file__)
    before = folder.stat().st_mtime_ns
    out, _ = run(ANOTHER_PROCESS, path)
    vehicle = bs.load_vehicle(path)
    states = np.random.default_rng(1).uniform(0.1, 1.0, (4, 12))
    here = bs.accelerations(vehicle, states, np.full((4, 5), 0.1), 80.0)
    assert out.splitlines() == [here.tobytes().hex()]
    assert folder.stat().st_mtime_ns == before


GENERATED = """
import sys
from bayesub.model.equations import load_equations
from bayesub.model.equations.generate import directory
folder = directory(load_equations(sys.argv[1]), None)
print(folder)
print((folder / "hydrodynamics.py").read_text().count("def "))
"""


def test_forces_are_written_where_users_cache(path, tmp_path):
    """Below the user's cache folder, which is made if there is none; the next process finds them."""
    cache = tmp_path / "none" / "yet"
    for _ in range(2):
        folder, functions = run(GENERATED, path.with_name("every_symbol.toml"), XDG_CACHE_HOME=cache)[0].split()
        assert folder.startswith(str(cache))
        assert int(functions) >= 5
    assert [p.name for p in (cache / "bayesub").iterdir()] == [folder.rpartition("/")[2]]


@pytest.mark.parametrize("hindrance", ["a file in the way", "no permission"])
def test_a_cache_that_cannot_be_written_is_said_in_one_line(path, tmp_path, hindrance):
    """With the folder, and not by a traceback."""
    cache = tmp_path / "cache"
    if hindrance == "a file in the way":
        cache.write_text("")
    else:
        if os.geteuid() == 0:
            pytest.skip("root may write anywhere")
        cache.mkdir(mode=0o500)
    script = f"""
import bayesub as bs
from bayesub.model.equations import load_equations
from bayesub.model.equations.generate import directory
try:
    directory(load_equations({str(path.with_name("every_symbol.toml"))!r}), None)
except bs.InputError as error:
    print(error)
"""
    out, _ = run(script, XDG_CACHE_HOME=cache)
    assert len(out.splitlines()) == 1
    assert str(cache) in out
    assert "cannot be written" in out


def test_two_processes_may_write_at_once(path, tmp_path, monkeypatch):
    """Each writes a file of its own and moves it to its place, as several that start together do."""
    equations = load_equations(path.with_name("every_symbol.toml"))
    text, barrier = generate.source(equations, None), threading.Barrier(8)

    def source(*_):
        barrier.wait()
        return text

    monkeypatch.setattr(generate, "source", source)
    monkeypatch.setattr(generate.platformdirs, "user_cache_dir", lambda _: str(tmp_path))
    folders = []
    threads = [
        threading.Thread(target=lambda: folders.append(generate._directory.__wrapped__(equations, None, False)))
        for _ in range(8)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(folders) == 8
    assert len(set(folders)) == 1
    assert [p.name for p in folders[0].iterdir()] == ["hydrodynamics.py"]
    assert (folders[0] / "hydrodynamics.py").read_text() == text


def test_only_the_first_asks_for_compilation(simulators, monkeypatch):
    """A simulator asks for compiled kernels at every run; after the first that is a look into a set."""
    monkeypatch.setattr(compilation.subprocess, "run", None)
    for simulator in simulators.values():
        states_of(simulator)
