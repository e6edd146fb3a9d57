"""What a run found: every number that its report quotes, and the sentences that say what they mean."""

from collections.abc import Mapping, Sequence
from functools import partial
from operator import itemgetter
from typing import Any

import numpy as np

from bayesub.findings import conflicts, feedback, rests_on, set_up, zeros
from bayesub.findings.equation_card import glossary
from bayesub.findings.set_up import AnyProblem
from bayesub.inference.baselines import Estimate
from bayesub.inference.baselines.sqp import BOUNDS
from bayesub.inference.checks import normality
from bayesub.inference.identifiability import NullSpace, Spectrum
from bayesub.inference.sampling import Posterior
from bayesub.io import templates
from bayesub.io.words import cell, counted, listed, rounded

KNOWN = 0.05  # posterior sd relative to the posterior mean
UNTOUCHED = 0.9  # posterior sd relative to the prior sd
STRONG, NOTABLE = 0.9, 0.7  # correlations
LISTED = 20  # strongest trade-offs among the numbers
QUOTED = 8  # of them in a sentence
LARGEST = 0.5  # relative change of the coefficient that changes most
LEAST = 0.05  # relative change of what a sentence speaks of
NAMED = 3  # coefficients in it beside that which changes most


def collect(
    problem: AnyProblem,
    estimates: Sequence[Estimate],
    spectrum: Spectrum,
    posterior: Posterior,
    summary: Posterior,
    null_space: NullSpace,
    conditional_sd: np.ndarray,
) -> dict:
    """Every number that the report quotes, as JSON types.

    `spectrum`: with its null directions last; `summary`: the posterior of all but white coordinates of histories,
    beside what was known before; `null_space`: that of the spectrum, axis by axis; `conditional_sd`: (n_others,) of
    each parameter of the summary if all others were known.
    """
    trials: list[dict[str, Any]] = [
        {
            "name": name,
            "manoeuvre": trial.manoeuvre.name,
            "duration_s": trial.manoeuvre.duration,
            "n_readings": trial.record.n_readings,
            "step_s": trial.simulator.step,
            "chi_square_per_reading": _chi_squares(trial, best[None])[0],
        }
        for name, trial, best in problem.each_trial(posterior.best)
    ]
    n = problem.n_coefficients
    dimensional = any(term.unit for term in problem.equations.terms)
    sensitivity = conflicts.power_scaling(problem, posterior, summary.bulk_ess)
    rows = _parameters(problem, summary, {"conditional_sd": conditional_sd} | sensitivity)
    assert spectrum.values is not None  # of a posterior it has them
    correlation = correlation_of_ratios(problem, summary)
    coefficient_pairs, nuisance_pairs = _trade_offs(summary.names, correlation, n)
    return {
        "vehicle": problem.vehicle.name,
        "coefficients": "coefficients in their units" if dimensional else "non-dimensional coefficients",
        "glossary": glossary(problem.equations, posterior.names[:n]),
        "manoeuvre": ", ".join(trial["manoeuvre"] for trial in trials),
        "reference_is_truth": all(trial.record.truth is not None for _, trial, _ in problem.each_trial(posterior.best)),
        "n_readings": len(problem.readings),
        "step_s": max(trial["step_s"] for trial in trials),
        "trials": trials,
        "convergence": _convergence(posterior),
        "cost": _cost(posterior),
        "parameters": [row | own for row, own in zip(rows, set_up.dimensional(problem), strict=False)],
        "nuisance": [{key: row[key] for key in row if key not in ("unit", "relative_sd")} for row in rows[n:]],
        "spectrum": {
            "singular_values": spectrum.singular_values.tolist(),
            "n_null": spectrum.n_null,
            "n_sharpened": spectrum.n_informed,
        },
        "ranks": {axis: rank.summary() for axis, rank in null_space.ranks.items()},
        "null_directions": null_changes(null_space, dict(zip(spectrum.names, spectrum.values.tolist(), strict=True))),
        "normality": normality.posterior_normality(summary.part(np.arange(n))).to_json(),
        "trade_offs": coefficient_pairs,
        "n_trade_offs": int(np.sum(np.abs(np.triu(correlation[:n, :n], 1)) >= NOTABLE)),
        "nuisance_trade_offs": nuisance_pairs,
        "baselines": [_baseline(problem, estimate) for estimate in estimates],
        "chi_square_per_reading": _chi_squares(problem, posterior.best[None])[0],
        "zeros": zeros.together(summary.names, np.atleast_2d(np.cov(summary.draws.T)), problem.vehicle),
        "advice": feedback.advice(problem),
        "conflict": conflicts.numbers(problem, summary),
        "rests_on": rests_on.numbers(problem, posterior.best, summary.mean[:n], summary.sd[:n]),
    }


def _parameters(problem, posterior, others) -> list[dict]:
    """A row for each parameter; the unit is that of a dimensional coefficient, or None."""
    units = {term.name: term.unit for term in problem.equations.terms}
    columns = {
        "reference": problem.reference[problem.others],
        **{name: getattr(posterior, name) for name in ("prior_mean", "prior_sd", "mean", "sd")},
        **dict(zip(("q5", "median", "q95"), posterior.quantiles([0.05, 0.5, 0.95]), strict=True)),
        "contraction": posterior.contraction,
        "relative_sd": posterior.sd / np.abs(posterior.mean),
        **others,
        **{name: getattr(posterior, name) for name in ("rhat", "bulk_ess", "tail_ess")},
        "tau_steps": posterior.tau.max(axis=0),
    }
    values = zip(*(column.tolist() for column in columns.values()), strict=True)
    return [
        {"name": name, "unit": units.get(name)} | dict(zip(columns, row, strict=True))
        for name, row in zip(posterior.names, values, strict=True)
    ]


def _convergence(posterior) -> dict:
    return {
        "converged": posterior.converged,
        "n_parameters": len(posterior.names),
        "shortcomings": list(posterior.shortcomings),
        "criteria": {key: limit for key, limit in vars(posterior.criteria).items() if key != "look"},
        "max_rhat": float(posterior.rhat.max()),
        **{f"min_{name}": float(getattr(posterior, name).min()) for name in ("bulk_ess", "tail_ess")},
        "max_tau_steps": float(posterior.tau.max()),
        "min_length_in_taus": float(posterior.n_steps / posterior.tau.max()),
        "n_ensembles": len(posterior.chain),
        "n_walkers": posterior.chain.shape[2],
        "n_warmup_steps": posterior.n_warmup,
        "n_kept_steps": posterior.n_steps,
        "acceptance": posterior.acceptance,
    }


def _cost(posterior) -> dict:
    """What sampling took; an effective sample costs simulations and Jacobians, these at their measured price."""
    in_jacobians = posterior.jacobians * posterior.jacobian_price if posterior.jacobians else 0.0
    return {
        "evaluations": posterior.evaluations,
        "jacobians": posterior.jacobians,
        "jacobian_price_simulations": posterior.jacobian_price if posterior.jacobians else None,
        "sampling_seconds": posterior.seconds,
        "simulation_seconds": posterior.simulation_seconds if np.isfinite(posterior.simulation_seconds) else None,
        "evaluations_per_second": posterior.evaluations / posterior.seconds,
        "evaluations_per_effective_sample": (posterior.evaluations + in_jacobians) / float(posterior.bulk_ess.min()),
        "failed_simulations": posterior.failures,
    }


def _chi_squares(problem, parameters) -> list[float]:
    """Chi-square per reading of each member of parameters (n_batch, n_params), with the sds of their noise."""
    errors, sds = problem.predicted(parameters) - problem.readings, np.empty((len(parameters), len(problem.readings)))
    for member, of in zip(parameters, sds, strict=True):
        for name, sd in set_up.noise_sds(problem, member).items():
            of[problem.rows[name]] = sd
    return np.mean((errors / sds) ** 2, axis=1).tolist()


def ratio_divisors(problem: AnyProblem) -> np.ndarray:
    """(n_others,) what parameters are divided by where they are drawn and correlated, histories of forces left out.

    Coefficients are ratios to the reference; what has none there, and all others, are as they are.
    """
    reference = problem.reference[problem.others]
    is_ratio = (np.arange(len(reference)) < problem.n_coefficients) & (reference != 0.0)
    return np.where(is_ratio, reference, 1.0)


def correlation_of_ratios(problem: AnyProblem, posterior: Posterior) -> np.ndarray:
    """(n_others, n_others) correlations of what is drawn, so that a number and its picture have one sign."""
    signs = np.sign(ratio_divisors(problem))
    return posterior.correlation * np.outer(signs, signs)


def _trade_offs(names, correlation, n_coefficients: int) -> tuple[list[dict], ...]:
    """Pairs of coefficients, and pairs with a nuisance parameter, by the size of their correlation."""
    rows, columns = np.triu_indices(len(names), 1)
    values = correlation[rows, columns]
    order = np.argsort(-np.abs(values))
    of_coefficients = columns[order] < n_coefficients
    return tuple(
        [{"pair": [names[rows[k]], names[columns[k]]], "correlation": float(values[k])} for k in group[:LISTED]]
        for group in (order[of_coefficients], order[~of_coefficients])
    )


def _baseline(problem, estimate) -> dict:
    plain = problem.searchable()
    if not set(plain.names) <= set(estimate.names):
        plain = problem.naive()
    n = plain.n_coefficients
    found = estimate.solutions[:, [estimate.names.index(name) for name in plain.names]]
    solutions, reference = found[:, :n], problem.reference[:n]
    guess = plain.prior.guess[:n]
    further = np.abs(solutions - reference) > np.abs(guess - reference)
    return {
        **{key: getattr(estimate, key) for key in ("method", "evaluations", "seconds")},
        "costs": estimate.costs.tolist(),
        "statuses": sorted(set(estimate.statuses)),
        "n_starts": len(solutions),
        "further_than_guess": np.count_nonzero(further, axis=1).tolist(),
        "n_params": len(reference),
        "nuisance": dict(zip(plain.names[n:], found[:, n:].T.tolist(), strict=True)),
        "chi_square_per_reading": _chi_squares(plain, found),
        "at_bounds": [
            [name for name, is_bound in zip(plain.names, row, strict=False) if is_bound]
            for row in np.abs(solutions - guess) > (BOUNDS - 1e-6) * np.abs(guess)
        ]
        if estimate.method == "SQP"
        else [[]] * len(solutions),
        "ratios": [
            [x / r if r else None for x, r in zip(solution, reference.tolist(), strict=True)]
            for solution in solutions.tolist()
        ],
    }


def sentences(numbers: dict) -> dict[str, str]:
    """The report in sentences by topic: what is known, what is not, what is null, what trades off, and SQP."""
    rows, searches = numbers["parameters"], [one for one in numbers["baselines"] if one["method"] == "SQP"]
    known, narrowed = known_rows(rows)
    by_contraction = sorted(rows, key=itemgetter("contraction"))
    values: dict[str, Any] = {
        "numbers": numbers,
        "word": reference_word(numbers),
        "null_count": null_count(numbers["ranks"]),
        "null_words": null_sentence(numbers["null_directions"]),
        "pivots": [name for rank in numbers["ranks"].values() for name in rank["pivots"]],
        "known": known,
        "narrowed": narrowed,
        "sharper": [r["name"] for r in by_contraction if r["contraction"] < UNTOUCHED and r["relative_sd"] >= KNOWN],
        "untouched": [row["name"] for row in by_contraction if row["contraction"] >= UNTOUCHED],
        "strong_pairs": _strong_pairs(numbers["trade_offs"]),
        "strong_others": _strong_pairs(numbers["nuisance_trade_offs"]),
        "gains": {"rows": sorted(rows, key=gain), "median": np.median([gain(row) for row in rows])},
        "search": searches[-1] if searches else None,
        "limits": {"known": KNOWN, "untouched": UNTOUCHED, "strong": STRONG},
    }
    fill = partial(templates.fill, "bayesub.findings", "run.txt", **values, gain=gain, cell=cell, counted=counted)

    def said(*topics: str) -> dict[str, str]:
        texts = {topic: " ".join(fill(topic=topic).split()) for topic in topics}
        return {topic: text for topic, text in texts.items() if text}

    result = said("answer") | conflicts.sentences(numbers) | rests_on.sentences(numbers["rests_on"])
    result |= said("known", "sharper", "untouched")
    if text := conflicts.sensitivity_sentence(rows):
        result["prior"] = text
    result |= said("directions", "null", "trade_offs", "others_known", "normality")
    parts = [zeros.sentence(numbers["zeros"])] if numbers["zeros"] else []
    parts += [f"{numbers['advice']}."] if numbers["advice"] else []
    if parts:
        result["zeros"] = " ".join(parts)
    if others := numbers["nuisance"]:
        ends = ((row["name"], *(rounded(row[q], row["sd"]) for q in ("q5", "q95"))) for row in others)
        intervals = ", ".join(f"{name} {low} to {high}" for name, low, high in ends)
        result["nuisance"] = f"{intervals} (90 % intervals)."
    return result | said("sqp")


def _strong_pairs(trade_offs) -> list[dict]:
    return [one for one in trade_offs if abs(one["correlation"]) >= STRONG][:QUOTED]


def known_rows(rows: Sequence[Mapping[str, Any]]) -> tuple[list[Mapping[str, Any]], list[Mapping[str, Any]]]:
    """Of parameters those that are known to KNOWN, and those that are known better than before, best known first."""
    by_size = sorted(rows, key=itemgetter("relative_sd"))
    narrowed = [row for row in by_size if row["contraction"] < UNTOUCHED]  # not what the prior has known as well before
    return [row for row in narrowed if row["relative_sd"] < KNOWN], narrowed


def null_count(ranks: Mapping[str, Mapping[str, Any]]) -> str:
    """How many combinations change nothing, and how many hardly anything, by axis -> summary of its rank."""
    n_null = sum(rank["null_dimension"] for rank in ranks.values())
    text = {0: "no combination leaves", 1: "one combination leaves"}.get(n_null, f"{n_null} combinations leave")
    text += " the motion exactly the same"
    shown = [(r["singular_values"][r["practical_rank"] : r["rank"]], r["singular_values"][0]) for r in ranks.values()]
    if faint := [f"{value / largest:.0e}" for values, largest in shown for value in values]:
        change = "changes" if len(faint) == 1 else "change"
        text += f", and {len(faint)} {change} it by less than any instrument sees ({', '.join(faint)})"
    return text


def gain(row: Mapping[str, Any]) -> float:
    """How many times smaller the posterior sd of a parameter would be if all others were known, by its numbers."""
    return max(row["sd"] / row["conditional_sd"], 1.0)


def reference_word(numbers: dict) -> str:
    """The word for what ratios refer to."""
    return "truth" if numbers["reference_is_truth"] else "vehicle file"


def null_changes(null_space: NullSpace, values: Mapping[str, float]) -> list[dict]:
    """Of each null direction its ``axis`` and its ``changes``, of which the largest is 50 % (:func:`changes`).

    The motion stays the same to round-off: a null direction is one of the linear form of the equations, so that a step
    along it may be of any length. `values`: coefficient -> value where the null space was taken.
    """
    ranks = null_space.ranks.items()
    return [{"axis": axis, "changes": changes(v, values)} for axis, rank in ranks for v in rank.null_vectors]


def changes(vector: Mapping[str, float], values: Mapping[str, float]) -> dict[str, float]:
    """A direction as changes over the values of coefficients that are not zero: the largest first, which is 50 %."""
    relative = {name: change / values[name] for name, change in vector.items() if values[name]}
    order = sorted(relative, key=lambda name: -abs(relative[name]))
    return {name: LARGEST / relative[order[0]] * relative[name] for name in order}


def null_sentence(directions: list[dict]) -> str:
    """What may change together; empty if nothing may."""
    return "; ".join(f"{direction['axis']}: {change_words(direction['changes'])}" for direction in directions)


def change_words(changes: Mapping[str, float]) -> str:
    """Changes such as ``50 % of Yvdot with 21 % of Yuv and 4 others``, or of one by itself where others hardly move."""
    first, *others = [f"{percent(change)} of {name}" for name, change in changes.items() if abs(change) >= LEAST]
    if not others:
        rest = counted(len(changes) - 1, "other")
        return f"{first} with less than {percent(LEAST)} of {rest}" if len(changes) > 1 else first
    named, more = others[:NAMED], len(others) - NAMED
    return f"{first} with {listed([*named, *([counted(more, 'other')] if more > 0 else [])])}"


def percent(share: float) -> str:
    """A share such as -0.1342 as ``-13 %``: two digits."""
    return f"{np.format_float_positional(100.0 * share, 2, fractional=False, trim='-')} %"
