"""The posterior mode, also where some channels say no more than an interval, and for long records and unstable boats.

*Continuation* follows the mode from the prior. With noise s times as large, and a large s, the posterior has one mode,
near the prior; as s falls to one, its mode moves to that of the posterior, and each search starts where the one before
has ended (Allgower & Georg 1990). If the noise is normal its likelihood is raised to the power 1/s^2 (Friel & Pettitt
2008). To noise with heavy tails every reading is an outlier from afar, and none has a slope; with a large s all of them
have (graduated non-convexity: Blake & Zisserman 1987). The record is lengthened as well: the first search is with an
eighth of it, or less where the boat does not complete that, and the part doubles.

On an unstable ship and a zig-zag of forty minutes, with guesses 70 % off, Gauss-Newton from the middle of the prior
ends at a deviance of 2507 a reading, and continuation at 1.02, with 73 Jacobians.
"""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from bayesub.inference.baselines.estimate import Estimate, meter
from bayesub.inference.baselines.gauss_newton import gauss_newton
from bayesub.inference.interface import Sampled, mostly_bounded
from bayesub.io.arguments import checked
from bayesub.io.errors import InputError

SHARES = (0.1, 0.03, 0.01, 0.003, 0.001)  # sd of what smooths the ends of an interval, over its length
_SEARCHES = 12  # from draws of the prior at most
_SAME = 0.05  # difference of costs for each parameter that is none: posterior draws cost one more for each
_MISFIT = 2.0  # mean square of the residuals, one of a mode that fits, from which a mode is not trusted
METHOD = "posterior mode by continuation"
_FALL = 2.0  # of the scale of the noise from one search to the next
_NO_FALL = 1e-3  # of the deviance a row
_NEAR: dict[str, Any] = {"tolerance": 0.1}  # posterior sd from the mode of a search, where the next begins
_HALVINGS, _MOST_HALVINGS = 3, 7  # of the record before the first search, and where that is not completed
_LAST = 200  # iterations of the last search


@checked
def posterior_mode(problem: Sampled, *, rng: np.random.Generator, start: Mapping[str, float] | None = None) -> Estimate:
    """The posterior mode by Gauss-Newton searches, with a finite log likelihood.

    A long track has local modes, thousands of standard deviations off. The searches start from the middle of the prior
    and from draws of it until the lowest cost has been reached twice, or nearly: where a force jumps with the sign of a
    velocity a density jumps a little from step to step, and has a mode on each. If the noise has heavy tails, each
    follows the mode from noise as large as the misfit of its start. Where none has, where the best of them fits badly
    or where no simulation completes the record, the mode is followed from large noise
    (:func:`bayesub.inference.baselines.continuation`), and the better of both is taken.

    Readings that are rounded and have no noise only say in which interval the prediction lies. The search then smooths
    the ends of the intervals, less and less until all predictions are inside. InputError if no mode is found: no
    simulation completes the record, or no parameters that the prior admits make every reading where there is no noise.

    `rng` is the source of the starts. Where parameters have a value in `start`, as of the posterior of fewer readings,
    one search from there will do if its mode fits; InputError for a name that the problem does not have. The Estimate
    is that of the last search; its costs are those of all searches.
    """
    mode: Estimate | None = None
    spent = meter(problem.costs)
    for share in SHARES:
        smooth = problem.smoothed(share)
        if mode is not None:
            mode = gauss_newton(smooth, mode.values)
        else:
            mode = (_near(smooth, start) if start else None) or _lowest(smooth, rng)
        if np.isfinite(problem.log_likelihood(mode.values)[0]):
            return replace(mode, **spent())
    assert mode is not None
    parts = problem.log_likelihoods(mode.values)
    channels = [name for name, part in parts.items() if not np.isfinite(part[0])]
    what = "no parameters that the prior admits are found with every prediction within the rounding of its reading"
    text = f"channel '{channels[0]}': {what}; give the sensor an sd, or widen the prior"
    raise InputError(text, "data", channels[0])


def _near(problem, values) -> Estimate | None:
    """The end of a search from the middle of the prior but for some values, if it fits."""
    start = problem.prior.parameters(np.zeros(problem.n_params))
    for name, value in values.items():
        if name not in problem.names:
            raise InputError(f"start: {name} is not free, and needs no value to begin with", "unknown", name)
        start[problem.names.index(name)] = value
    found = _search(problem, start)
    return found if found is not None and _fits(problem, found) else None


def _lowest(problem, rng) -> Estimate:
    """The best of the searches until two have ended there, or, where that is not to be trusted, of continuation.

    Forces with unknown histories can follow nearly any motion, so that there is one mode, but random ones lead far off:
    with them continuation is first.
    """
    if problem.histories:
        with suppress(ValueError):
            followed = continuation(problem)
            if _fits(problem, followed):
                return followed
    best, agreed = _best_of_starts(problem, rng)
    if best is not None and agreed and _fits(problem, best):
        return best
    try:
        other = continuation(problem)
    except ValueError:  # no part of the record is completed
        if best is None:
            text = "no residuals are finite within the prior, not even those of the first hundredth of the record: "
            text += "look at what the model is given (of a boat signs of controls, bayesub check VEHICLE), or narrow "
            text += "the prior"
            raise InputError(text, "model", "prior") from None
        return best
    return other if best is None or other.costs[0] < best.costs[0] - _SAME * problem.n_params else best


def _fits(problem, estimate) -> bool:
    return bool(np.mean(problem.misfit(estimate.values[None])[0] ** 2) < _MISFIT)


def _best_of_starts(problem, rng) -> tuple[Estimate | None, bool]:
    """The best of the searches from the prior, None if no simulation completes the record; whether two agree on it.

    Within bounds the last of the way is long, and walkers need no more than to begin near the mode: a search ends
    there, or where its cost is that of the one before.
    """
    options = _NEAR if mostly_bounded(problem.prior) else {}
    best = _search(problem, None, **options)

    def agrees(cost: float) -> bool:
        return best is not None and abs(cost - best.costs[0]) < _SAME * problem.n_params

    for start in problem.prior.sample(rng, _SEARCHES):
        other = _search(problem, start, **options, **({"enough": agrees} if options else {}))
        if best is None or other is None:
            best = best or other
            continue
        if agrees(other.costs[0]):
            return best, True
        best = min(best, other, key=lambda estimate: estimate.costs[0])
    return best, False


def _search(problem, start, **options) -> Estimate | None:
    try:
        if not problem.heavy_tailed:
            return gauss_newton(problem, start, **options)
        middle = problem.prior.parameters(np.zeros(problem.n_params))
        return follow_noise(problem, middle if start is None else start, **options)
    except ValueError:  # the simulation fails there
        return None


def continuation(problem: Sampled, start: np.ndarray | None = None) -> Estimate:
    """The posterior mode, followed from large noise and a short record to those of the problem.

    A problem that is itself within any duration has its whole record in all searches. `start` (n_params,) is by default
    the middle of the prior. The Estimate is that of the last search; its costs are those of all searches. ValueError if
    the simulation fails at the start even on the shortest part of the record.
    """
    spent = meter(problem.costs)
    values = problem.prior.parameters(np.zeros(problem.n_params)) if start is None else np.asarray(start)
    for part in _parts(problem, values):
        estimate = follow_noise(part, values, **({"max_iterations": _LAST} if part is problem else _NEAR))
        values = estimate.values
    return replace(estimate, method=METHOD, **spent())


def follow_noise(problem: Sampled, start: np.ndarray, **last: Any) -> Estimate:
    """The posterior mode, followed from noise with which the start (n_params,) would fit, with the seconds of all.

    The `last` search, with the noise of the problem, has these options of :func:`gauss_newton`. ValueError if it fails.
    """
    scales, misfit, fall = [1.0], _deviance_a_row(problem, start), np.inf
    while 1.0 < misfit < np.inf and fall > _NO_FALL:  # some noise is as large as the errors are, and falls no more
        scales.insert(0, _FALL * scales[0])
        before, misfit = misfit, _deviance_a_row(problem.widened(scales[0]), start)
        fall = before - misfit
    values, seconds = start, 0.0
    for scale in scales:
        posed, options = (problem, last) if scale == 1.0 else (problem.widened(scale), _NEAR)
        estimate = gauss_newton(posed, values, **options)
        values, seconds = estimate.values, seconds + estimate.seconds
    return replace(estimate, seconds=seconds)


def _parts(problem, values):
    """The problem of parts of the record, each twice as long as the one before, from one that is completed."""
    parts = [problem]
    for halvings in range(1, _MOST_HALVINGS + 1):
        if halvings > _HALVINGS and np.isfinite(_deviance_a_row(parts[0], values)):
            break
        part = problem.truncated(problem.duration / 2.0**halvings)
        if part is problem:
            break
        parts.insert(0, part)
    return parts


def _deviance_a_row(problem, values) -> float:
    residuals, (deviance,) = problem.misfit(values[None])
    return deviance / residuals.shape[1]
