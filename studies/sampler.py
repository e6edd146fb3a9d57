"""How many simulations does a posterior cost, with this sampler and with the moves that emcee comes with?

Question: what does an effective sample of the worst known coefficient cost on each vehicle and manoeuvre?
Claim: every problem converges, with a 25 % normal prior for at most 4 simulations an effective sample in a plane and 10
in six degrees of freedom, with bounds or rounded readings for at most 30. With normal priors emcee's stretch move and
its differential evolution have not converged when their simulations are spent. Directions that the data do not see are
sampled, and have the prior's spread.
Cost: a quarter of an hour on two cores. A killed run continues with --resume after the last problem.

Tracks have position noise of 0.5 m on a boat of suboff's length, in proportion to the length, and attitude noise of
0.1 degrees; sampling intervals scale with length over speed. The rivals do what a user would: they work in coordinates
in which the prior is standard normal and start from draws of it; ours finds the mode and learns a surrogate first,
which counts among its simulations, a Jacobian as the simulations that take as long. Of a chain that has not converged
the effective sample size is a guess, and too large. Motions with rounded readings are flown and fitted with steps of an
eighth of those that the track needs: with these the log likelihood of auv690 jumps where the sign of a velocity changes
a step later, and walkers are held there.
"""

from functools import partial
from itertools import product
from operator import itemgetter

import emcee
import numpy as np

import bayesub as bs
from bayesub.report import markdown
from sampler import plots
from thesis import cases, sampler_cost

SEED = sampler_cost.SEED
RIVALS = {
    "stretch": lambda: emcee.moves.StretchMove(),
    "DE and snooker": lambda: [(emcee.moves.DEMove(), 0.8), (emcee.moves.DESnookerMove(), 0.2)],
}
OURS = "ours"
MAX_STEPS = 6000
BUDGET, QUICK_BUDGET = 60_000, 4000  # simulations of a rival
PLANAR, COUPLED, HARD = 4.0, 10.0, 30.0  # simulations an effective sample with normal priors, and with all else
# The largest of some fifty departures stays below 3.5 standard errors, which are themselves optimistic.
MOST = 5.25
PROBLEMS = [(*case, variant) for variant in sampler_cost.VARIANTS for case in product(cases.VEHICLES, cases.MANOEUVRES)]
QUICK = [("suboff", "vertical", "normal")]
FIGURES = {
    "sampler": "Simulations for one effective sample of the worst known coefficient, by problem. Filled marks have "
    "converged. Arrows are chains that have not: an effective size of such a chain is a guess, and their cost is at "
    "least where the arrow begins. Bars are what ours may cost by the claim. Normal, uniform: the prior; rounded: "
    "readings rounded as the thesis's.",
}
ANSWER = """
An effective sample of the worst known coefficient costs {* horizontal normal/ours/per_sample & * vertical
normal/ours/per_sample; min; .1f} to {* horizontal normal/ours/per_sample & * vertical normal/ours/per_sample; max;
.1f} simulations on planar manoeuvres and {* coupled normal/ours/per_sample; min; .0f} to {* coupled
normal/ours/per_sample; max; .0f} on coupled ones. emcee's own moves have not converged in any case when 60,000
simulations are spent.
"""
GLOSSARY = "booth"


def compute(run):
    """Every problem by this sampler, and those with a normal prior by its rivals."""
    problems, budget = (QUICK, QUICK_BUDGET) if run.quick else (PROBLEMS, BUDGET)
    works = {" ".join(problem): partial(compare, n, problem, budget) for n, problem in enumerate(problems)}
    return run.parts("problems", works)


def compare(number, problem, budget):
    """What this sampler and its rivals make of one problem."""
    posed = sampler_cost.pose(*problem)
    posterior = bs.sample(posed, rng=np.random.default_rng([SEED, number]), max_steps=MAX_STEPS)
    result = {"n_params": posed.n_params}
    result[OURS] = sampler_cost.cost(posterior) | {"unseen": sampler_cost.unseen(posed, posterior)}
    if problem[2] == "normal":
        for name, moves in RIVALS.items():
            rng = np.random.default_rng([SEED, number])
            result[name] = sampler_cost.cost(sampler_cost.rival(sampler_cost.pose(*problem), moves, rng, budget))
    return result


def draw(run, numbers):
    """Costs by problem and sampler, and a table with a row each."""
    samplers = (OURS, *RIVALS)
    plots.draw(run.figure("sampler"), numbers, samplers, {problem: goal(problem) for problem in numbers})
    cells = {
        "problem": itemgetter("problem"),
        "parameters": itemgetter("n_params"),
        "sampler": itemgetter("sampler"),
        "simulations an effective sample": lambda r: f"{'' if r['converged'] else 'at least '}{r['per_sample']:.3g}",
        "worst": itemgetter("worst"),
        "seconds": lambda r: f"{'' if r['converged'] else 'NOT CONVERGED after '}{r['seconds']:.0f}",
        "of simulations, s": lambda r: f"{r['simulation_seconds']:.0f}",
        "longest tau": lambda r: f"{r['tau']:.0f}",
        "R-hat": lambda r: f"{r['rhat']:.4f}",
    }
    rows = [
        {"problem": problem, "n_params": result["n_params"], "sampler": sampler} | result[sampler]
        for problem, result in numbers.items()
        for sampler in samplers
        if sampler in result
    ]
    run.page(markdown.columns(rows, cells))


def goal(problem):
    """What an effective sample of a problem may cost, simulations."""
    if not problem.endswith("normal"):
        return HARD
    return COUPLED if "coupled" in problem else PLANAR


def claims(numbers):
    """All problems converge within their goal, rivals do not; unseen directions keep the prior."""
    for problem, result in numbers.items():
        ours, most = result[OURS], goal(problem)
        yield ours["converged"], f"{problem}: has not converged"
        yield ours["per_sample"] <= most, f"{problem}: {ours['per_sample']:.1f} simulations an effective sample"
        for name in RIVALS:
            if name in result:
                yield not result[name]["converged"], f"{problem}: {name} has converged too"
        if ours["converged"] and ours["unseen"] is not None:
            departure = ours["unseen"]["departure"]
            sentence = f"{problem}: unseen directions depart from their prior by {departure:.1f} standard errors"
            yield departure < MOST, sentence
