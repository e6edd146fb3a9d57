"""Are the posteriors right that people drew who never saw this sampler?

Question: posteriordb has 45 posteriors with 10,000 nearly independent draws of Stan each: regressions, time series, two
differential equations, Gaussian processes, mixtures. Does the sampler find their means, sds and quantiles, and what
does an effective sample cost beside NUTS (nutpie) on the same density?
Claim: in at least 43 of them all moments agree within four standard errors of both.
Cost: twenty-five minutes on one core, most of them nutpie's. The data are of a clone of github.com/stan-dev/posteriordb
that the environment variable BAYESUB_POSTERIORDB names; without it, and with --quick, only the three are drawn whose
data are with us.

Models are written from the mathematics of the Stan programs (`reference_posteriors/densities.py`): most as residuals of
errors with an unknown sd, some as a log likelihood. nutpie moves in the standard normal coordinates of the priors,
where wide normal ones in place of flat ones leave narrow ridges; in Stan's own coordinates it would do better. The
variance of K_m and V_m of `one_comp_mm_elim_abs` does not exist, for their density falls with the third power: their
sds are printed, and judged are their mean and quantiles.
"""

import os
import time
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np

import bayesub as bs
from bayesub.inference.checks import convergence
from bayesub.inference.sampling.moments import Effort
from bayesub.io.errors import InputError
from bayesub.problem.priors import Normal
from bayesub.report.markdown import columns
from bayesub.report.plots import style
from other_engines import samplers
from reference_posteriors import densities

SEED = 1
ESS, MAX_STEPS = 4000.0, 20_000  # of ours
QUICK_ESS = 1000.0  # Quick: half a minute, for three whole posteriors
GRADIENTS = 20_000  # of nutpie
N_REFERENCE = 10_000  # draws
LIMIT = 4.0  # standard errors
NO_VARIANCE = ("K_m", "V_m")
MOMENTS = ("mean", "sd", "q5", "q95")
RIVAL = "nutpie"
# Models that nutpie is asked for too: one of each kind, whose gradient takes milliseconds at most.
RIVALLED = (
    *("arK", "arma11", "blr", "eight_schools_noncentered", "garch11", "gp_pois_regr", "gp_regr", "hmm_example"),
    *("kidscore_interaction", "logearn_interaction_z", "logmesquite_logvolume", "low_dim_gauss_mix"),
)
FIGURES = {
    "moments": "Differences of means, sds and 5 % and 95 % quantiles from the reference draws, in standard errors of "
    "both; dashed lines are at four. A posterior with a moment beyond is named in red.",
}
ANSWER = """
In {agree/n; .0f} of {agree/of; .0f} posteriors every mean, sd and quantile agrees with the reference draws within four
standard errors. An effective sample of the worst parameter costs {posteriors/*/ours/per_effective_sample; median; .1f}
evaluations (median) and at most {posteriors/*/ours/per_effective_sample; max; .0f}. The price of a gradient of so
cheap a function is mostly what Python takes to call it; without it NUTS takes 5 to 45 gradients where its chains agree.
"""


def compute(run):
    """Every posterior whose data are there."""
    named = os.environ.get("BAYESUB_POSTERIORDB")
    folder = Path(named) if named and not run.quick else None
    if folder is not None and not (folder / "posterior_database").is_dir():
        return {"skipped": f"BAYESUB_POSTERIORDB names {folder}, which has no folder posterior_database"}
    found = {}
    run.progress.stage("posteriors")
    for done, name in enumerate(densities.SHIPPED["moments"]):
        data = densities.data_of(name, folder)
        if data is not None and not (run.quick and name.endswith("gp_pois_regr")):
            run.progress.update(done, len(densities.SHIPPED["moments"]), "posteriors", name)
            found[name] = run.part(name, partial(compare, name, data, run.quick))
    agree = sum(not lost(numbers) for numbers in found.values())
    return {"posteriors": found, "agree": {"n": agree, "of": len(found)}}


def compare(name, data, quick):
    """Moments and costs of one posterior, beside the reference's and nutpie's."""
    reference, rng = densities.pose(name, data), np.random.default_rng(SEED)
    model = reference.model
    criteria = bs.Criteria(ess=QUICK_ESS if quick else ESS)
    posterior = bs.sample(model, rng=rng, criteria=criteria, max_steps=MAX_STEPS)
    shape = posterior.chain.shape
    chain = reference.reported(posterior.draws).reshape(*shape[:-1], -1)
    numbers = {"residuals": isinstance(model, bs.LeastSquaresModel), "parameters": {}}
    for k, (parameter, moments) in enumerate(densities.SHIPPED["moments"][name].items()):
        numbers["parameters"][parameter] = judged(chain[..., [k]], moments)
    ess = float(min(posterior.bulk_ess))
    price = posterior.jacobian_price
    numbers["ours"] = cost(Effort(posterior.evaluations, posterior.jacobians, price, posterior.seconds, ess))
    numbers["shortcomings"] = list(posterior.shortcomings)
    asked = not quick and name.partition("-")[2] in RIVALLED
    numbers[RIVAL] = rival(model, price, GRADIENTS) if asked else {"skipped": "not asked"}
    return numbers


def judged(draws, reference):
    """Moments of draws (n_ensembles, n_steps, n_walkers, 1), and what they differ by in standard errors of both."""
    mean, sd, low, high = reference
    x = (draws - mean) / sd
    features = x, x**2 - 1.0, (draws < low) - 0.05, (draws < high) - 0.95
    values = draws.mean(), draws.std(), *np.quantile(draws, (0.05, 0.95))
    zs = [difference(feature) for feature in features]
    numbers = dict(zip(MOMENTS, map(rounded, values), strict=True))
    numbers["mcse_mean"] = rounded(draws.std() / np.sqrt(convergence.ess(draws)[0]))
    return numbers | {"z": dict(zip(MOMENTS, (round(float(z), 2) for z in zs), strict=True))}


def difference(feature):
    """The mean of what is zero on average, in standard errors; the reference has independent draws of that variance."""
    variance = max(feature.var(), 1e-6)
    ess = convergence.ess(feature)[0] if feature.var() > 0.0 else 1.0
    return feature.mean() / np.sqrt(variance * (1.0 / ess + 1.0 / N_REFERENCE))


def rounded(value):
    """Six digits."""
    return float(f"{value:.6g}")


def cost(effort):
    """Seconds, evaluations and effective sample, and evaluations for one."""
    numbers = vars(effort) | {"seconds": round(effort.seconds, 2), "jacobian_price": round(effort.jacobian_price, 1)}
    return {k: rounded(v) for k, v in numbers.items()} | {"per_effective_sample": rounded(effort.per_effective_sample)}


class Slope:
    """A model as nutpie's adapter asks for one, its parameters being t: a residual of one and a slope."""

    def __init__(self, model):
        self.costs, self.n_params, self._model = model.costs, model.n_params, model
        self.prior = Normal(np.zeros(model.n_params), np.ones(model.n_params))

    def log_likelihood(self, t):
        """(n_batch,)."""
        return self._model.log_likelihood(self._model.prior.parameters(t))

    def misfit(self, t):
        """Residuals (1, 1) and deviance (1,)."""
        return np.ones((1, 1)), -2.0 * self.log_likelihood(t)

    def jacobian(self, t):
        """(1, n_params)."""
        return self._model.slopes(self._model.prior.parameters(t)[None])


def rival(model, price, n_gradients):
    """What an effective sample costs by nutpie on the same density; None where it is not installed or got nowhere."""
    problem, began = (Slope(model) if isinstance(model, bs.DensityModel) else model), time.perf_counter()
    try:
        with np.errstate(all="ignore"):
            draws = samplers.nutpie_draws(problem, np.random.default_rng(SEED), n_gradients)
    except (InputError, RuntimeError) as missing:
        return {"skipped": str(missing)}
    n, seconds = draws.chain.shape[1], time.perf_counter() - began
    if n < 20 or not np.isfinite(draws.ess(n) + draws.rhat(n)):
        return {"skipped": draws.reached if n < 20 else f"a chain did not move in {draws.reached}"}
    effort = Effort(draws.simulations, draws.jacobians, price, seconds, draws.ess(n))
    return cost(effort) | {"rhat": rounded(draws.rhat(n)), "reached": draws.reached}


def lost(numbers):
    """Parameter, moment and z of what is beyond four standard errors."""
    return [
        (parameter, moment, z)
        for parameter, values in numbers["parameters"].items()
        for moment, z in values["z"].items()
        if not (abs(z) <= LIMIT or (moment == "sd" and parameter in NO_VARIANCE))
    ]


def draw(run, numbers):
    """The figure and the table."""
    run.page(tables(numbers))
    draw_moments(run.figure("moments"), numbers["posteriors"])


def draw_moments(paths, posteriors):
    """The z of each moment, a row a posterior."""
    with style.figure(paths, 8.3, 1.2 + 0.17 * len(posteriors)) as fig:
        axes = fig.add_subplot()
        colours = dict(zip(MOMENTS, style.CYCLE, strict=False))
        for row, numbers in enumerate(posteriors.values()):
            for moment in MOMENTS:
                zs = np.clip([values["z"][moment] for values in numbers["parameters"].values()], -8.0, 8.0)
                axes.plot(zs, np.full(len(zs), row), "|", color=colours[moment], ms=6, label="" if row else moment)
        for limit in (-LIMIT, LIMIT):
            axes.axvline(limit, **style.PRIOR_LINE)
        axes.set_yticks(range(len(posteriors)), posteriors, fontsize=7)
        for label, numbers in zip(axes.get_yticklabels(), posteriors.values(), strict=True):
            label.set_color(style.SQP if lost(numbers) else style.TRUTH)
        axes.set_xlim(-8.3, 8.3)
        axes.set_ylim(len(posteriors) - 0.4, -0.6)
        axes.set_xlabel("difference from the reference (standard errors of both)")
        fig.legend(*axes.get_legend_handles_labels(), ncols=4, loc="outside upper center")


def tables(numbers):
    """Every posterior: how far it is off, and what it costs."""
    yield "Largest size of z of all means, sds and quantiles, and of what. Evaluations for an effective sample of the"
    yield "worst parameter, a Jacobian or gradient at its price: ours, with seconds to 4000 effective samples, and by"
    yield f"nutpie for some, with {GRADIENTS} gradients, and these for one. With a star: a log likelihood without"
    yield "residuals, whose gradients are differences.\n"
    cells = {
        "posterior": lambda r: r.name + ("" if r.numbers["residuals"] else " *"),
        "parameters": lambda r: str(len(r.numbers["parameters"])),
        "largest z": lambda r: largest(r.numbers),
        "evaluations": lambda r: f"{r.numbers['ours']['per_effective_sample']:.1f}",
        "by nutpie": lambda r: of_rival(r.numbers, "per_effective_sample", ".0f"),
        "its gradients, at most": lambda r: "{:.0f}".format(GRADIENTS / r.numbers[RIVAL].get("ess", np.nan)).replace(
            "nan", "–"
        ),
        "price of a gradient": lambda r: f"{r.numbers['ours']['jacobian_price']:.0f}",
        "seconds": lambda r: f"{r.numbers['ours']['seconds']:.1f}",
        "of nutpie": lambda r: of_rival(r.numbers, "seconds", ".1f"),
        "its R-hat": lambda r: of_rival(r.numbers, "rhat", ".3f"),
        "short of": lambda r: "; ".join(r.numbers["shortcomings"]),
    }
    yield from columns([SimpleNamespace(name=k, numbers=v) for k, v in numbers["posteriors"].items()], cells)


def largest(numbers):
    """The largest |z| that counts, and its parameter and moment."""
    zs = [
        (abs(z), f"{moment} of {parameter}")
        for parameter, values in numbers["parameters"].items()
        for moment, z in values["z"].items()
        if moment != "sd" or parameter not in NO_VARIANCE
    ]
    return "{:.1f}, {}".format(*max(zs))


def of_rival(numbers, key, spec):
    """A number of nutpie's, or a dash where it has not got so far."""
    value = numbers[RIVAL].get(key, np.nan)
    return format(value, spec) if value is not None and np.isfinite(value) else "–"


def claims(numbers):
    """Nearly all agree."""
    posteriors = numbers["posteriors"]
    off = {name: lost(n) for name, n in posteriors.items() if lost(n)}
    most = 2 if len(posteriors) > 10 else 0
    yield len(off) <= most, "; ".join(f"{name}: {zs[0]}" for name, zs in off.items())
