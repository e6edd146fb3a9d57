"""The report of a run: numbers, figures, and one self-contained page that says in words what they show."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import metadata
from pathlib import Path
from typing import Protocol

import numpy as np

from bayesub.inference.baselines import Estimate
from bayesub.inference.checks import jumps
from bayesub.inference.checks.explanations import Explanation, explanations
from bayesub.inference.checks.fit import Criticism, criticise
from bayesub.inference.identifiability import NullSpace, Spectrum, null_space
from bayesub.inference.sampling import CrossCheck, Posterior
from bayesub.inference.sampling.sampler import SMOOTH
from bayesub.io import seeds, templates
from bayesub.io.atomic import write_text, writing
from bayesub.model.quantities import Quantity
from bayesub.plots.style import powers, rounded, uncertain
from bayesub.problem.alternatives import LeftOut
from bayesub.problem.joint import JointProblem
from bayesub.problem.problem import Problem
from bayesub.report import (
    contents,
    derived,
    disturbances,
    drawings,
    findings,
    null_directions,
    proposals,
    remedies,
    set_up,
    symbols,
    unseen,
    widgets,
)
from bayesub.report.figures import figures
from bayesub.report.report_page import markdown_page
from bayesub.report.unseen import TrialPrediction

PREDICTIVE_DRAWS = 100


class ReportedStudy(Protocol):
    """What a report says of the study that asked."""

    name: str
    question: str
    seed: int


@dataclass(frozen=True)
class Results:
    """Everything that a report is about.

    Attributes
    ----------
    problem : Problem or JointProblem
        What was solved.
    estimates : sequence of Estimate
        By the baselines.
    spectrum : Spectrum
        With its null directions last.
    posterior : Posterior
        What was sampled.
    check : CrossCheck or None
        The comparison with another sampler.
    predictions : sequence of TrialPrediction
        Of trials that were not fitted.
    rng : numpy.random.Generator
        Chooses the draws at which motions and residuals are looked at, and boats of the prior; nothing else in a report
        is random.
    quantities : sequence of Quantity
        That follow from the coefficients, besides the built-in ones.
    """

    problem: Problem | JointProblem
    estimates: Sequence[Estimate]
    spectrum: Spectrum
    posterior: Posterior
    check: CrossCheck | None
    rng: np.random.Generator
    predictions: Sequence[TrialPrediction] = ()
    quantities: Sequence[Quantity] = ()

    @cached_property
    def summary(self) -> Posterior:
        """The posterior of the parameters that tables and figures are of."""
        return self.posterior.part(self.problem.others)

    @cached_property
    def draws(self) -> np.ndarray:
        """(PREDICTIVE_DRAWS, n_params) of the posterior, at which motions and residuals are looked at."""
        return self.posterior.draws[self.rng.choice(len(self.posterior.draws), PREDICTIVE_DRAWS)]

    @cached_property
    def foretold(self) -> np.ndarray:
        """(PREDICTIVE_DRAWS, n_params) of the prior, which are drawn beside those of the posterior."""
        return self.problem.prior.sample(self.rng.spawn(1)[0], PREDICTIVE_DRAWS)

    @cached_property
    def forces(self) -> list[disturbances.InferredForces]:
        """Histories of unmodelled forces, of each trial that has them."""
        return list(disturbances.inferred_forces(self.problem, self.posterior.draws))

    @cached_property
    def derived(self) -> derived.Derived:
        """What follows from the coefficients, of the prior and of the posterior."""
        (rng,) = self.rng.spawn(1)
        return derived.derive(self.problem, self.posterior.draws, rng, self.quantities)

    @cached_property
    def residuals(self) -> dict[str, np.ndarray]:
        """Channel -> quantile residuals (PREDICTIVE_DRAWS, n_readings)."""
        return self.problem.quantile_residuals(self.draws, self.rng)

    @cached_property
    def times(self) -> dict[str, np.ndarray]:
        """Channel -> times (n_readings,) of its residuals, s."""
        return {name: self.problem.channels[name][0].times for name in self.residuals}

    @cached_property
    def criticism(self) -> Criticism:
        """What the residuals say of the model."""
        return criticise(self.residuals, self.times)

    @cached_property
    def explanations(self) -> list[Explanation]:
        """Why residuals are correlated, best first; empty if they are not."""
        if not any("correlated" in check.faults for check in self.criticism.suspects.values()):
            return []
        smooth = self.problem.smoothed(SMOOTH)
        return explanations(LeftOut(smooth), smooth.prior.standard(self.posterior.best))

    @cached_property
    def null_space(self) -> NullSpace:
        """The directions that leave the motion the same, where the spectrum was taken."""
        at = self.posterior.best.copy()
        at[self.problem.others] = self.spectrum.values
        return null_space(self.problem, at)


def write_report(
    folder: str | Path,
    problem: Problem | JointProblem,
    estimates: Sequence[Estimate],
    spectrum: Spectrum,
    posterior: Posterior,
    *,
    study: ReportedStudy | None = None,
    seconds: Mapping[str, float] | None = None,
    check: CrossCheck | None = None,
    predictions: Sequence[TrialPrediction] = (),
    quantities: Sequence[Quantity] = (),
    pdf: bool = False,
    commit: str | None = None,
    origin: Mapping[str, str] | None = None,
) -> dict:
    """Write ``numbers.json``, the figures, ``report.html`` and ``report.md`` into a folder.

    The draws at which motions and residuals are looked at are chosen by a stream of the study's seed (of seed 0 if
    there is no study), so that a report which is written again says the same.

    Parameters
    ----------
    folder : str or Path
        Made if it does not exist.
    problem : Problem or JointProblem
        What was solved.
    estimates : sequence of Estimate
        By the baselines; may be empty.
    spectrum : Spectrum
        From :func:`bayesub.inference.identifiability.fisher`.
    posterior : Posterior
        From :func:`bayesub.sample`.
    study : object with name, question and seed, optional
        The study that asked.
    seconds : mapping, optional
        Stage -> wall time, for the table of costs.
    check : CrossCheck, optional
        From :func:`bayesub.cross_check`.
    predictions : sequence of TrialPrediction
        Of trials that were not fitted.
    quantities : sequence of Quantity
        That follow from the coefficients, besides the built-in ones (:mod:`bayesub.model.quantities`).
    pdf : bool
        Whether every figure is saved as PDF too, beside the PNG.
    commit : str, optional
        Of the sources, for the foot of the page.
    origin : mapping, optional
        What made the run, for the set-up at the top of the page, such as versions and date: title -> text.

    Returns
    -------
    dict
        The content of ``numbers.json``: "converged" among "convergence", the sentences under "verdict".

    Raises
    ------
    InputError
        If the folder cannot be written to.
    """
    rng = seeds.generator(study.seed if study else 0, seeds.REPORT)
    results = Results(problem, estimates, spectrum, posterior, check, rng, predictions, quantities)
    numbers = numbers_of(results)
    numbers["name"] = study.name if study else problem.vehicle.name
    numbers["question"] = study.question if study else ""
    numbers["seconds"] = dict(seconds or {})
    numbers["set_up"] |= ({"seed": str(study.seed)} if study else {}) | dict(origin or {})
    reference, word = problem.reference[problem.others], findings.reference_word(numbers)
    suffixes = (".png", ".pdf") if pdf else (".png",)
    folder = Path(folder)
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        pictures = {}
        for figure in figures(results, reference, word, numbers["baselines"]):
            pictures[figure.name] = (figure.caption, drawings.drawn(figure, folder, suffixes))
        write_text(folder / "numbers.json", json.dumps(numbers, indent=1))
        live = widgets.content(results, numbers, reference, word)
        write_text(folder / "report.html", page(numbers, pictures, commit, live))
        captions = {f"{name}.png": caption for name, (caption, _) in pictures.items()}
        write_text(folder / "report.md", markdown_page(numbers, captions, problem.equations, commit))
    return numbers


def numbers_of(results: Results) -> dict:
    """Every number of a report and its sentences, as JSON types, without those of the study that asked."""
    numbers = findings.collect(
        results.problem, results.estimates, results.spectrum, results.posterior, results.null_space
    )
    numbers["set_up"] = set_up.rows(results.problem)
    numbers["criticism"] = results.criticism.to_json()
    reasons = results.explanations
    numbers["criticism"]["explanations"] = [reason.to_json() for reason in reasons]
    numbers["disturbance"] = disturbances.numbers(results.problem, results.posterior.draws, results.forces)
    numbers["predictions"] = unseen.numbers(results.predictions)
    numbers["derived"] = derived.numbers(results.derived)
    trials = [trial for _, trial, _ in results.problem.each_trial(results.posterior.best)]
    n_logs = sum(trial.record.truth is None for trial in trials)
    numbers["verdict"] = unseen.sentence(numbers["predictions"], n_logs, len(trials)) | {
        "fit": remedies.sentence(results.criticism, results.problem, reasons)
    }
    if reasons:
        numbers["verdict"]["lines_to_add"] = proposals.lines(reasons[0], results.problem)
    numbers["verdict"] |= disturbances.sentences(numbers["disturbance"]) | findings.sentences(numbers)
    numbers["verdict"]["derived"] = derived.sentence(numbers["derived"])
    if not results.posterior.converged:
        jump = jumps.largest_jump(results.problem, results.posterior.draws, results.rng.spawn(1)[0])
        numbers["convergence"]["largest_jump"] = jump
        if said := jumps.sentence(jump, numbers["step_s"]):
            numbers["verdict"]["jumps"] = said
    if results.check is not None:
        numbers["cross_check"] = results.check.to_json()
        numbers["verdict"]["cross_check"] = results.check.sentence
    return numbers


def page(
    numbers: dict, pictures: Mapping[str, tuple[str, bytes]], commit: str | None = None, live: dict | None = None
) -> str:
    """The page of a report, HTML.

    Parameters
    ----------
    numbers : dict
        The content of ``numbers.json``.
    pictures : mapping
        Name of a figure -> its caption and its PNG or SVG.
    commit : str, optional
        Of the sources, for the foot of the page.
    live : dict, optional
        What :func:`bayesub.report.widgets.content` gives; without it the page has figures that stand still.
    """
    sheet = drawings.Sheet()
    placed = {name: sheet.placed(*picture) for name, picture in pictures.items()}
    text = templates.fill(
        "bayesub.report",
        "report.html",
        numbers=numbers,
        pictures=placed,
        glyphs=sheet.shared,
        widgets=live,
        word=findings.reference_word(numbers),
        interval=derived.in_words,
        rounded=rounded,
        uncertain=uncertain,
        powers=powers,
        percent=null_directions.percent,
        symbol=symbols.html,
        version=metadata.version("bayesub"),
        commit=commit,
    )
    return contents.with_contents(text)
