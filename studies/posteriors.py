"""Do the sets that SQP identifies lie in the posterior, and what does the posterior add to them?

Question: the thesis draws 50 identified sets of each vehicle and manoeuvre beside each other (chapter 7) and cannot say
which of them is right. What does the posterior of the same trial say of them, coefficient by coefficient and together?
Claim: from noisy readings nine searches of ten and more end in sets that fit as well as the posterior does. From the
exact track they do in the vertical plane; on the horizontal spiral fewer than half do, because the thesis's rule stops
them while the track is off by more than the noise would hide, and on the coupled one it depends on the boat. (On the
horizontal spiral of auv690 the truth fails the same criterion, so that the case proves nothing.) Either way
at least four fifths of the variance of the sets is along directions that the data do not see. Their scatter is no
standard error: it differs from the posterior standard deviation by a factor that differs two-fold and more from one
coefficient to another. What is known is the drag Xuu, always best and to 2 % of the prior's standard deviation or 0.5 %
of its value, and combinations of the others; the median coefficient keeps two fifths of its prior uncertainty and more.
A posterior that has not converged is marked and counts for none of this.
Cost: about a quarter of an hour on one core. A killed run continues with --resume: posteriors and searches are kept.

The trials are :func:`thesis.cases.trial`: position noise of 0.5 m on a boat of suboff's length, in proportion
to length, and attitude noise of 0.1 degrees, sampled every second on suboff, in proportion to length over speed; the
prior is normal, 25 % about a guess 15 % off. SQP follows the thesis's rules (studies/baselines.py) on the exact track,
and on the noisy readings of the trial, weighted by their noise; the added masses that reduce the rank are known. A set
is inside where it lies within the 95 % of posterior draws that are nearest to their mean by Mahalanobis distance, that
fit best by chi-square, or that have the highest posterior density. Directions are those of the Fisher information at
the truth in prior standard deviations: null by the equations, sloppy where the singular value is not above one, the
others stiff. The prior is about a guess, so that two of these counts differ by one from those of the study
`ill_conditioning`, whose prior is about the truth.
"""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
from scipy import stats

from bayesub.model.coefficients import EQUATIONS
from bayesub.problem.distributions import Normal
from bayesub.report.plots import coefficients, corner, style, trade_offs
from posteriors import plots, tables
from posteriors.trials import compare, searches
from thesis import cases

N_SETS, MAX_ITERATIONS, MAX_STEPS = 50, 500, 20_000
QUICK, QUICK_CASES = (5, 60, 400), (("npsauv", "horizontal"),)
MOST, UNSEEN, DRAG, KEPT = 0.9, 0.8, 0.02, 0.4  # of the claim
SHOWN = 13  # sets at most of a group in the figures of a case
CHANCE = 0.05  # with which a few sets may fall short of it
SETS = {  # group of sets -> label, marker, colour
    "starts": ("starts of SQP", "o", "#909090"),
    "exact": ("SQP, exact track", "o", style.SQP),
    "noisy": ("SQP, noisy track", "s", style.NULL),
}
MARKS = {
    "exact": ("SQP, exact track", "o", True),
    "noisy": ("SQP, noisy track", "s", False),
    "truth": ("truth", "D", False),
}
MEASURES = {
    "distance": "Mahalanobis distance\nover its 95 % limit",
    "chi_square": "excess chi-square\nover its 95 % limit",
    "density": "loss of log density\nover its 95 % limit",
}
FIGURES = {
    "scatter": "Scatter of SQP and spread of the posterior along each direction of all cases, against its singular "
    "value; left of one the data see nothing. The posterior (crosses) keeps to the line that data and prior make. "
    "SQP's sets keep about the spread of their starts (grey) where the data see nothing, and fall with the line or "
    "below it where they see: their scatter is that of a search.",
    "trade_offs_*": "{}: the coefficients that trade off most, as ratios to the truth. SQP's sets from the exact "
    "track (orange) run along the ellipses of the posterior and out of them. Added masses that SQP held are no result "
    "of it.",
    "contraction": "Posterior sd over prior sd of every coefficient in every case, best known first. One (pale) means "
    "that the trial said nothing; empty cells have no part in the motion.",
    "coefficients_*": "{}: prior (grey), posterior (blue) and sets of SQP, as ratios to the truth. Added masses "
    "that SQP held are no result of it.",
    "distances": "How far out SQP's sets and the truth lie, over what holds 95 % of the posterior, by three measures.",
    "correlations_*": "{}: posterior correlations of the coefficients that have strong ones.",
}
GLOSSARY = "booth"
ANSWER = """
From noisy readings {*/inside/noisy/chi_square; min; .0f} or more of fifty sets fit as well as the posterior does,
but at most {*/scatter/noisy/stiff; max; percent; .0f} % of their variance is along directions that the data see.
For the median coefficient their scatter is {*/scatter_over_posterior/noisy/1; min; .2f} to
{*/scatter_over_posterior/noisy/1; max; .2f} of the posterior standard deviation, by case.
"""


def compute(run):
    """Every case; a posterior that has been sampled and searches that are done are read back."""
    effort = QUICK if run.quick else (N_SETS, MAX_ITERATIONS, MAX_STEPS)
    pairs = QUICK_CASES if run.quick else cases.CASES
    return run.parts("case", {" ".join(pair): partial(case, run, pair, *effort) for pair in pairs})


def case(run, pair, n_sets, max_iterations, max_steps):
    """The numbers of one case, and the arrays that its figures need besides."""
    problem, name = cases.trial(*pair), "_".join(pair)
    with run.work_folder() as folder:
        posterior = cases.sampled(problem, folder / f"posterior_{name}.nc", max_steps=max_steps)
    sets = run.part(f"sets_{name}", partial(searches, problem, n_sets, max_iterations))
    return compare(problem, posterior, sets)


def draw(run, numbers):
    """Coefficients and strongest trade-offs of each case; all cases beside each other."""
    run.page(tables.page(numbers, {group: label for group, (label, *_) in SETS.items()}))
    titles = {name: name + ("" if case["converged"] else " (not converged)") for name, case in numbers.items()}
    contraction = {t: dict(zip(numbers[n]["names"], numbers[n]["contraction"], strict=True)) for n, t in titles.items()}
    plots.draw_contraction(run.figure("contraction"), contraction)
    places = {title: numbers[name]["places"] for name, title in titles.items()}
    plots.draw_distances(run.figure("distances"), places, MARKS, MEASURES)
    arrays = {name: run.load_arrays(f"case_{name.replace(' ', '_')}") for name in numbers}
    groups = SETS | {"posterior": ("posterior", "x", style.POSTERIOR)}
    scatter = {titles[name]: scatter_of(a, numbers[name]["n_null"], groups) for name, a in arrays.items()}
    plots.draw_scatter(run.figure("scatter"), scatter, groups)
    for name, a in arrays.items():
        draw_case(run, name.replace(" ", "_"), numbers[name], a)


def scatter_of(arrays, n_null, groups):
    """Singular values, which directions are null, and standard deviations along them by group."""
    values = arrays["singular_values"]
    return values, np.arange(len(values)) >= len(values) - n_null, {g: arrays[f"along_{g}"] for g in groups}


def draw_case(run, name, case, arrays):
    """Coefficients, trade-offs and correlations of one case."""
    names, reference = case["names"], arrays["reference"]
    prior = Normal(arrays["prior_mean"], arrays["prior_sd"])
    found = []
    for group in ("exact", "noisy"):
        fits, (label, *look) = np.array(case["places"][group]["chi_square"]) <= 1.0, SETS[group]
        label = f"{label}: {fits.sum()} of {len(fits)} fit"
        some = slice(None, None, -(-len(fits) // SHOWN))  # all would cover the intervals
        values, fits = plots.identified(arrays[group], reference)[some], fits[some]
        found.append(coefficients.Found(label, values, fits, np.repeat(fits[:, None], len(names), axis=1), *look))
    whole = SimpleNamespace(names=names, mean=arrays["mean"], sd=arrays["sd"], quantiles=lambda _: arrays["quantiles"])
    word = "truth" if case["converged"] else "truth; NOT CONVERGED"
    path = run.figure(f"coefficients_{name}")
    coefficients.draw(path, whole, prior, reference, found, word, EQUATIONS)
    some = arrays["chosen"]
    draws = SimpleNamespace(names=tuple(np.array(names)[some]), draws=arrays["draws"].astype(float))
    prior = Normal(prior.mean[some], prior.sd[some])
    exact = replace(found[0], values=found[0].values[:, some], good=found[0].good[:, some])
    chosen, path = np.arange(len(some)), run.figure(f"trade_offs_{name}")
    corner.draw(path, draws, prior, reference[some], EQUATIONS, chosen=chosen, found=[exact], word=word)
    signs = np.where(reference < 0.0, -1.0, 1.0)  # of ratios to the truth, as all else is drawn
    correlation = arrays["correlation"] * np.outer(signs, signs)
    trade_offs.draw_correlation(run.figure(f"correlations_{name}"), names, correlation, EQUATIONS)


def claims(numbers):
    """The claim, of each case whose posterior has converged."""
    for name, case in numbers.items():
        if not case["converged"]:
            continue
        n, inside = len(case["places"]["exact"]["distance"]), case["inside"]
        noisy, exact = (inside[group]["chi_square"] for group in ("noisy", "exact"))
        yield reached(noisy, n, MOST), f"{name}: {noisy} of {n} sets from noisy readings fit as well as the posterior"
        holds = {"vertical": reached(exact, n, MOST), "horizontal": reached(n - exact, n, 0.5), "coupled": True}
        yield holds[name.split()[1]], f"{name}: {exact} of {n} sets from the exact track fit as well as the posterior"
        for group in ("exact", "noisy"):
            stiff = case["scatter"][group]["stiff"]
            yield stiff < 1.0 - UNSEEN, f"{name}: {stiff:.0%} of the scatter ({group}) is along what the data see"
            least, _, largest = case["scatter_over_posterior"][group]
            yield largest > 2.0 * least, f"{name}: all coefficients scatter {least:.2g} to {largest:.2g} posterior sd"
        contraction = dict(zip(case["names"], case["contraction"], strict=True))
        best = min(contraction, key=contraction.get)
        yield best == "Xuu", f"{name}: {best} is the best known coefficient"
        yield contraction["Xuu"] < DRAG, f"{name}: Xuu keeps {contraction['Xuu']:.1%} of its prior sd"
        median = np.median(case["contraction"])
        yield median > KEPT, f"{name}: the median coefficient keeps {median:.0%} of its prior sd"


def reached(count, n, share):
    """Whether a share of n sets is reached; the few of a quick run, which rounding can decide, may miss it by luck."""
    return count >= share * n if n >= N_SETS else stats.binom.cdf(count, n, share) > CHANCE
