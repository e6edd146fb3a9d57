"""One sensor: what it reads, when, and how wrong."""

import re
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from bayesub.io.errors import InputError, check_known, nearest
from bayesub.logs.log_files import ACCELERATIONS, COLUMNS, HEADERS, STATES, si_factor
from bayesub.sensors import velocity

MAX_READINGS = 1_000_000
KINDS: dict[str, Callable[..., "Sensor | Iterable"]] = {}  # name in files -> what gives the sensors, see `register`


@dataclass(frozen=True)
class Quantity:
    """What is measured."""

    state: str  # short name of a state, of a body acceleration, or of a velocity (:mod:`bayesub.sensors.velocity`)
    over_ground: bool = False  # whether the current is in it

    @property
    def heading(self) -> bool:
        """Whether a log may have it up to whole turns."""
        return self.state in ("psi", "cog")

    def changes(self, moving: Collection[str]) -> bool:
        """Whether it changes in a motion of which these states change."""
        if self.state in velocity.QUANTITIES:
            return self.state != "down" or "z" in moving
        return self.state.removesuffix("dot") in moving


# Short name -> quantity. Those over the ground feel a current; u v w and udot .. rdot are of the motion in the water.
QUANTITIES = {name: Quantity(name, over_ground=name in ("x", "y")) for name in (*STATES, *ACCELERATIONS)}
QUANTITIES |= {"depth": Quantity("z"), "heading": Quantity("psi")}
QUANTITIES |= {name: Quantity(name, over_ground=name in velocity.OVER_GROUND) for name in velocity.QUANTITIES}
QUANTITIES |= {f"{name}_ground": Quantity(name, over_ground=True) for name in "uvw"}

_VALID = [column for column, (name, _) in COLUMNS.items() if name in QUANTITIES]


def channel_name(quantity: str) -> str:
    """The name of a channel: the column of its quantity without the unit, such as ``yaw`` or ``u_ground``."""
    return HEADERS[quantity].rpartition("_")[0]


_Make = TypeVar("_Make", bound=Callable[..., Any])


def register(make: _Make) -> _Make:
    """Let study files have a function or class that gives sensors, under its name in small letters.

    Its arguments are the keys of a ``[[sensors]]`` of that kind; all have types, which the values of keys must be of.
    """
    KINDS[make.__name__.lower()] = make
    return make


@dataclass(frozen=True)
class Sensor:
    """Readings of one quantity.

    A reading is ``round(truth + noise + bias)``: first the noise, then the bias, then the rounding. The noise is
    normal; with probability `outlier_probability` it is that of an outlier, `outlier_scale` times as large. Readings go
    missing one by one with probability `dropout`, and all of them in the gaps. The record does not say where there was
    a bias, a dropout or an outlier: its channels hold the sd and the resolution only.
    """

    column: str  # the quantity with its unit, as in a record file: ``x_m``, ``yaw_deg``, ``u_mps``, ``depth_m``, ..
    sd: float = 0.0  # standard deviation of the noise, in the unit of the column
    resolution: float = 0.0  # rounding step in the unit of the column, 0 if there is none
    interval_s: float = 1.0  # one reading every so many seconds, the first after one interval
    times: tuple[float, ...] | None = None  # (n,) ascending times of the readings in s, instead of the interval
    bias: float = 0.0  # what is added to every reading, in the unit of the column
    dropout: float = 0.0  # probability that a reading is missing
    gaps: tuple[tuple[float, float], ...] = ()  # readings from start to end (s) are missing
    outlier_probability: float = 0.0  # probability that a reading is an outlier
    outlier_scale: float = 10.0  # its noise in units of the ordinary one
    # where the sensor is, ahead, to starboard and down from the body origin; None for the origin. It adds to position,
    # velocity and acceleration as on a rigid body (:mod:`bayesub.sensors.velocity`).
    lever_arm_m: tuple[float, float, float] | None = None
    # how far the clock of the sensor is ahead of that of the controls: a reading that a file stamps t was taken at t -
    # clock_offset_s
    clock_offset_s: float = 0.0
    # of a log of the speed through the water (``speed_through_water_mps``): ahead, to starboard and down, of any
    # length, along which it reads; None for the size of the horizontal velocity
    direction: tuple[float, float, float] | None = None
    # name of the instrument that it is part of, with which it shares the clock and the place; None if it is one by
    # itself, with the name of its channel
    instrument: str | None = None

    def __post_init__(self):
        if self.column not in _VALID:
            near = nearest(self.column, [HEADERS[quantity] for quantity in QUANTITIES])
            raise InputError(f"sensor: unknown quantity or unit '{self.column}'{near}", "unknown", self.column)
        for key in ("sd", "resolution"):
            if not (np.isfinite(getattr(self, key)) and getattr(self, key) >= 0):
                raise self._refused(key, f"must not be negative, found {getattr(self, key)}")
        if self.sd == 0 and self.resolution == 0:
            raise self._refused("sd", "and resolution are both zero; give the noise sd, the rounding step or both")
        if not np.isfinite(self.bias):
            raise self._refused("bias", f"must be finite, found {self.bias}")
        for key in ("dropout", "outlier_probability"):
            if not 0 <= getattr(self, key) < 1:
                raise self._refused(key, f"must lie between 0 and 1, 1 excluded, found {getattr(self, key)}")
        for key in ("interval_s", "outlier_scale"):
            if not (np.isfinite(getattr(self, key)) and getattr(self, key) > 0):
                raise self._refused(key, f"must be positive, found {getattr(self, key)}")
        if self.outlier_probability and self.sd == 0:
            raise self._refused("sd", "are multiples of the noise; give an sd", "missing", about="outliers")
        if self.lever_arm_m is not None and not (len(self.lever_arm_m) == 3 and np.isfinite(self.lever_arm_m).all()):
            raise self._refused("lever_arm_m", f"must be three finite numbers, found {tuple(self.lever_arm_m)}")
        if not np.isfinite(self.clock_offset_s):
            raise self._refused("clock_offset_s", f"must be finite, found {self.clock_offset_s}")
        if self.direction is not None:
            if self.quantity != "stw":
                raise self._refused("direction", "is for speed_through_water_mps; leave it out", "conflict")
            if not (len(self.direction) == 3 and np.isfinite(self.direction).all() and any(self.direction)):
                raise self._refused("direction", f"must be three finite numbers, not all zero, found {self.direction}")
        if self.instrument is not None and not re.fullmatch("[A-Za-z0-9_]+", self.instrument):
            raise self._refused("instrument", f"is a name of letters, digits and _, found '{self.instrument}'")
        for gap in self.gaps:
            if not (len(gap) == 2 and gap[0] <= gap[1]):
                text = f"must be a start and a later end in seconds, found {tuple(gap)}"
                raise self._refused("gaps", text, about="a gap")
        if self.times is not None and not (len(self.times) and np.all(np.diff(self.times) > 0)):
            raise self._refused("times", "must be at least one and ascend")

    def _refused(self, key: str, reason: str, kind: str = "value", about: str = "") -> InputError:
        return InputError(f"sensor '{self.column}': {about or key} {reason}", kind, key)

    @property
    def quantity(self) -> str:
        """Short name of what is measured, a key of QUANTITIES."""
        return COLUMNS[self.column][0]

    @property
    def factor(self) -> float:
        """From the unit of the column to SI."""
        return si_factor(self.column)

    def reading_times(self, duration: float) -> np.ndarray:
        """(n,) times of the readings in a trial of `duration`, both in s, missing ones included."""
        if self.times is None:
            if not duration / self.interval_s <= MAX_READINGS:
                reason = f"{self.interval_s:g} gives more than {MAX_READINGS:,} readings"
                raise self._refused("interval_s", reason, "limit")
            times = self.interval_s * np.arange(1, int(duration / self.interval_s * (1 + 1e-12)) + 1)
            if not times.size:
                raise self._refused("interval_s", f"{self.interval_s:g} is longer than the manoeuvre, {duration:g} s")
            return times
        times = np.array(self.times, dtype=float)
        outside = times[~((times >= 0) & (times <= duration * (1 + 1e-12)))]
        if outside.size:
            reason = f"{outside[0]:g} s is outside the manoeuvre, 0 to {duration:g} s"
            raise self._refused("times", reason, about="time")
        return times

    def read(
        self, times: np.ndarray, truth: np.ndarray, rng: np.random.Generator | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Times and values of the readings of `truth` (n,) at `times` (n,), in SI units, missing ones left out.

        Without an `rng` they are the truth itself.
        """
        if rng is None:
            return times, truth.copy()
        noise = self.sd * self.factor * rng.standard_normal(len(times))
        if self.outlier_probability:
            noise[rng.random(len(times)) < self.outlier_probability] *= self.outlier_scale
        values = truth + noise + self.bias * self.factor
        values = rounded(values, self.resolution * self.factor)
        present = np.ones(len(times), dtype=bool)
        if self.dropout:
            present &= rng.random(len(times)) >= self.dropout
        for start, end in self.gaps:
            present &= (times < start) | (times > end)
        if not present.any():
            reason = "is left; shorten the gaps or lower the dropout"
            raise self._refused(self.column, reason, "data", about="no reading")
        return times[present], values[present]


def rounded(values: np.ndarray, step: float) -> np.ndarray:
    """The nearest multiples of `step`, or the values themselves if that is zero."""
    return step * np.round(values / step) if step else values


def flat(sensors: Sensor | Iterable) -> tuple[Sensor, ...]:
    """The sensors of a sensor, an instrument, or a sequence of such and of sequences, in order.

    Raises InputError if there is none, or if two read the same quantity.
    """
    sensors = tuple(_each(sensors))
    if not sensors:
        raise InputError("there is no sensor; name at least one", "missing", "sensors")
    names = [channel_name(sensor.quantity) for sensor in sensors]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"two sensors make a channel '{name}'; leave one of them out", "conflict", name)
    return sensors


def _each(sensors) -> Iterable[Sensor]:
    if isinstance(sensors, Sensor):
        yield sensors
        return
    if isinstance(sensors, str) or not isinstance(sensors, Iterable):
        message = f"a sensor, an instrument or a sequence of them was expected, found {sensors!r}"
        raise InputError(message, "value", "sensors")
    for part in sensors:
        yield from _each(part)


def modified(sensors: Sensor | Iterable, channels: Iterable[str] | None = None, **changes: Any) -> tuple[Sensor, ...]:
    """Sensors with other settings, such as ``modified(DVL(0.005), dropout=0.1, gaps=[(60, 90)])``.

    `sensors` are whatever :func:`observe` takes. The `changes` are attributes of :class:`Sensor`, for the named
    `channels`, such as ``["u_ground"]``; by default for all.
    """
    sensors = flat(sensors)
    names = [channel_name(sensor.quantity) for sensor in sensors]
    channels = names if channels is None else tuple(channels)
    for channel in channels:
        check_known(channel, names, f"sensor: unknown channel '{channel}'")
    pairs = zip(names, sensors, strict=True)
    return tuple(replace(sensor, **changes) if name in channels else sensor for name, sensor in pairs)
