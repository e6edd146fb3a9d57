"""Actuators: from what a log has columns of to the controls of the equations and to forces from outside.

An actuator has a column in a log: a fin by its angle, a propeller by its revolutions, a thruster by its force. Fins are
mixed into the controls that the equations know (model manual, section 7); propellers and thrusters add a wrench. A
vehicle whose file has the plain table ``[actuators]`` has the controls of its equations themselves as actuators.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayesub.io.errors import InputError, nearest
from bayesub.logs.log_files import COLUMNS, si_factor
from bayesub.model.actuator import N_WEIGHTS, Actuator, with_water
from bayesub.model.equations import AXES, EquationSet
from bayesub.model.equations.equation_set import PLANES

AILERON = "aileron_deg"
COMMAND = "command"
NEGLIGIBLE = 1e-12  # round-off in a share of an order
Orders = dict[str, tuple[np.ndarray, np.ndarray]]  # column -> times (m,) in seconds, and orders (m,) in SI units


@dataclass(frozen=True)
class Actuators:
    """All actuators of a vehicle.

    Attributes
    ----------
    members : tuple of Actuator
        n_actuators of them.
    equations : EquationSet
        Whose controls they move.
    direct : bool
        Whether they are the controls of the equations themselves.
    """

    members: tuple[Actuator, ...]
    equations: EquationSet
    direct: bool = False

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """Their columns of a log."""
        return tuple(actuator.column for actuator in self.members)

    @cached_property
    def shorts(self) -> tuple[str, ...]:
        """Names of their columns in memory."""
        return tuple(actuator.short for actuator in self.members)

    @cached_property
    def rest(self) -> np.ndarray:
        """(n_actuators,) values at rest."""
        return np.array([actuator.rest for actuator in self.members])

    @cached_property
    def zeros(self) -> np.ndarray:
        """(n_actuators,) values with which they do nothing."""
        return np.array([actuator.zero for actuator in self.members])

    def _from_zero(self, values):
        return values - self.zeros if self.zeros.any() else values

    @cached_property
    def external(self) -> bool:
        """Whether any makes forces from outside of the equations."""
        return bool(self._wrench.any() or self._weight.any())

    @cached_property
    def mixing(self) -> np.ndarray:
        """(n_controls, n_actuators) controls of the equations for unit values."""
        rows = [actuator.mixing for actuator in self.members]
        return np.reshape(rows, (len(rows), len(self.equations.controls))).T

    @cached_property
    def allocation(self) -> np.ndarray:
        """(n_actuators, n_controls) values that make unit controls: the pseudo-inverse of the mixing.

        Fins that cannot make all controls one by one leave the aileron to what it becomes.
        """
        matrix = self.mixing.copy()
        columns = [control.column for control in self.equations.controls]
        moved = matrix.any(axis=1)
        if AILERON in columns and np.linalg.matrix_rank(matrix) < np.count_nonzero(moved):
            matrix[columns.index(AILERON)] = 0.0
        if self.direct:
            return matrix.T
        allocation = np.linalg.pinv(matrix)
        return np.where(np.abs(allocation) < NEGLIGIBLE, 0.0, allocation)

    @cached_property
    def limits(self) -> np.ndarray:
        """(n_controls,) largest orders of single controls that every actuator can follow, SI units."""
        limits = np.array([actuator.limit for actuator in self.members])[:, None]
        with np.errstate(divide="ignore"):
            return np.min(limits / np.abs(self.allocation), axis=0, initial=np.inf)

    @cached_property
    def _wrench(self) -> np.ndarray:
        """(3, n_actuators, 6) forces by value, by its square with its sign, and by its size and the speed."""
        rows = [[a.force, a.force_of_square, a.force_of_speed] for a in self.members]
        return np.reshape(rows, (len(rows), 3, 6)).swapaxes(0, 1)

    @property
    def weigh(self) -> bool:
        """Whether any changes the weight or the buoyancy of the boat."""
        return bool(self._weight.any())

    @cached_property
    def _weight(self) -> np.ndarray:
        """(n_actuators, 4) weights and their moments of unit values."""
        return np.reshape([actuator.weight for actuator in self.members], (len(self.members), N_WEIGHTS))

    @cached_property
    def parameters(self) -> dict[str, tuple[int, str]]:
        """Name of what may be unknown of an actuator -> its position, and "bias", "scale", "delay" or "lag".

        What acts is ``scale * value + bias``, a delay (s) after the log has the value. A propeller has no bias; its
        scale is that of its forces. A lag (s) is between a command and the value.
        """
        parameters = {}
        for i, actuator in enumerate(self.members):
            if actuator.is_linear:
                parameters[f"bias_{actuator.name}_{actuator.unit}"] = (i, "bias")
            parameters[f"scale_{actuator.name}"] = (i, "scale")
            parameters[f"delay_{actuator.name}_s"] = (i, "delay")
            if actuator.rate is not None:
                parameters[f"lag_{actuator.name}_s"] = (i, "lag")
        return parameters

    def nominal(self, parameter: str) -> float:
        """The value of a parameter with which the log is what acts; of a lag that of the vehicle."""
        i, kind = self.parameters[parameter]
        return self.members[i].time_constant if kind == "lag" else {"bias": 0.0, "scale": 1.0, "delay": 0.0}[kind]

    def changes(self, values: Mapping[str, float]) -> dict[str, float]:
        """How much parameters of these values differ from their nominal ones; InputError for an unknown name."""
        for name in values:
            if name not in self.parameters:
                raise InputError(f"actuators: there is no '{name}'{nearest(name, self.parameters)}", "unknown", name)
        return {name: value - self.nominal(name) for name, value in values.items()}

    def mixed(self, values: np.ndarray) -> np.ndarray:
        """Controls (n, n_controls) of the equations, SI units, for values (n, n_actuators)."""
        return values if self.direct else self._from_zero(values) @ self.mixing.T

    def wrenches(self, values: np.ndarray, subproblem: str | None) -> np.ndarray:
        """(n, 12) forces from outside X Y Z K M N, N and N m, and after them what of each goes with u (1 m/s).

        In a sub-problem those of other axes are zero.
        """
        values = self._from_zero(values)
        steady = values @ self._wrench[0] + (values * np.abs(values)) @ self._wrench[1]
        wrenches = np.hstack([steady, np.abs(values) @ self._wrench[2]])
        axes = AXES if subproblem is None else PLANES[subproblem][0]
        return np.where([axis in axes for axis in AXES * 2], wrenches, 0.0)

    def weights(self, values: np.ndarray, subproblem: str | None) -> np.ndarray:
        """(n, 4) weight from outside, N, and its moments about the origin, N m (model manual, equations 3.7 to 3.9).

        In the horizontal sub-problem, in which weight is balanced, there are none; the vertical one keeps those in its
        plane.
        """
        kept = {"horizontal": [False] * 4, "vertical": [True, True, False, True]}.get(subproblem, [True] * 4)
        return np.where(kept, self._from_zero(values) @ self._weight, 0.0)

    def kernel_controls(self, values: np.ndarray, ordered_speed: np.ndarray, subproblem: str | None) -> np.ndarray:
        """What the kernels take as controls.

        Parameters
        ----------
        values : (n, n_actuators) array
        ordered_speed : (n,) array
            n/k0 of [propulsion], m/s.
        subproblem : str or None

        Returns
        -------
        (n, n_controls + 1) array
            Controls of the equations and n/k0; 16 more columns if there are forces from outside.
        """
        parts = [self.mixed(values), ordered_speed[:, None]]
        if self.external:
            parts += [self.wrenches(values, subproblem), self.weights(values, subproblem)]
        return np.hstack(parts)

    def variation(self, parameter: str, values: np.ndarray, subproblem: str | None) -> np.ndarray:
        """What a unit of a bias or scale adds to :meth:`kernel_controls` at values (n, n_actuators)."""
        i, kind = self.parameters[parameter]
        alone = np.zeros_like(values) + self.zeros
        alone[:, i] = self.zeros[i] + si_factor(self.members[i].column) if kind == "bias" else values[:, i]
        return self.kernel_controls(alone, np.zeros(len(values)), subproblem)

    def moves(self, parameter: str, subproblem: str | None) -> bool:
        """Whether a parameter has a part in a sub-problem."""
        actuator = self.members[self.parameters[parameter][0]]
        if subproblem is None:
            return True
        controls = [control.subproblem in (None, subproblem) for control in self.equations.controls]
        axes = [axis in PLANES[subproblem][0] for axis in AXES]
        forces = np.abs([actuator.force, actuator.force_of_square, actuator.force_of_speed]).sum(axis=0)
        weighs = subproblem == "vertical" and actuator.weight.any()
        return bool(actuator.mixing[controls].any() or forces[axes].any() or weighs)

    def share(self, column: str, source: str) -> np.ndarray:
        """(n_actuators,) what a unit order of a control of the equations, or of an actuator, asks of each.

        Raises
        ------
        InputError
            That names the `source` of the order, if there is no such control and if no actuator moves it.
        """
        controls = [control.column for control in self.equations.controls]
        if column in self.columns and not (self.direct or column in controls):
            return np.eye(len(self.members))[self.columns.index(column)]
        if column not in controls and not self.direct:
            listed = ", ".join([*controls, *(other for other in self.columns if other not in controls)])
            raise InputError(f"{source}: there is no {column} to be ordered; the boat has {listed}", "unknown", column)
        share = self.allocation[:, self.equations.control(column, source)]
        if not share.any():
            raise InputError(
                f"{source}: no actuator can make the ordered {column}; they are {', '.join(self.columns)}",
                "model",
                column,
            )
        return share

    def demands(self, orders: Orders, source: str) -> dict[int, tuple[np.ndarray, np.ndarray]]:
        """Position of each actuator that is moved -> times (m,) of its demands, s, and demands (m,)."""
        shares = [self.share(column, source) for column in orders]
        demands = {}
        for i in range(len(self.members)):
            parts = [
                (times, share[i] * ordered)
                for share, (times, ordered) in zip(shares, orders.values(), strict=True)
                if share[i] != 0.0
            ]
            if parts:
                times, demand = parts[0] if len(parts) == 1 else _sum(parts)
                demands[i] = times, demand + self.members[i].zero if self.members[i].zero else demand
        return demands

    def responses(self, times: np.ndarray, orders: Orders, source: str) -> np.ndarray:
        """Values (n, n_actuators) at times (n,): the answer to orders, from rest."""
        values = np.tile(self.rest, (len(times), 1))
        for i, (demand_times, demands) in self.demands(orders, source).items():
            values[:, i] = self.members[i].response(times, demand_times, demands)
        return values

    @cached_property
    def log_columns(self) -> tuple[str, ...]:
        """All columns that a log may have of them: their own, commands of those that have a lag, and of the water."""
        commands = (command_column(a.column) for a in self.members if a.rate is not None)
        return (*self.columns, *commands, *self.water_columns)

    def commanded(self, log: dict[str, np.ndarray]) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
        """A log with commands in place of the columns that it lacks, and the short names of these."""
        log, commanded = dict(log), []
        for actuator in self.members:
            command = log.pop(command_column(actuator.column), None)
            if command is not None and actuator.short not in log:
                log[actuator.short] = command
                commanded.append(actuator.short)
            elif actuator.commanded and actuator.short in log:
                commanded.append(actuator.short)
        return log, tuple(commanded)

    @property
    def water_columns(self) -> tuple[str, ...]:
        """Columns of a log from which those of actuators follow with the density of the water."""
        return tuple(dict.fromkeys(column for a in self.members if a.water is not None for column in a.water.columns))

    def with_water(self, log: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """A log with the columns of actuators in place of :attr:`water_columns`."""
        return with_water(log, {a.column: a.water for a in self.members if a.water is not None})

    def values(self, log: dict[str, np.ndarray], n: int, source: str) -> np.ndarray:
        """Values (n, n_actuators) of the columns (n,) of a log by their names in memory; at rest those that it lacks.

        Raises
        ------
        InputError
            That names the `source`, for a column of an actuator that the vehicle does not have and that moves.
        """
        for name, history in log.items():
            if name in CONTROL_HEADERS and name not in self.shorts and np.any(np.nan_to_num(history) != 0.0):
                if self.direct:
                    self.equations.control(CONTROL_HEADERS[name], source)
                raise InputError(
                    f"{source}: has {CONTROL_HEADERS[name]}, which the boat does not have; it is moved by "
                    f"{', '.join(self.columns) or 'nothing'}",
                    "unknown",
                    CONTROL_HEADERS[name],
                )
        columns = [log.get(actuator.short, np.full(n, actuator.rest)) for actuator in self.members]
        return np.column_stack(columns or [np.empty((n, 0))])


def command_column(column: str) -> str:
    """The column of a log for what is ordered of an actuator that has a column: ``rudder_command_deg``."""
    name, _, unit = column.rpartition("_")
    return f"{name}_{COMMAND}_{unit}"


# Names in memory of the controls that any log may have -> their columns.
CONTROL_HEADERS = {COLUMNS[column][0]: column for column in ("rudder_deg", "bow_plane_deg", "stern_plane_deg")}


def _sum(parts: Sequence[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """The sum of demands that hold from their times on and are zero before."""
    times = np.unique(np.concatenate([at for at, _ in parts]))
    held = (np.append(0.0, demands)[np.searchsorted(at, times, side="right")] for at, demands in parts)
    return times, np.sum(list(held), axis=0)
