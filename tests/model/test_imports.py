"""What importing a module brings along: to read and check files needs no library that computes or draws."""

import subprocess
import sys

import pytest

HEAVY = ("numba", "scipy", "pandas", "matplotlib", "arviz", "xarray", "emcee", "h5py")


def imported(statement):
    """The heavy libraries that a fresh interpreter holds after a statement."""
    script = f"import sys\n{statement}\nprint(*(name for name in {HEAVY} if name in sys.modules))"
    finished = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert finished.returncode == 0, finished.stderr
    return finished.stdout.split()


def test_modules_that_describe():
    """Vehicles, hulls, manoeuvres, sensors, records, nuisance parameters and logs."""
    modules = [f"model.{name}" for name in ("coefficients", "vehicles", "manoeuvres", "manoeuvre_files", "trajectory")]
    modules += [f"model.{name}" for name in ("closed_loop", "hulls", "hull_files", "added_mass", "linear_form")]
    modules += ["io.toml_files", "logs.log_files", "io.errors", "kernels.workspace", "model.actuator"]
    modules += ["sensors", "sensors.measurement", "sensors.instruments", "problem.nuisance"]
    assert imported("import " + ", ".join(f"bayesub.{module}" for module in modules)) == []


@pytest.mark.parametrize(
    "statement",
    [
        "import bayesub as bs; boat = bs.load_vehicle('suboff'); bs.load_manoeuvre('horizontal', boat)",
        "from bayesub.model.manoeuvre_files import read_manoeuvre; from bayesub.io import toml_files;"
        "[read_manoeuvre(toml_files.find(name, 'manoeuvres')) for name in toml_files.built_in('manoeuvres')]",
        "import bayesub as bs; bs.sensors.autosub(); bs.load_vehicle('suboff').equations.active(subproblem='vertical')",
        "import numpy as np, bayesub as bs; bs.regressors(np.ones((2, 12)), np.ones((2, 6)), np.ones((2, 3)))",
    ],
)
def test_what_can_be_done_without(statement):
    """Files are read and checked, and a manoeuvre without closed loop is built."""
    assert imported(statement) == []


def test_what_cannot():
    """A closed loop is flown: the negative control."""
    assert "numba" in imported("import bayesub as bs; bs.load_manoeuvre('vertical', bs.load_vehicle('suboff'))")
