"""The page of :mod:`studies/disturbed`."""

from collections.abc import Iterator
from operator import itemgetter

import numpy as np

from bayesub.report import markdown
from disturbed import plots
from thesis import calibration

LIKELIHOODS = ("noise only", "slow noise", "filter error", "histories", "inferred")
HONEST = ("histories", "inferred")
HELD, FALSE_ALARMS = (0.87, 0.93), 0.01
STRANGERS, OF_STRANGERS = "strangers", (0.85, 0.95)  # boats of another simulator, and what 90 % intervals hold of them
OF_SAMPLING = ("n_params", "seconds", "simulations", "jacobians", "work_per_effective_sample", "acceptance")
MOST_WORK = 60.0  # simulations an effective sample
_ERRORS = 3.0  # standard errors by which coverage may miss, where boats are few
_RIGHT = 0.85  # coverage from which widths of intervals are compared

CAPTION = """
Boats from the prior, by sensors and disturbance (share of the hull's force): how often central intervals hold the true
coefficients (mean over boats and its standard error), the median posterior sd over that of the prior, how many
estimates failed, and coefficients whose ranks leave the band that uniform ranks leave once in a hundred. Noise only and
slow noise (`ar1` fitted to the residuals) are Laplace approximations. Histories are integrated out with the process
known, or inferred from a guess that is good to a factor of 2.7; the filter knows the process. In a current both are
Laplace approximations of the marginal posterior, from which importance sampling had few effective draws.
"""


def summaries(trials: dict[str, list[dict]], shares, rng: np.random.Generator) -> dict:
    """By group of boats: share -> likelihood -> what its intervals hold, and ranks of all shares together."""
    numbers = {}
    for name, results in trials.items():
        present = [likelihood for likelihood in LIKELIHOODS if any(likelihood in r for r in results)]
        groups = {f"{share:g}": [r for r in results if r["share"] == share] for share in shares}
        groups = {share: group for share, group in groups.items() if group} or {"": results}
        numbers[name] = {
            "n_boats": len(results),
            "boats_drawn_again": sum(r["boats_drawn_again"] for r in results),
            "shares": {
                share: {
                    one: held([r[one] for r in group if one in r]) for one in present if any(one in r for r in group)
                }
                for share, group in groups.items()
            },
            "ranks": {one: ranks([r[one] for r in results if one in r], rng) for one in present},
        }
    return numbers


def held(results: list[dict]) -> dict:
    """Coverage, widths and failures of the estimates of several boats."""
    of_boats = [calibration.coverage(r["rank"]) for r in results]
    coverage = {}
    for level in calibration.INTERVALS:
        shares = np.array([one[level] for one in of_boats])
        error = float(shares.std(ddof=1) / np.sqrt(len(shares))) if len(shares) > 1 else float("nan")
        coverage[f"{100 * level:g} %"] = {"mean": float(shares.mean()), "error": error}
    return {
        "n_boats": len(results),
        "coverage": coverage,
        "sd": float(np.median([r["sd"] for r in results])),
        "largest_error": float(np.max(np.abs([r["error"] for r in results]))),
        "n_failed": sum(r["failed"] for r in results),
        "seconds": float(np.median([r["seconds"] for r in results])),
    }


def ranks(results: list[dict], rng: np.random.Generator) -> dict:
    """Whether the ranks of every coefficient are uniform, and how all are distributed."""
    by_coefficient = np.array([r["rank"] for r in results]).T
    judged = calibration.uniformity({str(k): row for k, row in enumerate(by_coefficient)}, FALSE_ALARMS, rng)
    outside = [not quantity["inside"] for quantity in judged["quantities"].values()]
    counts = np.histogram(by_coefficient, bins=plots.BINS, range=(0, calibration.N_DRAWS + 1))[0]
    return {"n_outside": int(np.sum(outside)), "n_coefficients": len(outside), "histogram": counts.tolist()}


def rows(numbers: dict) -> Iterator[dict]:
    """What is held, a group of boats, share and likelihood at a time."""
    for name, group in numbers.items():
        for share, likelihoods in group["shares"].items():
            for likelihood, result in likelihoods.items():
                yield result | {"group": name, "share": share, "likelihood": likelihood}


SAMPLED = """
Strangers are boats of the prior that another simulator flies, which has no code of this one. Their logs are sampled;
sds and correlation time of the forces are inferred. How many boats converged, and the medians of all boats: parameters,
seconds on one core, and simulations an effective sample of the worst parameter.
"""
COST = """
Sampling of one trial of the log with a known process: knots on each of three axes, parameters in all, seconds on one
core, and simulations an effective sample of the worst parameter, a Jacobian counted as those that take as long.
"""


def draw(run, numbers: dict) -> None:
    """The figure and the tables."""
    costs, sampled, numbers = numbers["cost"], numbers.get("sampled", {}), numbers["trials"]
    plots.draw(run.figure("disturbed"), numbers)
    cells = {
        "sensors, or what is wrong": itemgetter("group"),
        "disturbance": lambda r: f"{100 * float(r['share']):g} %" if r["share"] else "",
        "likelihood": itemgetter("likelihood"),
        "boats": itemgetter("n_boats"),
    }
    for level in calibration.INTERVALS:
        cells[f"{100 * level:g} %"] = lambda r, key=f"{100 * level:g} %": covered(r["coverage"][key])
    cells |= {
        "largest error (sd)": lambda r: f"{r['largest_error']:.1f}",
        "posterior over prior sd": lambda r: f"{r['sd']:.2f}",
        "failed": itemgetter("n_failed"),
        "seconds": lambda r: f"{r['seconds']:.1f}",
    }
    of_ranks = {
        "sensors, or what is wrong": itemgetter("group"),
        "likelihood": itemgetter("likelihood"),
        "coefficients outside the band of ranks": lambda r: f"{r['n_outside']} of {r['n_coefficients']}",
    }
    lines = [
        result | {"group": name, "likelihood": likelihood}
        for name, group in numbers.items()
        for likelihood, result in group["ranks"].items()
    ]
    of_cost = {
        "knots": itemgetter("n_knots"),
        "parameters": lambda r: f"{r['n_params']:.0f}",
        "converged": lambda r: "yes" if r["converged"] else "no",
        "seconds": lambda r: f"{r['seconds']:.0f}",
        "simulations": lambda r: f"{r['simulations']:.0f}",
        "Jacobians": lambda r: f"{r['jacobians']:.0f}",
        "simulations an effective sample": lambda r: f"{r['work_per_effective_sample']:.0f}",
        "acceptance": lambda r: f"{r['acceptance']:.0%}",
    }
    of_boats = {
        "likelihood": itemgetter("likelihood"),
        "boats": itemgetter("n_boats"),
        "converged": itemgetter("n_converged"),
    }
    of_boats |= {title: cell for title, cell in of_cost.items() if title not in ("knots", "converged")}
    strangers = [result | {"likelihood": name} for name, result in sampled.items()]
    run.page([CAPTION, *markdown.columns(rows(numbers), cells), "", *markdown.columns(lines, of_ranks)])
    run.page([SAMPLED, *markdown.columns(strangers, of_boats)] if strangers else [])
    run.page([COST, *markdown.columns(costs, of_cost)])


def sampling(results: list[dict]) -> dict[str, dict]:
    """Likelihood -> how many boats converged, and the medians of what sampling them took."""
    numbers = {}
    for name in (likelihood for likelihood in LIKELIHOODS if likelihood in results[0]):
        costs = {key: [r[name][key] for r in results] for key in OF_SAMPLING}
        converged = [r[name]["converged"] for r in results]
        numbers[name] = {"n_boats": len(results), "n_converged": sum(converged)}
        numbers[name] |= {key: float(np.median(values)) for key, values in costs.items()}
    return numbers


def covered(coverage: dict) -> str:
    """Mean and standard error in words."""
    return f"{coverage['mean']:.0%}" + ("" if coverage["error"] is None else f" +- {coverage['error']:.1%}")


def claims(numbers: dict) -> Iterator[tuple[bool, str]]:
    """Intervals with histories hold what they say, no search fails, and they are no wider than need be."""
    for r in numbers["cost"]:
        yield r["converged"], f"{r['n_knots']} knots: not converged"
        work = r["work_per_effective_sample"]
        yield work <= MOST_WORK, f"{r['n_knots']} knots: {work:.0f} simulations an effective sample"
    if "sampled" in numbers:  # without forces a misfit may mix slowly (acceptance 18 % for the second boat)
        n_boats, n_converged = (numbers["sampled"]["inferred"][key] for key in ("n_boats", "n_converged"))
        yield n_converged == n_boats, f"{STRANGERS}: {n_converged} of {n_boats} converged with inferred forces"
    numbers = numbers["trials"]
    for r in rows(numbers):
        if r["likelihood"] not in HONEST or r["group"] not in ("log", "track", STRANGERS):
            continue
        coverage = r["coverage"]["90 %"]
        low, high = OF_STRANGERS if r["group"] == STRANGERS else HELD
        miss = max(low - coverage["mean"], coverage["mean"] - high, 0.0)
        what = f"{r['group']}, {r['share']}, {r['likelihood']}"
        error = np.inf if coverage["error"] is None else coverage["error"]
        yield not miss > _ERRORS * error, f"{what}: 90 % intervals hold {covered(coverage)}"
        yield not r["n_failed"], f"{what}: {r['n_failed']} of {r['n_boats']} failed"
    for name in ("log", "track"):
        for share, results in numbers[name]["shares"].items():
            slow, honest = results["slow noise"], results.get("histories")
            if honest and slow["coverage"]["90 %"]["mean"] >= _RIGHT:
                ratio = honest["sd"] / slow["sd"]
                yield ratio <= 1.1, f"{name}, {share}: {ratio:.2f} times as wide as slow noise, which is right"
