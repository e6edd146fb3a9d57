"""Records: what the sensors of a trial wrote down, in memory and as a CSV file."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bayesub.io import log_files
from bayesub.io.errors import InputError
from bayesub.sensors.lever_arm import TURNING
from bayesub.sensors.sensor import QUANTITIES, Sensor, channel_name, flat

_TURN = 2.0 * np.pi


@dataclass(frozen=True)
class Channel:
    """Readings of one quantity, all in SI units and radians.

    quantity : short name, a key of :data:`bayesub.sensors.QUANTITIES`
    times : (n,) s, and values : (n,)
    sd, resolution : standard deviation of the noise, and the step to which noisy values were then rounded, or 0
    lever_arm_m : (3,) place of the sensor from the body origin, and clock_offset_s : how far its clock is ahead; a file
        stamps a reading with its time plus that
    """

    quantity: str
    times: np.ndarray
    values: np.ndarray
    sd: float
    resolution: float = 0.0
    lever_arm_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    clock_offset_s: float = 0.0

    @property
    def name(self) -> str:
        """Unique in a record: the column in its file without the unit, such as ``yaw``, ``depth``, ``u_ground``."""
        return channel_name(self.quantity)

    @property
    def state(self) -> str:
        """Short name of the state or acceleration that was measured, ``z`` for ``depth``."""
        return QUANTITIES[self.quantity].state

    @property
    def over_ground(self) -> bool:
        """Whether the readings contain the current (:func:`bayesub.sensors.over_ground`)."""
        return QUANTITIES[self.quantity].over_ground

    @property
    def total_sd(self) -> float:
        """Standard deviation of noise and rounding error, as if they were independent: sqrt(sd^2 + resolution^2/12)."""
        return np.hypot(self.sd, self.resolution / np.sqrt(12.0)).item()

    @property
    def displaced(self) -> bool:
        """Whether the readings contain a lever arm (:mod:`bayesub.sensors.lever_arm`)."""
        return any(self.lever_arm_m) and self.state in TURNING


def channel_of(sensor: Sensor, times, values) -> Channel:
    """The channel of a sensor with readings (n,) at times (n,), SI units."""
    sd, resolution = sensor.factor * sensor.sd, sensor.factor * sensor.resolution
    place = sensor.lever_arm_m or (0.0, 0.0, 0.0)
    return Channel(sensor.quantity, times, values, sd, resolution, tuple(place), sensor.clock_offset_s)


@dataclass(frozen=True)
class Record:
    """What the sensors of a trial wrote down; the channels in a fixed order make the vector of readings.

    `truth` (101,) holds the coefficients behind a synthetic record, and `nuisances` what else is known of it: name
    (:mod:`bayesub.problem.nuisance`) -> true value in the unit of the name. For a real record they are None and empty.
    """

    channels: tuple[Channel, ...]
    truth: np.ndarray | None = None
    nuisances: dict[str, float] = field(default_factory=dict)

    def __post_init__(self):
        names = [channel.name for channel in self.channels]
        for channel in self.channels:
            if names.count(channel.name) > 1:
                raise InputError(f"record: two channels are named '{channel.name}'; leave one of them out")
            if not len(channel.times):
                raise InputError(f"record: channel '{channel.name}' has no readings; leave it out")
        if not names:
            raise InputError("record: is empty; it needs at least one channel")

    @property
    def n_readings(self) -> int:
        return sum(len(channel.times) for channel in self.channels)

    def save(self, path: str | Path, manoeuvre=None) -> None:
        """Write the readings as a CSV with units in the column names; a missing reading is an empty cell.

        Times that are the same to the digits of the file share a row. With a `manoeuvre` its controls are written too,
        in rows of their own times: the file is then the log of a trial, which a study reads as its `data`.
        """
        columns = [(c.quantity, c.times + c.clock_offset_s, c.values) for c in self.channels]
        if manoeuvre is not None:
            controls = zip((*log_files.CONTROLS, "rpm"), (*manoeuvre.controls.T, manoeuvre.rpm), strict=True)
            columns += [(name, manoeuvre.times, values) for name, values in controls]
        written = [np.char.mod(log_files.WRITTEN, times).astype(float) for _, times, _ in columns]
        times = np.unique(np.concatenate(written))
        log = {"time": times}
        for (name, _, values), own in zip(columns, written, strict=True):
            log[name] = np.full(len(times), np.nan)
            log[name][np.searchsorted(times, own)] = values
        log_files.write_log(Path(path), log)

    @classmethod
    def load(cls, path: str | Path, sensors, *, start_heading_deg: float = 0.0) -> "Record":
        """Read the readings of a trial.

        Each channel has the times of its own cells that are not empty. Columns of controls are left to
        :func:`bayesub.load_manoeuvre`.

        Yaw or heading is unwrapped if the column stays within one turn, 0 to 360 or -180 to 180 deg: each reading is
        brought within half a turn of the one before, across gaps too, and the first within half a turn of
        `start_heading_deg`. A boat that turns further than that between two readings cannot be told from one that turns
        the other way.

        Parameters
        ----------
        sensors : whatever :func:`observe` takes, one sensor for each column, with the noise sd and resolution of its
            readings, lever arm and clock offset; their other settings play no part

        Raises InputError for a file that does not fit, and for a column without sensor or a sensor without column.
        """
        return cls.of_log(log_files.read_log(Path(path)), sensors, path, start_heading_deg=start_heading_deg)

    @classmethod
    def of_log(cls, log, sensors, source, *, start_heading_deg: float = 0.0) -> "Record":
        """The readings of a log (:func:`bayesub.io.log_files.read_log`), as :meth:`load`; errors name the `source`."""
        by_quantity = {sensor.quantity: sensor for sensor in flat(sensors)}
        for quantity in log:
            if quantity in QUANTITIES and quantity not in by_quantity:
                column = log_files.HEADERS[quantity]
                raise InputError(f"{source}: column '{column}' has no sensor; add one for it or delete the column")
        channels = []
        for quantity, sensor in by_quantity.items():
            if quantity not in log:
                raise InputError(f"{source}: column '{sensor.column}' is missing; add it or leave out its sensor")
            given = np.isfinite(log[quantity])
            if not given.any():
                raise InputError(f"{source}: column '{sensor.column}' has no readings; leave it and its sensor out")
            values = log[quantity][given]
            if QUANTITIES[quantity].state == "psi":
                values = _unwrapped(values, np.radians(start_heading_deg))
            channels.append(channel_of(sensor, log["time"][given] - sensor.clock_offset_s, values))
        return cls(tuple(channels))


def _unwrapped(angles, start) -> np.ndarray:
    """Headings (n,) in rad without jumps, the first near `start`, unless they already leave the turn."""
    low, high = angles.min() / _TURN, angles.max() / _TURN
    slack = 1e-12  # round-off of degrees in radians
    if low < -0.5 - slack or high > (1.0 if low >= 0 else 0.5) + slack:
        return angles
    angles = np.unwrap(angles)
    return angles + _TURN * np.round((start - angles[0]) / _TURN)
