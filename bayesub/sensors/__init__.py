"""Sensors, and the records they make of a trial.

A :class:`Sensor` reads one quantity. Instruments are several at once (:class:`Track`, :class:`INS`, :class:`DVL`, ..),
and presets are those of a boat (:func:`autosub`, ..). :func:`observe` takes any mixture of them.
"""

from bayesub.sensors import velocity
from bayesub.sensors.current import over_ground
from bayesub.sensors.instruments import (
    ADCP,
    DVL,
    GPS,
    INS,
    Compass,
    Instrument,
    Pressure,
    Track,
    autosub,
    thesis_rounding,
    tracking_range,
)
from bayesub.sensors.measurement import observe, unread
from bayesub.sensors.record import Channel, Record
from bayesub.sensors.sensor import KINDS, QUANTITIES, Sensor, flat, modified, register

__all__ = [
    "ADCP", "DVL", "GPS", "INS", "KINDS", "QUANTITIES", "Channel", "Compass", "Instrument", "Pressure", "Record",
    "Sensor", "Track", "autosub", "flat", "modified", "observe", "over_ground", "register", "thesis_rounding",
    "tracking_range", "unread", "velocity",
]  # fmt: skip
