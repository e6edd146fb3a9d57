"""What to do if residuals say that the model is wrong, in sentences and in the lines of a study file.

Of correlated residuals there are explanations, and lines that let a run infer what explains them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from bayesub.findings.set_up import AnyProblem, noise_sds
from bayesub.inference.checks.discrepancy import Discrepancy, find_discrepancies
from bayesub.inference.checks.fit import OUTLIER, Criticism, criticise, expected_outliers
from bayesub.inference.interface import SMOOTH
from bayesub.io import templates
from bayesub.io.words import listed
from bayesub.logs import log_files
from bayesub.model.actuators import command_column
from bayesub.problem import likelihoods
from bayesub.problem.alternatives import LeftOut
from bayesub.problem.nuisance import CURRENTS

_CLOSE, _SHARE = 3.0, 0.05  # nats, and share of its gain, by which the best must lead to be named alone
_LOG_SD, _LOG_SD_TIME = 0.7, 0.5  # of the priors of an sd and of a correlation time about their estimates
_WIDER = 2.0  # sd of the prior of a bias or current, over the size that was found
_NAMES = {
    "bias": "biases",
    "current": "a current",
    "coefficient": "a coefficient held at a wrong value",
    "disturbance": "unmodelled forces",
    "slow noise": "slow sensors",
}
_ADD = "the lines to add"
_STEP = 0.15  # of its range, by which a control steps from one row to the next
_STEPS, _AFTER, _LARGER = 3, 3.0, 2.0  # steps at least; readings after one; by how much residuals are larger there
_LISTED = 6  # channels in a sentence


def explain(problem: AnyProblem, criticism: Criticism, parameters: np.ndarray) -> list[Discrepancy]:
    """Why the residuals of a problem are correlated at parameters (n_params,), best first; empty if they are not."""
    if not any(check.faults[0] == "correlated" for check in criticism.suspects.values()):
        return []
    smooth = problem.smoothed(SMOOTH)
    return find_discrepancies(LeftOut(smooth), smooth.prior.standard(parameters))


def advise(criticism: Criticism, problem: AnyProblem, explained: Sequence[Discrepancy] = ()) -> str:
    """Whether the model of a problem fits, and if not what is wrong with which channels and what to do about it.

    `explained`: of correlated residuals, best first.
    """
    if not criticism.checks:
        return "Readings without noise have no residuals to judge the model by."
    chance = f"{criticism.n_tests} tests, {100 * criticism.false_alarms:g} % false alarms in all"
    if criticism.fits:
        return f"The residuals of every channel look like its noise model ({chance})."
    suspects: dict[str, dict] = {}
    for name, check in criticism.suspects.items():
        suspects.setdefault(check.faults[0], {})[name] = check  # the others may follow from the first
    conclusion = "The noise is smaller than its model says, and the intervals are too wide"
    if suspects.keys() != {"small"}:
        conclusion = "The model does not fit, so that the intervals are too narrow"
    details = []
    if explained and "correlated" in suspects:
        details = [f"{_neighbours(suspects.pop('correlated'))}. {look_like(explained)}"]
    details += [describe(suspects[fault], problem) for fault, describe in _SENTENCES.items() if fault in suspects]
    return f"{conclusion} ({chance}). {' '.join(details)}"


def on_steps(problem: AnyProblem, residuals: Mapping[str, np.ndarray]) -> str:
    """The control that steps between its rows after which residuals are largest, in words; empty if there is none.

    `residuals`: channel -> (n_draws, n) quantile residuals. A log has no more than a straight line between two rows.
    """
    best, words = _LARGER, ""
    for trial_name, trial, _ in problem.each_trial(problem.prior.mean):
        manoeuvre, trials = trial.manoeuvre, f"[{trial_name}]" if trial_name else ""
        ordered = {manoeuvre.logged(name) for name in manoeuvre.commanded}
        for name, history in manoeuvre.log.items() if trial.record.truth is None else ():
            steps = (np.abs(np.diff(history)) > _STEP * np.ptp(history)) & (name not in ordered)
            begin, end = manoeuvre.times[:-1][steps], manoeuvre.times[1:][steps]
            for channel in trial.record.channels if len(begin) >= _STEPS else ():
                sizes = np.abs(residuals.get(f"{channel.name}{trials}", np.zeros((1, len(channel.times))))).mean(axis=0)
                k = np.searchsorted(begin, channel.times, side="right") - 1
                after = (k >= 0) & (channel.times <= end[k] + _AFTER * float(np.median(np.diff(channel.times))))
                if after.all():
                    continue
                largest = np.zeros(len(begin))
                np.maximum.at(largest, k[after], sizes[after])
                most, usual = float(np.median(largest)), float(np.quantile(sizes[~after], 0.9, method="lower"))
                if most < max(OUTLIER, best * usual):
                    continue
                best, column = most / usual, log_files.HEADERS.get(name, name)
                command = f"the command ({command_column(column)}), or " if "_" in column else ""
                words = f"residuals of {channel.name}{trials} reach {most:.2g} after steps of {column} from one row to "
                words += f"the next, and {usual:.2g} elsewhere. A straight line joins the rows: log {command}the "
                words += "control more often."
    return words


def _neighbours(checks):
    neighbours = _listed({name: f"{check.correlations[0]:.2f}" for name, check in checks.items()})
    return f"Neighbouring residuals are correlated: {neighbours}"


def _correlated(checks, problem):
    remedies = []
    currents = [name for name in CURRENTS if not _is_free(name, problem)]
    if currents and any(problem.channels[name][0].over_ground for name in checks):
        remedies.append(f"a current ({_nuisance(currents)})")
    biases = [f"bias_{column}" for column in _columns(checks, problem) if not _is_free(f"bias_{column}", problem)]
    if biases:
        remedies.append(f"a bias ({_nuisance(biases)})")
    remedies.append("a coefficient held at a wrong value")
    white = [name for name in checks if not isinstance(problem.channels[name][1], likelihoods.AR1)]
    text = f"{_neighbours(checks)}: something slow is missing, such as {', '.join(remedies)}"
    slow = f"; or the noise itself is slow ({_noise('ar1', white, problem)}, with a correlation_time_s)"
    return f"{text}{slow if white else ''}."


def _outliers(checks, problem):
    expected = {name: expected_outliers(check.n_readings) for name, check in checks.items()}
    counts = {name: f"{check.n_outliers:.0f} ({expected[name]:.1f} expected)" for name, check in checks.items()}
    normal = [name for name in checks if not isinstance(problem.channels[name][1], likelihoods.StudentT)]
    heavier = f"{_noise('student_t', normal, problem)}, with dof = 4"
    remedy = heavier if normal else f"a lower dof of {', '.join(checks)}"
    return f"Outliers beyond {OUTLIER:g} sd: {_listed(counts)}; give {remedy}."


def _wrong_sd(side, remedy, checks, problem):
    sizes = {name: f"{check.chi_square_per_reading**0.5:.2g} times" for name, check in checks.items()}
    size, noise = f"size of residuals over that of their noise {_listed(sizes)}", _noise("unknown_sd", checks, problem)
    return f"Standard deviations too {side}: {size}; {remedy} the sd, or give {noise}."


def _shape(checks, problem):
    columns = ", ".join(_columns(checks, problem))
    remedy = "look at the figure, and at the resolution of the sensor"
    return f"Residuals not distributed as their noise: {columns}; {remedy}."


_SENTENCES: dict[str, Callable] = {
    "correlated": _correlated,
    "outliers": _outliers,
    "large": partial(_wrong_sd, "small", "raise"),
    "small": partial(_wrong_sd, "large", "lower"),
    "shape": _shape,
}


def _listed(values: dict) -> str:
    first = [f"{name} {value}" for name, value in list(values.items())[:_LISTED]]
    return ", ".join(first) + (f" and {len(values) - _LISTED} more" if len(values) > _LISTED else "")


def _columns(names, problem) -> list[str]:
    """The columns of channels by name, each once."""
    return list(dict.fromkeys(log_files.HEADERS[problem.channels[name][0].quantity] for name in names))


def _is_free(nuisance, problem) -> bool:
    """Whether a problem infers a nuisance parameter, or that of any of its trials."""
    return any(name.partition("[")[0] == nuisance for name in problem.names)


def _noise(kind, names, problem) -> str:
    return f'kind = "{kind}" in {", ".join(f"[noise.{column}]" for column in _columns(names, problem))}'


def _nuisance(names) -> str:
    return f"{', '.join(names)} in [nuisance]"


def look_like(explanations: Sequence[Discrepancy]) -> str:
    """What the residuals look like, by how much, and what to do; of explanations, best first and at least one."""
    best, *others = explanations
    if not others:
        return f"They look as if {_words(best)} ({best.gain:.0f} nats better than by their noise); {_ADD} infer it."
    second = others[0]
    lead = best.gain - second.gain
    if lead < max(_CLOSE, _SHARE * best.gain):
        text = f"They look as if {_words(best)}, or nearly as well ({lead:.0f} nats less) as if {_words(second)}"
        return f"{text}; {_ADD} infer the first."
    return f"They look as if {_words(best)} ({lead:.0f} nats better than {_NAMES[second.kind]}); {_ADD} infer it."


def _words(explanation) -> str:
    names = listed(list(explanation.sizes))
    return {
        "bias": f"{names} were missing",
        "current": "a current were missing",
        "coefficient": f"{names} were held at a wrong value",
        "disturbance": f"forces on {names} were missing",
        "slow noise": f"the noise of {names} were slow",
    }[explanation.kind]


def lines_to_add(explanation: Discrepancy, problem: AnyProblem, mode: np.ndarray) -> str:
    """The lines of a study file that infer what an explanation is about, of errors at a mode (n_params,).

    Sections that the study has already are to be joined with them.
    """
    sizes, sds = explanation.sizes, noise_sds(problem, mode)
    noises: dict[str, tuple[float, float]] = {}
    if explanation.kind == "current":  # both components that are not inferred yet, with the size of either
        sizes = {name: size for size in sizes.values() for name in CURRENTS if name not in problem.names}
    for name, size in sizes.items() if explanation.kind == "slow noise" else ():
        channel, _ = problem.channels[name]
        column = log_files.HEADERS[channel.quantity]
        sd = size * sds[name] / log_files.si_factor(column)
        noises.setdefault(column, (sd, explanation.times[name]))  # of several trials the first
    free = {*problem.names[: problem.n_coefficients], *sizes}
    coefficients = [name for name in problem.equations.names if name in free]
    values = {"sizes": sizes, "noises": noises, "coefficients": coefficients, "times": explanation.times}
    values |= {"log_sd": _LOG_SD, "log_sd_time": _LOG_SD_TIME, "wider": _WIDER}
    return templates.fill("bayesub.findings", "lines_to_add.toml", kind=explanation.kind, **values).rstrip("\n")


@dataclass(frozen=True)
class ModeFit:
    """How the posterior mode fits."""

    # Median size of the residuals over that of their noise, of the worst channel; one if the mode fits. A few outliers
    # leave it alone
    misfit: float = 1.0
    channel: str = ""  # the worst channel; empty if no channel has residuals
    # What is wrong and what to try, by topic as in a report; empty if nothing is
    sentences: dict[str, str] = field(default_factory=dict)
    small_sd: str = ""  # why the sd of the worst channel may be all that is wrong; empty if it is not

    def to_json(self) -> dict:
        """Everything as JSON types."""
        return {"misfit": self.misfit, "channel": self.channel, "sentences": self.sentences}


def fit_of_mode(problem: AnyProblem, mode: np.ndarray, rng: np.random.Generator) -> ModeFit:
    """The tests of the residuals at the posterior mode (n_params,), and why they are correlated if they are.

    `mode` has n_params values; `rng` says where in its rounding interval a reading was.
    """
    residuals = problem.quantile_residuals(mode[None], rng)
    criticism = criticise(residuals, {name: problem.channels[name][0].times for name in residuals})
    if not criticism.checks:
        return ModeFit()
    channel, worst = max(criticism.checks.items(), key=lambda item: item[1].spread)
    if criticism.fits:
        return ModeFit(worst.spread, channel)
    reasons = explain(problem, criticism, mode)
    sentences = {"fit_of_the_mode": advise(criticism, problem, reasons)}
    if steps := on_steps(problem, residuals):
        sentences["steps"] = steps
    if reasons:
        sentences["lines_to_add"] = lines_to_add(reasons[0], problem, mode)
    small = [name for name, check in criticism.suspects.items() if check.faults[0] == "large"]
    reason = ""
    if channel in small:  # its residuals are as independent as noise
        reason = f"the sd of {', '.join(small)} is too small: the residuals are independent of each other"
    return ModeFit(worst.spread, channel, sentences, reason)
