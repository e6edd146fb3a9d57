"""The integrator: order of convergence, dense output, and members of a batch that do not know of each other."""

from dataclasses import replace

import numpy as np
import pytest
from support.motions import smooth_manoeuvre

from bayesub.kernels.workspace import LANES
from bayesub.model.coefficients import INDEX
from bayesub.model.simulator import STATUS, Simulator

SPACING = 1 / 16  # of the control history: every step below and its middle meet a knot, so the controls are exact
STEPS = np.array([4.0, 2.0, 1.0, 0.5])


@pytest.fixture(scope="module")
def smooth(suboff):
    return smooth_manoeuvre(suboff, 48.0, SPACING)


def position_errors(vehicle, manoeuvre, times, controls="linear"):
    """Largest position error at `times` with each of STEPS, against an eighth of a second."""
    reference = Simulator(vehicle, manoeuvre, times, dt=0.125).run(vehicle.xi)[0][0, :, :3]
    return [
        np.linalg.norm(
            Simulator(vehicle, manoeuvre, times, dt=dt, controls=controls).run(vehicle.xi)[0][0, :, :3] - reference,
            axis=1,
        ).max()
        for dt in STEPS
    ]


def order(errors):
    """Slope of log error over log step."""
    return np.polyfit(np.log(STEPS), np.log(errors), 1)[0]


def test_fourth_order_with_interpolated_controls(suboff, smooth):
    """Halving the step divides the error by sixteen in six degrees of freedom."""
    assert order(position_errors(suboff, smooth, [16.0, 32.0, 48.0])) == pytest.approx(4.0, abs=0.3)


def test_first_order_with_held_controls(suboff, smooth):
    """Controls held over a step cost three orders: the thesis's convention."""
    assert order(position_errors(suboff, smooth, [16.0, 32.0, 48.0], "hold")) == pytest.approx(1.0, abs=0.2)


def test_dense_output_is_third_order_or_better(suboff, smooth):
    """Between steps the error falls at least with the cube of the step."""
    times = np.arange(8.0, 48.0, 0.37)
    assert order(position_errors(suboff, smooth, times)) > 3.0


def test_dense_output_meets_the_steps_bitwise(full, coupled):
    """A state at the end of a step does not depend on which other times were asked for."""
    ends = np.arange(0, 97) * 0.5
    alone, _ = Simulator(full, coupled, ends, dt=0.5).run(full.xi)
    crowd = np.unique(np.concatenate([ends, np.arange(0.1, 48.0, 0.07), np.nextafter(ends[1:-1], 0)]))
    among, _ = Simulator(full, coupled, crowd, dt=0.5).run(full.xi)
    np.testing.assert_array_equal(among[:, np.isin(crowd, ends)], alone)
    last, _ = Simulator(full, coupled, [48.0], dt=0.5).run(full.xi)
    np.testing.assert_array_equal(last[0, 0], alone[0, -1])


@pytest.fixture
def sets(full, rng):
    """Coefficient sets that fill two blocks of lanes and part of a third."""
    return full.xi * rng.uniform(0.95, 1.05, (2 * LANES + 3, 101))


@pytest.fixture
def simulator(full, coupled):
    return Simulator(full, coupled, np.arange(0.0, 48.0, 0.7), dt=0.5)


def test_a_batch_is_its_members(simulator, sets):
    """A batch of n gives bitwise what n batches of one give."""
    together, status = simulator.run(sets)
    assert not status.any()
    for xi, states in zip(sets, together, strict=True):
        np.testing.assert_array_equal(simulator.run(xi)[0][0], states)


def test_serial_and_parallel_are_bitwise_equal(simulator, sets):
    """Sharing the blocks among threads changes nothing."""
    serial, parallel = (simulator.run(sets, parallel=choice)[0] for choice in (False, True))
    np.testing.assert_array_equal(serial, parallel)


def _runaway(xi, _):
    xi[INDEX["Xuu"]] = 0.1  # drag that pushes: u' = 0.05 u^2, infinite after about 3 s


def _dive(xi, _):
    xi[INDEX["Muu"]] = -0.01  # a steady bow-down moment, as of stern planes at four radians


def _massless(xi, vehicle):
    factor = vehicle.dimensional_factors[INDEX["Xudot"]]
    xi[:] = 0.0
    xi[INDEX["Xudot"]] = 1.001 * vehicle.body[0] / factor  # added mass of minus the mass: nothing holds the boat


@pytest.mark.parametrize(("spoil", "word"), [(_runaway, "diverged"), (_dive, "left_envelope"), (_massless, "diverged")])
@pytest.mark.parametrize("place", [0, LANES + 2, 2 * LANES + 2])
def test_failure_is_a_status_of_one_member(full, simulator, sets, spoil, word, place):
    """A member that fails says how, has no numbers from then on, and leaves the others bitwise as they were."""
    before, _ = simulator.run(sets)
    spoil(sets[place], full)
    after, status = simulator.run(sets)
    others = np.arange(len(sets)) != place
    assert STATUS[status[place]] == word
    assert not status[others].any()
    np.testing.assert_array_equal(after[others], before[others])
    finite = np.isfinite(after[place]).all(axis=1)
    failure = int(np.argmin(finite))
    assert 0 < failure < len(finite)
    assert finite[:failure].all()
    assert np.isnan(after[place, failure:]).all()
    lost = after[place, :failure]
    assert np.linalg.norm(lost[:, 6:9], axis=1).max() < 75.0
    assert np.abs(lost[:, 4]).max() < np.radians(85.0)


def test_a_singular_mass_matrix_is_a_failure(suboff, smooth):
    """A coefficient set that takes the last kilogram of surge mass fails, and its neighbours do not notice."""
    simulator = Simulator(suboff, smooth, np.arange(0.0, 48.0, 0.7), dt=0.5)
    sets = np.repeat(suboff.xi[None], 5, axis=0)
    before, _ = simulator.run(sets)
    sets[3, INDEX["Xudot"]] = suboff.body[0] / suboff.dimensional_factors[INDEX["Xudot"]]
    after, status = simulator.run(sets)
    assert [STATUS[code] for code in status] == ["ok", "ok", "ok", "diverged", "ok"]
    assert np.isnan(after[3]).all()
    np.testing.assert_array_equal(np.delete(after, 3, axis=0), np.delete(before, 3, axis=0))


@pytest.mark.parametrize(
    ("component", "value", "word"), [(7, 76.0, "diverged"), (8, -76.0, "diverged"), (4, 1.5, "left_envelope")]
)
def test_the_envelope_is_judged_from_the_start(suboff, smooth, component, value, word):
    """Sliding or sinking at ten times the trial speed, or standing at 86 degrees, fails before the first step."""
    start = smooth.initial_state.copy()
    start[component] = value
    states, status = Simulator(suboff, replace(smooth, initial_state=start), [0.0, 1.0], dt=0.5).run(suboff.xi)
    assert STATUS[status[0]] == word
    assert np.isnan(states).all()


def test_a_step_that_does_not_divide_the_manoeuvre(suboff, smooth):
    """The last step may reach beyond the end of the history, where the last controls stay."""
    steady = replace(smooth, controls=np.full_like(smooth.controls, 0.05))
    ragged, even = (Simulator(suboff, steady, [47.9], dt=dt).run(suboff.xi)[0][0, 0] for dt in (0.7, 0.25))
    # The truncation error at 0.7 s, below that of the test of order at 1 s.
    np.testing.assert_allclose(ragged[:3], even[:3], rtol=0, atol=1e-5)


def test_a_batch_that_fails_whole_ends(full, simulator, sets):
    """Every member may fail: all are marked, and what is left of each is kept."""
    for xi in sets:
        _runaway(xi, full)
    states, status = simulator.run(sets)
    assert (status == STATUS.index("diverged")).all()
    assert np.isnan(states[:, -1]).all()
    assert np.isfinite(states[:, 1]).all()
