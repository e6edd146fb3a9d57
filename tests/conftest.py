"""Shared vehicles and motions. `boat` is a vehicle file as a dictionary, which is what slow_twin understands."""

import os
import sys
import tomllib
import zlib

# Before NumPy and numba are loaded: threads of several test processes wait for one another in busy loops, which made
# tests of small matrices take up to ten times as long. Processes that tests start inherit it.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("NUMBA_NUM_THREADS", "1")

import numpy as np
import pytest
import tomli_w
from support import browsing, refusals, small_study
from support.motions import smooth_manoeuvre

import bayesub as bs
from bayesub.cli import app
from bayesub.io import toml_files
from bayesub.report.plots import style

RENDER = style.save


def pytest_addoption(parser):
    """Options: to write the sentences of refusals again, and to run a tenth of the tests."""
    parser.addoption("--sentences", action="store_true", help="write tests/sentences.json again; with -n 0")
    parser.addoption("--part", type=int, choices=range(10), help="only a tenth of the tests, by name, as CI does")


def pytest_collection_modifyitems(config, items):
    """Leave out the tests of other days."""
    if (part := config.getoption("part")) is not None:
        parts = {item: zlib.crc32(item.nodeid.encode()) % 10 for item in items}
        config.hook.pytest_deselected(items=[item for item in items if parts[item] != part])
        items[:] = [item for item in items if parts[item] == part]


def pytest_configure(config):
    """Tell those who compare sentences whether they are to be written."""
    refusals.writing = config.getoption("sentences")


@pytest.hookimpl(tryfirst=True)  # before fixtures, of a module too
def pytest_runtest_setup(item):
    """Render figures for tests that look at them only, since it takes longest; for others their files are empty."""
    is_rendered = any(map(item.get_closest_marker, ("rendered", "browser", "docs", "slow")))
    style.save = RENDER if is_rendered else lambda _, paths: small_study.leave_empty(paths)


@pytest.fixture(scope="session")
def browser():
    """Chromium or Chrome, for all tests that look at pages."""
    with browsing.started() as browser:
        yield browser


@pytest.fixture(scope="session")
def finished(tmp_path_factory):
    """finished(name, changes of TINY): the folder of a run, made once; a test that changes it takes a copy."""
    folder = tmp_path_factory.mktemp("finished")

    def run(name="tiny", **changes):
        if not (folder / name).exists():
            path = small_study.write(folder / f"{name}.toml", **small_study.TINY | {"name": name} | changes)
            small_study.run(path, folder / name)
        return folder / name

    return run


@pytest.fixture
def rng():
    """Random numbers that depend on nothing but this seed."""
    return np.random.default_rng(690)


@pytest.fixture
def bayesub(monkeypatch, capsys):
    """Run the command line; gives exit status, standard output and standard error.

    The attribute `error` is the InputError with which the last command ended, if it did.
    """
    complain = app.complain

    def complained(message, status):
        found = sys.exc_info()[1]
        run.error = found if isinstance(found, bs.InputError) else None
        complain(message, status)

    monkeypatch.setattr(app, "complain", complained)

    def run(*arguments):
        run.error = None
        monkeypatch.setattr(sys, "argv", ["bayesub", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            app.main()
        return stop.value.code or 0, *capsys.readouterr()

    return run


@pytest.fixture(scope="session")
def suboff():
    return bs.load_vehicle("suboff")


@pytest.fixture(scope="session")
def auv():
    return bs.load_vehicle("auv690")


@pytest.fixture(scope="session")
def suboff_file():
    """The text of the suboff vehicle file."""
    return toml_files.find("suboff", "vehicles").read_text()


@pytest.fixture(scope="session")
def boat(suboff_file):
    """A suboff-like boat none of whose coefficients and mass properties is zero, unladen with any symmetry."""
    content = tomllib.loads(suboff_file)
    rng = np.random.default_rng(101)
    typical = {"X": 2e-3, "Y": 5e-3, "Z": 5e-3, "K": 1e-5, "M": 5e-4, "N": 5e-4}
    for name, value in content["coefficients"].items():
        if value == 0:
            content["coefficients"][name] = typical[name[0]] * float(rng.uniform(0.2, 1.0) * rng.choice([-1, 1]))
    body, propulsion = content["body"], content["propulsion"]
    body["centre_of_gravity_m"], body["centre_of_buoyancy_m"] = [0.31, -0.07, 0.23], [0.29, -0.05, -0.17]
    body["inertia_kgm2"] |= {"Izz": 6.5e9, "Ixy": -2.1e6, "Iyz": 3.3e6, "Izx": -4.7e6}
    body |= {"neutrally_buoyant": False, "buoyancy_n": 0.998 * body["mass_kg"] * 9.81}
    propulsion["b"] = [-0.0009, -0.0031, 0.0052, -0.0006, -0.0035, 0.0051, -0.0007, 0.0003, -0.0024]
    propulsion |= {"thrust_line_z_m": 0.41, "torque": [13.0, 17.0], "rpm_per_mps": 11.0}
    return content


def vehicle_of(content, folder):
    """The vehicle that bayesub reads from a file with this content."""
    path = folder / "boat.toml"
    path.write_text(tomli_w.dumps(content))
    return bs.load_vehicle(path)


@pytest.fixture(scope="session")
def full(boat, tmp_path_factory):
    """What bayesub reads from a file of `boat`."""
    return vehicle_of(boat, tmp_path_factory.mktemp("full"))


@pytest.fixture
def vehicle_with(tmp_path):
    """vehicle_with(content): what bayesub reads from a file of that content."""
    return lambda content: vehicle_of(content, tmp_path)


@pytest.fixture
def motions(rng):
    """120 states, controls and propeller speeds: ahead, still and astern, every thrust branch, some not drifting."""
    n = 120
    states = rng.standard_normal((n, 12)) * [500, 500, 100, 0.6, 0.4, 3, 4, 1, 1, 0.05, 0.03, 0.03]
    states[:, 4] = np.clip(states[:, 4], -1.4, 1.4)
    states[:, 6] += 3
    states[::10, 6] = 0.0  # at rest
    states[1::7, 7:9] = 0.0  # no drift
    states[2::7, 7] = 0.0
    states[3::7, 9:] = 0.0  # not turning
    controls = rng.uniform(-0.5, 0.5, (n, 3))
    ratio = np.resize([1.7, 1.0, 0.6, 0.0, -0.8], n)  # n' by branch
    rpm = 11.0 * ratio * np.where(states[:, 6] == 0.0, 5.0, states[:, 6])
    return states, controls, rpm


@pytest.fixture(scope="session")
def coupled(full):
    """A smooth manoeuvre in six degrees of freedom for the full boat."""
    return smooth_manoeuvre(full, 48.0)


@pytest.fixture(scope="session")
def spiral(suboff):
    return bs.load_manoeuvre("horizontal", suboff)


@pytest.fixture(scope="session")
def spiral_track(suboff, spiral):
    """The suboff boat on the horizontal spiral, sampled every 0.1 s."""
    return bs.simulate(suboff, spiral, dt=0.5)
