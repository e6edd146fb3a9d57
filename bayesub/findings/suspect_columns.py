"""Which reading of a channel the boat of the prior would agree with, where the mode does not fit as it is named."""

from collections.abc import Iterator
from dataclasses import dataclass
from operator import itemgetter

import numpy as np

from bayesub.findings.set_up import AnyProblem
from bayesub.inference.baselines import gauss_newton
from bayesub.inference.checks.discrepancy import inner_products
from bayesub.inference.identifiability.linear_model import LinearModel
from bayesub.io.errors import InputError
from bayesub.io.units import DEGREE, FOOT, KNOT, TURN
from bayesub.logs.log_files import HEADERS
from bayesub.logs.mends import PAIRS
from bayesub.problem.alternatives import Alternatives

FACTORS = {
    "of the other sign": (-1.0, "multiply it by -1"),
    "in knots": (KNOT, "rename it to _kn"),
    "in km/h": (1.0 / 3.6, "multiply it by 0.2778"),
    "in feet": (FOOT, f"multiply it by {FOOT:.4g}"),
    "in radians": (1.0 / DEGREE, "rename it to _rad"),
    "in degrees": (DEGREE, "rename it to _deg"),
}
ANGULAR = ("in radians", "in degrees")
BETTER, AGREES = 3.0, 0.5  # factor by which the difference shrinks; share of the motion that it may then be
_SEARCHES, _SAME = 8, 0.05  # of the mode with readings taken earlier; steps from one to the next, s, that end them


def suspect(problem: AnyProblem, mode: np.ndarray) -> str:
    """The change of a column, of a pair or of a clock after which the log would agree with the model, in words.

    Of columns the boat of the prior means is the judge, and of clocks a mode that is searched anew: a clock that is
    seconds off moves readings by less than the prior is wide. `mode` (n_params,): that of the problem, which does not
    fit. Empty if no single change makes the difference at least three times as small, and of columns less than half the
    motion.
    """
    return _column(problem) or _clock(problem, mode)


def _column(problem) -> str:
    best, words = 1.0 / BETTER, ""
    for name, trial, values in problem.each_trial(problem.prior.mean):
        predicted = trial.predicted(values)[0]
        if not np.isfinite(predicted).all():
            continue
        readable = [channel for channel in trial.record.channels if channel.quantity in HEADERS]
        parts = [(channel, trial.rows[channel.name]) for channel in readable]
        motion = {c.quantity: _Motion(predicted[part], trial.readings[part], c.modulo_turn) for c, part in parts}
        for change, as_named, mended in _changes(motion):
            if mended < AGREES and mended < best * as_named:
                best = mended / as_named
                words = f"{f'{name}: ' if name else ''}{change} (the boat of the prior then differs by "
                words += f"{100 * mended:.0f} % of the motion, as named by {100 * as_named:.0f} %)"
    return words


def _clock(problem, mode) -> str:
    best, words = 1.0 / BETTER, ""
    for name, trial, values in problem.each_trial(mode):
        fits = [(0.0, _misfit(trial, values)), *_fits(trial)]
        as_stamped = min(misfit for late, misfit in fits if late == 0.0)
        late, mended = min(fits, key=itemgetter(1))
        if mended < best * as_stamped:
            best = mended / as_stamped
            words = f"{name}: " if name else ""
            words += f"the readings are {abs(late):.2g} s {'late' if late > 0 else 'early'}; add {late:.2g} to the "
            words += f"clock_offset_s of the trial (the best fit then misses them by {mended:.3g} times their noise, "
            words += f"as stamped by {as_stamped:.3g})"
    return words


def _fits(trial) -> Iterator[tuple[float, float]]:
    """How late the readings of a trial may be (s), and the misfit of the mode that is searched with these times.

    They are late, in first order about the mode before, by as much as makes the least squares of all, parameters and
    clock, least. Every search begins in the middle of the prior.
    """
    late, step = 0.0, np.inf
    for _ in range(_SEARCHES):
        try:
            shifted = trial.read_earlier(late)
            values = gauss_newton(shifted).values
        except (InputError, ValueError):  # no reading or no simulation is left
            return
        yield late, _misfit(shifted, values)
        if abs(step) < _SAME:
            return
        step = _step(shifted, values)
        late += step


def _step(trial, values) -> float:
    """How much later than it says a record is, s, of the least squares about parameters (n_params,)."""
    t, predicted = trial.prior.standard(values), trial.predicted(values)[0]
    parts = ((predicted[trial.rows[channel.name]], channel.times) for channel in trial.record.channels)
    slopes = [np.gradient(*part) if len(part[1]) > 1 else np.zeros(len(part[1])) for part in parts]
    model = LinearModel(trial, t, trial.residuals(values[None])[0])
    late = -model.out(trial.weighed(values, np.concatenate(slopes)[:, None]).T).T
    here = Alternatives(model.residuals, t[model.others], model.jacobian, effects={}, forces={}, factors={})
    forces, products = inner_products(here, late)
    return float(-forces[0] / products[0, 0])


def _misfit(trial, values) -> float:
    """Root mean square of the residuals at parameters (n_params,)."""
    return float(np.sqrt(np.mean(trial.residuals(values[None]) ** 2)))


@dataclass(frozen=True)
class _Motion:
    """Readings of a channel beside what is predicted, (n,) each, and whether both are known but for whole turns."""

    predicted: np.ndarray
    readings: np.ndarray
    modulo_turn: bool

    def share(self, readings: np.ndarray) -> float:
        """Root mean square of the difference of other readings (n,) over that of the predictions."""
        difference, motion = self.predicted - readings, self.predicted
        if self.modulo_turn:
            difference = np.remainder(difference + np.pi, TURN) - np.pi
            motion = np.unwrap(motion) - motion[0]
        return float(np.linalg.norm(difference) / max(np.linalg.norm(motion), np.finfo(float).tiny))


def _changes(motion) -> Iterator[tuple[str, float, float]]:
    """A change in words, and the shares that differ without and with it."""
    for name, one in motion.items():
        header, as_named = HEADERS[name], one.share(one.readings)
        for words, (factor, remedy) in FACTORS.items():
            if (words in ANGULAR) == ("_deg" in header) or factor == -1.0:
                column = header.removesuffix("_deg") if words in ANGULAR else header
                yield f"{column} {words}; {remedy}", as_named, one.share(factor * one.readings)
    for first, second in PAIRS:
        if first in motion and second in motion and len(motion[first].readings) == len(motion[second].readings):
            one, other = motion[first], motion[second]
            change = f"{HEADERS[first]}, {HEADERS[second]}: each holds the other; exchange the two names"
            as_named = max(one.share(one.readings), other.share(other.readings))
            yield change, as_named, max(one.share(other.readings), other.share(one.readings))
