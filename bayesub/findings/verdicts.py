"""The verdict on a run, which its folder, its page, the last line of its commands and their exit status share."""

from collections.abc import Iterable, Sequence
from typing import Any

FITS, CLAIM_HOLDS, SKIPPED = "converged and fits", "claim holds", "skipped"
IN_CONFLICT, DOES_NOT_PREDICT, DOES_NOT_FIT = "in conflict with the prior", "does not predict", "does not fit"
CONTRADICTED = "contradicts itself"
NOT_CONFIRMED, NOT_CONVERGED, CLAIM_FAILED = "not confirmed", "not converged", "claim failed"
NOT_FLOWN, NOT_FINISHED, FAILED = "does not complete the manoeuvre", "not finished", "failed"
STATUS = {  # exit status of each, the gravest last; 2 is bad input
    FITS: 0,
    CLAIM_HOLDS: 0,
    SKIPPED: 0,
    IN_CONFLICT: 3,
    CONTRADICTED: 10,
    DOES_NOT_PREDICT: 4,
    DOES_NOT_FIT: 5,
    NOT_CONFIRMED: 6,
    NOT_CONVERGED: 7,
    CLAIM_FAILED: 8,
    NOT_FLOWN: 9,
    NOT_FINISHED: 1,
    FAILED: 1,
}
MEANING = {  # of those on a posterior that is not to be used as it is
    IN_CONFLICT: "the data lie where the prior has almost no probability; look at both before you use the answer",
    CONTRADICTED: "the log contradicts a scale, zero or clock that is held fixed; correct it or infer it",
    DOES_NOT_PREDICT: "a log that was not fitted is not predicted; do not use the answer beyond the fitted trials",
    DOES_NOT_FIT: "the residuals do not look like the noise model; do not use the answer",
    NOT_CONFIRMED: "a second sampler finds another posterior, or is inconclusive; do not use the answer",
    NOT_CONVERGED: "the intervals may be wrong; do not use the answer",
}


CONTRADICTION = 4.0  # standard deviations from where it is held: of twenty faults one in 800 right studies has one


def contradicted(rows: Iterable[dict[str, Any]]) -> bool:
    """Whether a log contradicts where a scale, zero or clock is held (rows of :mod:`.rests_on`)."""
    return any(abs(row["off"] or 0.0) >= CONTRADICTION for row in rows)


def in_words(verdict: str, reasons: Sequence[str] = ()) -> str:
    """The verdict with its reasons, or what it means."""
    text = "; ".join(reasons) or MEANING.get(verdict, "")
    return verdict.upper() + (f": {text}" if text else "")


def worst(verdicts: Iterable[str]) -> str:
    """The gravest of several verdicts."""
    return max(verdicts, key=list(STATUS).index)


def verdict_on(numbers: dict[str, Any]) -> str:
    """The verdict on a posterior by the content of its ``numbers.json``: the gravest of all that is wrong with it."""
    check = numbers.get("cross_check")
    wrong = {
        NOT_CONVERGED: not numbers["convergence"]["converged"],
        NOT_CONFIRMED: check is not None and check["verdict"] != "agree",
        DOES_NOT_FIT: not numbers["criticism"]["fits"],
        DOES_NOT_PREDICT: not all(trial["predicts"] for trial in numbers["predictions"]),
        CONTRADICTED: contradicted(numbers.get("rests_on", [])),
        IN_CONFLICT: numbers["conflict"]["refuted"],
    }
    return worst([FITS, *(words for words, is_wrong in wrong.items() if is_wrong)])
