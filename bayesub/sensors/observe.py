"""Measuring a simulated trial."""

import numpy as np

from bayesub.io.errors import InputError
from bayesub.io.log_files import ACCELERATIONS, COLUMNS, HEADERS, STATES
from bayesub.sensors.current import over_ground
from bayesub.sensors.lever_arm import TURNING, displaced
from bayesub.sensors.record import Record, channel_of
from bayesub.sensors.sensor import QUANTITIES, flat


def observe(
    trajectory, sensors, rng: np.random.Generator | None, member: int = 0, current_mps: tuple[float, float] = (0.0, 0.0)
) -> Record:
    """Measure one member of a trajectory.

    Parameters
    ----------
    sensors : a :class:`Sensor`, an instrument such as :class:`Track`, a preset, or a sequence of them
    rng : source of noise, outliers and dropouts, which are drawn sensor after sensor; None for the truth itself as
        readings, which keep the sd of their sensor as their weight
    current_mps : a constant current in which the boat flies, north and east

    Raises InputError if the member failed, if the trial is shorter than the interval of a sensor or a time of a reading
    lies outside it, if two sensors make channels of one name, or if every reading of a sensor is missing.
    """
    if trajectory.status[member] != "ok":
        raise InputError(f"a simulation that {trajectory.status[member]} cannot be measured")
    current_mps = tuple(current_mps)
    if len(current_mps) != 2 or not np.isfinite(current_mps).all():
        raise InputError(f"current_mps must be two finite numbers, north and east, found {current_mps}")
    duration = trajectory.times[-1]
    motions, channels = {}, []
    nuisances = {f"current_{towards}_mps": speed for towards, speed in zip(("north", "east"), current_mps, strict=True)}
    for sensor in flat(sensors):
        times = sensor.reading_times(duration)
        key = times.tobytes()
        if key not in motions:
            motions[key] = _motion(trajectory.resampled(np.minimum(times, duration)), member, current_mps)
        in_water, on_ground = motions[key]
        quantity = QUANTITIES[sensor.quantity]
        truth = (on_ground if quantity.over_ground else in_water)[quantity.state]
        if sensor.lever_arm_m is not None and quantity.state in TURNING:
            turning = np.stack([in_water[name] for name in TURNING[quantity.state]], axis=-1)
            truth = truth + displaced(quantity.state, sensor.lever_arm_m, turning)
        channels.append(channel_of(sensor, *sensor.read(times, truth, rng)))
        column = HEADERS[sensor.quantity]
        unit = sensor.factor / COLUMNS[column][1]
        nuisances |= {f"bias_{column}": unit * sensor.bias, f"sd_{column}": unit * sensor.sd}
    return Record(tuple(channels), truth=trajectory.xi[member], nuisances=nuisances)


def _motion(trajectory, member, current_mps):
    """Short name -> (n_times,) states and accelerations through the water, and states over the ground."""
    states = trajectory.states[member]
    in_water = dict(zip(STATES, states.T, strict=True))
    in_water |= dict(zip(ACCELERATIONS, trajectory.accelerations[member].T, strict=True))
    if not any(current_mps):
        return in_water, in_water
    return in_water, dict(zip(STATES, over_ground(states, trajectory.times, current_mps).T, strict=True))
