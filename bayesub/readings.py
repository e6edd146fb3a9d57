"""What the channels of a record would read of a simulated motion, and how that depends on the motion."""

import numpy as np

from bayesub import logs
from bayesub.sensors.current import carried, carried_slopes

_ATTITUDE = ("phi", "theta", "psi")


class Readings:
    """The readings of all channels of a record, one after the other.

    Attributes
    ----------
    times : (n_times,) s, all at which a channel reads, and outputs : the states and accelerations that are needed
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
        self.measured = tuple(dict.fromkeys([c.state for c in channels] + list(_ATTITUDE) * turned))
        self.outputs = logs.STATES if set(self.measured) <= set(logs.STATES) else logs.OUTPUTS
        self._rows = [np.searchsorted(self.times, channel.times) for channel in channels]
        self._position = self._positions(self.outputs)
        self._slope_position = self._positions(self.measured)

    def _positions(self, states):
        """Where each reading stands in `states` of all times, laid out in one row."""
        pairs = zip(self._rows, self.channels, strict=True)
        return np.concatenate([len(states) * rows + states.index(channel.state) for rows, channel in pairs])

    def of(self, states, currents=None) -> np.ndarray:
        """(n_batch, n_readings) readings without noise and bias of states (n_batch, n_times, 12 or 18) in the water.

        currents : (n_batch, 2) north and east, m/s, or None
        """
        predicted = states.reshape(len(states), -1).take(self._position, axis=1)
        for part, channel, attitude in self._in_current(states):
            parts = carried(channel.state, channel.times, attitude)
            predicted[:, part] += np.einsum("ijk,ik->ij", parts, currents)
        return predicted

    def slopes(self, sensitivities, states=None, current=None) -> np.ndarray:
        """(n_readings, n) derivatives of one member's readings, of the :attr:`measured` ones (n_times, n_measured, n).

        states : (n_times, 12 or 18), and current : (2,), if there is a current
        """
        slopes = sensitivities.reshape(-1, sensitivities.shape[-1])[self._slope_position]
        if current is not None:
            for part, channel, attitude in self._in_current(states[None]):
                if channel.state in "uvw":
                    turning = carried_slopes(channel.state, channel.times, attitude[0], current)
                    rows = np.searchsorted(self.times, channel.times)
                    columns = [self.measured.index(name) for name in _ATTITUDE]
                    slopes[part] += np.einsum("ik,ikn->in", turning, sensitivities[rows][:, columns])
        return slopes

    def current_slopes(self, states) -> np.ndarray:
        """(n_readings, 2) derivatives of one member's readings by the current to the north and to the east."""
        slopes = np.zeros((len(self.values), 2))
        for part, channel, attitude in self._in_current(states[None]):
            slopes[part] = carried(channel.state, channel.times, attitude[0])
        return slopes

    def _in_current(self, states):
        """Slice, channel and attitude (n_batch, n, 3) of each channel that feels a current."""
        for part, channel, rows, here in zip(self.slices, self.channels, self._rows, self.carried, strict=True):
            if here:
                yield part, channel, states[:, rows, 3:6]
