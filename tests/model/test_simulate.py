"""Simulated motions: symmetry, straight flight, sub-problems, and what a user may ask for."""

from dataclasses import replace

import numpy as np
import pytest
from support.motions import smooth_manoeuvre
from support.refusals import refused

import bayesub as bs
from bayesub.kernels.workspace import BODY
from bayesub.logs.log_files import OUTPUTS
from bayesub.model.coefficients import AXES, HORIZONTAL, INDEX, NAMES, names_of_axis
from bayesub.model.simulator import STEP_TOLERANCE_M, Simulator, choose_step

# What changes sign when port and starboard are exchanged.
ODD_STATES = np.array([1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1])
ODD_AXES = {"X": 1, "Y": -1, "Z": 1, "K": -1, "M": 1, "N": -1}
ODD_ACCELERATIONS = np.array(list(ODD_AXES.values()))
ODD_CONTROLS = np.array([-1, 1, 1])


def with_body(vehicle, **values):
    return replace(vehicle, body=np.array([values.get(key, old) for key, old in zip(BODY, vehicle.body, strict=True)]))


def with_xi(vehicle, **values):
    return replace(vehicle, xi=np.array([values.get(name, old) for name, old in zip(NAMES, vehicle.xi, strict=True)]))


def lopsided_terms(rng):
    """The coefficients whose regressor has the other parity than their axis: they tell port from starboard."""
    states, accelerations, controls = (
        rng.standard_normal((1, 12)),
        rng.standard_normal((1, 6)),
        rng.uniform(size=(1, 3)),
    )
    here = bs.regressors(states, accelerations, controls)
    there = bs.regressors(states * ODD_STATES, accelerations * ODD_ACCELERATIONS, controls * ODD_CONTROLS)
    return [
        name
        for axis in AXES
        for name, a, b in zip(names_of_axis(axis), here[axis][0], there[axis][0], strict=True)
        if a != ODD_AXES[axis] * b
    ]


@pytest.fixture
def mirrored(full, rng):
    """The full boat made symmetric about its centre plane."""
    symmetric = with_xi(full, **dict.fromkeys(lopsided_terms(rng), 0.0))
    return with_body(symmetric, **dict.fromkeys(("yG", "yB", "Ixy", "Iyz", "Kn1", "Kn2"), 0.0))


def mirror_images(vehicle):
    """States on a manoeuvre and on its mirror image."""
    manoeuvre = smooth_manoeuvre(vehicle, 60.0)
    image = replace(manoeuvre, controls=manoeuvre.controls * ODD_CONTROLS)
    return [bs.simulate(vehicle, m, dt=0.5, sample=0.7).states[0] for m in (manoeuvre, image)]


def test_three_terms_tell_port_from_starboard(rng):
    """Of the 101 terms only Yuu, Kuu and Nuu push an undisturbed boat to one side."""
    assert lopsided_terms(rng) == ["Yuu", "Kuu", "Nuu"]


def test_mirrored_rudder_gives_the_mirrored_track(mirrored):
    """A symmetric boat in coupled motion flies the mirror image of the mirrored manoeuvre, to the last bit."""
    track, image = mirror_images(mirrored)
    np.testing.assert_array_equal(image, track * ODD_STATES)
    assert np.abs(track[:, [1, 3, 4, 5, 7, 8, 9, 10, 11]]).max(axis=0).min() > 1e-3  # and it does move every way


@pytest.mark.parametrize("name", ["Yuu", "Kuu", "Nuu"])
def test_a_lopsided_coefficient_breaks_the_mirror(mirrored, name):
    """Negative control: each of the three terms sends the boat to its own side."""
    track, image = mirror_images(with_xi(mirrored, **{name: 1e-5}))
    assert np.abs(image - track * ODD_STATES)[:, :3].max() > 1e-3


@pytest.mark.parametrize("key", ["yG", "yB", "Ixy", "Iyz", "Kn1"])
def test_a_lopsided_body_breaks_the_mirror(mirrored, full, key):
    """Negative control: so does each asymmetry of the body and the torque of the propeller."""
    track, image = mirror_images(with_body(mirrored, **{key: full.body[BODY.index(key)]}))
    assert np.abs(image - track * ODD_STATES).max() > 1e-7


@pytest.mark.parametrize(("name", "surplus"), [("suboff", 1e-5), ("auv690", 0.0), ("npsauv", 0.0)])
def test_straight_flight(name, surplus):
    """Planes amidships and self-propelled, all three boats go straight ahead at their trial speed.

    The thrust of suboff is printed to five digits and exceeds its drag by 1e-5, which raises the speed by at most half
    of that; the products of inertia of npsauv turn the round-off of its thrust into rotations of 1e-18.
    """
    vehicle = bs.load_vehicle(name)
    b = dict(zip(BODY, vehicle.body, strict=True))
    drag = -vehicle.xi[0] * vehicle.dimensional_factors[0]
    assert (b["b4"] + b["b5"] + b["b6"]) / drag - 1 == pytest.approx(surplus, rel=1e-6, abs=1e-15)
    times = np.linspace(0.0, 44.0 * vehicle.length_m / vehicle.speed_mps, 601)
    start = np.zeros(12)
    start[2], start[6] = vehicle.depth_m, vehicle.speed_mps
    ahead = np.full(601, vehicle.rpm_per_mps * vehicle.speed_mps)
    track = bs.simulate(vehicle, bs.Manoeuvre("ahead", times, np.zeros((601, 3)), ahead, start))
    states = track.states[0]
    gain = states[:, 0] / (vehicle.speed_mps * times.clip(1e-9)) - 1
    round_off = times[-1] / track.simulator.step * np.finfo(float).eps  # one a step
    assert np.all(gain[1:] <= 0.5 * surplus + round_off)
    assert np.all(gain[1:] >= -round_off)
    # Interpolation between steps may move a constant depth by its last bit.
    np.testing.assert_allclose(states[:, 2], vehicle.depth_m, rtol=2.3e-16)
    rest = states[:, [1, 3, 4, 5, 7, 8, 9, 10, 11]]
    assert np.abs(rest).max() <= (1e-17 if name == "npsauv" else 0.0)


@pytest.mark.parametrize(
    ("subproblem", "still"), [("horizontal", [2, 3, 4, 8, 9, 10]), ("vertical", [1, 3, 5, 7, 9, 11])]
)
def test_sub_problems_stay_in_their_plane(full, coupled, subproblem, still):
    """A boat with every offset and coupling, confined to a plane, never leaves it by a single bit."""
    states = bs.simulate(full, coupled, dt=0.5, sample=0.5, subproblem=subproblem).states[0]
    np.testing.assert_array_equal(states[:, still], np.broadcast_to(coupled.initial_state[still], (97, 6)))
    moving = np.setdiff1d(np.arange(12), still)
    assert np.ptp(states[:, moving], axis=0).min() > 1e-3
    free = bs.simulate(full, coupled, dt=0.5, sample=0.5).states[0]
    assert np.ptp(free[:, still], axis=0).min() > 1e-5  # negative control: unconfined, it does


def test_horizontal_sub_problem_uses_25_coefficients(suboff, spiral):
    """The horizontal motion depends on the 25 coefficients of its plane and on no other."""
    base, *changed = bs.simulate(
        suboff,
        spiral,
        xi=np.vstack([suboff.xi, suboff.xi + 0.2 * np.eye(101) * np.abs(suboff.xi).clip(1e-4)]),
        dt=1.0,
        sample=10.0,
    ).states
    matters = {name for name, states in zip(NAMES, changed, strict=True) if not np.array_equal(states, base)}
    assert matters == set(HORIZONTAL)


def test_automatic_step_keeps_its_promise(suboff, spiral):
    """The chosen step is within 5 cm of a step twenty times finer."""
    step = choose_step(suboff, spiral, "horizontal")
    times = np.linspace(0.0, 600.0, 61)
    coarse, fine = (Simulator(suboff, spiral, times, dt=dt).run(suboff.xi)[0][0, :, :3] for dt in (step, step / 20))
    assert np.linalg.norm(coarse - fine, axis=1).max() < STEP_TOLERANCE_M


def test_accelerations_are_the_derivative_of_the_velocities(suboff):
    """Reported accelerations are what the velocities do."""
    track = bs.simulate(suboff, smooth_manoeuvre(suboff, 48.0), dt=0.125, sample=0.125)
    slopes = (track.states[0, 2:, 6:] - track.states[0, :-2, 6:]) / 0.25
    errors = np.abs(slopes - track.accelerations[0, 1:-1])
    # A central difference is off by a sixth of step^2 times the third derivative: a sixth of the second difference of
    # the slopes, where that is steady; 1.5 for where it is not.
    bound = 1.5 / 6 * np.abs(np.diff(track.accelerations[0], n=2, axis=0)).max(axis=0)
    assert np.all(errors.max(axis=0) < bound)


def test_resampled_motion_is_the_same_motion(full, coupled):
    """Other output times show the same trajectory."""
    track = bs.simulate(full, coupled, dt=0.5, sample=0.5)
    again = track.resampled(track.times[::4])
    np.testing.assert_array_equal(again.states, track.states[:, ::4])
    np.testing.assert_array_equal(again.accelerations, track.accelerations[:, ::4])


@pytest.mark.parametrize(
    ("options", "kind", "key"),
    [
        ({"dt": 0.0}, "value", "dt"),
        ({"dt": -1.0}, "value", "dt"),
        ({"dt": np.nan}, "value", "dt"),
        ({"dt": np.inf}, "value", "dt"),
        ({"sample": 0.0}, "value", "sample"),
        ({"sample": 601.0}, "value", "sample"),
        ({"sample": np.nan}, "value", "sample"),
        ({"xi": np.zeros(100)}, "value", "xi"),
        ({"xi": np.zeros((1, 2, 101))}, "value", "xi"),
        ({"xi": np.full(101, np.nan)}, "value", "xi"),
        ({"subproblem": "diagonal"}, "unknown", "subproblem"),
        ({"controls": "cubic"}, "unknown", "controls"),
    ],
)
def test_bad_requests(suboff, spiral, options, kind, key):
    """What cannot be simulated is refused in one line."""
    with refused(kind, key) as error:
        bs.simulate(suboff, spiral, **options)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("times", [[], [-1.0, 2.0], [0.0, 601.0]])
def test_output_times_outside_the_manoeuvre(suboff, spiral, times):
    """Output is only given where there is motion."""
    with refused("value", "times"):
        Simulator(suboff, spiral, times, dt=1.0)


@pytest.mark.parametrize("times", [[0.0, 20.0, 10.0], [30.0, 20.0], [0.0, np.nan, 20.0], [np.nan]])
def test_output_times_that_do_not_ascend(suboff, spiral, times):
    """They are refused, by the simulator and by whoever samples a trajectory again; equal ones have equal states."""
    with refused("value", "times"):
        Simulator(suboff, spiral, times, dt=0.5)
    track = Simulator(suboff, spiral, [0.0, 10.0, 10.0, 20.0], dt=0.5).trajectory(suboff.xi)
    np.testing.assert_array_equal(track.states[0, 1], track.states[0, 2])
    with refused("value", "times"):
        track.resampled(times)


def test_outputs_of_a_trajectory(full, coupled):
    """States and accelerations by their names."""
    track = bs.simulate(full, coupled, dt=0.5, sample=5.0)
    outputs = track.outputs(("rdot", "x", "psi"))
    np.testing.assert_array_equal(outputs[..., 0], track.accelerations[..., 5])
    np.testing.assert_array_equal(outputs[..., 1:], track.states[..., [0, 5]])


def test_status_words(suboff, spiral):
    """A failed member of a trajectory is named so, and cannot be measured."""
    xi = np.repeat(suboff.xi[None], 2, axis=0)
    xi[1, INDEX["Xuu"]] = 0.1
    track = bs.simulate(suboff, spiral, xi=xi, dt=1.0, sample=5.0)
    assert track.status.tolist() == ["ok", "diverged"]
    with refused("model", "trajectory"):
        bs.observe(track, bs.sensors.Track(1.0, 1.0), np.random.default_rng(0), member=1)


def test_accelerations_beside_the_states(full, coupled):
    """Accelerations that come with the motion are those of the equations of motion: exactly at the ends of steps, and
    to the order of a cubic between them."""
    on, between = np.arange(0.0, 48.5, 0.5), np.arange(0.25, 48.0, 0.5)
    for times, bound in ((on, 1e-13), (between, 2e-4)):
        simulator = Simulator(full, coupled, times, dt=0.5)
        states, _ = simulator.run(full.xi, outputs=OUTPUTS)
        expected = simulator.accelerations(full.xi, np.ascontiguousarray(states[..., :12]))
        size = np.abs(expected).max(axis=(0, 1))
        errors = np.abs(states[..., 12:] - expected)[0]
        # A thrust branch that switches within a step is a jump, which no cubic follows.
        assert np.all(np.quantile(errors, 0.95, axis=0) < bound * size)


def test_outputs_are_chosen_in_any_order(full, coupled):
    """What is kept of a motion does not change it, in Euler angles and in quaternions."""
    chosen = ("rdot", "psi", "x", "udot", "theta", "w")
    columns = [OUTPUTS.index(name) for name in chosen]
    for attitude in ("euler", "quaternion"):
        simulator = Simulator(full, coupled, np.arange(0.25, 48.0, 0.5), dt=0.5, attitude=attitude)
        everything, _ = simulator.run(full.xi, outputs=OUTPUTS)
        np.testing.assert_array_equal(simulator.run(full.xi, outputs=chosen)[0], everything[..., columns])


def test_each_member_may_have_its_own_body_and_start(full, coupled):
    """Bodies and starts given to a batch are those of vehicles and manoeuvres that have them."""
    heavier, moved = full.body * [1.01, *np.ones(26)], coupled.initial_state + np.eye(12)[7]
    simulator = Simulator(full, coupled, [10.0, 48.0], dt=0.5)
    body, initial = np.stack([full.body, heavier, full.body]), np.stack([coupled.initial_state] * 2 + [moved])
    states, _ = simulator.run(np.repeat(full.xi[None], 3, axis=0), body=body, initial=initial)
    for member, vehicle, manoeuvre in (
        (0, full, coupled),
        (1, replace(full, body=heavier), coupled),
        (2, full, replace(coupled, initial_state=moved)),
    ):
        alone, _ = Simulator(vehicle, manoeuvre, [10.0, 48.0], dt=0.5).run(full.xi)
        np.testing.assert_array_equal(states[member], alone[0])


def test_the_track_of_a_ship_has_no_revolutions(tmp_path):
    """Its propulsion is in the terms of the equations; what stands for the propeller speed is no rpm."""
    ship = bs.load_vehicle("mariner")
    trajectory = bs.simulate(ship, bs.load_manoeuvre("zigzag_20_20", ship), sample=10.0)
    assert trajectory.log.keys() == {"delta_r"}
    trajectory.save(tmp_path / "track.csv")
    assert "rpm" not in (tmp_path / "track.csv").read_text()


def test_a_step_of_more_than_a_ship_length_is_refused(suboff, spiral):
    """In it a boat does all that its derivatives say; at 7.5 m/s SUBOFF travels its length in 13.6 s."""
    assert bs.simulate(suboff, spiral, dt=13.6, sample=13.6).status.shape == (1,)
    for dt in (13.7, 1e5):
        with refused("limit", "dt"):
            bs.simulate(suboff, spiral, dt=dt)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_fault_of_an_actuator_that_is_no_number_is_refused(suboff, spiral, value):
    """A delay that is none would take the rudder away."""
    with refused("value", "delay_rudder_s"):
        bs.simulate(suboff, spiral, actuators={"delay_rudder_s": value})
