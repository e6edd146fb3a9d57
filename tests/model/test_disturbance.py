"""Unmodelled forces: the random processes, their histories, and flights that feel them."""

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.logs.log_files import positions
from bayesub.model.disturbance import KINDS, Disturbance, ForceHistory, Knots, correlation, hull_force_rms, hull_forces
from bayesub.model.equations import AXES
from bayesub.model.linear_form import linear_systems

STEP = 0.5  # s
PROCESS = Disturbance(("X", "Y", "N"), np.array([2e4, 1e5, 5e6]), 5.0)


class UnitNoise:
    """Random numbers that are zero but for one."""

    def __init__(self, place):
        self.place = place

    def standard_normal(self, shape):
        noise = np.zeros(shape)
        noise.flat[self.place] = 1.0
        return noise


@pytest.fixture(scope="module")
def disturbed(suboff, spiral):
    """The suboff boat on the horizontal spiral, disturbed."""
    return bs.simulate(suboff, spiral, dt=STEP, sample=STEP, disturbance=PROCESS, rng=np.random.default_rng(3))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("step", [0.01, 0.3, 4.0])
def test_covariance_is_that_of_the_process(kind, step):
    """A history is linear in its white noise: the products of what each number makes add up to the closed form."""
    n, sd, time = 40, 3.0, 2.5
    times = 7.0 + step * time * np.arange(n)
    n_numbers = 2 * n if kind == "matern_3_2" else n
    process = Disturbance(("Y",), np.array([sd]), time, kind)
    parts = np.array([process.sample(times, UnitNoise(k)).values[:, 0] for k in range(n_numbers)])
    lags = np.abs(times[:, None] - times)
    np.testing.assert_allclose(parts.T @ parts, sd**2 * correlation(kind, lags / time), rtol=0, atol=1e-9 * sd**2)


@pytest.mark.parametrize("kind", KINDS)
def test_histories_have_their_sds_and_are_independent(kind, rng):
    """Of 20,000 correlation times; a sd is then known to a per cent."""
    sds = np.array([1.0, 30.0, 0.2])
    process = Disturbance(("X", "Y", "N"), sds, 2.0, kind)
    history = process.sample(2.0 * np.arange(20_000), rng)
    assert history.axes == process.axes
    np.testing.assert_allclose(history.values.std(axis=0), sds, rtol=0.03)
    assert np.abs(np.corrcoef(history.values.T) - np.eye(3)).max() < 0.04


def test_a_history_is_that_of_its_seed():
    times = np.arange(50.0)
    first, again, other = (PROCESS.sample(times, np.random.default_rng(seed)).values for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).min() > 0.0


def test_histories_are_linear_between_times_and_constant_outside():
    history = ForceHistory(np.array([1.0, 3.0]), ("Y", "K"), np.array([[2.0, -1.0], [4.0, 1.0]]))
    forces = history.at(np.array([0.0, 1.5, 9.0]))
    expected = np.zeros((3, 6))
    expected[:, AXES.index("Y")], expected[:, AXES.index("K")] = [2.0, 2.5, 4.0], [-1.0, -0.5, 1.0]
    np.testing.assert_array_equal(forces, expected)


def test_hats_interpolate(rng):
    knots = Knots(np.linspace(0.0, 9.0, 7), ("Y",))
    values, times = rng.standard_normal(7), np.array([0.0, 0.1, 1.5, 4.4, 8.99, 9.0])
    rows, places, weights = knots.hats(times)
    found = np.bincount(rows, weights * values[places], minlength=len(times))
    np.testing.assert_allclose(found, np.interp(times, knots.times, values), rtol=1e-12)


@pytest.mark.parametrize(
    ("changes", "kind", "key"),
    [
        ({"axes": ("X", "Q")}, "unknown", "Q"),
        ({"axes": ("X", "X")}, "conflict", "X"),
        ({"axes": ()}, "missing", "axes"),
        ({"kind": "matern"}, "unknown", "kind"),
        ({"sds": np.array([1.0, 0.0])}, "value", "N"),
        ({"correlation_time_s": -1.0}, "value", "correlation_time_s"),
    ],
)
def test_processes_that_cannot_be(changes, kind, key):
    arguments = {"axes": ("Y", "N"), "sds": np.array([1.0, 2.0]), "correlation_time_s": 4.0, "kind": KINDS[0]}
    with refused(kind, key):
        Disturbance(**arguments | changes)


def test_a_disturbed_boat_accelerates_by_its_forces(disturbed):
    """Mass times what the accelerations differ from those of the undisturbed boat in the same states is the force."""
    simulator = disturbed.simulator
    without = simulator.undisturbed.accelerations(disturbed.xi, disturbed.states)[0]
    forces = simulator.forces.at(disturbed.times)
    made = (disturbed.accelerations[0] - without) @ simulator.vehicle.mass_matrix.T
    np.testing.assert_allclose(made[:, [0, 1, 5]], forces[:, [0, 1, 5]], rtol=1e-9, atol=1e-6)
    assert not forces[:, 2:5].any()
    # And the velocities follow from the accelerations, of which RK4 knows the middle of each step too.
    simulated = np.diff(disturbed.states[0][:, positions("u", "v", "r")], axis=0) / STEP
    ends = disturbed.accelerations[0][:, [0, 1, 5]]
    assert np.abs(simulated - 0.5 * (ends[1:] + ends[:-1])).max() < 0.02 * np.abs(ends).max()


def test_a_disturbed_track_is_another_one_and_keeps_its_forces(disturbed, suboff, spiral):
    """Sampled elsewhere it is the same flight; without rng it cannot be drawn; with the history itself it is it."""
    again = disturbed.resampled(disturbed.times[::7])
    np.testing.assert_array_equal(again.states, disturbed.states[:, ::7])
    assert again.simulator.forces is disturbed.simulator.forces
    calm = bs.simulate(suboff, spiral, dt=STEP, sample=STEP)
    assert np.abs(disturbed.states - calm.states)[0, -1, :2].min() > 1.0
    given = bs.simulate(suboff, spiral, dt=STEP, sample=STEP, disturbance=disturbed.simulator.forces)
    np.testing.assert_array_equal(given.states, disturbed.states)
    assert disturbed.simulator.forces.times[-1] >= spiral.duration
    with refused("missing", "rng"):
        bs.simulate(suboff, spiral, dt=STEP, disturbance=PROCESS)


def test_flights_that_cannot_be_disturbed(suboff, spiral, rng):
    quick = Disturbance(("Y",), np.ones(1), 0.4)
    with refused("conflict", "correlation_time_s"):
        bs.simulate(suboff, spiral, dt=STEP, disturbance=quick, rng=rng)
    across = Disturbance(("Z",), np.ones(1), 4.0)
    with refused("conflict", "Z"):
        bs.simulate(suboff, spiral, dt=STEP, disturbance=across, rng=rng)


def test_hull_forces_are_what_mass_times_acceleration_lacks_without_them(suboff, spiral_track):
    """The kernels fly the boat with added masses and controls only: what they then lack are the velocity terms."""
    equations, simulator = suboff.equations, spiral_track.simulator
    commands = {control.symbol for control in equations.controls} | {"uc", "duc"}
    kept = [term.is_added_mass or bool(term.symbols & commands) for term in equations.terms]
    bare = np.where(kept, suboff.xi, 0.0)
    without = simulator.accelerations(bare, spiral_track.states)[0]
    lacking = (spiral_track.accelerations[0] - without) @ simulator.vehicle.mass_matrix.T
    forces = hull_forces(spiral_track)
    scale = np.abs(forces).max(axis=0)[[0, 1, 5]]
    assert np.abs((forces - lacking)[:, [0, 1, 5]]).max(axis=0) == pytest.approx(np.zeros(3), abs=1e-9 * scale.max())
    assert not forces[:, 2:5].any()
    # Undisturbed, whatever the simulator feels; two flights count by their durations.
    rms = hull_force_rms([simulator])
    np.testing.assert_allclose(rms[[0, 1, 5]], np.sqrt(np.mean(forces**2, axis=0))[[0, 1, 5]], rtol=2e-3)
    np.testing.assert_array_equal(hull_force_rms([simulator.disturbed(PROCESS, np.random.default_rng(1))]), rms)
    np.testing.assert_allclose(hull_force_rms([simulator, simulator]), rms, rtol=1e-12)


def test_the_linear_form_knows_nothing_of_a_disturbance(disturbed):
    """What the load has more than the terms of the equations is the force on that axis, and no column is lost."""
    systems = linear_systems(disturbed)
    calm = linear_systems(disturbed.simulator.undisturbed.trajectory(disturbed.xi))
    forces, xi = (
        disturbed.simulator.forces.at(disturbed.times),
        dict(zip(_names(disturbed), disturbed.xi[0], strict=True)),
    )
    for axis, system in systems.items():
        assert system.names == calm[axis].names
        lacking = system.load - system.matrix @ [xi[name] for name in system.names]
        scale = np.abs(system.load).max()
        np.testing.assert_allclose(lacking, forces[:, AXES.index(axis)], rtol=0, atol=1e-9 * scale)


def _names(trajectory):
    return trajectory.simulator.vehicle.equations.names
