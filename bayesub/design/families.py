"""Families of manoeuvres: numbers between -1 and 1 that make orders which planes and propeller can follow.

``steps``
    orders that hold until the next, as a helmsman gives them
``curves``
    straight lines between knots, as an autopilot can follow them
``multisines``
    harmonics that the controls share among themselves, with free amplitudes and phases (Morelli 2016)
``standard``
    zig-zags of rudder and planes with free angles and periods, and circles where a period is longer than the trial
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayesub.design.limits import Limits
from bayesub.io.errors import check_known
from bayesub.logs import log_files
from bayesub.model.manoeuvre_files import straight_and_level
from bayesub.model.manoeuvres import Manoeuvre, of_inputs
from bayesub.model.vehicles import Vehicle

LENGTHS = 44.0  # ship lengths that a trial takes unless its limits say otherwise: ten minutes of suboff
N_SAMPLES = 1200  # of a control history
RPM = "rpm"


@dataclass(frozen=True)
class Control:
    """One control that may be moved; values are in SI units."""

    column: str  # of a log, ``rudder_deg`` or ``rpm``
    rest: float
    lower: float
    upper: float
    rate: float  # largest rate of change, 1/s

    @property
    def unit(self) -> float:
        """SI units in a unit of the column."""
        return 1.0 if self.column == RPM else log_files.si_factor(self.column)

    @property
    def centre(self) -> float:
        """Value of a shape of zero: the rest, but for the propeller, which rests at one end of its range."""
        return 0.5 * (self.lower + self.upper) if self.column == RPM else self.rest

    def values(self, shape: np.ndarray) -> np.ndarray:
        """(n,) values, SI units, of a shape (n,) from -1 at the lower end to 1 at the upper one."""
        return self.centre + np.where(shape < 0.0, self.centre - self.lower, self.upper - self.centre) * shape

    def shape(self, values: np.ndarray) -> np.ndarray:
        """(n,) shape of values (n,); the inverse of :meth:`values`."""
        change = values - self.centre
        return change / np.where(change < 0.0, self.centre - self.lower, self.upper - self.centre)

    def followed(self, shape: np.ndarray, times: np.ndarray) -> np.ndarray:
        """(n,) values, from rest, that follow a shape (n,) at equal steps of time as fast as the control can."""
        wanted, largest = self.values(shape), self.rate * (times[1] - times[0])
        if not np.isfinite(largest):
            return np.concatenate([[self.rest], wanted[1:]])
        values, value = np.empty(len(wanted)), self.rest
        for k, target in enumerate(wanted.tolist()):
            value += min(max(target - value, -largest), largest) if k else 0.0
            values[k] = value
        return values


def controls(vehicle: Vehicle, limits: Limits) -> tuple[Control, ...]:
    """What may be moved on a vehicle: its actuators within the limits, and the propeller if its speed may change.

    An actuator without a limit, of vehicle or trial, rests. InputError for a limit of a control that is not there.
    """
    members = {m.column: m for m in vehicle.actuators.members if m.short in vehicle.inputs and m.column != RPM}
    given, expected = limits.of_controls, [f"{column}{rate}" for column in members for rate in ("", "ps")]
    for key in given:
        check_known(key, expected, f"limits: '{key}' is no limit and no control of '{vehicle.name}'")
    moved = []
    for column, member in members.items():
        factor = log_files.si_factor(column)
        largest = min(member.limit, given.get(column, np.inf) * factor)
        rate = min(np.inf if member.rate is None else member.rate, given.get(f"{column}ps", np.inf) * factor)
        if np.isfinite(largest):  # and not the density of the water, or a tank of unknown size
            moved.append(Control(column, member.rest, member.zero - largest, member.zero + largest, rate))
    low, begin, high = _rpm(vehicle, limits)
    if RPM in vehicle.inputs and low < high:
        percent = np.inf if limits.rpm_percentps is None else limits.rpm_percentps
        moved.append(Control(RPM, begin, low, high, 0.01 * percent * vehicle.rpm_per_mps * vehicle.speed_mps))
    return tuple(moved)


def _rpm(vehicle: Vehicle, limits: Limits) -> tuple[float, float, float]:
    """The least propeller speed, that at which a trial begins, the nearest to self-propulsion, and the largest."""
    steady = vehicle.rpm_per_mps * vehicle.speed_mps
    low, high = (0.01 * percent * steady for percent in (limits.min_rpm_percent, limits.max_rpm_percent))
    return low, min(max(steady, low), high), high


@dataclass(frozen=True)
class Family:
    """Manoeuvres of one kind."""

    kind: str  # a key of :data:`KINDS`
    vehicle: Vehicle
    limits: Limits
    controls: tuple[Control, ...]
    subproblem: str | None = None
    n_knots: int = 45  # orders, knots or harmonics of each control

    @property
    def duration(self) -> float:
        """s."""
        return self.limits.duration_s or LENGTHS * self.vehicle.length_m / self.vehicle.speed_mps

    @property
    def n_dims(self) -> int:
        """How many numbers make a manoeuvre."""
        return KINDS[self.kind][0](self) * len(self.controls)

    @cached_property
    def times(self) -> np.ndarray:
        """(n_samples,) of the control history, s."""
        return np.linspace(0.0, self.duration, N_SAMPLES + 1)

    def start(self, rng: np.random.Generator) -> np.ndarray:
        """(n_dims,) numbers of a random manoeuvre."""
        return rng.uniform(-1.0, 1.0, self.n_dims)

    def manoeuvre(self, numbers: np.ndarray, name: str = "design") -> Manoeuvre:
        """The manoeuvre of numbers (n_dims,); the controls follow as fast as they can."""
        shapes = KINDS[self.kind][1](self, np.clip(numbers, -1.0, 1.0).reshape(len(self.controls), -1))
        orders = {c.column: c.followed(shape, self.times) for c, shape in zip(self.controls, shapes, strict=True)}
        return self._of(orders, name)

    def orders(self, numbers: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Column -> times (n,), s, and what is ordered then (n,), in the unit of the column, of steps.

        Empty for other kinds, which an autopilot follows.
        """
        if self.kind != "steps":
            return {}
        rows = np.clip(numbers, -1.0, 1.0).reshape(len(self.controls), -1)
        times = self.times[np.searchsorted(_held(self, rows.shape[1]), np.arange(rows.shape[1]))]
        return {c.column: (times, c.values(row) / c.unit) for c, row in zip(self.controls, rows, strict=True)}

    def straight(self) -> Manoeuvre:
        """The manoeuvre in which nothing moves."""
        return self._of({}, "straight")

    def _of(self, histories, name):
        boat = self.vehicle
        inputs = np.tile(boat.actuators.rest, (len(self.times), 1))
        rpm = histories.get(RPM, np.full(len(self.times), _rpm(boat, self.limits)[1]))
        for k, member in enumerate(boat.actuators.members):
            if member.column in histories:
                inputs[:, k] = histories[member.column]
        return of_inputs(name, self.times, inputs, rpm, straight_and_level(boat), boat, subproblem=self.subproblem)


def _n_orders(family: Family) -> int:
    """Steps of each control: what the helmsman can follow, at most as many as knots."""
    an_hour = family.limits.orders_an_hour
    return family.n_knots if an_hour is None else max(1, min(family.n_knots, int(an_hour * family.duration / 3600.0)))


def _held(family: Family, n: int) -> np.ndarray:
    """(n_samples,) which of n orders holds."""
    return np.minimum((np.arange(len(family.times)) * n) // len(family.times), n - 1)


def _curves(family: Family, numbers):
    knots = np.linspace(0.0, family.duration, numbers.shape[1])
    return [np.interp(family.times, knots, row) for row in numbers]


def _multisines(family: Family, numbers):
    """Control j has the harmonics j + 1, j + 1 + n_controls, ..; amplitudes share a control's range."""
    n, (n_controls, _) = family.n_knots, numbers.shape
    shapes = []
    for j, row in enumerate(numbers):
        amplitudes, phases = 0.5 * (row[:n] + 1.0), np.pi * row[n:]
        harmonics = 1 + j + n_controls * np.arange(n)
        waves = np.sin(2.0 * np.pi * np.outer(harmonics, family.times / family.duration) + phases[:, None])
        shape = amplitudes @ waves
        shapes.append(shape / max(np.abs(shape).max(), 1.0))
    return shapes


def _standard(family: Family, numbers):
    """Square waves: amplitude, mean, logarithm of the period from a fiftieth to twice the trial, phase."""
    shapes = []
    for amplitude, mean, period, phase in numbers:
        period = family.duration * 10.0 ** (-0.7 + period)
        square = np.sign(np.sin(2.0 * np.pi * family.times / period + np.pi * phase))
        shapes.append(np.clip(0.5 * (1.0 + amplitude) * square + 0.5 * mean, -1.0, 1.0))
    return shapes


KINDS: dict[str, tuple[Callable, Callable]] = {  # numbers of each control, and shapes (n_controls, n_samples) of them
    "steps": (_n_orders, lambda family, numbers: numbers[:, _held(family, numbers.shape[1])]),
    "curves": (lambda family: family.n_knots, _curves),
    "multisines": (lambda family: 2 * family.n_knots, _multisines),
    "standard": (lambda _family: 4, _standard),
}
