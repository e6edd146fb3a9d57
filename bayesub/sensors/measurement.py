"""What the channels of a record read of a motion without error and how that depends on the motion, and with errors.

This is the one place where a motion through the water becomes readings: it knows which channels feel the current
(:mod:`bayesub.sensors.current`), which have a lever arm (:mod:`bayesub.sensors.velocity`), and which know a heading
up to whole turns only. :func:`observe` asks it for the truth behind a record, and
:class:`bayesub.problem.problem.Problem` for predictions.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesub.io.arguments import checked
from bayesub.io.errors import InputError
from bayesub.logs.log_files import ANGLES, HEADERS, si_factor
from bayesub.model.trajectory import Trajectory
from bayesub.sensors import velocity
from bayesub.sensors.current import Water, seen, seen_slopes
from bayesub.sensors.instruments import Instrument
from bayesub.sensors.record import TURN, Channel, Record, channel_of
from bayesub.sensors.sensor import Sensor, flat
from bayesub.sensors.velocity import TURNING, displaced, displaced_slopes

Arms = Mapping[str, np.ndarray]  # instrument -> its lever arm (3,), or (n_batch, 3)
_KNOWN: Arms = {}


@dataclass(frozen=True)
class _Place:
    """Where a channel stands: among the readings, among all times, and its causes among the measured outputs."""

    channel: Channel
    part: slice  # of the readings
    rows: np.ndarray  # (n,) of the times
    columns: list[int]  # of the measured outputs: attitude of a velocity in a current, or what turns the lever arm

    def arm(self, arms: Arms) -> np.ndarray:
        """Its lever arm, (3,), or (n_batch, 1, 3) if members of a batch have their own."""
        arm = np.asarray(arms.get(self.channel.instrument, self.channel.lever_arm_m))
        return arm if arm.ndim == 1 else arm[:, None]

    def causes(self, outputs: np.ndarray) -> np.ndarray:
        """(n_batch, n, n_columns) of outputs (n_batch, n_times, n_measured)."""
        return outputs[:, self.rows][..., self.columns]


class MeasurementModel:
    """The noise-free readings of all channels of a record, one channel after the other.

    Derivatives are those of one member: its outputs are (n_times, n_measured), the water, of a model with a current, is
    of (n_times, 2) each, and the lever arms of instruments that are moved are (3,).

    Of the `channels` count the quantity, the times and the lever arm; their values need not be known yet. `current`
    says whether there is a current. Instruments in `clocks` have rows of times for themselves, because their clocks are
    not known; the lever arms of those in `moved` are not known.

    `times` (n_times,), s, are all times at which a channel reads, ascending, and after them those of instruments in
    `clocks`; `by_clock` is instrument in `clocks` -> its times. `measured` are short names of the states and
    accelerations that the readings depend on, n_measured of them. `slices` say where each channel stands among the
    `n_readings` readings of all, and `places` (n_readings,) where the time of each stands among the times. `displaced`
    is whether derivatives need the motion: of a lever arm that matters, and of velocities in inertial axes.
    """

    def __init__(
        self, channels: Sequence[Channel], *, current: bool, clocks: Collection[str] = (), moved: Collection[str] = ()
    ):
        self.channels = tuple(channels)
        rows = self._set_times(channels, clocks)
        lengths = [len(channel.times) for channel in channels]
        ends = np.cumsum(lengths)
        self.slices = [slice(end - n, end) for n, end in zip(lengths, ends, strict=True)]
        self.n_readings, self.places = int(ends[-1]), np.concatenate(rows)
        away = [any(c.lever_arm_m) or c.instrument in moved for c in channels]
        displaced_here = [far and c.state in TURNING for far, c in zip(away, channels, strict=True)]
        self.displaced = any(displaced_here) or any(c.state in velocity.QUANTITIES for c in channels)

        in_current = [current and channel.over_ground for channel in channels]
        turned = any(feels and c.state in "uvw" for feels, c in zip(in_current, channels, strict=True))
        turning = [name for far, c in zip(displaced_here, channels, strict=True) if far for name in TURNING[c.state]]
        causes = [velocity.causes(c.state, far) for far, c in zip(away, channels, strict=True)]
        states = [name for names in causes for name in names]
        self.measured = tuple(dict.fromkeys(states + list(ANGLES) * turned + turning))
        attitude = [self.measured.index(name) for name in ANGLES] if turned else []

        # Where each reading stands in the measured outputs of all times, laid out in one row.
        # A velocity in inertial axes is put in the place of the first of its causes.
        firsts = [self.measured.index(names[0]) for names in causes]
        n = len(self.measured)
        self._position = np.concatenate([n * at + first for at, first in zip(rows, firsts, strict=True)])
        self._in_current: list[_Place] = []
        self._velocities: list[_Place] = []
        self._at_lever_arms: list[_Place] = []
        for c, part, at, names, far, feels in zip(
            channels, self.slices, rows, causes, displaced_here, in_current, strict=True
        ):
            if c.state in velocity.QUANTITIES:
                self._velocities.append(_Place(c, part, at, [self.measured.index(name) for name in names]))
            elif feels:  # positions in a current do not depend on the attitude
                self._in_current.append(_Place(c, part, at, attitude if c.state in "uvw" else []))
            if far:
                self._at_lever_arms.append(_Place(c, part, at, [self.measured.index(n) for n in TURNING[c.state]]))
        self._wrapped = [part for c, part in zip(channels, self.slices, strict=True) if c.modulo_turn]

    def _set_times(self, channels, clocks) -> list[np.ndarray]:
        """All times, and where those of each channel stand among them."""
        own = [channel.instrument if channel.instrument in clocks else None for channel in channels]
        parts, first, self.by_clock = [], {}, {}
        for clock in sorted(set(own), key=lambda name: (name is not None, name)):
            parts.append(
                np.unique(np.concatenate([c.times for c, by in zip(channels, own, strict=True) if by == clock]))
            )
            first[clock] = sum(map(len, parts[:-1]))
            if clock is not None:
                self.by_clock[clock] = slice(first[clock], first[clock] + len(parts[-1]))
        of_clock = dict(zip(first, parts, strict=True))
        self.times = np.concatenate(parts)
        return [first[by] + np.searchsorted(of_clock[by], c.times) for c, by in zip(channels, own, strict=True)]

    def of(self, outputs: np.ndarray, water: Water | None = None, arms: Arms = _KNOWN) -> np.ndarray:
        """(n_batch, n_readings) noise-free readings, SI units.

        `outputs` (n_batch, n_times, n_measured): the :attr:`measured` ones in the water; `water`: of (n_batch, n_times,
        2) or (n_times, 2) each, for a model with a current; `arms`: lever arms of the instruments that are moved.
        """
        readings = outputs.reshape(len(outputs), -1).take(self._position, axis=1)
        if water is not None:
            for place, parts in self._seen(outputs):
                moved = water.behind(place.channel.state)[..., place.rows, :]
                readings[:, place.part] += np.sum(parts * moved, axis=-1)
        for place in self._at_lever_arms:
            readings[:, place.part] += displaced(place.channel.state, place.arm(arms), place.causes(outputs))
        for place in self._velocities:
            current = np.zeros(2) if water is None else water.velocity[..., place.rows, :]
            readings[:, place.part] = velocity.readings(*self._velocity(place, place.causes(outputs), current, arms))
        return readings

    @staticmethod
    def _velocity(place, motion, current, arms) -> tuple:
        """Arguments of :mod:`bayesub.sensors.velocity`."""
        return place.channel.state, motion, current, place.arm(arms), place.channel.direction

    def _velocity_slopes(self, outputs, water, arms) -> Iterator[tuple[_Place, np.ndarray, np.ndarray]]:
        """Each velocity in inertial axes with its derivatives by its causes (n, n_causes) and by the current (n, 2)."""
        for place in self._velocities:
            (motion,) = place.causes(outputs[None])
            current = np.zeros((len(motion), 2)) if water is None else water.velocity[place.rows]
            yield place, *velocity.slopes(*self._velocity(place, motion, current, arms))

    def to_nearest_turn(self, predicted: np.ndarray, readings: np.ndarray) -> None:
        """Move headings that are known up to whole turns, in place, to the turn that is nearest to the reading.

        A compass that reads 0.1 degrees after 359.9 has turned by 0.2 degrees, and a log does not say which way round
        a boat went between two readings. Residuals of such headings are therefore those modulo one turn. A prediction
        within half a turn of its reading stays the same to the last bit.

        `predicted` (n_batch, n_readings): what sensors would read, bias included, or nan; `readings` (n_readings,).
        """
        for part in self._wrapped:
            predicted[:, part] -= TURN * np.round((predicted[:, part] - readings[part]) / TURN)

    def slopes(
        self,
        sensitivities: np.ndarray,
        outputs: np.ndarray | None = None,
        water: Water | None = None,
        arms: Arms = _KNOWN,
    ) -> np.ndarray:
        """(n_readings, n_params) derivatives of the readings of one member.

        `sensitivities` (n_times, n_measured, n_params): derivatives of the :attr:`measured` outputs; the outputs
        themselves are needed if there is a current or a lever arm.
        """
        slopes = sensitivities.reshape(len(sensitivities) * sensitivities.shape[1], -1)[self._position]
        if outputs is None:
            return slopes
        if water is not None:
            for place in self._in_current:
                if place.columns:
                    (attitude,) = place.causes(outputs[None])
                    by_attitude = seen_slopes(place.channel.state, attitude, water.velocity[place.rows])
                    slopes[place.part] += self._chained(by_attitude, sensitivities, place)
        for place in self._at_lever_arms:
            (turning,) = place.causes(outputs[None])
            by_turning = displaced_slopes(place.channel.state, place.arm(arms), turning)
            slopes[place.part] += self._chained(by_turning, sensitivities, place)
        for place, by_motion, _ in self._velocity_slopes(outputs, water, arms):
            slopes[place.part] = self._chained(by_motion, sensitivities, place)
        return slopes

    @staticmethod
    def _chained(by_causes, sensitivities, place) -> np.ndarray:
        return np.einsum("ik,ikn->in", by_causes, sensitivities[place.rows][:, place.columns])

    def arm_slopes(self, outputs: np.ndarray, water: Water | None, arms: Arms) -> np.ndarray:
        """(n_readings, 3) derivatives of one member's readings by the lever arm of their own instrument.

        Those of instruments whose lever arms are known are zero.
        """
        slopes, units = np.zeros((self.n_readings, 3)), np.eye(3)[:, None]
        for place in self._at_lever_arms:
            if place.channel.instrument in arms:
                slopes[place.part] = displaced(place.channel.state, units, place.causes(outputs[None])).T
        for place, by_motion, _ in self._velocity_slopes(outputs, water, arms):
            if place.channel.instrument in arms:
                rates = place.causes(outputs[None])[..., 6:]
                added = np.stack(
                    [displaced(name, units, rates) for name in "uvw"]
                )  # (3, 3, n), by the lever arm second
                slopes[place.part] = np.einsum("nv,vkn->nk", by_motion[:, 3:6], added)
        return slopes

    def time_slopes(
        self, rates: np.ndarray, outputs: np.ndarray, water: Water | None, by_time: Water | None, arms: Arms
    ) -> np.ndarray:
        """(n_readings,) derivatives of one member's readings by the time at which they are taken.

        `rates` (n_times, n_measured) and `by_time`: derivatives of the outputs and of the water by time.
        """
        slopes = self.slopes(rates[..., None], outputs, water, arms)[:, 0]
        if by_time is None:
            return slopes
        return slopes + np.einsum("ijj->i", self.current_slopes(outputs, by_time, water, arms))

    def current_slopes(
        self, outputs: np.ndarray, by_current: Water, water: Water | None = None, arms: Arms = _KNOWN
    ) -> np.ndarray:
        """(n_readings, 2, n) derivatives of one member's readings by n parameters of the current to the north and east.

        `by_current`: derivatives (n_times, n) of the velocity and the displacement of the water, to the north or to the
        east; `water`: where it is, for speed and course over ground, which are not linear in it.
        """
        slopes = np.zeros((self.n_readings, 2, by_current.velocity.shape[1]))
        for place, (parts,) in self._seen(outputs[None]):
            moved = by_current.behind(place.channel.state)[place.rows]
            slopes[place.part] = parts[:, :, None] * moved[:, None, :]
        for place, _, parts in self._velocity_slopes(outputs, water, arms):
            slopes[place.part] = parts[:, :, None] * by_current.velocity[place.rows][:, None, :]
        return slopes

    def _seen(self, outputs) -> Iterator[tuple[_Place, np.ndarray]]:
        """Each channel in a current, with what (n_batch or 1, n, 2) it sees of the water to the north and east."""
        for place in self._in_current:
            attitude = place.causes(outputs) if place.columns else np.zeros((1, len(place.rows), 3))
            yield place, seen(place.channel.state, attitude)


@checked
def observe(
    trajectory: Trajectory,
    sensors: Sensor | Instrument | Iterable,
    rng: np.random.Generator | None,
    member: int = 0,
    current_mps: tuple[float, float] = (0.0, 0.0),
) -> Record:
    """Measure one member of a trajectory.

    InputError if the member failed, if the trial is shorter than the interval of a sensor or a time of a reading lies
    outside it, if two sensors make channels of one name, or if every reading of a sensor is missing.

    Parameters
    ----------
    sensors : a :class:`Sensor`, an instrument such as :class:`Track`, a preset, or a sequence of them
    rng : source of noise, outliers and dropouts, which are drawn sensor after sensor. None gives the truth itself as
        readings, which keep the sd of their sensor as their weight.
    current_mps : a constant current to north and east, besides that of the disturbance of the trajectory
    """
    if member not in range(len(trajectory.status)):
        text = f"member must be one of the {len(trajectory.status)} of the trajectory, from 0 on, found {member!r}"
        raise InputError(text, "value", "member")
    if trajectory.status[member] != "ok":
        raise InputError(f"a simulation that {trajectory.status[member]} cannot be measured", "model", "trajectory")
    if np.shape(current_mps) != (2,) or not np.isfinite(current_mps).all():
        text = f"current_mps must be two finite numbers, north and east, found {current_mps!r}"
        raise InputError(text, "value", "current_mps")
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
