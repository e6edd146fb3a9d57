"""Columns of a log about the water along the path, and the columns of actuators that follow from them.

A ballast pump is logged by the volume that it displaces, and its lift is that of the water displaced here and now. The
hull is lifted by the density of the water too. What acts is therefore the product of a volume and a density, or a
density without that for which the boat is trimmed; both are computed once, when a log is read.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

GRAVITY_MPS2 = 9.81
DENSITY, ANOMALY, PRESSURE = "density_kgm3", "density_anomaly_kgm3", "pressure_bar"


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
