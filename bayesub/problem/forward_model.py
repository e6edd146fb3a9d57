"""From parameters to noise-free readings, and their derivatives: one vehicle, manoeuvre and record."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bayesub.kernels.workspace import HATS
from bayesub.logs import log_files
from bayesub.model.dense_output import DenseOutput
from bayesub.model.disturbance import CURRENTS as WATER
from bayesub.model.disturbance import ForceHistory
from bayesub.model.equations import AXES
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.simulator import STATUS, Pieces, Simulator
from bayesub.model.trajectory import Trajectory
from bayesub.model.vehicles import Vehicle
from bayesub.problem.base import Costs
from bayesub.problem.disturbances import Disturbances
from bayesub.problem.mounting import Mounting
from bayesub.problem.nuisance import CURRENTS, ON_READINGS, Nuisance, Nuisances
from bayesub.sensors.current import Water, over_ground
from bayesub.sensors.measurement import Arms, MeasurementModel
from bayesub.sensors.record import Record

if TYPE_CHECKING:
    from bayesub.kernels.kalman import Policy
    from bayesub.kernels.steering import Steering


class Currents:
    """A constant current and one that varies, either of which may be missing.

    Disturbances may have histories of a current; `histories` are theirs among the nuisance parameters. Where no other
    times are given, the water is wanted at `times` (n_times,), s.
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
        """How the water moves, (n_batch, n_times, 2), or (n_times, 2) of a history alone; None without a current.

        Values are (n_batch, n_nuisances), and times (n_batch, n_times), s, if members have their own. The history of
        the current of one member is by default that of the values.
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
        """(n_readings, n_nuisances) derivatives of one member's readings by the parameters of a constant current.

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
        return slopes

    def pieces(
        self,
        measurement: MeasurementModel,
        outputs: np.ndarray,
        values: np.ndarray,
        times: np.ndarray,
        numbers: np.ndarray,
        bounds: np.ndarray,
        arms: Arms,
    ) -> tuple[np.ndarray, np.ndarray]:
        """The current between knots, as :meth:`ForwardModel.pieces` has it, of one member.

        Derivatives of the readings (n_readings, n_towards, 1 + HATS) and of the displacement at the end of each piece
        (n_pieces, n_towards, 1 + HATS), by the displacement at its start and by the currents at its knots. Outputs are
        (n_times, n_measured), times (n_times,), s, of pieces with these numbers; those end at the bounds (n_pieces,).
        """
        ends = np.concatenate([[0.0], bounds])
        knots = np.arange(len(bounds))[:, None] + np.arange(HATS)

        def local(weights, numbers):
            """(n, HATS) of weights (n, n_knots), of the knots of pieces (n,)."""
            padded = np.pad(weights, ((0, 0), (0, HATS)))
            return np.take_along_axis(padded, knots[numbers], axis=1)

        whole, every = self._knots.integration(ends), np.arange(len(bounds))
        since = local(self._knots.integration(times), numbers) - local(whole[numbers], numbers)
        velocity = local(self._knots.interpolation(times), numbers)
        one, none = np.ones((len(times), 1)), np.zeros((len(times), 1))
        weights = Water(np.hstack([none, velocity]), np.hstack([one, since]))
        water = self.water(values, times[None])
        rows = measurement.current_slopes(outputs, weights, None if water is None else water.member(0), arms)
        moved = np.hstack([np.ones((len(bounds), 1)), local(whole[1:], every) - local(whole[:-1], every)])
        return rows[:, self._towards], np.repeat(moved[:, None], len(self._towards), axis=1)


Given = dict[str, Any]  # arrays or None: what members have of their own, arguments of Simulator.run


class ReadingTimes:
    """The measured outputs of a simulator at the times of the readings, which differ by member with unknown clocks.

    The simulator has output at all times at which a channel reads, and the last readings may have been taken
    `latest_s` later than the record says.
    """

    def __init__(self, simulator: Simulator, measurement: MeasurementModel, mounting: Mounting, latest_s: float):
        self._simulator, self._measurement, self._mounting = simulator, measurement, mounting
        if mounting.clocks:
            end = min(max(simulator.times[-1] + latest_s, simulator.step), simulator.manoeuvre.duration)
            self._simulator, self._dense = simulator.at(np.array([end])), DenseOutput(simulator.step, end)

    def times(self, values: np.ndarray) -> np.ndarray | None:
        """(n_batch, n_times) of values (n_batch, n_nuisances), s; None if they are those of the simulator for all."""
        return self._mounting.times(self._measurement, values) if self._mounting.clocks else None

    def outputs(
        self, sets: np.ndarray, times: np.ndarray | None, given: Given, steering: "Steering | None" = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Outputs (n_batch, n_times, n_measured) in the water of coefficient sets, and status codes (n_batch,)."""
        run, measured = self._simulator.run, self._measurement.measured
        if times is None:
            return run(sets, **given, outputs=measured, steering=steering)
        pieces = self._dense.pieces(times)
        looked = np.unique(pieces)
        outputs, status = run(sets, **given, outputs=measured, times=self._dense.looks(looked), steering=steering)
        return self._dense.at(times, pieces, looked, outputs), status

    def steering(self, *arguments: Any) -> "Steering":
        """As :meth:`bayesub.model.simulator.Simulator.steering`."""
        return self._simulator.steering(*arguments)

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
        if not parameters:
            return np.zeros((len(self._measurement.times), len(measured), 0))
        if times is None:
            return derivatives(sets[0], parameters, measured, **member)
        pieces = self._dense.pieces(times)
        looked = np.unique(pieces)
        looks = derivatives(sets[0], parameters, measured, **member, times=self._dense.looks(looked))
        rows = self._dense.at(times, pieces, looked, looks.reshape(1, len(looks), -1))
        return rows.reshape(-1, *looks.shape[1:])

    def pieces(self, sets: np.ndarray, times: np.ndarray, given: Given) -> Pieces:
        """The motion of one member between the knots, its outputs at times (n_times,)."""
        member = {key: None if rows is None else rows[0] for key, rows in given.items()}
        ascending, places = np.unique(np.clip(times, 0.0, self._simulator.times[-1]), return_inverse=True)
        pieces = self._simulator.pieces(sets[0], self._measurement.measured, **member, times=ascending)
        return pieces._replace(outputs=pieces.outputs[places], numbers=pieces.numbers[places])

    def of_trajectory(self, trajectory: Trajectory, times: np.ndarray | None) -> np.ndarray:
        """(1, n_times, n_measured) outputs of a trajectory of one member."""
        if times is None:
            return trajectory.outputs(self._measurement.measured)
        within = np.clip(times[0], 0.0, trajectory.simulator.manoeuvre.duration)
        ascending, places = np.unique(within, return_inverse=True)
        return trajectory.resampled(ascending).outputs(self._measurement.measured)[:, places]


class ForwardModel:
    """What the channels of a record read, as a function of coefficient sets and nuisance parameters.

    Coefficient sets are (n_batch, n_terms), values of the nuisance parameters (n_batch, n_nuisances) in their own
    units. Nothing here is counted but by :meth:`count`, in the `costs` that all problems on this model
    share. The nuisance parameters are of :func:`bayesub.problem.nuisance.find`; `others` are positions of those that
    make no history of forces. The integration step `dt` is in s.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        manoeuvre: Manoeuvre,
        record: Record,
        parameters: Sequence[Nuisance],
        dt: float,
        disturbances: Disturbances | None = None,
    ):
        self.vehicle, self.manoeuvre, self.record = vehicle, manoeuvre, record
        water = None if disturbances is None else disturbances.knots.part(WATER)
        true = record.forces is not None and record.forces.of_current is not None
        current = true or water is not None or any(parameter.name in CURRENTS for parameter in parameters)
        mounts = {k: parameter.mount for k, parameter in enumerate(parameters) if parameter.mount is not None}
        self.mounting = Mounting(mounts, record.channels)
        clocks, moved = self.mounting.clocks, self.mounting.moved
        self.measurement = MeasurementModel(record.channels, current=current, clocks=clocks, moved=moved)
        self.nuisances = Nuisances(tuple(parameters), vehicle.restricted(manoeuvre.subproblem), manoeuvre)
        self._biases, self._scales = (self.nuisances.on_readings(of, record.channels) for of in ON_READINGS)
        self.disturbances: Any = disturbances
        self._histories, self.others = slice(0, 0), np.arange(len(self.nuisances))
        knots = None
        if disturbances is not None:
            first = self.nuisances.names.index(next(iter(disturbances.priors)))
            self._histories = slice(first, first + len(disturbances.priors))
            self.others = np.delete(self.others, self._histories)
            knots = disturbances.knots.part(AXES)
        times, varied = np.unique(self.measurement.times), self.nuisances.varied
        self.simulator = Simulator(vehicle, manoeuvre, times, dt=dt, varied=varied, knots=knots)
        self.currents = Currents(self.nuisances, disturbances, self._histories, times)
        latest = max((parameter.later_s[1] for parameter in parameters), default=0.0)
        self._readings = ReadingTimes(self.simulator, self.measurement, self.mounting, latest)
        self.costs = Costs(failures=dict.fromkeys(STATUS[1:], 0))

    def with_wide_process(self) -> "ForwardModel":
        """The same model, and the same counter, with a known and wide process of the disturbance."""
        names = self.disturbances.processes
        parameters = [parameter for parameter in self.nuisances.parameters if parameter.name not in names]
        return self._changed(self.record, parameters, self.disturbances.with_wide_process())

    def with_record(self, record: Record) -> "ForwardModel":
        """The same model, and the same counter, of a record with the same channels and other readings."""
        return self._changed(record, self.nuisances.parameters, self.disturbances)

    def _changed(self, record, parameters, disturbances) -> "ForwardModel":
        step = self.simulator.step
        model = ForwardModel(self.vehicle, self.manoeuvre, record, parameters, step, disturbances)
        model.costs = self.costs
        return model

    def count(self, status: np.ndarray) -> None:
        """Count simulations by their status codes (n_batch,)."""
        self.costs.simulations += len(status)
        for code, word in enumerate(STATUS[1:], start=1):
            self.costs.failures[word] += int(np.count_nonzero(status == code))

    def forces(self, values: np.ndarray) -> np.ndarray:
        """(n_batch, n_axes, n_knots) at the knots: forces, N and N m, and the current, m/s."""
        return self.disturbances.forces(values[:, self._histories])

    def history(self, values: np.ndarray) -> ForceHistory | None:
        """The forces of one member (1, n_nuisances), or None if there are none."""
        if self.disturbances is None:
            return None
        knots = self.disturbances.knots
        return ForceHistory(knots.times, knots.axes, self.forces(values)[0].T)

    def with_history(self, values: np.ndarray, forces: ForceHistory) -> np.ndarray:
        """Values (n_nuisances,) of the nuisance parameters whose forces are nearest to given ones."""
        values = values.copy()
        if self.disturbances is not None:
            values[self._histories] = self.disturbances.nearest(values[self._histories], forces)
        return values

    def _given(self, values: np.ndarray) -> Given:
        """What differs between members of a batch, as the simulator takes it."""
        amounts = self.nuisances.amounts(values)
        if self.simulator.knots is not None:
            forces = self.forces(values)[:, self.disturbances.members(AXES)].reshape(len(values), -1)
            amounts = forces if amounts is None else np.hstack([amounts, forces])
        return {"body": self.nuisances.body(values), "initial": self.nuisances.initial(values), "amounts": amounts}

    def predicted(self, sets: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Noise-free readings (n_batch, n_readings), SI units, and status codes (n_batch,).

        The readings are not a number where the simulation failed.
        """
        return self._flown(sets, values, None)[:2]

    def _flown(self, sets, values, steering, shocks=None):
        """Readings, status codes, and values whose white coordinates differ by shocks, or by those of a steering."""
        times = self._readings.times(values)
        with self.costs.timed():
            outputs, status = self._readings.outputs(sets, times, self._given(values), steering)
        shocks = steering.shocks if shocks is None and steering is not None else shocks
        if shocks is not None and len(shocks):
            values = values.copy()
            white = slice(self._histories.stop - shocks[0].size, self._histories.stop)
            values[:, white] += shocks.reshape(len(values), -1)
        predicted = self._read(outputs, values, times)
        predicted[status != 0] = np.nan
        return predicted, status, values

    def flown(
        self, sets: np.ndarray, values: np.ndarray, policy: "Policy | None"
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """:meth:`predicted`, the values with forces that follow a policy, and states seen (n_batch, n_pieces, n_moved).

        The states are those of the motion, at the ends of :meth:`pieces`.
        """
        axes = self.disturbances.unknown.axes
        if self.simulator.knots is None:  # a current alone, in which the motion is the same
            shocks = None if policy is None else policy.followed()
            seen = np.zeros((len(values), len(self.disturbances.knots.times) - 1, 0))
            return *self._flown(sets, values, None, shocks), seen
        steering = self._readings.steering(len(values), policy, self.disturbances.members(AXES), len(axes))
        return *self._flown(sets, values, steering), steering.seen

    def _read(self, outputs, values, times, history: ForceHistory | None = None) -> np.ndarray:
        """(n_batch, n_readings) of outputs (n_batch, n_times, n_measured) in the water, at own times or None."""
        water, arms = self.currents.water(values, times, history), self.mounting.arms(values)
        predicted = self.measurement.of(outputs, water, arms)
        for channel, k, _ in self._scales:
            predicted[:, self.measurement.slices[channel]] *= values[:, k : k + 1]
        for channel, k, factor in self._biases:
            predicted[:, self.measurement.slices[channel]] += factor * values[:, k : k + 1]
        return predicted

    def slopes(
        self, sets: np.ndarray, values: np.ndarray, names: Sequence[str], *, of_nuisances: bool = True
    ) -> np.ndarray:
        """Derivatives (n_readings, n_coefficients) of the readings of one member by coefficients, SI units.

        Sets are (1, n_terms) and values (1, n_nuisances). If asked, a column follows for each nuisance parameter that
        is not of a history.
        """
        moved, effects = self.nuisances.on_motion() if of_nuisances else ((), None)
        times, given, currents = self._readings.times(values), self._given(values), self.currents
        water = currents.water(values, times)
        water = None if water is None else water.member(0)
        arms = {instrument: arm for instrument, (arm,) in self.mounting.arms(values).items()}
        moving = water is not None or self.measurement.displaced or times is not None or self._scales
        outputs: Any = self._readings.outputs(sets, times, given)[0][0] if moving else None  # given where it is needed
        with self.costs.timed():
            sensitivities = self._readings.sensitivities(sets, times, given, (*names, *moved))
        slopes = self.measurement.slopes(sensitivities, outputs, water, arms)
        if not of_nuisances or not len(self.nuisances):
            return self._scaled(slopes, values)
        at: Any = None if times is None else times[0]
        assert effects is not None
        by_nuisances = currents.slopes(self.measurement, outputs, values, at, water, arms)
        if moved:
            by_nuisances[:, self.others] += slopes[:, len(names) :] @ effects[:, self.others]
        if arms:
            by_arm = self.measurement.arm_slopes(outputs, water, arms)
            self.mounting.add_by_place(by_nuisances, self.measurement, by_arm)
        if times is not None:
            rates, by_time = self._readings.rates(sets, times, given), currents.rates(values, at)
            late = self.measurement.time_slopes(rates, outputs, water, by_time, arms)
            self.mounting.add_by_clock(by_nuisances, self.measurement, late)
        self._scaled(by_nuisances, values)
        for channel, k, _ in self._scales:
            part = self.measurement.slices[channel]
            by_nuisances[part, k] += self.measurement.of(outputs[None], water, arms)[0, part]
        for channel, k, factor in self._biases:
            by_nuisances[self.measurement.slices[channel], k] += factor
        return np.hstack([self._scaled(slopes[:, : len(names)], values), by_nuisances[:, self.others]])

    def pieces(self, sets: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The readings of one member between the knots, linear in the state at the start of a piece and in its forces.

        Sets are (1, n_terms) and values (1, n_nuisances). States are those of the motion, and how far the water has
        moved in each direction in which a current varies; the columns are n_states, and axis after axis the forces at
        HATS knots. Given are derivatives of the state at the ends of pieces (n_pieces, n_states, n_columns), those of
        the readings (n_readings, n_columns), SI units, and the numbers (n_readings,) of the pieces in which these are.
        """
        own, given = self._readings.times(values), self._given(values)
        times = self.measurement.times if own is None else own[0]
        knots, axes = self.disturbances.knots, self.disturbances.unknown.axes
        arms = {instrument: arm for instrument, (arm,) in self.mounting.arms(values).items()}
        water = self.currents.water(values, own)
        outputs: Any = None
        if water is not None or self.measurement.displaced:
            outputs = self._readings.outputs(sets, own, given)[0][0]
        towards = [k for k, axis in enumerate(axes) if axis in WATER]
        forces, n_moved = [k for k, axis in enumerate(axes) if axis in AXES], 0
        with self.costs.timed():
            if forces:
                pieces = self._readings.pieces(sets, times, given)
                bounds, numbers, n_moved = pieces.bounds, pieces.numbers, pieces.ends.shape[1]
            else:
                bounds = knots.times[1:]
                numbers = np.minimum(np.searchsorted(bounds, times), len(bounds) - 1)
        n_states = n_moved + len(towards)
        n_columns = n_states + HATS * len(axes)
        ends, rows = np.zeros((len(bounds), n_states, n_columns)), np.zeros((self.measurement.n_readings, n_columns))

        def columns(of):
            return np.concatenate([n_states + HATS * k + np.arange(HATS) for k in of])

        if forces:
            own_columns = np.concatenate([np.arange(n_moved), columns(forces)])
            ends[:, :n_moved, own_columns] = pieces.ends
            member = None if water is None else water.member(0)
            rows[:, own_columns] = self.measurement.slopes(pieces.outputs, outputs, member, arms)
        if towards:
            by_current, moved = self.currents.pieces(self.measurement, outputs, values, times, numbers, bounds, arms)
            for n, k in enumerate(towards):
                of_one = np.concatenate([[n_moved + n], columns([k])])
                ends[:, n_moved + n, of_one], rows[:, of_one] = moved[:, n], by_current[:, n]
        return ends, self._scaled(rows, values), numbers[self.measurement.places]

    def _scaled(self, slopes, values):
        """Slopes (n_readings, n) of unscaled readings, made those of the readings of values (1, n_nuisances)."""
        for channel, k, _ in self._scales:
            slopes[self.measurement.slices[channel]] *= values[0, k]
        return slopes

    def states(self, sets: np.ndarray, values: np.ndarray) -> np.ndarray:
        """(n_batch, n_times, 12) states over the ground at the times of the readings."""
        states, _ = self.simulator.run(sets, **self._given(values), outputs=log_files.STATES)
        return self._over_ground(states, values)

    def _over_ground(self, states, values, history: ForceHistory | None = None) -> np.ndarray:
        water = self.currents.water(values, history=history)
        return states if water is None else over_ground(states, self.simulator.times, water)

    def disturbed(
        self, sets: np.ndarray, values: np.ndarray, forces: ForceHistory | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Noise-free readings (n_readings,) and states over the ground (n_times, 12) of one member under forces."""
        trajectory, times = self.trajectory(sets, values, forces), self._readings.times(values)
        current = None if forces is None else forces.of_current
        outputs = self._readings.of_trajectory(trajectory, times)
        (readings,) = self._read(outputs, values, times, current)
        return readings, self._over_ground(trajectory.states, values, current)[0]

    def trajectory(self, sets: np.ndarray, values: np.ndarray, forces: ForceHistory | None = None) -> Trajectory:
        """The motion through the water of one member, of its own body and start.

        Sets are (1, n_terms) and values (1, n_nuisances); forces that the equations leave out are by default theirs.
        """
        body, initial = self.nuisances.body(values), self.nuisances.initial(values)
        amounts = self.nuisances.amounts(values)
        forces = self.history(values) if forces is None else forces
        if body is None and initial is None and amounts is None and forces is None:
            return self.simulator.trajectory(sets)
        vehicle = self.simulator.vehicle if body is None else replace(self.simulator.vehicle, body=body[0])
        manoeuvre = self.manoeuvre if initial is None else replace(self.manoeuvre, initial_state=initial[0])
        changes = {} if amounts is None else dict(zip(self.nuisances.varied, amounts[0], strict=True))
        step, times = self.simulator.step, self.simulator.times
        return Simulator(vehicle, manoeuvre, times, dt=step, changes=changes, forces=forces).trajectory(sets)
