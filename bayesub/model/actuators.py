"""Actuators: from what a log has columns of to the controls of the equations and to forces from outside.

An actuator has a column in a log: a fin by its angle, a propeller by its revolutions, a thruster by its force. Fins are
mixed into the controls that the equations know (model manual, section 7); propellers and thrusters add a wrench. A
vehicle whose file has the plain table ``[actuators]`` has the controls of its equations themselves as actuators.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayesub.io.errors import InputError
from bayesub.logs.log_files import COLUMNS, si_factor
from bayesub.model.actuator import N_WEIGHTS, Actuator
from bayesub.model.equations import AXES, EquationSet
from bayesub.model.equations.equation_set import PLANES

AILERON = "aileron_deg"
COMMAND = "command"
NEGLIGIBLE = 1e-12  # round-off in a share of an order
Orders = dict[str, tuple[np.ndarray, np.ndarray]]  # column -> times (m,) in seconds, and orders (m,) in SI units


@dataclass(frozen=True)
class Actuators:
    """All actuators of a vehicle."""

    members: tuple[Actuator, ...]  # n_actuators of them
    equations: EquationSet  # whose controls they move
    direct: bool = False  # whether they are the controls of the equations themselves

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

    @cached_property
    def external(self) -> bool:
        """Whether any makes forces from outside of the equations."""
        return any(part.any() for part in self._unit_forces)

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
        if AILERON in columns and np.linalg.matrix_rank(matrix) < np.count_nonzero(matrix.any(axis=1)):
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
    def _unit_forces(self) -> tuple[np.ndarray, ...]:
        """Rows (6,) of forces by value, by its signed square, by its size and the speed; and rows (4,) of weights."""
        n, rows = len(self.members), [[a.force, a.force_of_square, a.force_of_speed] for a in self.members]
        weights = np.reshape([a.weight for a in self.members], (n, N_WEIGHTS))
        return *np.reshape(rows, (n, 3, len(AXES))).swapaxes(0, 1), weights

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

    def mixed(self, values: np.ndarray) -> np.ndarray:
        """Controls (n, n_controls) of the equations, SI units, for values (n, n_actuators)."""
        return values if self.direct else (values - self.zeros) @ self.mixing.T

    def wrenches(self, values: np.ndarray, subproblem: str | None) -> np.ndarray:
        """(n, 12) forces from outside X Y Z K M N, N and N m, and after them what of each goes with u (1 m/s).

        In a sub-problem those of other axes are zero.
        """
        by_value, by_square, by_speed, _ = self._unit_forces
        values = values - self.zeros
        steady = values @ by_value + (values * np.abs(values)) @ by_square
        wrenches = np.hstack([steady, np.abs(values) @ by_speed])
        axes = AXES if subproblem is None else PLANES[subproblem][0]
        return np.where([axis in axes for axis in AXES * 2], wrenches, 0.0)

    def weights(self, values: np.ndarray, subproblem: str | None) -> np.ndarray:
        """(n, 4) weight from outside, N, and its moments about the origin, N m (model manual, equations 3.7 to 3.9).

        In the horizontal sub-problem, in which weight is balanced, there are none; the vertical has those in its plane.
        """
        kept = {None: [True] * 4, "horizontal": [False] * 4, "vertical": [True, True, False, True]}[subproblem]
        return np.where(kept, (values - self.zeros) @ self._unit_forces[3], 0.0)

    def kernel_controls(self, values: np.ndarray, ordered_speed: np.ndarray, subproblem: str | None) -> np.ndarray:
        """What the kernels take as controls: (n, n_controls + 1) controls of the equations and n/k0.

        There are 16 more columns if there are forces from outside. `values` is (n, n_actuators), and `ordered_speed`
        (n,) n/k0 of [propulsion], m/s.
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

        InputError names the `source` of the order, if there is no such control and if no actuator moves it.
        """
        controls = [control.column for control in self.equations.controls]
        if column in self.columns and not (self.direct or column in controls):
            return np.eye(len(self.members))[self.columns.index(column)]
        if column not in controls and not self.direct:
            listed = ", ".join([*controls, *(other for other in self.columns if other not in controls)])
            raise InputError(f"{source}: there is no {column} to be ordered; the boat has {listed}", "unknown", column)
        share = self.allocation[:, self.equations.control(column, source)]
        if not share.any():
            text = f"{source}: no actuator can make the ordered {column}; they are {', '.join(self.columns)}"
            raise InputError(text, "model", column)
        return share

    def demands(self, orders: Orders, source: str) -> dict[int, tuple[np.ndarray, np.ndarray]]:
        """Position of each actuator that is moved -> times (m,) of its demands, s, and demands (m,)."""
        shares = [self.share(column, source) for column in orders]
        demands = {}
        for i in range(len(self.members)):
            both = zip(shares, orders.values(), strict=True)
            if parts := [(times, share[i] * ordered) for share, (times, ordered) in both if share[i] != 0.0]:
                times, demand = parts[0]
                if len(parts) > 1:  # each holds from its times on and is zero before
                    times = np.unique(np.concatenate([at for at, _ in parts]))
                    held = [np.append(0.0, own)[np.searchsorted(at, times, side="right")] for at, own in parts]
                    demand = np.sum(held, axis=0)
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
        water = dict.fromkeys(column for a in self.members if a.water is not None for column in a.water.columns)
        return (*self.columns, *commands, *water)


def with_commands(log: dict[str, np.ndarray], actuators: Actuators) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """A log with commands in place of the columns of actuators that it lacks, and the short names of these."""
    log, commanded = dict(log), []
    for actuator in actuators.members:
        command = log.pop(command_column(actuator.column), None)
        if command is not None and actuator.short not in log:
            log[actuator.short] = command
            commanded.append(actuator.short)
        elif actuator.commanded and actuator.short in log:
            commanded.append(actuator.short)
    return log, tuple(commanded)


def values_of_log(actuators: Actuators, log: dict[str, np.ndarray], n: int, source: str) -> np.ndarray:
    """Values (n, n_actuators) of the columns (n,) of a log by their names in memory; at rest those that it lacks.

    InputError names the `source`, for a column of an actuator that the vehicle does not have and that moves.
    """
    for name, history in log.items():
        if name in CONTROL_HEADERS and name not in actuators.shorts and np.any(np.nan_to_num(history) != 0.0):
            if actuators.direct:
                actuators.equations.control(CONTROL_HEADERS[name], source)
            fault = f"{source}: has {CONTROL_HEADERS[name]}, which the boat does not have"
            text = f"{fault}; it is moved by {', '.join(actuators.columns) or 'nothing'}"
            raise InputError(text, "unknown", CONTROL_HEADERS[name])
    columns = [log.get(actuator.short, np.full(n, actuator.rest)) for actuator in actuators.members]
    return np.column_stack(columns or [np.empty((n, 0))])


def command_column(column: str) -> str:
    """The column of a log for what is ordered of an actuator that has a column: ``rudder_command_deg``."""
    name, _, unit = column.rpartition("_")
    return f"{name}_{COMMAND}_{unit}"


# Names in memory of the controls that any log may have -> their columns.
CONTROL_HEADERS = {COLUMNS[column][0]: column for column in ("rudder_deg", "bow_plane_deg", "stern_plane_deg")}
