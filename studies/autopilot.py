"""Does a controller mask that coefficients are wrong?

Question: thesis section 8.5 expects it: a model may be accurate enough "with a control system, as the controller will
mask the underlying dynamics". Sets that SQP identified, random sets and draws of posteriors are flown on courses of
headings, depths and waypoints, each steered by an autopilot that answers its own motion, and again without feedback, by
the orders that the truth was given.
Claim: it masks depth and path, and time less. Under feedback wrong sets miss depths by at least 2.5 times less, random
ones the path by at least four times, and the place at a time, which is drag's, by less than that. A boat that is
unstable on a straight course is held within a degree, where without feedback it turns through more than 90; what gives
it away is its rudder, which works at least half as much again. Bands of 90 % of posteriors hold 85 to 95 % of the
places and depths of boats of the prior under feedback.
Cost: ten minutes on two cores, a third of it for the sets of SQP.

All boats have the same gains, in ship lengths travelled. Coverage is of boats that are drawn from the prior, with the
normal approximation of the posterior of one coupled trial each.
"""

from functools import partial
from operator import itemgetter

import numpy as np

import bayesub as bs
from autopilot import courses, plots
from bayesub.inference.checks.prediction import laplace
from bayesub.model.coefficients import NAMES
from bayesub.report.markdown import columns, named
from thesis import cases
from thesis.prior_trials import PriorTrials

FULL = 50, 20, 500, 30, 200, 10  # sets, courses of a kind, iterations, boats, draws, and histories of forces
# Quick: half a minute, because sets of SQP and posteriors of six degrees of freedom are found.
QUICK = 2, 1, 30, 1, 10, 2
ENOUGH = 20  # boats, from which coverage is judged
HOW = "with", "without"  # feedback
PRIOR_SD, SHARE, LEVEL = 0.25, 0.01, 0.9
FACTORS = np.linspace(0.5, 8.0, 16)  # of Nuv
SEED = 85
KINDS = {"SQP": "identified by SQP", "random": "random within 10 %", "posterior": "draws of a posterior"}
FIGURES = {
    "masked": "Errors of sets without feedback against those under an autopilot, each the median over courses. Depth "
    "and path of wrong sets are far better under feedback (below the dashed line of equal errors), the place at a time "
    "hardly: no autopilot here orders the speed.",
    "unstable": "A straight course in random forces of one per cent of the hull's: rms of the heading without feedback "
    "and under an autopilot, and of the rudder, of boats with Nuv from half to eight times as large. Right of the line "
    "a straight course is unstable: the heading does not show it under an autopilot, the rudder does.",
}
ANSWER = """
It masks depth and path: sets that SQP identified miss depths {*/kinds/SQP/gain/depth_m; min; .1f} to
{*/kinds/SQP/gain/depth_m; max; .1f} times less under feedback, and the path {*/kinds/SQP/gain/path_m; min; .1f} to
{*/kinds/SQP/gain/path_m; max; .1f} times less, but the place at a time only {*/kinds/SQP/gain/track_m; min; .1f} to
{*/kinds/SQP/gain/track_m; max; .1f} times less (medians). It masks instability too, all but the work of the rudder.
"""


def compute(run):
    """Errors by kind of set, coverage of bands, and unstable boats, by vehicle."""
    vehicles = ("npsauv",) if run.quick else cases.VEHICLES
    return {vehicle: of_vehicle(run, vehicle) for vehicle in vehicles}


def of_vehicle(run, vehicle):
    """The numbers of one vehicle."""
    n_sets, n_courses, max_iterations, n_boats, n_draws, n_histories = QUICK if run.quick else FULL
    boat = bs.load_vehicle(vehicle)
    run.progress.stage(f"{vehicle}: sets")
    problem, estimate = cases.identified(vehicle, "coupled", n_sets, max_iterations)
    trial = cases.trial(vehicle, "coupled")
    rng = np.random.default_rng([SEED, cases.VEHICLES.index(vehicle)])
    sets = {
        "SQP": problem.coefficient_sets(estimate.solutions),
        "random": boat.xi * (1.0 + 0.1 * rng.uniform(-1.0, 1.0, (n_sets, len(NAMES)))),
        "posterior": trial.coefficient_sets(laplace(trial, rng, n_sets, boat.xi[trial.columns])),
    }
    run.progress.stage(f"{vehicle}: courses")
    jobs = [(kind, k) for kind in courses.COURSES for k in range(n_courses)]
    flown = run.repeat(f"courses_{vehicle}", partial(fly, vehicle, sets, jobs), len(jobs))
    run.progress.stage(f"{vehicle}: boats")
    ranks = run.repeat(f"boats_{vehicle}", partial(bands, vehicle, n_draws), n_boats)
    run.progress.stage(f"{vehicle}: unstable")
    return {
        "kinds": {kind: of_kind([one[kind] for one in flown]) for kind in KINDS},
        "unstable": courses.unstable(boat, FACTORS, SHARE, n_histories, SEED),
    } | of_bands([[one[kind] for kind in courses.COURSES if one[kind] is not None] for one in ranks])


def fly(vehicle, sets, jobs, k):
    """Errors of all sets on the k-th course: kind of set -> with and without feedback -> (n, n_quantities)."""
    kind, number = jobs[k]
    boat = bs.load_vehicle(vehicle)
    seed = [SEED, cases.VEHICLES.index(vehicle), courses.COURSES.index(kind), number]
    pilot = courses.course(boat, kind, np.random.default_rng(seed))
    return {
        name: {how: errors.tolist() for how, errors in courses.with_and_without(boat, pilot, some).items()}
        for name, some in sets.items()
    }


def bands(vehicle, n_draws, k):
    """Ranks of the k-th boat of the prior among draws of the posterior of its trial, on a course of each kind."""
    boat, rng = bs.load_vehicle(vehicle), np.random.default_rng([SEED, cases.VEHICLES.index(vehicle), 1000 + k])
    trials = PriorTrials(
        vehicle, "coupled", cases.tracking_range(boat), free=NAMES, prior=bs.priors.relative_normal(PRIOR_SD)
    )
    truth, problem, _ = trials.trial(rng)
    draws = problem.coefficient_sets(laplace(problem, rng, n_draws, truth))
    (xi,) = problem.coefficient_sets(truth[None])
    found = {}
    for kind in courses.COURSES:
        held = courses.held(boat, courses.course(boat, kind, rng), xi, draws)
        found[kind] = None if held is None else {name: values.tolist() for name, values in held.items()}
    return found


def of_kind(flown):
    """Medians over courses of the errors of each set, and over both of the errors and of their ratio."""
    errors = {how: np.array([one[how] for one in flown]) for how in HOW}  # (n_courses, n_sets, n_quantities)
    ratio = errors["without"] / errors["with"]

    def middle(values):
        return dict(zip(courses.QUANTITIES, np.nanmedian(values, axis=(0, 1)).tolist(), strict=True))

    return {
        "errors": {how: np.nanmedian(values, axis=0).tolist() for how, values in errors.items()},
        "failed": {how: int(np.isnan(values[..., 0]).sum()) for how, values in errors.items()},
        "gain": middle(ratio),
        "middle": {how: middle(values) for how, values in errors.items()},
    }


def of_bands(boats):
    """Coverage of places and depths with its error over boats, and how much wider bands are without feedback."""
    parts = {"place": slice(0, 2), "depth": slice(2, 3)}
    found = {
        "n_boats": len(boats),
        "coverage": {how: {} for how in HOW},
        "error": {how: {} for how in HOW},
        "wider": {},
    }
    for part, at in parts.items():
        for how in HOW:
            held = [np.mean([inside(one, how, at) for one in boat]) for boat in boats if boat]
            found["coverage"][how][part] = float(np.mean(held))
            found["error"][how][part] = float(np.std(held) / np.sqrt(len(held)))
        widths = {how: np.array([one[f"width {how}"] for boat in boats for one in boat])[..., at] for how in HOW}
        moved = widths["with"] > 0.0  # where the boat has turned or dived
        found["wider"][part] = float(np.median(widths["without"][moved] / widths["with"][moved]))
    return found


def inside(one, how, at):
    """Share of the looks at which the truth is in the band."""
    return np.mean(np.abs(np.array(one[how])[..., at] - 0.5) <= LEVEL / 2)


def draw(run, numbers):
    """What is masked, and what is not."""
    plots.draw_masked(run.figure("masked"), numbers)
    plots.draw_unstable(run.figure("unstable"), {vehicle: r["unstable"] for vehicle, r in numbers.items()})
    run.page(tables(numbers))


def tables(numbers):
    """Gains, and coverage."""
    words = {"track_m": "place at a time", "path_m": "path", "depth_m": "depth", "heading_deg": "heading"}
    yield "How many times as large an error is without feedback, and in brackets what it is under the autopilot (m,"
    yield "degrees): medians over sets and courses.\n"
    rows = [{"vehicle": vehicle, "sets": KINDS[k]} | r["kinds"][k] for vehicle, r in numbers.items() for k in KINDS]
    cells = {"vehicle": itemgetter("vehicle"), "sets": itemgetter("sets")} | {
        word: lambda row, key=key: f"{row['gain'][key]:.1f} ({row['middle']['with'][key]:.2g})"
        for key, word in words.items()
    }
    yield from columns(rows, cells)
    yield "\nShare of true places and depths within 90 % bands, of boats of the prior, and how many times as wide bands"
    yield "are without feedback (median):\n"
    cells = {"vehicle": itemgetter("name")} | {
        f"{part}, {how}": lambda r, part=part, how=how: f"{r['coverage'][how][part]:.0%} ± {r['error'][how][part]:.0%}"
        for how in HOW
        for part in ("place", "depth")
    }
    cells |= {f"wider, {part}": lambda r, part=part: f"{r['wider'][part]:.1f}" for part in ("place", "depth")}
    yield from columns(named(numbers), cells | {"boats": itemgetter("n_boats")})


def claims(numbers):
    """Masked are depth and path; and instability."""
    for vehicle, r in numbers.items():
        for kind, least in (("SQP", 1.3), ("random", 4.0)):
            gain = r["kinds"][kind]["gain"]
            yield gain["depth_m"] >= 2.5, f"{vehicle}, {kind}: depth {gain['depth_m']:.2g} times better under feedback"
            yield gain["path_m"] >= least, f"{vehicle}, {kind}: path {gain['path_m']:.2g} times better under feedback"
            text = f"{vehicle}, {kind}: place {gain['track_m']:.2g} times better, path {gain['path_m']:.2g}"
            yield gain["track_m"] < gain["path_m"], text
        one = {key: np.array(values) for key, values in r["unstable"].items()}
        some = (one["root"] > 0.2) & (one["root"] < 1.0)
        yield some.any(), f"{vehicle}: no boat is unstable"
        off, free = one["with"][some].max(), one["without"][some].min()
        yield off < 1.0, f"{vehicle}: headings of unstable boats are {off:.2g} degrees off"
        yield free > 90.0, f"{vehicle}: without feedback they are {free:.2g} degrees off"
        works = one["rudder"][some].min() / np.interp(1.0, FACTORS, one["rudder"])
        yield works > 1.5, f"{vehicle}: the rudder of unstable boats works {works:.2g} times as much"
    for part in ("place", "depth"):
        share = np.mean([r["coverage"]["with"][part] for r in numbers.values()])
        enough = sum(r["n_boats"] for r in numbers.values()) >= ENOUGH
        yield 0.85 <= share <= 0.95 or not enough, f"90 % bands hold {share:.0%} of {part}s"
