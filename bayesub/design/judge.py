"""Judge manoeuvres by what their readings will tell: exact sensitivities, without a single reading.

Normal noise weighs the sensitivities of the readings whatever is read. A reading that is rounded weighs as one with
normal noise of the same expected information (:func:`expected_sd`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from typing import NamedTuple

import numpy as np
from scipy import linalg
from scipy.special import ndtr

from bayesub.design.information import Information
from bayesub.inference.baselines import gauss_newton
from bayesub.inference.identifiability.fisher import integrated_out
from bayesub.io.errors import InputError
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.vehicles import Vehicle
from bayesub.problem.distributions import Prior
from bayesub.problem.disturbances import UnknownDisturbance
from bayesub.problem.joint import JointProblem
from bayesub.problem.likelihoods import Normal, Rounded, SetMembership, UnknownSd
from bayesub.problem.noise import Noise
from bayesub.problem.priors import CoefficientPrior, relative_normal
from bayesub.problem.problem import Problem
from bayesub.problem.trial_problem import TrialProblem
from bayesub.sensors.measurement import unread
from bayesub.sensors.record import Record
from bayesub.sensors.sensor import Sensor, channel_name

_ACCURATE = 0.02  # relative change of an expected sd by half the step
_COARSEST, _HALVINGS = 0.25, 8  # of the time in which the boat travels its length
_PHASES, _TAIL = 64, 9.0  # of a value between two multiples of the resolution; sds beyond which nothing is read
LARGEST = 1e14  # information in prior sds; of a hundred times as much, rounding errors hide the prior
MIN_SHARPNESS = 0.05  # noise below this share of the resolution tells no more in these sums


@dataclass(frozen=True)
class Judge:
    """The expected information of any manoeuvre of a boat."""

    vehicle: Vehicle
    sensors: tuple[Sensor, ...]
    free: tuple[str, ...] = ()  # to infer; those that are zero, or have no part in the sub-problem, are left out
    prior: CoefficientPrior = field(default_factory=lambda: relative_normal(0.25))  # of one trial and the next
    precision: np.ndarray | None = None  # (n, n) of the prior, in its sds, where an earlier trial knows more
    nuisance: Mapping[str, Prior] = field(default_factory=dict)  # nuisance parameters of each trial, integrated out
    expected: Mapping[str, float] = field(default_factory=dict)  # values of some of them; by default the prior means
    noise: Mapping[str, Noise] = field(default_factory=dict)  # as of :class:`bayesub.Problem`
    disturbance: UnknownDisturbance | None = None  # unmodelled forces, whose histories are integrated out
    subproblem: str | None = None
    draws: np.ndarray | None = None  # (n_draws, n_terms) coefficient sets; by default the values of the vehicle alone
    step_s: float | None = None  # of integration; by default that of :meth:`accurate_step`, which takes judgements
    rival: "Judge | None" = None  # of a boat with other equations, from which the readings are to distinguish this one

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The n coefficients, in the order of the equations."""
        equations, xi = self.vehicle.equations, self.vehicle.xi
        active = equations.active(subproblem=self.subproblem)
        columns = equations.columns(self.free or active)
        scale = self.prior.has_scale(columns, xi, equations)
        chosen = {equations.names[k] for k, has in zip(columns, scale, strict=True) if has} & set(active)
        if not chosen:
            text = f"{self.vehicle.name}: none of the coefficients asked for has a value and a part in the motion"
            raise InputError(text, "conflict", "free")
        return tuple(name for name in equations.names if name in chosen)

    @cached_property
    def columns(self) -> np.ndarray:
        """(n,) where the coefficients stand among those of the equations."""
        return self.vehicle.equations.columns(self.names)

    @property
    def values(self) -> np.ndarray:
        """(n,) values of the coefficients of the vehicle."""
        return self.vehicle.xi[self.columns]

    @property
    def sets(self) -> np.ndarray:
        """(n_draws, n_terms) coefficient sets over which a criterion is averaged."""
        return self.vehicle.xi[None] if self.draws is None else self.draws

    def problem(self, manoeuvre: Manoeuvre, step_s: float, readings: np.ndarray | None = None) -> TrialProblem:
        """The inference problem of a trial that has not been flown; it has Jacobians, and no likelihood.

        Unless it is given readings (n_readings,), those of one channel after those of another.
        """
        channels = unread(self.sensors, manoeuvre.duration).channels
        record = Record(tuple(replace(c, sd=expected_sd(c.sd, c.resolution), resolution=0.0) for c in channels))
        manoeuvre = replace(manoeuvre, subproblem=self.subproblem)
        problem = Problem(
            self.vehicle, manoeuvre, record, free=self.names, prior=self.prior, nuisance=dict(self.nuisance), dt=step_s,
            noise={name: _without_readings(one) for name, one in self.noise.items()}, disturbance=self.disturbance,
        )  # fmt: skip
        return problem if readings is None else problem.with_readings(readings)

    def parameters(self, problem: TrialProblem | JointProblem, xi: np.ndarray) -> np.ndarray:
        """(n_params,) parameters of a problem with coefficients of a set (n_terms,), and what is expected of others."""
        means = zip(problem.names, problem.prior.mean.tolist(), strict=True)
        parameters = np.array([self.expected.get(name.partition("[")[0], mean) for name, mean in means])
        parameters[: problem.n_coefficients] = xi[problem.columns]
        return parameters

    def information(self, manoeuvre: Manoeuvre) -> list[Information]:
        """The expected information of a manoeuvre, at each of :attr:`sets`."""
        return Sensed(self, manoeuvre, self.step_s or self.accurate_step(manoeuvre)).information()

    def losses(self, manoeuvre: Manoeuvre) -> list[list[Information]]:
        """As :meth:`information` with all instruments, and then without each, if there are several."""
        sensed = Sensed(self, manoeuvre, self.step_s or self.accurate_step(manoeuvre))
        instruments = {channel_name(one.quantity): one.instrument or one.column for one in self.sensors}
        of_readings = np.empty(len(sensed.times), dtype=object)
        for channel, rows in sensed.rows.items():
            of_readings[rows] = instruments[channel]
        lost = sorted(set(instruments.values())) if len(set(instruments.values())) > 1 else []
        return [sensed.information(), *(sensed.information(of_readings != name) for name in lost)]

    def accurate_step(self, manoeuvre: Manoeuvre) -> float:
        """The longest step, s, of which a half changes no expected sd by more than two per cent."""
        step = _COARSEST * self.vehicle.length_m / self.vehicle.speed_mps
        judge = replace(self, draws=None)
        (before,) = Sensed(judge, manoeuvre, step).information()
        for _ in range(_HALVINGS):
            (after,) = Sensed(judge, manoeuvre, 0.5 * step).information()
            if np.abs(before.posterior_sd / after.posterior_sd - 1.0).max() < _ACCURATE:
                return step
            step, before = 0.5 * step, after
        return step

    def alike(self) -> np.ndarray:
        """(n_draws, n_terms) coefficients of the rival, which differ from its values as the sets do from the boat's."""
        assert self.rival is not None
        own, other = self.vehicle, self.rival.vehicle
        sets = np.tile(other.xi, (len(self.sets), 1))
        shared = [name for name in self.rival.names if name in own.equations.index]
        columns, others = own.equations.columns(shared), other.equations.columns(shared)
        has = own.xi[columns] != 0.0
        sets[:, others[has]] *= self.sets[:, columns[has]] / own.xi[columns[has]]
        return sets

    def empty(self) -> Information:
        """The information of the prior, before any trial."""
        return self._information(np.zeros((len(self.names), len(self.names))))

    def _information(self, gram, apart=0.0) -> Information:
        prior_sd, precision = self._known
        return Information(self.names, self.values, prior_sd, precision, gram, apart)

    @cached_property
    def _known(self) -> tuple[np.ndarray, np.ndarray]:
        """Prior sds (n,) and precision (n, n) in them."""
        prior = self.prior.on(self.columns, self.vehicle.xi, self.vehicle.equations)
        if self.precision is not None:
            return prior.sd, self.precision
        n = len(self.names)
        lower = prior.chain(np.eye(n), np.zeros(n))  # parameters by standard normal coordinates
        lower /= np.linalg.norm(lower, axis=1)[:, None]
        return prior.sd, np.linalg.inv(lower @ lower.T)


class Sensed:
    """The derivatives of the readings of one manoeuvre, of which any part may be taken for the information.

    ``times`` (n_readings,) are in s, and ``rows`` is channel -> slice of its readings. The integration step is in s.
    """

    def __init__(self, judge: Judge, manoeuvre: Manoeuvre, step_s: float):
        self.judge, self._problem = judge, judge.problem(manoeuvre, step_s)
        self.times, self.rows = self._problem.times, self._problem.rows
        problem = self._problem
        self._places = np.array([judge.names.index(name) for name in problem.names[: problem.n_coefficients]])
        self._jacobians = []  # (n_rows, n_params) derivatives of readings over their sds by parameters in prior sds
        for xi in judge.sets:
            parameters = judge.parameters(problem, xi)
            with np.errstate(invalid="ignore"):  # what an unknown noise learns of itself takes readings
                self._jacobians.append(problem.jacobian(parameters) * problem.prior.sd)
        self._fits = [None] * len(judge.sets)
        if judge.rival is not None:
            self._fits = [_fits(judge, manoeuvre, step_s, *p) for p in zip(judge.sets, judge.alike(), strict=True)]

    def information(self, readings: np.ndarray | slice | None = None) -> list[Information]:
        """What the readings, or those of a mask (n_readings,) or slice alone, tell at each coefficient set."""
        return [self._of(*pair, readings) for pair in zip(self._jacobians, self._fits, strict=True)]

    def _of(self, jacobian, fits, readings):
        jacobian = jacobian[: len(self.times)]
        jacobian = jacobian if readings is None else jacobian[readings]
        n = self._problem.n_coefficients
        by_coefficients = jacobian[:, :n]
        if jacobian.shape[1] > n:
            by_coefficients = integrated_out(by_coefficients, jacobian[:, n:])
        gram = np.zeros((len(self.judge.names),) * 2)
        gram[np.ix_(self._places, self._places)] = by_coefficients.T @ by_coefficients
        apart = 0.0
        if fits is not None:
            own, rival = (one.least(slice(None) if readings is None else readings) for one in fits)
            apart = max(0.0, rival - own)
        return self.judge._information(gram if is_sound(gram) else np.zeros_like(gram), apart)


class _Fit(NamedTuple):
    """The best fit to readings without noise, of p parameters."""

    residuals: np.ndarray  # (n_readings,)
    jacobian: np.ndarray  # (n_readings, p) by coordinates in which the prior is standard normal
    standard: np.ndarray  # (p,) these coordinates

    def least(self, readings: np.ndarray | slice) -> float:
        """The least sum of squares of residuals and coordinates, if some readings are all there is; one step away."""
        rows = np.vstack([self.jacobian[readings], np.eye(len(self.standard))])
        ends = np.concatenate([self.residuals[readings], self.standard])
        return float(np.sum((ends - rows @ linalg.lstsq(rows, ends)[0]) ** 2))


def _fits(judge: Judge, manoeuvre: Manoeuvre, step_s: float, xi: np.ndarray, alike: np.ndarray):
    """The fits of a judge's boat and of its rival to what a boat with the coefficients xi (n_terms,) shows.

    The rival's search begins at the coefficients `alike`. None where a flight fails.
    """
    assert judge.rival is not None
    rival = replace(judge.rival, sensors=judge.sensors, noise=judge.noise, expected=judge.expected)
    problem = judge.problem(manoeuvre, step_s)
    true = judge.parameters(problem, xi)
    readings, fits = problem.predicted(true[None])[0], []
    if not np.isfinite(readings).all():
        return None
    for one, own in ((judge, xi), (rival, alike)):
        fitted = one.problem(manoeuvre, step_s, readings)
        start = judge.parameters(fitted, own)
        try:
            values = gauss_newton(fitted, start).values
        except ValueError:
            return None
        standard = fitted.prior.standard(values)
        jacobian = fitted.prior.chain(fitted.jacobian(values), standard)
        fits.append(_Fit(fitted.residuals(values[None])[0][: len(readings)], jacobian[: len(readings)], standard))
    return fits


def is_sound(gram: np.ndarray) -> bool:
    """Whether information (n, n), in prior sds, is not that of a flight out of control."""
    return bool(np.abs(gram).max() < LARGEST)


def _without_readings(noise: Noise) -> Noise:
    """The normal noise that a noise model amounts to if it weighs a reading by what is read; others as they are."""
    if isinstance(noise, Rounded | SetMembership):
        return Normal(expected_sd(getattr(noise, "sd", 0.0), noise.resolution))
    return Normal(noise.sd) if isinstance(noise, UnknownSd) else noise


@cache
def expected_sd(sd: float, resolution: float) -> float:
    """Sd of normal noise whose information is that expected of a reading with noise that is then rounded.

    Expected over where the true value lies between two multiples of the resolution. Without noise, or with little, a
    reading tells where a jump is and the information is without bound; then noise is a twentieth of the resolution.
    """
    if not resolution:
        return sd
    sd = max(sd, MIN_SHARPNESS * resolution)
    phases = (np.arange(_PHASES) + 0.5) / _PHASES * resolution
    n = int(np.ceil(_TAIL * sd / resolution)) + 1
    upper = (np.arange(-n, n + 1) + 0.5) * resolution
    ends = (np.stack([upper - resolution, upper])[:, None] - phases[:, None]) / sd  # (2, n_phases, n_multiples)
    probability = ndtr(ends[1]) - ndtr(ends[0])
    slope = np.diff(np.exp(-0.5 * ends**2), axis=0)[0] / np.sqrt(2.0 * np.pi) / sd
    information = np.divide(slope**2, probability, out=np.zeros_like(slope), where=probability > 0.0).sum(axis=1)
    return float(1.0 / np.sqrt(information.mean()))
