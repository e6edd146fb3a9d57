"""What a designed trial tells, as JSON types and in sentences."""

import numpy as np

from bayesub.design.information import SHARES, Information
from bayesub.design.plan import REFINED
from bayesub.findings.designed_trial import DesignedTrial
from bayesub.inference.identifiability import NullSpace

FAMILIES = {
    "steps": "steps",
    "curves": "curves between knots",
    "multisines": "multisines",
    "standard": "zig-zags and circles",
    REFINED: "curves that began as the best of the others",
}


def numbers(design: DesignedTrial) -> dict:
    """Everything that the page says, as JSON types."""
    judge, after, given = design.judge, design.after, design.after_standard
    found = design.searches[design.kind]
    content = {
        "vehicle": judge.vehicle.name,
        "goal": design.goal,
        "answer": sentence(design),
        "inputs": design.inputs,
        "duration_s": [manoeuvre.duration for manoeuvre in design.manoeuvres],
        "step_s": judge.step_s,
        "family": design.kind,
        "numbers": found.numbers.tolist(),
        "controls": {
            c.column: {"rest": c.rest, "lower": c.lower, "upper": c.upper, "rate": c.rate}
            for c in design.plan.family(design.kind).controls
        },
        "before": criteria(design.before, None),
        "standard": None if given is None else {"manoeuvre": design.standard.name} | criteria(given, design.unique),
        "after": criteria(after, design.structural),
        "on_boats_of_the_prior": {
            f"known_to_{100 * share:g}_percent": [information.n_known(share) for information in design.on_draws]
            for share in SHARES
        },
        "asked_for": [
            {
                "name": asked.name,
                "unit": asked.unit,
                "value": asked.value,
                "sd_before": design.before.prior_sd_of(asked.gradient),
                "sd_standard": None if given is None else given.sd_of(asked.gradient),
                "sd_after": after.sd_of(asked.gradient),
            }
            for asked in design.asked
        ],
        "share": design.share,
        "measure": measure_label(design),
        "by_minute": {f"{minute:.4g}": design.measure(one) for minute, one in design.minutes.items()},
        "by_sensor": {name: design.measure(one) for name, one in design.sensors.items()},
        "towing_tank": [
            {"name": v.name, "n_known": v.n_known, "gain": v.gain, "half_gain_sd": v.half_gain_sd}
            for v in design.tank_values
        ],
        "coefficients": _coefficients(design),
        "orders": _orders(design),
        "margins": [[_margin(margin) for margin in margins] for margins in design.margins],
        "out_of_reach": [dict(vector) for vector in design.structural.vectors],
        "ranks": {axis: rank.summary() for axis, rank in design.unique.ranks.items()},
        "searches": {
            kind: {"n_judgements": one.n_judgements, "cost": one.cost, "best": one.best.tolist()}
            for kind, one in design.searches.items()
        },
    }
    return _finite(content)


def _orders(design: DesignedTrial) -> list[dict]:
    """What a helmsman orders when, of each manoeuvre; empty if the family is not one of steps."""
    tables = []
    for orders in design.plan.cost(design.kind).orders(design.searches[design.kind].numbers):
        if orders:
            times = next(iter(orders.values()))[0]
            rows = np.column_stack([times, *(values for _, values in orders.values())])
            tables.append({"columns": ["time_s", *orders], "rows": rows.tolist()})
    return tables


def criteria(information: Information, null: NullSpace | None) -> dict:
    """Counts and criteria of an information."""
    counts = {f"known_to_{100 * share:g}_percent": information.n_known(share) for share in SHARES}
    optimality = {"D": information.d_optimality, "A": information.a_optimality, "n_sharper": information.n_sharper}
    if null is not None:
        optimality |= {"E": information.e_optimality(len(null)), "n_null": len(null)}
    return counts | optimality


def _coefficients(design) -> list[dict]:
    before, after, given = design.before, design.after, design.after_standard
    spread = np.array([information.posterior_sd for information in design.on_draws])
    return [
        {
            "name": name,
            "value": float(after.values[k]),
            "sd_before": float(before.posterior_sd[k]),
            "sd_standard": None if given is None else float(given.posterior_sd[k]),
            "sd_after": float(after.posterior_sd[k]),
            "sd_after_least": float(spread[:, k].min()),
            "sd_after_most": float(spread[:, k].max()),
        }
        for k, name in enumerate(after.names)
    ]


def _margin(margin) -> dict:
    return {
        "limit": margin.key,
        "value": margin.limit,
        "reached": float(margin.reached[0]),
        "excess": float(margin.excess[0]),
        "share_of_boats_within": margin.share_within,
    }


def _finite(content):
    """JSON has no infinite number: None instead."""
    if isinstance(content, dict):
        return {key: _finite(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_finite(value) for value in content]
    return None if isinstance(content, float) and not np.isfinite(content) else content


def sentence(design: DesignedTrial) -> str:
    """The answer with its numbers; what was asked for by name comes first."""
    given, after, parts = design.after_standard, design.after, []
    for asked in design.asked:
        unit = f" {asked.unit}" if asked.unit else ""
        text = (
            f"{asked.name} = {asked.value:.3g}{unit}: expected sd {after.sd_of(asked.gradient):.2g}{unit}, before the "
        )
        text += f"trial {design.before.prior_sd_of(asked.gradient):.2g}"
        parts.append(text + ("" if given is None else f", standard manoeuvre {given.sd_of(asked.gradient):.2g}"))
    counts = [information.n_known(design.share) for information in design.on_draws]
    known = f"Known to {100 * design.share:g} %: {after.n_known(design.share)} of {len(after.names)} coefficients"
    known += f" ({min(counts)} to {max(counts)} on boats of the prior); before the trial "
    known += f"{design.before.n_known(design.share)}"
    if given is not None:
        times = f", {len(design.manoeuvres)} times" if len(design.manoeuvres) > 1 else ""
        known += f"; the standard manoeuvre ({design.standard.name}, {design.standard.duration:.4g} s{times}) "
        known += f"{given.n_known(design.share)}"
    n_null = len(design.structural)
    known += f"; {n_null} combination{'s' * (n_null != 1)} of coefficients stay{'s' * (n_null == 1)} out of reach "
    parts.append(known + "whatever is flown")
    if any(design.margins):
        n_boats, n_within = boats_within(design)
        parts.append(f"{n_within} of {n_boats} boats that the prior holds possible keep all limits")
    return ". ".join(parts) + "."


def measure_label(design: DesignedTrial) -> str:
    """What :meth:`DesignedTrial.measure` is."""
    if design.asked:
        return "sd of what was asked for (% of that before)"
    return f"coefficients known to {100 * design.share:g} %"


def boats_within(design: DesignedTrial) -> tuple[int, int]:
    """How many boats of the prior flew, and how many of them keep all limits on all manoeuvres."""
    excess = np.max([margin.excess[1:] for margins in design.margins for margin in margins], axis=0)
    return len(excess), int(np.count_nonzero(excess <= 0.0))


def searched(design: DesignedTrial) -> list[str]:
    """What was searched and what was not, in sentences."""
    plan, family = design.plan, design.plan.family(design.kind)
    total = sum(one.n_judgements for one in design.searches.values())
    moved = ", ".join(control.column for control in family.controls)
    parts = ", ".join(f"{one.n_judgements} of {FAMILIES[kind]}" for kind, one in design.searches.items())
    lost = [kind for kind in plan.families if kind not in design.searches]
    sentences = [
        f"{total} manoeuvres of {family.duration:.4g} s were judged: {parts}. The best is of {FAMILIES[design.kind]}, "
        f"with {design.searches[design.kind].numbers.size} numbers (controls: {moved}).",
    ]
    if lost:
        sentences.append(f"Nothing within the limits was found among {', '.join(FAMILIES[kind] for kind in lost)}.")
    sentences.append(
        "Not searched: other lengths, speeds and depths at the start, orders that depend on the motion, and changes of "
        "trim or buoyancy. The search is random and finds a good manoeuvre, not the best there is; another --seed "
        "or more --minutes may find a better one. Expected sds are those of the normal approximation: a posterior of "
        "the flown trial says what was achieved."
    )
    return sentences
