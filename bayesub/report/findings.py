"""What a run found: every figure that its report quotes, and the sentences that say what they mean."""

import numpy as np

KNOWN = 0.05  # posterior sd relative to the posterior mean
UNTOUCHED = 0.9  # posterior sd relative to the prior sd
STRONG = 0.9  # correlation


def collect(problem, estimates, spectrum, posterior, ranks) -> dict:
    """Every figure that the report quotes, as JSON types."""
    truth, synthetic = reference(problem)
    n_coefficients = problem.n_coefficients
    q5, q50, q95 = posterior.quantiles([0.05, 0.5, 0.95])
    columns = {
        "name": posterior.names,
        "reference": truth,
        "prior_mean": posterior.prior_mean,
        "prior_sd": posterior.prior_sd,
        "mean": posterior.mean,
        "sd": posterior.sd,
        "q5": q5,
        "median": q50,
        "q95": q95,
        "contraction": posterior.contraction,
        "relative_sd": posterior.sd / np.abs(posterior.mean),
        "rhat": posterior.rhat,
        "bulk_ess": posterior.bulk_ess,
        "tail_ess": posterior.tail_ess,
        "tau_steps": posterior.tau.max(axis=0),
    }
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*map(_plain, columns.values()), strict=True)]
    trials = [_trial(*of_trial) for of_trial in problem.each_trial(posterior.best)]
    n_null = sum(axis.columns - axis.rank for axis in ranks.values())
    numbers = {
        "vehicle": problem.vehicle.name,
        "manoeuvre": ", ".join(trial["manoeuvre"] for trial in trials),
        "reference_is_truth": synthetic,
        "n_readings": len(problem.readings),
        "step_s": max(trial["step_s"] for trial in trials),
        "trials": trials,
        "convergence": {
            "converged": posterior.converged,
            "shortcomings": list(posterior.shortcomings),
            "criteria": vars(posterior.criteria),
            "max_rhat": float(posterior.rhat.max()),
            "min_bulk_ess": float(posterior.bulk_ess.min()),
            "min_tail_ess": float(posterior.tail_ess.min()),
            "max_tau_steps": float(posterior.tau.max()),
            "min_length_in_taus": float(posterior.n_steps / posterior.tau.max()),
            "n_ensembles": len(posterior.chain),
            "n_walkers": posterior.chain.shape[2],
            "n_warmup_steps": posterior.n_warmup,
            "n_kept_steps": posterior.n_steps,
            "acceptance": posterior.acceptance,
        },
        "cost": {
            "evaluations": posterior.evaluations,
            "sampling_seconds": posterior.seconds,
            "evaluations_per_second": posterior.evaluations / posterior.seconds,
            "evaluations_per_effective_sample": posterior.evaluations / float(posterior.bulk_ess.min()),
            "failed_simulations": posterior.failures,
        },
        "parameters": rows[:n_coefficients],
        "nuisance": [{k: v for k, v in row.items() if k != "relative_sd"} for row in rows[n_coefficients:]],
        "spectrum": {
            "singular_values": spectrum.singular_values.tolist(),
            "n_null": n_null,
            "n_sharpened": int(np.count_nonzero(spectrum.singular_values[: len(posterior.names) - n_null] > 1.0)),
        },
        "ranks": {axis: r.summary() for axis, r in ranks.items()},
        "null_contraction": _null_contraction(spectrum, posterior, n_null).tolist(),
        "trade_offs": _trade_offs(posterior),
        "baselines": [_baseline(problem, estimate, truth) for estimate in estimates],
        "chi_square_per_reading": _chi_square(problem, posterior.best[None])[0],
    }
    numbers["verdict"] = verdict(numbers)
    return numbers


def reference(problem) -> tuple[np.ndarray, bool]:
    """The values that ratios refer to (n_params,), and whether they are the truth behind a synthetic record."""
    trials = problem.each_trial(problem.reference)
    return problem.reference, all(p.record.truth is not None for _, p, _ in trials)


def _trial(name, problem, best) -> dict:
    return {
        "name": name,
        "manoeuvre": problem.manoeuvre.name,
        "duration_s": problem.manoeuvre.duration,
        "n_readings": problem.record.n_readings,
        "step_s": problem.simulator.step,
        "chi_square_per_reading": _chi_square(problem, best[None])[0],
    }


def _chi_square(problem, parameters) -> list[float]:
    """Chi-square per reading of each member of parameters (n_batch, n_params), with the total sd of every channel."""
    return np.mean(((problem.predicted(parameters) - problem.readings) / problem.sds) ** 2, axis=1).tolist()


def _null_contraction(spectrum, posterior, n_null):
    """Posterior sd over prior sd along each of the last `n_null` directions of the spectrum."""
    standardised = (posterior.draws - posterior.prior_mean) / posterior.prior_sd
    return np.std(standardised @ spectrum.directions[len(spectrum.names) - n_null :].T, axis=0)


def _trade_offs(posterior) -> list[dict]:
    """Pairs of coefficients by the size of their posterior correlation, strongest first."""
    rows, columns = np.triu_indices(len(posterior.names), 1)
    values = posterior.correlation[rows, columns]
    order = np.argsort(-np.abs(values))[:20]
    names = posterior.names
    return [{"pair": [names[rows[k]], names[columns[k]]], "correlation": float(values[k])} for k in order]


def _baseline(problem, estimate, truth) -> dict:
    plain = problem.naive()
    place = [estimate.names.index(name) for name in plain.names]
    solutions, truth = estimate.solutions[:, place], truth[: plain.n_params]
    error = np.abs(solutions - truth)
    start = np.abs(plain.prior.mean - truth)
    return {
        "method": estimate.method,
        "costs": estimate.costs.tolist(),
        "statuses": sorted(set(estimate.statuses)),
        "n_starts": len(solutions),
        "evaluations": estimate.evaluations,
        "seconds": estimate.seconds,
        "further_than_guess": np.count_nonzero(error > start, axis=1).tolist(),
        "n_params": len(truth),
        "chi_square_per_reading": _chi_square(plain, solutions),
        "ratios": [
            [x / t if t else None for x, t in zip(row, truth.tolist(), strict=True)] for row in solutions.tolist()
        ],
    }


def verdict(numbers: dict) -> dict[str, str]:
    """The report in sentences: what is known, what is not, which directions are null, and what trades off."""
    sentences = _what_is_known(numbers) | _directions(numbers) | _strongest_trade_offs(numbers) | _nuisance(numbers)
    for baseline in numbers["baselines"]:
        if baseline["method"] == "SQP":
            fits = baseline["chi_square_per_reading"]
            held = ", which holds nuisance parameters at their prior means," if numbers["nuisance"] else ""
            sentences["sqp"] = (
                f"SQP{held} from {baseline['n_starts']} starts reaches a chi-square per reading of {min(fits):.3f} to "
                f"{max(fits):.3f}, the best draw of the posterior {numbers['chi_square_per_reading']:.3f}; "
                f"{_range(baseline['further_than_guess'])} of its {baseline['n_params']} coefficients end further from "
                f"the {reference_word(numbers)} than the guess was."
            )
    return sentences


def _what_is_known(numbers):
    rows = sorted(numbers["parameters"], key=lambda row: row["relative_sd"])
    known = [f"{row['name']} ({100 * row['relative_sd']:.2g} %)" for row in rows if row["relative_sd"] < KNOWN]
    rows = sorted(numbers["parameters"], key=lambda row: row["contraction"])
    sharper = [row["name"] for row in rows if row["relative_sd"] >= KNOWN and row["contraction"] < UNTOUCHED]
    untouched = [row["name"] for row in rows if row["relative_sd"] >= KNOWN and row["contraction"] >= UNTOUCHED]
    sentences = {"known": f"No coefficient is known to better than {100 * KNOWN:.0f} %."}
    if known:
        sentences["known"] = f"To better than {100 * KNOWN:.0f} % (posterior sd over mean): {', '.join(known)}."
    if sharper:
        sentences["sharper"] = f"More than before the trial, but not to {100 * KNOWN:.0f} %: {', '.join(sharper)}."
    if untouched:
        sentences["untouched"] = (
            f"The prior is still what there is to say (posterior sd at least {100 * UNTOUCHED:.0f} % of the prior's): "
            f"{', '.join(untouched)}."
        )
    return sentences


def _directions(numbers):
    n = len(numbers["parameters"]) + len(numbers["nuisance"])
    n_null, n_sharpened = map(numbers["spectrum"].get, ("n_null", "n_sharpened"))
    space = "parameter" if numbers["nuisance"] else "coefficient"
    sentences = {
        "directions": f"Of {n} directions in {space} space the data sharpen {n_sharpened} and leave "
        f"{n - n_sharpened - n_null} to the prior; {n_null} leave the motion exactly the same, so that no sensor on "
        "this manoeuvre can tell."
    }
    if n_null:
        axes = {axis: r for axis, r in numbers["ranks"].items() if r["null_vectors"]}
        vectors = [f"{axis}: {combination(v, least=0.2)}" for axis, r in axes.items() for v in r["null_vectors"]]
        pivots = [name for r in axes.values() for name in r["pivots"]]
        sentences["null"] = (
            f"{'; '.join(vectors)} (changes of the non-dimensional coefficients, largest entries). Holding "
            f"{', '.join(pivots)} fixed makes the rest unique."
        )
    return sentences


def _nuisance(numbers):
    intervals = [f"{row['name']} {row['q5']:.4g} to {row['q95']:.4g}" for row in numbers["nuisance"]]
    return {"nuisance": f"{', '.join(intervals)} (90 % intervals)."} if intervals else {}


def _strongest_trade_offs(numbers):
    strong = [t for t in numbers["trade_offs"] if abs(t["correlation"]) >= STRONG]
    if not strong:
        return {"trade_offs": f"No two coefficients are correlated by more than {STRONG:g} in the posterior."}
    pairs = [f"{first} with {second} ({t['correlation']:+.2f})" for t in strong[:8] for first, second in [t["pair"]]]
    return {"trade_offs": f"{', '.join(pairs)} (posterior correlation)."}


def reference_word(numbers) -> str:
    """What ratios refer to."""
    return "truth" if numbers["reference_is_truth"] else "vehicle file"


def _range(values) -> str:
    return f"{min(values)}" if min(values) == max(values) else f"{min(values)} to {max(values)}"


def combination(vector: dict[str, float], least: float = 0.0) -> str:
    """A null vector in words, such as ``+1 Yv_absnu +0.43 Yvdot ..``, entries of at least `least` in size."""
    entries = [f"{value:+.2g} {name}" for name, value in vector.items() if abs(value) >= least]
    return " ".join(entries) + (" .." if len(entries) < len(vector) else "")


def _plain(values) -> list:
    return values.tolist() if isinstance(values, np.ndarray) else list(values)
