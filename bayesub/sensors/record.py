"""Records: what the sensors of a trial wrote down, in memory and as a CSV file."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from bayesub.io.equality import ByContent
from bayesub.io.errors import InputError
from bayesub.logs import log_files
from bayesub.model.disturbance import ForceHistory
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.trajectory import Trajectory
from bayesub.sensors.sensor import QUANTITIES, Sensor, channel_name, flat
from bayesub.sensors.velocity import TURNING

TURN = 2.0 * np.pi
_RUN, _DISTINCT = 10, 5  # readings in a row that no two trials have alike, and different values among them at least
_SHARED = 0.25  # of such runs; without noise two trials may begin alike
_SLACK = 0.05  # turns by which noise may push a heading beyond the ends of the turn to which a log confines it


@dataclass(frozen=True, eq=False)
class Channel(ByContent):
    """Readings of one quantity, all in SI units and radians."""

    quantity: str  # short name, a key of :data:`bayesub.sensors.QUANTITIES`
    times: np.ndarray  # (n,), s
    values: np.ndarray  # (n,)
    sd: float  # standard deviation of the noise
    resolution: float = 0.0  # step to which noisy values were then rounded, or 0
    lever_arm_m: tuple[float, float, float] = (0.0, 0.0, 0.0)  # place of the sensor from the body origin
    clock_offset_s: float = 0.0  # how far its clock is ahead: a file stamps a reading with its time plus that
    # whether values are known up to whole turns only, as the headings of a log, so that they are compared modulo one
    # turn (:meth:`bayesub.sensors.measurement.MeasurementModel.to_nearest_turn`). A simulated heading is continuous.
    modulo_turn: bool = False
    # unit vector along which a log of the speed through the water reads
    direction: tuple[float, float, float] | None = None
    # with whose other channels it shares clock and place; by default it is an instrument by itself
    instrument: str = ""

    def __post_init__(self):
        object.__setattr__(self, "instrument", self.instrument or self.name)

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
        """Whether the readings contain a lever arm (:mod:`bayesub.sensors.velocity`)."""
        return any(self.lever_arm_m) and self.state in TURNING


def _runs(values: np.ndarray) -> Iterator[bytes]:
    """Readings (n,) one run after the other, of fewer all, without those that hardly change."""
    n = min(_RUN, len(values))
    for first in range(0, len(values) - n + 1, n):
        run = values[first : first + n]
        if len(np.unique(run)) >= min(_DISTINCT, max(n, 3)):
            yield run.tobytes()


def channel_of(sensor: Sensor, times: np.ndarray, values: np.ndarray) -> Channel:
    """The channel of a sensor with readings (n,) at times (n,), SI units."""
    ahead, starboard, down = sensor.lever_arm_m or (0.0, 0.0, 0.0)
    direction = sensor.direction
    if direction is not None:
        direction = tuple((np.asarray(direction) / np.linalg.norm(direction)).tolist())
    sizes = sensor.factor * sensor.sd, sensor.factor * sensor.resolution
    place, instrument = ((ahead, starboard, down), sensor.clock_offset_s), sensor.instrument or ""
    return Channel(sensor.quantity, times, values, *sizes, *place, direction=direction, instrument=instrument)


@dataclass(frozen=True, eq=False)
class Record(ByContent):
    """What the sensors of a trial wrote down; the channels in a fixed order make the vector of readings."""

    channels: tuple[Channel, ...]  # with different names
    truth: np.ndarray | None = None  # (n_terms,) the coefficients behind a synthetic record; None for a real one
    # what else is known of a synthetic record: name of a nuisance parameter (:mod:`bayesub.problem.nuisance`) -> true
    # value in the unit of the name
    nuisances: dict[str, float] = field(default_factory=dict)
    forces: ForceHistory | None = None  # that the boat of a synthetic record felt and that no equations have

    def __post_init__(self):
        names = [channel.name for channel in self.channels]
        for channel in self.channels:
            name = channel.name
            if names.count(name) > 1:
                raise InputError(f"record: two channels are named '{name}'; leave one of them out", "conflict", name)
            if not len(channel.times):
                raise InputError(f"record: channel '{name}' has no readings; leave it out", "data", name)
        if not names:
            raise InputError("record: is empty; it needs at least one channel", "missing", "channels")

    @property
    def n_readings(self) -> int:
        """Number of readings of all channels."""
        return sum(len(channel.times) for channel in self.channels)

    @property
    def values(self) -> np.ndarray:
        """(n_readings,) the readings of all channels, one channel after the other, SI units."""
        return np.concatenate([channel.values for channel in self.channels])

    @property
    def total_sds(self) -> np.ndarray:
        """(n_readings,) standard deviations of noise and rounding error together, SI units."""
        return np.repeat([c.total_sd for c in self.channels], [len(c.times) for c in self.channels])

    def shared_with(self, other: "Record") -> list[str]:
        """Names of the channels of both records, if each that changes has a quarter of its readings in common."""
        others = {channel.name: channel.values.tobytes() for channel in other.channels}
        runs = {c.name: list(_runs(c.values)) for c in self.channels if c.name in others}
        shares = {name: np.mean([run in others[name] for run in found]) for name, found in runs.items() if found}
        return list(shares) if min(shares.values(), default=0.0) > _SHARED else []

    def of_readings(self, chosen: Iterable[slice | np.ndarray]) -> "Record":
        """The record with some readings of each channel: slices, or masks (n,)."""
        pairs = zip(self.channels, chosen, strict=True)
        channels = [replace(channel, times=channel.times[k], values=channel.values[k]) for channel, k in pairs]
        return replace(self, channels=tuple(channels))

    def thinned(self, interval_s: float) -> "Record":
        """The record with the first reading of each channel in every so many seconds."""
        turns = [np.floor((channel.times - channel.times[:1]) / interval_s + 1e-6) for channel in self.channels]
        return self.of_readings([np.diff(turn, prepend=-1.0) > 0.0 for turn in turns])

    def earlier(self, seconds: float) -> "Record":
        """The record with all readings taken so much earlier than it says."""
        return replace(self, channels=tuple(replace(c, times=c.times - seconds) for c in self.channels))

    def save(self, path: str | Path, manoeuvre: Manoeuvre | Trajectory | None = None) -> None:
        """Write the readings as a CSV with units in the column names; a missing reading is an empty cell.

        Times that are the same to the digits of the file share a row. With a `manoeuvre` its controls are written too,
        in rows of their own times: the file is then the log of a trial, which a study reads as its `data`.
        """
        columns = [(c.quantity, c.times + c.clock_offset_s, c.values) for c in self.channels]
        if manoeuvre is not None:
            columns += [(name, manoeuvre.times, values) for name, values in manoeuvre.log.items()]
        written = [np.char.mod(log_files.WRITTEN, times).astype(float) for _, times, _ in columns]
        times = np.unique(np.concatenate(written))
        log = {"time": times}
        for (name, _, values), at in zip(columns, written, strict=True):
            log[name] = np.full(len(times), np.nan)
            log[name][np.searchsorted(times, at)] = values
        log_files.write_log(Path(path), log)

    @classmethod
    def load(
        cls,
        path: str | Path,
        sensors: Sensor | Iterable,
        *,
        start_heading_deg: float = 0.0,
        controls: Iterable[str] = (),
    ) -> "Record":
        """Read the readings of a trial.

        Each channel has the times of its filled cells. Columns of controls are left to :func:`bayesub.load_manoeuvre`.

        Yaw, heading and course are compared to a simulation modulo one turn, whatever the range of the column, so that
        noise about north, long gaps and fast turns do no harm. For pictures, and for the heading at the start, one that
        stays within one turn (0 to 360 or -180 to 180 deg, and a twentieth of a turn beyond for noise) is unwrapped as
        well: each reading is brought within half a turn of the one before, across gaps too, and the first within half a
        turn of `start_heading_deg`. There is one sensor for each column, of which noise sd, resolution, lever arm and
        clock offset count; `controls` are columns of a vehicle's own that the file may have besides, ``fin_1_deg``.
        InputError for a file that does not fit, a column without sensor and the reverse.
        """
        return cls.of_log(log_files.read_log(Path(path), controls), sensors, path, start_heading_deg=start_heading_deg)

    @classmethod
    def of_log(
        cls,
        log: dict[str, np.ndarray],
        sensors: Sensor | Iterable,
        source: str | Path,
        *,
        start_heading_deg: float = 0.0,
    ) -> "Record":
        """The readings of a log (:func:`bayesub.logs.log_files.read_log`); errors name the `source`."""
        by_quantity = {sensor.quantity: sensor for sensor in flat(sensors)}
        for quantity in log:
            if quantity in QUANTITIES and quantity not in by_quantity:
                column = log_files.HEADERS[quantity]
                text = f"{source}: column '{column}' has no sensor; add one for it or delete the column"
                raise InputError(text, "conflict", column)
        channels = []
        for quantity, sensor in by_quantity.items():
            what = f"{source}: column '{sensor.column}'"
            if quantity not in log:
                raise InputError(f"{what} is missing; add it or leave out its sensor", "missing", sensor.column)
            present = np.isfinite(log[quantity])
            if not present.any():
                raise InputError(f"{what} has no readings; leave it and its sensor out", "data", sensor.column)
            values = log[quantity][present]
            channel = channel_of(sensor, log["time"][present] - sensor.clock_offset_s, values)
            if QUANTITIES[quantity].heading:
                values = _unwrapped(values, np.radians(start_heading_deg))
                channel = replace(channel, values=values, modulo_turn=True)
            channels.append(channel)
        return cls(tuple(channels))


def _unwrapped(angles, start) -> np.ndarray:
    """Headings (n,) in rad without jumps, the first near `start`; those that leave the turn are continuous already."""
    low, high = angles.min() / TURN, angles.max() / TURN
    if not any(begin - _SLACK <= low and high <= begin + 1.0 + _SLACK for begin in (0.0, -0.5)):
        return angles
    angles = np.unwrap(angles)
    return angles + TURN * np.round((start - angles[0]) / TURN)
