"""Sensors in study files: a section for each kind, whose keys are the arguments of the sensor in Python."""

import functools
import inspect
import operator
from typing import Annotated, Literal

import pydantic

from bayesub import sensors
from bayesub.io.toml_files import Section

KINDS = {
    "track": sensors.Track,
    "sensor": sensors.Sensor,
    "pressure": sensors.Pressure,
    "compass": sensors.Compass,
    "ins": sensors.INS,
    "dvl": sensors.DVL,
    "adcp": sensors.ADCP,
    "gps": sensors.GPS,
    "autosub": sensors.autosub,
    "thesis_rounding": sensors.thesis_rounding,
    "tracking_range": sensors.tracking_range,
}


PRESETS = ("autosub", "thesis_rounding", "tracking_range")
PLACED = ("lever_arm_m", "clock_offset_s", "direction", "instrument")
FAULTS = ("dropout", "gaps", "outlier_probability", "bias")  # a scale of outliers alone is none


class SensorSection(Section):
    """Keys of every kind of sensor, besides its own: faults, place and clock (:class:`bayesub.sensors.Sensor`).

    Attributes
    ----------
    dropout : float or None
        Probability that a reading is missing.
    gaps : tuple of (float, float) or None
        Begin and end of times without readings, s.
    outlier_probability, outlier_scale : float or None
        How often a reading is wrong, and by how many standard deviations.
    lever_arm_m : (float, float, float) or None
        Place of the sensor ahead, to starboard and down from the body origin.
    clock_offset_s : float or None
        How far its clock is ahead.
    direction : (float, float, float) or None
        Along which a log of the speed through the water reads.
    instrument : str or None
        Name of the instrument, whose channels share clock and place; by default that of the kind, and of a single
        sensor that of its channel.
    """

    dropout: float | None = None
    gaps: tuple[tuple[float, float], ...] | None = None
    outlier_probability: float | None = None
    outlier_scale: float | None = None
    lever_arm_m: tuple[float, float, float] | None = None
    clock_offset_s: float | None = None
    direction: tuple[float, float, float] | None = None
    instrument: str | None = None

    @pydantic.model_validator(mode="after")
    def _can_exist(self):
        self.build()
        return self

    def build(self) -> tuple[sensors.Sensor, ...]:
        """The sensors that the section describes; InputError if they cannot exist."""
        make = KINDS[self.kind]
        changes = self.model_dump(exclude={"kind"}, exclude_none=True)
        arguments = {key: changes.pop(key) for key in inspect.signature(make).parameters if key in changes}
        return sensors.modified(make(**arguments), **changes)


def _section(kind: str) -> type[SensorSection]:
    # Place and clock are left out of a completed study that gives none, so that earlier runs resume.
    arguments = [a for a in inspect.signature(KINDS[kind]).parameters.values() if a.name not in PLACED]
    keys = {a.name: (a.annotation, ... if a.default is a.empty else a.default) for a in arguments}
    return pydantic.create_model(f"{kind}_section", __base__=SensorSection, kind=(Literal[kind], ...), **keys)


AnySensorSection = Annotated[
    functools.reduce(operator.or_, [_section(kind) for kind in KINDS]), pydantic.Field(discriminator="kind")
]
