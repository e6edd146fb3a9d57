"""Histories of unmodelled forces as parameters of a problem.

A force that the equations leave out is a stationary random process (:class:`bayesub.model.disturbance.Disturbance`)
on each of some axes. It enters the simulation linear between knots. The forces at the knots are those whose broken line
is nearest to the process in least squares, not the values of the process there: a broken line through these would lack
the impulse of what happens in between, which is a third of all of it when knots are half a correlation time apart.
What the broken line lacks has no inner product with any hat.

The parameters are white coordinates w of these forces (:mod:`bayesub.problem.innovations`): standard normal whatever
the sd and the correlation time are, and independent. Where readings say nothing of forces, w has its prior.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from bayesub.io.errors import InputError
from bayesub.model.disturbance import CURRENTS, DISTURBED, KINDS, ForceHistory, Knots, by_time, check_axes, check_kind
from bayesub.model.vehicles import Vehicle
from bayesub.problem.distributions import WHITE, Prior

if TYPE_CHECKING:
    from bayesub.kernels.kalman import Innovations, Pieces
    from bayesub.problem.trial_problem import TrialProblem

CORRELATION_TIME = "correlation_time_disturbance_s"
CURRENT_TIME = "correlation_time_current_s"
_SD, _HISTORY = "sd_disturbance_", "disturbance_"
KNOTS_A_TIME = 2.0  # knots in a correlation time, if no interval is given
KNOTS_A_TIME_CURRENT = 5.0  # of a current, which bottom tracks read and do not integrate
_WIDE = 0.99  # probability of sds below the one with which searches begin
_TAILS = 1e-6  # probability of what is smaller than numbers that must be positive
_STEP = 1e-5  # of differences by the logarithm of a correlation time


def of_process(name: str) -> bool:
    """Whether a parameter belongs to the random process, which all trials share."""
    return name in (CORRELATION_TIME, CURRENT_TIME) or (name.startswith(_SD) and name[len(_SD) :] in DISTURBED)


def of_history(name: str) -> bool:
    """Whether a parameter is a white coordinate of a history of forces."""
    axis, _, knot = name.partition("[")[0].removeprefix(_HISTORY).partition("_")
    return name.startswith(_HISTORY) and axis in DISTURBED and knot.isdigit()


def force_scales(vehicle: Vehicle, axes: tuple[str, ...]) -> np.ndarray:
    """(n_axes,) N or N m of a unit non-dimensional force or moment at the trial speed; one, m/s, of a current."""
    force = 0.5 * vehicle.water_density_kgm3 * vehicle.length_m**2 * vehicle.speed_mps**2
    scales = dict.fromkeys("XYZ", force) | dict.fromkeys("KMN", force * vehicle.length_m) | dict.fromkeys(CURRENTS, 1.0)
    return np.array([scales[axis] for axis in axes])


@dataclass(frozen=True)
class UnknownDisturbance:
    """Unmodelled forces with unknown histories, as a problem is asked to infer them.

    InputError for an axis or kind that does not exist, and numbers that are not positive.
    """

    axes: tuple[str, ...]  # of X Y Z K M N, and north and east for a current that varies
    # axis -> standard deviation, non-dimensional: forces over (rho/2) l^2 U^2, moments over (rho/2) l^3 U^2, with the
    # trial speed U; of a current in m/s; or the prior of it
    sds: Mapping[str, float | Prior]
    correlation_time_s: float | Prior  # of all axes
    kind: str = KINDS[0]  # as of :class:`bayesub.model.disturbance.Disturbance`
    # by default half of the correlation time of forces and a fifth of that of currents, or of their prior medians
    knot_interval_s: float | None = None
    # correlation time of the current, if it is not that of the forces
    correlation_time_current_s: float | Prior | None = None

    def __post_init__(self):
        check_axes(self.axes)
        check_kind(self.kind)
        if set(self.sds) != set(self.axes):
            text = f"disturbance: give an sd for each of {', '.join(self.axes)}; found {', '.join(self.sds)}"
            raise InputError(text, "conflict", "sds")
        numbers: dict[str, float | Prior | None] = dict(self.sds)
        numbers |= {"correlation_time_s": self.correlation_time_s, "knot_interval_s": self.knot_interval_s}
        numbers |= {"correlation_time_current_s": self.correlation_time_current_s}
        for key, value in numbers.items():
            if value is None:
                continue
            least = value.quantiles(_TAILS)[0] if isinstance(value, Prior) else value
            if not (np.isfinite(least) and least > 0):
                words = f"the sd of {key}" if key in self.sds else key
                raise InputError(f"disturbance: {words} must be positive, found {least:g}", "value", key)

    @cached_property
    def groups(self) -> list[tuple[str, float | Prior, list[int], str]]:
        """Name and value or prior of the correlation time, positions and kind of forces, and of currents."""
        of_current = self.correlation_time_current_s
        named = None if of_current is None else (CURRENT_TIME, of_current)
        parts = by_time(self.axes, self.kind, (CORRELATION_TIME, self.correlation_time_s), named)
        return [(*time, members, kind) for time, members, kind in parts]

    @property
    def times(self) -> dict[str, float | Prior]:
        """Name of each correlation time -> its value or prior."""
        return {name: time for name, time, *_ in self.groups}

    def time(self, name: str) -> float | None:
        """A correlation time, or its prior median, s; None if there is no such one."""
        return _middle(self.times[name]) if name in self.times else None

    @property
    def time_s(self) -> float:
        """The shortest correlation time, or its prior median, s."""
        return min(map(_middle, self.times.values()))

    @property
    def interval_s(self) -> float:
        """Longest time between knots, s."""
        densities = {True: KNOTS_A_TIME_CURRENT, False: KNOTS_A_TIME}
        intervals = [
            _middle(time) / densities[self.axes[members[0]] in CURRENTS] for _, time, members, _ in self.groups
        ]
        return self.knot_interval_s or min(intervals)

    def sd(self, axis: str) -> float:
        """The standard deviation of an axis, or its prior median, non-dimensional."""
        return _middle(self.sds[axis])


def _middle(value: float | Prior) -> float:
    return float(value.quantiles(0.5)[0]) if isinstance(value, Prior) else float(value)


@dataclass(frozen=True)
class Disturbances:
    """The histories of one trial."""

    unknown: UnknownDisturbance
    vehicle: Vehicle
    duration: float  # of the readings, from the start of the manoeuvre, s

    @property
    def n_knots(self) -> float:
        """How many knots there are, or would be."""
        return max(1.0, float(np.ceil(self.duration / self.unknown.interval_s * (1.0 - 1e-9)))) + 1.0

    @cached_property
    def knots(self) -> Knots:
        """Equidistant, the last one at the end of the readings."""
        return Knots(np.linspace(0.0, self.duration, int(self.n_knots)), self.unknown.axes)

    @cached_property
    def processes(self) -> dict[str, Prior]:
        """Priors of the parameters of the process that are not known."""
        priors = {f"{_SD}{axis}": self.unknown.sds[axis] for axis in self.unknown.axes}
        priors |= self.unknown.times
        return {name: prior for name, prior in priors.items() if isinstance(prior, Prior)}

    @cached_property
    def priors(self) -> dict[str, Prior]:
        """Parameter -> prior, of the process and then of the white coordinates axis after axis."""
        n = len(self.knots.times)
        return self.processes | {f"{_HISTORY}{axis}_{k}": WHITE for axis in self.unknown.axes for k in range(n)}

    @property
    def held(self) -> np.ndarray:
        """(n_own,) prior medians: no forces."""
        return np.array([_middle(prior) for prior in self.priors.values()])

    @property
    def wide_process(self) -> dict[str, float]:
        """Unknown parameter of the process -> value for searches: a large sd, so that histories follow any motion."""
        return {
            name: float(prior.quantiles(_WIDE if name.startswith(_SD) else 0.5)[0])
            for name, prior in self.processes.items()
        }

    def with_wide_process(self) -> Disturbances:
        """The same histories, of a process that is known to be the :attr:`wide_process`."""
        wide = self.wide_process
        sds = {axis: wide.get(f"{_SD}{axis}", sd) for axis, sd in self.unknown.sds.items()}
        unknown = replace(
            self.unknown,
            sds=sds,
            correlation_time_s=self.unknown.time(CORRELATION_TIME) or self.unknown.time_s,
            correlation_time_current_s=self.unknown.time(CURRENT_TIME),
            knot_interval_s=self.unknown.interval_s,
        )
        return replace(self, unknown=unknown)

    def members(self, axes: tuple[str, ...]) -> list[int]:
        """Positions of those axes that are among the given ones."""
        return [k for k, axis in enumerate(self.unknown.axes) if axis in axes]

    def process(self, values: np.ndarray) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Sds (n_batch, n_axes), N, N m, m/s, and times (n_batch,), s, of values (n_batch, n) that begin as its own."""
        own, n = dict(zip(self.processes, values.T, strict=False)), len(values)
        scales = force_scales(self.vehicle, self.unknown.axes)
        given = {f"{_SD}{axis}": self.unknown.sds[axis] for axis in self.unknown.axes}
        sds = [np.broadcast_to(own.get(name, sd), n) for name, sd in given.items()]
        times = {name: np.broadcast_to(own.get(name, time), n) for name, time in self.unknown.times.items()}
        return np.stack(sds, axis=1) * scales, times

    def _parts(self, values: np.ndarray) -> tuple[np.ndarray, dict[str, np.ndarray], np.ndarray]:
        """Sds (n_batch, n_axes), correlation times by name, and w (n_batch, n_axes, n_knots) of own values."""
        white = values[:, len(self.processes) :].reshape(len(values), len(self.unknown.axes), -1)
        return *self.process(values), white

    def innovations(self, values: np.ndarray) -> Innovations:
        """The forces in innovations form, N, N m and m/s, of values (n_batch, n) that begin as its own."""
        from bayesub.kernels.kalman import Innovations  # loads the compiler
        from bayesub.problem import innovations

        sds, times = self.process(values)
        n_knots, n_lags = len(self.knots.times), max(innovations.lags(kind) for *_, kind in self.unknown.groups)
        last, gains = np.empty((*sds.shape, n_lags)), np.empty((*sds.shape, n_knots, n_lags))
        roots = np.empty((*sds.shape, n_knots))
        for name, _, members, kind in self.unknown.groups:
            different, places = np.unique(times[name], return_inverse=True)
            unit = innovations.innovations(kind, self.knots.interval, n_knots, different, n_lags)
            for whole, part in zip((last, gains, roots), unit, strict=True):
                whole[:, members] = part[places][:, None]
        return Innovations(last, gains * sds[:, :, None, None], roots * sds[:, :, None])

    def forces(self, values: np.ndarray) -> np.ndarray:
        """(n_batch, n_axes, n_knots) at the knots, N, N m and m/s, of own parameters (n_batch, n_own)."""
        *_, white = self._parts(values)
        return self.innovations(values).forces(white)

    def nearest(self, values: np.ndarray, forces: ForceHistory) -> np.ndarray:
        """Own parameters (n_own,) with those white coordinates whose forces are nearest to given ones."""
        values = np.array(values)
        white = self.innovations(values[None]).white(self.knots.projected(forces).T[None])
        values[len(self.processes) :] = white.ravel()
        return values

    def factor(self, values: np.ndarray) -> np.ndarray:
        """(n_axes, n_knots, n_knots) lower triangular: the forces of a member (1, n) are it times w."""
        n = len(self.knots.times)
        unit = np.broadcast_to(np.eye(n)[:, None], (n, len(self.unknown.axes), n))
        return np.moveaxis(self.innovations(values).repeated(n).forces(unit), 0, 2)

    def slopes(self, values: np.ndarray) -> np.ndarray:
        """(n_process, n_axes, n_knots) derivatives of the histories of one member (1, n_own) by the process."""
        sds, _, white = self._parts(values)
        slopes = np.zeros((len(self.processes), *white.shape[1:]))
        forces, scales = self.forces(values)[0], force_scales(self.vehicle, self.unknown.axes)
        for k, name in enumerate(self.processes):
            if name.startswith(_SD):
                a = self.unknown.axes.index(name.removeprefix(_SD))
                slopes[k, a] = forces[a] * scales[a] / sds[0, a]
                continue
            sides = np.repeat(values, 2, axis=0)
            sides[:, k] *= np.exp([_STEP, -_STEP])
            plus, minus = self.forces(sides)
            slopes[k] = (plus - minus) / (2.0 * _STEP * values[0, k])
        return slopes


@dataclass(frozen=True)
class History:
    """What of a problem the unknown histories of one trial are: :class:`bayesub.inference.interface.LatentForces`."""

    rows: slice  # of the residuals, those of the trial
    columns: np.ndarray  # (n_white,) positions of the white coordinates among the parameters, axis after axis
    process: np.ndarray  # (n_process,) positions of the parameters of the process
    trial: TrialProblem  # whose readings the forces move
    places: np.ndarray  # positions of the trial's parameters among all

    @property
    def disturbances(self) -> Disturbances:
        """The histories of the trial."""
        return self.trial.forward.disturbances

    @property
    def wide_process(self) -> np.ndarray:
        """(n_process,) values for searches, as :attr:`Disturbances.wide_process`."""
        return np.array(list(self.disturbances.wide_process.values()))

    def innovations(self, parameters: np.ndarray) -> Innovations:
        """The forces in innovations form of parameters (n_batch, n_params)."""
        return self.disturbances.innovations(parameters[:, self.process])

    def response(self, parameters: np.ndarray) -> Pieces:
        """How the residuals of the trial follow the forces, at parameters (n_params,): pieces of one term.

        A residual may depend on two successive readings of its channel. The one before is part of the state then.
        """
        from bayesub.kernels.kalman import Pieces  # loads the compiler

        trial = self.trial
        sets, values = trial.arguments(parameters[None, self.places])
        ends, by_reading, numbers = trial.forward.pieces(sets, values)
        n, n_pieces, n_states = len(trial.readings), len(ends), ends.shape[1]
        # What each residual takes of its own reading and of the one before.
        odd = np.concatenate([np.arange(part.stop - part.start) % 2 for part in trial.rows.values()])
        weights = trial.likelihood.weighed(
            trial.weighing(sets, values), values, np.column_stack([odd == 0, odd == 1]).astype(float)
        )
        own, before = weights[np.arange(n), odd], weights[np.arange(n), 1 - odd]
        rows = np.zeros((trial.n_rows, by_reading.shape[1]))
        rows[:n] = own[:, None] * by_reading
        for part in trial.rows.values():
            follows = np.arange(part.start, part.stop)[before[part] != 0.0]
            if not len(follows):
                continue
            same = numbers[follows] == numbers[follows - 1]
            rows[follows[same]] += before[follows[same], None] * by_reading[follows[same] - 1]
            ends, rows, by_reading = (np.insert(array, n_states, 0.0, axis=-1) for array in (ends, rows, by_reading))
            rows[follows[~same], n_states] = before[follows[~same]]
            last = np.zeros((n_pieces, 1, rows.shape[1]))
            last[:, 0, n_states] = 1.0
            reads, places = np.unique(numbers[part][::-1], return_index=True)
            last[reads, 0] = by_reading[part][::-1][places]
            ends, n_states = np.concatenate([ends, last], axis=1), n_states + 1
        order = np.argsort(numbers, kind="stable")
        return Pieces(ends[None], rows[None], order, np.searchsorted(numbers[order], np.arange(n_pieces + 1)))
