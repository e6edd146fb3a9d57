"""Sensors and the records they make of a trajectory."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bayesub import logs
from bayesub.coefficients import nearest
from bayesub.errors import InputError

# Channel names in files -> short names of the states.
TRACK_CHANNELS = {"x": "x", "y": "y", "z": "z", "roll": "phi", "pitch": "theta", "yaw": "psi"}
POSITIONS = ("x", "y", "z")


@dataclass(frozen=True)
class Track:
    """A tracking range or an inertial navigator: position and attitude with independent normal noise.

    position_sd_m : standard deviation of x, y, z
    attitude_sd_deg : standard deviation of roll, pitch, yaw
    interval_s : one reading every so many seconds, the first after one interval
    channels : those that are measured, of x, y, z, roll, pitch, yaw
    """

    position_sd_m: float
    attitude_sd_deg: float
    interval_s: float = 1.0
    channels: tuple[str, ...] = tuple(TRACK_CHANNELS)

    def __post_init__(self):
        for key in ("position_sd_m", "attitude_sd_deg", "interval_s"):
            value = getattr(self, key)
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"sensor: {key} must be positive, found {value}")
        for channel in self.channels:
            if channel not in TRACK_CHANNELS:
                raise InputError(f"sensor: unknown channel '{channel}'{nearest(channel, TRACK_CHANNELS)}")
        if not self.channels:
            raise InputError("sensor: channels is empty; name at least one of x, y, z, roll, pitch, yaw")

    def sd(self, state: str) -> float:
        """Noise standard deviation of a state in SI units."""
        return self.position_sd_m if state in POSITIONS else np.radians(self.attitude_sd_deg).item()


@dataclass(frozen=True)
class Channel:
    """Readings of one state: `times` (n,) s, `values` (n,) and noise `sd` in SI units and radians."""

    state: str
    times: np.ndarray
    values: np.ndarray
    sd: float


@dataclass(frozen=True)
class Record:
    """What the sensors of a trial wrote down; the channels in a fixed order make the vector of readings.

    `truth` (101,) holds the coefficients behind a synthetic record, and is None for a real one.
    """

    channels: tuple[Channel, ...]
    truth: np.ndarray | None = None

    @property
    def n_readings(self) -> int:
        return sum(len(channel.times) for channel in self.channels)

    def save(self, path: str | Path) -> None:
        """Write the readings as a CSV with units in the column names; a missing reading is an empty cell."""
        times = np.unique(np.concatenate([channel.times for channel in self.channels]))
        log = {"time": times}
        for channel in self.channels:
            log[channel.state] = np.full(len(times), np.nan)
            log[channel.state][np.searchsorted(times, channel.times)] = channel.values
        logs.write_log(Path(path), log)


def observe(trajectory, sensors, rng: np.random.Generator | None, member: int = 0) -> Record:
    """Measure one member of a trajectory.

    Parameters
    ----------
    sensors : a :class:`Track` or a sequence of them
    rng : source of the noise; None for readings without noise, which keep the sd of the sensor as their weight

    Raises InputError if the member failed or the trial is shorter than the interval of a sensor.
    """
    if trajectory.status[member] != "ok":
        raise InputError(f"a simulation that {trajectory.status[member]} cannot be measured")
    channels = []
    for sensor in [sensors] if isinstance(sensors, Track) else sensors:
        times = sensor.interval_s * np.arange(1, int(trajectory.times[-1] / sensor.interval_s * (1 + 1e-12)) + 1)
        if not times.size:
            raise InputError(f"sensor: interval_s {sensor.interval_s:g} is longer than the manoeuvre")
        states = trajectory.resampled(np.minimum(times, trajectory.times[-1])).states[member]
        for name in sensor.channels:
            state = TRACK_CHANNELS[name]
            sd = sensor.sd(state)
            noise = 0.0 if rng is None else sd * rng.standard_normal(len(times))
            channels.append(Channel(state, times, states[:, logs.STATES.index(state)] + noise, sd))
    return Record(tuple(channels), truth=trajectory.xi[member])
