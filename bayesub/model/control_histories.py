"""The histories of a manoeuvre: what the log says of the actuators, and the values that act, late or behind a command.

A value that is delayed, or that follows a command, is integrated over the steps of the simulator
(:mod:`bayesub.kernels.actuator_response`): the motion is then smooth in a delay and a lag, although the history has
kinks and jumps and the simulator has steps. All others are taken at the stages of the steps as the log has them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bayesub.io.errors import InputError
from bayesub.kernels.variations import Variations, of_entries
from bayesub.logs.log_files import si_factor
from bayesub.model.actuators import Actuators
from bayesub.model.disturbance import Knots
from bayesub.model.equations import AXES

if TYPE_CHECKING:
    from bayesub.model.manoeuvres import Manoeuvre
    from bayesub.model.vehicles import Vehicle

SHORTEST_LAG = 1e-6  # s, of a member whose lag would be negative
PARTS = np.array([[1.0, 0.0], [0.5, 0.5], [0.0, 1.0]])  # of the ends of a straight line in a step, at its stages


class Feature(NamedTuple):
    """A function of the value of an actuator, and what it adds to what the kernels take as controls."""

    row: np.ndarray  # (n_columns,) what a unit of the function adds
    of: Callable[[np.ndarray], np.ndarray]  # value (..) -> function (..)
    slope: Callable[[np.ndarray], np.ndarray]  # value (..) -> derivative of the function (..)


def features(actuators: Actuators, i: int, subproblem: str | None) -> list[Feature]:
    """What the value of the i-th actuator adds to :meth:`Actuators.kernel_controls`, as a sum of functions of it."""
    actuator = actuators.members[i]
    if actuator.is_linear:
        unit = np.eye(len(actuators.members))[i : i + 1] + actuators.zeros
        row = actuators.kernel_controls(unit, np.zeros(1), subproblem)[0]
        return [Feature(row, lambda v: v - actuator.zero, np.ones_like)]
    # Forces go with v |v| and with |v|: the odd and the even part of those of one unit ahead and one astern.
    ends = np.tile(actuators.zeros, (2, 1))
    ends[:, i] = 1.0, -1.0
    ahead, astern = actuators.kernel_controls(ends, np.zeros(2), subproblem)
    of_square, of_size = 0.5 * (ahead - astern), 0.5 * (ahead + astern)
    return [Feature(of_square, lambda v: v * np.abs(v), lambda v: 2.0 * np.abs(v)), Feature(of_size, np.abs, np.sign)]


class ControlHistories:
    """The histories of a manoeuvre of a vehicle, at the steps of a simulator.

    Parameters are as those of :class:`bayesub.model.simulator.Simulator`, n_varied `varied` of actuators alone. Steps
    begin at `starts` (n,), the last one at the end of the flight; `stage_times` are three arrays (n,), s. What acts at
    the `stages` is a list of three arrays (n, n_actuators), without biases and scales; `individual` are the positions
    of the actuators of which each member has a delay or a lag of its own. InputError for a delay, a lag or a command
    where the controls are held over a step.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        manoeuvre: Manoeuvre,
        starts: np.ndarray,
        step: float,
        stage_times: list[np.ndarray],
        varied: tuple[str, ...],
        changes: Mapping[str, float],
        subproblem: str | None,
    ):
        self._actuators, self._manoeuvre, self._subproblem = vehicle.actuators, manoeuvre, subproblem
        direct = vehicle.actuators.direct
        self._inputs = manoeuvre.controls if direct or manoeuvre.inputs is None else manoeuvre.inputs
        self._boundaries, self._step = np.append(starts, starts[-1] + step), step
        self._varied, self._changes = varied, changes
        self._commanded = {i for i, a in enumerate(vehicle.actuators.members) if a.short in manoeuvre.commanded}
        self.individual = tuple(dict.fromkeys(self._late(varied)))
        responding = sorted({*self.individual, *self._late(changes), *self._commanded})
        if responding and stage_times[2][0] == stage_times[0][0]:
            raise InputError("a delay, a lag or a command needs controls = linear, found hold", "conflict", "controls")
        self.stages = [self.logged(times) for times in stage_times]
        for i in responding:
            ends = self._ends(i, np.zeros((1, len(varied))))[0]
            for values, part in zip(self.stages, PARTS, strict=True):
                values[:, i] = ends @ part

    def _late(self, parameters):
        """Positions of the actuators of which any of the parameters is a delay or a lag."""
        entries = (self._actuators.parameters.get(name, (0, "")) for name in parameters)
        return [i for i, kind in entries if kind in ("delay", "lag")]

    def logged(self, times: np.ndarray) -> np.ndarray:
        """(n, n_actuators) what the log says of the actuators at times (n,), linearly interpolated; commands hold."""
        history = self._manoeuvre.times
        columns = [np.interp(times, history, column) for column in self._inputs.T]
        for i in self._commanded:
            before = np.maximum(np.searchsorted(history, times, side="right") - 1, 0)
            columns[i] = self._inputs[before, i]
        return np.column_stack(columns or [np.empty((len(times), 0))])

    def at(self, times: np.ndarray) -> np.ndarray:
        """(n, n_actuators) the values that act at times (n,), without biases and scales."""
        values = self.logged(times)
        for i in {*self._late(self._changes), *self._commanded}:
            order = np.argsort(times, kind="stable")
            points, _ = self._responses(i, times[order], *self._lateness(i, np.zeros((1, len(self._varied)))))
            values[order, i] = points[0, :, 0]
        return values

    def _value(self, i, kind, amounts):
        """(n_batch,) values of the parameter of a kind, of actuator i, of amounts (n_batch, n_varied)."""
        names = [name for name, entry in self._actuators.parameters.items() if entry == (i, kind)]
        if not names:
            return np.zeros(len(amounts))
        (name,) = names
        value = np.full(len(amounts), self._actuators.members[i].nominal(kind) + self._changes.get(name, 0.0))
        if name in self._varied:
            value += amounts[:, self._varied.index(name)]
        return value

    def _lateness(self, i, amounts):
        """Delays (n_batch,) and lags (n_batch,) of actuator i, s."""
        delays = self._value(i, "delay", amounts)
        if i not in self._commanded:
            return delays, np.zeros(len(amounts))
        return delays, np.maximum(self._value(i, "lag", amounts), SHORTEST_LAG)

    def _responses(self, i, boundaries, delays, lags):
        """Values at boundaries (n_batch, n, 2) and integrals (n_batch, n - 1, 4) of actuator i."""
        from bayesub.kernels.actuator_response import responses  # importing numba takes a second

        actuator, times = self._actuators.members[i], self._manoeuvre.times
        values = np.ascontiguousarray(self._inputs[:, i])
        slopes, rate = np.append(np.diff(values) / np.diff(times), 0.0), np.inf
        if i in self._commanded:
            values, slopes, rate = np.clip(values, *actuator.range), np.zeros(len(times)), actuator.rate
        bends = np.append(True, (values[1:] != values[:-1]) | (slopes[1:] != 0.0))
        times, values, slopes = times[bends], values[bends], slopes[bends]
        points = np.empty((len(delays), len(boundaries), 2))
        integrals = np.empty((len(delays), len(boundaries) - 1, 4))
        responses(times, values, slopes, rate, boundaries, delays, lags, points, integrals)
        return points, integrals

    def _ends(self, i, amounts):
        """The controls that act at begin and end of each step (n_batch, n, 2)."""
        from bayesub.kernels.actuator_response import straight_lines

        return straight_lines(self._responses(i, self._boundaries, *self._lateness(i, amounts))[1], self._step)

    def added(self, amounts: np.ndarray) -> np.ndarray:
        """(n_batch, n_numbers) how much functions of actuators of :attr:`individual` differ from nominal ones.

        Of each actuator and :class:`Feature` they are those at the begin and the end of each
        step; :meth:`individual_entries` has what a unit of each adds.
        """
        columns, none = [], np.zeros((1, len(self._varied)))
        for i in self.individual:
            ends, nominal = self._ends(i, amounts), self._ends(i, none)
            scale, base = self._value(i, "scale", amounts), self._value(i, "scale", none)
            unit = si_factor(self._actuators.members[i].column)
            bias, offset = (self._value(i, "bias", rows) * unit for rows in (amounts, none))
            for k, feature in enumerate(features(self._actuators, i, self._subproblem)):
                change = scale[:, None, None] * feature.of(ends) - base * feature.of(nominal)
                if k == 0:  # what has a bias has this feature alone
                    change += (bias - offset)[:, None, None]
                columns.append(change.reshape(len(amounts), -1))
        return np.hstack(columns)

    def individual_entries(self) -> list[tuple[np.ndarray, ...]]:
        """What a unit of each of the numbers of :meth:`added` adds to the controls at the stages.

        Each is the stages, numbers, columns and values of :func:`bayesub.kernels.variations.of_entries`.
        """
        entries: list[tuple[np.ndarray, ...]] = []
        first, n = 0, len(self._boundaries) - 1
        for i in self.individual:
            for feature in features(self._actuators, i, self._subproblem):
                stage, end, column = (part.ravel() for part in np.indices((3, 2, len(feature.row))))
                weights = PARTS[stage, end] * feature.row[column]
                steps, of = (part.ravel() for part in np.meshgrid(range(n), np.flatnonzero(weights), indexing="ij"))
                entries.append((3 * steps + stage[of], first + 2 * steps + end[of], column[of], weights[of]))
                first += 2 * n
        return entries

    def slopes(self, parameter: str, amounts: np.ndarray) -> np.ndarray | None:
        """(n, 3, n_columns) derivative of the controls at the stages by a parameter, of amounts (n_varied,).

        None if it is that of :meth:`bayesub.model.actuators.Actuators.variation` at :attr:`stages`.
        """
        i, kind = self._actuators.parameters[parameter]
        if kind in ("bias", "scale") and i not in self.individual:
            return None
        from bayesub.kernels.actuator_response import line_slopes

        points, integrals = self._responses(i, self._boundaries, *self._lateness(i, amounts[None]))
        unit = si_factor(self._actuators.members[i].column)
        ends, (by_delay, by_lag) = self._ends(i, amounts[None])[0], line_slopes(points[0], integrals[0], self._step)
        scale, change = self._value(i, "scale", amounts[None]), np.zeros(1)
        for feature in features(self._actuators, i, self._subproblem):
            of = {
                "bias": lambda feature=feature: unit * feature.slope(ends),
                "scale": lambda feature=feature: feature.of(ends),
                "delay": lambda feature=feature: scale * feature.slope(ends) * by_delay,
                "lag": lambda feature=feature: scale * feature.slope(ends) * by_lag,
            }[kind]()
            change = change + (of @ PARTS.T)[:, :, None] * feature.row
        return change


class StageChanges:
    """The changes of the controls at the stages by which members of a batch differ: actuators, and forces at knots.

    Most are amounts of what a unit of each adds. An actuator that has a delay or a lag of a member's own adds what that
    makes of its history instead, and the biases and scales of this actuator go into it. `varied` are n_varied
    parameters of actuators, those of the histories, and after them forces at the knots. The `variations` are what a
    unit of each of :meth:`numbers` adds, of which `n_before` come before the forces.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        subproblem: str | None,
        varied: tuple[str, ...],
        histories: ControlHistories,
        stage_times: list[np.ndarray],
        knots: Knots | None,
    ):
        self._vehicle, self._subproblem, self._histories = vehicle, subproblem, histories
        self._stage_times, self._knots = stage_times, knots
        positions = {name: i for name, (i, _) in vehicle.actuators.parameters.items()}
        self._n_of_actuators = sum(name in positions for name in varied)
        self._individual = np.array([positions.get(name) in histories.individual for name in varied], dtype=bool)
        others = tuple(name for name, individual in zip(varied, self._individual, strict=True) if not individual)
        first = len(others)
        self.n_before = first - (0 if knots is None else len(knots.parameters))
        individual = ((stages, first + numbers, *rest) for stages, numbers, *rest in histories.individual_entries())
        self.variations = self._variations([*self._entries(others, np.zeros(self._n_of_actuators)), *individual])

    def numbers(self, amounts: np.ndarray) -> np.ndarray:
        """What the kernels take as amounts, of amounts (n_batch, n_varied): those of own histories come last."""
        if not self._histories.individual:
            return amounts
        return np.hstack([amounts[:, ~self._individual], self._histories.added(amounts[:, : self._n_of_actuators])])

    def by(self, parameters: tuple[str, ...], amounts: np.ndarray | None) -> Variations:
        """The derivatives of the controls by parameters, at amounts (n_varied,) or none."""
        n = self._n_of_actuators
        return self._variations(self._entries(parameters, np.zeros(n) if amounts is None else amounts[:n]))

    @property
    def are_linear(self) -> bool:
        """Whether the derivatives are the same at all amounts."""
        return not self._histories.individual

    def _entries(self, parameters, amounts):
        """Stages, numbers, columns and values of what a unit of each parameter adds, part by part."""
        actuators, knots = self._vehicle.actuators, self._knots
        forces = {} if knots is None else {name: n for n, name in enumerate(knots.parameters)}
        places = {forces[name]: m for m, name in enumerate(parameters) if name in forces}
        others = {m: name for m, name in enumerate(parameters) if name not in forces}
        slopes = {m: (name, self._histories.slopes(name, amounts)) for m, name in others.items()}
        for k, times in enumerate(self._stage_times if len(parameters) else ()):
            for m, (name, slope) in slopes.items():
                if slope is None:
                    change = actuators.variation(name, self._histories.stages[k], self._subproblem)
                else:
                    change = slope[:, k]
                rows, columns = np.nonzero(change)
                yield 3 * rows + k, np.full(len(rows), m), columns, change[rows, columns]
            if knots is None or not places:
                continue
            first = len(self._vehicle.equations.controls) + 1
            rows, near, weights = knots.hats(times)
            for a, axis in enumerate(knots.axes):
                numbers = np.array([places.get(n, -1) for n in a * len(knots.times) + near])
                of = numbers >= 0
                column = np.full(np.count_nonzero(of), first + AXES.index(axis))
                yield 3 * rows[of] + k, numbers[of], column, weights[of]

    def _variations(self, entries) -> Variations:
        none = (np.zeros(0, dtype=int),) * 3 + (np.zeros(0),)
        stages, *rest = (np.concatenate(part) for part in zip(none, *entries, strict=True))
        order = np.argsort(rest[0], kind="stable")  # a member adds its amounts in their order
        return of_entries(len(self._stage_times[0]), stages[order], *(part[order] for part in rest))
