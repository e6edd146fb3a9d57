"""Does an independent sampler with exact gradients find the same posteriors?

Question: the ensemble sampler straightens, whitens and proposes by rules of its own. Does NUTS, which shares the log
posterior and nothing of these rules, find the same means, standard deviations and correlations in all nine cases?
Claim: yes, within Monte Carlo error, wherever NUTS itself converges.
Cost: a quarter of an hour of one core, for our side only. What NUTS drew in four hours is kept in studies/cross_check
as moments with their errors, and the log posterior at its mean, which must be that of today to the digits of a sum;
with that folder renamed NUTS samples all cases again. A killed run continues with --resume; finished cases stay.

The ensemble sampler goes on to many more draws than it needs to converge: what is left is the Monte Carlo error of
NUTS, and a few draws that are held for long no longer decide whether the two agree.
"""

import json
from dataclasses import replace
from functools import partial
from itertools import product
from operator import itemgetter
from pathlib import Path

import numpy as np

import bayesub as bs
from bayesub.inference.sampling import CrossCheck
from bayesub.inference.sampling.moments import Moments
from bayesub.inference.sampling.nuts import compare as compared
from bayesub.inference.sampling.nuts import sample_nuts
from bayesub.inference.sampling.posterior import STANDARD
from bayesub.report import markdown
from bayesub.report.plots import checks
from thesis import cases

N_DRAWS, N_TUNE, N_CHAINS = 1000, 300, 4  # of each chain of NUTS, and their number
ESS = 10_000  # of the ensemble sampler
# The longest first, so that no core is left waiting in the end.
CASES = {f"{vehicle} {manoeuvre}": None for manoeuvre, vehicle in product(cases.MANOEUVRES[::-1], cases.VEHICLES)}
SAMPLERS = "ours", "NUTS"
KEPT = Path(__file__).with_suffix("")  # a file of moments a case, and what they have cost
SAME = 1e-9  # log posteriors of one density, relative to their size
# Quick: half a minute, because NUTS compiles its own programs.
QUICK = {"suboff horizontal": ("Xuu", "Yuv", "Nuv")}  # free coefficients
QUICK_DRAWS, QUICK_TUNE = 60, 20
FIGURES = {
    "*": "{}: differences of all means, sds and correlations by the two samplers in Monte Carlo standard errors, as "
    "histograms with the normal curve that equal posteriors make, and the limit that holds all in 99 of 100 "
    "comparisons.",
}
ANSWER = """
The largest difference of a mean is {*/check/mean_z; size; max; .1f} Monte Carlo standard errors, of an sd
{*/check/sd_z; size; max; .1f}, of a correlation {*/check/correlation_z; size; max; .1f}. Too many trajectories of NUTS
diverge in {*/check/divergent; above 0.002; count; .0f} of {*/check/divergent; count; .0f} cases; in the others it has
converged, and agrees. An effective sample of the worst parameter costs {*/per_sample/ours; min; .1f} to
{*/per_sample/ours; max; .1f} simulations here and {*/per_sample/NUTS; min; .0f} to {*/per_sample/NUTS; max; .0f} by
NUTS, a Jacobian counted as the simulations that take as long.
"""


def compute(run):
    """Both samplers on every case, and the differences of their moments."""
    selection = QUICK if run.quick else CASES
    n_draws, n_tune, ess = (QUICK_DRAWS, QUICK_TUNE, STANDARD.ess) if run.quick else (N_DRAWS, N_TUNE, ESS)
    kept = {} if run.quick or not KEPT.is_dir() else kept_moments()
    works = {
        case: partial(by_nuts, case, free, n_draws, n_tune) for case, free in selection.items() if case not in kept
    }
    for case, counts in (run.parts("NUTS", works) if works else {}).items():
        kept[case] = counts, run.load_arrays(f"NUTS_{case.replace(' ', '_')}")
    return run.parts(
        "cases", {case: partial(compare, case, free, ess, *kept[case]) for case, free in selection.items()}
    )


def kept_moments():
    """Case -> what NUTS has cost, and the moments of what it has drawn, in the run that is kept."""
    counts = json.loads((KEPT / "nuts.json").read_text(encoding="utf-8"))
    return {case: (of, dict(np.load(KEPT / f"{case.replace(' ', '_')}.npz"))) for case, of in counts.items()}


def by_nuts(case, free, n_draws, n_tune):
    """What NUTS has cost, and the moments of what it has drawn."""
    problem, rng = cases.trial(*case.split(), free=free), np.random.default_rng([cases.SEED, 1])
    chain, counts = sample_nuts(problem, rng=rng, n_draws=n_draws, n_tune=n_tune, n_chains=N_CHAINS)
    moments = Moments.of_chain(chain)
    return counts | {"log_prob_at_mean": float(problem.log_prob(moments.means)[0])}, moments.arrays()


def compare(case, free, ess, counts, arrays):
    """The posterior of a case by both samplers."""
    moments, counts = Moments.restored(arrays), dict(counts)
    problem, rng = cases.trial(*case.split(), free=free), np.random.default_rng(cases.SEED)
    posterior = bs.sample(problem, rng=rng, criteria=replace(STANDARD, ess=ess))
    then, now = counts.pop("log_prob_at_mean"), float(problem.log_prob(moments.means)[0])
    check = compared(posterior, moments, **counts)
    return {
        "log_prob_at_mean": [then, now],
        "n_params": problem.n_params,
        "evaluations": posterior.evaluations,
        "seconds": posterior.seconds,
        "min_ess": float(posterior.bulk_ess.min()),
        "shortcomings": posterior.shortcomings,
        "per_sample": dict(zip(SAMPLERS, (effort.per_effective_sample for effort in check.efforts), strict=True)),
        "check": check.to_json(),
    }


def draw(run, numbers):
    """Both posteriors of each case, and a table with a row a case."""
    for case, result in numbers.items():
        checks.draw_cross_check(run.figure(case.replace(" ", "_")), CrossCheck.from_json(result["check"]))
    cells = {
        "case": itemgetter("name"),
        "parameters": itemgetter("n_params"),
        "largest difference of a mean (standard errors)": lambda r: f"{np.abs(r['mean_z']).max():.1f}",
        "of an sd": lambda r: f"{np.abs(r['sd_z']).max():.1f}",
        "of a correlation": lambda r: f"{np.abs(r['correlation_z']).max():.1f}",
        "allowed": lambda r: f"{r['threshold']:.1f}",
        "verdict": itemgetter("verdict"),
        "NUTS: R-hat": lambda r: f"{r['rhat']:.4f}",
        "ESS": lambda r: f"{r['ess']:.0f}",
        "divergences": itemgetter("divergences"),
    }
    rows = [r | r["check"] for r in markdown.named(numbers)]
    of_cost = {
        "case": itemgetter("name"),
        "sampler": itemgetter("sampler"),
        "simulations": itemgetter("simulations"),
        "Jacobians": itemgetter("jacobians"),
        "price of a Jacobian (simulations)": lambda r: f"{r['jacobian_price']:.0f}",
        "effective samples of the worst parameter": lambda r: f"{r['ess']:.0f}",
        "simulations an effective sample": lambda r: f"{r['each']:.3g}",
        "seconds": lambda r: f"{r['seconds']:.0f}",
    }
    efforts = [
        effort | {"name": row["name"], "sampler": sampler, "each": row["per_sample"][sampler]}
        for row in rows
        for sampler, effort in zip(SAMPLERS, row["efforts"], strict=True)
    ]
    run.page([*markdown.columns(rows, cells), "", *markdown.columns(efforts, of_cost)])


def claims(numbers):
    """The ensemble sampler converges, and NUTS does not disagree."""
    for case, result in numbers.items():
        shortcomings = result.get("shortcomings", ())
        yield not shortcomings, f"{case}: {'; '.join(shortcomings)}"
        then, now = result["log_prob_at_mean"]
        yield abs(now - then) < SAME * abs(then), f"{case}: NUTS sampled another density, {then} at its mean, now {now}"
        yield result["check"]["verdict"] != "disagree", f"{case}: {result['check']['sentence']}"
