"""Which prior about a guess holds the truth as often as it says, if the guess is off by more or by less than it says?

Question: users have a guess of every coefficient, and an idea of how far it may be off. How often do 90 % intervals
hold the truth, with guesses that are 15, 25 and 50 % off and a prior that says 25 %?
Claim: a normal prior with an sd relative to the guess is too narrow whenever the guess is too small, and any prior with
a fixed sd fails where that is too small. A log-normal prior whose sd is unknown, the same for all coefficients, and
informed by the data holds the truth within five per cent of what it says, but with guesses that are 50 % off, of which
some are several times too small. The report says that prior and data disagree where a prior of 25 % meets such guesses,
and keeps quiet where it is right.
Cost: ten minutes on two cores.

Posteriors are normal approximations (guesses.posteriors), not samples.
"""

from functools import partial
from operator import itemgetter

import numpy as np

import bayesub as bs
from bayesub.report import markdown
from bayesub.report.plots import style
from guesses.posteriors import NORMAL_SD, Guessed, judged

N_TRIALS, N_OTHERS, QUICK_TRIALS = 200, 60, 3
INTERVAL = 0.9
STEP = 2.0  # s; truth and model have the same, so that its error is in neither's way
SEED = 20049
PRIORS = {
    "normal, 25 %": bs.priors.relative_normal(NORMAL_SD),
    "log-normal, 25 %": bs.priors.relative_log_normal(0.25),
    "log-normal, 50 %": bs.priors.relative_log_normal(0.5),
    "spread of boats": None,
    "unknown scale of an axis": bs.priors.relative_hierarchical(0.25, by_axis=True),
    "unknown scale": bs.priors.relative_hierarchical(0.25),
}
BEST, NORMAL = "unknown scale", "normal, 25 %"
QUICKSTART = "quickstart: suboff every second, relative 15%"
CONDITIONS = {  # vehicle, errors of the guess, interval of the readings in seconds, number of trials, priors
    "suboff, relative 15%": ("suboff", "relative", 0.15, 5.0, N_TRIALS, tuple(PRIORS)),
    "suboff, relative 25%": ("suboff", "relative", 0.25, 5.0, N_TRIALS, tuple(PRIORS)),
    "suboff, relative 50%": ("suboff", "relative", 0.5, 5.0, N_TRIALS, tuple(PRIORS)),
    "suboff, logarithmic 25%": ("suboff", "logarithmic", 0.25, 5.0, N_OTHERS, tuple(PRIORS)),
    QUICKSTART: ("suboff", "relative", 0.15, 1.0, N_TRIALS, (NORMAL,)),
}
SIZES = {"15": "suboff, relative 15%", "25": "suboff, relative 25%", "50": "suboff, relative 50%"}
RIGHT = "suboff, logarithmic 25%"  # for which the log-normal prior of 25 % is right
FAR = "relative 50%"  # where one guess in six is less than half of the truth
CLOSE = 0.05  # coverage from what it should be, of a calibrated prior
MARKERS = "os^Dv*"
COLOURS = (style.SQP, style.READINGS, style.POSTERIOR, style.NULL, style.WEAK, style.LINEAR)
FIGURES = {
    "coverage": "How often 90 % intervals hold the truth, by how far the guess is off, a line a prior; bars are two "
    "standard errors. Above the dashed line intervals are wider than they need be.",
}
ANSWER = """
With guesses that are 25 % off 90 % intervals hold the truth {suboff, relative 25%/priors/normal, 25 %/coverage;
percent; .0f} % of the time with a normal prior of 25 % of the guess, and {suboff, relative 25%/priors/unknown
scale/coverage; percent; .0f} % with a log-normal prior of unknown scale; with guesses 50 % off it is
{suboff, relative 50%/priors/normal, 25 %/coverage; percent; .0f} and {suboff, relative 50%/priors/unknown
scale/coverage; percent; .0f} %, and the quickstart's prior holds {quickstart: suboff every second, relative
15%/priors/normal, 25 %/coverage; percent; .0f} % with its guesses.
"""


def compute(run):
    """Coverage, width and conflicts by condition and prior."""
    numbers = {}
    for place, (name, (*_, n_trials, names)) in enumerate(CONDITIONS.items()):
        run.progress.stage(name)
        n_trials = QUICK_TRIALS if run.quick else n_trials
        trials = run.repeat(f"condition_{place}", partial(trial, place), n_trials)
        numbers[name] = {"n_trials": n_trials, "priors": {prior: averaged(trials, prior) for prior in names}}
    return numbers


def posed(place, k):
    """Record and guess of a trial of a condition, and a generator."""
    vehicle, errors, size, interval_s, *_ = list(CONDITIONS.values())[place]
    rng = np.random.default_rng([SEED, place, k])
    boat = bs.load_vehicle(vehicle)
    sensors = bs.sensors.Track(0.5, 0.1, interval_s, ("x", "y", "yaw"))
    guessed = Guessed.drawn(boat, bs.load_manoeuvre("horizontal", boat), sensors, errors, size, STEP, rng)
    return guessed, rng


def trial(place, k):
    """What every prior makes of one record and one guess."""
    guessed, rng = posed(place, k)
    return approximate(guessed, list(CONDITIONS.values())[place][-1], rng)


def approximate(guessed, names, rng):
    """Coverage, width and conflict of approximate posteriors; nothing for a guess that does not fly the manoeuvre."""
    results = {}
    for prior in names:
        try:
            draws, conflict = guessed.draws(PRIORS[prior], rng)
        except ValueError:
            results[prior] = None
        else:
            results[prior] = judged(draws, guessed.truth, INTERVAL) | {"conflict": conflict.disagree}
    return results


def averaged(trials, prior):
    """Means over trials; coverage with the standard error of a mean over trials, whose coefficients hang together."""
    found = [t[prior] for t in trials if t[prior] is not None]
    held = [t["held"] for t in found]
    result = {
        "n_failed": len(trials) - len(found),
        "coverage": float(np.mean(held)),
        "coverage_error": float(np.std(held, ddof=1) / np.sqrt(len(held))),
        "half_width": float(np.mean([t["half_width"] for t in found])),
    }
    return result | {"conflict": float(np.mean([t["conflict"] for t in found]))}


def draw(run, numbers):
    """A figure of coverage, and tables of coverage, width and conflicts."""
    run.page(tables(numbers))
    with style.figure(run.figure("coverage"), 6.0, 4.0) as figure:
        panel(figure.subplots(), numbers)


def panel(ax, numbers):
    """Coverage over the size of the errors of the guess, a line a prior."""
    for j, prior in enumerate(PRIORS):
        rows = [numbers[name]["priors"][prior] for name in SIZES.values()]
        shares, bars = (100 * np.array([row[key] for row in rows]) for key in ("coverage", "coverage_error"))
        places = [float(size) + 0.4 * (j - 2.5) for size in SIZES]
        ax.errorbar(places, shares, 2 * bars, marker=MARKERS[j], color=COLOURS[j], ms=4, lw=1, label=prior)
    ax.axhline(100 * INTERVAL, color="0.4", ls="--", lw=1)
    ax.set(
        xticks=[float(size) for size in SIZES], xlabel="guess off by (%)", ylabel="truths held by 90 % intervals (%)"
    )
    ax.legend(loc="lower left")


def tables(numbers):
    """Coverage with its standard error, median half width, conflicts; and sampling against the approximation."""
    lines = []
    for text, head in (
        (
            "{coverage:.1%} ± {coverage_error:.1%}",
            f"Share of the true coefficients within {INTERVAL:.0%} intervals",
        ),
        ("{half_width:.0%}", "Half width of the intervals over the truth, median over coefficients"),
        ("{conflict:.1%}", "Trials in which the report would say that prior and data disagree"),
    ):
        cells = {"guess": itemgetter("name"), "trials": itemgetter("n_trials")} | {
            prior: partial(cell, text, prior) for prior in PRIORS
        }
        lines += [f"\n{head}:\n", *markdown.columns(markdown.named(numbers), cells)]
    return lines


def cell(text, prior, row):
    """A text of the numbers of a prior."""
    return text.format(**row["priors"][prior]) if prior in row["priors"] else ""


def size(numbers):
    """Number of trials of a condition."""
    return numbers[QUICKSTART]["n_trials"]


def claims(numbers):
    """The unknown scale is calibrated, the relative normal is not, and conflicts are said where there are some."""
    yield all(row["half_width"] is not None for c in numbers.values() for row in c["priors"].values()), "no interval"
    if size(numbers) < N_TRIALS:
        return
    for name, condition in numbers.items():
        if BEST in condition["priors"]:
            share = condition["priors"][BEST]["coverage"]
            yield name.endswith(FAR) or abs(share - INTERVAL) < CLOSE, f"{name}: {BEST} holds {share:.1%}"
    share = numbers["suboff, relative 25%"]["priors"][NORMAL]["coverage"]
    yield share < INTERVAL - CLOSE, f"the normal prior about a guess holds {share:.1%} after all"
    quiet = numbers[RIGHT]["priors"]["log-normal, 25 %"]["conflict"]
    loud = numbers["suboff, relative 50%"]["priors"]["log-normal, 25 %"]["conflict"]
    yield quiet < 0.05, f"a right prior is called into question in {quiet:.0%} of the trials"
    yield loud > 0.5, f"a prior half as wide as the errors is called into question in {loud:.0%} of the trials only"
