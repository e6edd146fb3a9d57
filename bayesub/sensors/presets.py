"""Sensors of boats that the literature describes. Each preset gives a tuple of :class:`Sensor`.

`channels` selects some of them by name. Where the source takes a quantity as exact a preset has a small standard
deviation, an argument: a likelihood needs one.
"""

from bayesub.io.errors import InputError, nearest
from bayesub.model.vehicles import GRAVITY_MPS2
from bayesub.sensors.instruments import ADCP, DVL, INS, Pressure, Track
from bayesub.sensors.sensor import Sensor, channel_name, flat

PHINS_ACCELEROMETER_MPS2 = 50e-6 * GRAVITY_MPS2  # 50 micro-g (thesis section 9.1.1)


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
    ins = INS(
        sd_deg=attitude_sd_deg,
        sd_degps=rate_sd_degps,
        sd_mps2=acceleration_sd_mps2,
        sd_degps2=angular_acceleration_sd_degps2,
        interval_s=interval_s,
        channels=INS.CHANNELS,
    )
    return _selected([Pressure(sd_m=depth_sd_m, interval_s=interval_s), dvl, ins], channels)


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
    ins = INS(
        sd_deg=attitude_sd_deg,
        sd_degps=rate_sd_degps,
        sd_mps2=acceleration_sd_mps2,
        sd_degps2=angular_acceleration_sd_degps2,
        resolution_mps2=0.001,
        interval_s=interval_s,
        channels=INS.CHANNELS,
    )
    return _selected([adcp, ins], channels)


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
        if channel not in by_channel:
            raise InputError(f"sensor: unknown channel '{channel}'{nearest(channel, by_channel)}", "unknown", channel)
    return tuple(by_channel[channel] for channel in (by_channel if channels is None else channels))
