"""A trial as a random process from reading to reading: what a Kalman filter needs of it.

The states are those of the boat that move and the unmodelled forces, in units of their sd. Over an interval h the force
f of an axis, an Ornstein-Uhlenbeck process with correlation time T, goes to

    exp(-h / T) f + sqrt(1 - exp(-2 h / T)) w,

with w standard normal. The boat feels the straight line between the two, and the impulse of how far the process is
from it: as much as that of a constant force of sd ``sqrt(h / (6 T))``, the mean of a Brownian bridge. Intervals are no
longer than half of a correlation time. Derivatives are differences of flights side by side.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from bayesub.io.errors import InputError
from bayesub.logs.log_files import STATES
from bayesub.model.disturbance import CURRENTS, KINDS
from bayesub.problem.distributions import joined
from bayesub.problem.disturbances import of_history
from bayesub.problem.nuisance import MOVING
from bayesub.problem.trial_problem import TrialProblem
from bayesub.sensors.current import Water
from bayesub.sensors.measurement import MeasurementModel
from disturbed.segments import Segment

_STATE_STEP, _FORCE_STEP = 1e-5, 1e-2  # of differences: of a length, a radian and the trial speed; of the sd of a force
_LONGEST = 0.5  # interval, in correlation times


@dataclass(frozen=True)
class Time:
    """The end of an interval, and the m readings there.

    Attributes
    ----------
    segment : Segment
        Of the manoeuvre, that ends there.
    interval : float
        Its length, s.
    positions : (m,) array
        Of these readings among all.
    channels : (m,) array
        Number of the channel of each.
    readings : (m,) array
    measurement : MeasurementModel or None
        What these channels read; None if there are none.
    """

    segment: Segment
    interval: float
    positions: np.ndarray
    channels: np.ndarray
    readings: np.ndarray
    measurement: MeasurementModel | None


class StateSpace:
    """A problem whose histories of unmodelled forces are states of a filter, and no parameters.

    Readings are taken to have independent normal noise of the total sd, as by
    :meth:`bayesub.problem.trial_problem.TrialProblem.naive`.

    Parameters
    ----------
    problem : TrialProblem
        With or without a disturbance.

    Attributes
    ----------
    names : tuple of str
        The n_params parameters: those of the problem without the histories.
    prior : Prior
        Of these.
    costs : Costs
        Those of the problem. Each flight of a filter is a simulation.
    readings : list of (m,) arrays
        At each of the times; at some there are none.
    variances : list of (m,) arrays
        Of the noise of these.

    Raises
    ------
    InputError
        For a process that is not an Ornstein-Uhlenbeck process, and for unknown parameters of noise and instruments.
    """

    def __init__(self, problem: TrialProblem):
        forward = problem.forward
        unknown = None if forward.disturbances is None else forward.disturbances.unknown
        if unknown is not None and unknown.kind != KINDS[0]:
            raise InputError(
                f"disturbance: the filter-error estimate takes kind '{KINDS[0]}', found '{unknown.kind}'",
                "conflict",
                "kind",
            )
        if unknown is not None and forward.disturbances.members(CURRENTS):
            raise InputError(
                "disturbance: the filter-error estimate takes forces, found a current; leave it out", "conflict", "axes"
            )
        for parameter in forward.nuisances.parameters:
            if parameter.mount is not None:
                raise InputError(
                    f"nuisance '{parameter.name}': the filter-error estimate takes clocks and places that are known; "
                    "leave it out",
                    "conflict",
                    parameter.name,
                )
        for channel in problem.record.channels:
            for _, k, _ in forward.nuisances.of_noise(channel):
                raise InputError(
                    f"nuisance '{forward.nuisances.names[k]}': the filter-error estimate takes noise that is known; "
                    "leave it out",
                    "conflict",
                    forward.nuisances.names[k],
                )
        self.problem = problem
        self.axes = () if unknown is None else unknown.axes
        self.kept = np.array([not of_history(name) for name in problem.names])
        self.names = tuple(name for name in problem.names if not of_history(name))
        priors = {name: prior for name, prior in problem.nuisance_priors.items() if name in self.names}
        self.prior, self.costs = joined(problem.coefficient_prior, priors), problem.costs
        self.times = list(_times(problem, self.axes, np.inf if unknown is None else _LONGEST * unknown.time_s))
        self.readings = [time.readings for time in self.times]
        self.variances = [problem.sds[time.positions] ** 2 for time in self.times]
        # Only what moves and what is read is asked of the simulation.
        moving = MOVING.get(problem.simulator.subproblem, STATES)
        self.moving = np.array([STATES.index(state) for state in moving])
        self.outputs = tuple(dict.fromkeys((*moving, *forward.measurement.measured)))
        length, speed = problem.vehicle.length_m, problem.vehicle.speed_mps
        scales = np.repeat([length, 1.0, speed, speed / length], 3)[self.moving]
        self.steps = np.concatenate([_STATE_STEP * scales, np.full(2 * len(self.axes), _FORCE_STEP)])

    @property
    def n_params(self) -> int:
        """Number of parameters."""
        return len(self.names)

    def members(self, parameters: np.ndarray) -> "Members":
        """A batch of the process, with parameters (n_batch, n_params)."""
        self.costs.simulations += len(parameters) * (1 + len(self.steps))
        return Members(self, parameters)


class Members:
    """A batch of members, from time to time.

    Parameters
    ----------
    space : StateSpace
    parameters : (n_batch, n_params) array

    Attributes
    ----------
    states : (n_batch, n_states) array
        Expected at the start: those of the boat that move, and the forces.
    covariances : (n_batch, n_states, n_states) array
        Of these.
    """

    def __init__(self, space: StateSpace, parameters: np.ndarray):
        problem, forward, n = space.problem, space.problem.forward, len(parameters)
        complete = np.zeros((n, problem.n_params))
        complete[:, space.kept] = parameters
        sets, values = problem.arguments(complete)
        of, simulator, start = forward.nuisances, forward.simulator, forward.manoeuvre.initial_state
        self._space, self._n_flights = space, 1 + len(space.steps)  # the mean, and one for each difference
        self._initial = _rows(of.initial(values), start, n)
        self._amounts = _rows(of.amounts(values), np.zeros(len(of.varied)), n)
        body, constants = _rows(of.body(values), simulator.vehicle.body, n), simulator.vehicle.constants
        bodies = np.hstack([body, _rows(None, constants, n)])
        self._dimensional = np.tile(simulator.dimensional(sets), (self._n_flights, 1))
        self._bodies = np.tile(bodies, (self._n_flights, 1))
        currents = of.currents(values)
        self._currents = None if currents is None else np.tile(currents, (self._n_flights, 1))
        self._biases = np.zeros((n, len(forward.record.channels)))
        for channel, k, factor in of.on_readings("bias", forward.record.channels):
            self._biases[:, channel] += factor * values[:, k]
        self._sds, self._correlation_times = np.zeros((n, 0)), np.ones(n)
        if space.axes:
            first = of.names.index(next(iter(forward.disturbances.priors)))
            self._sds, times = forward.disturbances.process(values[:, first:])
            (self._correlation_times,) = times.values()
        self.states = np.hstack([self._initial[:, space.moving], np.zeros((n, len(space.axes)))])
        uncertain = np.arange(self.states.shape[1]) >= len(space.moving)
        self.covariances = np.repeat(np.diag(uncertain.astype(float))[None], n, axis=0)

    def advance(self, k: int, states: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """To the k-th time, from states (n_batch, n_states) at the one before.

        Returns
        -------
        means : (n_batch, n_states + m) array
            States and readings, not a number where the simulation failed.
        by_states : (n_batch, n_states + m, n_states) array
            Their derivatives.
        by_noise : (n_batch, n_states + m, n_noises) array
            Derivatives by standard normal noise.
        """
        space, time = self._space, self._space.times[k]
        n_moving, n_axes = len(space.moving), len(space.axes)
        n_states = n_moving + n_axes
        decay = np.exp(-time.interval / self._correlation_times)[:, None, None]
        # What an interval depends on: states of the boat, forces at its beginning and at its end.
        causes = np.tile(np.hstack([states, decay[:, 0] * states[:, n_moving:]]), (self._n_flights, 1, 1))
        differences = np.arange(len(space.steps))
        causes[1 + differences, :, differences] += space.steps[:, None]
        effects = self._fly(time, causes)
        slopes = np.moveaxis((effects[1:] - effects[0]) / space.steps[:, None, None], 0, 2)
        of_boat, before, after = np.split(slopes, [n_moving, n_states], axis=2)
        between = np.sqrt(time.interval / (6.0 * self._correlation_times))[:, None, None] * (before + after)
        between[:, n_moving:n_states] = 0.0  # it changes the boat, and not the force at the end
        means = effects[0]
        if time.measurement is not None:
            means[:, n_states:] += self._biases[:, time.channels]
            time.measurement.to_nearest_turn(means[:, n_states:], time.readings)
        by_states = np.concatenate([of_boat, before + decay * after], axis=2)
        return means, by_states, np.concatenate([np.sqrt(1.0 - decay**2) * after, between], axis=2)

    def _fly(self, time, causes) -> np.ndarray:
        """States and readings (n_flights, n_batch, n_states + m) of causes (n_flights, n_batch, n_causes)."""
        space, shape = self._space, causes.shape[:2]
        n_moving, n_axes = len(space.moving), len(space.axes)
        flat = causes.reshape(-1, causes.shape[2])
        begin = np.tile(self._initial, (self._n_flights, 1))
        begin[:, space.moving] = flat[:, :n_moving]
        forces = flat[:, n_moving:] * np.tile(self._sds, (self._n_flights, 2))
        amounts = np.hstack([np.tile(self._amounts, (self._n_flights, 1)), forces])
        outputs = time.segment.fly(self._dimensional, self._bodies, begin, amounts, space.outputs)
        parts = [outputs[:, :n_moving], flat[:, n_moving + n_axes :]]
        if time.measurement is not None:
            measured = [space.outputs.index(name) for name in time.measurement.measured]
            water = None if self._currents is None else Water.steady(self._currents, time.measurement.times)
            parts.append(time.measurement.of(outputs[:, None, measured], water))
        return np.hstack(parts).reshape(*shape, -1)


def _rows(rows, default, n) -> np.ndarray:
    """The rows (n, ..), or the default (..) for each of n."""
    return np.tile(default, (n, 1)) if rows is None else rows


def _times(problem, axes, longest) -> Iterator[Time]:
    """The times at which a channel reads, and as many in between that no interval is longer than `longest`, s."""
    forward, channels = problem.forward, problem.record.channels
    begin, none = 0.0, np.zeros(0, dtype=int)
    for end in forward.measurement.times:
        n = max(1, int(np.ceil((end - begin) / longest * (1.0 - 1e-9))))
        between = np.linspace(begin, end, n + 1)
        segments = [Segment(forward.simulator, *ends, axes, forward.nuisances.varied) for ends in pairwise(between)]
        for segment in segments[:-1]:
            yield Time(segment, (end - begin) / n, none, none, np.zeros(0), None)
        rows = [np.flatnonzero(channel.times == end) for channel in channels]
        numbers = np.repeat(np.arange(len(channels)), [len(part) for part in rows])
        starts = [part.start for part in forward.measurement.slices]
        positions = np.concatenate([start + part for start, part in zip(starts, rows, strict=True)])
        here = [replace(c, times=c.times[r], values=c.values[r]) for c, r in zip(channels, rows, strict=True) if len(r)]
        measurement = MeasurementModel(here, current=bool(forward.nuisances.current_columns()))
        yield Time(segments[-1], (end - begin) / n, positions, numbers, problem.readings[positions], measurement)
        begin = end
