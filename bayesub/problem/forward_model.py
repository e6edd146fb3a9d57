"""From parameters to noise-free readings, and their derivatives: one vehicle, manoeuvre and record."""

from dataclasses import replace

import numpy as np

from bayesub.io import log_files
from bayesub.model.disturbance import ForceHistory
from bayesub.model.simulate import STATUS, Simulator, Trajectory
from bayesub.problem.base import Costs
from bayesub.problem.nuisance import CURRENTS, Nuisances
from bayesub.sensors.current import over_ground
from bayesub.sensors.measurement import MeasurementModel


class ForwardModel:
    """What the channels of a record read, as a function of coefficient sets and nuisance parameters.

    Coefficient sets are (n_batch, n_terms), values of the nuisance parameters (n_batch, n_nuisances) in their own
    units. Nothing here is counted but by :meth:`count`.

    Parameters
    ----------
    vehicle, manoeuvre, record : as those of :class:`bayesub.problem.problem.Problem`
    parameters : the nuisance parameters, of :func:`bayesub.problem.nuisance.find`
    dt : integration step, s
    disturbance : forces with unknown histories, or None

    Attributes
    ----------
    measurement : what the channels read of a motion
    simulator : with output at all times at which a channel reads
    nuisances : how the nuisance parameters act
    disturbances : how those act that make a history of forces, or None
    costs : the counter that all problems on this model share
    """

    def __init__(self, vehicle, manoeuvre, record, parameters, dt, disturbances=None):
        self.vehicle, self.manoeuvre, self.record = vehicle, manoeuvre, record
        current = any(parameter.name in CURRENTS for parameter in parameters)
        self.measurement = MeasurementModel(record.channels, current=current)
        self.nuisances = Nuisances(tuple(parameters), vehicle.restricted(manoeuvre.subproblem), manoeuvre)
        self.disturbances = disturbances
        self._histories = slice(0, 0)
        knots = None
        if disturbances is not None:
            first = self.nuisances.names.index(next(iter(disturbances.priors)))
            self._histories, knots = slice(first, first + len(disturbances.priors)), disturbances.knots
        varied = self.nuisances.varied
        self.simulator = Simulator(vehicle, manoeuvre, self.measurement.times, dt=dt, varied=varied, knots=knots)
        self.costs = Costs(failures=dict.fromkeys(STATUS[1:], 0))

    def with_wide_process(self) -> "ForwardModel":
        """The same model, and the same counter, with a known and wide process of the disturbance."""
        names = self.disturbances.processes
        parameters = [parameter for parameter in self.nuisances.parameters if parameter.name not in names]
        disturbances = self.disturbances.with_wide_process()
        step = self.simulator.step
        model = ForwardModel(self.vehicle, self.manoeuvre, self.record, parameters, step, disturbances)
        model.costs = self.costs
        return model

    def count(self, status) -> None:
        """Count simulations by their status codes (n_batch,)."""
        self.costs.simulations += len(status)
        for code, word in enumerate(STATUS[1:], start=1):
            self.costs.failures[word] += int(np.count_nonzero(status == code))

    def forces(self, values) -> np.ndarray:
        """(n_batch, n_axes, n_knots) forces at the knots, N and N m."""
        return self.disturbances.forces(values[:, self._histories])

    def history(self, values) -> ForceHistory | None:
        """The forces of one member (1, n_nuisances), or None if there are none."""
        if self.disturbances is None:
            return None
        knots = self.simulator.knots
        return ForceHistory(knots.times, knots.axes, self.forces(values)[0].T)

    def with_history(self, values, forces: ForceHistory) -> np.ndarray:
        """Values (n_nuisances,) of the nuisance parameters whose forces are nearest to given ones."""
        values = values.copy()
        if self.disturbances is not None:
            values[self._histories] = self.disturbances.nearest(values[self._histories], forces)
        return values

    def _amounts(self, values):
        """(n_batch, n_varied) by how much what the simulator varies differs, or None if it varies nothing."""
        amounts = self.nuisances.amounts(values)
        if self.disturbances is None:
            return amounts
        forces = self.forces(values).reshape(len(values), -1)
        return forces if amounts is None else np.hstack([amounts, forces])

    def _run(self, sets, values, outputs):
        """Outputs (n_batch, n_times, n_outputs) in the water, and status codes (n_batch,)."""
        body, initial = self.nuisances.body(values), self.nuisances.initial(values)
        amounts = self._amounts(values)
        return self.simulator.run(sets, body=body, initial=initial, amounts=amounts, outputs=outputs)

    def predicted(self, sets, values) -> tuple[np.ndarray, np.ndarray]:
        """Noise-free readings (n_batch, n_readings), SI units, and status codes (n_batch,).

        The readings are not a number where the simulation failed.
        """
        outputs, status = self._run(sets, values, self.measurement.measured)
        predicted = self._read(outputs, values)
        predicted[status != 0] = np.nan
        return predicted, status

    def _read(self, outputs, values) -> np.ndarray:
        """(n_batch, n_readings) of outputs (n_batch, n_times, n_measured) in the water."""
        predicted = self.measurement.of(outputs, self.nuisances.currents(values))
        for channel, k, factor in self.nuisances.biases(self.record.channels):
            predicted[:, self.measurement.slices[channel]] += factor * values[:, k : k + 1]
        return predicted

    def slopes(self, sets, values, names, *, of_nuisances: bool = True) -> np.ndarray:
        """Derivatives of the readings of one member, SI units.

        Parameters
        ----------
        sets, values : (1, n_terms) and (1, n_nuisances)
        names : the n_coefficients coefficients to differentiate by
        of_nuisances : whether to differentiate by the nuisance parameters too

        Returns
        -------
        (n_readings, n_coefficients), followed by n_nuisances columns if asked
        """
        of = self.nuisances
        body, initial, amounts, current = (
            None if rows is None else rows[0]
            for rows in (of.body(values), of.initial(values), self._amounts(values), of.currents(values))
        )
        moved, effects = self._on_motion(values) if of_nuisances else ((), None)
        moving = current is not None or self.measurement.displaced
        outputs = self._run(sets, values, self.measurement.measured)[0][0] if moving else None
        sensitivities = self.simulator.sensitivities(
            sets[0], (*names, *moved), self.measurement.measured, body=body, initial=initial, amounts=amounts
        )
        slopes = self.measurement.slopes(sensitivities, outputs, current)
        if not of_nuisances or not len(self.nuisances):
            return slopes
        by_nuisances = np.zeros((len(slopes), len(self.nuisances)))
        if moved:
            by_nuisances += slopes[:, len(names) :] @ effects
        for k, towards in self.nuisances.current_columns():
            by_nuisances[:, k] += self.measurement.current_slopes(outputs)[:, towards]
        for channel, k, factor in self.nuisances.biases(self.record.channels):
            by_nuisances[self.measurement.slices[channel], k] += factor
        return np.hstack([slopes[:, : len(names)], by_nuisances])

    def _on_motion(self, values):
        """As :meth:`bayesub.problem.nuisance.Nuisances.on_motion`, with the forces at the knots."""
        moved, effects = self.nuisances.on_motion()
        if self.disturbances is None:
            return moved, effects
        parameters = self.simulator.knots.parameters
        of_forces = np.zeros((len(parameters), len(self.nuisances)))
        of_forces[:, self._histories] = self.disturbances.slopes(values[:, self._histories])
        return (*moved, *parameters), np.vstack([effects, of_forces])

    def states(self, sets, values) -> np.ndarray:
        """(n_batch, n_times, 12) states over the ground at the times of the readings."""
        states, _ = self._run(sets, values, log_files.STATES)
        return self._over_ground(states, values)

    def _over_ground(self, states, values) -> np.ndarray:
        currents = self.nuisances.currents(values)
        if currents is None:
            return states
        pairs = zip(states, currents, strict=True)
        return np.stack([over_ground(member, self.simulator.times, current) for member, current in pairs])

    def disturbed(self, sets, values, forces: ForceHistory | None) -> tuple[np.ndarray, np.ndarray]:
        """Noise-free readings (n_readings,) and states over the ground (n_times, 12) of one member under forces."""
        trajectory = self.trajectory(sets, values, forces)
        (readings,) = self._read(trajectory.outputs(self.measurement.measured), values)
        return readings, self._over_ground(trajectory.states, values)[0]

    def trajectory(self, sets, values, forces: ForceHistory | None = None) -> Trajectory:
        """The motion through the water of one member, of its own body and start.

        Parameters
        ----------
        sets : (1, n_terms) array
        values : (1, n_nuisances) array
        forces : ForceHistory, optional
            That the equations leave out; by default those of `values`.
        """
        body, initial = self.nuisances.body(values), self.nuisances.initial(values)
        amounts = self.nuisances.amounts(values)
        forces = self.history(values) if forces is None else forces
        if body is None and initial is None and amounts is None and forces is None:
            return self.simulator.trajectory(sets)
        vehicle = self.simulator.vehicle if body is None else replace(self.simulator.vehicle, body=body[0])
        manoeuvre = self.manoeuvre if initial is None else replace(self.manoeuvre, initial_state=initial[0])
        changes = {} if amounts is None else dict(zip(self.nuisances.varied, amounts[0], strict=True))
        options = {"dt": self.simulator.step, "changes": changes, "forces": forces}
        simulator = Simulator(vehicle, manoeuvre, self.simulator.times, **options)
        return simulator.trajectory(sets)
