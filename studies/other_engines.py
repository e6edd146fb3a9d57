"""What does the same posterior cost by samplers that users reach for?

Question: how many simulations and seconds to 400 effective samples of the worst coefficient, with chains that agree, by
nutpie on exact gradients and by nested sampling with dynesty on the likelihood, beside this sampler?
Claim: where another engine gets there it finds the same posterior, and none gets there for as few simulations.
Cost: a quarter of an hour of one core.

The engines work as their manuals say, in the standard normal coordinates of the prior, until a budget is spent. A
Jacobian counts as the simulations that take as long. Tracks and priors are those of the study of the sampler, normal.
"""

from functools import partial

from bayesub.thesis import other_engines, sampler_cost
from bayesub.thesis.plots import other_engines as plots

SEED = sampler_cost.SEED
GRADIENTS, CALLS = 20_000, 60_000  # of nutpie, of dynesty
ESS = 10_000  # of ours, with which draws are compared
PROBLEMS = dict.fromkeys(("suboff horizontal", "auv690 horizontal"))
QUICK = {"suboff horizontal": ("Xuu", "Yuv", "Nuv")}  # free coefficients
QUICK_GRADIENTS, QUICK_CALLS, QUICK_ESS = 4000, 8000, 2000
FIGURES = {
    "engines": "Simulations (left) and seconds (right) to 400 effective samples of the worst coefficient with chains "
    "that agree; a Jacobian counts as the simulations that take as long. Arrows have not come so far when their budget "
    "was spent: it would take at least that.",
}
ANSWER = """
This sampler needs {*/ours/to_target/1; min; .0f} to {*/ours/to_target/1; max; .0f} simulations and
{*/ours/to_target/0; min; .1f} to {*/ours/to_target/0; max; .1f} s, all counted.
"""
GLOSSARY = "booth"


def engines(quick: bool) -> dict:
    """Name -> the engine, its budget, and its settings."""
    gradients, calls = (QUICK_GRADIENTS, QUICK_CALLS) if quick else (GRADIENTS, CALLS)
    return {
        "nutpie": (other_engines.nutpie_draws, gradients, {}),
        "nutpie, low rank": (other_engines.nutpie_draws, gradients, {"low_rank_modified_mass_matrix": True}),
        "dynesty": (other_engines.dynesty_draws, calls, {}),
    }


def compute(run):
    """Every problem by every engine."""
    problems = QUICK if run.quick else PROBLEMS
    return run.parts("problems", {name: partial(compare, name, free, run.quick) for name, free in problems.items()})


def compare(name, free, quick):
    """One problem by this sampler and by the others."""
    problem = sampler_cost.pose(*name.split(), "normal", free=free)
    return other_engines.compared(problem, engines(quick), SEED, QUICK_ESS if quick else ESS)


def draw(run, numbers):
    """Costs by problem and engine, and a table with a row each."""
    plots.draw(run.figure("engines"), numbers)
    run.page(other_engines.table(numbers))


def claims(numbers):
    """Engines that get there agree with ours, for more simulations."""
    for problem, results in numbers.items():
        ours = results[other_engines.OURS]
        yield ours["to_target"] is not None, f"{problem}: ours has not converged: {ours['reached']}"
        for name, cost in other_engines.rivals(results).items():
            if cost["to_target"] is not None and ours["to_target"] is not None:
                yield cost["verdict"] != "disagree", f"{problem}, {name}: {cost['sentence']}"
                work = cost["to_target"][1]
                yield work > ours["to_target"][1], f"{problem}, {name}: {work:.0f} simulations to 400 effective samples"
