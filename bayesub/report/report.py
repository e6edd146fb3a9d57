"""The report of a run: numbers, figures, and one self-contained page that says in words what they show."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from typing import Any

from bayesub.findings import derived
from bayesub.findings.equation_card import glossary
from bayesub.findings.results import AnyProblem, Quantity, Results, numbers_of
from bayesub.findings.run_numbers import percent, reference_word
from bayesub.findings.unseen import TrialPrediction
from bayesub.findings.verdicts import in_words
from bayesub.inference.baselines import Estimate
from bayesub.inference.identifiability import Spectrum
from bayesub.inference.sampling import CrossCheck, Posterior
from bayesub.io.arguments import checked
from bayesub.io.atomic import write_text, writing
from bayesub.io.terminal import SILENT, Progress
from bayesub.io.words import markdown
from bayesub.report import page as pages
from bayesub.report import widgets
from bayesub.report.figures import figures
from bayesub.report.markdown import StudyPage, table
from bayesub.report.parameter_tables import columns


@dataclass(frozen=True)
class ReportedStudy:
    """What a report says of the study that asked."""

    name: str
    question: str
    seed: int = 0
    seconds: Mapping[str, float] = field(default_factory=dict)  # stage -> wall time, for the table of costs
    commit: str | None = None  # of the sources, for the foot of the page
    # What made the run, such as versions and date, for the set-up at the top of the page: title -> text
    origin: Mapping[str, str] = field(default_factory=dict)
    progress: Progress = SILENT  # who hears which figure is drawn
    # What to measure or fly next, as :meth:`bayesub.design.prescription.Prescription.to_json` has it
    prescription: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


@checked
def write_report(
    folder: str | Path,
    problem: AnyProblem,
    estimates: Sequence[Estimate],
    spectrum: Spectrum,
    posterior: Posterior,
    *,
    study: ReportedStudy | None = None,
    check: CrossCheck | None = None,
    predictions: Sequence[TrialPrediction] = (),
    quantities: Sequence[Quantity] = (),
    pdf: bool = False,
) -> dict:
    """Write ``numbers.json``, the figures, ``report.html`` and ``report.md`` into a folder.

    The draws at which motions and residuals are looked at are chosen by a stream of the study's seed (of seed 0 if
    there is no study), so that a report which is written again says the same. InputError if it cannot be written. What
    is returned is the content of ``numbers.json``: "converged" among "convergence", the sentences under "verdict".

    Parameters
    ----------
    folder : made if it does not exist
    problem : what was solved
    estimates : by the baselines; may be empty
    spectrum : from :func:`bayesub.inference.identifiability.fisher`, with the draws of the posterior
    posterior : from :func:`bayesub.sample`
    study : the study that asked
    check : from :func:`bayesub.cross_check`
    predictions : of trials that were not fitted
    quantities : that follow from the coefficients, besides the built-in ones (:mod:`bayesub.model.quantities`)
    pdf : whether every figure is saved as PDF too, beside the PNG
    """
    asked = study or ReportedStudy(problem.vehicle.name, "")
    results = Results(
        problem, estimates, spectrum, posterior, check, asked.seed, predictions, quantities, asked.prescription
    )
    numbers = numbers_of(results)
    numbers |= {"name": asked.name, "question": asked.question, "seconds": dict(asked.seconds)}
    numbers["set_up"] |= ({"seed": str(asked.seed)} if study else {}) | dict(asked.origin)
    reference, word = problem.reference[problem.others], reference_word(numbers)
    folder = Path(folder)
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        drawn = list(figures(results, reference, word, numbers["baselines"]))
        pictures = pages.draw_all(drawn, folder, pdf=pdf, progress=asked.progress)
        write_text(folder / "numbers.json", json.dumps(numbers, indent=1))
        live = widgets.content(results, reference, word)
        write_text(folder / "report.html", page(numbers, pictures, asked.commit, live))
        captions = {f"{name}.png": caption for name, (caption, _) in pictures.items() if not name.endswith("_small")}
        write_text(folder / "report.md", markdown_page(numbers, captions, glossary(problem.equations), asked.commit))
    return numbers


def page(
    numbers: dict, pictures: Mapping[str, tuple[str, bytes]], commit: str | None = None, live: dict | None = None
) -> str:
    """The page of a report, HTML, of the content of ``numbers.json``, by name of a figure its caption and picture.

    `live`: what :func:`bayesub.report.widgets.content` gives, without which the page has figures that stand still.
    """
    word, outcome = reference_word(numbers), in_words(numbers["outcome"]["verdict"])
    content = {"numbers": numbers, "outcome": outcome, "widgets": live, "word": word, "commit": commit}
    tools = {"interval": derived.in_words, "percent": percent, "symbol": pages.symbol}
    return pages.fill("report.html", pictures, columns=columns(numbers, word), **content, **tools)


def markdown_page(
    numbers: dict, captions: Mapping[str, str], coefficients: Sequence[Mapping[str, str]], commit: str | None = None
) -> str:
    """The short page of a report, Markdown, for folders that are read where HTML is not shown.

    `captions`: file of a figure -> caption; `coefficients`: of the equation set (:func:`.equation_card.glossary`).
    """
    verdict, convergence, cost = numbers["verdict"], numbers["convergence"], numbers["cost"]
    shortcomings = "; ".join(convergence["shortcomings"])
    converged = "Converged." if convergence["converged"] else f"NOT CONVERGED: {shortcomings}."
    topics = "jumps prediction derived steps conflict contradiction rests_on guess disturbance prior directions null "
    topics += "others_known known_sums trade_offs normality sqp next"
    word, vehicle = reference_word(numbers), markdown(numbers["vehicle"])
    wanted = ("mean ± sd", word, "prior mean ± sd", "sd, all others known")
    shown = [column for column in columns(numbers, word) if column.head.partition(" ×")[0] in wanted]
    rows = [
        (f"`{row['name']}`", *(column.cells[k] for column in shown), f"{row['contraction']:.2g}")
        for k, row in enumerate(numbers["parameters"] + numbers["nuisance"])
    ]
    heads = ("name", *(column.head for column in shown), "posterior / prior sd")
    set_up = (map(markdown, row) for row in numbers["set_up"].items())
    page = StudyPage(
        name=numbers["name"],
        question=numbers["question"] or f"What does the trial say of {vehicle}?",
        background=f"{vehicle}, {markdown(numbers['manoeuvre'])}: {numbers['n_readings']} readings.",
        verdict=f"**{in_words(numbers['outcome']['verdict'])}.** {converged} {verdict['fit']}",
        answer=("Not to be used. " if numbers["outcome"]["status"] else "") + verdict["answer"],
        pictures=captions,
        tables=[*table(("set-up", ""), set_up), "", *table(heads, rows)],
        method="\n\n".join(verdict[topic] for topic in (*topics.split(), "cross_check") if verdict.get(topic)),
        coefficients=coefficients,
        cost=f"{cost['evaluations']} simulations, {cost['jacobians']} Jacobians, {cost['sampling_seconds']:.0f} s.",
        code=f"Made by bayesub {metadata.version('bayesub')}{f', commit {commit}' if commit else ''}.",
    )
    return page.text()
