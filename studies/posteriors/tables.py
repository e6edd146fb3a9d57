"""Tables of posteriors and of the sets that SQP identifies, from the numbers of :mod:`posteriors.trials`."""

from collections.abc import Iterator

import numpy as np

from bayesub.report.markdown import columns, named
from posteriors.trials import GROUPS, MEASURES, TRADE_OFF

KNOWN = 0.1  # posterior sd over prior sd


def title(case: dict) -> str:
    """The name of a case, which says so if its posterior has not converged."""
    return case["name"] if case["converged"] else f"{case['name']}, NOT CONVERGED"


def page(numbers: dict, labels: dict[str, str]) -> Iterator[str]:
    """Markdown; `labels` are those of the groups of sets."""
    cases = named(numbers)
    yield "Posteriors. Stiff, sloppy and null directions of the Fisher information at the truth.\n"
    yield from columns(
        cases,
        {
            "case": title,
            "noise (m, deg)": lambda c: f"{c['position_sd_m']:.2g}, {c['attitude_sd_deg']:.2g}",
            "coefficients": lambda c: len(c["names"]),
            "stiff, sloppy, null": _kinds,
            f"posterior sd below {KNOWN:.0%} of the prior's": lambda c: np.sum(np.array(c["contraction"]) < KNOWN),
            "median": lambda c: f"{np.median(c['contraction']):.2f}",
            "R-hat": lambda c: f"{c['rhat']:.4f}",
            "least ESS": lambda c: f"{c['ess']:.0f}",
            "simulations": lambda c: c["evaluations"],
            "seconds": lambda c: f"{c['seconds']:.0f}",
        },
    )
    yield "\nSets of SQP inside the 95 % region of the posterior, by distance, by chi-square, by density.\n"
    groups = {"exact track": "exact", "noisy track": "noisy", "truth": "truth"}
    yield from columns(
        cases,
        {"case": title, "sets": lambda c: len(c["places"]["exact"]["distance"])}
        | {word: lambda c, g=g: ", ".join(str(c["inside"][g][m]) for m in MEASURES) for word, g in groups.items()}
        | {"truth furthest from the guess, prior sd": lambda c: "{} {:+.1f}".format(*c["furthest_from_prior"])},
    )
    yield "\nShares of the scatter's variance along stiff, sloppy and null directions, and its size in prior sd.\n"
    yield from columns(
        cases,
        {"case": title}
        | {labels[group]: lambda c, group=group: _scatter(c, group) for group in GROUPS}
        | {"posterior, size": lambda c: f"{c['scatter_sd']['posterior']:.2g}"},
    )
    yield "\nScatter of the sets over posterior sd of each identified coefficient: least, median, largest.\n"
    ratios = {"exact track": "exact", "noisy track": "noisy"}
    yield from columns(
        cases,
        {"case": title}
        | {w: lambda c, g=g: ", ".join(f"{x:.2g}" for x in c["scatter_over_posterior"][g]) for w, g in ratios.items()},
    )
    yield f"\nTrade-offs: pairs of values correlated above {TRADE_OFF:g}, and the strongest.\n"
    yield from columns(
        cases,
        {
            "case": title,
            "pairs": lambda c: c["n_trade_offs"],
            "strongest": lambda c: "; ".join(f"{a} {b} {r:+.3f}" for a, b, r in c["trade_offs"][:3]),
        },
    )


def _kinds(case) -> str:
    n = len(case["names"])
    return f"{case['n_stiff']}, {n - case['n_stiff'] - case['n_null']}, {case['n_null']}"


def _scatter(case, group) -> str:
    parts = ", ".join(f"{share:.2g}" for share in case["scatter"][group].values())
    return f"{parts}; {case['scatter_sd'][group]:.2g}"
