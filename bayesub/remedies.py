"""What to do if the residuals say that the model is wrong, in sentences and in the words of a study file."""

from bayesub import likelihoods, logs
from bayesub.criticism import OUTLIER, Criticism, expected_outliers
from bayesub.nuisance import CURRENTS

_SHOWN = 6  # channels in a sentence


def sentence(criticism: Criticism, problem) -> str:
    """Whether the model of a problem fits, and if not what is wrong with which channels and what to do about it."""
    if not criticism.checks:
        return "Readings without noise have no residuals to judge the model by."
    chance = f"{criticism.n_tests} tests, {100 * criticism.false_alarms:g} % false alarms in all"
    if criticism.fits:
        return f"The residuals of every channel look like its noise model ({chance})."
    suspects = {}
    for name, check in criticism.suspects.items():
        for fault in check.faults:
            suspects.setdefault(fault, {})[name] = check
    ends = "The noise is smaller than was said, and the intervals are too wide"
    if suspects.keys() != {"small"}:
        ends = "The model does not fit, and then the intervals are too narrow"
    said = [_SENTENCES[fault](suspects[fault], problem) for fault in _SENTENCES if fault in suspects]
    return f"{ends} ({chance}). {' '.join(said)}"


def _correlated(checks, problem):
    columns = _columns(checks, problem)
    found = _listed({name: f"{check.correlations[0]:.2f}" for name, check in checks.items()})
    currents = [name for name in CURRENTS if not any(own.startswith(name) for own in problem.names)]
    remedies = [f"a current ({_nuisance(currents)})"] * (_over_ground(checks, problem) and bool(currents))
    remedies += [f"a bias ({_nuisance([f'bias_{columns[0]}'])})", "a coefficient held at a wrong value"]
    white = [c for c, name in zip(columns, checks, strict=True) if not _is(likelihoods.AR1, name, problem)]
    slow = f", or the noise itself is slow ({_noise(white[0], 'ar1')})" if white else ""
    return (
        f"Residuals follow from those before them, with correlation of neighbours {found}: something slow is missing, "
        f"such as {', '.join(remedies)}{slow}."
    )


def _outliers(checks, problem):
    counts = {
        n: f"{c.n_outliers:.0f} where {expected_outliers(c.n_readings):.1f} are expected" for n, c in checks.items()
    }
    plain = [name for name in checks if not _is(likelihoods.StudentT, name, problem)]
    remedy = _noise(_columns(plain, problem)[0], "student_t") if plain else _nuisance([f"dof_{next(iter(checks))}"])
    return f"Outliers beyond {OUTLIER:g} sd: {_listed(counts)}; give {remedy}."


def _large(checks, problem):
    remedy = _noise(_columns(checks, problem)[0], "unknown_sd")
    return f"Residuals over their noise: {_listed(_sizes(checks))}; raise the sd, or give {remedy}."


def _small(checks, problem):
    remedy = _noise(_columns(checks, problem)[0], "unknown_sd")
    return f"Residuals under their noise: {_listed(_sizes(checks))}; lower the sd, or give {remedy}."


def _shape(checks, problem):
    column = _columns(checks, problem)[0]
    names = ", ".join(list(checks)[:_SHOWN])
    return f"Residuals not distributed as their noise: {names}; look at the figure, and at the resolution of {column}."


_SENTENCES = {"correlated": _correlated, "outliers": _outliers, "large": _large, "small": _small, "shape": _shape}


def _sizes(checks):
    return {name: f"{check.chi_square_per_reading**0.5:.2g} times its sd" for name, check in checks.items()}


def _listed(values: dict) -> str:
    shown = [f"{name} {value}" for name, value in list(values.items())[:_SHOWN]]
    return ", ".join(shown) + (f" and {len(values) - _SHOWN} more" if len(values) > _SHOWN else "")


def _columns(names, problem) -> list[str]:
    return [logs.HEADERS[problem.channels[name][0].quantity] for name in names]


def _over_ground(names, problem) -> bool:
    return any(problem.channels[name][0].over_ground for name in names)


def _is(kind, name, problem) -> bool:
    return isinstance(problem.channels[name][1], kind)


def _noise(column, kind) -> str:
    return f'[noise.{column}] kind = "{kind}"'


def _nuisance(names) -> str:
    return f"[nuisance] {', '.join(names)}"
