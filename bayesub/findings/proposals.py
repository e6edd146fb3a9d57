"""What could have made correlated residuals, in a sentence and in the lines of a study file that let a run infer it."""

from collections.abc import Sequence

from bayesub.inference.checks.discrepancy import Discrepancy
from bayesub.logs import log_files
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


def sentence(explanations: Sequence[Discrepancy]) -> str:
    """What the residuals look like, by how much, and what to do; of explanations, best first and at least one."""
    best, *others = explanations
    if not others:
        return f"They look as if {_words(best)} ({best.gain:.0f} nats better than by their noise); add the lines below."
    second = others[0]
    lead = best.gain - second.gain
    if lead < max(_CLOSE, _SHARE * best.gain):
        return (
            f"They look as if {_words(best)}, or nearly as well ({lead:.0f} nats less) as if {_words(second)}; add the "
            "lines below, which are for the first, or what the second needs."
        )
    return f"They look as if {_words(best)} ({lead:.0f} nats better than {_NAMES[second.kind]}); add the lines below."


def _words(explanation) -> str:
    names = _enumerated(list(explanation.sizes))
    return {
        "bias": f"{names} were missing",
        "current": "a current were missing",
        "coefficient": f"{names} were held at a wrong value",
        "disturbance": f"forces on {names} were missing",
        "slow noise": f"the noise of {names} were slow",
    }[explanation.kind]


def _enumerated(names) -> str:
    return " and ".join(part for part in (", ".join(names[:-1]), names[-1]) if part)


def lines(explanation: Discrepancy, problem) -> str:
    """The lines of a study file that infer what an explanation is about.

    Sections that the study has already are to be joined with them.
    """
    return "\n".join(_LINES[explanation.kind](explanation, problem))


def _disturbance(explanation, problem):  # noqa: ARG001
    (time,) = set(explanation.times.values())
    sds = [f"{axis} = {_log_normal(size, _LOG_SD)}" for axis, size in explanation.sizes.items()]
    axes = ", ".join(f'"{axis}"' for axis in explanation.sizes)
    yield "[disturbance]"
    yield f"axes = [{axes}]"
    yield f"sd = {{ {', '.join(sds)} }}"
    yield f"correlation_time_s = {_log_normal(time, _LOG_SD_TIME)}"


def _slow_noise(explanation, problem):
    columns = {}
    for name, size in explanation.sizes.items():
        channel, _ = problem.channels[name]
        column = log_files.HEADERS[channel.quantity]
        sd = size * channel.total_sd / log_files.si_factor(column)
        columns.setdefault(column, (sd, explanation.times[name]))  # of several trials the first
    for n, (column, (sd, time)) in enumerate(columns.items()):
        yield from [""] * (n > 0)
        yield f"[noise.{column}]"
        yield 'kind = "ar1"'
        yield f"sd = {sd:.2g}"
        yield f"correlation_time_s = {time:.2g}"


def _bias(explanation, problem):  # noqa: ARG001
    yield "[nuisance]"
    for name, size in explanation.sizes.items():
        yield f"{name} = {{ mean = 0.0, sd = {_WIDER * size:.2g} }}"


def _current(explanation, problem):
    (size,) = explanation.sizes.values()
    yield "[nuisance]"
    for name in CURRENTS:
        if name not in problem.names:
            yield f"{name} = {{ mean = 0.0, sd = {_WIDER * size:.2g} }}"


def _coefficient(explanation, problem):
    free = {*problem.names[: problem.n_coefficients], *explanation.sizes}
    names = ", ".join(f'"{name}"' for name in problem.equations.names if name in free)
    yield "[free]"
    yield f"coefficients = [{names}]"


def _log_normal(median, log_sd) -> str:
    return f"{{ median = {median:.2g}, log_sd = {log_sd:g} }}"


_LINES = {
    "bias": _bias,
    "current": _current,
    "coefficient": _coefficient,
    "disturbance": _disturbance,
    "slow noise": _slow_noise,
}
