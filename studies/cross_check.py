"""Does an independent sampler with exact gradients find the same posteriors?

Question: the ensemble sampler straightens, whitens and proposes by rules of our own. Does NUTS, which shares the log
posterior and nothing of these rules, find the same means, standard deviations and correlations in all nine cases?
Claim: yes, within Monte Carlo error, wherever NUTS itself converges.
Cost: about an hour and a half of one core, most of it NUTS; a finished case is read back.

The ensemble sampler goes on to many more draws than it needs to converge: what is left is the Monte Carlo error of
NUTS, and a few draws that are held for long no longer decide whether the two agree.
"""

from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np

import bayesub as bs
from bayesub.plots import cross_check as plots
from bayesub.report.markdown import table
from bayesub.sampling import CrossCheck, cross_check
from bayesub.sampling.posterior import STANDARD
from bayesub.study.script import in_processes, resumed
from bayesub.thesis import cases as thesis
from bayesub.thesis.cases import MANOEUVRES, VEHICLES

N_DRAWS, N_TUNE = 1000, 300  # of each of four chains of NUTS
ESS = 10_000  # of the ensemble sampler
QUICK = {"npsauv horizontal": ("Xuu", "Yuv", "Nuv")}


def run(folder, *, quick, progress):
    """Both samplers on every case, and the differences of their moments."""
    # The longest first, so that no core is left waiting in the end.
    planes = reversed(MANOEUVRES)
    cases = QUICK if quick else {f"{vehicle} {plane}": None for plane, vehicle in product(planes, VEHICLES)}
    progress.stage("cases")
    numbers = {}
    for case, result in zip(cases, in_processes(partial(finished, folder, quick), cases.items()), strict=True):
        numbers[case] = result
        for suffix in ("png",) if quick else ("png", "pdf"):
            plots.draw(file_of(folder, case).with_suffix(f".{suffix}"), CrossCheck.from_json(result["check"]))
        progress.update(len(numbers) / len(cases), f"{len(numbers)} of {len(cases)} cases")
    (folder / "cross_check.md").write_text("\n".join(tables(numbers)) + "\n")
    for case, result in numbers.items():
        assert result["check"]["verdict"] != "disagree", f"{case}: {result['check']['sentence']}"
    return numbers


def finished(folder, quick, item):
    """Both posteriors of a case, now or before."""
    return resumed(file_of(folder, item[0]), lambda: compared(*item, quick))


def file_of(folder, case):
    """Where the result of a case is kept."""
    return folder / f"{case.replace(' ', '_')}.json"


def compared(case, free, quick):
    """The posterior of a case by both samplers."""
    vehicle, manoeuvre = case.split()
    problem = thesis.trial(vehicle, manoeuvre, free=free)
    rng = np.random.default_rng(thesis.SEED)
    n_draws, n_tune, ess = (300, 50, STANDARD.ess) if quick else (N_DRAWS, N_TUNE, ESS)
    posterior = bs.sample(problem, rng=rng, criteria=replace(STANDARD, ess=ess))
    assert posterior.converged, f"{case}: {'; '.join(posterior.shortcomings)}"
    check = cross_check(problem, posterior, rng=rng, n_draws=n_draws, n_tune=n_tune)
    return {
        "n_params": problem.n_params,
        "evaluations": posterior.evaluations,
        "seconds": posterior.seconds,
        "min_ess": float(posterior.bulk_ess.min()),
        "check": check.to_json(),
    }


def tables(numbers):
    """A row a case."""
    header = ("case", "parameters", "largest difference of a mean (standard errors)", "of an sd", "of a correlation")
    header += ("allowed", "verdict", "NUTS: gradients", "R-hat", "ESS", "divergences")
    lines = []
    for case, result in numbers.items():
        check = result["check"]
        worst = [f"{np.max(np.abs(check[key])):.1f}" for key in ("mean_z", "sd_z", "correlation_z")]
        costs = (check["gradients"], f"{check['rhat']:.4f}", f"{check['ess']:.0f}", check["divergences"])
        lines.append((case, result["n_params"], *worst, f"{check['threshold']:.1f}", check["verdict"], *costs))
    yield from table(header, lines)
