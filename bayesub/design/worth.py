"""What each part of a trial brings: its minutes, its sensors, and sensors that the boat does not have yet.

All are taken at the coefficients of the vehicle, from the derivatives of one flight as far as that goes.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from bayesub.design.information import Information
from bayesub.design.judge import Judge, Sensed
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.sensors import flat
from bayesub.sensors.sensor import Sensor, channel_name


@dataclass(frozen=True)
class SensorWorth:
    """What one channel brings to a trial.

    Attributes
    ----------
    without : Information
        Of all other channels.
    alone : Information
        Of this channel only.
    """

    without: Information
    alone: Information


def by_minute(judge: Judge, manoeuvre: Manoeuvre, minutes: Iterable[float]) -> dict[float, Information]:
    """Minutes -> what the trial would have told if it had ended then."""
    sensed = _sensed(judge, manoeuvre)
    return {minute: sensed.information(sensed.times <= 60.0 * minute)[0] for minute in minutes}


def by_sensor(judge: Judge, manoeuvre: Manoeuvre) -> dict[str, SensorWorth]:
    """Channel -> what the trial tells without it, and by it alone."""
    sensed = _sensed(judge, manoeuvre)
    worth = {}
    for channel, rows in sensed.rows.items():
        mask = np.zeros(len(sensed.times), dtype=bool)
        mask[rows] = True
        worth[channel] = SensorWorth(*(sensed.information(readings)[0] for readings in (~mask, mask)))
    return worth


def further_sensors(
    judge: Judge, manoeuvre: Manoeuvre, extra: Mapping[str, Sensor | Iterable[Sensor]]
) -> dict[str, Information]:
    """Name -> what the trial tells with one more sensor, which takes the place of one that reads the same.

    Parameters
    ----------
    judge : Judge
    manoeuvre : Manoeuvre
    extra : dict of str to Sensor
        Sensors by any name; an instrument of several counts as one.
    """
    step = judge.step_s or judge.accurate_step(manoeuvre)
    worth = {}
    for name, sensors in extra.items():
        added = flat([sensors])
        channels = {channel_name(sensor.quantity) for sensor in added}
        others = tuple(sensor for sensor in judge.sensors if channel_name(sensor.quantity) not in channels)
        (worth[name],) = Sensed(replace(judge, sensors=(*others, *added), draws=None), manoeuvre, step).information()
    return worth


def _sensed(judge: Judge, manoeuvre: Manoeuvre) -> Sensed:
    judge = replace(judge, draws=None)
    return Sensed(judge, manoeuvre, judge.step_s or judge.accurate_step(manoeuvre))
