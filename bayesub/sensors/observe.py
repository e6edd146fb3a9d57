"""Readings of a simulated trial: the prediction of the true motion, plus errors."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from bayesub.io.errors import InputError
from bayesub.logs.log_files import HEADERS, si_factor
from bayesub.model.trajectory import Trajectory
from bayesub.sensors.current import Water
from bayesub.sensors.instruments import Instrument
from bayesub.sensors.measurement import MeasurementModel
from bayesub.sensors.record import Record, channel_of
from bayesub.sensors.sensor import Sensor, flat


def observe(
    trajectory: Trajectory,
    sensors: Sensor | Instrument | Iterable,
    rng: np.random.Generator | None,
    member: int = 0,
    current_mps: tuple[float, float] = (0.0, 0.0),
) -> Record:
    """Measure one member of a trajectory.

    Parameters
    ----------
    sensors : a :class:`Sensor`, an instrument such as :class:`Track`, a preset, or a sequence of them
    rng : source of noise, outliers and dropouts, which are drawn sensor after sensor. None gives the truth itself as
        readings, which keep the sd of their sensor as their weight.
    member : which of the batch
    current_mps : a constant current in which the boat moves, to the north and to the east, besides that of the
        disturbance of the trajectory

    Raises
    ------
    InputError : if the member failed, if the trial is shorter than the interval of a sensor or a time of a reading lies
        outside it, if two sensors make channels of one name, or if every reading of a sensor is missing
    """
    if trajectory.status[member] != "ok":
        raise InputError(f"a simulation that {trajectory.status[member]} cannot be measured", "model", "trajectory")
    if len(current_mps) != 2 or not np.isfinite(current_mps).all():
        raise InputError(
            f"current_mps must be two finite numbers, north and east, found {tuple(current_mps)}",
            "value",
            "current_mps",
        )
    sensors, duration = flat(sensors), trajectory.times[-1]
    channels = unread(sensors, duration).channels
    times = [channel.times for channel in channels]
    forces = trajectory.simulator.forces
    history = None if forces is None else forces.of_current
    model = MeasurementModel(channels, current=any(current_mps) or history is not None)
    outputs = trajectory.resampled(np.minimum(model.times, duration)).outputs(model.measured)[member]
    water = Water.steady(np.array(current_mps), model.times)
    if history is not None:
        water += Water.varying(history, model.times)
    (truth,) = model.of(outputs[None], water)
    readings = [
        sensor.read(at, truth[part], rng) for sensor, at, part in zip(sensors, times, model.slices, strict=True)
    ]
    read = [replace(c, times=at, values=values) for c, (at, values) in zip(channels, readings, strict=True)]
    return Record(tuple(read), trajectory.xi[member], _true_nuisances(sensors, current_mps), forces)


def unread(sensors: Sensor | Instrument | Iterable, duration: float) -> Record:
    """The record that sensors are about to make of a trial of `duration` (s): its values are not numbers.

    It says all that the choice of an integration step depends on (:mod:`bayesub.problem.problem`).
    """
    channels = []
    for sensor in flat(sensors):
        times = sensor.reading_times(duration)
        channels.append(channel_of(sensor, times, np.full(len(times), np.nan)))
    return Record(tuple(channels))


def _true_nuisances(sensors, current_mps) -> dict[str, float]:
    """Name of a nuisance parameter (:mod:`bayesub.problem.nuisance`) -> its value in the unit of the name."""
    values = {f"current_{towards}_mps": speed for towards, speed in zip(("north", "east"), current_mps, strict=True)}
    for sensor in sensors:
        column, unit = HEADERS[sensor.quantity], sensor.factor / si_factor(sensor.quantity)
        values |= {f"bias_{column}": unit * sensor.bias, f"sd_{column}": unit * sensor.sd}
    return values
