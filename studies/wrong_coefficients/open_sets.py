"""Coefficient sets that data leave open, and how far off the tracks are that they predict."""

from collections.abc import Iterable

import numpy as np

from bayesub.inference.baselines import gauss_newton
from bayesub.inference.identifiability import null_space
from bayesub.model.coefficients import NAMES, columns
from bayesub.model.disturbance import Disturbance, ForceHistory, hull_force_rms
from bayesub.model.equations import AXES
from bayesub.model.simulator import Simulator
from bayesub.model.vehicles import Vehicle, load_vehicle
from bayesub.problem import priors
from bayesub.problem.joint import JointProblem
from thesis import cases

PRIOR_SD = 0.25
MOST_ITERATIONS = 200
SEED, SHARES = 103, (0.005, 0.015, 0.05)  # of random forces, of which shares are of the hull's
PUSH, SHEAR = 0.05, 0.05  # of the hull's side force; of the trial speed, a ship length down
NULL_MOVE = 0.5  # of the largest coefficient of a null vector


def open_set(vehicle: str, n_manoeuvres: int, k: int) -> dict:
    """The k-th set that the tracks of so many manoeuvres leave open, drawn by randomising and optimising.

    The readings get noise, the centre of the prior a draw from it, and the mode is found again (Bardsley et al. 2014),
    from the truth, since the question is what the data leave open around it.
    """
    boat = load_vehicle(vehicle)
    problem = randomised(boat, cases.unseen(boat, n_manoeuvres), np.random.default_rng([cases.SEED, n_manoeuvres, k]))
    mode = gauss_newton(problem, boat.xi[problem.columns], max_iterations=MOST_ITERATIONS)
    return {
        "xi": problem.coefficient_sets(mode.values)[0].tolist(),
        "cost": mode.costs[0],
        "status": mode.statuses[0],
    }


def randomised(boat: Vehicle, simulators: Iterable[Simulator], rng: np.random.Generator) -> JointProblem:
    """The joint problem of noisy tracks of manoeuvres, with its prior moved, at the same width, to a draw from it."""
    sensor, sds = cases.tracking_range(boat), PRIOR_SD * np.abs(boat.xi)
    centre = boat.xi + sds * rng.standard_normal(len(NAMES))
    moved = {n: priors.normal(c, sd) for n, c, sd in zip(NAMES, centre, sds, strict=True) if sd > 0.0}
    prior = priors.Given(priors.relative_normal(PRIOR_SD), moved)
    problems = {}
    for simulator in simulators:
        manoeuvre = simulator.manoeuvre
        problems[manoeuvre.name] = cases.posed(boat, manoeuvre, sensor, rng, free=NAMES, prior=prior)
    return JointProblem(problems)


def null_moves(boat: Vehicle, names) -> np.ndarray:
    """Sets moved along each null vector of the equations until its largest relative change is NULL_MOVE, both ways.

    Parameters
    ----------
    boat : vehicle
    names : coefficients that may change

    Returns
    -------
    (n_sets, 101) non-dimensional coefficients
    """
    problem, sets = cases.track_problem(boat, "coupled", names), []
    for vector in null_space(problem, problem.reference).vectors:
        change = np.zeros(len(NAMES))
        change[columns(vector)] = list(vector.values())
        size = np.max(np.abs(change[boat.xi != 0] / boat.xi[boat.xi != 0]))
        sets += [boat.xi + side * NULL_MOVE / size * change for side in (-1, 1)]
    return np.array(sets)


def random_sets(boat: Vehicle, relative_sds: dict[str, float], n: int) -> dict[str, np.ndarray]:
    """Kind -> sets (n, 101) whose coefficients have independent normal relative errors."""
    rng = np.random.default_rng(cases.SEED)
    return {kind: boat.xi * (1 + sd * rng.standard_normal((n, len(NAMES)))) for kind, sd in relative_sds.items()}


def disturbed(boat: Vehicle, simulators: list[Simulator], sets: np.ndarray) -> dict[str, list[float]]:
    """Disturbance -> (n_sets,) largest position errors (m) when sets and true boat move under the same disturbance.

    Random forces on all axes have shares of those of the hull; a push is a steady side force of a thruster at the bow
    from a third of the manoeuvre on; the current is sheared, so that a boat at another depth drifts otherwise.

    Parameters
    ----------
    boat : vehicle
    simulators : of the manoeuvres
    sets : (n_sets, 101) non-dimensional coefficients
    """
    everyone, found = np.vstack([boat.xi, sets]), {}
    second = boat.speed_mps / boat.length_m
    for number, simulator in enumerate(simulators):
        hull = hull_force_rms([simulator])
        axes = tuple(axis for axis, rms in zip(AXES, hull, strict=True) if rms > 0.0)
        sizes = hull[hull > 0.0]
        cases = {"still water": simulator}
        for share in SHARES:
            process, rng = Disturbance(axes, share * sizes, 2.0 / second), np.random.default_rng([SEED, number])
            cases[f"random forces of {100 * share:g} %"] = simulator.disturbed(process, rng)
        cases[f"a push of {100 * PUSH:g} %"] = simulator.disturbed(
            pushed(simulator, PUSH * hull[AXES.index("Y")], boat)
        )
        for name, flown in cases.items():
            states, status = flown.run(everyone)
            found.setdefault(name, []).append(distances(states, status))
            if flown is simulator:
                deeper = np.cumsum((states[..., 2] - boat.depth_m) * np.gradient(simulator.times), axis=1)
                states[..., 0] += SHEAR * second * deeper
                found.setdefault("a sheared current", []).append(distances(states, status))
    return {name: np.max(off, axis=0).tolist() for name, off in found.items()}


def pushed(simulator: Simulator, force: float, boat: Vehicle) -> ForceHistory:
    """A side force (N) at the bow, from a third of a manoeuvre on."""
    end, lever = simulator.manoeuvre.duration, 0.4 * boat.length_m
    values = np.array([[0.0, 0.0], [0.0, 0.0], [force, force * lever], [force, force * lever]])
    return ForceHistory(np.array([0.0, end / 3.0, end / 3.0 + simulator.step, end]), ("Y", "N"), values)


def distances(states: np.ndarray, status: np.ndarray) -> np.ndarray:
    """(n_sets,) largest distances (m) of states (1 + n_sets, n_times, 12) from the first; infinite for what fails."""
    off = np.linalg.norm(states[1:, :, :3] - states[0, :, :3], axis=2).max(axis=1)
    return np.where(status[1:] == 0, off, np.inf)


def errors(boat: Vehicle, names, simulators: list[Simulator], n_seen: int, sets: np.ndarray) -> dict:
    """Relative errors of coefficients `names`, and largest position errors in m, set by set.

    Parameters
    ----------
    boat : vehicle
    names : coefficients that are compared
    simulators : of the manoeuvres, the first `n_seen` of which are those that the data come from
    n_seen : number of them
    sets : (n_sets, 101) non-dimensional coefficients
    """
    places = columns(names)
    relative = np.abs(sets[:, places] / boat.xi[places] - 1)
    off = [distances(*simulator.run(np.vstack([boat.xi, sets]))) for simulator in simulators]
    seen, unseen = np.array(off[:n_seen]), np.array(off[n_seen:])
    return {
        "n_sets": len(sets),
        "coefficient_median": np.median(relative, axis=1).tolist(),
        "coefficient_largest": relative.max(axis=1).tolist(),
        "beyond_ten_per_cent": np.sum(relative > 0.1, axis=1).tolist(),
        "n_coefficients": len(names),
        "seen_m": seen.max(axis=0).tolist(),
        "unseen_m": unseen.max(axis=0).tolist(),
        "unseen_median_m": np.median(unseen, axis=0).tolist(),
        "disturbed_m": disturbed(boat, simulators[n_seen:], sets),
        "noise_m": 0.5 * cases.length_scale(boat),
    }
