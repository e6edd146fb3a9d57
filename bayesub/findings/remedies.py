"""What to do if the residuals say that the model is wrong, in sentences and in the words of a study file."""

from collections.abc import Sequence

import numpy as np

from bayesub.findings import proposals
from bayesub.inference.checks.discrepancy import Discrepancy, find_discrepancies
from bayesub.inference.checks.fit import OUTLIER, Criticism, expected_outliers
from bayesub.inference.sampling.sampler import SMOOTH
from bayesub.logs import log_files
from bayesub.problem import likelihoods
from bayesub.problem.alternatives import LeftOut
from bayesub.problem.nuisance import CURRENTS

_LISTED = 6  # channels in a sentence


def reasons(problem, criticism: Criticism, parameters: np.ndarray) -> list[Discrepancy]:
    """Why the residuals of a problem are correlated at parameters (n_params,), best first; empty if they are not."""
    if not any("correlated" in check.faults for check in criticism.suspects.values()):
        return []
    smooth = problem.smoothed(SMOOTH)
    return find_discrepancies(LeftOut(smooth), smooth.prior.standard(parameters))


def sentence(criticism: Criticism, problem, explained: Sequence[Discrepancy] = ()) -> str:
    """Whether the model of a problem fits, and if not what is wrong with which channels and what to do about it.

    Parameters
    ----------
    criticism : Criticism
    problem : Problem or JointProblem
    explained : sequence of Discrepancy
        Of correlated residuals, best first.
    """
    if not criticism.checks:
        return "Readings without noise have no residuals to judge the model by."
    chance = f"{criticism.n_tests} tests, {100 * criticism.false_alarms:g} % false alarms in all"
    if criticism.fits:
        return f"The residuals of every channel look like its noise model ({chance})."
    suspects = {}
    for name, check in criticism.suspects.items():
        suspects.setdefault(check.faults[0], {})[name] = check  # the others may follow from the first
    conclusion = "The noise is smaller than its model says, and the intervals are too wide"
    if suspects.keys() != {"small"}:
        conclusion = "The model does not fit, and then the intervals are too narrow"
    if explained and "correlated" in suspects:
        details = [f"{_neighbours(suspects.pop('correlated'))}. {proposals.sentence(explained)}"]
    else:
        details = []
    details += [describe(suspects[fault], problem) for fault, describe in _SENTENCES.items() if fault in suspects]
    return f"{conclusion} ({chance}). {' '.join(details)}"


def _neighbours(checks):
    neighbours = _listed({name: f"{check.correlations[0]:.2f}" for name, check in checks.items()})
    return f"Residuals follow from those before them, with correlation of neighbours {neighbours}"


def _correlated(checks, problem):
    remedies = []
    currents = [name for name in CURRENTS if not _inferred(name, problem)]
    if currents and any(problem.channels[name][0].over_ground for name in checks):
        remedies.append(f"a current ({_nuisance(currents)})")
    biases = [f"bias_{column}" for column in _columns(checks, problem) if not _inferred(f"bias_{column}", problem)]
    if biases:
        remedies.append(f"a bias ({_nuisance(biases)})")
    remedies.append("a coefficient held at a wrong value")
    white = [name for name in checks if not isinstance(problem.channels[name][1], likelihoods.AR1)]
    slow = (
        f"; or the noise itself is slow ({_noise('ar1', white, problem)}, with a correlation_time_s)" if white else ""
    )
    return f"{_neighbours(checks)}: something slow is missing, such as {', '.join(remedies)}{slow}."


def _outliers(checks, problem):
    expected = {name: expected_outliers(check.n_readings) for name, check in checks.items()}
    counts = {name: f"{check.n_outliers:.0f} ({expected[name]:.1f} expected)" for name, check in checks.items()}
    normal = [name for name in checks if not isinstance(problem.channels[name][1], likelihoods.StudentT)]
    remedy = (
        f"{_noise('student_t', normal, problem)}, with dof = 4" if normal else f"a lower dof of {', '.join(checks)}"
    )
    return f"Outliers beyond {OUTLIER:g} sd: {_listed(counts)}; give {remedy}."


def _large(checks, problem):
    return (
        f"Residuals over their noise: {_sizes(checks)}; raise the sd, or give {_noise('unknown_sd', checks, problem)}."
    )


def _small(checks, problem):
    return (
        f"Residuals under their noise: {_sizes(checks)}; lower the sd, or give {_noise('unknown_sd', checks, problem)}."
    )


def _shape(checks, problem):
    columns = ", ".join(_columns(checks, problem))
    return (
        f"Residuals not distributed as their noise: {columns}; look at the figure, and at the resolution of the sensor."
    )


_SENTENCES = {"correlated": _correlated, "outliers": _outliers, "large": _large, "small": _small, "shape": _shape}


def _sizes(checks) -> str:
    return _listed({name: f"{check.chi_square_per_reading**0.5:.2g} times" for name, check in checks.items()})


def _listed(values: dict) -> str:
    first = [f"{name} {value}" for name, value in list(values.items())[:_LISTED]]
    return ", ".join(first) + (f" and {len(values) - _LISTED} more" if len(values) > _LISTED else "")


def _columns(names, problem) -> list[str]:
    """The columns of channels by name, each once."""
    return list(dict.fromkeys(log_files.HEADERS[problem.channels[name][0].quantity] for name in names))


def _inferred(nuisance, problem) -> bool:
    """Whether a problem infers a nuisance parameter, or that of any of its trials."""
    return any(name.partition("[")[0] == nuisance for name in problem.names)


def _noise(kind, names, problem) -> str:
    return f'kind = "{kind}" in {", ".join(f"[noise.{column}]" for column in _columns(names, problem))}'


def _nuisance(names) -> str:
    return f"{', '.join(names)} in [nuisance]"
