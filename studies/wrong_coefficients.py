"""Can a set of wrong-valued coefficients reproduce all other manoeuvres accurately?

Question: the last one of the thesis (chapter 10). SQP's sets are wrong and reproduce one manoeuvre; are there sets that
are wrong and reproduce every one?
Claim: yes, in two ways. Along null directions of the equations coefficients may be wrong by any amount and no manoeuvre
moves at all. And the tracks of a hundred manoeuvres together still leave half of the coefficients wrong by several per
cent, while none of these and of fifty further manoeuvres is missed by more than a fraction of the noise of a tracking
range; random errors a tenth as large miss them by far more.
Cost: half an hour on two cores.

What data leave open is drawn by randomising and optimising: the readings get noise, the centre of the prior a draw from
it, and the mode is found again (Bardsley et al. 2014), from the truth, since the question is what the data leave open
around it. How far the tracks of a set are off is simulated, not estimated.
"""

from functools import partial

import numpy as np

import bayesub as bs
from bayesub import identifiability
from bayesub.baselines import gauss_newton
from bayesub.model.coefficients import ADDED_MASSES, NAMES
from bayesub.model.linear_form import linear_systems
from bayesub.problem.joint import JointProblem
from bayesub.report.markdown import table
from bayesub.study.script import repeated
from bayesub.thesis import cases
from bayesub.thesis.cases import SUBOFF_TIME, VEHICLES
from bayesub.thesis.plots import wrong_coefficients as plots

PRIOR_SD = 0.25
DATA = {"one manoeuvre": 1, "10 manoeuvres": 10, "100 manoeuvres": 100}
N_DRAWS, N_UNSEEN = 20, 50
RANDOM = {"random 1 %": 0.01, "random 10 %": 0.1}
MOST_ITERATIONS = 200
NULL_MOVE = 0.5  # of the largest coefficient of a null vector


def run(folder, *, quick, progress):
    """Coefficient and track errors of sets of every kind, by vehicle."""
    vehicles, data = (("npsauv",), {"one manoeuvre": 1, "2 manoeuvres": 2}) if quick else (VEHICLES, DATA)
    n_draws, n_unseen = (3, 3) if quick else (N_DRAWS, N_UNSEEN)
    numbers = {}
    for vehicle in vehicles:
        boat = bs.load_vehicle(vehicle)
        n_seen = max(data.values())
        simulators = list(cases.unseen(boat, n_seen + n_unseen))
        sets = {}
        for kind, n in data.items():
            progress.stage(f"{vehicle}: {kind}")
            draws = repeated(folder / f"sets_{vehicle}_{n}.jsonl", partial(open_set, vehicle, n), n_draws, progress)
            cut_off = [draw["status"] for draw in draws if not draw["status"].startswith("converged")]
            assert not cut_off, f"{vehicle}, {kind}: {cut_off[0]}"
            sets[kind] = np.array([draw["xi"] for draw in draws])
        progress.stage(f"{vehicle}: fly")
        names = randomised(boat, simulators[:1], np.random.default_rng(0)).names
        sets["null directions"] = null_moves(boat, names)
        rng = np.random.default_rng(cases.SEED)
        for kind, sd in RANDOM.items():
            sets[kind] = boat.xi * (1 + sd * rng.standard_normal((n_draws, len(NAMES))))
        numbers[vehicle] = {kind: outcome(boat, names, simulators, n_seen, xi) for kind, xi in sets.items()}
    for suffix in ("png",) if quick else ("png", "pdf"):
        plots.draw(folder / f"wrong_coefficients.{suffix}", numbers)
    (folder / "wrong_coefficients.md").write_text("\n".join(tables(numbers)) + "\n")
    for vehicle, result in numbers.items():
        check(vehicle, result)
    return numbers


def open_set(vehicle, n_manoeuvres, k):
    """The k-th set that the tracks of so many manoeuvres leave open."""
    boat = bs.load_vehicle(vehicle)
    simulators = cases.unseen(boat, n_manoeuvres)
    problem = randomised(boat, simulators, np.random.default_rng([cases.SEED, n_manoeuvres, k]))
    found = gauss_newton(problem, boat.xi[problem.columns], max_iterations=MOST_ITERATIONS)
    return {
        "xi": problem.coefficient_sets(found.values)[0].tolist(),
        "cost": found.costs[0],
        "status": found.statuses[0],
    }


def randomised(boat, simulators, rng):
    """The joint problem of noisy tracks of manoeuvres, with its prior moved, at the same width, to a draw from it."""
    sd = 0.5 * boat.length_m / bs.load_vehicle("suboff").length_m
    interval = boat.length_m / boat.speed_mps / SUBOFF_TIME
    sensor = bs.sensors.Track(sd, 0.1, interval)
    sds = PRIOR_SD * np.abs(boat.xi)
    centre = boat.xi + sds * rng.standard_normal(len(NAMES))
    moved = {n: bs.priors.normal(c, sd) for n, c, sd in zip(NAMES, centre, sds, strict=True) if sd > 0.0}
    prior = bs.priors.Given(bs.priors.relative_normal(PRIOR_SD), moved)
    problems = {}
    for simulator in simulators:
        record = bs.observe(simulator.trajectory(boat.xi), sensor, rng)
        manoeuvre = simulator.manoeuvre
        problems[manoeuvre.name] = bs.Problem(boat, manoeuvre, record, free=NAMES, prior=prior, dt=simulator.step)
    return JointProblem(problems)


def null_moves(boat, names):
    """Sets moved along each null vector of the equations until its largest relative change is NULL_MOVE, both ways."""
    flown = bs.simulate(boat, bs.load_manoeuvre("coupled", boat))
    ranks = identifiability.rank(linear_systems(flown, free=names), prefer=ADDED_MASSES)
    moved = []
    for vector in (vector for axis in ranks.values() for vector in axis.null_vectors):
        change = np.zeros(len(NAMES))
        change[bs.coefficients.columns(vector)] = list(vector.values())
        size = np.max(np.abs(change[boat.xi != 0] / boat.xi[boat.xi != 0]))
        moved += [boat.xi + side * NULL_MOVE / size * change for side in (-1, 1)]
    return np.array(moved)


def outcome(boat, names, simulators, n_seen, sets):
    """Relative coefficient errors, and largest position errors in m on seen and unseen manoeuvres, set by set."""
    columns = bs.coefficients.columns(names)
    errors = np.abs(sets[:, columns] / boat.xi[columns] - 1)
    off = []
    for simulator in simulators:
        states, status = simulator.run(np.vstack([boat.xi, sets]))
        distance = np.linalg.norm(states[1:, :, :3] - states[0, :, :3], axis=2).max(axis=1)
        off.append(np.where(status[1:] == 0, distance, np.inf))
    seen, unseen = np.array(off[:n_seen]), np.array(off[n_seen:])
    return {
        "n_sets": len(sets),
        "coefficient_median": np.median(errors, axis=1).tolist(),
        "coefficient_largest": errors.max(axis=1).tolist(),
        "beyond_ten_per_cent": np.sum(errors > 0.1, axis=1).tolist(),
        "n_coefficients": len(names),
        "seen_m": seen.max(axis=0).tolist(),
        "unseen_m": unseen.max(axis=0).tolist(),
        "unseen_median_m": np.median(unseen, axis=0).tolist(),
        "noise_m": 0.5 * boat.length_m / bs.load_vehicle("suboff").length_m,
    }


def tables(numbers):
    """How wrong the coefficients and how wrong the tracks are, medians over the sets of a kind."""
    header = ("vehicle", "sets", "error of half the coefficients", "largest", "beyond 10 %")
    header += ("furthest off any unseen manoeuvre (m)", "over the noise", "half the unseen (m)")
    lines = []
    for vehicle, result in numbers.items():
        for kind, r in result.items():
            middle = {key: np.median(value) for key, value in r.items() if isinstance(value, list)}
            lines.append(
                (
                    vehicle,
                    f"{kind} ({r['n_sets']})",
                    f"{middle['coefficient_median']:.2%}",
                    f"{middle['coefficient_largest']:.0%}",
                    f"{middle['beyond_ten_per_cent']:.0f} of {r['n_coefficients']}",
                    f"{middle['unseen_m']:.2g}",
                    f"{middle['unseen_m'] / r['noise_m']:.2g}",
                    f"{middle['unseen_median_m']:.2g}",
                )
            )
    yield from table(header, lines)


def check(vehicle, result):
    """The claim, of one vehicle."""
    null = result["null directions"]
    assert max(null["unseen_m"]) < 1e-6, f"{vehicle}: null moves take the boat {max(null['unseen_m']):.1e} m off"
    most = [kind for kind in result if kind.endswith("manoeuvres")][-1]
    middle = {kind: {k: np.median(result[kind][k]) for k in ("coefficient_median", "unseen_m")} for kind in result}
    known, random = middle[most], middle["random 1 %"]
    assert known["coefficient_median"] > random["coefficient_median"], (
        f"{vehicle}: {most} leave half the coefficients within {known['coefficient_median']:.2%}"
    )
    assert known["unseen_m"] < random["unseen_m"], (
        f"{vehicle}: {most} leave {known['unseen_m']:.2g} m, random errors of 1 % {random['unseen_m']:.2g} m"
    )
