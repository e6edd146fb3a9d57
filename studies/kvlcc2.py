"""Does a posterior of real zig-zags of a tanker model predict its other trials, and those of another basin?

Question: the trials of KVLCC2 for the workshop SIMMAN of 2008, free-running models of 7 m. HSVA's zig-zags 10/10 and
20/10 to both sides are fitted; its nine others and MARIN's six trials are predicted from rudder and start. All thirteen
zig-zags are fitted; MARIN's turning circles are predicted, beside what was published (Alexandersson et al. 2022).
Claim: CLAIM
Cost: COST. The data are not ours to give: the environment variable BAYESUB_KVLCC2 names a folder with
HSVA_CPMC_KVLCC2_Z_*.dat and MARIN_FREE_KVLCC2_*.dat; without it the study is skipped, and with --quick too.
"""

import os
from functools import partial
from pathlib import Path

import numpy as np

import bayesub as bs
from kvlcc2 import circles, drawings, fits, predictions
from kvlcc2.trials import CIRCLES, FITTED, HSVA, MARIN, UNSEEN, ZERO, ZIGZAGS, Tanker

TRAINED = {"four": FITTED, "all": HSVA}
N_STARTS, MAX_STEPS, SEED = 3, 6000, 1
FIGURES = {
    "errors": "Errors of heading and track of each unseen run by method, of fits of four zig-zags.",
    "circles": "Advance and tactical diameter of MARIN's turning circles, as predicted from HSVA's thirteen zig-zags, in "
    "per cent of the tests, with 90 % intervals where a method has them.",
    "headings": "Headings of runs that were not fitted, and the bands of the posterior.",
}
ANSWER = """ANSWER"""


def compute(run):
    """Errors, bands and circles of all methods."""
    folder = os.environ.get("BAYESUB_KVLCC2")
    if not folder or not list(Path(folder).glob("HSVA_CPMC_KVLCC2_Z_*.dat")):
        return {"skipped": "BAYESUB_KVLCC2 does not name a folder with the files HSVA_CPMC_KVLCC2_Z_*.dat"}
    if run.quick:
        return {"skipped": "there is no small version: the posteriors are of whole trials"}
    tanker = Tanker(Path(folder))
    numbers = {"definitions": circles.definitions(tanker), "posteriors": {}, "estimates": {}, "runs": {}, "circles": {}}
    known = {}
    for key, names in TRAINED.items():
        estimates = run.parts(f"estimates of {key}", estimators(tanker, names))
        posterior = sampled(run, tanker, key)
        numbers["posteriors"][key] = summary(posterior)
        numbers["estimates"][key] = {m: of_estimate(content) for m, content in estimates.items()}
        known[key] = methods(posterior, estimates)
    run.progress.stage("predict")
    arrays = {}
    for name in (*FITTED, *UNSEEN):
        content, of_run = predictions.of_run(tanker, name, known["four"], SEED)
        numbers["runs"][name] = content | {"best_zero": predictions.best_zero(tanker, name, known["four"]["posterior"])}
        arrays |= of_run
    for side, name in CIRCLES.items():
        numbers["circles"][side] = predictions.of_circle(tanker, name, side, known["all"], SEED)
    run.save_arrays("bands", **arrays)
    return numbers


def estimators(tanker, names):
    """Name -> what makes the estimate of some trials by a method, as JSON types."""
    plain = {"rng": np.random.default_rng(SEED), "n_starts": N_STARTS}
    makes = {
        "SQP": lambda: bs.baselines.sqp(tanker.joint(names).naive(), **plain),
        "linear least squares": lambda: fits.differenced(tanker, names),
        "smoothed regression": lambda: fits.smoothed(tanker, names),
    }
    return {key: partial(lambda make: make().to_json(), make) for key, make in makes.items()}


def sampled(run, tanker, key):
    """The posterior of some trials, kept in the run folder."""
    file = run.folder / f"posterior_{key}.nc"
    if not file.exists():
        run.progress.stage(f"sample the posterior of {key}")
        options = {"max_steps": MAX_STEPS, "checkpoint": run.folder / f"chain_{key}", "progress": run.progress}
        problem = tanker.joint(TRAINED[key], fits.unmodelled())
        bs.sample(problem, rng=np.random.default_rng(SEED), **options).save(file)
    return bs.Posterior.load(file)


def summary(posterior):
    """Convergence, and the rudder zeros of the runs."""
    zeros = {name: k for k, name in enumerate(posterior.names) if name.startswith(ZERO)}
    moments = {name: {"mean": float(posterior.mean[k]), "sd": float(posterior.sd[k])} for name, k in zeros.items()}
    return {"shortcomings": list(posterior.shortcomings), "seconds": posterior.seconds, "zeros": moments}


def of_estimate(content):
    """What is kept of an estimate."""
    values = dict(zip(content["names"], content["solutions"][0], strict=True))
    return {"status": content["statuses"][0], "seconds": content["seconds"], "values": values}


def methods(posterior, estimates):
    """Method -> what it knows."""
    rng = np.random.default_rng(SEED)
    draws = posterior.draws[rng.choice(len(posterior.draws), predictions.N_DRAWS)]
    known = {"posterior": predictions.Known(posterior.names, posterior.mean, draws, with_unknowns=True)}
    known["literature"] = predictions.Known((), np.zeros(0))
    return known | {key: predictions.Known.of_estimate(content, rng) for key, content in estimates.items()}
