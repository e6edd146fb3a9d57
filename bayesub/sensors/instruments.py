"""Instruments: several sensors with one interval, and one noise and one resolution for each unit."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bayesub.io.errors import InputError, check_known
from bayesub.io.toml_files import Positive
from bayesub.logs.log_files import HEADERS
from bayesub.sensors.sensor import QUANTITIES, Sensor, channel_name

_COLUMNS = {channel_name(quantity): HEADERS[quantity] for quantity in QUANTITIES}

# Channel names in files -> short names of the states.
TRACK_CHANNELS = {"x": "x", "y": "y", "z": "z", "roll": "phi", "pitch": "theta", "yaw": "psi"}
ATTITUDE = ("roll", "pitch", "yaw")
RATES = ("p", "q", "r")
LINEAR_ACCELERATIONS = ("udot", "vdot", "wdot")
ANGULAR_ACCELERATIONS = ("pdot", "qdot", "rdot")


class Instrument:
    """What all instruments share; iterating over one gives its sensors.

    For a channel of unit m, deg, mps, .. an instrument has a standard deviation `sd_m`, `sd_deg`, `sd_mps`, .. and
    possibly a rounding step `resolution_m`, .. in that unit.

    Attributes
    ----------
    channels : tuple of str
        Those that are measured.
    interval_s : float
        One reading every so many seconds, the first after one interval.
    """

    CHANNELS: ClassVar[tuple[str, ...]]  # all that it can measure
    channels: tuple[str, ...]
    interval_s: float

    def __post_init__(self):
        for channel in self.channels:
            check_known(channel, self.CHANNELS, f"sensor: unknown channel '{channel}'")
        if not self.channels:
            raise InputError(
                f"sensor: channels is empty; name at least one of {', '.join(self.CHANNELS)}", "missing", "channels"
            )
        tuple(self)  # which checks each sensor

    def __iter__(self) -> Iterator[Sensor]:
        for channel in self.channels:
            column = _COLUMNS[channel]
            unit = column.rpartition("_")[2]
            sd, resolution = getattr(self, f"sd_{unit}"), getattr(self, f"resolution_{unit}", 0.0)
            yield Sensor(column, sd, resolution, self.interval_s, instrument=type(self).__name__.lower())


@dataclass(frozen=True)
class Track(Instrument):
    """A tracking range or an inertial navigator: position and attitude with independent normal noise.

    Attributes
    ----------
    position_sd_m : float
        Standard deviation of x, y, z.
    attitude_sd_deg : float
        Standard deviation of roll, pitch, yaw.
    interval_s : float
        One reading every so many seconds, the first after one interval.
    channels : tuple of str
        Those that are measured, of x, y, z, roll, pitch, yaw.
    """

    CHANNELS = tuple(TRACK_CHANNELS)

    position_sd_m: Positive
    attitude_sd_deg: Positive
    interval_s: Positive = 1.0
    channels: tuple[str, ...] = CHANNELS

    def __post_init__(self):
        for key in ("position_sd_m", "attitude_sd_deg", "interval_s"):
            value = getattr(self, key)
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"sensor: {key} must be positive, found {value}", "value", key)
        super().__post_init__()

    @property
    def sd_m(self) -> float:
        """Standard deviation of channels in m."""
        return self.position_sd_m

    @property
    def sd_deg(self) -> float:
        """Standard deviation of channels in deg."""
        return self.attitude_sd_deg


@dataclass(frozen=True)
class Pressure(Instrument):
    """A pressure gauge, which reads depth; a constant error of the surface is its bias (:func:`modified`)."""

    CHANNELS = ("depth",)

    sd_m: float = 0.0
    resolution_m: float = 0.0
    interval_s: Positive = 1.0
    channels: tuple[str, ...] = CHANNELS


@dataclass(frozen=True)
class Compass(Instrument):
    """A compass, magnetic or gyroscopic, which reads heading; its deviation is a bias (:func:`modified`)."""

    CHANNELS = ("heading",)

    sd_deg: float = 0.0
    resolution_deg: float = 0.0
    interval_s: Positive = 1.0
    channels: tuple[str, ...] = CHANNELS


@dataclass(frozen=True)
class INS(Instrument):
    """An inertial navigation system: attitude, rates, and linear and angular accelerations in body axes.

    Accelerations are the rates of change of u v w through the water and of p q r, with gravity removed. By default
    attitude and rates are measured.
    """

    CHANNELS = (*ATTITUDE, *RATES, *LINEAR_ACCELERATIONS, *ANGULAR_ACCELERATIONS)

    sd_deg: float = 0.0
    sd_degps: float = 0.0
    sd_mps2: float = 0.0
    sd_degps2: float = 0.0
    resolution_deg: float = 0.0
    resolution_degps: float = 0.0
    resolution_mps2: float = 0.0
    resolution_degps2: float = 0.0
    interval_s: Positive = 1.0
    channels: tuple[str, ...] = (*ATTITUDE, *RATES)


@dataclass(frozen=True)
class DVL(Instrument):
    """A Doppler log locked on to the bottom: body velocities over the ground, current included."""

    CHANNELS = ("u_ground", "v_ground", "w_ground")

    sd_mps: float = 0.0
    resolution_mps: float = 0.0
    interval_s: Positive = 1.0
    channels: tuple[str, ...] = CHANNELS


@dataclass(frozen=True)
class ADCP(Instrument):
    """A Doppler current profiler: body velocities through the water, which are those of the equations of motion."""

    CHANNELS = ("u", "v", "w")

    sd_mps: float = 0.0
    resolution_mps: float = 0.0
    interval_s: Positive = 1.0
    channels: tuple[str, ...] = CHANNELS


@dataclass(frozen=True)
class GPS(Instrument):
    """A satellite receiver: position, and if named velocity over the ground, speed and course over ground.

    Latitude and longitude of a log are x and y in m from the first fix. Its antenna is at a lever arm
    (:func:`modified`).
    """

    CHANNELS = ("x", "y", "velocity_north", "velocity_east", "velocity_down", "speed_over_ground", "course_over_ground")

    sd_m: float = 0.0
    sd_mps: float = 0.0
    sd_deg: float = 0.0
    resolution_m: float = 0.0
    resolution_mps: float = 0.0
    resolution_deg: float = 0.0
    interval_s: Positive = 1.0
    channels: tuple[str, ...] = ("x", "y")
