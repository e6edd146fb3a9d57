"""Do other equations have non-unique, ill-conditioned coefficients too?

Question: with it the thesis closes. Four equation sets and their vehicles are asked: the 101 terms of the thesis
(booth), Prestero's of an AUV (remus), a ship's (abkowitz) and the revised submarine equations with integrals of the
cross-flow along the hull (feldman). And does a set with fewer terms predict as well?
Claim: every null direction of every axis is an equation of motion that can be written in the terms of that axis, and
so may be multiplied by a number or added; none comes from velocity terms that look alike. All sets have such
directions on horizontal manoeuvres. Every spectrum spans decades, and every posterior sharpens some coefficients and
leaves others. A set with too few terms does not fit, its bands miss the truth, and the model check says so. One with
more terms than the boat has fits, and its bands hold the truth, but it predicts worse than the right set.
Cost: six minutes on two cores; with --quick one.
"""

from functools import partial

import numpy as np

from bayesub.inference.sampling import sample
from bayesub.model.vehicles import load_vehicle
from other_equations import plots, swapped, tables
from thesis import uniqueness

VEHICLES = {
    "booth": ("auv690", "suboff", "npsauv"),
    "remus": ("remus100",),
    "abkowitz": ("mariner",),
    "feldman": ("npsauv_crossflow", "phoenix"),
}
PLANAR = ("horizontal", "zigzag_20_20")  # with rudder
OTHERS = ("vertical", "coupled")
# Vehicle, and the equations it is fitted with: its own, or others.
FITS = (
    ("auv690", "booth"),
    ("auv690", "remus"),
    ("remus100", "remus"),
    ("remus100", "booth"),
    ("npsauv_crossflow", "feldman"),
    ("npsauv_crossflow", "booth"),
    ("mariner", "abkowitz"),
)
UNSEEN = ("turning_circle", "zigzag_20_20", "zigzag_10_10", *(f"random:{seed}" for seed in range(1, 11)))
MAX_STEPS, QUICK_STEPS = 3000, 300
# Quick: a minute, because bands are judged over three posteriors with each boat's own terms.
N_TRIALS, QUICK_TRIALS = 4, {True: 3, False: 1}  # of a fit, by own terms or not, whose predictions are judged together
N_STARTS, QUICK_STARTS, ITERATIONS = 5, 3, 200
SEED = 19
FIGURES = {
    "other_equations": "Left, null directions of each axis by vehicle and manoeuvre; all are equations of motion. "
    "Middle, spectra of a track. Right, errors on unseen manoeuvres by the terms that were fitted, and what the 90 "
    "% bands hold.",
}
ANSWER = """
In {cases/*/spectra/track/n_params; count; .0f} cases of four equation sets every null direction is an equation of
motion that the terms of its axis can write; terms that look alike make {cases/*/axes/*/terms; max; .0f}. Spectra
span {cases/*/spectra/track/decades; min; .1f} to {cases/*/spectra/track/decades; max; .1f} decades besides, and
auv690 fitted with the terms of remus misses unseen manoeuvres by {fits/auv690 remus/predictions/median_lengths;
.2f} ship lengths instead of {fits/auv690 booth/predictions/median_lengths; .2f}.
"""


def compute(run):
    """Ranks with their mechanisms, spectra, and fits with own and other equations."""
    chosen = {name: vehicles[: 1 if run.quick else None] for name, vehicles in VEHICLES.items()}
    cases = {
        f"{vehicle} {manoeuvre}": partial(case, name, vehicle, manoeuvre)
        for name, vehicles in chosen.items()
        for vehicle in vehicles
        for manoeuvre in (PLANAR if run.quick or name == "abkowitz" else PLANAR + OTHERS)
    }
    fits = {
        f"{vehicle} {name}": partial(fit, vehicle, name, run.quick)
        for vehicle, name in FITS[: 4 if run.quick else None]
    }
    return {"cases": run.parts("cases", cases), "fits": run.parts("fits", fits)}


def case(name, vehicle, manoeuvre):
    """Uniqueness and spectra of one vehicle on one manoeuvre."""
    track = uniqueness.flight(vehicle, manoeuvre)
    axes, spectra = uniqueness.uniqueness(track), uniqueness.spectra(track)
    return {"equations": name, "vehicle": vehicle, "manoeuvre": manoeuvre, "axes": axes, "spectra": spectra}


def fit(vehicle, name, quick):
    """The posterior of the horizontal spiral in some equations, what it predicts, and what the model check says.

    Predictions are of trials with other noise and other guesses; the rest is of the first one.
    """
    track, boat = uniqueness.flight(vehicle, "horizontal"), load_vehicle(vehicle)
    trials, checked, searched, predicted = (
        np.random.default_rng(seed) for seed in np.random.SeedSequence(SEED).spawn(4)
    )
    own = name == boat.equations.name
    n_trials, n_starts = (QUICK_TRIALS[own], QUICK_STARTS) if quick else (N_TRIALS, N_STARTS)
    max_steps = QUICK_STEPS if quick else MAX_STEPS
    crossed = boat if own else swapped.crossed(boat, name, "horizontal")
    fits = []
    for posed, sampled in zip(trials.spawn(n_trials), trials.spawn(n_trials), strict=True):
        trial = uniqueness.trial(track, posed) if own else swapped.crossed_trial(track, crossed, posed)
        fits.append((trial, sample(trial, rng=sampled, max_steps=max_steps)))
    # Random manoeuvres move stern planes too, which the equations of a ship do not have.
    names = UNSEEN if boat.equations.degrees_of_freedom == 6 else UNSEEN[:3]
    unseen = swapped.unseen(boat, names, "horizontal")
    problem, posterior = fits[0]
    return {
        "equations": name,
        "vehicle": vehicle,
        "own": own,
        "posterior": uniqueness.sharpened(posterior),
        "predictions": swapped.predictions(unseen, fits, predicted),
        "check": swapped.model_check(problem, posterior, checked),
        "sqp": uniqueness.searches(problem, searched, n_starts, ITERATIONS) if own else None,
    }


def draw(run, numbers):
    """One figure and the tables."""
    plots.draw(run.figure("other_equations"), numbers["cases"], numbers["fits"])
    run.page(tables.page(numbers))


def claims(numbers):
    """Null directions are equations of motion in all sets; spectra, posteriors and crossed fits as said above."""
    for title, r in numbers["cases"].items():
        for axis, one in r["axes"].items():
            yield one["terms"] == 0, f"{title}: {one['terms']} null directions of {axis} have no added mass"
            n_equations = len(one["equations"])
            yield (
                one["motion"] == n_equations,
                f"{title} {axis}: {one['motion']} null, {n_equations} equations of motion",
            )
            yield (one["gap"] or np.inf) > 1e6, f"{title} {axis}: a gap of {one['gap'] or 0:.0e} separates nothing"
            if r["manoeuvre"] in PLANAR and axis in "YN":
                yield axis in one["equations"], f"{title}: the equation of {axis} is no null direction of its axis"
        for sensors, s in r["spectra"].items():
            yield s["decades"] > 3.0, f"{title}: the spectrum of {sensors} spans {s['decades']:.1f} decades"
        s = r["spectra"]["track"]
        yield s["n_sharpened"] < s["n_params"], f"{title}: a track sharpens every coefficient"
        yield s["n_known"] < 0.5 * s["n_params"], f"{title}: a track makes {s['n_known']} coefficients known"
    fits = numbers["fits"]
    for title, f in fits.items():
        if f["own"]:
            p, errors, nearer = f["posterior"], f["predictions"], np.mean(f["sqp"]["nearer_than_guess"])
            yield p["converged"], f"{title}: {'; '.join(p['shortcomings'])}"
            share = p["n_sharpened"] / p["n_params"]
            yield 0.5 < share < 0.95, f"{title}: {share:.0%} of the coefficients are sharpened"
            yield f["check"]["fits"], f"{title}: the right equations are called into question"
            yield errors["coverage"]["0.9"] > 0.8, f"{title}: 90 % bands hold {errors['coverage']['0.9']:.0%}"
            yield nearer < 2 / 3, f"{title}: SQP ends nearer to the truth than the guess in {nearer:.0%}"
    fewer, more = fits["auv690 remus"], fits["remus100 booth"]
    for title, other in (("auv690 booth", fewer), ("remus100 remus", more)):
        right, wrong = (f["predictions"]["median_lengths"] for f in (fits[title], other))
        yield wrong > 2.0 * right, f"{title} misses by {right:.2g} ship lengths, the other equations by {wrong:.2g}"
    yield not fewer["check"]["fits"], "auv690 remus: too few terms pass the model check"
    yield fewer["predictions"]["coverage"]["0.9"] < 0.5, "auv690 remus: bands of too few terms hold the truth"
    yield more["check"]["fits"], "remus100 booth: more terms than the boat has fail the model check"
    yield more["predictions"]["coverage"]["0.9"] > 0.8, "remus100 booth: bands of more terms than the boat has miss"
