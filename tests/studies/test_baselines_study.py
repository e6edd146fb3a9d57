"""The campaign of the deterministic baselines: it resumes, and is the same for the same seed."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from bayesub.model.linear_form import linear_systems
from bayesub.sensors.measured_motion import measure


@pytest.fixture(scope="module")
def study():
    path = Path(__file__).parents[2] / "studies" / "baselines.py"
    spec = importlib.util.spec_from_file_location("study_baselines", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_finished_case_is_read_back(study, tmp_path):
    """A case is computed once; one that was interrupted leaves no file and is computed again."""
    calls = []

    def make():
        calls.append(1)
        return {"costs": [1.0, 0.1 + 0.2]}

    def stumble():
        raise RuntimeError

    with pytest.raises(RuntimeError):
        study.resumed(tmp_path / "case.json", stumble)
    first = study.resumed(tmp_path / "case.json", make)
    assert study.resumed(tmp_path / "case.json", stumble) == first == {"costs": [1.0, 0.1 + 0.2]}
    assert len(calls) == 1


def test_the_cost_is_that_of_the_thesis(study, suboff):
    """The sum of squared residuals is ten times sum(m^2) + sum(deg^2) over samples every second."""
    problem = study.track_problem(suboff, "horizontal", ("Xuu", "Nuv"))
    x = 1.02 * problem.prior.mean
    off = problem.trajectory(x).states[0, :, :6] - problem.trajectory(problem.prior.mean).states[0, :, :6]
    off[:, 3:] = np.degrees(off[:, 3:])
    assert len(off) == 600
    assert np.sum(problem.residuals(x[None]) ** 2) == pytest.approx(10.0 * np.sum(off**2), rel=1e-9)


def test_measured_motion(spiral_track, rng):
    """Velocities and accelerations are multiples of their resolution, everything else is exact; noise has its sd."""
    rounded = measure(spiral_track, velocity_resolution=0.01, acceleration_resolution=0.001)
    np.testing.assert_allclose(rounded.states[..., 6:9] / 0.01, np.round(spiral_track.states[..., 6:9] / 0.01))
    off = rounded.accelerations - spiral_track.accelerations
    assert 0.0004 < np.abs(off[..., :2]).max() <= 0.0005 + 1e-12
    assert not off[..., 3:].any()
    np.testing.assert_array_equal(rounded.states[..., :6], spiral_track.states[..., :6])
    noisy = measure(spiral_track, velocity_sd=0.02, rng=rng)
    spread = np.std(noisy.states[..., 6:9] - spiral_track.states[..., 6:9])
    assert spread == pytest.approx(0.02, rel=4 / np.sqrt(2 * 3 * 6001))


def test_exact_measurements_make_the_exact_linear_form(spiral_track):
    """Measured without error, a motion is its trajectory."""
    exact, same = linear_systems(spiral_track), linear_systems(measure(spiral_track))
    for axis, system in exact.items():
        np.testing.assert_array_equal(same[axis].matrix, system.matrix)
        np.testing.assert_array_equal(same[axis].load, system.load)


def test_quantities_stand_beside_the_thesis(study):
    """Ours, the thesis's and the ratio; ours alone where the thesis has none."""
    assert study.beside(3.0, 2.0) == "3 / 2 = 1.5"
    assert study.beside(3.0, None) == "3"
