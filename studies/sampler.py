"""How many simulations does a posterior cost, with this sampler and with the moves that emcee comes with?

Question: what does an effective sample of the worst known coefficient cost on each vehicle and manoeuvre?
Claim: with a 25 % normal prior every planar problem converges, for at most 50 simulations an effective sample, while
emcee's stretch move and its differential evolution have not converged when their simulations are spent. Directions that
the data do not see are sampled, and have the prior's spread.
Cost: about an hour on two cores. A killed run continues with --resume after the last problem.

Tracks have position noise of 0.5 m on a boat of suboff's length, in proportion to the length, and attitude noise of
0.1 degrees; sampling intervals scale with length over speed. The rivals do what a user would: they work in coordinates
in which the prior is standard normal and start from draws of it; ours finds the mode and learns a surrogate first,
which counts among its simulations. Of a chain that has not converged the effective sample size is a guess, and too
large.
"""

import json
import time
from itertools import product

import emcee
import numpy as np

import bayesub as bs
from bayesub.checks import convergence
from bayesub.io.atomic import write_text
from bayesub.model.coefficients import NAMES, SUBPROBLEMS
from bayesub.plots import style
from bayesub.report.markdown import table
from bayesub.sampling import Posterior

SEED = 690
VEHICLES = ("suboff", "auv690", "npsauv")
MANOEUVRES = ("horizontal", "vertical", "coupled")
VARIANTS = ("normal", "uniform", "rounded")  # prior sd 25 %; prior within 75 %; thesis_rounding with a normal prior
RIVALS = {
    "stretch": lambda: emcee.moves.StretchMove(),
    "DE and snooker": lambda: [(emcee.moves.DEMove(), 0.8), (emcee.moves.DESnookerMove(), 0.2)],
}
OURS = "ours"
MAX_STEPS = 6000
BUDGET = 60_000  # simulations of a rival
POSITION_SD_M, ROUNDED_SD = 0.5, (0.001, 0.0001)  # on suboff; m/s and m/s^2
N_JACOBIANS = 12
UNSEEN = 0.01  # singular value, in prior sd: the data move the mean by as much, less than a standard error
GOAL = 50.0  # simulations an effective sample
COLOURS = {OURS: style.POSTERIOR, "stretch": style.SQP, "DE and snooker": style.LINEAR}


def run(folder, *, quick, progress):
    """Every problem and sampler; draws ``sampler.png`` and writes ``sampler.md``."""
    cases = (
        [("suboff", "vertical", "normal")]
        if quick
        else [(*case, variant) for variant in VARIANTS for case in product(VEHICLES, MANOEUVRES)]
    )
    budget = 4000 if quick else BUDGET
    progress.stage("problems")
    done = folder / "cases.json"
    numbers = json.loads(done.read_text()) if done.exists() else {}
    for n, case in enumerate(cases):
        if " ".join(case) in numbers:
            continue
        problem = make_problem(*case)
        posterior = bs.sample(problem, rng=np.random.default_rng([SEED, n]), max_steps=MAX_STEPS)
        result = {OURS: cost(posterior) | {"unseen": unseen(problem, posterior)}}
        if case[2] == "normal":
            for name, moves in RIVALS.items():
                result[name] = cost(rival(make_problem(*case), moves, np.random.default_rng([SEED, n]), budget))
        numbers[" ".join(case)] = {"n_params": problem.n_params} | result
        write_text(done, json.dumps(numbers))
        progress.update((n + 1) / len(cases), " ".join(case))
    for suffix in ("png", "pdf"):
        draw(folder / f"sampler.{suffix}", numbers)
    (folder / "sampler.md").write_text(tables(numbers))
    for case, result in numbers.items():
        check(case, result)
    return numbers


def make_problem(vehicle, manoeuvre, variant):
    """A record of the manoeuvre, and all coefficients of the sub-problem to be inferred from it."""
    boat, suboff = bs.load_vehicle(vehicle), bs.load_vehicle("suboff")
    flown = bs.load_manoeuvre(manoeuvre, boat)
    scale = boat.length_m / suboff.length_m
    interval = scale * suboff.speed_mps / boat.speed_mps
    sensors = bs.sensors.tracking_range(position_sd_m=scale * POSITION_SD_M, interval_s=interval)
    if variant == "rounded":
        velocity, acceleration = ROUNDED_SD
        sensors = bs.sensors.thesis_rounding(
            interval_s=interval, velocity_sd_mps=velocity, acceleration_sd_mps2=acceleration
        )
    record = bs.observe(bs.simulate(boat, flown), sensors, np.random.default_rng(SEED))
    prior = bs.priors.relative_uniform(0.75) if variant == "uniform" else bs.priors.relative_normal(0.25)
    return bs.Problem(boat, flown, record, free=SUBPROBLEMS.get(manoeuvre, NAMES), prior=prior)


def rival(problem, moves, rng, budget):
    """Four independent emcee ensembles of three walkers a parameter, in prior coordinates, from draws of the prior."""
    n_params, n_ensembles = problem.n_params, 4
    n_walkers = 4 * (1 + 3 * n_params // 4)
    n_steps = budget // (n_ensembles * n_walkers)
    watch = time.perf_counter()

    def log_prob(t):
        return problem.log_likelihood(problem.prior.parameters(t)) - 0.5 * np.einsum("ij,ij->i", t, t)

    chains, densities, accepted = [], [], 0.0
    for _ in range(n_ensembles):
        sampler = emcee.EnsembleSampler(n_walkers, n_params, log_prob, moves=moves(), vectorize=True)
        state = np.random.RandomState(rng.integers(2**32)).get_state()
        starts = emcee.State(finite_starts(log_prob, rng, n_walkers, n_params), random_state=state)
        sampler.run_mcmc(starts, n_steps)
        half = n_steps // 2
        chains.append(problem.prior.parameters(sampler.get_chain(discard=half)))
        densities.append(sampler.get_log_prob(discard=half))
        accepted += sampler.acceptance_fraction.mean() / n_ensembles
    return Posterior(
        names=problem.names,
        chain=np.array(chains),
        log_prob=np.array(densities),
        prior_mean=problem.prior.mean,
        prior_sd=problem.prior.sd,
        n_warmup=n_steps // 2,
        acceptance=accepted,
        evaluations=problem.evaluations,
        seconds=time.perf_counter() - watch,
        failures=dict(problem.failures),
    )


def finite_starts(log_prob, rng, n, n_params):
    """(n, n_params) draws of the prior whose simulation completes."""
    starts = np.empty((0, n_params))
    while len(starts) < n:
        t = rng.standard_normal((n, n_params))
        starts = np.concatenate([starts, t[np.isfinite(log_prob(t))]])
    return starts[:n]


def cost(posterior):
    """What a posterior cost and whether it can be used."""
    ess = posterior.bulk_ess
    worst = int(np.argmin(ess))
    return {
        "converged": posterior.converged,
        "evaluations": posterior.evaluations,
        "seconds": posterior.seconds,
        "ess": float(ess[worst]),
        "worst": posterior.names[worst],
        "per_sample": float(posterior.evaluations / ess[worst]),
        "tau": float(posterior.tau.max()),
        "rhat": float(posterior.rhat.max()),
        "acceptance": float(posterior.acceptance),
    }


def unseen(problem, posterior):
    """Number of directions that the data do not see, and the largest departure of mean and sd from the prior's.

    In Monte Carlo standard errors; None where the prior is not normal. They are what no Jacobian at a dozen draws sees.
    """
    if not isinstance(problem.prior, bs.priors.Normal):
        return None
    # At one point every motion that fits has directions which it alone does not see: take several.
    some = posterior.draws[:: len(posterior.draws) // N_JACOBIANS]
    jacobians = [problem.jacobian(parameters) * problem.prior.sd for parameters in some]
    _, s, vt = np.linalg.svd(np.concatenate(jacobians) / np.sqrt(len(some)), full_matrices=False)
    along = (posterior.chain - problem.prior.mean) / problem.prior.sd @ vt[s < UNSEEN].T
    if not along.shape[-1]:
        return {"n": 0, "departure": 0.0}
    squares = along**2 - 1.0
    departures = [
        np.abs(f.mean(axis=(0, 1, 2))) / f.std(axis=(0, 1, 2)) * np.sqrt(convergence.ess(f)) for f in (along, squares)
    ]
    return {"n": along.shape[-1], "departure": float(np.max(departures))}


def draw(path, numbers):
    """Simulations an effective sample by problem and sampler; open marks have not converged."""
    with style.figure(path, 9.0, 1.6 + 0.22 * len(numbers)) as figure:
        panel = figure.subplots()
        for row, result in enumerate(numbers.values()):
            for name, colour in COLOURS.items():
                if name in result:
                    fill = colour if result[name]["converged"] else "none"
                    panel.plot(result[name]["per_sample"], row, "o", ms=6, mec=colour, mfc=fill)
        panel.axvline(GOAL, color=style.PRIOR)
        panel.set_xscale("log")
        panel.set_yticks(range(len(numbers)), [f"{case} ({r['n_params']})" for case, r in numbers.items()], fontsize=8)
        panel.invert_yaxis()
        panel.set_xlabel(
            "simulations an effective sample of the worst known coefficient; open: not converged, at least"
        )
        marks = [panel.plot([], [], "o", color=colour, label=name)[0] for name, colour in COLOURS.items()]
        figure.legend(handles=marks, loc="outside upper center", ncols=3, fontsize=8)


def tables(numbers):
    """Markdown."""
    header = ("problem", "parameters", "sampler", "simulations an effective sample", "worst", "seconds")
    lines = []
    for case, result in numbers.items():
        for name in COLOURS:
            if name in result:
                r = result[name]
                seconds = f"{r['seconds']:.0f}" if r["converged"] else f"NOT CONVERGED after {r['seconds']:.0f}"
                per_sample = f"{'' if r['converged'] else 'at least '}{r['per_sample']:.3g}"
                cells = (case, result["n_params"], name, per_sample, r["worst"], seconds)
                lines.append((*cells, f"{r['tau']:.0f}", f"{r['rhat']:.4f}"))
    return "\n".join(table((*header, "longest tau", "R-hat"), lines)) + "\n"


def check(case, result):
    """The claim, of one problem."""
    ours = result[OURS]
    if case.endswith("normal") and "coupled" not in case:
        assert ours["converged"], f"{case}: has not converged"
        assert ours["per_sample"] < GOAL, f"{case}: {ours['per_sample']:.0f} simulations an effective sample"
        for name in RIVALS:
            assert not result[name]["converged"], f"{case}: {name} has converged too"
    if ours["converged"] and ours["unseen"] is not None:
        # The largest of some fifty departures stays below 3.5 standard errors, which are themselves optimistic.
        departure = ours["unseen"]["departure"]
        assert departure < 5.25, f"{case}: unseen directions depart from their prior by {departure:.1f} standard errors"
