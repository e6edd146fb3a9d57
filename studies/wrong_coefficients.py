"""Can a set of wrong-valued coefficients reproduce all other manoeuvres accurately?

Question: the last one of the thesis (chapter 10). SQP's sets are wrong and reproduce one manoeuvre; are there sets that
are wrong and reproduce every one?
Claim: yes, in two ways. Along null directions of the equations coefficients may be wrong by any amount and no manoeuvre
moves at all. And the tracks of a hundred manoeuvres together still leave half of the coefficients wrong by several per
cent, while none of these and of fifty further manoeuvres is missed by more than a fraction of the noise of a tracking
range; random errors a tenth as large miss them by far more.
Cost: a quarter of an hour of one core.

What data leave open is drawn by randomising and optimising (Bardsley et al. 2014). How far the tracks of a set are off
is simulated, not estimated.
"""

from functools import partial
from operator import itemgetter

import numpy as np

import bayesub as bs
from bayesub.report.markdown import columns
from thesis.cases import VEHICLES, unseen
from wrong_coefficients import plots
from wrong_coefficients.open_sets import errors, null_moves, open_sets, random_sets, tracks

DATA = {"one manoeuvre": 1, "10 manoeuvres": 10, "100 manoeuvres": 100}
N_SETS, N_UNSEEN = 20, 50
AT_JUMPS = 0.1  # of the distance of a set from the truth, by which jumps may keep it from its solution
QUICK_DATA, QUICK_SETS, QUICK_UNSEEN = {"one manoeuvre": 1, "2 manoeuvres": 2}, 3, 3
RANDOM = {"random 1 %": 0.01, "random 10 %": 0.1}
FIGURES = {
    "wrong_coefficients": "Error of the median coefficient of a set against the largest error of any of fifty unseen "
    "tracks, a dot a set. Tracks of more manoeuvres leave sets that miss less, with coefficients hardly less wrong. "
    "Random errors of 1 % miss by far more. Sets moved along null directions by half of a coefficient stand in the "
    "title: they miss nothing.",
}
ANSWER = """
Yes. Along null directions half of a coefficient moves no unseen track by more than {*/null directions/unseen_m;
max; .0e} m, and tracks of a hundred manoeuvres together leave sets with single coefficients {*/100
manoeuvres/coefficient_largest; each median; min; percent; .0f} to {*/100 manoeuvres/coefficient_largest; each
median; max; percent; .0f} % wrong that miss none of fifty further manoeuvres of suboff by more than {suboff/100
manoeuvres/unseen_m; median; centi; .0f} cm (medians of twenty sets a boat).
"""


def compute(run):
    """Coefficient and track errors of sets of every kind, by vehicle."""
    data, n_sets, n_unseen = (QUICK_DATA, QUICK_SETS, QUICK_UNSEEN) if run.quick else (DATA, N_SETS, N_UNSEEN)
    vehicles = ("npsauv",) if run.quick else VEHICLES
    works = {f"{v} {kind}": partial(open_sets, v, n, n_sets) for v in vehicles for kind, n in data.items()}
    drawn = run.parts("sets", works)
    of = {v: {kind: drawn[f"{v} {kind}"] for kind in data} for v in vehicles}
    seen = max(data.values())
    return run.parts("errors", {v: partial(errors_by_kind, v, of[v], seen, n_unseen, n_sets) for v in vehicles})


def errors_by_kind(vehicle, drawn, n_seen, n_unseen, n_sets):
    """Sets that data leave open, null moves and random sets of one vehicle."""
    boat = bs.load_vehicle(vehicle)
    simulators = list(unseen(boat, n_seen + n_unseen))
    names = tracks(boat, simulators[:1]).names
    sets = {kind: np.array(found["xi"]) for kind, found in drawn.items()}
    sets |= {"null directions": null_moves(boat, names)} | random_sets(boat, RANDOM, n_sets)
    results = {kind: errors(boat, names, simulators, n_seen, xi) for kind, xi in sets.items()}
    for kind, found in drawn.items():
        results[kind]["last_steps"] = found["last_steps"]
    return results


def medians(r):
    """Medians over the sets of a kind."""
    return {key: np.median(values) for key, values in r.items() if isinstance(values, list)}


def draw(run, numbers):
    """How wrong the coefficients and how wrong the tracks are."""
    plots.draw(run.figure("wrong_coefficients"), numbers)
    rows = [
        {"vehicle": vehicle, "sets": f"{kind} ({r['n_sets']})", "of": r, "middle": medians(r)}
        for vehicle, result in numbers.items()
        for kind, r in result.items()
    ]
    cells = {
        "vehicle": itemgetter("vehicle"),
        "sets": itemgetter("sets"),
        "error of half the coefficients": lambda row: f"{row['middle']['coefficient_median']:.2%}",
        "largest": lambda row: f"{row['middle']['coefficient_largest']:.0%}",
        "beyond 10 %": lambda row: f"{row['middle']['beyond_ten_per_cent']:.0f} of {row['of']['n_coefficients']}",
        "furthest off any unseen manoeuvre (m)": lambda row: f"{row['middle']['unseen_m']:.2g}",
        "over the noise": lambda row: f"{row['middle']['unseen_m'] / row['of']['noise_m']:.2g}",
        "half the unseen (m)": lambda row: f"{row['middle']['unseen_median_m']:.2g}",
    }
    run.page(columns(rows, cells))


def claims(numbers):
    """The claim, vehicle by vehicle."""
    for vehicle, result in numbers.items():
        for kind, r in result.items():
            last = max(r.get("last_steps", [0.0]))
            yield last < AT_JUMPS, f"{vehicle}, {kind}: the last step of a set is {last:.0%} of its way"
        moved = max(result["null directions"]["unseen_m"])
        yield moved < 1e-6, f"{vehicle}: null moves take the boat {moved:.1e} m off"
        most = [kind for kind in result if kind.endswith("manoeuvres")][-1]
        known, random = medians(result[most]), medians(result["random 1 %"])
        yield (
            known["coefficient_median"] > random["coefficient_median"],
            (f"{vehicle}: {most} leave half the coefficients within {known['coefficient_median']:.2%}"),
        )
        yield (
            known["unseen_m"] < random["unseen_m"],
            (f"{vehicle}: {most} leave {known['unseen_m']:.2g} m, random errors of 1 % {random['unseen_m']:.2g} m"),
        )
