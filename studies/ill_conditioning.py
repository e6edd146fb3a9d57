"""Which coefficients does a manoeuvre leave uncertain although they are unique, and why?

Question: chapter 6 of the thesis finds null spaces, section 7.8 ill-conditioning beside them. Which is which, how good
would sensors have to be, and what makes the difference: coefficients that do little, or errors that cancel?
Claim: null directions stay flat whatever the sensors, sloppy ones do not. Most coefficients would be known to 5 % if
they were alone, but fewer than half of those are in company: the others imitate them, so that a set whose force errors
are ten times their sum and more fits the horizontal track. The rest do too little. Xuu, the drag, is the best known and
known to 1 % everywhere.
Cost: about two minutes.

Readings are noise-free with the noise of the sensors as their weight, so nothing depends on a draw. A boat of length l
at speed u has its position read to 0.5 m * l / 102.26 m and its attitude to 0.1 degrees, once every l / u / 13.63: what
0.5 m, 0.1 degrees and 1 s are to suboff. The prior is 25 % about the truth.
"""

from functools import partial

import numpy as np

from bayesub.model.coefficients import EQUATIONS
from bayesub.report.plots import trade_offs
from ill_conditioning import one_case, tables
from ill_conditioning.plots import cancellation, collinearity, contribution, profile, spectra
from ill_conditioning.profile import LEVEL_95
from thesis.cases import CASES, MANOEUVRES, published

QUICK_CASES = (("suboff", "horizontal"),)
# A null profile rises by the square of what round-off moves the readings: 1e4 roundings of 1e-16 of 1 km over 0.5 m are
# 1e-9 sd at most, so 1e-18 a reading and 1e-14 over a few thousand.
FLAT = 1e-12
CANCELS = 10.0  # an order of magnitude; the thesis has 42 between its largest term and the sum
CANCELLATION = (
    "force errors of a set that SQP stopped at, over time, on the axes where they cancel most. Terms err far more than "
    "their sum (black)."
)
FIGURES = {
    "cancellation_suboff_horizontal": f"suboff horizontal: {CANCELLATION}",
    "cancellation_*": f"{{}}: {CANCELLATION}",
    "directions_*": "{}: directions from stiff to null, what is left of the prior along each, and what it is made of.",
    "spectra": "Singular values of all cases: known better than by the prior, left to the prior, and null.",
    "contribution_*": "{} manoeuvre: cost of one coefficient changed alone, sorted by size, a column a boat. Left of "
    "the dashed line the change costs less than the simulation's own error.",
    "profiles_*": "{}: rise of -2 log likelihood if one coefficient is held off its best value. What is sloppy crosses "
    "the lower line, with sensors a thousand times better; what is null stays at round-off however good they are.",
    "correlation_*": "{}: cosines of the regressors of each axis over time. Two of one shape have 1 or -1: this is of "
    "the equations along the motion, not of a posterior.",
    "regressors": "Surge regressors against each other on the horizontal manoeuvre: nearly one line (thesis Figure "
    "68).",
}
GLOSSARY = "booth"
ANSWER = """
On the horizontal spiral of suboff {suboff horizontal/n_sharpened; .0f} of {suboff horizontal/n_params; .0f}
directions are sharper than the prior and {suboff horizontal/n_null; .0f} are null; alone every coefficient would be
known, in company few are. A set that SQP stopped at has force errors of {suboff
horizontal/largest_force_errors/X/Xvv; .0f} N in Xvv alone, of which {suboff horizontal/largest_sum/X; .0f} N are
left in the sum.
"""


def compute(run):
    """Everything that is asked of every case."""
    converged = max(published()["sqp"]["horizontal"]["mean_converged_cost"])
    pairs = QUICK_CASES if run.quick else CASES
    return run.parts("case", {" ".join(pair): partial(analyse, *pair, converged) for pair in pairs})


def analyse(vehicle, manoeuvre, converged):
    """The numbers of one case, and the arrays that its figures need besides."""
    case = one_case.analyse(vehicle, manoeuvre, converged)
    return case.numbers(), case.arrays()


def draw(run, numbers):
    """Spectra, contributions, regressors; directions, profiles, correlations and cancellation of each case."""
    run.page(tables.page(numbers))
    all_spectra = {title: one_case.restored_spectrum(case) for title, case in numbers.items()}
    spectra.draw_cases(run.figure("spectra"), all_spectra, min(len(numbers), len(MANOEUVRES)))
    for manoeuvre in MANOEUVRES:
        alike = {title.split()[0]: case for title, case in numbers.items() if title.endswith(manoeuvre)}
        if alike:
            contributions = {vehicle: one_case.restored_contribution(case) for vehicle, case in alike.items()}
            accuracies = {vehicle: case["simulator_cost"] for vehicle, case in alike.items()}
            contribution.draw(run.figure(f"contribution_{manoeuvre}"), contributions, accuracies, EQUATIONS)
    stems = {title: title.replace(" ", "_") for title in numbers}
    arrays = {title: run.load_arrays(f"case_{stem}") for title, stem in stems.items()}
    for title, case in numbers.items():
        stem, saved = stems[title], arrays[title]
        directions = one_case.restored_spectrum(case, saved)
        trade_offs.draw_directions(run.figure(f"directions_{stem}"), directions, EQUATIONS)
        profile.draw(run.figure(f"profiles_{stem}"), one_case.restored_profiles(case), EQUATIONS)
        related = one_case.restored_collinearity(case, saved)
        collinearity.draw_correlation(run.figure(f"correlation_{stem}"), related, EQUATIONS)
        errors = one_case.restored_cancellation(case, saved)
        cancellation.draw(run.figure(f"cancellation_{stem}"), saved["times"], errors, EQUATIONS)
    flat = {t: a for t, a in arrays.items() if t.endswith("horizontal") and len(a["regressors"])}  # auv690 has no Xvv
    surge = {title: one_case.restored_regressors(a) for title, a in flat.items()}
    collinearity.draw_scatter(run.figure("regressors"), surge, [("Xvr", "Xrr"), ("Xvr", "Xvv")], EQUATIONS)


def claims(numbers):
    """The claim, case by case."""
    for title, case in numbers.items():
        names, posterior = list(case["coefficients"]), tables.column(case, "posterior")
        best = names[np.argmin(posterior)]
        yield best == "Xuu", f"{title}: the best known coefficient is {best}, not Xuu"
        yield posterior[names.index("Xuu")] < 0.01, f"{title}: Xuu is not known to 1 %"

        # Null and sloppy are two verdicts: the one is flat to round-off, the other rises above it.
        profiles = case["profiles"]
        rise = {verdict: max(cost for cost in p["cost"] if cost is not None) for verdict, p in profiles.items()}
        yield rise["best known"] > LEVEL_95, f"{title}: the profile of Xuu does not reach the 95 % level"
        yield rise["worst known"] > FLAT, f"{title}: {profiles['worst known']['name']} is flat but not null"
        if case["n_null"]:
            name, rises = profiles["null direction"]["name"], rise["null direction"]
            yield rises < FLAT, f"{title}: {name} is null but costs {rises:.1e}"
            bounded = np.isfinite(tables.column(case, "cramer_rao"))
            is_null = tables.column(case, "null_part") > 0
            yield bool(np.all(bounded != is_null)), f"{title}: a null coefficient has a finite bound"
        n = case["n_params"] - case["n_null"]
        null, sloppy = np.array(case["singular_values"][n:]), case["singular_values"][n - 1]
        yield bool(np.all(null < 1e-3 * sloppy)), f"{title}: no gap between null {null} and sloppy {sloppy:.1e}"

        # Company, more than little contribution, is the reason.
        alone, company = (np.mean(tables.column(case, key) < one_case.KNOWN) for key in ("alone", "posterior"))
        yield alone > 0.5, f"{title}: only {alone:.0%} of the coefficients would be known alone"
        yield company < 0.5 * alone, f"{title}: {company:.0%} are known in company, of {alone:.0%} alone"
        for axis in case["largest_sum"] if title == "suboff horizontal" else ():
            ratio = tables.cancellation_ratio(case, axis)
            yield ratio > CANCELS, f"{title}: the largest error of {axis} is only {ratio:.1f} times the sum"
