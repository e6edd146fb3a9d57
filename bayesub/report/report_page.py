"""The short page of a report in Markdown."""

from collections.abc import Mapping, Sequence
from importlib import metadata

from bayesub.findings.run_numbers import reference_word
from bayesub.io.words import rounded, uncertain
from bayesub.report.markdown import table
from bayesub.report.study_page import StudyPage


def markdown_page(
    numbers: dict,
    captions: Mapping[str, str],
    coefficients: Sequence[Mapping[str, str]],
    commit: str | None = None,
) -> str:
    """The short page of a report, Markdown, for folders that are read where HTML is not shown.

    Parameters
    ----------
    numbers : dict
        The content of ``numbers.json``.
    captions : mapping
        File of a figure -> caption.
    coefficients : sequence of mappings
        Of the equation set, as :func:`bayesub.findings.equation_card.glossary` has them.
    commit : str, optional
        Of the sources.
    """
    verdict, convergence, cost = numbers["verdict"], numbers["convergence"], numbers["cost"]
    shortcomings = "; ".join(convergence["shortcomings"])
    converged = "Converged." if convergence["converged"] else f"NOT CONVERGED: {shortcomings}."
    topics = (
        "jumps",
        "prediction",
        "derived",
        "conflict",
        "guess",
        "disturbance",
        "prior",
        "directions",
        "null",
        "trade_offs",
        "normality",
        "sqp",
        "cross_check",
    )
    rows = [
        (
            f"`{row['name']}`",
            rounded(row["reference"], row["sd"]),
            uncertain(row["prior_mean"], row["prior_sd"]),
            uncertain(row["mean"], row["sd"]),
            f"{row['contraction']:.2g}",
            row["hangs_on"],
        )
        for row in numbers["parameters"] + numbers["nuisance"]
    ]
    heads = (
        "name",
        reference_word(numbers),
        "prior, mean ± sd",
        "posterior, mean ± sd",
        "posterior / prior sd",
        "hangs on",
    )
    page = StudyPage(
        name=numbers["name"],
        question=numbers["question"] or f"What does the trial say of {numbers['vehicle']}?",
        background=f"{numbers['vehicle']}, {numbers['manoeuvre']}: {numbers['n_readings']} readings.",
        verdict=f"{converged} {verdict['fit']}",
        answer=verdict["answer"],
        pictures=captions,
        tables=[*table(("set-up", ""), numbers["set_up"].items()), "", *table(heads, rows)],
        method="\n\n".join(verdict[topic] for topic in topics if verdict.get(topic)),
        coefficients=coefficients,
        cost=f"{cost['evaluations']} simulations, {cost['jacobians']} Jacobians, {cost['sampling_seconds']:.0f} s.",
        code=f"Made by bayesub {metadata.version('bayesub')}{f', commit {commit}' if commit else ''}.",
    )
    return page.text()
