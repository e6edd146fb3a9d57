"""One actuator: a fin, a propeller, a thruster, a ballast tank or a sliding mass; and water that acts like one.

A ballast pump is logged by the volume that it displaces, and its lift is that of the water displaced here and now. The
hull is lifted by the density of the water too. What acts is therefore the product of a volume and a density, or a
density without that for which the boat is trimmed; both are computed once, when a log is read.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from bayesub.logs.log_files import COLUMNS

GRAVITY_MPS2 = 9.81
DENSITY, ANOMALY, PRESSURE = "density_kgm3", "density_anomaly_kgm3", "pressure_bar"
N_WEIGHTS = 4  # a weight, and its moments: its force times x, y and z of the point where it acts


@dataclass(frozen=True)
class WaterColumn:
    """How the value of an actuator follows from a log.

    Attributes
    ----------
    volume : str or None
        Column of a displaced volume, cm3, whose lift in N is the value; None for the density anomaly itself.
    density_kgm3 : float
        Of the water where the log does not say, and that from which the anomaly counts.
    """

    volume: str | None
    density_kgm3: float

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

    Attributes
    ----------
    name : str
    column : str
        Of a log, with the unit as its suffix.
    mixing : (n_controls,) array
        What a unit of its value adds to the controls of the equations.
    force : (6,) array
        What a unit of its value adds to the forces from outside, N and N m.
    force_of_square : (6,) array
        The same for a unit of its value times the size of its value.
    force_of_speed : (6,) array
        The same for a unit of the size of its value and a surge velocity of 1 m/s.
    rest : float
        Value that it has unless something else is ordered.
    limit : float
        Largest value to either side.
    rate : float or None
        Largest rate of change, 1/s; None for one that answers at once.
    time_constant : float or None
        s.
    angle_deg : float or None
        Where a fin stands around the hull, seen from astern, clockwise from up.
    turns : int
        Of a fin by geometry: 1 if its trailing edge goes counterclockwise, seen from astern, with a positive value, -1
        if it goes clockwise; 0 if nobody says.
    zero : float
        Value with which it does nothing.
    commanded : bool
        Whether its column is of commands.
    weight : (4,) array
        What a unit of its value adds to the weight from outside, N, and to its moments about the origin, N m.
    water : WaterColumn or None
        The column from which that of the actuator follows with the density of the water.
    """

    name: str
    column: str
    mixing: np.ndarray
    force: np.ndarray
    force_of_square: np.ndarray
    force_of_speed: np.ndarray
    rest: float = 0.0
    limit: float = np.inf
    rate: float | None = None
    time_constant: float | None = None
    angle_deg: float | None = None
    turns: int = 0
    zero: float = 0.0
    commanded: bool = False
    weight: np.ndarray = field(default_factory=lambda: np.zeros(N_WEIGHTS))
    water: WaterColumn | None = None

    def by_column(self, column: str, unit: float, zero: float) -> Actuator:
        """The same linear actuator, of which a log has another column.

        Parameters
        ----------
        column : str
        unit : float
            Of its value, in a unit of the column; negative if the column counts the other way round.
        zero : float
            Where the column stands when the value is zero.
        """
        rate = None if self.rate is None else self.rate / abs(unit)
        parts = {"limit": self.limit / abs(unit), "rate": rate, "rest": self.rest / unit + zero, "zero": zero}
        parts |= {key: unit * getattr(self, key) for key in ("mixing", "force", "weight")}
        sign = -1 if unit < 0.0 else 1
        return replace(self, column=column, turns=sign * self.turns, **parts)

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
        """Values (n,) at times (n,) under several demands one after the other (model manual, equation 7.3).

        Parameters
        ----------
        times : (n,) array
            s.
        demand_times : (m,) array
            When each demand begins, s.
        demands : (m,) array
        start : float, optional
            Value at the first demand; by default that of rest.
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
        if self.rate is None:
            return np.full(len(elapsed), demand)
        return step_response(elapsed, start, demand, self.rate, self.time_constant)


def step_response(elapsed, start, demand, rate, time_constant):
    """Plane angle after a step of the demand.

    ``delta' = clip((demand - delta) / time_constant, -rate, rate)`` has a closed form: a slew at `rate` until
    ``rate * time_constant`` from the demand, then an exponential approach.

    Parameters
    ----------
    elapsed : (n,) array
        Times since the step, s.
    start : float
        Angle at the step, rad.
    demand : float
        Ordered angle, rad.
    rate : float
        Slew limit, rad/s.
    time_constant : float
        s.
    """
    error = abs(demand - start)
    direction = np.sign(demand - start)
    slew_time = max(0.0, error / rate - time_constant)
    slewing = np.minimum(elapsed, slew_time) * rate
    settling = np.maximum(elapsed - slew_time, 0.0) / time_constant
    return start + direction * (slewing - (error - slew_time * rate) * np.expm1(-settling))


def with_water(log: dict[str, np.ndarray], columns: Mapping[str, WaterColumn]) -> dict[str, np.ndarray]:
    """A log with the columns of actuators in place of those of volumes and of the density.

    Parameters
    ----------
    log : dict of str to (n,) array
        By short names, with the time.
    columns : mapping of str to WaterColumn
        Column of an actuator -> how it follows; one that the log has already stays.
    """
    values = {column: water.value(log) for column, water in columns.items() if column not in log}
    used = {name for water in columns.values() for name in water.columns}
    log = {name: cells for name, cells in log.items() if name not in used}
    return log | {column: value for column, value in values.items() if value is not None}
