"""When readings were taken and what the boat did then, where clocks of instruments may not be known."""

import numpy as np

from bayesub.model.dense_output import DenseOutput
from bayesub.model.simulator import Simulator
from bayesub.model.trajectory import Trajectory
from bayesub.problem.mounting import Mounting
from bayesub.sensors.measurement import MeasurementModel

Given = dict[str, np.ndarray | None]  # what members have of their own, arguments of Simulator.run


class ReadingTimes:
    """The measured outputs of a simulator at the times of the readings, which differ by member with unknown clocks.

    Parameters
    ----------
    simulator : Simulator
        With output at all times at which a channel reads.
    measurement : MeasurementModel
    mounting : Mounting
    latest_s : float
        How much later than the record says the last readings may have been taken.
    """

    def __init__(self, simulator: Simulator, measurement: MeasurementModel, mounting: Mounting, latest_s: float):
        self._simulator, self._measurement, self._mounting = simulator, measurement, mounting
        if mounting.clocks:
            end = min(max(simulator.times[-1] + latest_s, simulator.step), simulator.manoeuvre.duration)
            self._simulator, self._dense = simulator.at(np.array([end])), DenseOutput(simulator.step, end)

    def times(self, values: np.ndarray) -> np.ndarray | None:
        """(n_batch, n_times) of values (n_batch, n_nuisances), s; None if they are those of the simulator for all."""
        return self._mounting.times(self._measurement, values) if self._mounting.clocks else None

    def outputs(self, sets: np.ndarray, times: np.ndarray | None, given: Given) -> tuple[np.ndarray, np.ndarray]:
        """Outputs (n_batch, n_times, n_measured) in the water of coefficient sets, and status codes (n_batch,)."""
        run, measured = self._simulator.run, self._measurement.measured
        if times is None:
            return run(sets, **given, outputs=measured)
        pieces = self._dense.pieces(times)
        looked = np.unique(pieces)
        outputs, status = run(sets, **given, outputs=measured, times=self._dense.looks(looked))
        return self._dense.at(times, pieces, looked, outputs), status

    def rates(self, sets: np.ndarray, times: np.ndarray, given: Given) -> np.ndarray:
        """(n_times, n_measured) derivatives of the outputs of one member by time."""
        pieces = self._dense.pieces(times)
        looked, measured = np.unique(pieces), self._measurement.measured
        outputs, _ = self._simulator.run(sets, **given, outputs=measured, times=self._dense.looks(looked))
        return self._dense.at(times, pieces, looked, outputs, rates=True)[0]

    def sensitivities(
        self, sets: np.ndarray, times: np.ndarray | None, given: Given, parameters: tuple[str, ...]
    ) -> np.ndarray:
        """(n_times, n_measured, n_parameters) derivatives of the outputs of one member by what moves the boat."""
        member = {key: None if rows is None else rows[0] for key, rows in given.items()}
        derivatives, measured = self._simulator.sensitivities, self._measurement.measured
        if times is None:
            return derivatives(sets[0], parameters, measured, **member)
        pieces = self._dense.pieces(times)
        looked = np.unique(pieces)
        looks = derivatives(sets[0], parameters, measured, **member, times=self._dense.looks(looked))
        rows = self._dense.at(times, pieces, looked, looks.reshape(1, len(looks), -1))
        return rows.reshape(-1, *looks.shape[1:])

    def of_trajectory(self, trajectory: Trajectory, times: np.ndarray | None) -> np.ndarray:
        """(1, n_times, n_measured) outputs of a trajectory of one member."""
        if times is None:
            return trajectory.outputs(self._measurement.measured)
        within = np.clip(times[0], 0.0, trajectory.simulator.manoeuvre.duration)
        ascending, places = np.unique(within, return_inverse=True)
        return trajectory.resampled(ascending).outputs(self._measurement.measured)[:, places]
