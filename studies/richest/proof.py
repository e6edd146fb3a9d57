"""Does a trial tell what was expected of it? Posteriors, searches and predictions of boats of the prior."""

from collections.abc import Sequence

import numpy as np

from bayesub.inference.baselines import gauss_newton, sqp
from bayesub.inference.sampling import sample
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.simulate import simulate
from bayesub.model.simulator import true_step
from bayesub.model.vehicles import Vehicle
from bayesub.problem import priors
from bayesub.problem.problem import Problem
from bayesub.sensors import observe
from richest.appraisal import SHARE, appraiser_of
from thesis import calibration
from thesis.cases import unseen

PRIOR_SD = 0.25
START_SPREAD = float(np.sqrt(3.0) * PRIOR_SD)  # half width of uniform starts with the sd of the prior
N_DRAWS = 39  # of a posterior that fly unseen manoeuvres: central 90 % of the ranks of a truth are 2 to 37
MAX_ITERATIONS = 60  # of SQP
STEP_LENGTHS = 0.03  # of fits, in ship lengths travelled
N_TIMES = 10  # of an unseen manoeuvre
FITS = 1.2  # mean square of the residuals over their sds, below which a search has found a fit
_PRIOR = priors.relative_normal(PRIOR_SD)


class Proof:
    """Trials of boats of the prior on one manoeuvre, with one set of sensors, flown at a tenth of the step of the fit.

    Parameters
    ----------
    vehicle, sensors : str
    manoeuvre : Manoeuvre
    """

    def __init__(self, vehicle: str, sensors: str, manoeuvre: Manoeuvre):
        self.appraiser, self.manoeuvre = appraiser_of(vehicle), manoeuvre
        self.boat, self.sensors = self.appraiser.boat, self.appraiser.sensors[sensors]
        self.names = self.appraiser.exact.names
        self.step = STEP_LENGTHS * self.boat.length_m / self.boat.speed_mps

    def trial(self, xi: np.ndarray, rng: np.random.Generator) -> Problem:
        """The problem of a record of a boat with coefficients xi (n_terms,)."""
        step = true_step(self.step, self.manoeuvre)
        track = simulate(self.boat, self.manoeuvre, xi=xi, dt=step)
        record = observe(track, self.sensors, rng)
        return Problem(self.boat, self.manoeuvre, record, free=self.names, prior=_PRIOR, dt=self.step)


def boat_of_prior(boat: Vehicle, names: Sequence[str], manoeuvres: Sequence[Manoeuvre], rng: np.random.Generator):
    """Coefficients (n_terms,) of a boat of the prior that completes all manoeuvres, and how many before it do not."""
    columns, n_failed = boat.equations.columns(names), 0
    prior = _PRIOR.on(columns, boat.xi, boat.equations)
    while True:
        xi = boat.xi.copy()
        (xi[columns],) = prior.sample(rng, 1)
        if all(simulate(boat, m, xi=xi).status[0] == "ok" for m in manoeuvres):
            return xi, n_failed
        n_failed += 1


def trial_results(
    proof: Proof,
    xi: np.ndarray,
    rng: np.random.Generator,
    *,
    n_searches: int,
    n_unseen: int,
    max_steps: int,
) -> dict:
    """Posterior, searches and predictions of one record of a boat xi (n_terms,), as JSON types.

    The posterior is the normal approximation at the mode that a search from the truth finds. If `max_steps` is not
    zero it is sampled too, and compared.
    """
    problem = proof.trial(xi, rng)
    truth, centre = xi[problem.columns], problem.prior.mean
    mode = gauss_newton(problem, truth)
    sd = np.sqrt(np.diag(mode.covariance))
    draws = rng.multivariate_normal(mode.values, mode.covariance, calibration.N_DRAWS, method="eigh")
    expected = dict(zip(proof.names, _expected(proof), strict=True))
    searches = {"SQP": sqp_ends(problem, rng, n_searches), "Gauss-Newton": gauss_newton_ends(problem, rng, n_searches)}
    ends = {name: result.pop("solutions") for name, result in searches.items()}
    sets = {"posterior": mode.values[None], "no trial": centre[None]} | ends
    return {
        "n_params": problem.n_params,
        "truth": _digits(truth / centre),
        "mode": _digits(mode.values / centre),
        "sd": _digits(sd / np.abs(centre)),
        "expected": _digits([expected[name] for name in problem.names]),
        "rank": calibration.rank(truth, draws).tolist(),
        "converged": mode.statuses[0] == "converged",
        "sampled": compared(problem, mode.values, sd, rng, max_steps) if max_steps else {},
        "searches": {name: result | found(ends[name], truth) for name, result in searches.items()},
        "unseen": predictions(problem, xi, draws[:N_DRAWS], sets, n_unseen),
    }


def compared(problem: Problem, mode: np.ndarray, sd: np.ndarray, rng: np.random.Generator, max_steps: int) -> dict:
    """A sampled posterior against its normal approximation of a mode (n_params,) and sds (n_params,)."""
    posterior = sample(problem, rng=rng, max_steps=max_steps)
    return {
        "sd_ratio": _digits(posterior.sd / sd),
        "shift": _digits((posterior.mean - mode) / sd),
        "converged": bool(posterior.converged),
        "shortcomings": list(posterior.shortcomings),
        "seconds": round(posterior.seconds, 1),
    }


def _digits(values) -> list[float]:
    return [float(f"{x:.4g}") for x in values]


def _expected(proof) -> np.ndarray:
    """(n,) sds over the size of the values that the judge expects of the vehicle itself, without any record."""
    judge = proof.appraiser
    (name,) = (name for name, sensors in judge.sensors.items() if sensors == proof.sensors)
    return judge.exact_information(proof.manoeuvre)[name].relative_sd


def boat_results(vehicle: str, sensors: str, specs: dict[str, dict], seed: int, sizes: dict[str, int], k: int) -> dict:
    """Name of a manoeuvre -> results of the trial of the k-th boat of the prior on it, the same boat on each.

    Parameters
    ----------
    vehicle, sensors : str
    specs : dict of str to dict
        Manoeuvres, as :meth:`richest.appraisal.Appraiser.manoeuvre` takes them.
    seed : int
    sizes : dict of str to int
        ``n_boats``, ``n_sampled`` of them, ``n_searches`` of them all together, ``n_unseen`` and ``max_steps``.
    k : int
    """
    appraiser = appraiser_of(vehicle)
    manoeuvres = {name: appraiser.manoeuvre(spec) for name, spec in specs.items()}
    rng = np.random.default_rng([seed, 2, k])
    xi, n_failed = boat_of_prior(appraiser.boat, appraiser.exact.names, list(manoeuvres.values()), rng)
    whole, rest = divmod(sizes["n_searches"], sizes["n_boats"])
    max_steps = sizes["max_steps"] if k < sizes["n_sampled"] else 0
    options = {"n_searches": whole + (k < rest), "n_unseen": sizes["n_unseen"], "max_steps": max_steps}
    return {
        name: trial_results(Proof(vehicle, sensors, manoeuvre), xi, np.random.default_rng([seed, 3, k, j]), **options)
        | {"boats_drawn_again": n_failed}
        for j, (name, manoeuvre) in enumerate(manoeuvres.items())
    }


def sqp_ends(problem: Problem, rng: np.random.Generator, n: int) -> dict:
    """Where n searches without the prior end that start spread as the prior is."""
    estimate = sqp(problem, rng=rng, n_starts=n, start_spread=START_SPREAD, max_iterations=MAX_ITERATIONS)
    return _ends(problem, estimate.solutions, estimate.seconds / n)


def gauss_newton_ends(problem: Problem, rng: np.random.Generator, n: int) -> dict:
    """Where n searches for the posterior mode end that start at draws of the prior."""
    solutions, seconds = [], 0.0
    while len(solutions) < n:
        (start,) = problem.prior.sample(rng, 1)
        try:
            estimate = gauss_newton(problem, start)
        except ValueError:  # the boat of the start does not complete the manoeuvre
            continue
        solutions.append(estimate.values)
        seconds += estimate.seconds
    return _ends(problem, np.array(solutions), seconds / n)


def _ends(problem, solutions, seconds) -> dict:
    misfit = np.nan_to_num(np.sum(problem.residuals(solutions) ** 2, axis=1), nan=1e9) / problem.record.n_readings
    return {"solutions": solutions, "misfit": _digits(misfit), "seconds": round(float(seconds), 2)}


def found(solutions: np.ndarray, truth: np.ndarray) -> dict:
    """Share of the coefficients (n_params,) that each of some solutions (n, n_params) has within 10 % of the truth."""
    off = np.abs(solutions / truth - 1.0)
    return {"found": _digits(np.mean(off <= SHARE, axis=1)), "median_error": _digits(np.median(off, axis=1))}


def predictions(problem: Problem, xi: np.ndarray, draws: np.ndarray, sets: dict, n: int) -> dict:
    """Largest position errors of n unseen manoeuvres in lengths, and what 90 % bands of the draws hold.

    Parameters
    ----------
    problem : Problem
    xi : (n_terms,) array
        The true boat.
    draws : (N_DRAWS, n_params) array
        Of the posterior.
    sets : dict of str to (n_sets, n_params) array
    n : int
        Random manoeuvres (thesis section 8.2).

    Returns
    -------
    dict
        ``errors``, of each set the median over sets and manoeuvres of those that complete; ``failed``; ``held``, the
        shares of true positions between the fifth and 95th per cent of the draws, by manoeuvre.
    """
    some = problem.coefficient_sets(np.concatenate([draws, *sets.values()]))
    some = np.concatenate([xi[None], some])
    ends = np.cumsum([1 + len(draws), *map(len, sets.values())])
    groups = {name: slice(a, b) for name, a, b in zip(sets, ends[:-1], ends[1:], strict=True)}
    errors, held, failed = {name: [] for name in sets}, [], dict.fromkeys([*sets, "draws"], 0)
    for simulator in unseen(problem.vehicle, n):
        states, status = simulator.run(some)
        if status[0] != 0:  # the true boat does not complete what the vehicle does
            continue
        positions = states[..., :3] / problem.vehicle.length_m
        off = np.linalg.norm(positions - positions[0], axis=2).max(axis=1)
        for name, group in groups.items():
            ok = status[group] == 0
            errors[name] += off[group][ok].tolist()
            failed[name] += int(np.count_nonzero(~ok))
        looks = np.linspace(0, len(simulator.times) - 1, N_TIMES + 1).astype(int)[1:]
        flown = positions[1 : 1 + len(draws)][status[1 : 1 + len(draws)] == 0][:, looks]
        failed["draws"] += len(draws) - len(flown)
        share = np.mean(flown < positions[0, looks], axis=0)
        held.append(float(np.mean(np.abs(share - 0.5) <= 0.45)))
    return {
        "errors": {name: _digits([np.median(e), np.quantile(e, 0.9)]) for name, e in errors.items()},
        "held": _digits([np.mean(held)])[0],
        "failed": failed,
        "n": len(held),
    }


def summary(trials: list[dict]) -> dict:
    """What the trials of several boats on one manoeuvre show together, as JSON types."""
    expected, sd, mode, truth = (np.array([t[key] for t in trials]) for key in ("expected", "sd", "mode", "truth"))
    coverages = [calibration.coverage(t["rank"]) for t in trials]
    sampled = [t["sampled"] for t in trials if t["sampled"]]
    unseen = [t["unseen"] for t in trials]
    return {
        "n_trials": len(trials),
        "n_params": trials[0]["n_params"],
        "n_converged": sum(t["converged"] for t in trials),
        "boats_drawn_again": sum(t["boats_drawn_again"] for t in trials),
        "n_known": {
            key: float((s <= SHARE).sum(axis=1).mean()) for key, s in (("expected", expected), ("achieved", sd))
        },
        "sd_over_expected": _digits(np.quantile(sd / expected, [0.05, 0.5, 0.95])),
        "pairs": [_digits(expected[0]), _digits(np.median(sd, axis=0))],
        "rms_error": float(np.sqrt(np.mean(((mode - truth) / sd) ** 2))),
        "coverage": {f"{100 * level:g} %": _mean([c[level] for c in coverages]) for level in calibration.INTERVALS},
        "sampled": {
            "n": len(sampled),
            "n_converged": sum(s["converged"] for s in sampled),
            "sd_ratio": _spread([x for s in sampled for x in s["sd_ratio"]]),
            "shift": _spread([x for s in sampled for x in s["shift"]]),
            "seconds": _spread([s["seconds"] for s in sampled]),
        },
        "guess": _mean(np.mean(np.abs(1.0 / truth - 1.0) <= SHARE, axis=1)),
        "found": _mean(np.mean(np.abs(mode / truth - 1.0) <= SHARE, axis=1)),
        "searches": {name: _searches([t["searches"][name] for t in trials]) for name in trials[0]["searches"]},
        "unseen": {
            "n": sum(u["n"] for u in unseen),
            "errors": {key: _digits(np.median([u["errors"][key] for u in unseen], 0)) for key in unseen[0]["errors"]},
            "held": _mean([u["held"] for u in unseen]),
            "failed": {key: sum(u["failed"][key] for u in unseen) for key in unseen[0]["failed"]},
        },
    }


def _spread(values) -> list[float]:
    """Fifth, fiftieth and 95th per cent, nothing of nothing."""
    return _digits(np.quantile(values, [0.05, 0.5, 0.95])) if len(values) else []


def _searches(results) -> dict:
    together = {key: np.concatenate([r[key] for r in results]) for key in ("found", "median_error", "misfit")}
    return {
        "n": len(together["found"]),
        "found": _mean(together["found"]),
        "median_error": float(np.median(together["median_error"])),
        "misfit": float(np.median(together["misfit"])),
        "n_fit": int(np.count_nonzero(together["misfit"] < FITS)),
        "seconds": float(np.median([r["seconds"] for r in results])),
    }


def _mean(values) -> dict[str, float]:
    """Mean, and its standard error."""
    error = np.std(values, ddof=1) / np.sqrt(len(values)) if len(values) > 1 else np.nan
    return {"mean": float(f"{np.mean(values):.4g}"), "error": None if np.isnan(error) else float(f"{error:.3g}")}
