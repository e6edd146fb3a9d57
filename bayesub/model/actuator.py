"""One actuator: a fin, a propeller, a thruster, a ballast tank or a sliding mass; and water that acts like one.

A ballast pump is logged by the volume that it displaces, and its lift is that of the water displaced here and now. The
hull is lifted by the density of the water too. What acts is therefore the product of a volume and a density, or a
density without that for which the boat is trimmed; both are computed once, when a log is read.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from bayesub.logs.log_files import COLUMNS

GRAVITY_MPS2 = 9.81
DENSITY, ANOMALY, PRESSURE = "density_kgm3", "density_anomaly_kgm3", "pressure_bar"
N_WEIGHTS = 4  # a weight, and its moments: its force times x, y and z of the point where it acts


@dataclass(frozen=True)
class WaterColumn:
    """How the value of an actuator follows from a log."""

    volume: str | None  # column of a displaced volume, cm3, whose lift in N is the value; None for the anomaly itself
    density_kgm3: float  # of the water where the log does not say, and that from which the anomaly counts

    @property
    def columns(self) -> tuple[str, ...]:
        """The columns of a log from which it follows."""
        return (DENSITY,) if self.volume is None else (self.volume, DENSITY)

    def value(self, log: Mapping[str, np.ndarray]) -> np.ndarray | None:
        """(n,) the value, not a number where a cell is empty; None if the log has no such column."""
        if self.volume is None:
            return log[DENSITY] - self.density_kgm3 if DENSITY in log else None
        if self.volume not in log:
            return None
        density = self.density_kgm3
        if DENSITY in log:
            cells = np.isfinite(log[DENSITY])
            density = np.interp(log["time"], log["time"][cells], log[DENSITY][cells])
        return GRAVITY_MPS2 * density * log[self.volume] * 1e-6


@dataclass(frozen=True)
class Actuator:
    """One actuator; its value is what the log says, in SI units, or in counts and the like as they are.

    A unit of its value adds rows to the controls of the equations, and to forces (6,) and weights from outside.
    """

    name: str
    column: str  # of a log, with the unit as its suffix
    mixing: np.ndarray  # (n_controls,) of the controls of the equations
    force: np.ndarray  # N and N m
    force_of_square: np.ndarray  # the same for a unit of its value times the size of its value
    force_of_speed: np.ndarray  # the same for a unit of the size of its value and a surge velocity of 1 m/s
    rest: float = 0.0  # value that it has unless something else is ordered
    limit: float = np.inf  # largest value to either side
    rate: float | None = None  # largest rate of change, 1/s; None for one that answers at once
    time_constant: float | None = None  # s
    angle_deg: float | None = None  # where a fin stands around the hull, seen from astern, clockwise from up
    # Of a fin by geometry 1 if its trailing edge goes counterclockwise, seen from astern, with a positive value, -1 if
    # it goes clockwise; 0 if not given.
    turns: int = 0
    zero: float = 0.0  # value with which it does nothing
    commanded: bool = False  # whether its column is of commands
    weight: np.ndarray = field(default_factory=lambda: np.zeros(N_WEIGHTS))  # N, and its moments about the origin, N m
    water: WaterColumn | None = None  # from which its column follows with the density of the water

    def by_column(self, column: str, unit: float, zero: float) -> Actuator:
        """The same linear actuator, of which a log has another column, which stands at `zero` when the value is zero.

        A `unit` of the column is so much of the value; it is negative if the column counts the other way round.
        """
        return replace(
            self,
            column=column,
            turns=-self.turns if unit < 0.0 else self.turns,
            limit=self.limit / abs(unit),
            rate=None if self.rate is None else self.rate / abs(unit),
            rest=self.rest / unit + zero,
            zero=zero,
            mixing=unit * self.mixing,
            force=unit * self.force,
            weight=unit * self.weight,
        )

    @property
    def short(self) -> str:
        """Name of the column in memory."""
        return COLUMNS[self.column][0] if self.column in COLUMNS else self.column

    @property
    def unit(self) -> str:
        """Of the column."""
        return self.column.rpartition("_")[2]

    @property
    def range(self) -> tuple[float, float]:
        """Smallest and largest value."""
        return self.zero - self.limit, self.zero + self.limit

    @property
    def is_linear(self) -> bool:
        """Whether forces and controls are proportional to its value."""
        return not (self.force_of_square.any() or self.force_of_speed.any())

    def response(
        self, times: np.ndarray, demand_times: np.ndarray, demands: np.ndarray, start: float | None = None
    ) -> np.ndarray:
        """Values (n,) at times (n,), s, under several demands one after the other (model manual, equation 7.3).

        They are `demands` (m,) that begin at `demand_times` (m,), s; the value at the first is `start` or that of rest.
        """
        value = self.rest if start is None else start
        values = np.full(len(times), value, dtype=float)
        for j, (begin, demand) in enumerate(zip(demand_times, np.clip(demands, *self.range), strict=True)):
            end = demand_times[j + 1] if j + 1 < len(demand_times) else np.inf
            inside = (times >= begin) & (times < end)
            values[inside] = self._step(times[inside] - begin, value, demand)
            if np.isfinite(end):
                value = self._step(np.array([end - begin]), value, demand)[0]
        return values

    def _step(self, elapsed, start, demand) -> np.ndarray:
        if self.rate is None or self.time_constant is None:
            return np.full(len(elapsed), demand)
        return step_response(elapsed, start, demand, self.rate, self.time_constant)

    def nominal(self, kind: str) -> float:
        """The bias, scale, delay (s) or lag (s) with which the log is what acts; the lag is that of the vehicle."""
        return (self.time_constant or 0.0) if kind == "lag" else float(kind == "scale")


def step_response(elapsed: np.ndarray, start: float, demand: float, rate: float, time_constant: float) -> np.ndarray:
    """Plane angle, rad, at times (n,) since a step of the demand, s (model manual, section 7; thesis section 8.2).

    ``delta' = clip((demand - delta) / time_constant, -rate, rate)`` has a closed form: a slew at `rate` (rad/s) until
    ``rate * time_constant`` from the demand, then an exponential approach.
    """
    error = abs(demand - start)
    direction = np.sign(demand - start)
    slew_time = max(0.0, error / rate - time_constant)
    slewing = np.minimum(elapsed, slew_time) * rate
    settling = np.maximum(elapsed - slew_time, 0.0) / time_constant
    return start + direction * (slewing - (error - slew_time * rate) * np.expm1(-settling))


def with_water(log: dict[str, np.ndarray], actuators: Iterable[Actuator]) -> dict[str, np.ndarray]:
    """A log by short names, with the time, with columns of actuators in place of those of volumes and of the density.

    What the log has already of an actuator stays.
    """
    columns = {actuator.column: actuator.water for actuator in actuators if actuator.water is not None}
    values = {column: water.value(log) for column, water in columns.items() if column not in log}
    used = {name for water in columns.values() for name in water.columns}
    log = {name: cells for name, cells in log.items() if name not in used}
    return log | {column: value for column, value in values.items() if value is not None}
