"""What is known of the coefficients when the nine assumptions of section 7.3 are relaxed?

Question: the thesis calls each of them unrealistic and considers none of their effects: added masses, propulsion, mass
and its centre, neutral buoyancy, zeros and the start are taken as known. What does each cost if it is wrong and kept,
and what if it is inferred? And does a wrong added mass, held, lead to another set that is as good?
Claim: kept while they are wrong, propulsion, mechanics, buoyancy, start and current make intervals too narrow, and
mechanics and all together hold less than two thirds of the coefficients in 90 % intervals. With everything inferred
(every coefficient, body, thrust, trim, start, current and clock) the posterior converges within five minutes, and 90 %
intervals hold 88 to 92 % of the coefficients of a hundred boats of the prior, of which fewer are known. An added mass
that is held at nothing or at half its value leaves a set that no manoeuvre tells from the truth, to 1e-9 m.
Cost: ten minutes on two cores, half of it for one posterior.

Assumption by assumption coverage is of a thousand boats, linear about that of the file by exact sensitivities; all
together are a hundred boats that are flown. Noise, unmodelled forces, worse guesses and bounds have studies of their
own: `posteriors`, `disturbed`, `guesses`, `sampler`.
"""

from functools import partial
from operator import itemgetter

import numpy as np

from assumptions import plots
from assumptions.trials import ASSUMPTIONS, expected, one, other_sets, sampled
from bayesub.report.markdown import columns

VEHICLE, SEED = "npsauv", 73
N_LINEAR, N_BOATS, N_KEPT, MAX_STEPS = 1000, 100, 10, 6000
# Quick: half a minute, because trials of six degrees of freedom are fitted.
QUICK = 100, 1, 0, 0
FACTORS = (0.0, 0.5, 0.8, 1.2)  # of the true Yvdot, at which it is held
FIGURES = {
    "assumptions": "Left: coefficients that a fit says are known to 10 %, with an assumption kept while it is wrong "
    "and with it inferred. Right: how often its 90 % intervals hold the truth. A fit that keeps a wrong assumption "
    "knows more, and what it knows is not so.",
}
ANSWER = """
Kept while they are wrong, all at once, the assumptions make {all/kept/known; .0f} of {all/n_compared; .0f} coefficients
look known to 10 %, in 90 % intervals that hold {flown/kept/inside; mean; percent; .0f} % of all; inferred,
{all/relaxed/known; .0f}, in intervals that hold {flown/relaxed/inside; mean; percent; .1f} %.
"""


def compute(run):
    """Every assumption by sensitivities, all together by flights and a posterior, and other sets of the null space."""
    n_linear, n_boats, n_kept, max_steps = QUICK if run.quick else (N_LINEAR, N_BOATS, N_KEPT, MAX_STEPS)
    some = ("none", "all") if run.quick else ASSUMPTIONS
    numbers = run.parts("expected", {name: partial(expected, VEHICLE, name, n_linear, SEED) for name in some})
    numbers["other_sets"] = other_sets(VEHICLE, "Yvdot", FACTORS)
    if max_steps:
        run.progress.stage("sample with all relaxed")
        numbers["sampled"] = run.part("sampled", partial(sampled, VEHICLE, SEED, max_steps))
    run.progress.stage("boats")
    relaxed = run.repeat("relaxed", partial(one, VEHICLE, "all", SEED, ("relaxed",)), n_boats)
    kept = run.repeat("kept", partial(one, VEHICLE, "all", SEED, ("kept",)), n_kept) if n_kept else []
    numbers["flown"] = {
        key: {name: [boat[key][name] for boat in boats] for name in ("inside", "known")}
        for key, boats in (("relaxed", relaxed), ("kept", kept))
        if boats
    }
    return numbers


def of_assumptions(numbers):
    """Those that were judged, in their order."""
    return {name: numbers[name] for name in ASSUMPTIONS if name in numbers}


def draw(run, numbers):
    """What is known, and how often it is so."""
    plots.draw(run.figure("assumptions"), of_assumptions(numbers))
    run.page(tables(numbers))


def tables(numbers):
    """Assumption by assumption, all together, and other sets."""
    rows = [{"name": name, "says": ASSUMPTIONS[name].says} | r for name, r in of_assumptions(numbers).items()]
    cells = {
        "assumption of section 7.3": itemgetter("says"),
        "parameters if inferred": itemgetter("n_parameters"),
        "known to 10 %, kept": lambda r: f"{r['kept']['known']} of {r['n_compared']}",
        "in its 90 % intervals": lambda r: f"{r['kept']['coverage']:.0%}",
        "known, inferred": lambda r: r["relaxed"]["known"],
        "in 90 %": lambda r: f"{r['relaxed']['coverage']:.0%}",
    }
    yield from columns(rows, cells)
    for key, words in (("relaxed", "all inferred"), ("kept", "all kept while they are wrong")):
        if key in numbers["flown"]:
            r = numbers["flown"][key]
            error = np.std(r["inside"]) / np.sqrt(len(r["inside"]))
            held = f"{np.mean(r['inside']):.1%} ± {error:.1%}"
            yield f"\n{len(r['inside'])} boats that are flown, {words}: 90 % intervals hold {held}"
            yield f"of the coefficients, of which {np.mean(r['known']):.0f} look known to 10 %."
    if "sampled" in numbers:
        r = numbers["sampled"]
        yield f"\nThe posterior of one of them, {r['n_parameters']} parameters, takes {r['seconds']:.0f} s and has"
        yield "converged." if r["converged"] else f"not converged: {'; '.join(r['shortcomings'])}."
    sets = ", ".join(f"{factor} of its value {off:.0e} m" for factor, off in numbers["other_sets"].items())
    yield f"\nYvdot held, the others moved along null vectors; off ten unseen manoeuvres by at most: {sets}."


def claims(numbers):
    """Too narrow if kept, honest if inferred, and not unique."""
    for factor, off in numbers["other_sets"].items():
        yield off < 1e-9, f"Yvdot held at {factor} of its value: {off:.1e} m off"
    for name, r in of_assumptions(numbers).items():
        wrong = name not in ("none", "zeros", "added masses", "clock")
        yield not wrong or r["kept"]["coverage"] < 0.88, f"{name}: kept, intervals hold {r['kept']['coverage']:.0%}"
        if name in ("mechanics", "all"):
            yield r["kept"]["coverage"] < 2.0 / 3.0, f"{name}: kept, intervals hold {r['kept']['coverage']:.0%}"
    if "sampled" in numbers:
        r = numbers["sampled"]
        yield r["converged"], f"all: {'; '.join(r['shortcomings'])}"
        yield r["seconds"] < 300.0, f"all: sampled for {r['seconds']:.0f} s"
        inside = np.mean(numbers["flown"]["relaxed"]["inside"])
        yield 0.88 <= inside <= 0.92, f"all: 90 % intervals hold {inside:.1%}"
