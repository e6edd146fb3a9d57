"""Sensors in study files, a section for each kind, whose keys are its arguments in Python; and columns of actuators."""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
import pydantic

from bayesub import sensors
from bayesub.io.errors import InputError, check_known
from bayesub.io.toml_files import KindSection, Section
from bayesub.model.actuator_files import RAW_UNITS
from bayesub.model.vehicles import Vehicle

PRESETS = tuple(kind for kind, make in sensors.KINDS.items() if not isinstance(make, type))
PLACED = ("lever_arm_m", "clock_offset_s", "direction", "instrument")
FAULTS = ("dropout", "gaps", "outlier_probability", "bias")  # a scale of outliers alone is none


class SensorSection(KindSection):
    """Keys of every kind of sensor, besides its own: faults, place and clock, as of :class:`bayesub.sensors.Sensor`.

    Channels of one instrument, by default that of the kind, or of a single sensor its channel's, share clock and place.
    """

    dropout: float | None = None
    gaps: tuple[tuple[float, float], ...] | None = None
    outlier_probability: float | None = None
    outlier_scale: float | None = None
    lever_arm_m: tuple[float, float, float] | None = None
    clock_offset_s: float | None = None
    direction: tuple[float, float, float] | None = None
    instrument: str | None = None

    not_keys: ClassVar = PLACED  # which are given above, and left out of a completed study that has none

    @classmethod
    def registered(cls) -> Mapping[str, Callable[..., Any]]:
        """The sensors and instruments of :mod:`bayesub.sensors`, and whatever else was registered there."""
        return sensors.KINDS

    def _check(self):
        self.build()

    def build(self) -> tuple[sensors.Sensor, ...]:
        """The sensors that the section describes; InputError if they cannot exist."""
        changes = self.model_dump(exclude={"kind"}, exclude_none=True)
        arguments = {key: changes.pop(key) for key in inspect.signature(self.make).parameters if key in changes}
        return sensors.modified(self.make(**arguments), **changes)


class ControlSection(Section):
    """How the log of a study has an actuator: its column, by default that of the vehicle.

    Units are degrees of a fin, newtons of a thruster, in a unit of a column of counts and the like; negative if it
    counts the other way round. The limit of a fin is a hundred per cent by default.
    """

    column: str | None = pydantic.Field(default=None, pattern=rf"^[A-Za-z][A-Za-z0-9_]*_({'|'.join(RAW_UNITS)})$")
    unit_deg: float | None = None
    unit_n: float | None = None
    zero: float = 0.0  # where the column stands when the actuator does nothing
    commanded: bool = False

    def _check(self):
        for key in ("unit_deg", "unit_n"):
            if getattr(self, key) == 0.0:
                raise ValueError(f"{key} must not be zero")
        if self.column is None and any(getattr(self, key) for key in ("unit_deg", "unit_n", "zero")):
            raise InputError("unit and zero are those of a column; give column, which ends with its unit", "missing")

    def unit(self, name: str, native: str, limit: float) -> float:
        """SI units in a unit of the column, of an actuator of a name, the unit `native` and a limit in SI units."""
        key = {"deg": "unit_deg", "n": "unit_n"}.get(native)
        size = None if key is None else getattr(self, key)
        if size is not None:
            return np.radians(size).item() if native == "deg" else size
        if native == "deg" and str(self.column).endswith("_percent") and np.isfinite(limit):
            return limit / 100.0
        if key is None:
            text = f"controls.{name}: its column ends with _{native} and has no other; leave column out"
            raise InputError(text, "conflict", f"controls.{name}.column")
        text = f"controls.{name}: {key} is missing; give a guess of how much one unit of {self.column} is"
        raise InputError(text, "missing", f"controls.{name}.{key}")


def with_columns(vehicle: Vehicle, sections: Mapping[str, ControlSection]) -> Vehicle:
    """The vehicle with the columns of a study; InputError for an actuator that it does not have."""
    if not sections:
        return vehicle
    members = {actuator.name: actuator for actuator in vehicle.actuators.members}
    for name, section in sections.items():
        check_known(name, members, f"controls.{name}: there is no such actuator", key=f"controls.{name}")
        actuator = members[name]
        if section.column is not None:
            unit = section.unit(name, actuator.unit, actuator.limit)
            actuator = actuator.by_column(section.column, unit, section.zero)
        if section.commanded and actuator.rate is None:
            text = f"controls.{name}: answers a command at once; leave commanded out"
            raise InputError(text, "conflict", f"controls.{name}.commanded")
        members[name] = replace(actuator, commanded=section.commanded)
    direct = vehicle.actuators.direct and all(section.column is None for section in sections.values())
    return replace(vehicle, actuators=replace(vehicle.actuators, members=tuple(members.values()), direct=direct))
