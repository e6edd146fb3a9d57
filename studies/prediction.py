"""Do coefficients that reproduce the manoeuvre they were identified from predict manoeuvres that nobody has flown?

Question: thesis section 8.1 asks which it is: the same accuracy on all manoeuvres, no better than random coefficients
with errors of the same size, or in between. It flies 50 identified sets on 100 random manoeuvres (Tables 29-32, Figures
72-88, 113-126); the sets are those of the coupled manoeuvre.
Claim: in between. Identified sets predict better than random sets within 10 % and far worse than they reproduce their
own manoeuvre, and the set matters more than the manoeuvre. The posterior of a noisy track of that manoeuvre knows how
far off its predictions are: its 90 % bands hold the truth about 90 % of the time.
Cost: twenty minutes, most of them for three posteriors, which are kept.
"""

from functools import partial
from operator import itemgetter

import numpy as np

import bayesub as bs
from bayesub.report.markdown import columns, named
from prediction import plots
from thesis import cases
from thesis.counterparts import comparison
from thesis.plots import campaign
from thesis.predictions import LEVELS, STATISTICS, fly_all, searched, summary

N_SETS, N_MANOEUVRES, MAX_ITERATIONS, N_DRAWS = 50, 100, 500, 200
QUICK = (4, 5, 60)
QUICK_FREE = ("Xuu", "Yuv", "Nuv", "Zuw", "Muw")
SETS = {"best": "o", "middle": "s", "worst": "D"}
FIGURES = {
    "distributions": "Largest position error on a hundred unseen manoeuvres, on one axis for all boats, scaled to the "
    "length of suboff. Sets that SQP identified (dotted, dash-dotted, vermilion) lie far left of random ones "
    "(dashed). The middle and the worst lie right of the error of the simulation itself (black), the best by less, and "
    "the best of npsauv not at all.",
    "calibration": "How often bands of the posterior hold the true position, against what they claim. It is one trial "
    "a boat, so that a line may leave the diagonal by chance; the study calibration repeats trials.",
    "sorted": "Errors by identified set and by unseen manoeuvre, in the boats' own metres: median and 90 %.",
    "sets_*": "{}: the best, the middle and the worst set by mean cost, as ratios to the truth.",
    "surface_*": "{}: largest position error of every set on every manoeuvre.",
}
SENTENCES = {  # what sections 5.6 and 7.5.3, 8.4 and 8.5 say, and which of our numbers that is
    "share of the time in the simulation (%)": ("99.8, and 90 to 95", lambda r: 100.0 * r["share_simulating"]),
    "unseen over own manoeuvre, mean errors": ("500 to 1000", itemgetter("times_worse")),
    "middle set, error over path (%)": ("about 1", lambda r: 100.0 * r["share_of_path"]["middle"]),
    "worst set on its worst manoeuvre, error over path (%)": (
        "just over 6", lambda r: 100.0 * r["largest_share_of_path"],
    ),
}  # fmt: skip
GLOSSARY = "booth"
ANSWER = """
In between: the fifty identified sets miss a hundred unseen manoeuvres of suboff by {suboff/all/mean; .1f} m on
average (largest position error), random sets within 10 % by {suboff/kinds/random/mean; .0f} m. The 90 % bands of
the posterior hold {*/coverage/0.9; min; percent; .0f} to {*/coverage/0.9; max; percent; .0f} % of the true
positions, of one trial a boat.
"""


def compute(run):
    """Errors of every set, calibration level and posterior draw on every manoeuvre."""
    vehicles = ("npsauv",) if run.quick else cases.VEHICLES
    return run.parts("flights", {vehicle: partial(predict, run, vehicle) for vehicle in vehicles})


def predict(run, vehicle):
    """The numbers of one vehicle, and the array of its errors."""
    n_sets, n_manoeuvres, max_iterations = QUICK if run.quick else (N_SETS, N_MANOEUVRES, MAX_ITERATIONS)
    problem, estimate = searched(vehicle, n_sets, max_iterations)
    trial = cases.trial(vehicle, "coupled", free=QUICK_FREE if run.quick else None)
    with run.work_folder() as folder:
        posterior = cases.sampled(trial, folder / f"posterior_{vehicle}_coupled.nc")
    rows = np.random.default_rng(cases.SEED).choice(len(posterior.draws), N_DRAWS, replace=False)
    draws = trial.coefficient_sets(posterior.draws[rows])
    flights = fly_all(problem, estimate, draws, n_manoeuvres)
    numbers = summary(problem, estimate, flights)
    numbers["shortcomings"] = [] if posterior.converged else list(posterior.shortcomings)
    return numbers, {"errors": flights["errors"]["sets"]}


def draw(run, numbers):
    """Errors by kind, by set and by manoeuvre; coefficients; tables beside the thesis's."""
    for vehicle, r in numbers.items():
        groups = [(*plots.KINDS[key], np.array([r["ratios"][key]]), marker) for key, marker in SETS.items()]
        groups = [(label, ratios, marker, colour) for label, colour, ratios, marker in groups]
        campaign.draw_sets(run.figure(f"sets_{vehicle}"), r["names"], groups)
    kinds = {v: {key: np.array(e, dtype=float) for key, e in r["kind_errors"].items()} for v, r in numbers.items()}
    plots.draw_distributions(run.figure("distributions"), kinds, {v: to_suboff(v) for v in numbers})
    shares, chance = (
        {v: np.array(list(r[key].values())) for v, r in numbers.items() if key in r}
        for key in ("coverage", "coverage_of_draws")
    )
    plots.draw_calibration(run.figure("calibration"), LEVELS, shares, chance)
    run.page(tables(numbers))
    errors = {vehicle: run.load_arrays(f"flights_{vehicle}")["errors"] for vehicle in numbers}
    for vehicle, values in errors.items():
        plots.draw_surface(run.figure(f"surface_{vehicle}"), values)
    plots.draw_sorted(run.figure("sorted"), errors)


def tables(numbers):
    """Tables 29 to 32 beside the thesis's, and the posterior predictive."""
    published = cases.published()["prediction"]
    vehicle = {"vehicle": itemgetter("name")}
    yield "Largest position errors, `ours / thesis = ratio`, in m on a boat as long as suboff: those of the AUVs times"
    yield "102.26 m over their length. Over all identified sets and manoeuvres (thesis Table 29):\n"
    words = {"max": "maximum", "mean": "mean", "median": "median", "min": "minimum"}
    cells = {
        words[key]: lambda r, key=key: scaled(r["name"], r["all"][key], published["all"][key]) for key in STATISTICS
    }
    own = {"on its own manoeuvre, mean": lambda r: scaled(r["name"], r["own_manoeuvre_mean_m"])}
    yield from columns(named(numbers), vehicle | cells | own)
    yield "\nMean over the manoeuvres (Tables 30-32):\n"
    keys = {f"{key} set": key for key in SETS} | {key: key for key in ("simulation", "random", "posterior")}
    cells = {
        word: lambda r, key=key: scaled(
            r["name"], r["kinds"][key]["mean"], published["position"].get(key, {}).get("mean")
        )
        for word, key in keys.items()
    }
    yield from columns(named(numbers), vehicle | cells)
    yield "\nWhat the thesis says in sentences, for its three submarines:\n"
    cells = {"sentence": itemgetter("sentence"), "thesis": itemgetter("thesis")}
    cells |= {v: lambda row, v=v: f"{row['of'](numbers[v]):.3g}" for v in numbers}
    rows = [{"sentence": key, "thesis": says, "of": of} for key, (says, of) in SENTENCES.items()]
    yield from columns(rows, cells)
    yield "\nRank correlations of the error of predictions (median) with errors of coefficients, set by set: of all,"
    yield "along the stiffer and along the sloppier half of the directions; and with how far velocities of a manoeuvre"
    yield "are from those of the own one, manoeuvre by manoeuvre:\n"
    cells = vehicle | {
        word: lambda r, word=word: f"{r['rank_correlations'][word]:.2f}"
        for word in ("all", "stiff", "sloppy", "manoeuvre")
    }
    yield from columns(named(numbers), cells)
    yield "\nShare of true positions inside central posterior predictive bands; shares of the variance of log errors:\n"
    cells = {
        "50 %": lambda r: f"{r['coverage']['0.5']:.0%}",
        "90 %": lambda r: f"{r['coverage']['0.9']:.0%}",
        "variance by set": lambda r: f"{r['variance_by_set']['set']:.0%}",
        "by manoeuvre": lambda r: f"{r['variance_by_set']['manoeuvre']:.0%}",
        "failed predictions": lambda r: r["failed"]["sets"],
    }
    yield from columns(named(numbers), vehicle | cells)


def scaled(vehicle, metres, published=None):
    """A length on a boat as long as suboff, beside the thesis's for submarines 1 to 3."""
    return comparison(to_suboff(vehicle) * metres, published[cases.VEHICLES.index(vehicle)] if published else None)


def to_suboff(vehicle):
    """What makes lengths of a boat those of one as long as suboff."""
    return bs.load_vehicle("suboff").length_m / bs.load_vehicle(vehicle).length_m


def claims(numbers):
    """In between, vehicle by vehicle."""
    for vehicle, r in numbers.items():
        shortcomings = r.get("shortcomings", [])
        yield not shortcomings, f"{vehicle}: {'; '.join(shortcomings)}"
        middle, random = r["kinds"]["middle"]["mean"], r["kinds"]["random"]["mean"]
        own = r["own_manoeuvre_mean_m"]
        yield (
            10 * own < middle < random,
            (f"{vehicle}: {own:.3g} m on its own, {middle:.3g} m unseen, {random:.3g} m random"),
        )
