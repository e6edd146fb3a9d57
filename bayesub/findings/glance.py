"""A run at a glance: what its page and the last lines of its command say first, from the content of its numbers."""

from collections.abc import Iterator, Mapping
from typing import Any

from bayesub.findings import derived
from bayesub.findings.run_numbers import KNOWN, STRONG, UNTOUCHED, null_count
from bayesub.findings.verdicts import contradicted

BEST = 8  # coefficients that are named as best known
NOTABLE = 0.7  # correlation from which a pair is counted


def glance(numbers: Mapping[str, Any]) -> dict[str, Any]:
    """What a run says of boat, coefficients, what the trial cannot tell, and whether to trust it, as JSON types.

    `numbers`: the content of ``numbers.json`` with its sentences under "verdict".

    Gives "boat": rows ``name, label, unit, posterior, prior`` (5 and 95 % as words) of the headline quantities;
    "stable": rows ``where, posterior, prior`` (probabilities from 0 to 1); "known": rows ``name, percent`` of
    coefficients known to 5 %, best first; "best": the same of the best known; "n_coefficients", "n_sharper",
    "n_untouched": numbers of them; "n_null", "n_faint": the combinations that leave the motion exactly the same, and
    those that change it by less than any instrument sees; "not_unique": both in words; "hold": coefficients which,
    held, make the rest unique; "pairs": rows ``pair, correlation`` above 0.9, strongest first; "n_pairs": how many are
    above 0.7, at most those of "trade_offs"; "marks": rows ``topic, good, word, text``, the verdict taken apart.
    """
    rows = numbers["parameters"]
    narrowed = [row for row in rows if row["contraction"] < UNTOUCHED]
    best = [
        {"name": row["name"], "percent": 100.0 * row["relative_sd"]}
        for row in sorted(narrowed, key=lambda row: row["relative_sd"])
    ]
    known = [row for row in best if row["percent"] < 100.0 * KNOWN]
    sizes = [abs(pair["correlation"]) for pair in numbers["trade_offs"]]
    return {
        "boat": list(derived.headlines(numbers["derived"])),
        "stable": [
            {"where": derived.STABILITIES[name], **shares} for name, shares in numbers["derived"]["stable"].items()
        ],
        "known": known,
        "best": best[:BEST],
        "n_coefficients": len(rows),
        "n_sharper": len(narrowed) - len(known),
        "n_untouched": len(rows) - len(narrowed),
        "n_null": sum(rank["null_dimension"] for rank in numbers["ranks"].values()),
        "n_faint": sum(rank["rank"] - rank["practical_rank"] for rank in numbers["ranks"].values()),
        "not_unique": null_count(numbers["ranks"]),
        "hold": [name for rank in numbers["ranks"].values() for name in rank["pivots"]],
        "pairs": [pair for pair in numbers["trade_offs"] if abs(pair["correlation"]) >= STRONG],
        "n_pairs": sum(size >= NOTABLE for size in sizes),
        "marks": list(_marks(numbers)),
    }


def _marks(numbers: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Whether the sampling, the fit, the prediction, the prior, the log and the cross-check are good, a row each."""
    verdict, sampling = numbers["verdict"], numbers["convergence"]
    reasons = "; ".join(sampling["shortcomings"])
    numbers_of_it = (
        f"R-hat {sampling['max_rhat']:.4f}, ESS {min(sampling['min_bulk_ess'], sampling['min_tail_ess']):.0f}"
    )
    yield _mark("sampling", sampling["converged"], "converged", "not converged", reasons or numbers_of_it)
    yield _mark("fit", numbers["criticism"]["fits"], "fits", "does not fit", verdict["fit"])
    if numbers["predictions"]:
        good = all(trial["predicts"] for trial in numbers["predictions"])
        yield _mark("prediction", good, "predicts", "does not predict", verdict["prediction"])
    if "prediction" in verdict and not numbers["predictions"]:
        yield {"topic": "prediction", "good": None, "word": "not tried", "text": verdict["prediction"]}
    if numbers["conflict"]["found"] or numbers["conflict"]["refuted"]:
        good = not numbers["conflict"]["refuted"]
        yield _mark("prior", good, "disagrees in part", "in conflict with the data", verdict.get("conflict", ""))
    if contradicted(numbers["rests_on"]):
        yield _mark("log", False, "", "contradicts itself", verdict["contradiction"])
    if check := numbers.get("cross_check"):
        yield _mark("second sampler", check["verdict"] == "agree", "agrees", "does not confirm", verdict["cross_check"])


def _mark(topic: str, good: bool, word: str, bad_word: str, text: str) -> dict[str, Any]:
    return {"topic": topic, "good": good, "word": word if good else bad_word, "text": text}
