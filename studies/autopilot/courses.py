"""Autopilots with random courses, and the errors of coefficient sets with and without feedback."""

import numpy as np

from bayesub.io.toml_files import validate
from bayesub.model.autopilot import Autopilot, SteeredSimulator
from bayesub.model.boats import Boats
from bayesub.model.disturbance import Disturbance, hull_force_rms
from bayesub.model.equations import AXES
from bayesub.model.linear_motion import roots
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulator import FINER, Simulator
from bayesub.model.vehicles import Vehicle
from thesis.cases import time_scale

DURATION, LEG = 600.0, 100.0  # of a course, and between two orders, s on suboff
INTERVAL, RATE = 1.0, 5.0  # between orders of the autopilot, s on suboff, and of planes there, degrees a second
LIMIT = 20.0  # of planes, degrees
COURSES = ("headings and depths", "waypoints and depths")
QUANTITIES = ("track_m", "path_m", "depth_m", "heading_deg")
PUSHED = "Y", "N"  # axes of random forces
N_LOOKS = 10  # times of a course at which bands are compared with the truth


def autopilot(boat: Vehicle, **orders) -> Autopilot:
    """An autopilot with the gains of all courses, of which a boat of another size has the same in its ship lengths.

    Parameters
    ----------
    boat : to whose size times and rates belong
    **orders : tables "heading" and "depth" with the orders, of which one may be left out
    """
    scale = time_scale(boat)
    servo = {"plane_limit_deg": LIMIT, "plane_rate_degps": RATE / scale}
    gains = {
        "heading": {"rudder_per_heading": 1.0, "rudder_per_yaw_rate": 1.0},
        "depth": {
            "pitch_per_depth": 0.4,
            "pitch_per_depth_travelled": 0.02,
            "pitch_limit_deg": 10.0,
            "plane_per_pitch": 1.0,
            "plane_per_pitch_rate": 1.0,
        },
    }
    tables = {name: servo | gains[name] | given for name, given in orders.items()}
    return validate({"name": "autopilot", "interval_s": INTERVAL * scale, **tables}, Autopilot, "autopilot")


def course(boat: Vehicle, kind: str, rng: np.random.Generator) -> Autopilot:
    """An autopilot with a random course: every 100 s of suboff a heading up to 60 degrees off the last and a depth.

    Waypoints turn as far and are eight ship lengths apart.
    """
    n, scale = int(DURATION / LEG), time_scale(boat)
    turns = rng.uniform(-60.0, 60.0, n)
    turns[0] = 0.0
    headings, times = np.cumsum(turns), (np.arange(n) * LEG * scale).tolist()
    depths = boat.depth_m + boat.length_m * np.append(0.0, rng.uniform(-0.1, 0.1, n - 1))
    steer: dict = {"time_s": times, "heading_deg": headings.tolist()}
    if kind == COURSES[1]:
        steps = 8.0 * boat.length_m * np.stack([np.cos(np.radians(headings)), np.sin(np.radians(headings))], axis=1)
        length = boat.length_m
        steer = {
            "waypoints_m": np.cumsum(steps, axis=0).tolist(),
            "lookahead_m": 3.0 * length,
            "acceptance_m": 2.0 * length,
        }
    return autopilot(boat, heading=steer, depth={"time_s": times, "depth_m": depths.tolist()})


def simulators(boat: Vehicle, pilot: Autopilot, n_times: int = 201) -> tuple[SteeredSimulator, SteeredSimulator]:
    """The boat on a course as sets are flown, and as the truth is, with a tenth of the step."""
    manoeuvre = load_manoeuvre("coupled", boat)  # whose start, propeller and duration are left
    times = np.linspace(0.0, manoeuvre.duration, n_times)
    usual = SteeredSimulator(boat, manoeuvre, times, autopilot=pilot)
    return usual, SteeredSimulator(boat, manoeuvre, times, dt=usual.step / FINER, autopilot=pilot)


def errors(truth: np.ndarray, states: np.ndarray) -> np.ndarray:
    """(n, n_quantities) largest distances of states (n, n_times, 12) from those of the truth (n_times, 12).

    Of the position at the same time (m), from the path of the truth at any time as seen from above (m), of the depth
    (m) and of the heading (degrees).
    """
    off = states - truth
    track = np.linalg.norm(off[..., :3], axis=2).max(axis=1)
    path = [from_path(truth[:, :2], places) for places in states[..., :2]]
    return np.stack([track, path, np.abs(off[..., 2]).max(axis=1), np.degrees(np.abs(off[..., 5]).max(axis=1))], axis=1)


def from_path(path: np.ndarray, places: np.ndarray) -> float:
    """Largest distance (m) of places (n, 2) from a path (n_points, 2), but for those past its end."""
    begins, steps = path[:-1], np.diff(path, axis=0)
    along = np.einsum("nki,ki->nk", places[:, None] - begins, steps) / np.maximum(np.sum(steps**2, axis=1), 1e-12)
    nearest = begins + np.clip(along, 0.0, 1.0)[..., None] * steps
    distances = np.linalg.norm(places[:, None] - nearest, axis=2)
    past = (distances.argmin(axis=1) == len(steps) - 1) & (along[:, -1] > 1.0)
    return float(distances.min(axis=1)[~past].max(initial=0.0))


def with_and_without(boat: Vehicle, pilot: Autopilot, sets: np.ndarray) -> dict[str, np.ndarray]:
    """Errors (n, n_quantities) of sets (n, n_terms) that the autopilot steers, and that replay the orders to the truth.

    Not a number where a set does not complete the course; InputError if the boat itself does not.
    """
    usual, fine = simulators(boat, pilot)
    (truth,), _ = fine.run(boat.xi)
    replay = Simulator(boat, fine.recorded(), usual.times, dt=usual.step)
    found = {}
    for name, simulator in (("with", usual), ("without", replay)):
        states, status = simulator.run(sets)
        found[name] = np.where(status[:, None] == 0, errors(truth, states), np.nan)
    return found


def held(boat: Vehicle, pilot: Autopilot, truth: np.ndarray, draws: np.ndarray) -> dict[str, np.ndarray] | None:
    """Ranks (N_LOOKS, 3) of a true boat's place among those of draws, and widths of bands, with feedback and without.

    Parameters
    ----------
    boat : whose size and planes all have
    pilot : with a course
    truth : (n_terms,) coefficients of the boat
    draws : (n, n_terms) coefficients of the posterior of its trial

    Returns
    -------
    dict, or None if the boat or half of the draws do not complete the course
    """
    usual, fine = simulators(boat, pilot)
    states, status = fine.run(truth)
    if status[0]:
        return None
    replay = Simulator(boat, fine.recorded(truth), usual.times, dt=usual.step)
    looks = np.linspace(0, len(usual.times) - 1, N_LOOKS + 1).astype(int)[1:]
    found = {}
    for name, simulator in (("with", usual), ("without", replay)):
        flown, codes = simulator.run(draws)
        if np.mean(codes == 0) < 0.5:
            return None
        places = flown[codes == 0][:, looks, :3]
        true = states[0, looks, :3]  # which all draws have where the boat has not turned or dived yet
        found[name] = np.mean(places < true, axis=0) + 0.5 * np.mean(places == true, axis=0)
        found[f"width {name}"] = np.diff(np.quantile(places, [0.05, 0.95], axis=0), axis=0)[0]
    return found


def unstable(boat: Vehicle, factors, share: float, n: int, seed: int) -> dict[str, list[float]]:
    """A straight course with Nuv so many times as large, in random forces: how it looks with feedback and without.

    Parameters
    ----------
    boat : vehicle
    factors : of Nuv
    share : of the force of the hull on the horizontal spiral that random forces have
    n : histories of forces
    seed : of these

    Returns
    -------
    dict of lists: the largest root of sway and yaw, per ship length travelled ("root"), rms of the heading with and
    without feedback, and of the rudder, degrees
    """
    second, spiral = boat.speed_mps / boat.length_m, load_manoeuvre("horizontal", boat)
    sets = np.tile(boat.xi, (len(factors), 1))
    sets[:, boat.equations.index["Nuv"]] *= factors
    times = np.linspace(0.0, spiral.duration, 301)
    hull = hull_force_rms([Simulator(boat, spiral, times[-1:])])[[AXES.index(axis) for axis in PUSHED]]
    process = Disturbance(PUSHED, share * hull, 2.0 / second)
    straight = SteeredSimulator(boat, spiral, times, autopilot=autopilot(boat, heading={"heading_deg": [0.0]}))
    squares = []
    for k in range(n):
        pushed = straight.disturbed(process, np.random.default_rng([seed, k]))
        under, _, planes = pushed.steered(sets)
        free, _ = Simulator(boat, pushed.manoeuvre, times, dt=pushed.step, forces=pushed.forces).run(sets)
        squares.append([np.mean(part**2, axis=1) for part in (under[..., 5], free[..., 5], planes[..., 0])])
    rms = np.degrees(np.sqrt(np.mean(squares, axis=0)))
    found = roots(Boats(boat, sets), "horizontal").real[:, 0] / second
    return {"root": found.tolist()} | dict(zip(("with", "without", "rudder"), rms.tolist(), strict=True))
