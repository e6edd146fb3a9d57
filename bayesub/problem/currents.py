"""How the water moves as a function of the nuisance parameters, and what readings change with these through it."""

from typing import Any

import numpy as np

from bayesub.model.disturbance import CURRENTS as WATER
from bayesub.model.disturbance import ForceHistory
from bayesub.problem.disturbances import Disturbances
from bayesub.problem.nuisance import Nuisances
from bayesub.sensors.current import Water
from bayesub.sensors.measurement import Arms, MeasurementModel


class Currents:
    """A constant current and one that varies, either of which may be missing.

    Parameters
    ----------
    disturbances : with histories of a current, perhaps
    histories : of the nuisance parameters, those of the disturbances
    times : (n_times,) at which the water is wanted where no others are given, s
    """

    def __init__(self, nuisances: Nuisances, disturbances: Disturbances | None, histories: slice, times: np.ndarray):
        self._nuisances, self._histories, self._times = nuisances, histories, times
        self._disturbances: Any = disturbances  # not None where there are knots
        self._knots: Any = None if disturbances is None else disturbances.knots.part(WATER)
        self._weights: Any = None if self._knots is None else self._at(times)

    def _at(self, times: np.ndarray) -> Water:
        """Derivatives (n_times, n_knots) of how the water moves by the currents at the knots."""
        return Water(self._knots.interpolation(times), self._knots.integration(times))

    def _at_knots(self, values) -> np.ndarray:
        """(n_batch, 2, n_knots) to the north and to the east, m/s."""
        knots = np.zeros((len(values), len(WATER), len(self._knots.times)))
        forces = self._disturbances.forces(values[:, self._histories])
        knots[:, self._towards] = forces[:, self._disturbances.members(WATER)]
        return knots

    @property
    def _towards(self) -> list[int]:
        """0 for north or 1 for east, of each axis of the disturbance that is a current."""
        return [WATER.index(axis) for axis in self._disturbances.unknown.axes if axis in WATER]

    def water(
        self, values: np.ndarray, times: np.ndarray | None = None, history: ForceHistory | None = None
    ) -> Water | None:
        """How the water moves; None without a current.

        Of (n_batch, n_times, 2) each, or (n_times, 2) of a history alone.

        Parameters
        ----------
        values : (n_batch, n_nuisances)
        times : (n_batch, n_times), s, if members have their own
        history : of the current of one member, by default that of the values
        """
        currents = self._nuisances.currents(values)
        steady = None if currents is None else Water.steady(currents, self._times if times is None else times)
        if history is not None:
            varying = Water.varying(history, self._times if times is None else times[0])
        elif self._knots is None:
            return steady
        else:
            knots, weights, axes = self._at_knots(values), self._weights, "tk"
            if times is not None:
                each = [self._at(own) for own in times]
                weights = Water(np.stack([w.velocity for w in each]), np.stack([w.displacement for w in each]))
                axes = "btk"
            parts = weights.velocity, weights.displacement
            varying = Water(*(np.einsum(f"{axes},bak->bta", part, knots) for part in parts))
        return varying if steady is None else steady + varying

    def rates(self, values: np.ndarray, times: np.ndarray) -> Water | None:
        """Derivatives (n_times, 2) by time of how the water moves at times (n_times,), of one member."""
        water = self.water(values, times[None])
        if water is None:
            return None
        velocity = np.zeros((len(times), 2))
        if self._knots is not None:
            velocity = self._knots.differentiation(times) @ self._at_knots(values)[0].T
        return Water(velocity, water.velocity[0])

    def slopes(
        self,
        measurement: MeasurementModel,
        outputs: np.ndarray,
        values: np.ndarray,
        times: np.ndarray | None,
        water: Water | None,
        arms: Arms,
    ) -> np.ndarray:
        """(n_readings, n_nuisances) derivatives of one member's readings by the parameters of the current.

        Outputs are (n_times, n_measured), values (1, n_nuisances), and times (n_times,), s, if not those of all; water
        and arms are as of :meth:`bayesub.sensors.measurement.MeasurementModel.slopes`.
        """
        slopes = np.zeros((measurement.n_readings, values.shape[1]))
        at = self._times if times is None else times
        if columns := self._nuisances.current_columns():
            steady = Water(np.ones((len(at), 1)), at[:, None])
            by_steady = measurement.current_slopes(outputs, steady, water, arms)
            for k, towards in columns:
                slopes[:, k] += by_steady[:, towards, 0]
        if self._knots is not None:
            weights = self._weights if times is None else self._at(times)
            by_knots = measurement.current_slopes(outputs, weights, water, arms)[:, self._towards]
            histories = self._disturbances.slopes(values[:, self._histories])[self._disturbances.members(WATER)]
            slopes[:, self._histories] += by_knots.reshape(len(slopes), -1) @ histories.reshape(-1, histories.shape[-1])
        return slopes
