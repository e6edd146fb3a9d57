"""Autopilots: the law against a slow one, recorded orders flown again, and boats that keep heading, depth and path."""

from dataclasses import replace

import numpy as np
import pytest
import tomli_w
from support.fins import X_TAIL, fins, with_actuators
from support.refusals import refused

import bayesub as bs
from bayesub.kernels.kalman import Policy
from bayesub.kernels.workspace import BODY
from bayesub.logs.log_files import positions
from bayesub.model.autopilot import SteeredSimulator, load_autopilot
from bayesub.model.manoeuvres import of_inputs
from bayesub.model.simulator import Simulator
from bayesub.problem.nuisance import of_boat

SERVO = {"plane_limit_deg": 20.0, "plane_rate_degps": 4.0}
HEADING = SERVO | {
    "time_s": [0.0, 60.0],
    "heading_deg": [0.0, 60.0],
    "rudder_per_heading": 1.0,
    "rudder_per_yaw_rate": 1.0,
    "rudder_per_heading_travelled": 0.02,
}
DEPTH = SERVO | {
    "time_s": [0.0, 30.0],
    "depth_m": [100.0, 110.0],
    "pitch_per_depth": 1.0,
    "pitch_per_depth_travelled": 0.1,
    "pitch_limit_deg": 8.0,
    "plane_per_pitch": 1.0,
    "plane_per_pitch_rate": 1.0,
    "bow_planes": True,
}
CALM = DEPTH | {"pitch_per_depth": 0.4, "pitch_per_depth_travelled": 0.02, "bow_planes": False}
PILOT = {"name": "pilot", "interval_s": 0.7, "heading": HEADING, "depth": DEPTH}
X, Y, Z, PHI, THETA, PSI, Q, R = positions("x", "y", "z", "phi", "theta", "psi", "q", "r")


@pytest.fixture(scope="module")
def suboff():
    return bs.load_vehicle("suboff")


@pytest.fixture
def pilot(tmp_path):
    """pilot(changes of PILOT): the autopilot of that file; a table of None is left out."""

    def load(**changes):
        content = {key: value for key, value in (PILOT | changes).items() if value is not None}
        (tmp_path / "pilot.toml").write_text(tomli_w.dumps(content))
        return load_autopilot(tmp_path / "pilot.toml")

    return load


def steered(vehicle, autopilot, manoeuvre="coupled", times=(300.0,), **given):
    return SteeredSimulator(
        vehicle, bs.load_manoeuvre(manoeuvre, vehicle), np.array(times), autopilot=autopilot, **given
    )


def near(vehicle, n, rng):
    """Coefficient sets (n, n_terms) within some per cent of those of a vehicle."""
    return vehicle.xi * (1.0 + 0.05 * rng.standard_normal((n, len(vehicle.xi))))


def test_each_boat_obeys_the_law_that_a_slow_loop_evaluates(suboff, pilot, rng):
    """Integrals, limits and rates too; planes are where the loop puts them after each interval, of every member."""
    every = np.arange(0.0, 300.0, PILOT["interval_s"])
    simulator = steered(suboff, pilot(), times=every)
    states, status, planes = simulator.steered(near(suboff, 3, rng))
    assert not status.any()
    second = suboff.speed_mps / suboff.length_m
    limited = set()
    for motion, record in zip(states, planes, strict=True):
        angles, turned, sunk = np.zeros(3), 0.0, 0.0
        for k, time in enumerate(every[:-1]):
            state = motion[k]
            off = state[PSI] - np.radians(60.0 if time >= 60.0 else 0.0)
            rudder = off + state[R] / second + 0.02 * turned
            turned += 0.7 * second * off * (abs(rudder) < np.radians(20.0))
            deep = (state[Z] - (110.0 if time >= 30.0 else 100.0)) / suboff.length_m
            pitch = deep + 0.1 * sunk
            sunk += 0.7 * second * deep * (abs(pitch) < np.radians(8.0))
            pitch = max(-np.radians(8.0), min(np.radians(8.0), pitch))
            rate = state[Q] * np.cos(state[PHI]) - state[R] * np.sin(state[PHI])
            stern = state[THETA] - pitch + rate / second
            for i, order in enumerate((rudder, stern, -stern)):
                limited |= {"limit"} if abs(order) > np.radians(20.0) else set()
                order = max(-np.radians(20.0), min(np.radians(20.0), order))
                most = 0.7 * np.radians(4.0)
                limited |= {"rate"} if abs(order - angles[i]) > most else set()
                angles[i] += max(-most, min(most, order - angles[i]))
            np.testing.assert_allclose(record[k + 1], angles, rtol=0.0, atol=1e-9)
    assert limited == {"limit", "rate"}  # so that both were tried


@pytest.mark.parametrize("tail", ["controls", "X tail"])
def test_what_was_recorded_flies_the_same_track_without_autopilot(pilot, boat, vehicle_with, tail):
    """The history of the planes as a manoeuvre, by the open-loop simulator with the same step."""
    vehicle = vehicle_with(with_actuators(boat, *fins(*X_TAIL)) if tail == "X tail" else boat)
    depth = DEPTH | {"bow_planes": tail == "controls", "depth_m": [vehicle.depth_m, vehicle.depth_m + 10.0]}
    simulator = steered(vehicle, pilot(depth=depth), times=np.linspace(0.0, 300.0, 101))
    recorded = simulator.recorded()
    assert np.abs(recorded.controls[:, [0, 2]]).max(axis=0).min() > np.radians(3.0)
    (flown,), _ = Simulator(vehicle, recorded, simulator.times, dt=simulator.step).run(vehicle.xi)
    (under,), _ = simulator.run(vehicle.xi)
    np.testing.assert_allclose(flown, under, rtol=1e-9, atol=1e-9)


def test_members_do_not_depend_on_each_other(suboff, pilot, rng):
    simulator, sets = steered(suboff, pilot(), times=np.linspace(0.0, 200.0, 41)), near(suboff, 11, rng)
    together, _ = simulator.run(sets)
    for k in (0, 7, 10):
        np.testing.assert_array_equal(simulator.run(sets[k : k + 1])[0][0], together[k])


def test_heading_and_depth_are_reached_by_boats_that_differ(suboff, pilot, rng):
    quick = HEADING | {"rudder_per_heading_travelled": 0.0}  # an integral takes fifty lengths to forget the turn
    simulator = steered(suboff, pilot(heading=quick, depth=CALM), times=(590.0, 600.0))
    states, status = simulator.run(near(suboff, 20, rng))
    assert not status.any()
    assert np.abs(np.degrees(states[..., PSI]) - 60.0).max() < 0.1
    assert np.abs(states[..., Z] - 110.0).max() < 0.01 * suboff.length_m


def test_without_its_integral_a_boat_that_is_out_of_trim_stays_beside_its_depth(suboff, pilot):
    body = suboff.body.copy()[None]
    body[0, BODY.index("weight")] *= 1.002
    flown = [pilot(depth=CALM | {"pitch_per_depth_travelled": gain}) for gain in (0.02, 0.0)]
    depths = [steered(suboff, p, times=(600.0,)).run(suboff.xi, body=body)[0][0, -1, Z] for p in flown]
    held, beside = np.array(depths) - 110.0
    assert abs(beside) > 2.0
    assert abs(held) < 0.2 * abs(beside)


def test_a_path_is_followed_from_waypoint_to_waypoint(suboff, pilot):
    """Each is passed within the acceptance, and on the long leg the boat comes onto the line."""
    points = [[1000.0, 0.0], [1000.0, 1500.0]]
    path = {"waypoints_m": points, "lookahead_m": 400.0, "acceptance_m": 300.0, "rudder_per_heading_travelled": 0.0}
    heading = {key: value for key, value in (HEADING | path).items() if key not in ("heading_deg", "time_s")}
    simulator = steered(suboff, pilot(heading=heading, depth=None), "turning_circle", np.arange(0.0, 560.0, 2.0))
    (motion,), status = simulator.run(suboff.xi)
    assert not status.any()
    for north, east in points:
        assert np.hypot(motion[:, X] - north, motion[:, Y] - east).min() < 300.0
    on_leg = (motion[:, Y] > 1000.0) & (motion[:, Y] < 1300.0) & (motion[:, X] > 500.0)
    assert np.abs(motion[on_leg, X] - 1000.0).max() < suboff.length_m / 3.0


def test_an_unstable_boat_keeps_its_heading_only_under_the_autopilot(suboff, pilot):
    """With Nuv seven times as large a straight course is unstable: without the rudder the boat turns away."""
    sets = suboff.xi.copy()[None]
    sets[0, suboff.equations.index["Nuv"]] *= 7.0
    straight = replace(bs.load_manoeuvre("turning_circle", suboff))
    kick = np.zeros((1, 12))
    kick[0] = straight.initial_state
    kick[0, R] = np.radians(0.01)
    steady = HEADING | {"time_s": [0.0], "heading_deg": [0.0]}
    simulator = steered(suboff, pilot(heading=steady, depth=None), "turning_circle", (600.0,))
    still = replace(straight, controls=np.zeros_like(straight.controls))
    free = Simulator(suboff, still, np.array([600.0]), dt=simulator.step)
    under, loose = (np.degrees(s.run(sets, initial=kick)[0][0, -1, PSI]) for s in (simulator, free))
    assert abs(under) < 1.0
    assert abs(loose) > 30.0


def test_a_fin_of_which_a_scale_is_unknown_does_as_much_of_its_orders(suboff, pilot):
    """A boat whose rudder turns twice as far as ordered flies what one flies that is ordered twice as far."""
    name = "scale_rudder"
    assert of_boat(name, suboff)
    gains = {key: 2.0 * value for key, value in HEADING.items() if key.startswith("rudder")}
    twice = pilot(heading=HEADING | gains | {"plane_limit_deg": 40.0, "plane_rate_degps": 8.0}, depth=None)
    (ordered,), _ = steered(suboff, twice, "turning_circle", (100.0, 300.0)).run(suboff.xi)
    for varied, amounts in (((name,), [1.0]), (("delay_rudder_s", name), [3.0, 1.0])):  # a delay has no part
        once = steered(suboff, pilot(depth=None), "turning_circle", (100.0, 300.0), varied=varied)
        (scaled,), _ = once.run(suboff.xi, amounts=np.array([amounts]))
        np.testing.assert_allclose(scaled, ordered, rtol=1e-9, atol=1e-9)


def test_what_it_cannot_steer_is_refused(suboff, pilot):
    for manoeuvre, key in (("vertical", "heading"), ("horizontal", "depth")):
        with refused("conflict", key):
            steered(suboff, pilot(), manoeuvre)
    with refused("unknown", "rudder_deg"):
        rov = bs.load_vehicle("bluerov2")
        straight = of_inputs("straight", np.array([0.0, 9.0]), np.zeros((2, 8)), np.zeros(2), np.eye(12)[6], rov)
        SteeredSimulator(rov, straight, straight.times, autopilot=pilot(depth=None))
    with refused("conflict", "steering"):
        steered(suboff, pilot()).run(suboff.xi, steering=Policy)


PATH = {"waypoints_m": [[1.0, 2.0]], "lookahead_m": 10.0, "acceptance_m": 5.0}


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"heading": None, "depth": None}, ""),
        ({"heading": HEADING | {"time_s": [0.0, 0.0]}}, "heading"),
        ({"heading": HEADING | {"time_s": [], "heading_deg": []}}, "heading.time_s"),
        ({"heading": HEADING | {"time_s": [5.0, 60.0]}}, "heading"),
        ({"heading": HEADING | {"time_s": [0.0]}}, "heading"),
        ({"heading": HEADING | {"lookahead_m": 10.0}}, "heading"),
        ({"heading": HEADING | PATH}, "heading"),
        ({"heading": {k: v for k, v in HEADING.items() if k != "heading_deg"}}, "heading"),
        ({"heading": HEADING | {"rudder_per_heading": -1.0}}, "heading.rudder_per_heading"),
        ({"depth": DEPTH | {"pitch_limit_deg": 85.0}}, "depth.pitch_limit_deg"),
        ({"depth": DEPTH | {"gain": 1.0}}, "depth.gain"),
        ({"interval_s": 0.0}, "interval_s"),
        ({"heading": {k: v for k, v in HEADING.items() if k != "heading_deg"} | PATH}, "heading"),
    ],
)
def test_a_file_that_is_wrong_is_one_line(pilot, changes, key):
    with refused("unknown" if key.endswith("gain") else "value", key):
        pilot(**changes)
