"""What does the same posterior cost by samplers that users reach for?

Question: how many simulations and seconds to 400 effective samples of the worst coefficient, with chains that agree, by
nutpie on exact gradients and by nested sampling with dynesty on the likelihood, beside this sampler?
Claim: where another engine gets there it finds the same posterior, and none gets there for as few simulations. With
three free coefficients one does, with all of a sub-problem none.
Cost: three quarters of an hour on two cores.

The engines work as their manuals say, in the standard normal coordinates of the prior, until a budget is spent. A
Jacobian counts as the simulations that take as long. Tracks and priors are those of the study of the sampler, normal;
with few free coefficients the others are known.
"""

from functools import partial

from other_engines import plots, samplers
from thesis import sampler_cost

SEED = sampler_cost.SEED
GRADIENTS, CALLS = 20_000, 60_000  # of nutpie, of dynesty
LOW_RANK = "nutpie, low rank"
ESS = 10_000  # of ours, with which draws are compared
THREE = "Xuu", "Yuv", "Nuv"
SEVEN = *THREE, "Yur", "Nur", "Yuu_dr", "Nuu_dr"
# Problem -> vehicle and manoeuvre, and free coefficients; None are all of the sub-problem.
PROBLEMS = {
    "suboff horizontal, three": ("suboff horizontal", THREE),
    "suboff horizontal, seven": ("suboff horizontal", SEVEN),
    "suboff horizontal": ("suboff horizontal", None),
    "auv690 horizontal": ("auv690 horizontal", None),
    "suboff coupled": ("suboff coupled", None),
}
QUICK = ("suboff horizontal, three",)
# Quick: half a minute, because NUTS compiles its own programs and every engine spends a budget.
QUICK_GRADIENTS, QUICK_CALLS, QUICK_ESS = 1500, 4000, 1000
FIGURES = {
    "engines": "Simulations (left) and seconds (right) to 400 effective samples of the worst coefficient with chains "
    "that agree; a Jacobian counts as the simulations that take as long. Arrows have not come so far when their budget "
    "was spent: it would take at least that.",
}
ANSWER = """
This sampler needs {*/ours/to_target/1; min; .0f} to {*/ours/to_target/1; max; .0f} simulations and
{*/ours/to_target/0; min; .1f} to {*/ours/to_target/0; max; .1f} s, all counted. With three free coefficients nutpie
with masses of low rank gets there too, for {suboff horizontal, three/nutpie, low rank/to_target/1; .0f} simulations and
in {suboff horizontal, three/nutpie, low rank/to_target/0; .0f} s, where this sampler takes
{suboff horizontal, three/ours/to_target/0; .1f} s.
"""
GLOSSARY = "booth"


def engines(quick: bool) -> dict:
    """Name -> the engine, its budget, and its settings."""
    gradients, calls = (QUICK_GRADIENTS, QUICK_CALLS) if quick else (GRADIENTS, CALLS)
    return {
        "nutpie": (samplers.nutpie_draws, gradients, {}),
        LOW_RANK: (samplers.nutpie_draws, gradients, {"low_rank_modified_mass_matrix": True}),
        "dynesty": (samplers.dynesty_draws, calls, {}),
    }


def compute(run):
    """Every problem by every engine."""
    problems = QUICK if run.quick else PROBLEMS
    return run.parts("problems", {name: partial(compare, *PROBLEMS[name], run.quick) for name in problems})


def compare(case, free, quick):
    """One problem by this sampler and by the others."""
    problem = sampler_cost.pose(*case.split(), "normal", free=free)
    return samplers.compared(problem, engines(quick), SEED, QUICK_ESS if quick else ESS)


def draw(run, numbers):
    """Costs by problem and engine, and a table with a row each."""
    plots.draw(run.figure("engines"), numbers)
    run.page(samplers.table(numbers))


def claims(numbers):
    """Engines that get there agree, for more simulations; one does so with three coefficients, none with all."""
    for problem, results in numbers.items():
        ours, (_, free) = results[samplers.OURS], PROBLEMS[problem]
        yield ours["to_target"] is not None, f"{problem}: ours has not converged: {ours['reached']}"
        for name, cost in samplers.rivals(results).items():
            there = cost["to_target"] is not None
            if there and ours["to_target"] is not None:
                yield cost["verdict"] != "disagree", f"{problem}, {name}: {cost['sentence']}"
                work = cost["to_target"][1]
                yield work > ours["to_target"][1], f"{problem}, {name}: {work:.0f} simulations to 400 effective samples"
            if free is None:
                yield not there, f"{problem}, {name}: got there too"
            elif (free, name, cost["budget"]) == (THREE, LOW_RANK, GRADIENTS):
                yield there, f"{problem}, {name}: has not got there: {cost['reached']}"
