"""Clocks and places of instruments that are not known, as nuisance parameters.

- ``clock_dvl_s``: how far the clock of an instrument is ahead of that of the controls
  (:attr:`bayesub.sensors.Sensor.clock_offset_s`). A reading that is stamped t was taken at t minus it.
- ``lever_dvl_x_m``, ``_y_m``, ``_z_m``: where the instrument is, ahead, to starboard and down from the body origin
  (:attr:`bayesub.sensors.Sensor.lever_arm_m`).

An instrument has one clock and one place. The parameters are the whole offset and arm, instead of what sensors say.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesub.io.errors import InputError
from bayesub.logs.log_files import STATES
from bayesub.sensors.measurement import Arms, MeasurementModel
from bayesub.sensors.record import Channel, Record
from bayesub.sensors.velocity import QUANTITIES, TURNING

AXES = ("x", "y", "z")
_LEVER = "lever_"


@dataclass(frozen=True)
class Mount:
    """The instrument and the clock or lever arm that a parameter stands for."""

    instrument: str
    axis: str  # of its lever arm, x, y or z; empty for the clock
    value: float  # what the sensors say, s or m


def mounts(channels: Sequence[Channel]) -> dict[str, Mount]:
    """Name -> instrument and quantity, of every such parameter that these channels could have."""
    found = {}
    for instrument, members in _by_instrument(channels).items():
        found[f"clock_{instrument}_s"] = Mount(instrument, "", members[0].clock_offset_s)
        if any(_feels_place(channel) for channel in members):
            arm = zip(AXES, members[0].lever_arm_m, strict=True)
            found |= {f"{_LEVER}{instrument}_{axis}_m": Mount(instrument, axis, float(value)) for axis, value in arm}
    return found


def of_place(name: str) -> bool:
    """Whether a parameter is of a lever arm, which is the same in all trials."""
    return name.startswith(_LEVER)


def check(name: str, mount: Mount, channels: Sequence[Channel], moving: Sequence[str]) -> None:
    """Raise an InputError for a parameter without a part in a motion of which `moving` states change.

    And for an instrument whose channels are said to have different clocks or places.
    """
    members = _by_instrument(channels)[mount.instrument]
    members = [channel for channel in members if not mount.axis or _feels_place(channel)]
    key = "lever_arm_m" if mount.axis else "clock_offset_s"
    if len({getattr(channel, key) for channel in members}) > 1:
        names = ", ".join(channel.name for channel in members)
        text = f"nuisance '{name}': the channels {names} have different {key}; give the sensors an 'instrument' each"
        raise InputError(text, "conflict", name)
    if mount.axis:
        model = MeasurementModel(members, current=False, moved=(mount.instrument,))
        turning = [
            (output in STATES and output in moving) or output.removesuffix("dot") in moving for output in model.measured
        ]
        # Of any motion: what changes is somewhere, and what does not is zero.
        outputs = np.where(turning, np.linspace(0.3, 0.7, len(turning)), 0.0)
        arms = {mount.instrument: np.zeros(3)}
        slopes = model.arm_slopes(np.tile(outputs, (len(model.times), 1)), None, arms)
        if not slopes[:, AXES.index(mount.axis)].any():
            message = f"nuisance '{name}': none of its channels depends on it in this motion; leave it out"
            raise InputError(message, "conflict", name)


def within_reach(record: Record, spans: dict[str, tuple[float, float]], duration: float) -> Record:
    """The record without readings that may have been taken before the start of a trial or after its end.

    By `spans` (instrument -> least and most, s) readings may have been taken later than channels say; the trial takes
    `duration`, s. Raises InputError for a channel of which nothing is left.
    """
    channels = []
    for channel in record.channels:
        least, most = spans.get(channel.instrument, (0.0, 0.0))
        kept = (channel.times + least >= 0.0) & (channel.times + most <= duration)
        if channel.instrument in spans and not kept.any():
            text = f"nuisance 'clock_{channel.instrument}_s': its prior allows times {least:+.3g} to {most:+.3g} s "
            text += f"off, which leave no reading of '{channel.name}' within the {duration:g} s of the trial; narrow it"
            raise InputError(text, "conflict", f"clock_{channel.instrument}_s")
        if channel.instrument in spans and not kept.all():
            channel = replace(channel, times=channel.times[kept], values=channel.values[kept])
        channels.append(channel)
    return replace(record, channels=tuple(channels))


def _by_instrument(channels) -> dict[str, list[Channel]]:
    instruments: dict[str, list[Channel]] = {}
    for channel in channels:
        instruments.setdefault(channel.instrument, []).append(channel)
    return instruments


def _feels_place(channel) -> bool:
    return channel.state in TURNING or channel.state in QUANTITIES


class Mounting:
    """How the unknown clocks and lever arms of a problem act, given what is at positions among the nuisance parameters.

    By instrument, `clocks`: positions of unknown ones, `moved`: and numbers (0 to 2) of parts of unknown lever arms.
    """

    def __init__(self, members: dict[int, Mount], channels: Sequence[Channel]):
        self.clocks = {mount.instrument: k for k, mount in members.items() if not mount.axis}
        self.moved: dict[str, list[tuple[int, int]]] = {}
        for k, mount in members.items():
            if mount.axis:
                self.moved.setdefault(mount.instrument, []).append((k, AXES.index(mount.axis)))
        instruments = _by_instrument(channels)
        self._said = {instrument: instruments[instrument][0].clock_offset_s for instrument in self.clocks}
        self._arms = {
            instrument: np.array(next(c for c in instruments[instrument] if _feels_place(c)).lever_arm_m, dtype=float)
            for instrument in self.moved
        }

    def times(self, measurement: MeasurementModel, values: np.ndarray) -> np.ndarray:
        """(n_batch, n_times) when the readings were taken, s, of values (n_batch, n_nuisances)."""
        times = np.repeat(measurement.times[None], len(values), axis=0)
        for instrument, k in self.clocks.items():
            times[:, measurement.by_clock[instrument]] += self._said[instrument] - values[:, k : k + 1]
        return times

    def arms(self, values: np.ndarray) -> Arms:
        """Lever arms (n_batch, 3) of the instruments that have an unknown one, m."""
        arms = {instrument: np.repeat(arm[None], len(values), axis=0) for instrument, arm in self._arms.items()}
        for instrument, components in self.moved.items():
            for k, axis in components:
                arms[instrument][:, axis] = values[:, k]
        return arms

    def add_by_clock(self, slopes: np.ndarray, measurement: MeasurementModel, by_time: np.ndarray) -> None:
        """Add to slopes (n_readings, n_nuisances) those by clocks, of derivatives (n_readings,) by time."""
        for channel, own in zip(measurement.channels, measurement.slices, strict=True):
            if channel.instrument in self.clocks:
                slopes[own, self.clocks[channel.instrument]] -= by_time[own]

    def add_by_place(self, slopes: np.ndarray, measurement: MeasurementModel, by_arm: np.ndarray) -> None:
        """Add to slopes (n_readings, n_nuisances) those by lever arms, of derivatives (n_readings, 3) by these."""
        for channel, own in zip(measurement.channels, measurement.slices, strict=True):
            for k, axis in self.moved.get(channel.instrument, ()):
                slopes[own, k] += by_arm[own, axis]
