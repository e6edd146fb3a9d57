"""Do the posteriors hold the truth as often as they say?

Question: of 200 boats drawn from the prior and measured on one trial each, does every coefficient's posterior have the
truth at a rank that is uniform, and do its 50, 90 and 95 % intervals hold it 50, 90 and 95 % of the time?
Claim: yes, for the horizontal spiral tracked, for the same with rounded readings, and for twelve coefficients in six
degrees of freedom: no ECDF of ranks leaves a simulated band that one study in a hundred leaves by chance. A likelihood
that takes the noise for a third smaller than it is fails the same test.
Cost: half an hour a problem on two cores. A killed run continues with --resume after the last trial.

A boat drawn from the prior that does not complete the manoeuvre is drawn again. The prior is thereby restricted to
boats that do, and so is the posterior, as a simulation that fails has likelihood zero.
"""

import time
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy import stats

import bayesub as bs
from bayesub.checks import calibration
from bayesub.plots import calibration as plots
from bayesub.problem import likelihoods
from bayesub.report.markdown import table
from bayesub.sampling.posterior import Criteria
from bayesub.study.script import repeated

N_TRIALS, QUICK_TRIALS = 200, 6
FALSE_ALARMS = 0.01  # of all quantities of a problem together
PRIOR_SD = 0.25
STEP = 2.0  # s; truth and model have the same, so that its error is in neither's way
N_WALKERS = 50  # of each of four ensembles: one for every draw that ranks count
CRITERIA = Criteria(rhat=1.05, ess=400.0, taus=10.0)
MAX_STEPS = 4000
SEED = 20043
BROKEN = "noise 1.5 times larger than the likelihood says"

TRACK = bs.sensors.Track(0.5, 0.1, 5.0, ("x", "y", "yaw"))
ROUNDED = (
    bs.sensors.Sensor("u_mps", sd=0.003, resolution=0.01, interval_s=5.0),
    bs.sensors.Sensor("v_mps", sd=0.003, resolution=0.01, interval_s=5.0),
    bs.sensors.Sensor("r_degps", sd=0.01, resolution=0.05, interval_s=5.0),
    bs.sensors.Sensor("yaw_deg", sd=0.05, resolution=0.2, interval_s=5.0),
)
DEPTH_TRACK = bs.sensors.Track(0.5, 0.1, 5.0, ("x", "y", "z", "roll", "pitch", "yaw"))
TWELVE = ("Xuu", "Xvr", "Yuv", "Yuu_dr", "Zuw", "Zuu_ds", "Muw", "Muu_ds", "Nuv", "Nur", "Nuu_dr", "Kuv")
FEW = ("Xuu", "Yuv", "Nuv", "Nuu_dr")


@dataclass(frozen=True)
class Case:
    """A problem that is posed again and again; the likelihood's sd is the sensors' times `sd_factor`."""

    manoeuvre: str
    sensors: object
    free: tuple[str, ...]
    sd_factor: float = 1.0


CASES = {
    "six degrees of freedom": Case("coupled", DEPTH_TRACK, TWELVE),
    "track": Case("horizontal", TRACK, bs.coefficients.HORIZONTAL),
    "rounded readings": Case("horizontal", ROUNDED, bs.coefficients.HORIZONTAL),
    BROKEN: Case("horizontal", TRACK, bs.coefficients.HORIZONTAL, 1 / 1.5),
}
QUICK_CASES = {
    "track": Case("horizontal", TRACK, FEW),
    "rounded readings": Case("horizontal", ROUNDED, FEW),
    BROKEN: Case("horizontal", TRACK, FEW, 1 / 1.5),
}


def run(folder, *, quick, progress):
    """Ranks, ECDFs with their band, and coverage, for each problem."""
    cases, n_trials = (QUICK_CASES, QUICK_TRIALS) if quick else (CASES, N_TRIALS)
    numbers = {}
    for place, (name, case) in enumerate(cases.items()):
        progress.stage(name)
        file = folder / f"{name.replace(' ', '_')}.jsonl"
        trials = repeated(file, partial(trial, case, place), n_trials, progress)
        numbers[name] = judged(trials)
        draw(folder, name, trials, numbers[name])
    (folder / "calibration.md").write_text(tables(numbers))
    for name, result in numbers.items():
        outside = [quantity for quantity, row in result["quantities"].items() if not row["inside"]]
        if name == BROKEN:
            assert outside, "the broken likelihood passes: the test has no power"
        else:
            assert not outside, f"{name}: ranks of {', '.join(outside)} are not uniform"
    return numbers


def trial(case, place, k):
    """Ranks of the truth for one boat from the prior, and how its posterior was found."""
    began = time.perf_counter()
    rng = np.random.default_rng([SEED, place, k])
    boat = bs.load_vehicle("suboff")
    flown = bs.load_manoeuvre(case.manoeuvre, boat)
    prior = bs.priors.relative_normal(PRIOR_SD)
    # Any record poses the problem whose prior is drawn from.
    record = bs.observe(bs.simulate(boat, flown, dt=STEP), case.sensors, rng)
    posed = bs.Problem(boat, flown, record, free=case.free, prior=prior, dt=STEP)
    failed = -1
    status = ""
    while status != "ok":
        failed += 1
        (truth,) = posed.prior.sample(rng, 1)
        trajectory = bs.simulate(boat, flown, xi=posed.coefficient_sets(truth), dt=STEP)
        status = trajectory.status[0]
    record = bs.observe(trajectory, case.sensors, rng)
    noise = {}
    if case.sd_factor != 1.0:
        noise = {c.name: likelihoods.Normal(case.sd_factor * c.total_sd) for c in record.channels}
    problem = bs.Problem(boat, flown, record, free=case.free, prior=prior, noise=noise, dt=STEP)
    posterior = bs.sample(problem, rng=rng, n_walkers=N_WALKERS, max_steps=MAX_STEPS, criteria=CRITERIA)
    draws = calibration.independent_draws(posterior, rng)
    ranks = dict(zip(problem.names, calibration.rank(truth, draws).tolist(), strict=True))
    likelihood = problem.log_likelihood(np.concatenate([truth[None], draws]))
    ranks["log likelihood"] = int(calibration.rank(likelihood[0], likelihood[1:]))
    return {
        "ranks": ranks,
        "converged": posterior.converged,
        "shortcomings": posterior.shortcomings,
        "failed_boats": failed,
        "evaluations": posterior.evaluations,
        "seconds": time.perf_counter() - began,
    }


def judged(trials):
    """For each quantity whether its ECDF stays in the band, and the coverage of its intervals."""
    n_trials, names = len(trials), trials[0]["ranks"].keys()
    lower, upper = calibration.band(n_trials, FALSE_ALARMS / len(names), np.random.default_rng(SEED))
    quantities = {}
    for name in names:
        ranks = [t["ranks"][name] for t in trials]
        ecdf = calibration.ecdf(ranks)
        quantities[name] = {
            "inside": bool(np.all((ecdf >= lower) & (ecdf <= upper))),
            "mean_rank": float(np.mean(ranks)) / calibration.N_DRAWS,
            "coverage": {f"{100 * level:g} %": c for level, c in calibration.coverage(ranks).items()},
        }
    return {
        "n_trials": n_trials,
        "n_not_converged": sum(not t["converged"] for t in trials),
        "n_failed_boats": sum(t["failed_boats"] for t in trials),
        "seconds_per_trial": float(np.mean([t["seconds"] for t in trials])),
        "band": {"lower": lower.tolist(), "upper": upper.tolist()},
        "quantities": quantities,
    }


def draw(folder, name, trials, result):
    """ECDFs within their band and rank histograms."""
    ranks = {quantity: [t["ranks"][quantity] for t in trials] for quantity in result["quantities"]}
    ecdfs = {quantity: calibration.ecdf(values) for quantity, values in ranks.items()}
    limits = np.array(result["band"]["lower"]), np.array(result["band"]["upper"])
    expected = stats.binom.ppf([0.005, 0.995], len(trials), 1 / plots.BINS)
    for suffix in ("png", "pdf"):
        plots.draw_ecdf(folder / f"ecdf_{name.replace(' ', '_')}.{suffix}", ecdfs, limits)
        path = folder / f"histograms_{name.replace(' ', '_')}.{suffix}"
        plots.draw_histograms(path, ranks, calibration.N_DRAWS, expected)


def tables(numbers):
    """Coverage in Markdown: the smallest, mean and largest over the quantities of a problem."""
    levels = [f"{100 * level:g} %" for level in calibration.INTERVALS]
    lines = []
    for name, result in numbers.items():
        rows = result["quantities"].values()
        cells = []
        for level in levels:
            found = [row["coverage"][level] for row in rows]
            cells.append(f"{np.mean(found):.3f} ({min(found):.2f} to {max(found):.2f})")
        outside = sum(not row["inside"] for row in rows)
        counts = (result[key] for key in ("n_trials", "n_not_converged", "n_failed_boats"))
        lines.append((name, *counts, f"{outside} of {len(rows)}", *cells))
    caption = "Fraction of trials whose interval holds the truth: mean over coefficients (least to most).\n"
    header = ("problem", "trials", "not converged", "boats drawn again", "outside the band", *levels)
    return "\n".join([caption, *table(header, lines)]) + "\n"
