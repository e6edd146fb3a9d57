"""Do the posteriors hold the truth as often as they say?

Question: of 200 boats drawn from the prior and measured on one trial each, does every coefficient's posterior have the
truth at a rank that is uniform, and do its 50, 90 and 95 % intervals hold it 50, 90 and 95 % of the time?
Claim: yes, for the horizontal spiral tracked, for the same with rounded readings, and for twelve coefficients in six
degrees of freedom: no ECDF of ranks leaves a simulated band that one study in a hundred leaves by chance. A likelihood
that takes the noise for a third smaller than it is fails the same test.
Cost: a quarter of an hour a problem on two cores. A killed run continues with --resume after the last trial.

A boat drawn from the prior that does not complete the manoeuvre is drawn again.
"""

import time
from functools import partial
from operator import itemgetter

import numpy as np

import bayesub as bs
from bayesub.inference.sampling.posterior import Criteria
from bayesub.model.coefficients import EQUATIONS
from bayesub.report import markdown
from calibration import plots
from thesis import calibration
from thesis.prior_trials import PriorTrials

# Quick: half a minute, because two posteriors are sampled of each of several kinds of trial.
N_TRIALS, QUICK_TRIALS = 200, 2
FALSE_ALARMS = 0.01  # of all quantities of a problem together
PRIOR = bs.priors.relative_normal(0.25)
STEP = 2.0  # s; truth and model have the same, so that its error is in neither's way
N_WALKERS = 50  # of each of four ensembles: one for every draw that ranks count
CRITERIA = Criteria(rhat=1.05, ess=400.0, taus=10.0)
MAX_STEPS = 4000
SEED = 20043
LIKELIHOOD = "log likelihood"
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
RANKS = (
    "ranks of the truth among posterior draws, less the uniform distribution, a panel a coefficient. Within the grey "
    "band is what a right posterior makes."
)
FIGURES = {
    "ecdf_track": f"track: {RANKS}",
    "ecdf_*": f"{{}}: {RANKS}",
}
ANSWER = """
Intervals of 90 % hold the truth {track/quantities/[A-Z]*/coverage/90 %; mean; percent; .0f} % of the time on
the tracked spiral, of {track/n_trials; .0f} boats drawn from the prior. With noise 1.5 times larger than the
likelihood says the least covered quantity is held {noise 1.5 */quantities/*/coverage/90 %; min; percent; .0f} %
of the time: the log likelihood.
"""


def planar(free):
    """On the horizontal spiral: manoeuvre, sensors, free coefficients, sd of the likelihood over that of sensors."""
    return {
        "track": ("horizontal", TRACK, free, 1.0),
        "rounded readings": ("horizontal", ROUNDED, free, 1.0),
        BROKEN: ("horizontal", TRACK, free, 1 / 1.5),
    }


EXPERIMENTS = {"six degrees of freedom": ("coupled", DEPTH_TRACK, TWELVE, 1.0), **planar(bs.coefficients.HORIZONTAL)}


def compute(run):
    """Ranks of every trial, and whether they are uniform, for each problem."""
    experiments, n_trials = (planar(FEW), QUICK_TRIALS) if run.quick else (EXPERIMENTS, N_TRIALS)
    numbers, ranks = {}, {}
    for place, (name, experiment) in enumerate(experiments.items()):
        run.progress.stage(name)
        trials = run.repeat(name.replace(" ", "_"), partial(trial, experiment, place), n_trials)
        ranks[name] = {quantity: [t["ranks"][quantity] for t in trials] for quantity in trials[0]["ranks"]}
        numbers[name] = {
            "n_trials": n_trials,
            "n_not_converged": sum(not t["converged"] for t in trials),
            "n_failed_boats": sum(t["failed_boats"] for t in trials),
            "seconds_per_trial": float(np.mean([t["seconds"] for t in trials])),
        } | calibration.uniformity(ranks[name], FALSE_ALARMS, np.random.default_rng(SEED))
    run.save_arrays("ranks", **{name: np.array(list(rows.values()), np.int16) for name, rows in ranks.items()})
    return numbers


def trial(experiment, place, k):
    """Ranks of the truth for one boat from the prior, and how its posterior was sampled."""
    began = time.perf_counter()
    rng = np.random.default_rng([SEED, place, k])
    manoeuvre, sensors, free, sd_factor = experiment
    trials = PriorTrials("suboff", manoeuvre, sensors, free=free, prior=PRIOR, dt=STEP, rng=rng)
    truth, problem, n_failed = trials.trial(rng, sd_factor)
    posterior = bs.sample(problem, rng=rng, n_walkers=N_WALKERS, max_steps=MAX_STEPS, criteria=CRITERIA)
    return {
        "ranks": calibration.posterior_ranks(problem, posterior, truth, rng),
        "converged": posterior.converged,
        "shortcomings": posterior.shortcomings,
        "failed_boats": n_failed,
        "evaluations": posterior.evaluations,
        "seconds": time.perf_counter() - began,
    }


def draw(run, numbers):
    """ECDFs within their band, and coverage: the least, mean and largest of a problem."""
    cells = {
        "problem": itemgetter("name"),
        "trials": itemgetter("n_trials"),
        "not converged": itemgetter("n_not_converged"),
        "boats drawn again": itemgetter("n_failed_boats"),
        "outside the band": lambda r: f"{len(outside(r))} of {len(r['quantities'])}",
    }
    cells |= {level: partial(covered, level) for level in (f"{100 * p:g} %" for p in calibration.INTERVALS)}
    cells["log likelihood, 90 %"] = lambda r: f"{r['quantities'][LIKELIHOOD]['coverage']['90 %']:.3f}"
    caption = (
        "Fraction of trials whose interval holds the truth: mean over coefficients (least to most); apart from them\n"
    )
    caption += "that of the log likelihood at the truth, which counts among what may leave the band.\n"
    run.page([caption, *markdown.columns(markdown.named(numbers), cells)])
    arrays = run.load_arrays("ranks")
    for name, result in numbers.items():
        ranks = dict(zip(result["quantities"], arrays[name], strict=True))
        ecdfs = {quantity: calibration.ecdf(values) for quantity, values in ranks.items()}
        limits = np.array(result["band"]["lower"]), np.array(result["band"]["upper"])
        plots.draw_ecdf(run.figure(f"ecdf_{name.replace(' ', '_')}"), ecdfs, limits, EQUATIONS)


def covered(level, result):
    """Coverage of the intervals of a level: mean, least and largest over the coefficients."""
    shares = [row["coverage"][level] for name, row in result["quantities"].items() if name != LIKELIHOOD]
    return f"{np.mean(shares):.3f} ({min(shares):.2f} to {max(shares):.2f})"


def outside(result):
    """The quantities whose ranks leave the band."""
    return [quantity for quantity, row in result["quantities"].items() if not row["inside"]]


def claims(numbers):
    """Ranks are uniform, except under the broken likelihood."""
    for name, result in numbers.items():
        if name == BROKEN:
            yield bool(outside(result)), "the broken likelihood passes: the test has no power"
        else:
            yield not outside(result), f"{name}: ranks of {', '.join(outside(result))} are not uniform"
