"""Is it the coefficient set or the manoeuvre that makes a prediction bad, and what does the worst one look like?

Question: the thesis draws the costs of 50 identified sets on 100 unseen manoeuvres, sorts the manoeuvres by their mean,
and finds that single sets follow no order (Figures 75-78, 82, 115, 118-126; costs of Tables 30-32).
Claim: the set explains more of the variance of log costs than the manoeuvre; but single sets do follow the order, of
the ten of each boat that vary most and least all but one at the most.
Cost: twenty minutes, nearly all of it searches.

Sets and manoeuvres are those of the study `prediction`. Costs and positions are those of a boat as long as suboff.
"""

from functools import partial

import numpy as np

from bayesub.model.coefficients import INDEX
from bayesub.model.simulator import Simulator
from bayesub.report.markdown import columns, named, table
from prediction_costs import plots
from thesis import cases
from thesis.counterparts import comparison
from thesis.predictions import HELD_STEP, STATISTICS, searched, shares_of_variance, spread

N_SETS, N_MANOEUVRES, MAX_ITERATIONS = 50, 100, 500
QUICK = (4, 5, 60)
N_EXTREME = 5  # sets that vary most, and least
EVERY = 4  # samples of a track that are kept
FIGURES = {
    "sorted": "Costs over manoeuvres sorted by their mean (black) within the range of all sets (grey). The five sets "
    "that vary most jump by as much as the mean rises. Those that vary least rise with it all the same, by a third to "
    "all of what it rises by, but for one of auv690; in the thesis some do not.",
    "surfaces": "Cost of every set on every manoeuvre, sorted: rows differ more than columns.",
    "worst_tracks": "The set with the highest mean cost on its worst manoeuvre: from above, depth, and distance from "
    "the true track over time, beside the largest error of all sets. Depths above the surface are the model's, which "
    "knows none.",
}
ANSWER = """
The set explains {*/variance/set; min; percent; .0f} to {*/variance/set; max; percent; .0f} % of the variance of log
costs, the manoeuvre {*/variance/manoeuvre; min; percent; .0f} to {*/variance/manoeuvre; max; percent; .0f} %. The worst
set of suboff ends {suboff/worst_set_m; .0f} m off, the largest error of any is {suboff/largest_m; .0f} m.
"""


def compute(run):
    """Errors and costs of every set on every manoeuvre, and the worst tracks."""
    vehicles = ("npsauv",) if run.quick else cases.VEHICLES
    return run.parts("flights", {vehicle: partial(flights, vehicle, run.quick) for vehicle in vehicles})


def flights(vehicle, quick):
    """One vehicle: numbers of Tables 29 to 32, and arrays of costs and worst tracks."""
    n_sets, n_manoeuvres, max_iterations = QUICK if quick else (N_SETS, N_MANOEUVRES, MAX_ITERATIONS)
    problem, estimate = searched(vehicle, n_sets, max_iterations)
    boat, length = problem.vehicle, cases.length_scale(problem.vehicle)
    random = problem.coefficient_sets(estimate.starts)
    random[:, INDEX["Xuu"]] = boat.xi[INDEX["Xuu"]]
    sets = np.concatenate([boat.xi[None], problem.coefficient_sets(estimate.solutions), random])
    identified, others = slice(1, 1 + n_sets), slice(1 + n_sets, None)
    errors, costs, held, tracks = [], [], [], []
    for simulator in cases.unseen(boat, n_manoeuvres):
        states, status = simulator.run(sets)
        step = HELD_STEP * cases.time_scale(boat)
        coarse = Simulator(boat, simulator.manoeuvre, simulator.times, dt=step, controls="hold").run(boat.xi)[0]
        some = [
            np.where(np.append(status, 0) == 0, x, np.nan) for x in off(np.vstack([states, coarse]), states[0], length)
        ]
        errors.append(some[0][:-1])
        costs.append(some[1][:-1])
        held.append([x[-1] for x in some])
        tracks.append(states[: 1 + n_sets, ::EVERY, :3] / length)
    errors, costs, held = np.array(errors).T, np.array(costs).T, np.array(held).T
    order = np.argsort(np.nanmean(costs[identified], axis=1))
    chosen = {"best": order[0], "middle": order[len(order) // 2], "worst": order[-1]}
    kinds = {key: (errors[1 + k], costs[1 + k]) for key, k in chosen.items()}
    kinds |= {"simulation": held, "random": (np.nanmean(errors[others], axis=0), np.nanmean(costs[others], axis=0))}
    worst, largest = chosen["worst"], np.nanargmax(errors[identified]) // n_manoeuvres
    arrays = {}
    for name, k in (("worst", worst), ("largest", largest)):
        m = int(np.nanargmax(errors[1 + k]))
        arrays |= {f"{name}_true": tracks[m][0], f"{name}_predicted": tracks[m][1 + k]}
    logs = np.log10(costs[identified])
    arrays = {key: values.astype(np.float32) for key, values in arrays.items()}
    arrays["log_costs"] = logs.astype(np.float16)
    rise = np.nanmean(logs, axis=0)
    extreme = np.argsort(np.nanstd(logs, axis=1))
    numbers = {
        "n_sets": n_sets,
        "all_m": spread(errors[identified]),
        "all_cost": spread(costs[identified]),
        "kinds": {key: spread(c) for key, (_, c) in kinds.items()},
        "kinds_m": {key: spread(e) for key, (e, _) in kinds.items()},
        "worst_set_m": float(np.nanmax(errors[1 + worst])),
        "largest_m": float(np.nanmax(errors[identified])),
        "variance": shares_of_variance(costs[identified]),
        "slopes": {
            "least varying": slopes(logs[extreme[:N_EXTREME]], rise),
            "most varying": slopes(logs[extreme[-N_EXTREME:]], rise),
        },
    }
    return numbers, arrays


def off(states, truth, length):
    """Largest position errors (m) and costs of states (n, n_times, 12), of a boat as long as suboff."""
    distance = (states[..., :3] - truth[:, :3]) / length
    angle = np.degrees(states[..., 3:6] - truth[:, 3:6])
    cost = cases.WEIGHT * (np.sum(distance**2, axis=(1, 2)) + np.sum(angle**2, axis=(1, 2)))
    return np.linalg.norm(distance, axis=2).max(axis=1), cost


def slopes(logs, rise):
    """By how many orders the log costs of a set rise where their mean over the sets rises by one, set by set."""
    return [float(np.polyfit(rise[np.isfinite(row)], row[np.isfinite(row)], 1)[0]) for row in logs]


def draw(run, numbers):
    """Surfaces, sorted costs with single sets, worst tracks with depth and error over time, and the tables."""
    run.page(tables(numbers))
    arrays = {vehicle: run.load_arrays(f"flights_{vehicle}") for vehicle in numbers}
    logs = {vehicle: a["log_costs"].astype(float) for vehicle, a in arrays.items()}
    plots.draw_surfaces(run.figure("surfaces"), logs)
    plots.draw_sorted(run.figure("sorted"), logs, N_EXTREME)
    interval = {v: EVERY * cases.time_scale(cases.load_vehicle(v)) for v in numbers}
    plots.draw_worst(run.figure("worst_tracks"), arrays, numbers, interval)


def tables(numbers):
    """Costs of Tables 29 to 32 beside those that the scan has kept, and variances."""
    published = cases.published()["prediction"]
    theirs = published["cost"] | {"all": published["all_cost"]}
    yield "Costs in m^2 + deg^2 of a boat as long as suboff, `ours / thesis = ratio` where the scan has the thesis's.\n"
    lines = []
    for k, vehicle in enumerate(cases.VEHICLES):
        if vehicle not in numbers:
            continue
        for key, of in ({"all": numbers[vehicle]["all_cost"]} | numbers[vehicle]["kinds"]).items():
            rows = theirs.get(key, {})
            cells = (comparison(of[s], rows[s][k] if s in rows else None) for s in STATISTICS)
            lines.append((vehicle, key, *cells))
    yield from table(("vehicle", "sets", *STATISTICS), lines)
    yield "\nVariance of log costs that set and manoeuvre explain; by how many orders the costs of the five sets that"
    yield "vary least, and most, rise where the mean over all sets rises by one.\n"
    cells = {
        "vehicle": lambda r: r["name"],
        "by set": lambda r: f"{r['variance']['set']:.0%}",
        "by manoeuvre": lambda r: f"{r['variance']['manoeuvre']:.0%}",
        **{
            f"{kind}: rise": lambda r, kind=kind: ", ".join(f"{x:.2g}" for x in r["slopes"][kind])
            for kind in ("least varying", "most varying")
        },
        "worst set, largest error (m)": lambda r: f"{r['worst_set_m']:.3g}",
        "largest of all (m)": lambda r: f"{r['largest_m']:.3g}",
    }
    yield from columns(named(numbers), cells)


def claims(numbers):
    """The set says more than the manoeuvre, and sets but for one follow the order of the manoeuvres."""
    for vehicle, r in numbers.items():
        by_set, by_manoeuvre = r["variance"]["set"], r["variance"]["manoeuvre"]
        rises = sorted(x for slopes in r["slopes"].values() for x in slopes)
        few = r["n_sets"] < N_SETS  # a few sets need not decide it
        text = f"{vehicle}: two sets rise by {rises[0]:.2g} and {rises[1]:.2g} of what the mean rises by"
        yield few or rises[1] > 0.3, text
        text = f"{vehicle}: the set explains {by_set:.0%}, the manoeuvre {by_manoeuvre:.0%}"
        yield few or by_set > by_manoeuvre, text
