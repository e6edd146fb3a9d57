"""Instruments, several sensors with one interval and one noise and resolution for each unit; and those of boats.

Each preset gives a tuple of :class:`Sensor`: the sensors of a boat that the literature describes. `channels` selects
some of them by name. Where the source takes a quantity as exact a preset has a small standard deviation, an argument: a
likelihood needs one.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from operator import attrgetter
from typing import ClassVar, SupportsFloat

import numpy as np

from bayesub.io.arguments import check_class
from bayesub.io.errors import InputError, check_known
from bayesub.io.toml_files import Positive
from bayesub.logs.log_files import ACCELERATIONS, HEADERS
from bayesub.model.vehicles import GRAVITY_MPS2
from bayesub.sensors.sensor import QUANTITIES, Sensor, channel_name, flat, register

_COLUMNS = {channel_name(quantity): HEADERS[quantity] for quantity in QUANTITIES}

ATTITUDE, RATES = ("roll", "pitch", "yaw"), ("p", "q", "r")


class Instrument:
    """What all instruments share; iterating over one gives its sensors.

    For a channel of unit m, deg, mps, .. an instrument has a standard deviation `sd_m`, `sd_deg`, `sd_mps`, .. and
    possibly a rounding step `resolution_m`, .. in that unit. It reads its `channels` every `interval_s`, not at 0.
    """

    CHANNELS: ClassVar[tuple[str, ...]]  # all that it can measure
    channels: tuple[str, ...]
    interval_s: float

    def __post_init__(self):
        for channel in self.channels:
            check_known(channel, self.CHANNELS, f"sensor: unknown channel '{channel}'")
        if not self.channels:
            message = f"sensor: channels is empty; name at least one of {', '.join(self.CHANNELS)}"
            raise InputError(message, "missing", "channels")
        tuple(self)  # which checks each sensor

    def __iter__(self) -> Iterator[Sensor]:
        for channel in self.channels:
            column = _COLUMNS[channel]
            unit = column.rpartition("_")[2]
            sd, resolution = getattr(self, f"sd_{unit}"), getattr(self, f"resolution_{unit}", 0.0)
            yield Sensor(column, sd, resolution, self.interval_s, instrument=type(self).__name__.lower())


@register
@dataclass(frozen=True)
class Track(Instrument):
    """A tracking range or an inertial navigator: position and attitude with independent normal noise.

    The standard deviation of x, y, z is `position_sd_m`, that of roll, pitch, yaw `attitude_sd_deg`.
    """

    CHANNELS = ("x", "y", "z", *ATTITUDE)

    position_sd_m: Positive
    attitude_sd_deg: Positive
    interval_s: Positive = 1.0
    channels: tuple[str, ...] = CHANNELS

    def __post_init__(self):
        for key in ("position_sd_m", "attitude_sd_deg", "interval_s"):
            value = check_class(f"sensor: {key}", getattr(self, key), SupportsFloat, key=key)
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"sensor: {key} must be positive, found {value}", "value", key)
        super().__post_init__()

    sd_m = property(attrgetter("position_sd_m"), doc="Standard deviation of channels in m.")
    sd_deg = property(attrgetter("attitude_sd_deg"), doc="Standard deviation of channels in deg.")


register(Sensor)  # here, as messages name the kinds in this order


@register
@dataclass(frozen=True)
class Pressure(Instrument):
    """A pressure gauge, which reads depth; a constant error of the surface is its bias (:func:`modified`)."""

    CHANNELS = ("depth",)

    sd_m: float = 0.0
    resolution_m: float = 0.0
    interval_s: Positive = 1.0
    channels: tuple[str, ...] = CHANNELS


@register
@dataclass(frozen=True)
class Compass(Instrument):
    """A compass, magnetic or gyroscopic, which reads heading; its deviation is a bias (:func:`modified`)."""

    CHANNELS = ("heading",)

    sd_deg: float = 0.0
    resolution_deg: float = 0.0
    interval_s: Positive = 1.0
    channels: tuple[str, ...] = CHANNELS


@register
@dataclass(frozen=True)
class INS(Instrument):
    """An inertial navigation system: attitude, rates, and linear and angular accelerations in body axes.

    Accelerations are the rates of change of u v w through the water and of p q r, with gravity removed. By default
    attitude and rates are measured.
    """

    CHANNELS = (*ATTITUDE, *RATES, *ACCELERATIONS)

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


@register
@dataclass(frozen=True)
class DVL(Instrument):
    """A Doppler log locked on to the bottom: body velocities over the ground, current included."""

    CHANNELS = ("u_ground", "v_ground", "w_ground")

    sd_mps: float = 0.0
    resolution_mps: float = 0.0
    interval_s: Positive = 1.0
    channels: tuple[str, ...] = CHANNELS


@register
@dataclass(frozen=True)
class ADCP(Instrument):
    """A Doppler current profiler: body velocities through the water, which are those of the equations of motion."""

    CHANNELS = ("u", "v", "w")

    sd_mps: float = 0.0
    resolution_mps: float = 0.0
    interval_s: Positive = 1.0
    channels: tuple[str, ...] = CHANNELS


@register
@dataclass(frozen=True)
class GPS(Instrument):
    """A satellite receiver: position, and if named velocity over the ground, speed and course over ground.

    Latitude and longitude of a log are x and y in m from the first fix. Its antenna may be off (:func:`modified`).
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


PHINS_ACCELEROMETER_MPS2 = 50e-6 * GRAVITY_MPS2  # 50 micro-g (thesis section 9.1.1)


@register
def autosub(
    *,
    interval_s: float = 1.0,
    velocity_sd_mps: float = 0.0045,
    velocity_resolution_mps: float = 0.001,
    acceleration_sd_mps2: float = PHINS_ACCELEROMETER_MPS2,
    depth_sd_m: float = 0.1,
    attitude_sd_deg: float = 0.01,
    rate_sd_degps: float = 0.001,
    angular_acceleration_sd_degps2: float = 0.001,
    channels: tuple[str, ...] | None = None,
) -> tuple[Sensor, ...]:
    """What Autosub measures: an IXSEA PHINS INS, an RDI Workhorse Navigator on the bottom, and pressure.

    From thesis section 9.1 and table 33 are the channels; bottom-track velocities with a standard deviation of 0.3 to
    0.6 cm/s, of which the middle is taken, and a resolution of 0.1 cm/s; accelerometers good to 50 micro-g, taken as
    the standard deviation of the linear accelerations. Depth has none there; attitude, rates and angular accelerations
    are exact there, for gyros that drift less than 0.01 deg/h. Their standard deviations are assumed.
    """
    dvl = DVL(sd_mps=velocity_sd_mps, resolution_mps=velocity_resolution_mps, interval_s=interval_s)
    sds = attitude_sd_deg, rate_sd_degps, acceleration_sd_mps2, angular_acceleration_sd_degps2
    ins = INS(*sds, interval_s=interval_s, channels=INS.CHANNELS)
    return _selected([Pressure(sd_m=depth_sd_m, interval_s=interval_s), dvl, ins], channels)


@register
def thesis_rounding(
    *,
    interval_s: float = 1.0,
    velocity_sd_mps: float = 0.0,
    acceleration_sd_mps2: float = 0.0,
    attitude_sd_deg: float = 0.01,
    rate_sd_degps: float = 0.001,
    angular_acceleration_sd_degps2: float = 0.001,
    channels: tuple[str, ...] | None = None,
) -> tuple[Sensor, ...]:
    """The data of the thesis's ill-conditioning tests (section 9.6): rounded, not noisy.

    Velocities are rounded to 1 cm/s and linear accelerations to 1 mm/s^2, of exact values unless a standard deviation
    is given. Attitude, rates and angular accelerations are exact there; their standard deviations are assumed.
    """
    adcp = ADCP(sd_mps=velocity_sd_mps, resolution_mps=0.01, interval_s=interval_s)
    sds = attitude_sd_deg, rate_sd_degps, acceleration_sd_mps2, angular_acceleration_sd_degps2
    ins = INS(*sds, resolution_mps2=0.001, interval_s=interval_s, channels=INS.CHANNELS)
    return _selected([adcp, ins], channels)


@register
def tracking_range(
    *,
    interval_s: float = 1.0,
    position_sd_m: float = 0.5,
    attitude_sd_deg: float = 0.1,
    channels: tuple[str, ...] | None = None,
) -> tuple[Sensor, ...]:
    """An acoustic tracking range with the boat's own attitude: position to 0.5 m and attitude to 0.1 deg.

    The standard deviations are assumed: the thesis fits exact tracks (chapter 4).
    """
    return _selected(Track(position_sd_m, attitude_sd_deg, interval_s), channels)


def _selected(sensors, channels) -> tuple[Sensor, ...]:
    by_channel = {channel_name(sensor.quantity): sensor for sensor in flat(sensors)}
    for channel in channels or ():
        check_known(channel, by_channel, f"sensor: unknown channel '{channel}'")
    return tuple(by_channel[channel] for channel in (by_channel if channels is None else channels))
