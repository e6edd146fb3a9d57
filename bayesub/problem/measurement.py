"""What the channels of a record would read of a simulated motion, and how that depends on the motion."""

import numpy as np

from bayesub.kernels.noise import gathered
from bayesub.sensors.current import carried, carried_slopes
from bayesub.sensors.lever_arm import TURNING, displaced, displaced_slopes

_ATTITUDE = ("phi", "theta", "psi")


class MeasurementModel:
    """The readings of all channels of a record, one after the other.

    Attributes
    ----------
    times : (n_times,) s, all at which a channel reads, and measured : the states and accelerations that are needed
    values, sds : (n_readings,) the measured values and their sd with rounding, SI units
    channels : those of the record, and slices : where each stands among the readings
    """

    def __init__(self, channels, *, current: bool):
        self.channels = channels
        self.times = np.unique(np.concatenate([channel.times for channel in channels]))
        lengths = [len(channel.times) for channel in channels]
        ends = np.cumsum(lengths)
        self.slices = [slice(end - n, end) for n, end in zip(lengths, ends, strict=True)]
        self.values = np.concatenate([channel.values for channel in channels])
        self.sds = np.repeat([channel.total_sd for channel in channels], lengths)
        self.carried = [c.over_ground and current for c in channels]
        turned = any(here and c.state in "uvw" for here, c in zip(self.carried, channels, strict=True))
        self.displaced = any(channel.displaced for channel in channels)
        turning = [name for channel in channels if channel.displaced for name in TURNING[channel.state]]
        self.measured = tuple(dict.fromkeys([c.state for c in channels] + list(_ATTITUDE) * turned + turning))
        self._attitude = [self.measured.index(name) for name in _ATTITUDE] if turned else []
        self._rows = [np.searchsorted(self.times, channel.times) for channel in channels]
        # Where each reading stands in the measured outputs of all times, laid out in one row.
        n = len(self.measured)
        pairs = zip(self._rows, channels, strict=True)
        self._position = np.concatenate([n * rows + self.measured.index(c.state) for rows, c in pairs])

    def of(self, outputs, currents=None) -> np.ndarray:
        """(n_batch, n_readings) noise-free readings of measured outputs (n_batch, n_times, n) in the water.

        currents : (n_batch, 2) north and east, m/s, or None
        """
        predicted = gathered(outputs.reshape(len(outputs), -1), self._position)
        for part, channel, _, attitude in self._in_current(outputs):
            parts = carried(channel.state, channel.times, attitude)
            predicted[:, part] += (parts @ currents[:, :, None])[..., 0]
        for part, channel, turning, _ in self._at_lever_arms(outputs):
            predicted[:, part] += displaced(channel.state, channel.lever_arm_m, turning)
        return predicted

    def slopes(self, sensitivities, outputs=None, current=None) -> np.ndarray:
        """(n_readings, n_params) derivatives of one member's readings, of the :attr:`measured` outputs.

        sensitivities : (n_times, n_measured, n_params)
        outputs : (n_times, n_measured), if there is a current or a lever arm, and current : (2,), if there is one
        """
        slopes = sensitivities.reshape(-1, sensitivities.shape[-1])[self._position]
        if current is not None:
            for part, channel, rows, attitude in self._in_current(outputs[None]):
                if channel.state in "uvw":
                    turning = carried_slopes(channel.state, channel.times, attitude[0], current)
                    slopes[part] += np.einsum("ik,ikn->in", turning, sensitivities[rows][:, self._attitude])
        if self.displaced:
            for part, channel, turning, places in self._at_lever_arms(outputs[None]):
                by_turning = displaced_slopes(channel.state, channel.lever_arm_m, turning[0])
                slopes[part] += np.einsum("ik,ikn->in", by_turning, sensitivities[places])
        return slopes

    def current_slopes(self, outputs) -> np.ndarray:
        """(n_readings, 2) derivatives of one member's readings by the current to the north and to the east."""
        slopes = np.zeros((len(self.values), 2))
        for part, channel, _, attitude in self._in_current(outputs[None]):
            slopes[part] = carried(channel.state, channel.times, attitude[0])
        return slopes

    def _in_current(self, outputs):
        """Slice, channel, rows among the times and attitude (n_batch, n, 3), which positions can do without, of each
        channel in a current.
        """
        for part, channel, rows, here in zip(self.slices, self.channels, self._rows, self.carried, strict=True):
            if here:
                attitude = (
                    outputs[:, rows][..., self._attitude] if channel.state in "uvw" else np.zeros((1, len(rows), 3))
                )
                yield part, channel, rows, attitude

    def _at_lever_arms(self, outputs):
        """Slice, channel, what turns the lever arm (n_batch, n, 3) and where that stands in (n_times, n_measured), of
        each channel that has one.
        """
        for part, channel, rows in zip(self.slices, self.channels, self._rows, strict=True):
            if channel.displaced:
                columns = [self.measured.index(name) for name in TURNING[channel.state]]
                places = np.ix_(rows, columns)
                yield part, channel, outputs[:, places[0], places[1]], places
