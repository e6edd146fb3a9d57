"""What is known of coefficients after a run, as a mean and a covariance, and the vehicle file that passes it on.

The posterior of the coefficients, all other parameters integrated out, is taken as normal. A trial with this prior then
ends at the posterior of both trials, if the posterior is normal and the trials share no other unknown.
"""

import textwrap
from importlib import metadata
from pathlib import Path

import numpy as np
import tomlkit

from bayesub.design.knowledge import Knowledge, of_draws, of_moments
from bayesub.inference.checks import normality
from bayesub.io import toml_files
from bayesub.io.words import listed
from bayesub.model.equations.files import beside
from bayesub.problem.priors import CoefficientPrior, Given
from bayesub.study.after.finished_run import FinishedRun
from bayesub.study.new import files


def coefficients(run: FinishedRun) -> list[int]:
    """Positions of the coefficients among the parameters of a posterior."""
    return [k for k, name in enumerate(run.posterior.names) if name in run.vehicle.equations.index]


def known(run: FinishedRun) -> Knowledge:
    """The posterior of the coefficients of a run as a normal distribution, all other parameters integrated out.

    Among them are those without part in its trials that its prior correlates with free ones, which inform them.
    """
    places = coefficients(run)
    found = of_draws([run.posterior.names[k] for k in places], run.posterior.draws[:, places])
    prior, _ = prior_of(run)
    pairs = prior.correlations if isinstance(prior, Given) else ()
    related = {name for *pair, _ in pairs for name in pair if not set(pair).isdisjoint(found.names)}
    if related <= set(found.names):
        return found
    equations = run.vehicle.equations
    manoeuvres = [trial.manoeuvre for trial in run.setup().trials.values()]
    active = {name for one in manoeuvres for name in equations.active(None, one, one.subproblem)}
    members = set(found.names) | related - active
    names = [name for name in equations.names if name in members]
    before = prior.on(equations.columns(names), run.vehicle.xi, equations)
    spread = before.chain(np.eye(len(names)), np.zeros(len(names)))
    return of_moments(names, before.mean, spread @ spread.T).updated(found)


def prior_of(run: FinishedRun) -> tuple[CoefficientPrior, dict[str, float]]:
    """The prior of the coefficients, and the values of those that are fixed."""
    return run.study.prior.build(run.vehicle.xi, run.vehicle, run.study.path)


def normality_of(run: FinishedRun) -> normality.Normality:
    """How normal the posterior of the coefficients is."""
    return normality.posterior_normality(run.posterior.part(np.array(coefficients(run))))


def vehicle_file(run: FinishedRun, path: Path) -> str:
    """The text of the vehicle file of a run, to be written to `path`: that of its boat with what is known now.

    `[prior] kind = "vehicle"` of another study reads it back.
    """
    study, posterior, knowledge = run.study, run.posterior, known(run)
    document = tomlkit.parse(toml_files.read_text(toml_files.find(study.path(study.vehicle), "vehicles")))
    equations = document.get("equations")
    if isinstance(equations, str) and toml_files.is_path(equations):
        document["equations"] = files.relative(path, study.path(beside(study.vehicle, equations)))
    origin = f"posterior of the study '{study.name}' by bayesub {metadata.version('bayesub')}"
    document["coefficients"].update(prior_of(run)[1])
    contraction = dict(zip(posterior.names, posterior.contraction.tolist(), strict=True))
    text = files.with_knowledge(document, origin, knowledge, contraction)
    said = (line for sentence in _head(run, knowledge) for line in textwrap.wrap(sentence, 116))
    return "".join(f"# {line}\n" for line in said) + text


def _head(run: FinishedRun, knowledge: Knowledge) -> list[str]:
    """The comment at the head of the file."""
    others = [name for name in run.posterior.names if name not in knowledge.names]
    lines = [
        f"The posterior of {len(knowledge.names)} coefficients by the study '{run.study.name}', taken as normal: "
        '[prior] kind = "vehicle" of another study starts from it. The digits are needed, where combinations are known '
        "far better than coefficients. What the trial does not determine is as wide here as its prior made it."
    ]
    if run.doubt:
        lines.insert(0, run.doubt)
    if others:
        some = listed([*others[:6], *([f"{len(others) - 6} more"] if len(others) > 6 else [])])
        lines.append(f"Integrated out: {some}. What two trials share of these is not passed on: fit both together.")
    return [*lines, normality_of(run).sentence]
