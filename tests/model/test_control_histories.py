"""Controls that act late, or that follow a command: motions, derivatives, logs."""

from dataclasses import replace

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.model.disturbance import ForceHistory, Knots
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.simulator import Simulator

NAMES = ("delay_rudder_s", "scale_rudder", "bias_rudder_deg")
COMMANDED = ("lag_rudder_s", *NAMES)
STEP = 0.5
FASTER = 1.3  # than self-propelled, where the thrust bends
X, Y = 0, 1


@pytest.fixture(scope="module")
def turns(suboff):
    """Steps of the rudder, as a planes' log has them: ramps with kinks between the steps of the simulator."""
    zigzag = bs.load_manoeuvre("zigzag_20_20", suboff)
    return replace(zigzag, subproblem="horizontal", rpm=FASTER * zigzag.rpm)


@pytest.fixture(scope="module")
def unbent(suboff):
    """The coefficients without those of terms that bend where a speed is zero, where no difference is exact."""
    bent = ["abs(" in term.regressor or "sgn(" in term.regressor for term in suboff.equations.terms]
    return np.where(bent, 0.0, suboff.xi)


@pytest.fixture(scope="module")
def orders(suboff):
    """The commands of a rudder, at any times."""
    times = np.array([0.0, 20.3, 41.7, 63.2, 90.45, 120.0])
    controls = np.zeros((6, 3))
    controls[:, 0] = np.radians([0.0, 15.0, -15.0, 10.0, -5.0, -5.0])
    start = bs.load_manoeuvre("zigzag_20_20", suboff).initial_state
    rpm = np.full(6, FASTER * suboff.rpm_per_mps * suboff.speed_mps)
    return Manoeuvre("orders", times, controls, rpm, start, subproblem="horizontal", commanded=("delta_r",))


def flown(vehicle, manoeuvre, times, step=STEP, **options):
    amounts = options.pop("amounts", None)
    return Simulator(vehicle, manoeuvre, times, dt=step, **options).run(vehicle.xi, amounts=amounts)[0][0]


def shifted(manoeuvre, delay):
    """The same manoeuvre with controls that come later."""
    changed = {
        "times": np.append(0.0, manoeuvre.times + delay),
        "controls": np.vstack([manoeuvre.controls[:1], manoeuvre.controls]),
        "rpm": np.append(manoeuvre.rpm[0], manoeuvre.rpm),
    }
    return replace(manoeuvre, **changed)


def test_a_delay_is_that_of_a_shifted_history(suboff, turns):
    """To round-off with the same integration, and to the error of the steps with a fine one."""
    times = np.linspace(0.0, turns.duration, 101)
    late = flown(suboff, turns, times, varied=NAMES, amounts=np.array([[0.73, 0.0, 0.0]]))
    moved = shifted(turns, 0.73)
    np.testing.assert_allclose(flown(suboff, moved, times, varied=NAMES[:1]), late, rtol=0, atol=1e-10)
    exact = flown(suboff, moved, times, step=STEP / 20)
    error, of_stages = (np.abs(track - exact)[:, [X, Y]].max() for track in (late, flown(suboff, moved, times)))
    assert error < 2e-3
    assert of_stages > 20.0 * error  # values at the stages overlook where in a step a kink is


def test_changes_are_amounts(suboff, turns):
    """A delay, scale and bias of all members are those of a member."""
    times = np.linspace(0.0, turns.duration, 101)
    amounts = dict(zip(NAMES, (0.73, -0.1, 0.5), strict=True))
    one = flown(suboff, turns, times, varied=NAMES, amounts=np.array([list(amounts.values())]))
    np.testing.assert_allclose(flown(suboff, turns, times, changes=amounts), one, rtol=0, atol=1e-10)
    values = amounts | {"scale_rudder": 0.9}
    trajectory = bs.simulate(suboff, turns, dt=STEP, actuators=values)
    np.testing.assert_allclose(trajectory.resampled(times).states[0], one, rtol=0, atol=1e-10)
    np.testing.assert_array_equal(trajectory.log["delta_r"], turns.controls[:, 0])  # the log knows nothing of it
    late = np.interp(turns.times - 0.73, turns.times, turns.controls[:, 0])
    np.testing.assert_allclose(trajectory.controls[:, 0], 0.9 * late + np.radians(0.5), rtol=0, atol=1e-12)


def test_nothing_changes_where_nobody_asks(suboff, turns):
    """Bit for bit: a bias and a scale beside a rudder that is on time."""
    times = np.linspace(0.0, turns.duration, 101)
    simulator = Simulator(suboff, turns, times, dt=STEP, varied=NAMES[1:])
    at = [np.arange(len(simulator._stages)) * STEP + part * STEP for part in (0.0, 0.5, 1.0)]
    expected = [np.interp(when, turns.times, turns.controls[:, 0]) for when in at]
    np.testing.assert_array_equal(simulator._stages[:, :, 0], np.stack(expected, axis=1))
    assert not simulator.histories.individual


def differences(simulator, xi, amounts, sizes):
    """Derivatives by differences of fourth order (n_times, 12, n_varied)."""
    columns, sets = [], np.repeat(xi[None], 4, axis=0)
    for k, size in enumerate(sizes):
        steps = size * np.array([[-2.0], [-1.0], [1.0], [2.0]]) * np.eye(len(sizes))[k]
        a, b, c, d = simulator.run(sets, amounts=amounts + steps)[0]
        columns.append((a - 8.0 * b + 8.0 * c - d) / (12.0 * size))
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("amounts", [(0.0, 0.1, 0.4), (0.73, -0.1, 0.5), (-0.2, 0.0, 1.0)])
def test_derivatives_by_a_delay(suboff, unbent, turns, amounts):
    """Exact whether or not kinks of the history are where the steps begin, where the second derivatives jump."""
    simulator = Simulator(suboff, turns, np.linspace(0.0, turns.duration, 51), dt=STEP, varied=NAMES)
    amounts = np.array(amounts)
    slopes = simulator.sensitivities(unbent, NAMES, amounts=amounts)
    expected = differences(simulator, unbent, amounts, (1e-4, 1e-3, 1e-2))
    compare(slopes, expected)


def compare(slopes, expected):
    scale = np.abs(expected).max(axis=0)
    scale[scale == 0.0] = 1.0
    np.testing.assert_allclose(slopes / scale, expected / scale, rtol=0, atol=1e-6)


def test_derivatives_behind_a_command(suboff, unbent, orders):
    simulator = Simulator(suboff, orders, np.linspace(0.0, 120.0, 61), dt=STEP, varied=COMMANDED)
    amounts = np.array([0.4, 0.73, -0.1, 0.5])
    slopes = simulator.sensitivities(unbent, COMMANDED, amounts=amounts)
    expected = differences(simulator, unbent, amounts, (1e-5, 1e-5, 1e-4, 1e-3))
    compare(slopes, expected)


def test_a_command_is_answered_as_in_a_manoeuvre(suboff, orders):
    """By the answer of the actuator to the same demands, flown as a log of its angle in fine steps."""
    rudder, fine = suboff.actuators.members[0], np.linspace(0.0, 120.0, 12001)
    controls = np.zeros((len(fine), 3))
    controls[:, 0] = rudder.response(fine, orders.times, orders.controls[:, 0])
    rpm = np.full(len(fine), orders.rpm[0])
    angles = replace(orders, times=fine, controls=controls, rpm=rpm, commanded=())
    times = np.linspace(0.0, 120.0, 61)
    track = flown(suboff, orders, times)
    np.testing.assert_allclose(track, flown(suboff, angles, times, step=STEP / 20), rtol=0, atol=2e-3)
    trajectory = Simulator(suboff, orders, times, dt=STEP).trajectory(suboff.xi)
    np.testing.assert_allclose(trajectory.controls[:, 0], np.interp(times, fine, controls[:, 0]), rtol=0, atol=1e-9)
    assert set(trajectory.log) == {"rudder_command_deg", "delta_b", "delta_s", "rpm"}
    with refused("conflict", "controls"):
        Simulator(suboff, orders, times, dt=STEP, controls="hold")


def test_a_history_of_commands(suboff, orders, tmp_path):
    """A control history may have the commands of a plane in place of its angles; an angle goes first."""
    path = tmp_path / "orders.csv"
    rows = [f"{t},{np.degrees(c):.17g}" for t, c in zip(orders.times, orders.controls[:, 0], strict=True)]
    path.write_text("\n".join(["time_s,rudder_command_deg", *rows]) + "\n")
    read = bs.load_manoeuvre(path, suboff)
    assert read.commanded == ("delta_r",)
    np.testing.assert_allclose(read.controls, orders.controls, rtol=0, atol=1e-15)
    path.write_text("\n".join(["time_s,rudder_command_deg,rudder_deg", *(f"{row},3" for row in rows)]) + "\n")
    both = bs.load_manoeuvre(path, suboff)
    assert both.commanded == ()
    np.testing.assert_allclose(both.controls[:, 0], np.radians(3.0))


def test_each_member_has_its_own(suboff, orders):
    """A batch is its members one by one, bit for bit."""
    simulator = Simulator(suboff, orders, np.linspace(0.0, 120.0, 31), dt=STEP, varied=COMMANDED)
    amounts = np.random.default_rng(3).normal(size=(11, 4)) * [0.2, 0.5, 0.1, 1.0]
    sets = np.repeat(suboff.xi[None], 11, axis=0)
    together = simulator.run(sets, amounts=amounts)[0]
    for k in (0, 7, 10):
        np.testing.assert_array_equal(simulator.run(sets[:1], amounts=amounts[k : k + 1])[0][0], together[k])


def test_beside_forces_at_knots(suboff, unbent, orders):
    """Amounts and derivatives of late controls and of forces do not mix."""
    knots = Knots(np.linspace(0.0, 120.0, 4), ("Y", "N"))
    varied = ("bias_stern_plane_deg", "delay_rudder_s", "bias_rudder_deg")
    free = replace(orders, subproblem="horizontal")
    options = {"dt": STEP, "subproblem": "horizontal", "varied": varied, "knots": knots}
    simulator = Simulator(suboff, free, np.linspace(0.0, 120.0, 31), **options)
    amounts = np.concatenate([[0.0, 0.4, 0.3], 2e4 * np.arange(4), 1e6 * np.arange(4)])
    names = (*varied, *knots.parameters)
    slopes = simulator.sensitivities(unbent, ("Yuv", *names), amounts=amounts)
    sizes = (1e-3, 1e-4, 1e-3, *np.full(4, 1e2), *np.full(4, 1e4))
    expected = differences(simulator, unbent, amounts, sizes)
    compare(slopes[..., 2:], expected[..., 1:])  # a stern plane does nothing here but have a number
    np.testing.assert_array_equal(slopes[..., 1], 0.0)
    forces = ForceHistory(knots.times, knots.axes, amounts[3:].reshape(2, 4).T)
    changes = dict(zip(varied, amounts[:3], strict=True))
    options = {"dt": STEP, "subproblem": "horizontal", "changes": changes, "forces": forces}
    expected = Simulator(suboff, free, simulator.times, **options).run(unbent)[0]
    np.testing.assert_allclose(simulator.run(unbent, amounts=amounts[None])[0], expected, rtol=0, atol=1e-9)
